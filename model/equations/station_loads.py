"""Load coefficients along the whole vehicle: a table of stations by times."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, PlausibilityWarning
from ..files.csv_table import read_csv_table
from ..files.folder_files import file_inside
from ..tables import Table
from ..vehicle.columns import (
    ALONG_ARGUMENTS,
    AXIAL,
    RADIUS,
    TIME,
    Column,
    along_columns,
    by_need_columns,
    whole_shear_columns,
)
from ..vehicle.loads import AXIAL_FORCE, BENDING_MOMENT, SHEAR_FORCE, load_name
from ..vehicle.mean_wind import in_air
from ..vehicle.noise_loads import needed_columns
from ..vehicle.vehicle import Vehicle
from ..vehicle.vehicle_file import TableEntry

KEYS = {
    BENDING_MOMENT: "loads_along_vehicle",
    SHEAR_FORCE: "shear_along_vehicle",
    AXIAL_FORCE: "axial_along_vehicle",
}
SAME_STATION = 1e-6  # m
SAME_GIMBAL = 1e-3  # m
DIFFERENT = 1e-3  # of the largest coefficient


@dataclass(frozen=True, eq=False)
class StationLoads:
    """Coefficients of a load at stations.

    Attributes
    ----------
    station, forward_of_gimbal : (s,) arrays
        Vehicle station and metres forward of the gimbal plane (m).
    tables : dict of str to tuple of Table
        By column of a load's table, one table over time for each station.
    """

    station: NDArray[np.float64]
    forward_of_gimbal: NDArray[np.float64]
    tables: dict[str, tuple[Table, ...]]

    def at(self, times: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return every column at times, (times, s).

        Raises
        ------
        DataError
            For a time that the table does not cover.
        """
        first = next(iter(self.tables.values()))[0].argument
        for time in times:
            if not first[0] <= time <= first[-1]:
                raise DataError(
                    f"t = {time:g} s lies outside of the loads along the vehicle, {first[0]:g} to {first[-1]:g} s; "
                    "build the vehicle for it"
                )
        return {name: np.array([table.polynomial(times) for table in tables]).T for name, tables in self.tables.items()}


def station_table(vehicle: Vehicle, load: str) -> TableEntry:
    """Return the table of a load along the vehicle, one of ``KEYS``.

    Raises
    ------
    DataError
        If there is none.
    """
    entry: TableEntry | None = getattr(vehicle.file.tables, KEYS[load])
    if entry is None:
        raise DataError(
            f"is missing, but the {load.replace('_', ' ')} along the vehicle needs it; 'ascentwind build-vehicle' "
            "makes it",
            file=vehicle.folder / "vehicle.toml",
            column=f"tables.{KEYS[load]}",
        )
    return entry


def load_station_loads(vehicle: Vehicle, load: str = BENDING_MOMENT) -> StationLoads:
    """Read the table of a load along the vehicle.

    Parameters
    ----------
    vehicle : Vehicle
    load : {'bending_moment', 'shear_force', 'axial_force'}

    Raises
    ------
    DataError
        If there is none, if a column is missing, or if the stations differ from time to time.
    """
    entry, modes, tanks = station_table(vehicle, load), len(vehicle.bending), [tank.name for tank in vehicle.slosh]
    file: Path = file_inside(vehicle.folder, entry.file)
    csv = read_csv_table(file, TIME.name, TIME.unit, order="not decreasing")
    columns = {
        BENDING_MOMENT: along_columns(modes, tanks),
        SHEAR_FORCE: whole_shear_columns(modes),
        AXIAL_FORCE: (*AXIAL, RADIUS),
    }[load]
    by_need = {column.name for column in by_need_columns(modes)}
    needed = {column.name for column in needed_columns(vehicle.file)[0]}
    columns = tuple(column for column in columns if column.name in needed or column.name not in by_need)
    for column in (*ALONG_ARGUMENTS, *columns):
        csv.column(column.name, column.unit)
    time, station = csv.columns["time"], csv.columns["station"]
    times, stations = np.unique(time), np.unique(station)
    shape = times.size, stations.size
    order = np.lexsort((station, time))
    if order.size != times.size * stations.size or (station[order].reshape(shape) != stations).any():
        raise DataError(
            f"has {order.size} rows for {times.size} times and {stations.size} stations; give every station once at "
            "every time",
            file=file,
        )
    breaks = tuple(sorted(vehicle.file.events[event] for event in entry.events if event in vehicle.file.events))

    def tables(column: Column) -> tuple[Table, ...]:
        values = csv.columns[column.name][order].reshape(shape)
        found = (Table(column.name, column.unit, times, row, entry.interpolation, breaks) for row in values.T)
        return tuple(in_air(vehicle, table, column.name) for table in found)

    forward = csv.columns["forward_of_gimbal"][order].reshape(shape)[0]
    found = StationLoads(stations, forward, {column.name: tables(column) for column in columns})
    _compare(vehicle, load, found, file)
    return found


def _compare(vehicle: Vehicle, quantity: str, along: StationLoads, file: Path) -> None:
    """Warn where a load's own table and the stations along the vehicle tell of different vehicles."""
    gimbal = along.station[0] - along.forward_of_gimbal[0]
    for i, load in enumerate(vehicle.file.loads):
        own_gimbal = gimbal if load.forward_of_gimbal_m is None else load.station_m - load.forward_of_gimbal_m
        if abs(own_gimbal - gimbal) > SAME_GIMBAL:
            warnings.warn(
                f"{vehicle.folder / 'vehicle.toml'}, column 'loads.{i}.forward_of_gimbal_m': is "
                f"{load.forward_of_gimbal_m:g} m, which puts the gimbal plane at station {own_gimbal:g} m; {file.name} "
                f"puts it at {gimbal:g} m; correct one",
                PlausibilityWarning,
                stacklevel=3,
            )
        k = int(np.argmin(np.abs(along.station - load.station_m)))
        entry = {BENDING_MOMENT: load.table, SHEAR_FORCE: load.shear, AXIAL_FORCE: load.axial}[quantity]
        if entry is None or abs(along.station[k] - load.station_m) > SAME_STATION:
            continue
        name = load_name(load.output, quantity)
        for column, tables in along.tables.items():
            own, other = vehicle.tables.get(f"loads.{name}.{column}"), tables[k]
            if own is None:
                continue
            times = other.argument[(other.argument >= own.argument[0]) & (other.argument <= own.argument[-1])]
            here, there = own.polynomial(times), other.polynomial(times)
            off = np.abs(here - there)
            worst = int(np.argmax(off))
            if off[worst] > DIFFERENT * np.abs(here).max():
                warnings.warn(
                    f"{file}, column '{column}', t = {times[worst]:g} s: is {there[worst]:.6g} at station "
                    f"{load.station_m:g} m, but {entry.file} has {here[worst]:.6g}; build both again, or look at "
                    "the column's unit, sign and rows",
                    PlausibilityWarning,
                    stacklevel=3,
                )
