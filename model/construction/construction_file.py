"""Reading what a vehicle is built of: construction.toml and the CSV files that it names."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..errors import DataError, DataErrorCollector, PlausibilityWarning, SeveralDataErrors, suggestion
from ..files.csv_table import CsvTable, Order, read_csv_table
from ..files.folder_files import file_inside
from ..files.toml_file import read_toml
from .construction import Construction
from .construction_entries import (
    ConstructionFile,
    EngineEntry,
    FileEntry,
    JettisonEntry,
    NormalForceEntry,
    PitchEntry,
    SiteEntry,
    SolidMotorEntry,
    Status,
    TankEntry,
)
from .flight import AtmosphereFactors, Drag, EngineGroup, NormalForceComponent, PitchProgramme, Site
from .given_modes import GivenModes
from .grain import Grain
from .jettison import Jettison
from .outline import Outline
from .sizes import check_sizes
from .structure import LumpedMass, Stiffness, Tank, TankSection

CONSTRUCTION_FILE = "construction.toml"
LONGEST_BRIDGE = 0.08  # of the vehicle's length, from one item of the stiffness to another
FLOW_ERROR = 0.01  # of the propellant of a solid motor, by which its table may burn another amount
_ORIGIN = ("status", "source")
_POLYNOMIAL = (
    ("begin", "s"),
    ("end", "s"),
    ("constant", "deg"),
    ("linear", "deg/s"),
    ("quadratic", "deg/s2"),
    ("cubic", "deg/s3"),
    ("quartic", "deg/s4"),
)


def load_construction(folder: Path, changes: Mapping[str, Any] | None = None) -> Construction:
    """Read the raw inputs of a vehicle.

    Parameters
    ----------
    folder : Path
        Vehicle folder; docs/construction.md describes its construction.toml.
    changes : mapping, optional
        Values to put in the place of the file's, by dotted key; see ``read_toml``.

    Raises
    ------
    DataError
        File, key or column, and row of what cannot be used, and what to do; of all files together.
    UnknownNameError
        An engine draws from a tank that is not there.
    """
    toml = file_inside(folder, CONSTRUCTION_FILE)
    collector = DataErrorCollector()
    entry = read_toml(toml, ConstructionFile, changes, collector)
    take = collector.take

    def at(file: FileEntry) -> Path:
        return file_inside(folder, file.file)

    masses = take(lambda: read_masses(at(entry.masses), entry.aft_end_m, entry.forward_end_m))
    stiffness = take(lambda: read_stiffness(at(entry.stiffness)))
    modes = take(lambda: None if entry.modes is None else read_modes(at(entry.modes)))
    drag = take(lambda: _drag(at(entry.drag)))
    outline = take(lambda: None if entry.outline is None else _outline(at(entry.outline)))
    atmosphere = take(lambda: None if entry.atmosphere is None else _atmosphere(at(entry.atmosphere)))
    engines = [take(lambda e=e: _engine(folder, e)) for e in entry.engines]
    motors = [take(lambda e=e: _solid_motor(folder, e, entry.site.release_s)) for e in entry.solid_motors]
    jettisons = [take(lambda e=e: _jettison(folder, e)) for e in entry.jettisons]
    normal_force = [take(lambda e=e: _normal_force(folder, e)) for e in entry.normal_force]
    take(lambda: _refuse_unused_parts(folder, entry.normal_force))
    with collector.part(), _located(toml):
        pitch = _pitch(file_inside(folder, entry.pitch.file), entry.pitch)
    tanks = []
    for tank in entry.tanks:
        with collector.part(), _located(toml, f"tanks.{tank.name}"):
            tanks.append(_tank(tank))
    collector.raise_all()
    with _located(toml):
        construction = Construction(
            name=entry.name,
            gimbal_station=entry.gimbal_station_m,
            sensor_station=entry.sensor_station_m,
            aft_end=entry.aft_end_m,
            forward_end=entry.forward_end_m,
            reference_area=entry.reference_area_m2,
            masses=masses,
            tanks=tuple(tanks),
            stiffness=stiffness,
            bending_modes=entry.bending_modes,
            normal_force=tuple(normal_force),
            drag=drag,
            engines=(*engines, *(group for group, _ in motors)),
            pitch=pitch,
            site=_site(entry.site),
            atmosphere=atmosphere,
            load_stations=entry.load_stations_m,
            end_time=entry.end_time_s,
            slosh_method=entry.slosh_method,
            outline=outline,
            modes=modes,
            grains=tuple(grain for _, grain in motors),
            jettisons=tuple(jettisons),
        )
    check_sizes(construction, toml)
    return construction


def construction_files(folder: Path) -> tuple[Path, ...]:
    """Return construction.toml and every file that it names, in its order, each once."""
    toml = file_inside(folder, CONSTRUCTION_FILE)
    entry = read_toml(toml, ConstructionFile)
    parts = (entry.masses, entry.stiffness, entry.modes, entry.drag, entry.outline, entry.atmosphere, entry.pitch)
    names = [p.file for p in (*parts, *entry.engines, *entry.normal_force, *entry.solid_motors) if p is not None]
    names += [jettison.drag_file for jettison in entry.jettisons if jettison.drag_file is not None]
    return (toml, *(file_inside(folder, name) for name in dict.fromkeys(names)))


@contextmanager
def _located(file: Path, column: str | None = None, row: int | None = None) -> Iterator[None]:
    """Add file, key and row to the errors of the data classes."""
    try:
        yield
    except DataError as error:
        collector = DataErrorCollector()
        for e in error.errors if isinstance(error, SeveralDataErrors) else (error,):
            placed = e if e.file is not None else DataError(e.why, file=file, column=column or e.column, row=row)
            collector.errors.append(placed)
        collector.raise_all()


def _read(
    file: Path,
    argument: str,
    unit: str,
    columns: Iterable[tuple[str, str, str]],
    order: Order = "increasing",
    text: tuple[str, ...] = _ORIGIN,
) -> CsvTable:
    """Read a table with columns by name, unit and sign: '+' positive, '0' not negative, '' any."""
    table = read_csv_table(file, argument, unit, order=order, text=text)
    collector = DataErrorCollector()
    for name, of_column, sign in columns:
        with collector.part():
            table.column(name, of_column)
            if sign:
                table.require_positive(name, allow_zero=sign == "0")
    for status, line in zip(table.text["status"], table.lines, strict=True):
        if status not in get_args(Status):
            why = f"'{status}' is not a status; write one of {', '.join(get_args(Status))}"
            collector.errors.append(DataError(why, file=file, column="status", row=line))
    collector.raise_all()
    return table


def read_masses(file: Path, aft_end: float = -math.inf, forward_end: float = math.inf) -> tuple[LumpedMass, ...]:
    """Read a table of masses; as :func:`load_construction`."""
    units = (("end", "m", ""), ("mass", "kg", ""), ("radius_of_gyration", "m", ""))
    table = _read(file, "begin", "m", units, "any", ("item", *_ORIGIN))
    columns = zip(
        table.text["item"], *(table.columns[n] for n in ("begin", "end", "mass", "radius_of_gyration")), strict=True
    )
    masses, collector = [], DataErrorCollector()
    lines: dict[str, int] = {}
    for line, (item, begin, end, mass, radius) in zip(table.lines, columns, strict=True):
        if lines.setdefault(item, line) != line:
            why = f"'{item}' stands in line {lines[item]} already; remove or rename one"
            collector.errors.append(DataError(why, file=file, column="item", row=line))
        with collector.part(), _located(file, row=line):
            masses.append(LumpedMass(item, float(begin), float(end), float(mass), float(radius)))
            masses[-1].require_within(aft_end, forward_end)
    collector.raise_all()
    return tuple(masses)


def read_stiffness(file: Path) -> Stiffness:
    """Read a table of stiffness; as :func:`load_construction`."""
    units = (("bending", "N m2", "+"), ("shear", "N", "+"))
    table = _read(file, "station", "m", units, "not decreasing", ("item", *_ORIGIN))
    bending, shear = table.columns["bending"], table.columns["shear"]
    _warn_of_bridged_items(table)
    with _located(file):
        return Stiffness(table.columns["station"], bending, shear)


def _warn_of_bridged_items(table: CsvTable) -> None:
    """Warn of a long stretch between the rows of two items: of one of them, or of a third, rows were lost."""
    station, item = table.columns["station"], table.text["item"]
    for i, step in enumerate(np.diff(station)):
        if item[i] != item[i + 1] and step > LONGEST_BRIDGE * (station[-1] - station[0]):
            warnings.warn(
                f"{table.file}, line {table.lines[i + 1]}: no row between {station[i]:g} m of '{item[i]}' and "
                f"{station[i + 1]:g} m of '{item[i + 1]}', and stiffness is interpolated from one to the other; add "
                "the rows where one ends and the other begins",
                PlausibilityWarning,
                stacklevel=4,
            )


def read_modes(file: Path) -> GivenModes:
    """Read a table of modes, of any normalisation and sign; as :func:`load_construction`."""
    units = {
        "mode": "1",
        "frequency": "rad/s",
        "generalized_mass": "kg",
        "station": "m",
        "displacement": "1",
        "rotation": "1/m",
    }
    table = _read(file, "time", "s", ((name, unit, "") for name, unit in units.items()), "not decreasing")
    time, columns = table.columns["time"], {name: table.columns[name] for name in units}
    times, stations = np.unique(time), np.unique(columns["station"])
    count = int(columns["mode"].max())
    order = np.lexsort((columns["station"], columns["mode"], time))
    expected = [g.ravel() for g in np.meshgrid(times, np.arange(1, count + 1), stations, indexing="ij")]
    found = [values[order] for values in (time, columns["mode"], columns["station"])]
    shape = (times.size, count, stations.size)
    if time.size != np.prod(shape) or any((a != b).any() for a, b in zip(found, expected, strict=True)):
        raise DataError(
            f"has {time.size} rows; every mode from 1 to {count} takes a row at each of {times.size} times and "
            f"{stations.size} stations, {np.prod(shape)} in all",
            file=file,
        )
    arrays = {name: columns[name][order].reshape(shape) for name in units if name not in ("mode", "station")}
    for name in ("frequency", "generalized_mass"):
        differs = np.flatnonzero((arrays[name] != arrays[name][..., :1]).ravel())
        if differs.size:
            raise DataError(
                "differs from station to station of one mode and time; make it equal",
                file=file,
                column=name,
                row=table.lines[order[differs[0]]],
            )
    with _located(file):
        return GivenModes.scaled(
            times,
            stations,
            arrays["frequency"][..., 0],
            arrays["generalized_mass"][..., 0],
            arrays["displacement"],
            arrays["rotation"],
        )


def _outline(file: Path) -> Outline:
    table = _read(file, "station", "m", (("radius", "m", "0"),), "not decreasing", ("item", *_ORIGIN))
    radius = table.columns["radius"]
    with _located(file):
        return Outline(table.columns["station"], radius)


def _drag(file: Path) -> Drag:
    table = _read(file, "mach", "1", (("coefficient", "1", "0"),))
    return Drag(table.columns["mach"], table.columns["coefficient"])


def _atmosphere(file: Path) -> AtmosphereFactors:
    table = _read(file, "altitude", "m", (("density_factor", "1", "+"), ("temperature_factor", "1", "+")))
    density, temperature = table.columns["density_factor"], table.columns["temperature_factor"]
    return AtmosphereFactors(table.columns["altitude"], density, temperature)


def _engine(folder: Path, entry: EngineEntry) -> EngineGroup:
    units = (("vacuum_thrust", "N", "+"), ("mass_flow", "kg/s", "+"))
    table = _read(file_inside(folder, entry.file), "time", "s", units)
    thrust, flow = table.columns["vacuum_thrust"], table.columns["mass_flow"]
    with _located(folder / CONSTRUCTION_FILE, f"engines.{entry.name}"):
        return EngineGroup(
            name=entry.name,
            count=entry.count,
            gimballed=entry.gimballed,
            exit_area=entry.exit_area_m2,
            time=table.columns["time"],
            vacuum_thrust=thrust,
            mass_flow=flow,
            draws=entry.draws,
            cutoff=entry.cutoff_s,
            cutoff_event=entry.cutoff_event,
            residual=entry.residual_kg,
        )


def _solid_motor(folder: Path, entry: SolidMotorEntry, release: float) -> tuple[EngineGroup, Grain]:
    """Read a motor; its flow is scaled, within ``FLOW_ERROR``, so that it burns what is in the grain."""
    toml, column = folder / CONSTRUCTION_FILE, f"solid_motors.{entry.name}"
    units = (("vacuum_thrust", "N", "0"), ("mass_flow", "kg/s", "0"))
    table = _read(file_inside(folder, entry.file), "time", "s", units)
    time, thrust, flow = (table.columns[name] for name in ("time", "vacuum_thrust", "mass_flow"))
    if time[0] > release and (thrust[0] > 0 or flow[0] > 0):
        raise DataError(
            f"begins with {thrust[0]:g} N and {flow[0]:g} kg/s at {time[0]:g} s, after release at {release:g} s; begin "
            "with a row of zeros",
            file=table.file,
            row=table.lines[0],
        )
    moments = np.unique([max(time[0], release), *time[time > release]])
    burnt = float(np.trapezoid(np.interp(moments, time, flow), moments))
    burns = entry.propellant_kg - entry.sliver_kg
    if abs(burnt - burns) > FLOW_ERROR * burns:
        raise DataError(
            f"burns {burnt:.6g} kg from {moments[0]:g} to {moments[-1]:g} s, but propellant_kg less sliver_kg of one "
            f"motor is {burns:.6g}; make them agree within {100 * FLOW_ERROR:g} %",
            file=table.file,
            column="mass_flow",
        )
    grain = entry.grain
    with _located(toml, column):
        return (
            EngineGroup(
                name=entry.name,
                count=entry.count,
                gimballed=entry.gimballed,
                exit_area=entry.exit_area_m2,
                time=time,
                vacuum_thrust=thrust,
                mass_flow=flow * burns / burnt,
                draws={entry.name: 1.0},
                cutoff=float(time[-1]),
                cutoff_event=entry.burnout_event,
                solid=True,
            ),
            Grain(
                name=entry.name,
                count=entry.count,
                begin=grain.begin_m,
                end=grain.end_m,
                radius=grain.radius_m,
                distance=grain.distance_m,
                density=grain.density_kg_m3,
                propellant=entry.count * entry.propellant_kg,
            ),
        )


def _jettison(folder: Path, entry: JettisonEntry) -> Jettison:
    drag = None if entry.drag_file is None else _drag(file_inside(folder, entry.drag_file))
    with _located(folder / CONSTRUCTION_FILE, f"jettisons.{entry.event}"):
        return Jettison(entry.event, entry.time_s, entry.masses, entry.motors, entry.normal_force, drag)


def _normal_force(folder: Path, entry: NormalForceEntry) -> NormalForceComponent:
    table = _read(file_inside(folder, entry.file), "mach", "1", ((entry.name, "1/rad", ""),))
    slope = table.columns[entry.name]
    with _located(folder / CONSTRUCTION_FILE, f"normal_force.{entry.name}"):
        return NormalForceComponent(
            entry.name, np.array(entry.station_m), np.array(entry.shape), table.columns["mach"], slope
        )


def _refuse_unused_parts(folder: Path, entries: tuple[NormalForceEntry, ...]) -> None:
    """Refuse a column of the normal force that no part names."""
    for name in dict.fromkeys(e.file for e in entries):
        table = _read(file_inside(folder, name), "mach", "1", ())
        parts = [e.name for e in entries if e.file == name]
        for column in table.columns:
            if column != "mach" and column not in parts:
                raise DataError(
                    f"is a part of the normal force that no [[normal_force]] of {CONSTRUCTION_FILE} places on the "
                    f"vehicle{suggestion(column, parts)}; add its section or remove the column",
                    file=table.file,
                    column=column,
                )


def _pitch(file: Path, entry: PitchEntry) -> PitchProgramme:
    none = np.zeros(0)
    segments, time, angle = np.zeros((0, 7)), none, none
    if entry.kind == "polynomials":
        table = _read(file, "begin", "s", ((name, unit, "") for name, unit in _POLYNOMIAL))
        columns = [table.columns[name] for name, _ in _POLYNOMIAL]
        segments = np.column_stack([*columns[:2], *(np.radians(c) for c in columns[2:])])
        gap = np.flatnonzero(segments[1:, 0] != segments[:-1, 1])
        if gap.size:
            raise DataError(
                f"begins at {segments[gap[0] + 1, 0]:g} s where the row above ends at {segments[gap[0], 1]:g} s; "
                "let segments follow each other",
                file=file,
                column="begin",
                row=table.lines[gap[0] + 1],
            )
    else:
        table = _read(file, "time", "s", (("pitch", "deg", ""),))
        time, angle = table.columns["time"], np.radians(table.columns["pitch"])
    last = float(segments[-1, 1] if entry.kind == "polynomials" else time[-1])
    if entry.arrest_s is not None and entry.arrest_s > last + 1e-9:
        raise DataError(
            f"is {entry.arrest_s:g} s, but the programme in {file.name} ends at {last:g} s and is held; extend it "
            "or arrest earlier",
            column="pitch.arrest_s",
        )
    arrest = math.inf if entry.arrest_s is None else entry.arrest_s
    return PitchProgramme(entry.kind, entry.time_base_s, entry.begin_s, arrest, segments, time, angle)


def _site(entry: SiteEntry) -> Site:
    return Site(
        math.radians(entry.latitude_deg),
        math.radians(entry.azimuth_deg),
        entry.altitude_m,
        entry.platform_release_s,
        entry.release_s,
    )


def _tank(entry: TankEntry) -> Tank:
    sections = tuple(
        TankSection(
            kind=s.kind,
            begin=s.begin_m,
            end=s.end_m,
            radius=s.radius_m,
            end_radius=0.0 if s.end_radius_m is None else s.end_radius_m,
            center=0.0 if s.center_m is None else s.center_m,
            semi_axis=1.0 if s.semi_axis_m is None else s.semi_axis_m,
            sign=s.sign,
            count=s.count,
        )
        for s in entry.sections
    )
    return Tank(entry.name, sections, entry.density_kg_m3, entry.liquid_kg, entry.sloshes)
