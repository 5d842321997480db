"""A made-up vehicle whose planes differ: inertia, aerodynamics with a force at zero angle, control, one more mode."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.planes import flown_planes
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.runners import Study

FILE = 'status = "assumed"\nsource = "made up"\n'
SECTION = f"""
[pitch.tables.moment_of_inertia]
file = "pitch_inertia.csv"
{FILE}
[pitch.tables.aerodynamics]
file = "pitch_aerodynamics.csv"
{FILE}
"""


def unsymmetrical(folder: Path, zero_angle: float = 0.02) -> Path:
    """Give AS-504 a pitch plane of its own: a third more inertia, less normal force and some at zero angle."""
    inertia, aerodynamics = ["time [s],moment_of_inertia [kg m2]"], []
    for line in (folder / "rigid_body.csv").read_text().splitlines():
        if line[:1].isdigit():
            cells = line.split(",")
            inertia.append(f"{cells[0]},{1.33 * float(cells[2]):.9g}")
    (folder / "pitch_inertia.csv").write_text("\n".join(inertia) + "\n")
    for line in (folder / "aerodynamics.csv").read_text().splitlines():
        cells = line.split(",")
        if line.startswith("time"):
            aerodynamics.append(f"{line},normal_force_at_zero_angle [1]")
        elif line[:1].isdigit():
            aerodynamics.append(f"{cells[0]},{0.9 * float(cells[1]):.9g},{cells[2]},{zero_angle}")
    (folder / "pitch_aerodynamics.csv").write_text("\n".join(aerodynamics) + "\n")
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    control = text[text.index("[control]") : text.index("[[bending]]")].replace("[control", "[pitch.control")
    toml.write_text(text + SECTION + control.replace("[37.63,", "[30.0,", 1))
    return folder


def of_another_shape(folder: Path) -> Path:
    """Give that vehicle a pitch plane of one mode, without slosh, with loads that are 0.8 times the yaw's."""
    unsymmetrical(folder)
    for file, drop in (
        ("bending_1", "_at_s"),
        ("loads_station_25m", "slosh|bending_2|p_delta_2"),
        ("shear_station_25m", "_2"),
        ("local_loads_station_25m", "_2"),
    ):
        lines = [line for line in (folder / f"{file}.csv").read_text().splitlines() if not line.startswith("#")]
        names = lines[0].split(",")
        keep = [i for i, c in enumerate(names) if not re.search(drop, c) or "sensor" in c]
        factor = [1.0 if names[i].startswith("time") or "bending_1" in file else 0.8 for i in keep]
        body = [names] + [line.split(",") for line in lines[1:]]
        rows = [[row[i] for i in keep] for row in body]
        rows[1:] = [[f"{f * float(cell):.12g}" for f, cell in zip(factor, row, strict=True)] for row in rows[1:]]
        (folder / f"pitch_{file}.csv").write_text("\n".join(",".join(row) for row in rows) + "\n")
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    first = text.index("[[bending]]")
    mode = text[first : text.index("[[bending]]", first + 1)]
    loads = text[text.index("[[loads]]") : text.index("# Relative deviations of tables")]
    axial = loads.index("[loads.axial]")
    own = (mode + loads[:axial]).replace('file = "', 'file = "pitch_') + loads[axial:]
    own = own.replace("[[", "[[pitch.").replace("[bending.", "[pitch.bending.").replace("[loads.", "[pitch.loads.")
    toml.write_text("pitch.slosh = []\n" + text + own)
    return folder


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
def test_a_plane_may_have_modes_tanks_and_loads_of_its_own(vehicle_folder):
    """Fewer states in pitch, whose moment is 0.8 times that of a yaw plane with its numbers, and yaw as it was."""
    plain = Study.load(vehicle_folder, compile=False, changes={"planes": "yaw"})
    folder = of_another_shape(vehicle_folder)
    both = Study.load(folder, compile=False, changes={"planes": "both"})
    names = both.system.state_names
    assert [n for n in names if n.startswith("pitch_bending")] == ["pitch_bending_1", "pitch_bending_rate_1"]
    assert (
        not any(n.startswith("pitch_slosh") for n in names) and sum(n.startswith("yaw_slosh_rate") for n in names) == 4
    )
    assert {"pitch.bending.1.damping", "bending.2.damping"} <= set(both.system.parameter_names)
    yaw = [i for i, n in enumerate(plain.system.state_names) if not n.startswith(("wind", "deviation"))]
    same = [names.index(f"yaw_{plain.system.state_names[i]}") for i in yaw]
    pitch = [i for i, n in enumerate(names) if n.startswith("pitch_")]
    for time in (30.0, 75.0):
        found, alone = matrices(both, time), matrices(plain, time)
        scale = np.abs(alone["A"]).max()
        expected = alone["A"][np.ix_(yaw, yaw)]
        np.testing.assert_allclose(found["A"][np.ix_(same, same)], expected, rtol=1e-12, atol=1e-12 * scale)
        assert not found["A"][np.ix_(pitch, same)].any() and not found["A"][np.ix_(same, pitch)].any()
        # M'_beta of both planes, by the column of the actuator's first state
        row, other = (both.system.output_index(f"{plane}_bending_moment") for plane in ("pitch", "yaw"))
        at = both.tables(time)
        assert at["pitch.loads.bending_moment.engine_angle"] == pytest.approx(
            0.8 * at["loads.bending_moment.engine_angle"], rel=1e-9
        )
        assert found["C"][row, pitch].any() and not found["C"][row, same].any() and found["C"][other, same].any()


