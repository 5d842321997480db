"""From a vehicle's folder to a vehicle: every table read, checked and put on common times."""

from __future__ import annotations

import math
import tomllib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..deprecation import warn_deprecated
from ..errors import DataError, DataErrorCollector, PlausibilityWarning, WindWarning, suggestion
from ..files.csv_table import CsvTable, Order, read_csv_table
from ..files.folder_files import file_inside
from ..files.text_file import read_text
from ..system.switches import switch_times
from ..tables import Table
from ..wind.filter_file import read_filter, read_two_component_filter
from ..wind.range_reference import check_against_edition
from ..wind.record import COMPONENTS, WindOrigin, WindRecord
from ..wind.shaping_filter import TwoPartKernel
from ..wind.statistics import WindModel, check_plausible, closed_form_filter, report_standard_deviation
from ..wind.turbulence import INTENSITY, Turbulence, turbulence_intensity
from ..wind.two_components import TwoComponentWind
from .columns import (
    AERODYNAMICS,
    ALONG_ARGUMENTS,
    ALTITUDE,
    AXIAL,
    AZIMUTH_CHANGE,
    GAINS,
    MOVED_MODE,
    OWN_ANGLE,
    PREFIX,
    PRODUCT_OF_INERTIA,
    PROPULSION,
    RIGID_BODY,
    SCHEDULE,
    SLOSH,
    TIME,
    TRAJECTORY,
    TURBULENCE,
    WIND,
    WIND_COMPONENTS,
    ZERO_ANGLE,
    Column,
    bending_columns,
    local_columns,
    mode_columns,
    normal_force_columns,
)
from .coverage import check_intensity, check_joint_correlation, check_schedule, check_winds, loaded_flight
from .loads import AXIAL_FORCE, LateralLoad, lateral_loads, load_name
from .mean_wind import through_mean_wind, with_biased_programme
from .names import name_faults
from .noise_loads import check_noises, form_is_open, form_of_tables, needed_columns, needed_for
from .planes import BOTH, SECTIONS, flown_planes, own_tables, plane_entry, plane_file, plane_names
from .plausibility import check_plausibility
from .shipped import VEHICLE_FILE
from .vehicle import TableSource, Vehicle
from .vehicle_file import (
    PlaneTablesEntry,
    TableEntry,
    TurbulenceEntry,
    VehicleFile,
    WindEntry,
    WindRecordEntry,
    read_vehicle_file,
)
from .zones import AHEAD, Strips, Zones, is_turbulent, make_zones, zone_count

REGULAR = 1.5  # times the usual step: in a table whose other steps are shorter, rows were lost at a longer one
CONSTRUCTION_FILE = "construction.toml"
IN_TITLE = {"yaw": "yaw plane", "pitch": "pitch plane", "both": "both planes"}  # of a title that names the plane
SAME_AZIMUTH = 1e-6  # deg
LARGEST_OWN_ANGLE = math.radians(30.0)  # of attack, of a flight without wind
FORMER_Q_ALPHA = "dynamic_pressure_times_angle_of_attack"


