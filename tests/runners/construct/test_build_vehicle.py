"""``ascentwind build-vehicle``: shipped tables are its output, builds agree, and nothing is lost when one refuses."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from ascentwind.model import load_vehicle
from ascentwind.model.equations.station_loads import load_station_loads
from ascentwind.model.errors import DataError, OutputFolderError
from ascentwind.model.files.csv_table import read_csv_table
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.vehicle_file import read_vehicle_file
from ascentwind.runners.construct.build_vehicle import build_vehicle, inputs_hash, table_entries
from ascentwind.runners.construct.vehicle_figures import FIGURES
from ascentwind.runners.construct.vehicle_numbers import STEPS
from ascentwind.version import __version__

AS504 = built_in_vehicles()["as504"]
COARSE = 10.0  # s between rows
VEHICLE, CONSTRUCTION = "vehicle.toml", "construction.toml"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """AS-504 built anew as it ships, with its load-relief sensors: numbers, folder and the steps done."""
    made, steps = tmp_path_factory.mktemp("built"), []
    out, folder = made / "as504", made / "raw"
    shutil.copytree(AS504, folder)
    with (folder / VEHICLE).open("a") as file:
        file.write((AS504 / "load_relief.toml").read_text())
    numbers, written = build_vehicle(folder, out, progress=steps.append)
    return numbers, out, written, steps


def columns(file: Path):
    return read_csv_table(file, "time", "s", order="not decreasing").columns


@pytest.mark.slow
def test_shipped_tables_are_the_output_of_the_build(built):
    """Every table that vehicle.toml names and no hand wrote; digits are nine, sums of other processors another 1e-8."""
    _, out, written, steps = built
    assert steps == list(STEPS)
    named = {entry.file for entry in table_entries(read_vehicle_file(out / VEHICLE)).values()}
    assert {p.name for p in written} == named and len(named) == 21
    for path in written:
        shipped, found = columns(AS504 / path.name), columns(path)
        assert list(shipped) == list(found), path.name
        for name, values in found.items():
            size = np.abs(values).max()
            np.testing.assert_allclose(shipped[name], values, rtol=0, atol=1e-8 * size, err_msg=f"{path.name} {name}")
    texts, shipped_texts = ([path.read_text() for path in of] for of in (written, [AS504 / p.name for p in written]))
    assert all(text.startswith(f"# computed by 'ascentwind build-vehicle' {__version__}; ") for text in texts)
    inputs = [{text.split("\n")[0].partition("; ")[2] for text in of} for of in (texts, shipped_texts)]
    assert inputs[0] == inputs[1]  # the version beside them is that of the release that computed the shipped ones
    load_vehicle(out)


@pytest.mark.slow
def test_loads_of_as504_meet_those_of_as506_in_flight(built):
    """Station 25 m at AS-506's alpha 1.7 deg, gimbal 0.27 deg, 33.0 kPa, 91.5 s: 3.75e6 N m (its flight evaluation)."""
    numbers, _, _, _ = built
    row = int(np.argmin(np.abs(numbers.flight.time - 91.5)))
    station = int(np.argmin(np.abs(numbers.stations - 22.46)))
    c = numbers.loads[row]
    scale = 33.0e3 / numbers.flight.dynamic_pressure[row]
    moment = c.angle_of_attack[station] * scale * np.deg2rad(1.7) + c.engine_angle[station] * np.deg2rad(0.27)
    assert moment == pytest.approx(3.75e6, rel=0.05)


@pytest.mark.slow
def test_forces_of_the_line_are_those_of_the_tables(built):
    """Normal force and its centre agree exactly; mass moments but for 60 t elements, misplaced by 0.1 m."""
    numbers, _, _, _ = built
    line, x = numbers.line, numbers.line.points
    force = line.total(numbers.intensity)
    np.testing.assert_allclose(force, numbers.normal_force_slope, rtol=1e-12)
    np.testing.assert_allclose(line.total(numbers.intensity * x) / force, numbers.center_of_pressure, rtol=1e-12)
    tail = [c.first_moment[0] for c in numbers.loads]
    p, s = numbers.properties, numbers.stations[0]
    np.testing.assert_allclose(tail, p.mass * (p.center_of_gravity - s), rtol=2e-4)
    np.testing.assert_allclose([c.second_moment[0] for c in numbers.loads], p.moment_of_inertia, rtol=5e-4)


@pytest.mark.slow
def test_moments_vanish_at_both_ends_of_as504(built):
    numbers, _, _, _ = built
    for c in numbers.loads[::20]:
        for name in ("angle_of_attack", "engine_angle", "center_of_pressure", "bending"):
            values = np.atleast_2d(getattr(c, name))
            assert np.abs(values[:, [0, -1]]).max() < 1e-9 * np.abs(values).max(), name


@pytest.mark.slow
def test_stations_along_the_vehicle_hold_the_loads_that_are_outputs(built):
    """The row of station 25 m along the vehicle is the load's own table, digit by digit."""
    _, out, _, _ = built
    of_every_column = {"options.p_delta": True, "biases.center_of_gravity_offset.standard_deviation_m": 0.01}
    vehicle = load_vehicle(out, {"options.slosh_reaction": True} | of_every_column)
    along, direct = load_station_loads(vehicle), columns(out / "loads_station_25m.csv")
    station = along.station.tolist().index(25.0)
    for name in set(direct) - {"time"}:
        table = along.tables[name][station]
        rows = np.isin(direct["time"], table.argument)
        np.testing.assert_array_equal(table.values, direct[name][rows])
        assert table.argument[0] <= vehicle.start


