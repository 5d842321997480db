"""From raw inputs to the tables of a vehicle folder: computed whole, tried, then put in place."""

from __future__ import annotations

import hashlib
import math
import shutil
import tempfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from ...model.construction import Construction
from ...model.construction.construction_file import CONSTRUCTION_FILE, construction_files, load_construction
from ...model.errors import DataError, DataErrorCollector, OutputFolderError
from ...model.files.folder_files import file_inside, unsafe_to_copy
from ...model.vehicle.noise_loads import has_axial
from ...model.vehicle.plausibility import station_in_name
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.trial_load import load_trial
from ...model.vehicle.vehicle_file import TableEntry, VehicleFile, read_vehicle_file
from ..present.files import prepare_folder, write_text
from .ascent.mean_flight import EVENT_MARGIN, MeanFlight
from .tables import Columns, table_text, vehicle_tables
from .vehicle_numbers import Progress, VehicleNumbers, compute_vehicle

SMALLEST_JUMP = 1e-3  # of a column's largest value, across the two rows beside an event
POSITION_TOLERANCE = 1e-6  # m
AZIMUTH_TOLERANCE = 1e-6  # deg
EVENT_TOLERANCE = 0.5 * EVENT_MARGIN  # beyond, rows beside the event would stand on one side of it


def build_vehicle(
    folder: Path, out: Path | None = None, *, spacing: float = 1.0, progress: Progress | None = None
) -> tuple[VehicleNumbers, list[Path]]:
    """Compute the tables that a vehicle.toml names from the construction.toml beside it, and write them.

    Everything is computed, and the vehicle loaded with its new tables in a temporary folder, before any file changes.

    Parameters
    ----------
    folder : Path
        Holds ``vehicle.toml`` and ``construction.toml``.
    out : Path, optional
        A new folder for the whole vehicle; without, tables are replaced in ``folder``.
    spacing : float
        Of the rows (s).
    progress : callable, optional
        As of :func:`compute_vehicle`.

    Returns
    -------
    VehicleNumbers, list of Path
        What was computed, and the tables that were written.

    Raises
    ------
    DataError
        Raw inputs that cannot be used, or that vehicle.toml contradicts.
    OutputFolderError
    """
    collector = DataErrorCollector()
    file = collector.take(lambda: read_vehicle_file(file_inside(folder, VEHICLE_FILE)))
    construction = collector.take(lambda: load_construction(folder))
    collector.raise_all()
    check_agreement(folder / VEHICLE_FILE, file, construction)
    check_outputs(folder, file)
    if out is not None and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise OutputFolderError(f"{out} exists already and is not empty; choose another folder with --out")
    target = folder if out is None else out
    prepare_folder(folder if out is None else out.parent)
    numbers = compute_vehicle(construction, spacing, progress)
    check_events(folder / VEHICLE_FILE, file, numbers.flight)
    tables = vehicle_tables(numbers, file)
    check_jumps(folder / VEHICLE_FILE, file, numbers.flight, tables)
    origin = f"computed by 'ascentwind build-vehicle' {version('ascentwind')}; raw inputs sha256 {inputs_hash(folder)}"
    texts = {name: table_text((origin, note), columns) for name, (note, columns) in tables.items()}
    try:
        with tempfile.TemporaryDirectory(dir=None if out is None else out.parent) as work:
            made = Path(work) / "vehicle"
            shutil.copytree(folder, made, copy_function=shutil.copyfile, ignore=unsafe_to_copy(folder))
            for name, text in texts.items():
                (made / name).parent.mkdir(parents=True, exist_ok=True)
                (made / name).write_text(text, encoding="utf-8")
            load_trial(made, folder)
            if out is not None:
                made.replace(target)
    except OSError as error:
        raise OutputFolderError(f"{target} cannot be written ({error.strerror or error}); choose another") from None
    if out is None:
        for name, text in texts.items():
            path = file_inside(target, name)
            prepare_folder(path.parent)
            write_text(path, text)
    return numbers, [target / name for name in texts]


