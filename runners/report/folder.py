"""What a results folder holds: files by the command that wrote them, held against the folder's manifest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr

from ...model.errors import DataError
from ..present.manifest import MANIFEST, PAGE, RESULTS, file_hash, own_file, read_manifest
from ..present.netcdf import joined

DATA = (".nc", ".csv", ".json", ".md")
FIGURES = (".png", ".svg")
WRITERS = {  # data files by which a folder without a manifest is known, and the command that writes them
    "statistics.nc": "run",
    "flight_load.nc": "flight-load",
    "limits.nc": "flight-load",
    "sensitivity.nc": "sensitivity",
    "study.nc": "study",
    "design.csv": "design",
    "day_of_launch.nc": "day-of-launch",
    "flown_winds.nc": "fly",
    "availability.nc": "availability",
}
SAME_DATA = (
    "statistics.nc",
    "flight_load.nc",
    "limits.nc",
    "sensitivity.nc",
)  # of one vehicle, or they are no one page


class ResultsFolderError(DataError):
    """A folder holds nothing that a report can be made of, or results that do not belong together."""


@dataclass(frozen=True)
class Entry:
    """What one command wrote into a folder.

    Attributes
    ----------
    command : str
    of : str
        The vehicle or system.
    files : tuple of str
        Those that are there.
    missing : tuple of str
        Those that were written and are gone, and figures that are others now.
    about : mapping
        What the command noted: how it was typed, the vehicle, warnings.
    hashes : mapping of str to str
        SHA-256 of each of the files, as it was written.
    """

    command: str
    of: str
    files: tuple[str, ...]
    missing: tuple[str, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    hashes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ResultsFolder:
    """The results in a folder.

    Attributes
    ----------
    folder : Path
    entries : mapping of str to Entry
        Complete runs, by command.
    unfinished : tuple of str
        Commands that began to write and did not end.
    others : tuple of str
        Results that no command's list holds.
    filters : tuple of str
        Files of wind filters.
    """

    folder: Path
    entries: Mapping[str, Entry]
    unfinished: tuple[str, ...]
    others: tuple[str, ...]
    filters: tuple[str, ...]

    @property
    def of(self) -> str:
        """The vehicle or system; the folder's name where only filters are in it."""
        return next((entry.of for entry in self.entries.values()), self.folder.resolve().name)

    def path(self, name: str) -> Path | None:
        """Return a data file that a complete run lists, None without it."""
        listed = any(name in entry.files for entry in self.entries.values())
        return self.folder / name if listed else None

    def about(self, *wanted: str) -> Any:
        """Return what the first command that noted it says under a key, deeper by further keys; None without it."""
        for entry in self.entries.values():
            found: Any = entry.about
            for key in wanted:
                found = found.get(key) if isinstance(found, Mapping) else None
            if found:
                return found
        return None

    def each(self, key: str) -> Iterator[tuple[str, list[str]]]:
        """Yield the lists of texts that commands noted under a key, by command."""
        for name, entry in self.entries.items():
            noted = entry.about.get(key)
            if isinstance(noted, list) and noted:
                yield name, [str(text) for text in noted]


def open_folder(folder: Path) -> ResultsFolder:
    """Read what a folder holds, and hold it against its manifest.

    Raises
    ------
    ResultsFolderError
        There is no such folder, nothing in it is of ascentwind, a data file is not the one that its command wrote, or
        results are of different vehicles.
    """
    if not folder.is_dir():
        what = "is a file; name the folder it is in" if folder.exists() else "there is no such folder"
        raise ResultsFolderError(what, file=folder)
    try:
        here = sorted(p.name for p in folder.iterdir() if p.is_file())
    except OSError as error:
        raise ResultsFolderError(f"cannot be read ({error.strerror or error})", file=folder) from None
    if MANIFEST in here and not read_manifest(folder) and not _is_of_filters(folder):
        raise ResultsFolderError(
            "is no manifest of this program, so that nothing says which files belong together; compute them again",
            file=folder / MANIFEST,
        )
    commands = {name: entry for name, entry in read_manifest(folder).items() if name != PAGE}
    unfinished = tuple(name for name, entry in commands.items() if not entry.get("complete"))
    entries = {
        name: _entry(folder, name, entry) for name, entry in commands.items() if name not in unfinished
    } or _without_manifest(here if not commands else [])
    _refuse_changed(folder, commands, unfinished)
    filters = tuple(name for name in here if name.endswith(".json") and name != MANIFEST and _is_filter(folder / name))
    listed = {name for entry in commands.values() for name in entry["files"]} | {
        name for entry in entries.values() for name in entry.files
    }
    others = tuple(n for n in here if n.endswith(RESULTS) and n not in listed)
    if not entries and not filters:
        if unfinished:
            raise ResultsFolderError(
                f"'ascentwind {unfinished[0]}' did not end there, so that its files may be of two runs; run it again",
                file=folder,
            )
        raise ResultsFolderError(
            "holds no results of ascentwind: neither a manifest nor statistics.nc, study.nc, design.csv or a wind's "
            "filter; give the folder that a command wrote",
            file=folder,
        )
    found = ResultsFolder(folder, entries, unfinished, others, filters)
    _refuse_mixed(found)
    return found


