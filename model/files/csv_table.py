"""Reading tables from CSV files whose header names every column with its unit: ``mass [kg]``."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, DataErrorCollector, suggestion
from .numbers import parse_number, parse_row
from .text_file import read_text

Order = Literal["increasing", "not decreasing", "any"]
QUOTED = re.compile(r'["\r\0]')  # where cells are more than what stands between commas
_HEADER = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]\s*$")


@dataclass(frozen=True)
class CsvTable:
    """Columns of a CSV file by name, with the line number of each row for messages."""

    file: Path
    units: dict[str, str]
    columns: dict[str, NDArray[np.float64]]
    lines: tuple[int, ...]
    text: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def column(self, name: str, unit: str) -> NDArray[np.float64]:
        """Return a column after checking its unit.

        Raises
        ------
        DataError
            If the column is missing or its unit is another one.
        """
        if name not in self.columns:
            raise DataError(f"column '{name} [{unit}]' is missing{suggestion(name, self.columns)}", file=self.file)
        if self.units[name] != unit:
            raise DataError(
                f"unit is [{self.units[name]}], expected [{unit}]; convert the values and the header",
                file=self.file,
                column=name,
            )
        return self.columns[name]

    def require_positive(self, name: str, allow_zero: bool = False) -> None:
        """Refuse values that a physical quantity cannot have."""
        values = self.columns[name]
        bad = values < 0 if allow_zero else values <= 0
        if bad.any():
            i = int(np.argmax(bad))
            raise DataError(
                f"{values[i]:g} is not {'allowed below zero' if allow_zero else 'positive'}; correct the value",
                file=self.file,
                column=name,
                row=self.lines[i],
            )


def read_csv_table(
    file: Path,
    argument: str,
    unit: str,
    *,
    order: Order = "increasing",
    text: tuple[str, ...] = (),
) -> CsvTable:
    """Read a table and check the order of its rows.

    Parameters
    ----------
    file : Path
        Lines that start with ``#`` are comments (provenance).
    argument, unit : str
        Name and unit of the argument column, such as 'time', 's'.
    order : str
        What the argument must do from row to row.
    text : tuple of str
        Columns of words, which the file must have; their headers carry no unit.

    Raises
    ------
    DataError
        Missing file, header without units, a cell that is not a finite number, rows out of order or repeated.
    """
    rows = read_rows(file)
    if len(rows) < (2 if order == "any" else 3):
        raise DataError(f"needs a header and at least {'one row' if order == 'any' else 'two rows'}", file=file)
    (header_line, header), body = rows[0], rows[1:]
    names, units = _read_header(file, header_line, header, text)
    data, collector = np.full((len(body), len(names)), np.nan), DataErrorCollector()
    for i, (line, cells) in enumerate(body):
        if len(cells) != len(names):
            why = f"has {len(cells)} cells where the header has {len(names)}"
            collector.errors.append(DataError(why, file=file, row=line))
            continue
        if not text and (values := parse_row(cells)) is not None:
            data[i] = values
            continue
        for j, cell in enumerate(cells):
            if names[j] not in text:
                try:
                    data[i, j] = parse_number(cell)
                    continue
                except ValueError:
                    why = f"'{_short(cell)}' is not a finite number; fill the cell or remove the row"
            elif cell.strip():
                continue
            else:
                why = "is empty; fill the cell"
            collector.errors.append(DataError(why, file=file, column=names[j], row=line))
    collector.raise_all()
    table = CsvTable(
        file,
        units,
        {n: data[:, j] for j, n in enumerate(names) if n not in text},
        tuple(line for line, _ in body),
        {n: tuple(cells[j].strip() for _, cells in body) for j, n in enumerate(names) if n in text},
    )
    x = table.column(argument, unit)
    if order == "any":
        return table
    steps = np.diff(x)
    good = steps > 0 if order == "increasing" else steps >= 0
    if not good.all():
        i = int(np.argmin(good))
        why = "repeats the row above" if steps[i] == 0 else f"comes after {x[i]:g}"
        raise DataError(
            f"{x[i + 1]:g} {why}; sort the rows and keep each once", file=file, column=argument, row=table.lines[i + 1]
        )
    return table


def read_rows(file: Path) -> list[tuple[int, list[str]]]:
    """Return line number and cells of every line that is neither empty nor a comment, trailing blank columns left out.

    Each line is read by itself: a quote left open in one cannot swallow the next.

    Raises
    ------
    DataError
        The file cannot be read or is no UTF-8 text, or a line is no row of cells.
    """
    rows = []
    for number, line in enumerate(read_text(file).split("\n"), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        plain = not QUOTED.search(line) and len(line) <= csv.field_size_limit()
        try:
            (cells,) = [line.split(",")] if plain else csv.reader([line], strict=True)
        except csv.Error as error:
            raise DataError(
                f"cannot be read ({error}); a line is a row of cells with commas between them", file=file, row=number
            ) from None
        if any(c.strip() for c in cells):
            rows.append((number, cells))
    filled = max((_filled(cells) for _, cells in rows), default=0)
    return [(number, cells[:filled]) for number, cells in rows]


def _filled(cells: list[str]) -> int:
    """Return the number of cells up to the last that is not blank."""
    count = len(cells)
    while not cells[count - 1].strip():
        count -= 1
    return count


def _read_header(file: Path, line: int, header: list[str], text: tuple[str, ...]) -> tuple[list[str], dict[str, str]]:
    names: list[str] = []
    units: dict[str, str] = {}
    collector = DataErrorCollector()
    if len(header) == 1 and (mark := next((m for m in ";\t|" if m in header[0]), None)):
        raise DataError(
            f"has its cells separated by {'tabs' if mark == chr(9) else repr(mark)}; save it with commas between cells "
            "and points in numbers",
            file=file,
            row=line,
        )
    for cell in header:
        match = _HEADER.match(cell)
        name = match["name"] if match else cell.strip()
        why = None
        if not name:
            why = "a column without a header; give it one, such as 'name [unit]', or remove it"
        elif not match and name not in text:
            why = f"header '{_short(name)}' has no unit; write it as 'name [unit]', [1] if it has none"
        if why:
            collector.errors.append(DataError(why, file=file, row=line))
        elif name in names:
            collector.errors.append(DataError("stands twice in the header", file=file, column=_short(name), row=line))
        names.append(name)
        if match:
            units[name] = match["unit"].strip()
    for name in text:
        if name not in names:
            why = f"column '{name}' is missing; add it, its header without a unit"
            collector.errors.append(DataError(why, file=file))
    collector.raise_all()
    return names, units


def _short(cell: str) -> str:
    text = cell.strip()
    return text if len(text) <= 60 else f"{text[:57]}..."
