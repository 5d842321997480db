"""Masses, stiffness and modes from the sheets of a workbook, converted to SI by the units in their headers."""

from __future__ import annotations

import csv
import importlib
import io
import math
import re
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ....model.construction.construction_file import read_masses, read_modes, read_stiffness
from ....model.errors import DataError, DataErrorCollector, MissingLibraryError, suggestion
from ....model.files.numbers import parse_number
from .mapping import KILOGRAMS, METRES

LBF = 4.4482216152605  # N
SHEETS: dict[str, tuple[str, tuple[str, ...]]] = {  # the header of a sheet: columns with units, columns of words
    "masses": ("begin [m], end [m], mass [kg], radius_of_gyration [m]", ("item",)),
    "stiffness": ("station [m], bending [N m2], shear [N]", ("item",)),
    "modes": (
        "time [s], mode [1], frequency [rad/s], generalized_mass [kg], station [m], displacement [1], rotation [1/m]",
        (),
    ),
}
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": LBF}
UNITS: dict[str, dict[str, float]] = {  # SI: what may stand in its place, and its size
    "s": {"s": 1.0},
    "1": {"1": 1.0},
    "m": METRES,
    "kg": KILOGRAMS,
    "N": FORCES,
    "N m2": {f"{f} {m}2": size * metre**2 for f, size in FORCES.items() for m, metre in METRES.items()},
    "rad/s": {"rad/s": 1.0, "Hz": 2 * math.pi},
    "1/m": {f"1/{m}": 1 / metre for m, metre in METRES.items()},
}
HEADER = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]\s*$")
READERS: dict[str, Callable[[Path], Any]] = {"masses": read_masses, "stiffness": read_stiffness, "modes": read_modes}


def workbook_tables(file: Path) -> tuple[dict[str, str], tuple[str, ...]]:
    """Return the CSV files that the sheets of a workbook make, and what was done, in sentences.

    Sheets are named ``masses``, ``stiffness`` and ``modes``; their first row is a header with units, as
    docs/construction.md gives it. ``status`` and ``source`` may be left out. Other sheets are not read.

    Raises
    ------
    DataError
        File, sheet with column, and row of what cannot be used.
    MissingLibraryError
    """
    book = _opened(file)
    wanted = [name for name in SHEETS if name in book.sheetnames]
    if not wanted:
        known = f"its sheets: {', '.join(book.sheetnames[:12])}"
        raise DataError(f"has no sheet named {', '.join(SHEETS)}; rename or add one ({known})", file=file)
    collector, tables, said = DataErrorCollector(), {}, []
    for sheet in wanted:
        with collector.part():
            text, converted = _table(file, sheet, book[sheet])
            _check(file, sheet, text)
            tables[f"{sheet}.csv"] = text
            changed = f", converted: {', '.join(converted)}" if converted else ""
            said.append(f"{file.name}, sheet {sheet}: {len(text.splitlines()) - 1} rows{changed}")
    collector.raise_all()
    left = [name for name in book.sheetnames if name not in SHEETS]
    if left:
        said.append(f"{file.name}: not read: {', '.join(left[:12])}")
    return tables, tuple(said)


def _opened(file: Path) -> Any:
    try:
        openpyxl = importlib.import_module("openpyxl")
    except ImportError as error:
        raise MissingLibraryError(
            f"openpyxl cannot be imported ({error}); pip install 'ascentwind[spreadsheet]', or save the sheets as CSV"
        ) from None
    try:
        return openpyxl.load_workbook(file, data_only=True, read_only=True)
    except OSError as error:
        raise DataError(f"cannot be read ({error.strerror or error}); check its name", file=file) from None
    except (
        zipfile.BadZipFile,
        KeyError,
        ValueError,
        TypeError,
        openpyxl.utils.exceptions.InvalidFileException,
    ) as error:
        raise DataError(f"is no .xlsx workbook ({str(error)[:120]}); save it as .xlsx", file=file) from None


