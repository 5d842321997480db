"""Options of a vehicle: coupling, extra outputs, further stations, noise colour, wind, interpolation."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from ascentwind.model.deprecation import warn_deprecated
from ascentwind.model.errors import DeprecatedNameWarning
from ascentwind.model.wind.statistics import report_standard_deviation
from ascentwind.runners import Cvodes, Study
from ascentwind.runners.solvers.covariance import covariance_equation

TIGHT = Cvodes(relative_tolerance=1e-9)


def test_full_coupling_has_one_symmetric_positive_mass_matrix(edit, as504):
    """The reaction changes the rigid rows, and the covariance equation agrees with the adjoint there too."""
    study = Study.load(edit("full_coupling = false", "full_coupling = true"))
    A, B = study.matrices(60.0)[0], as504.matrices(60.0)[0]
    names = study.system.state_names
    row, xi = names.index("lateral_velocity"), names.index("slosh_sic_lox")
    assert B[row, xi] == 0
    v = study.tables(60.0)
    stiffness = v["slosh.sic_lox.mass"] * v["slosh.sic_lox.frequency"] ** 2
    # to leading order the spring of the slosh mass pushes the vehicle: m Y'' = ... + m_S w^2 xi
    assert A[row, xi] == pytest.approx(stiffness / v["mass"], rel=0.6)
    found = study.response_statistics([40.0], engine=TIGHT)
    forward = covariance_equation(study.with_means, [40.0], 1e-9)
    np.testing.assert_allclose(found.variance.values[:, :, :3], forward.variance, rtol=1e-5)
    plain = as504.response_statistics([40.0], engine=TIGHT)
    wind = {"response": "bending_moment", "source": "wind", "time": 40}
    change = float(found.std.sel(wind) / plain.std.sel(wind)) - 1
    assert 1e-4 < abs(change) < 0.2


def test_changes_are_as_if_the_file_had_been_edited(edit):
    """Study.load(changes=...) is the edited file, for a nested key and an item of a list."""
    edit("full_coupling = false", "full_coupling = true")
    edited = Study.load(edit("[[bending]]\ndamping = 0.005", "[[bending]]\ndamping = 0.02"), compile=False)
    changes = {"options.full_coupling": True, "bending.0.damping": 0.02, "bending.1.damping": 0.02}
    changed = Study.load("as504", compile=False, changes=changes)
    np.testing.assert_array_equal(changed.matrices(60.0)[0], edited.matrices(60.0)[0])
    assert changed.parameters["bending.1.damping"].value == 0.02


def test_extra_outputs_are_what_their_names_say(edit, as504):
    """The third is the former name of q_alpha, which every vehicle has; it is said to go, once a process."""
    extra = '"lateral_drift", "drift_rate", "dynamic_pressure_times_angle_of_attack"'
    warn_deprecated.cache_clear()
    with pytest.warns(DeprecatedNameWarning, match="q_alpha"):
        study = Study.load(edit("extra_outputs = []", f"extra_outputs = [{extra}]"))
    found, plain = (s.response_statistics([50.0, 50.2], engine=TIGHT) for s in (study, as504))
    q = study.tables(50.0)["dynamic_pressure"]
    ratio = found.std.sel(response="dynamic_pressure_times_angle_of_attack", time=50) / found.std.sel(
        response="angle_of_attack", time=50
    )
    np.testing.assert_allclose(ratio, q, rtol=1e-6)
    former = found.std.sel(response="dynamic_pressure_times_angle_of_attack")
    np.testing.assert_array_equal(found.std.sel(response="q_alpha"), former)
    np.testing.assert_allclose(
        found.std.sel(response="bending_moment"), plain.std.sel(response="bending_moment"), rtol=1e-6
    )
    # drift is the integral of drift rate: the mean moves by rate times time
    drift = found.mean.sel(response="lateral_drift", source="wind").values
    rate = found.mean.sel(response="drift_rate", source="wind").values
    assert (drift[1] - drift[0]) / 0.2 == pytest.approx(rate.mean(), rel=1e-4)
    assert [str(u) for u in found["unit"].values[-3:]] == ["m", "m/s", "Pa rad"]


def test_further_stations_come_from_data(vehicle_folder, edit):
    """A second load table of half the size is a second output of half the size."""
    rows = (vehicle_folder / "loads_station_25m.csv").read_text().splitlines()
    halved = [",".join([c.split(",")[0], *(f"{float(x) / 2:.12g}" for x in c.split(",")[1:])]) for c in rows[3:]]
    (vehicle_folder / "loads_b.csv").write_text("\n".join([*rows[:3], *halved]) + "\n")
    entry = (
        '[[loads]]\noutput = "bending_moment_b"\nstation_m = 40.0\n'
        '[loads.table]\nfile = "loads_b.csv"\nstatus = "assumed"\nsource = "half of station 25"\n\n'
    )
    study = Study.load(
        edit("# Relative deviations of tables", entry + "# Relative deviations of tables"), compile=False
    )
    found = study.response_statistics([30.0], engine=TIGHT)
    np.testing.assert_allclose(
        2 * found.std.sel(response="bending_moment_b"), found.std.sel(response="bending_moment"), rtol=1e-6
    )


def test_fewer_modes_and_tanks_come_from_data(vehicle_folder):
    """A vehicle of one mode and no slosh, and the adjoint still meets the covariance equation."""
    import re

    toml = vehicle_folder / "vehicle.toml"
    text = toml.read_text()
    text = re.sub(r"\[\[slosh\]\].*?(?=\[\[loads\]\])", "", text, flags=re.DOTALL)
    second = text.index("[[bending]]", text.index("[[bending]]") + 1)
    text = text[:second] + text[text.index("[[loads]]") :]
    toml.write_text(text)
    for file, drop in (
        ("bending_1.csv", "_at_s"),
        ("loads_station_25m.csv", "slosh|bending_2|p_delta_2"),
        ("shear_station_25m.csv", "_2"),
    ):
        lines = (vehicle_folder / file).read_text().splitlines()
        start = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        keep = [i for i, c in enumerate(lines[start].split(",")) if not re.search(drop, c) or "sensor" in c]
        body = [",".join(line.split(",")[i] for i in keep) for line in lines[start:]]
        (vehicle_folder / file).write_text("\n".join(body) + "\n")
    study = Study.load(vehicle_folder, compile=False)
    assert len(study.system.states) == 3 + 11 + 2 + 3 + 2
    found = study.response_statistics([30.0], engine=TIGHT)
    forward = covariance_equation(study.with_means, [30.0], 1e-9)
    np.testing.assert_allclose(found.variance.values[:, :, :3], forward.variance, rtol=1e-5)


def test_report_sigma_is_an_option(edit, as504_closed_form):
    edit('synthesis = "fitted"', 'synthesis = "closed_form"')
    study = Study.load(edit('standard_deviation = "table"', 'standard_deviation = "cr103010_fit"'), compile=False)
    for s, sigma in ((study, float(report_standard_deviation(10000.0))), (as504_closed_form, 14.54)):
        assert s.vehicle is not None
        _, _, H = s.vehicle.wind.shaping_filter.at(10000.0)
        P = np.diag([1.0, 3.0, 1.0])
        assert np.sqrt(H @ P @ H) == pytest.approx(sigma, rel=1e-4)


def test_white_angle_of_attack_is_the_limit_of_short_correlation(vehicle_folder, tmp_path):
    """Coloured noise of sigma and tau has the intensity 2 tau sigma^2; for tau -> 0 it acts as white."""
    tau, folders = 0.002, []
    toml = (vehicle_folder / "vehicle.toml").read_text()
    before = "sigma = 0.01\ncorrelation_time_s = 1.0 "
    assert before in toml
    for name, after in (
        ("white", "sigma = 0.01\nwhite = true\n# "),
        ("short", f"sigma = {float(0.01 / np.sqrt(2 * tau))!r}\ncorrelation_time_s = {tau} "),
    ):
        folder = tmp_path / name
        shutil.copytree(vehicle_folder, folder)
        (folder / "vehicle.toml").write_text(toml.replace(before, after))
        folders.append(folder)
    white, short = (
        Study.load(f, compile=False).response_statistics([30.0], responses=["angle_of_attack", "engine_angle"])
        for f in folders
    )
    np.testing.assert_allclose(white.std.sel(source="thrust"), short.std.sel(source="thrust"), rtol=2e-3)
