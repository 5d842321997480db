"""Copying a vehicle folder as the start of another one, under its own name."""

from __future__ import annotations

import csv
import io
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from ...model.construction.construction_file import CONSTRUCTION_FILE, construction_files
from ...model.errors import OutputFolderError
from ...model.files.folder_files import unsafe_to_copy
from ...model.vehicle.columns import Column
from ...model.vehicle.reader import VEHICLE_FILE, load_vehicle
from ...model.vehicle.shipped import find_vehicle
from ...model.vehicle.table_columns import table_columns

COPIED = "copied from "
SOURCE = re.compile(rf'(?<![\w"\'])((?:\w+_)?source\s*=\s*")(?!"|{COPIED})')


def copy_vehicle(
    source: str | Path,
    folder: Path,
    name: str | None = None,
    title: str | None = None,
    change: Callable[[Path], None] | None = None,
) -> list[Path]:
    """Copy a vehicle into a new folder and name it after the folder, or as told.

    ``change`` is called with the copy before it is put in place.


    The copy has a title of its own, and its sources say that they were copied: its figures and files carry no other
    vehicle's name as theirs.

    Raises
    ------
    OutputFolderError
        If the folder exists and is not empty, lies inside the vehicle copied, or cannot be made.
    """
    start = find_vehicle(source)
    vehicle = load_vehicle(start)
    origin = vehicle.name
    if folder.resolve().is_relative_to(start.resolve()):
        raise OutputFolderError(f"{folder} lies inside {start}, the vehicle to copy; choose a folder beside it")
    if name is None:
        name = re.sub(r"[^A-Za-z0-9_]", "_", folder.resolve().name)
        name = name if name[:1].isalpha() else f"vehicle_{name}"
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise OutputFolderError(f"{folder} exists already and is not empty; choose another folder")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as work:
            made = Path(work) / "vehicle"
            shutil.copytree(start, made, copy_function=shutil.copyfile, ignore=unsafe_to_copy(start))
            for toml in sorted(made.glob("*.toml")):
                text = sourced(toml.read_text(encoding="utf-8-sig", errors="surrogateescape"), origin)
                if toml.name in (VEHICLE_FILE, CONSTRUCTION_FILE):
                    text = renamed(text, name, origin, title)
                toml.write_text(text, encoding="utf-8", errors="surrogateescape")
            if (made / CONSTRUCTION_FILE).is_file():
                for file in construction_files(made)[1:]:
                    file.write_text(sourced_rows(file.read_text(encoding="utf-8-sig"), origin), encoding="utf-8")
            for file, columns in table_columns(vehicle.file).items():
                table = made / file
                table.write_text(explained(table.read_text(encoding="utf-8-sig"), columns), encoding="utf-8")
            if change is not None:
                change(made)
            made.replace(folder)
    except OSError as error:
        raise OutputFolderError(f"{folder} cannot be made ({error.strerror or error}); choose another folder") from None
    return sorted(folder.iterdir())


def explained(text: str, columns: Iterable[Column]) -> str:
    """Return a CSV table with what its columns are in comments above its header."""
    lines = text.splitlines()
    header = next(i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#"))
    present = {cell.strip() for cell in next(csv.reader([lines[header]]))}
    said = [f"# {column.label}: {column.meaning}" for column in columns if column.label in present]
    new = [line for line in said if line not in lines]
    return "\n".join([*lines[:header], *new, *lines[header:]]) + "\n"


def renamed(text: str, name: str, origin: str, title: str | None = None) -> str:
    """Return a TOML file under another vehicle's name, with a title of its own."""
    text = re.sub(r"(?m)^name = .*$", f'name = "{name}"', text, count=1)
    line = f'title = "{name}, started from {origin}"  # of figures and files: describe your vehicle here'
    line = line if title is None else f'title = "{title}"'
    text = re.sub(r"(?m)^title = .*$", lambda _: line, text, count=1)
    return (
        f"# {name}: made from {origin} by 'ascentwind new-vehicle'. It tells of {origin} until you change it,\n"
        f"# and so does every source that begins with '{COPIED}{origin}'.\n\n{text}"
    )


def sourced(text: str, origin: str) -> str:
    """Return a TOML file whose sources say from which vehicle they were copied."""
    return SOURCE.sub(lambda match: f"{match[1]}{COPIED}{origin}: ", text)


def sourced_rows(text: str, origin: str) -> str:
    """Return a CSV file whose column of sources says from which vehicle they were copied.

    A file with cells over several lines stays as it is.
    """
    if any(line.count('"') % 2 for line in text.splitlines() if not line.lstrip().startswith("#")):
        return text
    lines, column = [], None
    for line in text.splitlines():
        cells = next(csv.reader([line]), [])
        if not cells or line.lstrip().startswith("#"):
            lines.append(line)
            continue
        if column is None:
            column = next((i for i, cell in enumerate(cells) if cell.strip() == "source"), -1)
        elif 0 <= column < len(cells) and not cells[column].startswith(COPIED):
            cells[column] = f"{COPIED}{origin}: {cells[column]}"
        buffer = io.StringIO()
        csv.writer(buffer, lineterminator="").writerow(cells)
        lines.append(buffer.getvalue())
    return "\n".join(lines) + "\n"