def stored(path: Path) -> xr.Dataset:
    """Read a NetCDF file of results, its variables put together again, with the unit of each response as ``unit``.

    Raises
    ------
    DataError
    """
    try:
        with xr.open_dataset(path, engine="scipy", decode_times=False) as opened:
            whole = opened.load()
            found = joined(whole)
    except (OSError, TypeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"cannot be read as results ({error!s:.200}); compute them again", file=path) from None
    for dim in ("response", "load"):
        units = {v.attrs[dim]: v.attrs[f"{dim}_unit"] for v in whole.data_vars.values() if f"{dim}_unit" in v.attrs}
        if units and dim in found.coords:
            found = found.assign_coords({f"{dim}_units": (dim, [units.get(str(n), "") for n in found[dim].values])})
    return found


def _entry(folder: Path, command: str, entry: Mapping[str, Any]) -> Entry:
    there = [name for name in entry["files"] if own_file(folder, name) is not None]
    changed = [n for n in there if n.endswith(FIGURES) and _is_other(folder / n, entry["files"][n])]
    about = entry.get("about")
    return Entry(
        command,
        str(entry.get("of", "")),
        tuple(n for n in there if n not in changed),
        tuple(n for n in entry["files"] if n not in there or n in changed),
        about if isinstance(about, Mapping) else {},
        {n: entry["files"][n] for n in there if n not in changed},
    )


def _without_manifest(here: list[str]) -> dict[str, Entry]:
    files: dict[str, list[str]] = {}
    for name in here:
        if name in WRITERS:
            files.setdefault(WRITERS[name], []).append(name)
    return {command: Entry(command, "", tuple(names)) for command, names in files.items()}


def _is_other(path: Path, digest: str) -> bool:
    try:
        return file_hash(path) != digest
    except OSError as error:
        raise ResultsFolderError(f"cannot be read ({error.strerror or error})", file=path) from None


def _refuse_changed(folder: Path, commands: Mapping[str, Mapping[str, Any]], unfinished: tuple[str, ...]) -> None:
    """Refuse data files that are none of those that a complete command wrote under their name."""
    written: dict[str, list[tuple[str, str]]] = {}
    for command, entry in commands.items():
        if command not in unfinished:
            for name, digest in entry["files"].items():
                written.setdefault(name, []).append((command, digest))
    for name, by in written.items():
        path = own_file(folder, name)
        if path is None or not name.endswith(DATA) or not all(_is_other(path, digest) for _, digest in by):
            continue
        raise ResultsFolderError(
            f"is not the file that 'ascentwind {by[0][0]}' wrote there: changed since, or of another run; compute it "
            "again",
            file=path,
        )


def _refuse_mixed(found: ResultsFolder) -> None:
    names = {entry.of: entry.command for entry in found.entries.values() if entry.of}
    if len(names) > 1:
        told = " and ".join(f"'{of}' ('ascentwind {command}')" for of, command in names.items())
        raise ResultsFolderError(
            f"holds results of {told}; one page is of one vehicle, so give each its own folder", file=found.folder
        )
    hashes: dict[str, str] = {}
    for name in SAME_DATA:
        path = found.path(name)
        if path is not None:
            hashes.setdefault(str(stored_attributes(path).get("data_sha256", "")), name)
    if len(hashes) > 1:
        raise ResultsFolderError(
            f"{' and '.join(hashes.values())} were computed from different numbers (other files or --set); compute "
            "them again from the same",
            file=found.folder,
        )


def stored_attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a NetCDF file.

    Raises
    ------
    DataError
    """
    try:
        with xr.open_dataset(path, engine="scipy", decode_times=False) as opened:
            return dict(opened.attrs)
    except (OSError, TypeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"cannot be read as NetCDF ({error!s:.200}); compute it again", file=path) from None


def _is_filter(path: Path) -> bool:
    from ...model.wind.filter_file import read_filter

    try:
        read_filter(path)
    except DataError:
        return False
    return True


def _is_of_filters(folder: Path) -> bool:
    return any(_is_filter(p) for p in folder.glob("*.json") if p.name != MANIFEST)
