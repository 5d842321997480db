"""Reading tables from CSV files whose header names every column with its unit: ``mass [kg]``."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .errors import DataError, suggestion
from .numbers import parse_number

Order = Literal["increasing", "not decreasing", "any"]
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
    rows = _read_rows(file)
    if len(rows) < (2 if order == "any" else 3):
        raise DataError(f"needs a header and at least {'one row' if order == 'any' else 'two rows'}", file=file)
    (header_line, header), body = rows[0], rows[1:]
    names, units = _read_header(file, header_line, header, text)
    for name in text:
        if name not in names:
            raise DataError(f"column '{name}' is missing; add it, its header without a unit", file=file)
    data = np.empty((len(body), len(names)))
    for i, (line, cells) in enumerate(body):
        if len(cells) != len(names):
            raise DataError(f"has {len(cells)} cells where the header has {len(names)}", file=file, row=line)
        for j, cell in enumerate(cells):
            if names[j] in text:
                if not cell.strip():
                    raise DataError("is empty; fill the cell", file=file, column=names[j], row=line)
                continue
            try:
                data[i, j] = parse_number(cell)
            except ValueError:
                raise DataError(
                    f"'{cell.strip()}' is not a finite number; fill the cell or remove the row",
                    file=file,
                    column=names[j],
                    row=line,
                ) from None
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


def _read_rows(file: Path) -> list[tuple[int, list[str]]]:
    """Return line number and cells of every line that is neither empty nor a comment."""
    try:
        content = file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DataError(
            f"cannot be read ({error.strerror or error}); check the name in the TOML file", file=file
        ) from None
    except UnicodeDecodeError:
        raise DataError("is not UTF-8 text; save it as CSV", file=file) from None
    return [
        (number, cells)
        for number, cells in enumerate(csv.reader(content.splitlines()), start=1)
        if cells and any(c.strip() for c in cells) and not cells[0].lstrip().startswith("#")
    ]


def _read_header(file: Path, line: int, header: list[str], text: tuple[str, ...]) -> tuple[list[str], dict[str, str]]:
    names: list[str] = []
    units: dict[str, str] = {}
    for cell in header:
        match = _HEADER.match(cell)
        name = match["name"] if match else cell.strip()
        if not match and name not in text:
            raise DataError(
                f"header '{cell.strip()}' has no unit; write it as 'name [unit]', [1] if it has none",
                file=file,
                row=line,
            )
        if name in names:
            raise DataError("stands twice in the header", file=file, column=name, row=line)
        names.append(name)
        if match:
            units[name] = match["unit"].strip()
    return names, units
