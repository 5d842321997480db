"""Tables that a vehicle names beside those of its equations, held against them: what is stated twice must agree."""

from __future__ import annotations

import tomllib
import warnings

import numpy as np
from numpy.typing import NDArray

from ..errors import PlausibilityWarning
from ..files.csv_table import read_csv_table
from ..files.folder_files import file_inside
from ..vehicle.columns import TIME, local_columns
from ..vehicle.shipped import VEHICLE_FILE
from ..vehicle.vehicle import Vehicle
from .station_loads import StationLoads, load_station_loads

CONSTRUCTION_FILE = "construction.toml"
SAME_AREA = 1e-6  # relative
DIFFERENT = 0.01  # of the largest value of the column


def compare_stated_twice(vehicle: Vehicle) -> None:
    """Hold the loads along the vehicle and the integrals of the normal force against the other tables.

    The loads' own tables are stations along the vehicle. Forward of the aft end lies the whole vehicle: S_1 is there
    mass times X_CG - x and S_2 the moment of inertia. The integral of c'_N times x - X_CG is C'_N (X_CP - X_CG).
    A construction beside the vehicle has its reference area.

    Raises
    ------
    DataError
        A table that vehicle.toml names cannot be read.

    Warns
    -----
    PlausibilityWarning
        Both numbers, and where they stand.
    """
    if vehicle.file.tables.loads_along_vehicle is not None:
        _compare_whole(vehicle, load_station_loads(vehicle))
    if vehicle.file.tables.local_aerodynamics is not None:
        _compare_arm(vehicle)
    _compare_area(vehicle)


def _compare_whole(vehicle: Vehicle, along: StationLoads) -> None:
    entry = vehicle.file.tables.loads_along_vehicle
    assert entry is not None
    name, aft = entry.file, along.forward_of_gimbal[0]
    first, second = along.tables["first_moment"][0], along.tables["second_moment"][0]
    if np.abs(along.tables["engine_angle"][0].values).max() > 0:  # not the aft end
        return
    time = _common(vehicle, first.argument)
    mass, center = (_at(vehicle, name, time) for name in ("mass", "center_of_gravity"))
    _tell(name, "first_moment", time, first.polynomial(time), mass * (center - aft), "mass and center_of_gravity")
    inertia = _at(vehicle, "moment_of_inertia", time)
    _tell(name, "second_moment", time, second.polynomial(time), inertia, "moment_of_inertia")


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
