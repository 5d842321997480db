"""The CSV files that a vehicle.toml names, written from computed numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...model.vehicle.columns import ALONG_ARGUMENTS, RADIUS
from ...model.vehicle.vehicle_file import VehicleFile
from . import aerodynamics
from .line_integrals import Line
from .loads import load_columns, local_load_columns, shear_columns
from .vehicle_numbers import VehicleNumbers

Array = NDArray[np.float64]
Columns = dict[tuple[str, str], Array]

DIGITS = 9
ROUNDING = 1e-11  # of a column's largest value


def vehicle_tables(numbers: VehicleNumbers, file: VehicleFile) -> dict[str, tuple[str, Columns]]:
    """Return every table that a vehicle.toml names and the build computes: file name to a note and columns.

    Columns go by (name, unit); the first is the time.
    """
    construction, flight = numbers.construction, numbers.flight
    time: Columns = {("time", "s"): flight.time}
    tables = {
        file.tables.rigid_body.file: ("center_of_gravity: metres forward of the gimbal plane", time | _rigid(numbers)),
        file.tables.trajectory.file: (
            "axial_acceleration: (thrust - drag) / mass; angles of attack: nose over and to the right +",
            time
            | {
                ("altitude", "m"): flight.altitude,
                ("relative_velocity", "m/s"): flight.relative_velocity,
                ("dynamic_pressure", "Pa"): flight.dynamic_pressure,
                ("axial_acceleration", "m/s2"): flight.axial_acceleration,
                ("axial_drag", "N"): flight.drag,
                ("angle_of_attack_pitch", "rad"): flight.angle_of_attack_pitch,
                ("angle_of_attack_yaw", "rad"): flight.angle_of_attack_yaw,
                ("azimuth_change", "rad"): flight.azimuth_change,
            },
        ),
        file.tables.propulsion.file: (
            "control_thrust: of the gimballed engines",
            time | {("thrust", "N"): flight.thrust, ("control_thrust", "N"): flight.control_thrust},
        ),
        file.tables.aerodynamics.file: (
            f"slope on {construction.reference_area:g} m2; center_of_pressure: metres forward of the gimbal plane",
            time
            | {
                ("normal_force_slope", "1/rad"): numbers.normal_force_slope,
                ("center_of_pressure", "m"): numbers.center_of_pressure,
            },
        ),
    }
    for i, mode in enumerate(file.bending):
        origin = "free-free Timoshenko beam, all liquid frozen" if construction.modes is None else "modes as given"
        note = f"{origin}, displacement 1 at the forward end"
        tables[mode.table.file] = note, time | _bending(numbers, i)
    for tank in file.slosh:
        found = numbers.slosh[tank.name]
        tables[tank.table.file] = (
            f"method '{construction.slosh_method}'; attach_point: metres forward of the gimbal plane",
            time
            | {
                ("mass", "kg"): found.mass,
                ("frequency", "rad/s"): found.frequency,
                ("attach_point", "m"): found.attach_point,
            },
        )
    for name, sensor in file.control.load_relief.items():
        if sensor.modes is not None:
            label = f"bending modes at the {name.replace('_', ' ')} sensor"
            note = f"{label}, {sensor.position_m:g} m forward of the gimbal plane"
            tables[sensor.modes.file] = note, time | _sensor(numbers, sensor.position_m)
    for load in file.loads:
        station = int(np.argmin(np.abs(numbers.stations + construction.gimbal_station - load.station_m)))
        forward = numbers.stations[station]
        note = f"vehicle station {load.station_m:g} m, {forward:.6g} m forward of the gimbal plane"
        tables[load.table.file] = note, time | _load(numbers, station)
        if load.local is not None:
            tables[load.local.file] = f"{note}; local angle of attack", time | _local_load(numbers, station)
        if load.shear is not None:
            tables[load.shear.file] = f"{note}; shear force", time | _shear(numbers, station)
        if load.axial is not None:
            tables[load.axial.file] = f"{note}; axial force", time | _axial(numbers, station)
    if file.tables.local_aerodynamics is not None:
        note = "integrals of the normal force over products of 1, x - X_CG, mode displacements and slopes"
        tables[file.tables.local_aerodynamics.file] = note, time | _local_integrals(numbers)
    if file.tables.loads_along_vehicle is not None:
        note = "coefficients of the bending moment at stations along the whole vehicle"
        by_station = [_load(numbers, s) | _local_load(numbers, s) for s in range(numbers.stations.size)]
        tables[file.tables.loads_along_vehicle.file] = (
            note,
            _along(numbers, file.start_time_s, numbers.stations, by_station),
        )
    if file.tables.shear_along_vehicle is not None:
        note = "coefficients of the shear force at stations along the whole vehicle"
        by_station = [_shear(numbers, s) for s in range(numbers.stations.size)]
        tables[file.tables.shear_along_vehicle.file] = (
            note,
            _along(numbers, file.start_time_s, numbers.stations, by_station),
        )
    if file.tables.axial_along_vehicle is not None:
        note = "coefficients of the axial force at stations along the whole vehicle"
        by_station = [_axial(numbers, s) | _radius(numbers, s) for s in range(numbers.stations.size)]
        tables[file.tables.axial_along_vehicle.file] = (
            note,
            _along(numbers, file.start_time_s, numbers.stations, by_station),
        )
    if file.tables.normal_force_along_vehicle is not None:
        note = "normal force by strips along the vehicle, cut at the load stations; stations are their middles"
        tables[file.tables.normal_force_along_vehicle.file] = note, _strips(numbers, file.start_time_s)
    return tables


def table_text(comments: Iterable[str], columns: Columns) -> str:
    """Return a table as CSV with comments above."""
    lines = [f"# {comment}" for comment in comments]
    lines.append(",".join(f"{name} [{unit}]" for name, unit in columns))
    rows = np.stack(list(columns.values()), axis=1) + 0.0  # no minus before a zero
    rows[np.abs(rows) < ROUNDING * np.abs(rows).max(axis=0)] = 0.0  # where moments vanish: else no two builds agree
    lines += [",".join(f"{value:.{DIGITS}g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def _rigid(numbers: VehicleNumbers) -> Columns:
    properties = numbers.properties
    return {
        ("mass", "kg"): properties.mass,
        ("moment_of_inertia", "kg m2"): properties.moment_of_inertia,
        ("center_of_gravity", "m"): properties.center_of_gravity,
    }


def _bending(numbers: VehicleNumbers, mode: int) -> Columns:
    modes, construction = numbers.modes, numbers.construction
    sensor = construction.forward_of_gimbal(construction.sensor_station)
    shapes = modes.displacement[:, mode], modes.rotation[:, mode]

    def at(points: Array | float, which: int) -> Array:
        return _along_beam(numbers, shapes[which], points)

    points = {tank: found.attach_point for tank, found in numbers.slosh.items()}
    force = numbers.line.total(numbers.intensity * numbers.displacement[:, mode])
    moved = numbers.line.total(numbers.intensity * numbers.slope[:, mode])
    return {
        ("frequency", "rad/s"): modes.frequency[:, mode],
        ("generalized_mass", "kg"): modes.generalized_mass[:, mode],
        ("displacement_at_gimbal", "1"): at(0.0, 0),
        ("slope_at_gimbal", "1/m"): at(0.0, 1),
        ("slope_at_sensor", "1/m"): at(sensor, 1),
        ("normal_force_slope_times_displacement", "1/rad"): force,
        ("normal_force_slope_times_slope", "1/m/rad"): moved,
        **{(f"displacement_at_{tank}", "1"): at(x, 0) for tank, x in points.items()},
        **{(f"slope_at_{tank}", "1/m"): at(x, 1) for tank, x in points.items()},
    }


def _sensor(numbers: VehicleNumbers, position: float) -> Columns:
    """Return the columns of model/vehicle/columns.py: mode_columns."""
    found: Columns = {}
    for mode in range(numbers.construction.bending_modes):
        shapes = numbers.modes.displacement[:, mode], numbers.modes.rotation[:, mode]
        for (name, unit), shape in zip((("displacement", "1"), ("slope", "1/m")), shapes, strict=True):
            found[f"{name}_{mode + 1}", unit] = _along_beam(numbers, shape, position)
    return found


def _along_beam(numbers: VehicleNumbers, shapes: Array, points: Array | float) -> Array:
    """Return shapes (t, points of the beam) at one point for each time, m forward of the gimbal plane."""
    points = np.broadcast_to(points, numbers.modes.time.shape)
    return np.array([np.interp(x, numbers.modes.x, shape) for x, shape in zip(points, shapes, strict=True)])


def _load(numbers: VehicleNumbers, station: int) -> Columns:
    rows = [load_columns(row, list(numbers.slosh)) for row in numbers.loads]
    return {key: np.array([row[key][station] for row in rows]) for key in rows[0]}


def _local_load(numbers: VehicleNumbers, station: int) -> Columns:
    rows = [local_load_columns(row) for row in numbers.loads]
    return {key: np.array([row[key][station] for row in rows]) for key in rows[0]}


def _shear(numbers: VehicleNumbers, station: int) -> Columns:
    rows = [shear_columns(row) for row in numbers.shears]
    return {key: np.array([row[key][station] for row in rows]) for key in rows[0]}


def _axial(numbers: VehicleNumbers, station: int) -> Columns:
    assert numbers.axial is not None  # checked before the build
    return {key: np.array([row[key][station] for row in numbers.axial]) for key in numbers.axial[0]}


def _radius(numbers: VehicleNumbers, station: int) -> Columns:
    construction = numbers.construction
    assert construction.outline is not None
    radius = construction.outline.at(numbers.stations[station] + construction.gimbal_station)
    return {(RADIUS.name, RADIUS.unit): np.full(numbers.flight.time.size, float(radius))}


def _along(numbers: VehicleNumbers, start: float, stations: Array, by_station: Sequence[Columns]) -> Columns:
    """Return columns at all stations, time by time from the last row before the start of the model on."""
    times = numbers.flight.time
    times = times[max(0, int(np.searchsorted(times, start, side="right")) - 1) :]
    gimbal = numbers.construction.gimbal_station
    values = (np.repeat(times, stations.size), *(np.tile(x, times.size) for x in (stations + gimbal, stations)))
    arguments = {(column.name, column.unit): value for column, value in zip(ALONG_ARGUMENTS, values, strict=True)}
    return arguments | {
        key: np.array([found[key][-times.size :] for found in by_station]).T.ravel() for key in by_station[0]
    }


def _strips(numbers: VehicleNumbers, start: float) -> Columns:
    """Return the normal force by strips between stations and its corners; those without any are left out."""
    edges = Line.cut_at(numbers.stations, aerodynamics.knots(numbers.construction)).edges
    integrands = {
        ("normal_force_slope", "1/rad"): numbers.intensity,
        ("first_moment", "m/rad"): numbers.intensity * numbers.line.points,
        **{
            (f"displacement_{i + 1}", "1/rad"): numbers.intensity * numbers.displacement[:, i]
            for i in range(numbers.construction.bending_modes)
        },
    }
    found = {key: -np.diff(numbers.line.forward(density, edges)) for key, density in integrands.items()}
    size = np.abs(found["normal_force_slope", "1/rad"]).max(axis=0)
    kept = np.flatnonzero(size > ROUNDING * size.max())
    by_strip = [{key: values[:, k] for key, values in found.items()} for k in kept]
    return _along(numbers, start, 0.5 * (edges[:-1] + edges[1:])[kept], by_strip)


def _local_integrals(numbers: VehicleNumbers) -> Columns:
    """Return the columns of model/vehicle/columns.py: local_columns."""
    arm = numbers.line.points - numbers.properties.center_of_gravity[:, None]
    Y, slope = np.moveaxis(numbers.displacement, 1, 0), np.moveaxis(numbers.slope, 1, 0)
    modes = range(numbers.construction.bending_modes)
    densities = {
        ("arm", "m/rad"): arm,
        ("arm_squared", "m2/rad"): arm**2,
        **{(f"arm_displacement_{i + 1}", "m/rad"): arm * Y[i] for i in modes},
        **{(f"slope_{i + 1}", "1/m/rad"): slope[i] for i in modes},
        **{(f"arm_slope_{i + 1}", "1/rad"): arm * slope[i] for i in modes},
        **{
            (f"displacement_{i + 1}_displacement_{j + 1}", "1/rad"): Y[i] * Y[j] for i in modes for j in modes if j >= i
        },
        **{(f"displacement_{i + 1}_slope_{j + 1}", "1/m/rad"): Y[i] * slope[j] for i in modes for j in modes},
    }
    return {key: numbers.line.total(numbers.intensity * density) for key, density in densities.items()}