@pytest.mark.slow
def test_in_place_build_is_the_same_and_replaces_whole_files(tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    build_vehicle(AS504, first, spacing=COARSE)
    shutil.copytree(AS504, second)
    _, written = build_vehicle(second, spacing=COARSE)
    for path in written:
        assert path.read_bytes() == (first / path.name).read_bytes()
    assert {p.name for p in second.iterdir()} == {p.name for p in AS504.iterdir()}


@pytest.fixture
def folder(tmp_path) -> Path:
    made = tmp_path / "vehicle"
    shutil.copytree(AS504, made)
    return made


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert text.count(old) >= 1, old
    file.write_text(text.replace(old, new, 1))


EVENT = 'figure 5-3"\nevents = ["center_engine_cutoff"]'
MASSES = "construction/masses.csv"
REFUSED = {
    "area": (
        VEHICLE,
        "reference_area_m2 = 79.46",
        "reference_area_m2 = 80.0",
        r"'reference_area_m2'.*79\.46 m2",
    ),
    "modes": (CONSTRUCTION, "bending_modes = 2", "bending_modes = 3", r"has 2 modes, but .* has bending_modes = 3"),
    "tank": (CONSTRUCTION, "sloshes = false", "sloshes = true", r"'sii_lh2' sloshes in .*; add its \[\[slosh\]\]"),
    "station": (CONSTRUCTION, "stations_m = [25.0]", "stations_m = [30.0]", r"25 m is not one of load_stations_m"),
    "gimbal": (VEHICLE, "forward_of_gimbal_m = 22.46", "forward_of_gimbal_m = 25.0", r"makes it 22\.46"),
    "event": (VEHICLE, "cutoff = 134.34", "cutoff = 134.0", r"write center_engine_cutoff = 134\.34"),
    "unlisted event": (VEHICLE, EVENT, 'figure 5-3"', r"tables\.propulsion.*'thrust' jumps at center.*write events"),
    "missing file": (CONSTRUCTION, f'file = "{MASSES}"', 'file = "construction/mass.csv"', r"mass\.csv"),
}


def test_sensor_beyond_the_tip_is_refused(folder):
    sensors = (folder / "load_relief.toml").read_text()
    assert "position_m = 105.156" in sensors
    with (folder / VEHICLE).open("a") as file:
        file.write(sensors.replace("position_m = 105.156", "position_m = 105.2"))
    with pytest.raises(DataError, match=r"'control\.angle_of_attack\.position_m'.* from -5\.588 to 105\.156 m"):
        build_vehicle(folder, spacing=COARSE)


@pytest.mark.slow
def test_modes_at_a_sensor_are_those_of_the_tank_beside_it(built):
    """The accelerometer is 0.1 m from the attach point of S-II LOX, as far as the bending tables' slope reaches."""
    numbers, out, _, _ = built
    sensor = columns(out / "accelerometer_modes.csv")
    for i in (1, 2):
        mode = columns(out / f"bending_{i}.csv")
        near = mode["displacement_at_sii_lox"] + mode["slope_at_sii_lox"] * (
            43.2 - numbers.slosh["sii_lox"].attach_point
        )
        np.testing.assert_allclose(sensor[f"displacement_{i}"], near, atol=5e-4)
        np.testing.assert_allclose(sensor[f"slope_{i}"], mode["slope_at_sii_lox"], atol=5e-5)


@pytest.mark.parametrize("case", REFUSED)
def test_refusal_names_the_key_and_changes_nothing(folder, case):
    name, old, new, message = REFUSED[case]
    edit(folder / name, old, new)
    before = {p.name: p.stat().st_mtime_ns for p in folder.iterdir() if p.suffix == ".csv"}
    with pytest.raises(DataError, match=message):
        build_vehicle(folder, spacing=COARSE)
    assert {p.name: p.stat().st_mtime_ns for p in folder.iterdir() if p.suffix == ".csv"} == before


def test_flight_beyond_the_normal_force_names_mach_and_time(folder):
    file = folder / "construction" / "normal_force.csv"
    file.write_text(
        "".join(line for line in file.read_text().splitlines(True) if not line.startswith(("6,", "8,", "10,")))
    )
    with pytest.raises(DataError, match=r"t = 1\d\d.* s: .*Mach"):
        build_vehicle(folder, spacing=COARSE)


def test_unwritable_and_full_folders_are_refused(folder, tmp_path):
    with pytest.raises(OutputFolderError, match="not empty"):
        build_vehicle(AS504, folder)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputFolderError, match="cannot be written"):
        build_vehicle(AS504, tmp_path / "file" / "vehicle")


@pytest.mark.slow
def test_figures_show_every_panel_with_a_label_and_data(built):
    numbers, _, _, _ = built
    for name, draw in FIGURES.items():
        for axes in draw(numbers).axes:
            assert axes.lines, name
            assert axes.get_ylabel() and axes.get_xlabel(), name
            assert all(np.isfinite(np.asarray(line.get_ydata(), float)).all() for line in axes.lines), name


def test_inputs_are_hashed_whole(folder):
    before = inputs_hash(folder)
    edit(folder / "construction" / "drag.csv", "0.85,0.36", "0.85,0.37")
    assert inputs_hash(folder) != before