def inputs_hash(folder: Path) -> str:
    """Return a hash of construction.toml and the files it names, 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for file in construction_files(folder):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def check_agreement(toml: Path, file: VehicleFile, construction: Construction) -> None:
    """Refuse a vehicle.toml that contradicts its construction.toml; all that differs together."""
    collector = DataErrorCollector()

    def refuse(why: str, key: str) -> None:
        collector.errors.append(DataError(why, file=toml, column=key))

    if file.name != construction.name:
        refuse(f"is '{file.name}', but {CONSTRUCTION_FILE} tells of '{construction.name}'; make them equal", "name")
    if abs(file.reference_area_m2 - construction.reference_area) > 1e-9 * construction.reference_area:
        refuse(
            f"is {file.reference_area_m2:g}, but {CONSTRUCTION_FILE} has {construction.reference_area:g} m2; make "
            "them equal",
            "reference_area_m2",
        )
    if len(file.bending) != construction.bending_modes:
        refuse(
            f"has {len(file.bending)} modes, but {CONSTRUCTION_FILE} has bending_modes = {construction.bending_modes}; "
            "add or remove [[bending]]",
            "bending",
        )
    sloshing, named = {t.name for t in construction.tanks if t.sloshes}, {t.name for t in file.slosh}
    for tank in sorted(sloshing ^ named):
        where = "sloshes in " + CONSTRUCTION_FILE if tank in sloshing else "is no sloshing tank of " + CONSTRUCTION_FILE
        refuse(f"'{tank}' {where}; {'add' if tank in sloshing else 'remove'} its [[slosh]]", "slosh")
    record, azimuth = file.wind.record, math.degrees(construction.site.azimuth)
    if record is not None and abs(record.azimuth_deg - azimuth) > AZIMUTH_TOLERANCE:
        refuse(
            f"is {record.azimuth_deg:g}, but {CONSTRUCTION_FILE} flies towards {azimuth:g} deg; take the wind across "
            "that path with 'ascentwind wind apply'",
            "wind.record.azimuth_deg",
        )
    aft, forward = map(construction.forward_of_gimbal, (construction.aft_end, construction.forward_end))
    for name, sensor in file.control.load_relief.items():
        if not aft - POSITION_TOLERANCE <= sensor.position_m <= forward + POSITION_TOLERANCE:
            refuse(
                f"is {sensor.position_m:g} m forward of the gimbal plane, but {CONSTRUCTION_FILE} has a vehicle "
                f"from {aft:g} to {forward:g} m",
                f"control.{name}.position_m",
            )
    outline = construction.outline
    if outline is None and has_axial(file):
        refuse(
            f"has a table of the axial force, which needs [outline] in {CONSTRUCTION_FILE}; add it or remove the table",
            "tables.axial_along_vehicle" if file.tables.axial_along_vehicle else "loads",
        )
    for i, load in enumerate(file.loads):
        near = [s for s in construction.load_stations if abs(s - load.station_m) < POSITION_TOLERANCE]
        if not near:
            refuse(
                f"{load.station_m:g} m is not one of load_stations_m in {CONSTRUCTION_FILE}; add it there",
                f"loads.{i}.station_m",
            )
        for key in ("table", "local", "shear", "axial"):
            entry = getattr(load, key)
            named = None if entry is None else station_in_name(entry.file)
            if entry is not None and named is not None and not named[0] <= load.station_m <= named[1]:
                refuse(
                    f"is {entry.file}, but would hold station {load.station_m:g} m; name it after that station",
                    f"loads.{i}.{key}.file",
                )
        if load.radius_m is not None and outline is not None:
            radius = float(outline.at(load.station_m))
            if abs(load.radius_m - radius) > POSITION_TOLERANCE:
                refuse(
                    f"is {load.radius_m:g}, but the outline of {CONSTRUCTION_FILE} has {radius:.9g} m at station "
                    f"{load.station_m:g} m; make them equal",
                    f"loads.{i}.radius_m",
                )
        forward = construction.forward_of_gimbal(load.station_m)
        if load.forward_of_gimbal_m is not None and abs(load.forward_of_gimbal_m - forward) > POSITION_TOLERANCE:
            refuse(
                f"is {load.forward_of_gimbal_m:g}, but the gimbal plane of {CONSTRUCTION_FILE} makes it {forward:g}; "
                "correct it",
                f"loads.{i}.forward_of_gimbal_m",
            )
    collector.raise_all()


def check_outputs(folder: Path, file: VehicleFile) -> None:
    """Refuse a table that the build would write over something else: an input of its own, or another table."""
    control, wind = file.control, file.wind
    inputs = {path: "an input of the build" for path in construction_files(folder)}
    given = [control.gains, wind.statistics, *(sensor.schedule for sensor in control.load_relief.values())]
    inputs |= {folder / entry.file: "written by hand" for entry in given if entry is not None}
    taken = {path.resolve(): what for path, what in inputs.items()}
    for key, entry in table_entries(file).items():
        path = file_inside(folder, entry.file)
        if path.suffix.lower() != ".csv":
            raise DataError(
                f"'{entry.file}' would be written over; name a .csv file", file=folder / VEHICLE_FILE, column=key
            )
        if path.resolve() in taken:
            raise DataError(
                f"'{entry.file}' would be written over, but is {taken[path.resolve()]}; name another file",
                file=folder / VEHICLE_FILE,
                column=key,
            )
        taken[path.resolve()] = f"also named by {key}"


def check_events(toml: Path, file: VehicleFile, flight: MeanFlight) -> None:
    """Refuse events of vehicle.toml that the flight has at another time."""
    for name, time in file.events.items():
        found = flight.events.get(name)
        if found is not None and abs(found - time) > EVENT_TOLERANCE:
            raise DataError(
                f"is {time:.9g} s, but the flight has it at another time; write {name} = {found:.9g}",
                file=toml,
                column=f"events.{name}",
            )


def check_jumps(toml: Path, file: VehicleFile, flight: MeanFlight, tables: Mapping[str, tuple[str, Columns]]) -> None:
    """Refuse a table that jumps at an event which its entry does not list: a spline across a jump rings."""
    time = flight.time
    for event, at in flight.events.items():
        before, after = (
            np.flatnonzero((time < at) & (time > at - 2 * EVENT_MARGIN)),
            np.flatnonzero((time > at) & (time < at + 2 * EVENT_MARGIN)),
        )
        if not before.size or not after.size:
            continue
        for key, entry in table_entries(file).items():
            for (name, _), values in tables[entry.file][1].items():
                if values.size != time.size:
                    continue
                jump = abs(values[after[0]] - values[before[-1]])
                if jump > SMALLEST_JUMP * np.abs(values).max() and event not in entry.events:
                    value = "" if event in file.events else f" and {event} = {at:.9g} under [events]"
                    raise DataError(
                        f"column '{name}' jumps at {event}, {at:.9g} s; write events = [\"{event}\"]{value}",
                        file=toml,
                        column=key,
                        time=at,
                    )


def table_entries(file: VehicleFile) -> dict[str, TableEntry]:
    """Return the tables over time that the build computes, by their key in vehicle.toml."""
    tables = file.tables
    found = {
        "tables.rigid_body": tables.rigid_body,
        "tables.trajectory": tables.trajectory,
        "tables.propulsion": tables.propulsion,
        "tables.aerodynamics": tables.aerodynamics,
        "tables.local_aerodynamics": tables.local_aerodynamics,
        "tables.loads_along_vehicle": tables.loads_along_vehicle,
        "tables.shear_along_vehicle": tables.shear_along_vehicle,
        "tables.axial_along_vehicle": tables.axial_along_vehicle,
        "tables.normal_force_along_vehicle": tables.normal_force_along_vehicle,
        **{f"bending.{i}.table": mode.table for i, mode in enumerate(file.bending)},
        **{f"slosh.{tank.name}.table": tank.table for tank in file.slosh},
        **{f"control.{name}.modes": sensor.modes for name, sensor in file.control.load_relief.items()},
        **{f"loads.{load.output}.table": load.table for load in file.loads},
        **{f"loads.{load.output}.local": load.local for load in file.loads},
        **{f"loads.{load.output}.shear": load.shear for load in file.loads},
        **{f"loads.{load.output}.axial": load.axial for load in file.loads},
    }
    return {key: entry for key, entry in found.items() if entry is not None}
