"""Tables that a vehicle names beside those of its equations, held against them: what is stated twice must agree."""

from __future__ import annotations

import tomllib
import warnings

import numpy as np
from numpy.typing import NDArray

from ..errors import PlausibilityWarning
from ..files.csv_table import CsvTable, read_csv_table
from ..files.folder_files import file_inside
from ..vehicle.columns import MOVED_MODE, RADIUS, TIME, local_columns
from ..vehicle.loads import AXIAL_FORCE, BENDING_MOMENT, SHEAR_FORCE
from ..vehicle.shipped import VEHICLE_FILE
from ..vehicle.vehicle import Vehicle
from .station_loads import KEYS, SAME_STATION, StationLoads, load_station_loads

CONSTRUCTION_FILE = "construction.toml"
SAME_AREA = 1e-6  # relative
DIFFERENT = 0.01  # of the largest value of the column
NEAR = 0.05  # of the length, either way of a place, over which a mode's displacement is nearly that of the place
NEGATIVE = 0.1  # an eigenvalue of integrals of pairs, scaled to ones on the diagonal, by boat-tails
OFF_MODE = 0.2  # of the mode's largest displacement: what that, and stations far apart, leave; it is 0.1 at most


def compare_stated_twice(vehicle: Vehicle) -> None:
    """Hold the loads along the vehicle and the integrals of the normal force against the other tables.

    The loads' own tables are stations along the vehicle. Forward of the aft end lies the whole vehicle: S_1 is there
    mass times X_CG - x, S_2 the moment of inertia and slosh minus its mass times x_S - x; shear and axial force have
    the mass. From station to station the inertia of a mode is minus the mass between them times its displacement there.
    The integral of c'_N times x - X_CG is C'_N (X_CP - X_CG). A construction beside the vehicle
    has its reference area. The integral of c'_N times the slope of a mode's axis stands in that mode's table too, where
    the centre of pressure deviates.

    Raises
    ------
    DataError
        A table that vehicle.toml names cannot be read.

    Warns
    -----
    PlausibilityWarning
        Both numbers, and where they stand.
    """
    for load, key in KEYS.items():
        entry = getattr(vehicle.file.tables, key)
        if entry is not None:
            _compare_whole(vehicle, load, entry.file, load_station_loads(vehicle, load))
    if vehicle.file.tables.local_aerodynamics is not None:
        _compare_arm(vehicle)
    _compare_area(vehicle)


def _compare_whole(vehicle: Vehicle, load: str, name: str, along: StationLoads) -> None:
    """Hold what lies forward of the aft end against the whole vehicle, and the radius at stations against their own."""
    aft = along.forward_of_gimbal[0]
    time = _common(vehicle, next(iter(along.tables.values()))[0].argument)
    mass, center = (_at(vehicle, table, time) for table in ("mass", "center_of_gravity"))
    whole = {
        BENDING_MOMENT: (
            ("first_moment", mass * (center - aft), "mass and center_of_gravity"),
            ("second_moment", _at(vehicle, "moment_of_inertia", time), "moment_of_inertia"),
        ),
        SHEAR_FORCE: (("first_moment", mass, "mass"),),
        AXIAL_FORCE: (("mass_forward", mass, "mass"),),
    }[load]
    if load == BENDING_MOMENT:
        whole += tuple(
            (
                f"slosh_{tank.name}",
                _at(vehicle, f"slosh.{tank.name}.mass", time)
                * (aft - _at(vehicle, f"slosh.{tank.name}.attach_point", time)),
                f"mass and attach_point of {tank.name}",
            )
            for tank in vehicle.slosh
        )
    if load == SHEAR_FORCE:
        _compare_modes(vehicle, name, along)
    if load == AXIAL_FORCE:
        _compare_radius(vehicle, name, along)
    elif np.abs(along.tables["engine_angle"][0].values).max() > 0:  # not the aft end
        return
    for column, made, what in whole:
        _tell(name, column, time, np.asarray(along.tables[column][0].polynomial(time)), made, what)