def load_vehicle(folder: Path, changes: Mapping[str, Any] | None = None) -> Vehicle:
    """Load a vehicle folder.

    Parameters
    ----------
    folder : Path
        Holds ``vehicle.toml`` and the CSV files it names.
    changes : mapping, optional
        Values to put in the place of the file's, by dotted key; see ``read_vehicle_file``.

    Returns
    -------
    Vehicle

    Raises
    ------
    DataError
        Names the file, column and row at fault.

    Warns
    -----
    ExtrapolationWarning, WindWarning
        A schedule or the wind is held where the flight is loaded; mean and filter of the wind do not fit together, or
        have no record.
    """
    toml = folder / VEHICLE_FILE
    if not toml.is_file():
        raise DataError(f"holds no {VEHICLE_FILE}; start from 'ascentwind new-vehicle DIR --from as504'", file=folder)
    collector = DataErrorCollector()
    file = read_vehicle_file(file_inside(folder, VEHICLE_FILE), changes, collector)
    with collector.part():
        _refuse_unused(changes or {}, file, toml)
    if FORMER_Q_ALPHA in file.options.extra_outputs:
        warn_deprecated(f"the extra output {FORMER_Q_ALPHA}", "q_alpha, which every vehicle has")
    reader = _Reader(folder, toml, file, collector)
    if file.planes != "yaw" and file.options.mean_response == "nonlinear":
        why = f'is of the yaw plane, and planes = "{file.planes}"; set it to "linear"'
        reader.collector.errors.append(DataError(why, file=toml, column="options.mean_response"))
    if file.roll_deg is not None and file.planes != BOTH:
        why = f'turns both planes, and planes = "{file.planes}"; fly "both" or leave it out'
        reader.collector.errors.append(DataError(why, file=toml, column="roll_deg"))
    if file.tables.product_of_inertia is not None and file.planes != BOTH:
        why = f'couples both planes, and planes = "{file.planes}"; fly "both" or leave it out'
        reader.refuse(why, "tables.product_of_inertia")
    for key, asked, why in (
        ("wind.air_speed", file.wind.air_speed != "no_wind", "the wind of the yaw plane blows across the path"),
        ("options.wind_biased_programme", file.options.wind_biased_programme, "the tilt programme is that of pitch"),
    ):
        if asked and file.planes == "yaw":
            why = f'changes nothing in planes = "yaw": {why}; fly "pitch" or "both", or leave it out'
            reader.collector.errors.append(DataError(why, file=toml, column=key))
    if file.options.trajectory_angle_of_attack and file.options.mean_response == "nonlinear":
        why = 'is of the linear mean, and mean_response = "nonlinear"; leave one of them out'
        reader.collector.errors.append(DataError(why, file=toml, column="options.trajectory_angle_of_attack"))
    reader.collector.errors += [DataError(why, file=toml, column=key) for key, why in name_faults(file)]
    with reader.collector.part():
        file = _with_noise_loads(file, folder, toml)
    names = plane_names(file)
    reader.add("rigid_body", file.tables.rigid_body, RIGID_BODY)
    flown = tuple(column for column in _ASKED_FOR if column in _asked_of_trajectory(file))
    reader.add("trajectory", file.tables.trajectory, (*TRAJECTORY, *flown), "", _ASKED_FOR)
    own_angles = _own_angles(reader, file.tables.trajectory)
    reader.add("propulsion", file.tables.propulsion, PROPULSION)
    if len(names) == 1:
        with reader.collector.part():
            _add_tables(reader, plane_file(file, next(iter(names))))
        _add_moment_of_inertia(reader, file, names[0], "")
    else:
        with reader.collector.part():
            _add_tables(reader, file)
        for name in names:
            with reader.collector.part():
                _add_plane(reader, file, name)
        if file.tables.product_of_inertia is not None:
            reader.add("product_of_inertia", file.tables.product_of_inertia, (PRODUCT_OF_INERTIA,))
    wind = turbulence = None
    with reader.collector.part():
        wind = _load_both(file.wind, reader) if file.planes == BOTH else _load_wind(file, reader)
        turbulence = _load_turbulence(file.wind.turbulence, wind, reader)
    zoned = file if len(names) > 1 else plane_file(file, next(iter(names)))
    strips = reader.collector.take(lambda: _read_strips(reader, zoned))
    reader.collector.raise_all()
    zones = None if strips is None else _make_zones(reader, zoned, strips)
    for name, noise in file.noise.items():
        for table in noise.tables:
            if table not in reader.tables:
                why = f"there is no table '{table}'{suggestion(table, reader.tables)}"
                reader.collector.errors.append(DataError(why, file=toml, column=f"noise.{name}"))
    reader.collector.raise_all()
    assert wind is not None  # its error was raised
    timed = [s for s in reader.sources if not s.name.startswith("wind") and "control." not in s.name]
    first, last = max(timed, key=lambda s: s.first), min(timed, key=lambda s: s.last)
    start = file.start_time_s
    if start < first.first:
        raise DataError(
            f"start_time_s = {start:g} lies before the first row of {first.file.name} at {first.first:g} s; "
            "start later or extend the table",
            file=toml,
            column="start_time_s",
        )
    if start >= last.last:
        raise DataError(
            f"start_time_s = {start:g} is not before the end of {last.file.name} at {last.last:g} s",
            file=toml,
            column="start_time_s",
        )
    vehicle = Vehicle(
        name=file.name,
        title=file.title.replace("yaw plane", IN_TITLE[file.planes]),
        folder=folder,
        file=file,
        tables=reader.tables,
        wind=wind,
        start=start,
        end=last.last,
        discontinuities=switch_times((t for t in reader.discontinuities if start < t < last.last), start),
        sources=tuple(reader.sources),
        turbulence=turbulence,
        zones=zones,
        own_angles=own_angles,
    )
    for plane in flown_planes(vehicle):
        with reader.collector.part():
            check_plausibility(plane.vehicle)
    with reader.collector.part():
        _check_product_of_inertia(vehicle)
    _check_coverage(reader, wind, turbulence, start, last.last)
    reader.collector.raise_all()
    if file.wind.air_speed == "mean_wind":
        vehicle = through_mean_wind(vehicle)
    return with_biased_programme(vehicle) if file.options.wind_biased_programme else vehicle


