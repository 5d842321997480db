"""Tables held against each other: wrong units, signs, columns, rows and repetitions are told with both numbers."""

from __future__ import annotations

import csv
import json
import re
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ascentwind.model import load_vehicle
from ascentwind.model.equations.stated_twice import compare_stated_twice
from ascentwind.model.equations.station_loads import load_station_loads
from ascentwind.model.errors import DataError, PlausibilityWarning
from ascentwind.model.vehicle.plausibility import station_in_name
from ascentwind.model.vehicle.shipped import built_in_vehicles

SHIPPED = built_in_vehicles()
Rows = list[list[str]]


def change_table(folder: Path, file: str, change: Callable[[list[str], Rows], None]) -> Path:
    """Let ``change`` work on header and rows of a table of numbers."""
    path = folder / file
    lines = path.read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    header, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    change(header, rows)
    path.write_text("\n".join([*comments, ",".join(header), *(",".join(row) for row in rows)]) + "\n")
    return folder


def scaled(column: str, factor: float, only: float | None = None) -> Callable[[list[str], Rows], None]:
    def change(header: list[str], rows: Rows) -> None:
        k = next(i for i, name in enumerate(header) if name.startswith(f"{column} ["))
        for row in rows:
            if only is None or float(row[0]) == only:
                row[k] = repr(factor * float(row[k]))

    return change


def swapped(one: str, other: str) -> Callable[[list[str], Rows], None]:
    def change(header: list[str], rows: Rows) -> None:
        i, k = (next(n for n, name in enumerate(header) if name.startswith(f"{c} [")) for c in (one, other))
        for row in rows:
            row[i], row[k] = row[k], row[i]

    return change


def shifted(column: str, by: int) -> Callable[[list[str], Rows], None]:
    def change(header: list[str], rows: Rows) -> None:
        k = next(i for i, name in enumerate(header) if name.startswith(f"{column} ["))
        values = [row[k] for row in rows]
        for row, value in zip(rows, [*values[by:], *values[-1:] * by], strict=True):
            row[k] = value

    return change


def without(first: float, last: float) -> Callable[[list[str], Rows], None]:
    def change(_: list[str], rows: Rows) -> None:
        rows[:] = [row for row in rows if not first <= float(row[0]) <= last]

    return change


def copied(vehicle: str, folder: Path) -> Path:
    shutil.copytree(SHIPPED[vehicle], folder / vehicle)
    return folder / vehicle


@pytest.mark.parametrize("vehicle", SHIPPED)
def test_shipped_vehicles_pass_without_a_word(vehicle):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_vehicle(SHIPPED[vehicle])