def matrices(study: Study, time: float) -> dict[str, np.ndarray]:
    names = ("A", "B", "C", "E", "G")
    return dict(zip(names, MatrixEvaluator(study.with_means, names)(time, 10.0, 150.0), strict=True))


@pytest.fixture
def folder(vehicle_folder):
    return unsymmetrical(vehicle_folder)


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
@pytest.mark.parametrize("plane", ["pitch", "yaw"])
def test_each_plane_of_both_is_the_plane_alone(folder, plane):
    """States and forces of a plane in both are those of the vehicle that flies in it alone, wind aside."""
    both = Study.load(folder, compile=False, changes={"planes": "both"})
    alone = Study.load(folder, compile=False, changes={"planes": plane})
    own = [n for n in alone.system.state_names if not n.startswith(("wind", "deviation"))]
    states = [both.system.state_names.index(f"{plane}_{n}") for n in own]
    single = [alone.system.state_names.index(n) for n in own]
    names = [n for n in alone.system.output_names if f"{plane}_{n}" in both.system.output_names]
    for time in (30.0, 75.0):
        found, expected = matrices(both, time), matrices(alone, time)
        scale = np.abs(expected["A"]).max()
        np.testing.assert_allclose(
            found["A"][np.ix_(states, states)], expected["A"][np.ix_(single, single)], rtol=1e-12, atol=1e-12 * scale
        )
        for name in names:
            row, other = both.system.output_index(f"{plane}_{name}"), alone.system.output_index(name)
            np.testing.assert_allclose(found["C"][row, states], expected["C"][other, single], rtol=1e-12)
            undisturbed = found["G"][row, -1], expected["G"][other, -1]
            assert undisturbed[0] == pytest.approx(undisturbed[1], rel=1e-12)


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
def test_planes_differ_where_they_say_so(folder):
    vehicle = load_vehicle(folder, {"planes": "both"})
    pitch, yaw = flown_planes(vehicle)
    assert pitch.own == {"control"} and not yaw.own
    ratio = pitch.vehicle.tables["moment_of_inertia"].values / yaw.vehicle.tables["moment_of_inertia"].values
    np.testing.assert_allclose(ratio, 1.33, rtol=1e-8)
    assert pitch.vehicle.tables["mass"] is yaw.vehicle.tables["mass"]
    system = Study.from_vehicle(vehicle, compile=False).system
    assert {"pitch.control.T1.gain", "control.T1.gain"} <= set(system.parameter_names)
    assert system.parameter_names.count("thrust.sigma") == 1
    tables = [name for group in system.tables for name in group.names]
    assert "pitch.moment_of_inertia" in tables and "yaw.moment_of_inertia" not in tables


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
def test_force_at_zero_angle_is_an_angle_of_attack_more(folder):
    """C_N0 acts as C_N0 / C'_N: what it puts into every rate and load is that angle times the column of alpha."""
    study = Study.load(folder, compile=False, changes={"planes": "pitch"})
    at, m = study.tables(75.0), matrices(study, 75.0)
    zero = 0.02 / at["normal_force_slope"]
    rate = study.system.state_names.index("lateral_velocity")
    force = at["dynamic_pressure"] * study.parameters["reference_area"].value * 0.02 / at["mass"]
    assert m["E"][rate, -1] == pytest.approx(force, rel=1e-12)
    moment = study.system.output_index("bending_moment")
    direct = m["G"][moment, -1] / zero
    by_wind = m["G"][moment, 0] * at["relative_velocity"] ** 2 / at["altitude_rate"]  # wind in pitch: sin gamma / V
    assert direct == pytest.approx(by_wind, rel=1e-12)
    assert m["G"][study.system.output_index("angle_of_attack"), -1] == 0.0