def _check_product_of_inertia(vehicle: Vehicle) -> None:
    """Refuse a product of inertia beyond the root of the moments of inertia: no masses have it."""
    product = vehicle.tables.get(PRODUCT_OF_INERTIA.name)
    if product is None:
        return
    moments = [plane.vehicle.tables["moment_of_inertia"] for plane in flown_planes(vehicle)]
    times = np.unique(np.concatenate([table.argument for table in (product, *moments)]))
    times = times[(times >= vehicle.start) & (times <= vehicle.end)]
    stated, pitch, yaw = (np.asarray(table.polynomial(times)) for table in (product, *moments))
    beyond = np.flatnonzero(np.abs(stated) >= np.sqrt(pitch * yaw))
    if beyond.size:
        k = beyond[0]
        raise DataError(
            f"is {stated[k]:g} kg m2 at {times[k]:g} s, not below the root of the moments of inertia in pitch and yaw, "
            f"{np.sqrt(pitch[k] * yaw[k]):g} kg m2; no masses have that",
            file=next(s.file for s in vehicle.sources if s.name == PRODUCT_OF_INERTIA.name),
            column=PRODUCT_OF_INERTIA.label,
        )


# columns of the trajectory that an option asks for, and it
_ASKED_FOR = {
    **dict.fromkeys(OWN_ANGLE.values(), "options.trajectory_angle_of_attack"),
    AZIMUTH_CHANGE: "wind.azimuth_change",
}


def _asked_of_trajectory(file: VehicleFile) -> set[Column]:
    """Return the columns that a vehicle's options ask for."""
    own = {OWN_ANGLE[plane] for plane in plane_names(file)} if file.options.trajectory_angle_of_attack else set()
    return own | ({AZIMUTH_CHANGE} if file.wind.azimuth_change and file.planes == BOTH else set())


def _own_angles(reader: _Reader, entry: TableEntry) -> dict[str, Table]:
    """Return the angles of attack of the flight without wind itself, by plane, where its table has them."""
    found = {}
    with reader.collector.part():
        csv = read_csv_table(file_inside(reader.folder, entry.file), TIME.name, TIME.unit)
        breaks = tuple(sorted(reader.events[event] for event in entry.events if event in reader.events))
        for plane, column in OWN_ANGLE.items():
            if column.name in csv.columns:
                values = csv.column(column.name, column.unit)
                large = np.flatnonzero(np.abs(values) > LARGEST_OWN_ANGLE)
                if large.size:
                    raise DataError(
                        f"is {values[large[0]]:g} rad, {math.degrees(values[large[0]]):.0f} degrees, at which no "
                        "vehicle climbs; is it in degrees?",
                        file=csv.file,
                        column=column.name,
                        row=csv.lines[large[0]],
                    )
                found[plane] = Table(column.name, column.unit, csv.columns["time"], values, entry.interpolation, breaks)
    return found


SHORTEST_WAVE = 1.0  # m, of turbulence
EVERYTHING = frozenset((*SECTIONS, *PlaneTablesEntry.model_fields))


def _add_tables(reader: _Reader, file: VehicleFile, scope: str = "", wanted: frozenset[str] = EVERYTHING) -> None:
    """Read the tables of a plane of which a vehicle may have two: all, or those of some sections alone."""
    if "aerodynamics" in wanted:
        reader.add(f"{scope}aerodynamics", file.tables.aerodynamics, AERODYNAMICS, scope, (), (ZERO_ANGLE,))
    if "control" in wanted:
        reader.add(f"{scope}control.gains", file.control.gains, GAINS, f"{scope}control.")
        _add_load_relief(reader, file, scope)
    tanks, modes = [tank.name for tank in file.slosh], len(file.bending)
    of_loads, of_modes = needed_columns(file)
    for i, mode in enumerate(file.bending if "bending" in wanted else (), start=1):
        name = f"{scope}bending.{i}"
        reader.add(name, mode.table, (*bending_columns(tanks), *of_modes), f"{name}.", (MOVED_MODE,))
    for tank in file.slosh if "slosh" in wanted else ():
        reader.add(f"{scope}slosh.{tank.name}", tank.table, SLOSH, f"{scope}slosh.{tank.name}.")
    for load in lateral_loads(file) if "loads" in wanted else ():
        by_need, needed = load.by_need(modes), {column.name for column in of_loads}
        columns = dict.fromkeys((*load.columns(modes, tanks), *(c for c in by_need if c.name in needed)))
        answer, zones = file.options.slosh_reaction, zone_count(file) > 1
        if answer or zones:
            if load.station.forward_of_gimbal_m is None:
                why = f"is missing, but options.{'slosh_reaction' if answer else 'gust_zones'} needs it"
                reader.refuse(
                    f"{why}; give metres forward of the gimbal plane",
                    f"{scope}loads.{load.output}.forward_of_gimbal_m",
                )
            columns |= dict.fromkeys(load.reaction if answer else load.reaction[1:])
        unused = (*by_need, *(load.local_columns(modes) if load.is_shear else ()))
        name = f"{scope}loads.{load.output}"
        reader.add(name, load.table, tuple(columns), f"{name}.", unused)
    for entry in file.loads if "loads" in wanted else ():
        if entry.axial:
            name = f"{scope}loads.{load_name(entry.output, AXIAL_FORCE)}"
            reader.add(name, entry.axial, AXIAL, f"{name}.")
    if file.options.local_angle_of_attack:
        _add_local(reader, file, scope, wanted)