T, R, P = "trajectory.csv", "rigid_body.csv", "propulsion.csv"
REFUSED = {
    "altitude in km": (T, scaled("altitude", 1e-3), "hardly a climb|half the density"),
    "altitude in ft": (T, scaled("altitude", 1 / 0.3048), "faster than the vehicle flies"),
    "speed in km/s": (
        T,
        scaled("relative_velocity", 1e-3),
        r"rises by .* faster than the vehicle flies|half the density",
    ),
    "speed in ft/s": (T, scaled("relative_velocity", 1 / 0.3048), "half the density times the speed squared"),
    "speed in knots": (T, scaled("relative_velocity", 1 / 0.514444), "half the density times the speed squared"),
    "pressure in kPa": (T, scaled("dynamic_pressure", 1e-3), "half the density times the speed squared"),
    "pressure in psf": (T, scaled("dynamic_pressure", 1 / 47.88), "half the density times the speed squared"),
    "pressure twice": (T, scaled("dynamic_pressure", 2.2), "half the density times the speed squared"),
    "acceleration in g": (T, scaled("axial_acceleration", 1 / 9.80665), r"\(thrust - axial_drag\) / mass"),
    "acceleration turned": (T, scaled("axial_acceleration", -1.0), r"\(thrust - axial_drag\) / mass"),
    "drag in kN": (T, scaled("axial_drag", 1e3), r"\(thrust - axial_drag\) / mass"),
    "one row of speed": (T, scaled("relative_velocity", 1.3, only=60.0), "relative_velocity|faster"),
    "one row of acceleration": (T, scaled("axial_acceleration", 2.0, only=60.0), r"t = 60 s: is"),
    "slope per degree": ("aerodynamics.csv", scaled("normal_force_slope", 1 / 57.2958), "the normal force at"),
    "mass in lb": (R, scaled("mass", 1 / 0.45359), r"\(thrust - axial_drag\) / mass"),
    "mass in t": (R, scaled("mass", 1e-3), r"\(thrust - axial_drag\) / mass"),
    "columns of mass and inertia": (R, swapped("mass", "moment_of_inertia"), r"\(thrust - axial_drag\) / mass"),
    "thrust in kN": (P, scaled("thrust", 1e-3), r"\(thrust - axial_drag\) / mass"),
    "thrust in lbf": (P, scaled("thrust", 1 / 4.44822), r"\(thrust - axial_drag\) / mass"),
    "more than all thrust": (P, scaled("control_thrust", 1.3), "more than the whole thrust"),
    "centre of gravity in mm": (R, scaled("center_of_gravity", 1e3), "radii of gyration .* from the centre of gravity"),
    "centre of pressure in mm": ("aerodynamics.csv", scaled("center_of_pressure", 1e3), "radii of gyration"),
    "attach point in mm": ("slosh_s1_lox.csv", scaled("attach_point", 1e3), "radii of gyration"),
    "slosh mass above all": ("slosh_s1_lox.csv", scaled("mass", 1e3), "of all tanks together is"),
    "moment in N mm": ("loads_station_10m.csv", scaled("angle_of_attack", 1e3), "the normal force at the radius"),
    "moved normal force in mN": (
        "loads_station_10m.csv",
        scaled("center_of_pressure", 1e3),
        "where the whole normal force is",
    ),
    "moment of thrust in N mm": (
        "loads_station_10m.csv",
        scaled("engine_angle", 1e3),
        "where the thrust at the radius",
    ),
}
WARNED = {
    "pressure by a third": (T, scaled("dynamic_pressure", 1.34), "half the density times the speed squared"),
    "acceleration by a tenth": (T, scaled("axial_acceleration", 1.1), r"\(thrust - axial_drag\) / mass"),
    "centre of gravity turned": (R, scaled("center_of_gravity", -1.0), "aft of the engines' gimbal plane"),
    "inertia in g m2": (R, scaled("moment_of_inertia", 1e3), "by its inertia is about"),
    "slosh frequency in Hz": ("slosh_s1_lox.csv", scaled("frequency", 1 / 6.2832), "belongs to a tank of"),
    "bending frequency in Hz": ("bending_1.csv", scaled("frequency", 1 / 6.2832), r"look at its unit \(rad/s\)"),
    "columns of drag and pressure": (T, swapped("axial_drag", "dynamic_pressure"), "half the density"),
    "slope fifty times": ("aerodynamics.csv", scaled("normal_force_slope", 50), r"look at its unit \(1/rad\)"),
    "moment in kN m": ("loads_station_10m.csv", scaled("angle_of_attack", 1e-3), "the normal force at the radius"),
    "row of mass": (R, scaled("mass", 1.02, only=100.0), "rises from .* in the next row"),
    "normal force turned": ("aerodynamics.csv", scaled("normal_force_slope", -1.0), "that begins in a tip"),
    "normal force over pi": ("aerodynamics.csv", scaled("normal_force_slope", 0.318), "that begins in a tip"),
    "slosh frequency in rpm": ("slosh_s2_lox.csv", scaled("frequency", 9.55), "where reference_area_m2 is a circle of"),
    "slosh mass in kt": ("slosh_s1_rp1.csv", scaled("mass", 1e-6), "or leave the tank out"),
    "slosh mass in lb": ("slosh_s2_lox.csv", scaled("mass", 1 / 0.4536), "kg at 15.07 m make"),
    "slosh moment turned": ("loads_station_10m.csv", scaled("slosh_s2_lox", -1.0), "kg at 15.07 m make"),
    "attach point and frequency": ("slosh_s2_lox.csv", swapped("attach_point", "frequency"), "make .* at a station"),
    "modes far apart": ("bending_2.csv", scaled("frequency", 3.28), "times that of the mode before"),
    "modes out of order": ("bending_2.csv", scaled("frequency", 0.3), "times that of the mode before"),
    "slope of a mode turned": ("bending_2.csv", scaled("slope_at_gimbal", -1.0), "over .* m make a slope of"),
    "deflection of a mode turned": ("bending_1.csv", scaled("displacement_at_s1_rp1", -1.0), "over .* make a slope of"),
    "deflection of a mode in ft": ("bending_2.csv", scaled("displacement_at_gimbal", 3.28), "over .* make a slope of"),
    "time of one table": ("slosh_s1_rp1.csv", scaled("time", 0.7), "last row at .* the flight is cut off there"),
    "time shifted": ("bending_2.csv", scaled("time", 1.05), "is its time shifted"),
    "end of one table lost": ("slosh_s1_lox.csv", without(140, 200), "the flight is cut off there"),
    "two rows lost": ("bending_1.csv", without(60, 61), "no rows between 59 and 62 s, where others are 1 s apart"),
    "most rows lost": (R, without(12, 148), "no rows between 11 and 149 s"),
    "acceleration five rows late": (T, shifted("axial_acceleration", 5), r"\(thrust - axial_drag\) / mass"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_vehicle_could_mean_is_refused(tmp_path, case):
    file, change, message = REFUSED[case]
    folder = change_table(copied("falcon1", tmp_path), file, change)
    with pytest.raises(DataError, match=message) as caught:
        load_vehicle(folder)
    assert caught.value.file is not None and caught.value.column is not None


@pytest.mark.parametrize("case", WARNED)
def test_what_is_unlikely_is_warned_of(tmp_path, case):
    file, change, message = WARNED[case]
    folder = change_table(copied("falcon1", tmp_path), file, change)
    with pytest.warns(PlausibilityWarning, match=message):
        load_vehicle(folder)


def test_both_numbers_are_told(tmp_path):
    """Falcon 1 flies in the standard atmosphere: what its table has is right."""
    folder = change_table(copied("falcon1", tmp_path), T, scaled("dynamic_pressure", 3.0, only=60.0))
    row = next(r for r in csv.reader((SHIPPED["falcon1"] / T).read_text().splitlines()) if r[0] == "60")
    stated, right = 3 * float(row[3]), float(row[3])
    with pytest.raises(
        DataError, match=re.escape(f"t = 60 s: is {stated:.4g} Pa") + f".* is {re.escape(f'{right:.4g}')} Pa"
    ):
        load_vehicle(folder)


ROWS = [
    ("bending_1.csv", "slope_at_sensor"),
    ("bending_2.csv", "displacement_at_s1_lox"),
    ("loads_station_10m.csv", "bending_1"),
    ("loads_station_16m.csv", "slosh_s2_lox"),
    ("aerodynamics.csv", "normal_force_slope"),
    ("slosh_s1_rp1.csv", "attach_point"),
    ("bending_2.csv", "normal_force_slope_times_displacement"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "column"), ROWS)
def test_a_row_that_stands_apart(tmp_path, file, column):
    """One wrong row."""
    folder = change_table(copied("falcon1", tmp_path), file, scaled(column, 10.0, only=90.0))
    with pytest.warns(PlausibilityWarning, match=rf"{file}, column '{column}', t = 90 s: is .* between rows that make"):
        load_vehicle(folder)


SHAPES = [
    ("bending_1.csv", "generalized_mass", 1e3, "times the vehicle's mass"),
    ("bending_1.csv", "generalized_mass", 1e-3, "times the vehicle's mass"),
    ("bending_2.csv", "slope_at_sensor", 1e3, r"look at the units of slopes \(1/m\)"),
    ("bending_1.csv", "displacement_at_gimbal", 1e3, "at displacements up to"),
    ("bending_1.csv", "normal_force_slope_times_displacement", 57.3, "look at its scale"),
    ("bending_2.csv", "normal_force_slope_times_slope", 1e-6, "look at its scale"),
    ("loads_station_10m.csv", "bending_1", 1e3, "where its mass at the radius of gyration"),
    ("loads_station_10m.csv", "slosh_s1_lox", 1e3, "where its mass at the radius of gyration"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "column", "factor", "message"), SHAPES)
def test_modes_and_loads_of_another_scale(tmp_path, file, column, factor, message):
    folder = change_table(copied("falcon1", tmp_path), file, scaled(column, factor))
    with pytest.warns(PlausibilityWarning, match=message):
        load_vehicle(folder)


def test_control_thrust_of_another_time(tmp_path):
    """The same engines swivel until some stop."""
    folder = change_table(copied("as504", tmp_path), "propulsion.csv", shifted("control_thrust", 38))
    with pytest.warns(PlausibilityWarning, match=r"'control_thrust'.*times its usual share 0.8"):
        load_vehicle(folder)


def test_slosh_of_another_time(tmp_path):
    """A tank keeps its radius: what omega^2 is to the axial acceleration cannot change while it is full."""
    folder = change_table(copied("falcon1", tmp_path), "slosh_s2_lox.csv", shifted("frequency", 38))
    with pytest.warns(
        PlausibilityWarning, match=r"'frequency'.*belongs to a tank of .* at other times to one of 0.573 m"
    ):
        load_vehicle(folder)


def test_loads_along_the_vehicle_and_their_own_tables(tmp_path):
    """The same station twice: as shipped they agree, and one built before the other does not."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_station_loads(load_vehicle(SHIPPED["falcon1"]))
    folder = change_table(copied("falcon1", tmp_path), "loads_station_10m.csv", scaled("angle_of_attack", 1.1))
    with pytest.warns(PlausibilityWarning, match=r"at station 10 m, but loads_station_10m.csv has .*build both again"):
        load_station_loads(load_vehicle(folder))


BESIDE = {  # file, change, what run tells
    "mode of a load turned": (
        "loads_station_10m.csv",
        scaled("bending_1", -1.0),
        "column 'bending_1'.*build both again",
    ),
    "inertia of another time": (R, shifted("moment_of_inertia", 30), "'second_moment'.*but moment_of_inertia make"),
    "centre of gravity moved": (R, scaled("center_of_gravity", 1.1), "'first_moment'.*but mass and center_of_gravity"),
    "normal force of another time": ("aerodynamics.csv", shifted("normal_force_slope", 30), "'arm'.*but normal_force"),
    "shear force of a mode turned": (
        "shear_station_10m.csv",
        scaled("bending_1", -1.0),
        "shear_along_vehicle.csv, column 'bending_1'.*build both again",
    ),
    "mass forward in tonnes": (
        "axial_station_10m.csv",
        scaled("mass_forward", 1e-3),
        "axial_along_vehicle.csv, column 'mass_forward'.*build both again",
    ),
    "shear force of half the vehicle": (
        "shear_along_vehicle.csv",
        scaled("first_moment", 0.5),
        "'first_moment'.*but mass make",
    ),
    "axial force of half the vehicle": (
        "axial_along_vehicle.csv",
        scaled("mass_forward", 0.5),
        "'mass_forward'.*but mass make",
    ),
    "mode turned at a tank": (
        "bending_1.csv",
        scaled("displacement_at_s2_lox", -1.0),
        "'displacement_at_s2_lox'.*but first_moment and bending_1 of shear_along_vehicle.csv make",
    ),
    "mode of another scale at the gimbal": (
        "bending_2.csv",
        scaled("displacement_at_gimbal", 0.3048),
        "'displacement_at_gimbal'.*but first_moment and bending_2",
    ),
    "air force on a mode turned": (
        "bending_2.csv",
        scaled("normal_force_slope_times_displacement", -1.0),
        "local_aerodynamics.csv, t = .*: no normal force along the vehicle has both its integrals and",
    ),
    "slosh of a tank aft of all stations": (
        "slosh_s1_rp1.csv",
        scaled("mass", 0.4536),
        "'slosh_s1_rp1'.*but mass and attach_point of s1_rp1 make",
    ),
    "rotation of the section for the slope of the axis": (
        "local_aerodynamics.csv",
        scaled("slope_1", 0.97),
        "'slope_1'.*but normal_force_slope_times_slope of bending_1.csv make",
    ),
    "another radius": (
        "axial_along_vehicle.csv",
        scaled("radius", 2.0),
        r"'loads.0.radius_m': is 0.84023 m, but axial_along_vehicle.csv has 1.68046 m at station 10",
    ),
}


@pytest.mark.parametrize("vehicle", SHIPPED)
def test_what_shipped_vehicles_state_twice_agrees(vehicle):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compare_stated_twice(load_vehicle(SHIPPED[vehicle]))


def test_area_of_the_construction(tmp_path):
    """The construction of the same folder was built with its own."""
    toml = copied("falcon1", tmp_path) / "vehicle.toml"
    toml.write_text(toml.read_text().replace("reference_area_m2 = 2.21793", "reference_area_m2 = 3.0"))
    vehicle = load_vehicle(toml.parent)
    with pytest.warns(PlausibilityWarning, match=r"is 3 m2, but construction.toml has 2.21793 m2"):
        compare_stated_twice(vehicle)


def test_gimbal_plane_of_a_load_and_of_the_stations(tmp_path):
    """AS-504 has one load, so that no other says where the plane is."""
    toml = copied("as504", tmp_path) / "vehicle.toml"
    toml.write_text(toml.read_text().replace("forward_of_gimbal_m = 22.46", "forward_of_gimbal_m = 21.46"))
    vehicle = load_vehicle(toml.parent)
    with pytest.warns(PlausibilityWarning, match=r"at station 3.54 m; loads_along_vehicle.csv puts it at 2.54 m"):
        compare_stated_twice(vehicle)


@pytest.mark.parametrize("case", BESIDE)
def test_tables_beside_those_of_the_equations(tmp_path, case):
    file, change, message = BESIDE[case]
    vehicle = load_vehicle(change_table(copied("falcon1", tmp_path), file, change))
    with pytest.warns(PlausibilityWarning, match=message):
        compare_stated_twice(vehicle)


ASSUMED = [
    ("sigma = 0.01\n", "sigma = 0.573\n", "'noise.thrust.sigma': is 0.573, 57.3 % of thrust and control_thrust"),
    ("sigma = 0.05\n", "sigma = 5e-5\n", "'noise.center_of_pressure.sigma': is 5e-05"),
    ("correlation_time_s = 1.0 ", "correlation_time_s = 1000.0 ", "'noise.thrust.correlation_time_s': is 1000, where"),
    ("correlation_time_s = 1.0 ", "correlation_time_s = 1e-3 ", "'noise.thrust.correlation_time_s': is 0.001, where"),
    ("damping = 0.005 ", "damping = 0.5 ", "'bending.0.damping': is 0.5, of the critical damping"),
    ("start_time_s = 10.0 ", "start_time_s = 60.0 ", "'start_time_s': is 60 s, where the dynamic pressure is"),
    ("damping = 0.01 ", "damping = 1.0 ", "'slosh.0.damping': is 1, of the critical damping"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), ASSUMED)
def test_noise_levels_and_dampings_of_no_vehicle(tmp_path, old, new, message):
    toml = copied("falcon1", tmp_path) / "vehicle.toml"
    text = toml.read_text()
    assert old in text
    toml.write_text(text.replace(old, new, 1))
    with pytest.warns(PlausibilityWarning, match=message):
        load_vehicle(toml.parent)


@pytest.mark.parametrize(
    ("key", "sigma", "message"),
    [
        ("thrust.standard_deviation", 1.0, "'biases.thrust': is 1, one sigma in parts of 1; those .* 0.0005 and 0.2"),
        ("thrust_misalignment.standard_deviation_deg", 5.0, "'biases.thrust_misalignment': is 5, one sigma in degrees"),
        ("center_of_gravity_offset.standard_deviation_m", 20.0, "'biases.center_of_gravity_offset': is 20, .* in m"),
    ],
)
def test_biases_of_no_vehicle(key, sigma, message):
    with pytest.warns(PlausibilityWarning, match=message):
        load_vehicle(built_in_vehicles()["falcon1"], {f"biases.{key}": sigma})


def test_a_sample_of_the_wind_filter_that_stands_apart(tmp_path):
    (file,) = copied("falcon1", tmp_path).glob("*filter.json")
    filter_ = json.loads(file.read_text())
    filter_["G_per_root_m"][100][0][1] *= -1
    file.write_text(json.dumps(filter_))
    with pytest.warns(
        PlausibilityWarning, match=r"'G_per_root_m': has -0.\d+ in G\[1, 2\] at \d+.* between samples that"
    ):
        load_vehicle(file.parent)


def test_a_jump_at_an_event_is_no_row_apart():
    """AS-504's tables jump where its centre engine is cut off, and its rows stand 0.1 ms either side."""
    vehicle = load_vehicle(SHIPPED["as504"])
    assert vehicle.tables["thrust"].breaks == (134.34,)


STATIONS = [
    ("station_m = 10.0 ", "station_m = 9999 ", "puts the gimbal plane at station|radii of gyration"),
    ("forward_of_gimbal_m = 7.46", "forward_of_gimbal_m = 9996.46", "radii of gyration|puts the gimbal plane"),
    ("forward_of_gimbal_m = 13.93952", "forward_of_gimbal_m = 14.93952", "puts the gimbal plane at station 1.54 m"),
    ('file = "bending_2.csv"', 'file = "bending_1.csv"', r"numbers of bending_1.csv.*remove one \[\[bending\]\]"),
    ('file = "slosh_s1_rp1.csv"', 'file = "slosh_s1_lox.csv"', r"holds the numbers of slosh_s1_lox.csv"),
    ("reference_area_m2 = 2.21793", "reference_area_m2 = 2.21793e-4", "drag coefficient|normal force"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), STATIONS)
def test_keys_of_vehicle_toml(tmp_path, old, new, message):
    toml = copied("falcon1", tmp_path) / "vehicle.toml"
    text = toml.read_text()
    assert old in text
    toml.write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=message):
        load_vehicle(toml.parent)


def test_a_station_that_is_not_its_files(tmp_path):
    toml = copied("falcon1", tmp_path) / "vehicle.toml"
    moved = toml.read_text().replace("station_m = 10.0 ", "station_m = 9.0 ").replace("= 7.46", "= 6.46")
    toml.write_text(moved)
    with pytest.warns(PlausibilityWarning, match="is 9 m, but its table is called loads_station_10m.csv"):
        load_vehicle(toml.parent)


@pytest.mark.parametrize(
    ("file", "inside", "outside"),
    [
        ("loads_station_10m.csv", 10.0, 9.0),
        ("loads_station_16m.csv", 16.47952, 17.0),
        ("a/station_16.48_m.csv", 16.47952, 16.5),
        ("station_16_5m.csv", 16.47952, 16.7),
    ],
)
def test_stations_in_names(file, inside, outside):
    limits = station_in_name(file)
    assert limits is not None
    assert limits[0] <= inside <= limits[1]
    assert not limits[0] <= outside <= limits[1]


@pytest.mark.parametrize("file", ["loads.csv", "station_mass.csv", "moment_10m.csv", "station_10mm.csv"])
def test_names_without_a_station(file):
    assert station_in_name(file) is None


@settings(max_examples=10, deadline=None, suppress_health_check=(HealthCheck.too_slow,))
@given(factor=st.floats(0.92, 1.08), vehicle=st.sampled_from(sorted(SHIPPED)))
@pytest.mark.slow
def test_heavier_vehicles_with_more_of_everything_pass(tmp_path_factory, factor, vehicle):
    """Mass, inertia, thrust and drag in proportion: the same flight."""
    folder = copied(vehicle, tmp_path_factory.mktemp("scaled"))
    changed = {R: ("mass", "moment_of_inertia"), P: ("thrust", "control_thrust"), T: ("axial_drag",)}
    for file, column in ((file, column) for file, columns in changed.items() for column in columns):
        change_table(folder, file, scaled(column, factor))
    with warnings.catch_warnings():
        warnings.simplefilter("error", PlausibilityWarning)
        load_vehicle(folder)