def test_a_vehicle_without_force_at_zero_angle_knows_none(vehicle_folder):
    study = Study.load(vehicle_folder, compile=False)
    assert not matrices(study, 75.0)["E"][:, -1].any()


CASES = {
    "file is missing": ("pitch.tables.aerodynamics.file", "none.csv", "none.csv"),
    "azimuth beyond a turn": ("wind.azimuth_deg", 361.0, "azimuth_deg"),
    "azimuth below zero": ("wind.azimuth_deg", -1.0, "azimuth_deg"),
    "azimuth of another flight": ("wind.azimuth_deg", 90.0, "site.azimuth_deg = 72"),
    "azimuth no number": ("wind.azimuth_deg", "east", "azimuth_deg"),
    "pitch wind": ("wind.pitch_wind", "vertical", "normal"),
    "planes": ("planes", "roll", "'yaw', 'pitch' or 'both'"),
    "nonlinear mean": ("options.mean_response", "nonlinear", "mean_response"),
    "bias of each": ("biases.thrust", {"standard_deviation": 0.01, "planes": "both"}, "'common' or 'each'"),
    "roll beyond a turn": ("roll_deg", 400.0, "roll_deg"),
    "noise of each": ("noise.thrust.planes", "both", "'common' or 'each'"),
    "one component's filter": ("wind.components.filter", "wind_march_zonal_filter.json", "one component"),
    "one component's table": ("wind.components.statistics.file", "wind_march_zonal.csv", "mean_zonal"),
    "correlated turbulence": ("wind.turbulence", {"severity": "light", "correlation": 0.2}, "correlation"),
}


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
@pytest.mark.parametrize("name", CASES)
def test_refused(folder, name):
    key, value, message = CASES[name]
    with pytest.raises(DataError, match=message):
        load_vehicle(folder, {"planes": "both", key: value})


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
def test_other_tanks_need_their_own_modes_and_loads(folder):
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    first, second = (i for i in (text.index("[[slosh]]"), text.index("[[slosh]]", text.index("[[slosh]]") + 1)))
    tank = text[first:second].replace("[[slosh]]", "[[pitch.slosh]]").replace("[slosh.", "[pitch.slosh.")
    toml.write_text(text + "\n" + tank)
    with pytest.raises(DataError, match=r"pitch\.(bending|loads)'?: is missing, but this plane has other slosh tanks"):
        load_vehicle(folder, {"planes": "both"})


def test_correlations_that_cannot_be(vehicle_folder):
    file = vehicle_folder / "wind_march_components_filter.json"
    text = file.read_text()
    file.write_text(text[: text.rindex('"start_correlation"')] + '"start_correlation": 1.5\n}\n')
    with pytest.raises(DataError, match=r"components_filter\.json.*1\.5 is not between -1 and 1"):
        load_vehicle(vehicle_folder, {"planes": "both"})
    file.write_text(text)
    table = vehicle_folder / "wind_march_components.csv"
    rows = table.read_text().splitlines()
    table.write_text("\n".join([*rows[:-1], rows[-1].rsplit(",", 1)[0] + ",1.2"]) + "\n")
    with pytest.raises(DataError, match="correlation of the two winds at 30000 m is 1.2, beyond 1"):
        load_vehicle(vehicle_folder, {"planes": "both"})
    table.write_text("\n".join([*rows[:-1], rows[-1].rsplit(",", 1)[0]]) + "\n")
    with pytest.raises(DataError, match="wind_march_components.csv"):
        load_vehicle(vehicle_folder, {"planes": "both"})
