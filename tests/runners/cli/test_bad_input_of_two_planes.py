"""Bad input of two planes, each by Python and by the command line: typed, with file and key, and exit code 2."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ascentwind.model.errors import DataError, ParameterValueError
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.runners import Study
from ascentwind.runners.cli.app import main

TOML, TABLE = "vehicle.toml", "wind_march_components.csv"
FILTER = "wind_march_components_filter.json"
AZIMUTH = "azimuth_deg = 72.0             # of the flight, from north towards east; turns"
INERTIA = '\n[pitch.tables.moment_of_inertia]\nfile = "pitch.csv"\nstatus = "assumed"\nsource = "made up"\n'


def replaced(file: str, old: str, new: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        text = (folder / file).read_text()
        assert old in text, old
        (folder / file).write_text(text.replace(old, new, 1))

    return spoil


def azimuth(new: str) -> Callable[[Path], None]:
    return replaced(TOML, AZIMUTH, new)


def without(column: str) -> Callable[[Path], None]:
    """Take a column out of the table of both components."""

    def spoil(folder: Path) -> None:
        lines = (folder / TABLE).read_text().splitlines()
        head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
        k = next(i for i, name in enumerate(lines[head].split(",")) if name.startswith(column))
        rows = [[c for i, c in enumerate(line.split(",")) if i != k] for line in lines[head:]]
        (folder / TABLE).write_text("\n".join([*lines[:head], *(",".join(row) for row in rows)]) + "\n")

    return spoil


def correlation(value: str) -> Callable[[Path], None]:
    """Give the last level another correlation."""

    def spoil(folder: Path) -> None:
        lines = (folder / TABLE).read_text().splitlines()
        (folder / TABLE).write_text("\n".join([*lines[:-1], f"{lines[-1].rsplit(',', 1)[0]},{value}"]) + "\n")

    return spoil


def inertia(last: int, head: str = "time [s],moment_of_inertia [kg m2]", cell: str = "9e8") -> Callable[[Path], None]:
    """Give the pitch plane a table of inertia from 1 s to another time."""

    def spoil(folder: Path) -> None:
        (folder / "pitch.csv").write_text("\n".join([head, *(f"{t},{cell}" for t in range(1, last + 1))]) + "\n")
        with (folder / TOML).open("a") as file:
            file.write(INERTIA)

    return spoil


def no_components(folder: Path) -> None:
    text = (folder / TOML).read_text()
    start, end = text.index("\n[wind.components]"), text.index("\n[options]")
    (folder / TOML).write_text(text[:start] + text[end:])


def section(text: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        with (folder / TOML).open("a") as file:
            file.write(text)

    return spoil


PRODUCT = INERTIA.replace("pitch.tables.moment_of_inertia", "tables.product_of_inertia").replace(
    "pitch.csv", "product.csv"
)


def product(cell: str) -> Callable[[Path], None]:
    """Give the vehicle a product of inertia."""

    def spoil(folder: Path) -> None:
        rows = [f"{t},{cell}" for t in range(1, 151)]
        (folder / "product.csv").write_text("\n".join(["time [s],product_of_inertia [kg m2]", *rows]) + "\n")
        section(PRODUCT)(folder)

    return spoil


LOADS = '\n[[pitch.loads]]\noutput = "bending_moment"\nstation_m = 25.0\n[pitch.loads.table]\nfile = "short.csv"\n'
CASES = {
    "azimuth missing": (azimuth("# turns"), "wind.azimuth_deg.*is missing, but planes"),
    "azimuth below zero": (azimuth("azimuth_deg = -1.0 # "), r"azimuth_deg.*greater than or equal to 0"),
    "azimuth beyond a turn": (azimuth("azimuth_deg = 360.5 # "), "azimuth_deg.*less than or equal to 360"),
    "azimuth no number": (azimuth('azimuth_deg = "east" # '), "azimuth_deg.*valid number"),
    "azimuth not finite": (azimuth("azimuth_deg = nan # "), "azimuth_deg.*finite|azimuth_deg.*equal to"),
    "azimuth of another flight": (azimuth("azimuth_deg = 90.0 # "), "azimuth_deg.*site.azimuth_deg = 72"),
    "no components": (no_components, 'wind.components.*is missing, but planes = "both" needs it.*--components both'),
    "no second mean": (without("mean_meridional"), r"column 'mean_meridional \[m/s\]' is missing"),
    "no second deviation": (without("standard_deviation_meridional"), "standard_deviation_meridional.*is missing"),
    "no first mean": (without("mean_zonal"), r"column 'mean_zonal \[m/s\]' is missing"),
    "no correlation": (without("correlation"), r"column 'correlation \[1\]' is missing"),
    "correlation beyond one": (correlation("1.2"), "correlation of the two winds at 30000 m is 1.2, beyond 1"),
    "correlation below minus one": (correlation("-1.001"), "30000 m is -1.001?, beyond 1|-1, beyond 1"),
    "correlation not a number": (correlation("nan"), "'nan' is not a finite number"),
    "correlation of another wind": (correlation("0.99"), "filters' winds have a correlation of .* says 0.99"),
    "start correlation beyond one": (
        lambda folder: (folder / FILTER).write_text(
            re.sub(r'"start_correlation": [-\d.e]+', '"start_correlation": 1.5', (folder / FILTER).read_text())
        ),
        "1.5 is not between -1 and 1",
    ),
    "no start correlation": (replaced(FILTER, '"start_correlation"', '"start_correlatio"'), "start_correlation"),
    "a negative start correlation beyond one": (
        lambda folder: (folder / FILTER).write_text(
            re.sub(r'"start_correlation": [-\d.e]+', '"start_correlation": -1.01', (folder / FILTER).read_text())
        ),
        "-1.01 is not between -1 and 1",
    ),
    "start correlation not a number": (
        lambda folder: (folder / FILTER).write_text(
            re.sub(r'"start_correlation": [-\d.e]+', '"start_correlation": NaN', (folder / FILTER).read_text())
        ),
        "start_correlation|not a finite|NaN",
    ),
    "filter of one component": (replaced(TOML, f'"{FILTER}"', '"wind_march_zonal_filter.json"'), "one component"),
    "no filter file": (replaced(TOML, f'"{FILTER}"', '"none.json"'), "none.json.*cannot be read"),
    "table of a plane missing": (section(INERTIA), "pitch.csv.*cannot be read"),
    "table of a plane too short": (inertia(8), "start_time_s = 10 is not before the end of pitch.csv at 8 s"),
    "table of a plane in another unit": (inertia(150, "time [s],moment_of_inertia [lb]"), r"unit is \[lb\]"),
    "table of a plane with another column": (inertia(150, "time [s],mass [kg]"), "moment_of_inertia.*is missing"),
    "table of a plane with a row too short": (
        lambda folder: (
            inertia(150)(folder),
            (folder / "pitch.csv").write_text((folder / "pitch.csv").read_text().replace("\n75,9e8\n", "\n75\n")),
        )[0],
        "pitch.csv, line 76.*1 cell|pitch.csv.*75",
    ),
    "table of a plane with times that go back": (
        lambda folder: (
            inertia(150)(folder),
            (folder / "pitch.csv").write_text((folder / "pitch.csv").read_text().replace("\n75,9e8\n", "\n70,9e8\n")),
        )[0],
        "pitch.csv.*70 comes after 74; sort the rows",
    ),
    "product of inertia beyond any masses": (
        product("9e15"), r"product.csv.*not below the root of the moments of inertia in pitch and yaw",
    ),
    "product of inertia that is no number": (product("nan"), "product.csv.*'nan' is not a finite number"),
    "product of inertia of a file that is not there": (
        section(PRODUCT), "product.csv.*cannot be read",
    ),
    "table of a plane not positive": (inertia(150, cell="-9e8"), "is not positive"),
    "loads of a plane missing": (
        section(f'{LOADS}status = "assumed"\nsource = "made up"\n'), "short.csv.*cannot be read",
    ),
    "section of a third plane": (section("\n[roll.control]\n"), "roll.*is not a key"),
    "misspelt table of a plane": (section(INERTIA.replace("ertia", "ertai", 1)), "did you mean 'moment_of_inertia'"),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
@pytest.mark.filterwarnings("ignore::ascentwind.errors.WindWarning")
@pytest.mark.parametrize("name", CASES)
def test_refused_by_python_and_on_the_command_line(name, vehicle_folder, tmp_path, monkeypatch, capsys):
    spoil, message = CASES[name]
    spoil(vehicle_folder)
    with pytest.raises(DataError, match=message):
        load_vehicle(vehicle_folder, {"planes": "both"})
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["ascentwind", "run", "vehicle", "--set", "planes=both", "--times", "75"])
    with pytest.raises(SystemExit) as stop:
        main()
    printed = capsys.readouterr()
    assert stop.value.code == 2 and "Traceback" not in printed.err + printed.out
    assert re.search(message, re.sub(r"\s+", " ", printed.err))
    assert [p.name for p in tmp_path.iterdir()] == ["vehicle"], "something was written"


@pytest.mark.filterwarnings("ignore::ascentwind.errors.PlausibilityWarning")
def test_a_table_of_one_plane_that_ends_early_ends_the_flight_there(vehicle_folder):
    inertia(100)(vehicle_folder)
    vehicle = load_vehicle(vehicle_folder, {"planes": "both"})
    assert vehicle.end == 100.0
    assert min(vehicle.sources, key=lambda s: s.last).file.name == "pitch.csv"


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("wind.azimuth", 72.0, "cannot be 72 rad, more than a turn; 72 deg is 1.257 rad"),
        ("wind.azimuth", -90.0, "more than a turn"),
        ("wind.azimuth", float("nan"), "finite"),
        ("roll", 30.0, "cannot be 30 rad, more than a turn; 30 deg is 0.5236 rad"),
    ],
)
def test_an_angle_in_degrees_where_rad_are_asked_for(name, value, message):
    study = Study.load("as504", compile=False, changes={"planes": "both", "roll_deg": 0.0})
    with pytest.raises(ParameterValueError, match=message):
        study.with_parameters({name: value})
    assert study.with_parameters({name: 1.0}).parameters[name].value == 1.0