def _add_plane(reader: _Reader, file: VehicleFile, plane: str) -> None:
    """Read what one of two planes has for itself."""
    entry, own = plane_entry(file, plane), plane_file(file, plane)
    stated = {section for section in SECTIONS if getattr(entry, section) is not None}
    tanks = [[tank.name for tank in f.slosh] for f in (file, own)]
    for needs, differs, what in (
        ("bending", tanks[0] != tanks[1], "other slosh tanks"),
        ("loads", tanks[0] != tanks[1], "other slosh tanks"),
        ("loads", len(file.bending) != len(own.bending), "another number of bending modes"),
    ):
        if differs and needs not in stated and getattr(file, needs):
            why = f"is missing, but this plane has {what}, and {needs} have columns for each; give its own"
            raise DataError(why, file=reader.toml, column=f"{plane}.{needs}")
    _add_tables(reader, own, f"{plane}.", frozenset((*stated, *own_tables(entry))))
    _add_moment_of_inertia(reader, file, plane, f"{plane}.")


def _add_moment_of_inertia(reader: _Reader, file: VehicleFile, plane: str, scope: str) -> None:
    table = plane_entry(file, plane).tables.moment_of_inertia
    if table is not None:
        column = next(column for column in RIGID_BODY if column.name == "moment_of_inertia")
        reader.add(f"{plane}.moment_of_inertia", table, (column,), scope)


def _with_noise_loads(file: VehicleFile, folder: Path, toml: Path) -> VehicleFile:
    """Check what noises do to the loads; where the file leaves it open, take the form that its tables allow."""
    check_noises(file, toml)
    if not form_is_open(file):
        return file
    form, warning = form_of_tables(folder, toml, file)
    if warning is not None:
        warnings.warn(warning, stacklevel=3)
    return file.model_copy(update={"options": file.options.model_copy(update={"noise_loads": form})})


def _refuse_unused(changes: Mapping[str, Any], file: VehicleFile, toml: Path) -> None:
    """Refuse changes to what the vehicle's options leave aside."""
    for key in changes:
        parts = key.split(".")
        for idle, concerned, why in (
            (not file.wind.fitted, parts[:2] == ["wind", "filter"], 'wind.synthesis = "fitted"'),
            (file.wind.fitted, parts[:2] == ["wind", "correlation"], 'wind.synthesis = "closed_form"'),
            (file.planes != BOTH, parts[:2] == ["wind", "azimuth_change"], 'planes = "both"'),
            (
                not file.options.local_angle_of_attack,
                "local_aerodynamics" in parts or (parts[0] == "loads" and "local" in parts),
                "options.local_angle_of_attack = true",
            ),
        ):
            if idle and concerned:
                raise DataError(f"changes nothing here; it is used with {why}", file=toml, column=key)


def _add_load_relief(reader: _Reader, file: VehicleFile, scope: str) -> None:
    """Read gain schedules and bending modes of the load-relief sensors."""
    for sensor, entry in file.control.load_relief.items():
        prefix = f"{scope}control.{sensor}."
        if entry.schedule:
            reader.add(f"{prefix}schedule", entry.schedule, SCHEDULE, prefix)
        if entry.modes:
            reader.add(f"{scope}load_relief.{sensor}", entry.modes, mode_columns(len(file.bending)), prefix)
        elif file.bending:
            columns = ", ".join(column.label for column in mode_columns(len(file.bending)))
            reader.refuse(f"is missing; name a table of {columns} at the sensor", f"{prefix}modes")


def _add_local(reader: _Reader, file: VehicleFile, scope: str, wanted: frozenset[str]) -> None:
    """Read the integrals that the option local_angle_of_attack needs."""
    modes, missing = (
        len(file.bending),
        "is missing, but options.local_angle_of_attack needs it; 'ascentwind build-vehicle' makes it",
    )
    if file.tables.local_aerodynamics is None:
        reader.refuse(missing, "tables.local_aerodynamics")
    elif "local_aerodynamics" in wanted:
        table = file.tables.local_aerodynamics
        reader.add(f"{scope}local_aerodynamics", table, local_columns(modes), f"{scope}{PREFIX}")
    for load in lateral_loads(file) if "loads" in wanted else ():
        if load.local is None:
            reader.refuse(missing, f"{scope}loads.{load.output}.local")
            continue
        name = f"{scope}{PREFIX}loads.{load.output}"
        rest = (*load.columns(modes, ()), *load.by_need(modes)) if load.is_shear else ()
        reader.add(name, load.local, load.local_columns(modes), f"{name}.", rest)


