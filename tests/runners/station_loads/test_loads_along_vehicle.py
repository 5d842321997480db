"""Bending moment along the vehicle from one run, against moments that are outputs themselves, under every option."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ascentwind.model import load_vehicle
from ascentwind.model.errors import DataError, IntegrationError
from ascentwind.model.files.csv_table import read_csv_table
from ascentwind.model.vehicle.columns import REACTION, along_columns, local_columns, local_load_columns
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Study
from ascentwind.runners.solvers.time_nodes import interval_before
from ascentwind.runners.station_loads.loads_along_vehicle import load_rows, loads_along_vehicle
from ascentwind.runners.statistics.covariance import CovarianceEquation
from ascentwind.runners.statistics.sweep import Sweep

ALONG = "loads_along_vehicle.csv"
AS504 = built_in_vehicles()["as504"]
STATIONS = {"bending_moment": (25.0, 22.46), "bending_moment_b": (60.0, 57.46)}
TIMES = [30.0, 41.3]


def write(file: Path, columns: dict[str, np.ndarray]) -> None:
    rows = zip(*columns.values(), strict=True)
    file.write_text(",".join(columns) + "\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows))


def entry(file: str) -> str:
    return f'{{ file = "{file}", status = "assumed", source = "test" }}'


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """AS-504 with two bending moments and a table of the same coefficients along the vehicle."""
    made = tmp_path_factory.mktemp("along") / "as504"
    shutil.copytree(AS504, made)
    vehicle = load_vehicle(AS504)
    tanks, modes = [tank.name for tank in vehicle.slosh], len(vehicle.bending)
    shipped = read_csv_table(AS504 / vehicle.file.loads[0].table.file, "time", "s").columns
    time, rng = shipped["time"], np.random.default_rng(3)
    local_names = [c.name for c in local_load_columns(modes)]
    per_station = []
    for k, (output, (station, forward)) in enumerate(STATIONS.items()):
        columns = {
            f"{name} [{unit}]": shipped[name] * (1 - 0.6 * k) if name in shipped else 0 * time
            for name, unit, *_ in along_columns(modes, tanks)
        }
        columns["first_moment [kg m]"] = 3e7 / (1 + k) * (1 - 0.001 * time)
        columns["second_moment [kg m2]"] = 5e8 / (1 + k) * (1 - 0.001 * time)
        for name, unit, *_ in local_load_columns(modes):
            columns[f"{name} [{unit}]"] = rng.uniform(-1e5, 1e5) * (1 + 0.01 * time)
        is_local = {key: key.split(" ")[0] in local_names for key in columns}
        write(made / f"{output}.csv", {"time [s]": time} | {k: v for k, v in columns.items() if not is_local[k]})
        write(made / f"{output}_local.csv", {"time [s]": time} | {k: v for k, v in columns.items() if is_local[k]})
        head = {"time [s]": time, "station [m]": time * 0 + station, "forward_of_gimbal [m]": time * 0 + forward}
        per_station.append(head | columns)
    long = {key: np.array([part[key] for part in per_station]).T.ravel() for key in per_station[0]}
    write(made / ALONG, long)
    write(
        made / "local_aerodynamics.csv",
        {"time [s]": time[[0, 1, -2, -1]]} | {f"{n} [{u}]": np.full(4, 1e-3) for n, u, *_ in local_columns(modes)},
    )
    text = (made / "vehicle.toml").read_text()
    first, last = text.index("[[loads]]"), text.index("# Relative deviations of tables")
    loads = "".join(
        f'[[loads]]\noutput = "{output}"\nstation_m = {station}\nforward_of_gimbal_m = {forward}\n'
        f"table = {entry(output + '.csv')}\nlocal = {entry(output + '_local.csv')}\n\n"
        for output, (station, forward) in STATIONS.items()
    )
    text = text[:first] + loads + text[last:]
    (made / "vehicle.toml").write_text(text)
    return made


@pytest.mark.parametrize(
    ("options", "noise_loads"),
    [
        ((), "moved_line"),
        (("slosh_reaction", "local_angle_of_attack"), "moved_line"),
        (("slosh_reaction",), "couple_forward"),
        ((), "couple_aft"),
        ((), "as_reported"),
    ],
)
@pytest.mark.slow
def test_every_station_is_the_moment_that_is_an_output_there(folder, options, noise_loads):
    """Sources, means and times alike: the congruence of one run is the run of each moment."""
    changes = {f"options.{name}": True for name in options} | {"options.noise_loads": noise_loads}
    study = Study.load(folder, changes=changes)
    tight = Sweep(relative_tolerance=1e-10)
    along = loads_along_vehicle(study, TIMES, slosh_reaction="slosh_reaction" in options, engine=tight)
    direct = study.response_statistics(TIMES, responses=list(STATIONS), engine=tight)
    for quantity in ("std", "mean_plus_3sigma"):
        expected = direct[quantity].transpose("time", "response", "source").values
        np.testing.assert_allclose(along[quantity].values, expected, rtol=1e-9)
    np.testing.assert_allclose(along["mean"].values, direct.mean.sel(source="combined").values, rtol=1e-9)
    assert along["station"].values.tolist() == [25.0, 60.0]


BIASES = {
    "biases.thrust.standard_deviation": 0.01,
    "biases.center_of_pressure.standard_deviation": 0.03,
    "biases.center_of_gravity_offset.standard_deviation_m": 0.02,
    "biases.thrust_misalignment.standard_deviation_deg": 0.1,
    "biases.wind.standard_deviation": 0.1,
}


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("slosh_reaction", "local_angle_of_attack"), ("p_delta",)])
def test_rows_are_those_of_the_moment_that_is_an_output_there(folder, options):
    """Coefficient by coefficient, from the left where the flight jumps: C and G u of the outputs."""
    changes = {f"options.{name}": True for name in options} | (BIASES if "p_delta" in options else {})
    study = Study.load(folder, compile=False, changes=changes)
    times = [30.0, 70.0, 105.6]
    found = load_rows(study, times, [60.0, 25.0], slosh_reaction="slosh_reaction" in options)
    outputs = [study.system.output_index(name) for name in ("bending_moment_b", "bending_moment")]
    assert found.station.tolist() == [60.0, 25.0]
    for k, time in enumerate(times):
        before = interval_before(study.executable, time)
        at = study.with_means.matrices(time, before.low, before.high)
        largest = np.abs(at["C"][outputs]).max(axis=0)
        assert (np.abs(found.state[k] - at["C"][outputs]) <= 1e-10 * largest).all()
        np.testing.assert_allclose(found.direct_mean[k], (at["G"] @ at["inputs"])[outputs, 0], rtol=1e-10)
    with pytest.raises(DataError, match=r"loads_along_vehicle\.csv, column 'station': has no station at 26 m.*25 m"):
        load_rows(study, times, [25.0, 26.0])


@pytest.mark.slow
def test_covariance_equation_gives_the_same_without_a_compiler(folder):
    study = Study.load(folder, compile=False)
    along = loads_along_vehicle(study, TIMES[:1], engine=CovarianceEquation(1e-7))
    sweep = loads_along_vehicle(Study.load(folder), TIMES[:1])
    np.testing.assert_allclose(along["std"].values, sweep["std"].values, rtol=1e-5)


def test_changed_parameters_come_along(folder):
    study = Study.load(folder)
    doubled = loads_along_vehicle(study.with_parameters({"wind.sigma_scale": 2.0}), TIMES[:1])
    once = loads_along_vehicle(study, TIMES[:1])
    np.testing.assert_allclose(
        doubled["std"].sel(source="wind").values, 2 * once["std"].sel(source="wind").values, rtol=1e-6
    )


def test_refusals_say_what_to_do(folder, tmp_path):
    spoiled = tmp_path / "as504"
    shutil.copytree(folder, spoiled)
    lines = (spoiled / ALONG).read_text().splitlines()
    (spoiled / ALONG).write_text("\n".join(lines[:-1]) + "\n")
    with pytest.raises(DataError, match=r"loads_along_vehicle\.csv: has \d+ rows for \d+ times and 2 stations"):
        loads_along_vehicle(Study.load(spoiled), TIMES)
    with pytest.raises(DataError, match=r"tables\.loads_along_vehicle.*build-vehicle"):
        loads_along_vehicle(Study.load(folder, changes={"tables.loads_along_vehicle": None}), TIMES)
    with pytest.raises(IntegrationError, match="gives no covariances; use sweep or covariance"):
        loads_along_vehicle(Study.load(folder), TIMES[:1], engine="cvodes")
    toml = spoiled / "vehicle.toml"
    toml.write_text(toml.read_text().replace("forward_of_gimbal_m = 57.46\n", ""))
    with pytest.raises(DataError, match=r"bending_moment_b\.forward_of_gimbal_m.*slosh_reaction needs it"):
        Study.load(spoiled, changes={"options.slosh_reaction": True})
    table = spoiled / "bending_moment.csv"
    table.write_text(table.read_text().replace(REACTION[0].name, "moment_first"))
    with pytest.raises(DataError, match=r"bending_moment\.csv.*first_moment"):
        Study.load(spoiled, changes={"options.slosh_reaction": True, "loads.1.forward_of_gimbal_m": 57.46})