def _table(file: Path, sheet: str, cells: Any) -> tuple[str, list[str]]:
    """Return a sheet as CSV in SI, a line for each of its rows, and the columns that were converted."""
    labels, words = SHEETS[sheet]
    units = dict(_name_and_unit(label) for label in labels.split(", "))
    rows = [list(row) for row in cells.iter_rows(values_only=True)]
    if not rows or not any(isinstance(c, str) for c in rows[0]):
        raise DataError(f"has no header in its first row; write {labels}", file=file, column=sheet, row=1)
    header = [str(c).strip() if c is not None else "" for c in rows[0]]
    factors: dict[int, tuple[str, float]] = {}
    place: dict[str, int] = {}
    converted, collector = [], DataErrorCollector()
    for j, cell in enumerate(header):
        with collector.part():
            name, unit = _name_and_unit(cell)
            if not name:
                if any(len(row) > j and row[j] is not None for row in rows[1:]):
                    raise DataError(f"column {j + 1} has no header", file=file, column=sheet, row=1)
                continue
            if name not in (*units, *words, "status", "source"):
                why = f"is not a column here{suggestion(name, [*units, *words])}; remove it"
                raise DataError(why, file=file, column=f"{sheet}: {name[:60]}", row=1)
            if name in place:
                raise DataError("stands twice", file=file, column=f"{sheet}: {name}", row=1)
            place[name] = j
            if name in units:
                known = UNITS[units[name]]
                if unit not in known:
                    why = f"unit is [{unit}]; write one of {', '.join(f'[{u}]' for u in known)}"
                    raise DataError(why, file=file, column=f"{sheet}: {name}", row=1)
                factors[j] = (name, known[unit])
                if unit != units[name]:
                    converted.append(f"{name} from {unit}")
    collector.errors += [
        DataError(f"column '{name}' is missing{suggestion(name, place)}", file=file, column=sheet, row=1)
        for name in (*words, *units)
        if name not in place
    ]
    collector.raise_all()
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*words, *(f"{name} [{unit}]" for name, unit in units.items()), "status", "source"])
    for number, row in enumerate(rows[1:], start=2):
        if all(c is None or not str(c).strip() for c in row):
            buffer.write("\n")
            continue
        line = []
        for name in (*words, *units, "status", "source"):
            with collector.part():
                cell = row[place[name]] if name in place and place[name] < len(row) else None
                if name in units:
                    factor = factors[place[name]][1]
                    line.append(repr(_number(cell, file, f"{sheet}: {name}", number) * factor))
                elif cell is not None and str(cell).strip():
                    line.append(" ".join(str(cell).split()))
                else:
                    line.append({"status": "found", "source": f"{file.name}, sheet {sheet}"}.get(name, ""))
        writer.writerow(line)
    collector.raise_all()
    return buffer.getvalue().rstrip("\n") + "\n", converted


def _name_and_unit(label: str) -> tuple[str, str]:
    found = HEADER.match(label)
    return (found["name"], found["unit"].strip()) if found else (label.strip(), "")


def _number(cell: Any, file: Path, column: str, row: int) -> float:
    if isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell):
        return float(cell)
    if cell is None:
        why = "is empty, or a formula whose value the file does not hold; fill it, or save the workbook in its program"
        raise DataError(why, file=file, column=column, row=row)
    try:
        return parse_number(str(cell))
    except ValueError:
        raise DataError(f"'{str(cell)[:40]}' is not a finite number", file=file, column=column, row=row) from None


def _check(file: Path, sheet: str, text: str) -> None:
    """Read the table as the construction will; its lines are the sheet's rows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{sheet}.csv"
        path.write_text(text, encoding="utf-8")
        try:
            READERS[sheet](path)
        except DataError as error:
            collector = DataErrorCollector()
            for e in getattr(error, "errors", (error,)):
                column = f"{sheet}: {e.column}" if e.column else sheet
                collector.errors.append(DataError(e.why, file=file, column=column, row=e.row, time=e.time))
            collector.raise_all()