class _Reader:
    """Collects tables, their sources and the times at which they jump."""

    def __init__(self, folder: Path, toml: Path, file: VehicleFile, collector: DataErrorCollector):
        self.folder, self.toml, self.events, self.start = folder, toml, file.events, file.start_time_s
        self.file = file
        self.tables: dict[str, Table] = {}
        self.sources: list[TableSource] = []
        self.discontinuities: set[float] = set()
        self.collector = collector
        self.schedules: dict[str, tuple[Table, Path]] = {}

    def refuse(self, why: str, key: str) -> None:
        """Keep what is wrong with a key of vehicle.toml."""
        self.collector.errors.append(DataError(why, file=self.toml, column=key))

    def read(
        self,
        name: str,
        entry: TableEntry,
        columns: Iterable[Column],
        argument: Column,
        unused: Iterable[Column] = (),
        order: Order = "increasing",
    ) -> CsvTable:
        columns = tuple(columns)
        csv = read_csv_table(file_inside(self.folder, entry.file), argument.name, argument.unit, order=order)
        x, collector = csv.columns[argument.name], DataErrorCollector()
        for column in columns:
            with collector.part():
                if column.name not in csv.columns and (key := needed_for(column.name) or _ASKED_FOR.get(column)):
                    why = f"is missing, but {key} needs it; 'ascentwind build-vehicle' writes it"
                    raise DataError(why, file=csv.file, column=column.label)
                csv.column(column.name, column.unit)
                if column.sign:
                    csv.require_positive(column.name, allow_zero=column.sign == "0")
        unknown = set(csv.columns) - {column.name for column in (*columns, *unused)} - {argument.name}
        known = [column.name for column in columns]
        for extra in sorted(unknown):
            why = f"is not a column that this table uses{suggestion(extra, known)}; remove it"
            collector.errors.append(DataError(why, file=csv.file, column=extra))
        collector.raise_all()
        self.sources.append(TableSource(name, csv.file, entry.status, entry.source, float(x[0]), float(x[-1])))
        return csv

    def add(
        self,
        name: str,
        entry: TableEntry,
        columns: Sequence[Column],
        prefix: str = "",
        unused: Iterable[Column] = (),
        where_there: Iterable[Column] = (),
    ) -> None:
        """Read a table; what is wrong with it is kept in ``collector``."""
        with self.collector.part():
            self._add(name, entry, columns, prefix, unused, tuple(where_there))

    def _add(
        self,
        name: str,
        entry: TableEntry,
        columns: Sequence[Column],
        prefix: str,
        unused: Iterable[Column],
        where_there: Sequence[Column],
    ) -> None:
        csv = self.read(name, entry, columns, TIME, (*unused, *where_there))
        for column in where_there:
            if column.name in csv.columns:
                csv.column(column.name, column.unit)
                columns = (*columns, column)
        breaks = self.breaks(name, entry)
        x = csv.columns["time"]
        _warn_of_gap(csv, 4 if entry.interpolation in ("cubic", "pchip") else 10)
        if entry.interpolation == "step":
            self.discontinuities.update(x[1:].tolist())
        collector = DataErrorCollector()
        for column, unit, sign, _ in columns:
            try:
                table = Table(prefix + column, unit, x, csv.columns[column], entry.interpolation, breaks)
                self._check_between_rows(table, sign)
            except DataError as error:
                collector.errors.append(DataError(error.why, file=csv.file, column=column, time=error.time))
                continue
            self.tables[table.name] = table
            if "control." in name:
                self.schedules[name] = (table, csv.file)
        collector.raise_all()

    def breaks(self, name: str, entry: TableEntry) -> tuple[float, ...]:
        """Return the times (s) at which a table may jump."""
        for event in entry.events:
            if event not in self.events:
                raise DataError(
                    f"event '{event}' is not listed under [events]{suggestion(event, self.events)}",
                    file=self.toml,
                    column=name,
                )
        found = tuple(sorted(self.events[event] for event in entry.events))
        self.discontinuities.update(found)
        return found

    def _check_between_rows(self, table: Table, sign: str) -> None:
        """Refuse an interpolation that leaves the range its rows keep, and an altitude that does not increase."""
        begin, end = max(self.start, table.argument[0]), table.argument[-1]
        if begin >= end:
            return
        times = np.linspace(begin, end, 20 * table.argument.size)
        values = table.polynomial(times)
        if sign == "+" and not (values > 0).all():
            raise DataError(
                "the interpolation between rows is not positive; add rows or set interpolation = 'pchip'",
                time=float(times[int(np.argmin(values))]),
            )
        if table.name == "altitude":
            rate = table.polynomial.derivative()(times)
            if not (rate > 0).all():
                raise DataError(
                    "does not increase, but the wind filter needs a vehicle that ascends; end the tables there, start "
                    "later or set interpolation = 'pchip'",
                    time=float(times[int(np.argmin(rate))]),
                )