def _compare_modes(vehicle: Vehicle, name: str, along: StationLoads) -> None:
    """Hold displacements of modes against the inertia in shear over a tenth of the vehicle around the place."""
    rows = along.tables["first_moment"][0].argument
    time = _common(vehicle, rows)
    if not time.size:
        return
    place, common = along.forward_of_gimbal, np.isin(rows, time)
    inertias = [f"bending_{i}" for i in range(1, len(vehicle.bending) + 1)]
    columns = {
        name: np.array([table.values[common] for table in along.tables[name]]).T for name in ("first_moment", *inertias)
    }
    reach = NEAR * (place[-1] - place[0])
    points = {"gimbal": np.zeros_like(time)}
    points |= {tank.name: _at(vehicle, f"slosh.{tank.name}.attach_point", time) for tank in vehicle.slosh}

    def around(column: str, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how much less of a coefficient lies forward of the near end than of the far one."""
        near, far = (
            np.array([np.interp(x + side, place, row) for x, row in zip(at, columns[column], strict=True)])
            for side in (-reach, reach)
        )
        return near - far

    for i, inertia in enumerate(inertias, start=1):
        file = vehicle.folder / vehicle.file.bending[i - 1].table.file
        stated = {point: _at(vehicle, f"bending.{i}.displacement_at_{point}", time) for point in points}
        largest = float(np.max(np.abs(list(stated.values()))))
        for point, at in points.items():
            mass = around("first_moment", at)
            made = np.where(mass > 0, -around(inertia, at) / np.where(mass > 0, mass, 1.0), stated[point])
            worst = int(np.argmax(np.abs(stated[point] - made)))
            if abs(stated[point][worst] - made[worst]) > OFF_MODE * largest:
                warnings.warn(
                    PlausibilityWarning(
                        f"{file}, column 'displacement_at_{point}', t = {time[worst]:g} s: is "
                        f"{stated[point][worst]:.4g}, but first_moment and {inertia} of {name} make {made[worst]:.4g} "
                        f"at {at[worst]:.4g} m; look at its sign, scale and place"
                    ),
                    stacklevel=5,
                )


def _compare_radius(vehicle: Vehicle, name: str, along: StationLoads) -> None:
    for i, load in enumerate(vehicle.file.loads):
        k = int(np.argmin(np.abs(along.station - load.station_m)))
        if load.radius_m is None or abs(along.station[k] - load.station_m) > SAME_STATION:
            continue
        stated = float(along.tables[RADIUS.name][k].values[0])
        if abs(load.radius_m - stated) > DIFFERENT * stated:
            warnings.warn(
                PlausibilityWarning(
                    f"{vehicle.folder / VEHICLE_FILE}, column 'loads.{i}.radius_m': is {load.radius_m:g} m, but {name} "
                    f"has {stated:g} m at station {load.station_m:g} m; look at its unit and station"
                ),
                stacklevel=4,
            )


def _compare_arm(vehicle: Vehicle) -> None:
    entry = vehicle.file.tables.local_aerodynamics
    assert entry is not None
    arm = local_columns(len(vehicle.bending))[0]
    csv = read_csv_table(file_inside(vehicle.folder, entry.file), TIME.name, TIME.unit)
    stated, all_times = csv.column(arm.name, arm.unit), csv.columns[TIME.name]
    time = _common(vehicle, all_times)
    slope, pressure, gravity = (
        _at(vehicle, name, time) for name in ("normal_force_slope", "center_of_pressure", "center_of_gravity")
    )
    made = slope * (pressure - gravity)
    what = "normal_force_slope, center_of_pressure and center_of_gravity"
    _tell(entry.file, arm.name, time, stated[np.isin(all_times, time)], made, what)
    _compare_slopes(vehicle, csv, time)
    _compare_products(vehicle, csv, time)


def _compare_slopes(vehicle: Vehicle, csv: CsvTable, time: NDArray[np.float64]) -> None:
    for i, mode in enumerate(vehicle.file.bending, start=1):
        table, name = f"bending.{i}.{MOVED_MODE.name}", f"slope_{i}"
        if table in vehicle.tables:
            stated = csv.column(name, MOVED_MODE.unit)[np.isin(csv.columns[TIME.name], time)]
            made, what = _at(vehicle, table, time), f"{MOVED_MODE.name} of {mode.table.file}"
            _tell(csv.file.name, name, time, stated, made, what)


def _compare_products(vehicle: Vehicle, csv: CsvTable, time: NDArray[np.float64]) -> None:
    """Hold sum c'_N Y against the other integrals of c'_N times 1, x - X_CG and Y, by pairs: a Gram matrix.

    With c'_N of one sign it has no negative eigenvalue, scaled to ones on its diagonal; boat-tails leave small ones.
    """
    modes, rows = range(1, len(vehicle.bending) + 1), np.isin(csv.columns[TIME.name], time)
    units = {column.name: column.unit for column in local_columns(len(vehicle.bending))}

    def integral(name: str) -> NDArray[np.float64]:
        return csv.column(name, units[name])[rows]

    gram = np.empty((time.size, len(modes) + 2, len(modes) + 2))
    gram[:, 0, 0], gram[:, 0, 1] = _at(vehicle, "normal_force_slope", time), integral("arm")
    gram[:, 1, 1] = integral("arm_squared")
    for i in modes:
        gram[:, 0, i + 1] = _at(vehicle, f"bending.{i}.normal_force_slope_times_displacement", time)
        gram[:, 1, i + 1] = integral(f"arm_displacement_{i}")
        for j in modes[i - 1 :]:
            gram[:, i + 1, j + 1] = integral(f"displacement_{i}_displacement_{j}")
    size = np.sqrt(np.abs(np.einsum("tii->ti", gram)))
    scaled = gram / np.where(size > 0, size, 1.0)[:, :, None] / np.where(size > 0, size, 1.0)[:, None, :]
    least = np.linalg.eigvalsh(scaled, UPLO="U")[:, 0]
    if not least.size or least.min() >= -NEGATIVE:
        return
    worst = int(np.argmin(least))
    warnings.warn(
        PlausibilityWarning(
            f"{csv.file}, t = {time[worst]:g} s: no normal force along the vehicle has both its integrals and the "
            "normal_force_slope and normal_force_slope_times_displacement of the other tables; look at the signs, "
            "scales and rows of all"
        ),
        stacklevel=4,
    )


def _compare_area(vehicle: Vehicle) -> None:
    toml = vehicle.folder / CONSTRUCTION_FILE
    if not toml.is_file():
        return
    try:
        built = tomllib.loads(toml.read_text(encoding="utf-8")).get("reference_area_m2")
    except (OSError, ValueError, RecursionError):  # faults of a file that is not used here are told by the build
        return
    area = vehicle.file.reference_area_m2
    if isinstance(built, float) and abs(area - built) > SAME_AREA * built:
        warnings.warn(
            PlausibilityWarning(
                f"{vehicle.folder / VEHICLE_FILE}, column 'reference_area_m2': is {area:g} m2, but {CONSTRUCTION_FILE} "
                f"has {built:g} m2, and coefficients are on that; make them equal, or build the tables again"
            ),
            stacklevel=3,
        )


def _common(vehicle: Vehicle, times: NDArray[np.float64]) -> NDArray[np.float64]:
    return times[(times >= vehicle.start) & (times <= vehicle.end)]


def _at(vehicle: Vehicle, name: str, time: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vehicle.tables[name].polynomial(time))


def _tell(
    file: str, column: str, time: NDArray[np.float64], stated: NDArray[np.float64], made: NDArray[np.float64], what: str
) -> None:
    if not time.size:
        return
    off = np.abs(stated - made)
    worst = int(np.argmax(off))
    if off[worst] > DIFFERENT * np.abs(made).max():
        warnings.warn(
            PlausibilityWarning(
                f"{file}, column '{column}', t = {time[worst]:g} s: is {stated[worst]:.6g}, but {what} make "
                f"{made[worst]:.6g}; build the tables again together, or look at units, signs and rows"
            ),
            stacklevel=4,
        )