def _warn_of_gap(csv: CsvTable, fewest: int) -> None:
    """Warn of rows far apart where the others are close: the values between them are interpolated.

    Of fewer steps than ``fewest`` nobody can tell which are usual; a curve of straight lines has them where it bends.
    """
    x = csv.columns["time"]
    steps = np.diff(x)
    widest, usual = int(np.argmax(steps)), float(np.median(steps))
    regular = bool((steps < REGULAR * usual).sum() >= steps.size - 1)  # all others, rows beside events included
    if steps.size >= fewest and steps[widest] > (
        REGULAR * usual if regular else max(10 * usual, 0.05 * (x[-1] - x[0]))
    ):
        warnings.warn(
            PlausibilityWarning(
                f"{csv.file}, line {csv.lines[widest + 1]}: no rows between {x[widest]:g} and {x[widest + 1]:g} s, "
                f"where others are {usual:g} s apart; values there are interpolated. Add the rows if they were lost"
            ),
            stacklevel=2,
        )


def _load_both(entry: WindEntry, reader: _Reader) -> TwoComponentWind:
    """Read zonal and meridional wind for both planes."""
    missing = [
        DataError(f'is missing, but planes = "both" needs it; {out}', file=reader.toml, column=f"wind.{key}")
        for key, out, value in (
            ("azimuth_deg", "give the azimuth of the flight, from north towards east", entry.azimuth_deg),
            ("components", "'ascentwind wind apply VEHICLE --components both' writes it", entry.components),
        )
        if value is None
    ]
    reader.collector.errors += missing
    reader.collector.raise_all()
    assert entry.azimuth_deg is not None and entry.components is not None
    _check_azimuth(entry.azimuth_deg, reader)
    parts, r = entry.components, entry.components.record
    file = file_inside(reader.folder, parts.filter)
    filters = reader.collector.take(lambda: read_two_component_filter(file))
    csv = reader.read("wind", parts.statistics, WIND_COMPONENTS, ALTITUDE)
    reader.collector.raise_all()
    h, record = csv.columns["altitude"], None
    if r is None:
        _warn_of_no_record(reader.toml, "wind.components.record", "--components both")
    else:
        origin = WindOrigin(r.site, BOTH, r.period, r.edition)
        azimuth = math.radians(entry.azimuth_deg)
        record = WindRecord(origin, azimuth, 1, r.held_above_m, r.source, r.independent_samples)
    low, high = (float(x) for x in filters.joint.altitude[[0, -1]])
    reader.sources.append(TableSource("wind.filter", file, "computed", filters.joint.source, low, high))
    winds, interpolation = [], parts.statistics.interpolation
    for component, shaping_filter in zip(COMPONENTS, (filters.zonal, filters.meridional), strict=True):
        mean, sigma = (csv.columns[f"{name}_{component}"] for name in ("mean", "standard_deviation"))
        try:
            check_plausible(f"the {component} wind's statistics", h, mean, sigma)
            if record is not None:
                one = replace(record, origin=replace(record.origin, component=component), azimuth=math.pi / 4)
                check_against_edition(one, h, mean, sigma)
        except DataError as error:
            raise DataError(error.why, file=csv.file) from None
        winds.append(
            WindModel(
                Table(f"wind.mean_{component}", "m/s", h, mean, interpolation),
                shaping_filter,
                Table(f"wind.standard_deviation_{component}", "m/s", h, sigma, interpolation),
            )
        )
    try:
        check_joint_correlation(filters, h, csv.columns["correlation"])
        return TwoComponentWind(winds[0], winds[1], filters, record)
    except DataError as error:
        raise DataError(error.why, file=file) from None


def _check_azimuth(azimuth_deg: float, reader: _Reader) -> None:
    """Hold the azimuth against that of the construction, where the folder has one."""
    file = reader.folder / CONSTRUCTION_FILE
    built = tomllib.loads(read_text(file)).get("site", {}).get("azimuth_deg") if file.is_file() else None
    if isinstance(built, int | float) and abs(built - azimuth_deg) > SAME_AZIMUTH:
        raise DataError(
            f"is {azimuth_deg:g}, but {CONSTRUCTION_FILE} was built for site.azimuth_deg = {built:g}; give that, or "
            "build the vehicle for the other one. The parameter 'wind.azimuth' turns the wind without a new flight",
            file=reader.toml,
            column="wind.azimuth_deg",
        )


def _load_wind(vehicle: VehicleFile, reader: _Reader) -> WindModel:
    folder, entry = reader.folder, vehicle.wind
    file = reader.toml if entry.filter is None else file_inside(folder, entry.filter)
    fitted = reader.collector.take(lambda: read_filter(file)) if entry.fitted else None
    csv = reader.read("wind", entry.statistics, WIND, ALTITUDE)
    reader.collector.raise_all()
    h, mean, sigma = (csv.columns[name] for name in ("altitude", "mean", "standard_deviation"))
    record = _wind_record(entry.record, vehicle.planes, reader.toml)
    if entry.azimuth_deg is not None and record is not None:
        stated = math.degrees(record.azimuth)
        if abs(stated - entry.azimuth_deg) > SAME_AZIMUTH:
            raise DataError(
                f"is {entry.azimuth_deg:g}, but wind.record.azimuth_deg is {stated:g}; correct one of them",
                file=reader.toml,
                column="wind.azimuth_deg",
            )
    if entry.azimuth_deg is not None:
        _check_azimuth(entry.azimuth_deg, reader)
    try:
        check_plausible("the wind's statistics", h, mean, sigma)
        if record is not None:
            check_against_edition(record, h, mean, sigma)
    except DataError as error:
        raise DataError(error.why, file=csv.file) from None
    if entry.standard_deviation == "cr103010_fit":
        sigma = report_standard_deviation(h)
    interpolation = entry.statistics.interpolation
    mean_table = Table("wind.mean", "m/s", h, mean, interpolation)
    deviation = Table("wind.standard_deviation", "m/s", h, sigma, interpolation)
    if fitted is not None:
        shaping_filter = fitted
        low, high = (float(x) for x in shaping_filter.altitude[[0, -1]])
        reader.sources.append(TableSource("wind.filter", file, "computed", shaping_filter.source, low, high))
    else:
        assert entry.correlation is not None  # checked by WindEntry, as the filter
        knots, file = entry.correlation, reader.toml
        kernel = TwoPartKernel(
            *(
                (np.array(profile.altitude_m), np.array(profile.value))
                for profile in (knots.long_scale_m, knots.short_scale_m, knots.short_fraction)
            ),
            source=knots.source,
        )
        shaping_filter = closed_form_filter(kernel, deviation)
    try:
        return WindModel(mean_table, shaping_filter, deviation, record)
    except DataError as error:
        raise DataError(error.why, file=file) from None


def _read_strips(reader: _Reader, file: VehicleFile) -> Strips | None:
    """Return the strips of a vehicle with gust zones; None where it feels one wind."""
    entry = file.tables.normal_force_along_vehicle
    if zone_count(file) == 1:
        if is_turbulent(file) and entry is None and file.options.gust_zones is None:
            warnings.warn(
                WindWarning(
                    f"{reader.toml} has turbulence but no tables.normal_force_along_vehicle: the whole vehicle feels "
                    "every gust at once. 'ascentwind build-vehicle' makes the table; options.gust_zones = 1 keeps it "
                    "so without this warning"
                ),
                stacklevel=3,
            )
        return None
    for name in plane_names(file) if file.planes == BOTH else ():
        own = plane_entry(file, name)
        if own.tables.aerodynamics is not None or own.bending is not None:
            why = (
                f"take one normal force for both planes, but [{name}] has its own aerodynamics or bending; "
                'set options.gust_zones = 1, or fly planes = "yaw" or "pitch"'
            )
            raise DataError(why, file=reader.toml, column="options.gust_zones")
    if entry is None:
        why = "is missing, but options.gust_zones needs it; 'ascentwind build-vehicle' makes it"
        raise DataError(why, file=reader.toml, column="tables.normal_force_along_vehicle")
    modes = len(file.bending)
    columns = (*ALONG_ARGUMENTS[1:], *normal_force_columns(modes))
    csv = reader.read("zones", entry, columns, TIME, order="not decreasing")
    return Strips.read(csv, modes, entry.interpolation, reader.breaks("zones", entry))


def _make_zones(reader: _Reader, file: VehicleFile, strips: Strips) -> Zones:
    """Return the gust zones of a vehicle and put their tables among the others."""
    entry, tables = file.tables.normal_force_along_vehicle, reader.tables
    assert entry is not None  # the strips are its
    time, low = strips.time, reader.file.start_time_s
    values = {n: tables[n].polynomial(time) for n in ("dynamic_pressure", "center_of_gravity", "relative_velocity")}
    places = [load.forward_of_gimbal_m for load in file.loads if load.forward_of_gimbal_m is not None]
    weight = np.where(time >= low, values["dynamic_pressure"], 0.0)
    zones = make_zones(strips, zone_count(file), weight, places, file_inside(reader.folder, entry.file))
    found = [*zones.tables(), *zones.rate_tables(values["relative_velocity"])]
    for scope, loads in _loads_by_scope(file).items():
        for load in loads:
            assert load.station.forward_of_gimbal_m is not None  # its error was raised
            tables_of_load = zones.load_tables(load.output, load.station.forward_of_gimbal_m, load.is_shear)
            found += [replace(table, name=f"{scope}{table.name}") for table in tables_of_load]
    rise = tables["altitude"].polynomial.derivative()(time) / values["relative_velocity"]
    found.append(strips.table(AHEAD, "m", (zones.position[0] - values["center_of_gravity"]) * np.minimum(rise, 1.0)))
    tables |= {table.name: table for table in found}
    return zones


def _loads_by_scope(file: VehicleFile) -> dict[str, Sequence[LateralLoad]]:
    """Return the loads across a vehicle, and of both planes those that one has for itself under its name."""
    found: dict[str, Sequence[LateralLoad]] = {"": lateral_loads(file)}
    for name in plane_names(file) if file.planes == BOTH else ():
        if plane_entry(file, name).loads is not None:
            found[f"{name}."] = lateral_loads(plane_file(file, name))
    return found


def _load_turbulence(
    entry: TurbulenceEntry | None, wind: WindModel | TwoComponentWind, reader: _Reader
) -> Turbulence | None:
    """Return a vehicle's turbulence, None where it is off."""
    if entry is None or entry.severity == "off":
        return None
    if entry.correlation is not None and not isinstance(wind, WindModel):
        raise DataError(
            'is of one wind, and planes = "both" has two components; leave it out: turbulence is then independent',
            file=reader.toml,
            column="wind.turbulence.correlation",
        )
    if entry.intensity is None:
        assert entry.severity is not None  # checked by TurbulenceEntry
        intensity, file = turbulence_intensity(entry.severity), reader.toml
    else:
        csv = reader.read("wind.turbulence", entry.intensity, TURBULENCE, ALTITUDE)
        altitude, sigma, file = csv.columns["altitude"], csv.columns["sigma"], csv.file
        intensity = Table(INTENSITY, "m/s", altitude, sigma, entry.intensity.interpolation)
    high_pass, length = None if entry.high_pass_m == "none" else entry.high_pass_m, entry.length_m
    low, high = (float(x) for x in wind.means[0].argument[[0, -1]])
    for key, metres, advice in (
        ("high_pass_m", high_pass, "no wave of theirs is longer; give about twice the distance of their levels"),
        ("length_m", length, "longer waves are wind, not turbulence; give some hundred metres"),
    ):
        why = None
        if metres is not None and metres > high - low:
            why = f"is {metres:g} m, more than the {high - low:g} m that the wind's statistics cover: {advice}"
        elif metres is not None and metres < SHORTEST_WAVE:
            why = f"is {metres:g} m, and waves shorter than {SHORTEST_WAVE:g} m move no vehicle; give metres"
        if why is not None:
            raise DataError(why, file=reader.toml, column=f"wind.turbulence.{key}")
    try:
        return Turbulence(entry.form, intensity, length, high_pass, entry.correlation)
    except DataError as error:
        raise DataError(error.why, file=file, column="wind.turbulence") from None


def _warn_of_no_record(toml: Path, section: str, option: str) -> None:
    warnings.warn(
        WindWarning(
            f"{toml} holds no [{section}]: nobody can tell whether mean and filter are of one wind; 'ascentwind "
            f"wind apply VEHICLE {option}' writes filter, mean and record together"
        ),
        stacklevel=5,
    )


def _wind_record(entry: WindRecordEntry | None, plane: str, toml: Path) -> WindRecord | None:
    if entry is None:
        _warn_of_no_record(toml, "wind.record", "--component zonal|meridional")
        return None
    origin = WindOrigin(entry.site, entry.component, entry.period, entry.edition)
    try:
        return WindRecord(
            origin,
            math.radians(entry.azimuth_deg),
            entry.sign,
            entry.held_above_m,
            entry.source,
            entry.independent_samples,
            plane,
        )
    except DataError as error:
        raise DataError(error.why, file=toml, column="wind.record") from None


def _check_coverage(
    reader: _Reader, wind: WindModel | TwoComponentWind, turbulence: Turbulence | None, start: float, end: float
) -> None:
    """Hold schedules of the control system and the wind against the part of the flight that they must cover."""
    flight = loaded_flight(reader.tables, start, end)
    for name, (table, file) in reader.schedules.items():
        with reader.collector.part():
            check_schedule(name, table, flight, file)
    try:
        check_winds(wind, flight)
    except DataError as error:
        reader.collector.errors.append(DataError(error.why, file=reader.toml, column="wind"))
    entry = reader.file.wind.turbulence
    if turbulence is not None and entry is not None and entry.intensity is not None:
        try:
            check_intensity(turbulence.intensity, flight)
        except DataError as error:
            raise DataError(error.why, file=file_inside(reader.folder, entry.intensity.file)) from None
