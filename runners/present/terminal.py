"""The terminal: consoles, and tables that lose no digit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table


class Terminal(Console):
    """A console that moves nothing where no terminal is, though FORCE_COLOR asks for colour, as in notebooks."""

    @property
    def is_terminal(self) -> bool:
        """Whether what is printed reaches a terminal."""
        return super().is_terminal and (self.is_jupyter or self.file.isatty())


# '40:100:5' is no emoji, and a folder called '[/red]' no markup
console = Terminal(emoji=False, markup=False)


errors = Terminal(stderr=True, emoji=False, markup=False)


warned: list[str] = []  # warnings that the command under way has printed


WIDEST = 1000  # columns
UNIT = r"(?:[A-Za-z°%µ]+[A-Za-z0-9°²/·%]*)"
QUANTITY = re.compile(rf"(?P<value>[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?)(?: ?(?P<unit>{UNIT}(?: {UNIT})?))?(?P<mark>\*?)")
EDGES = 3  # of a column: a space on either side and a line


def complain(text: str) -> None:
    """Say what went wrong while all else stands."""
    errors.print(text, style="bold red", markup=False, highlight=False, soft_wrap=True)


@dataclass
class Machine:
    """Tables and files of a command whose output a program reads."""

    tables: list[dict[str, Any]] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    folder: str | None = None

    def told(self) -> dict[str, Any]:
        """Return what the program is given."""
        return {"tables": self.tables, "folder": self.folder, "files": self.files}


class MachineReads:
    """Whether a program reads the command under way, and what it is given.

    Attributes
    ----------
    now : Machine or None
    folder : Path or None
        Where the command last wrote, whoever reads.
    """

    def __init__(self):
        self.now: Machine | None = None
        self.folder: Path | None = None

    def begin(self) -> None:
        """Collect tables, and send all else to standard error."""
        self.now, console.stderr = Machine(), True

    def end(self) -> None:
        """Print tables again."""
        self.now, console.stderr = None, False

    def wrote(self, files: Sequence[Path], folder: Path) -> None:
        """Note where files were written."""
        self.folder = folder
        if self.now is not None:
            self.now.folder = str(folder)
            self.now.files += [path.relative_to(folder).as_posix() for path in files]

    def take(self, table: Table, printed_by: Console) -> bool:
        """Collect a table of the command's console; say whether that was done."""
        if self.now is None or printed_by is not console:
            return False
        heads = [_text(column.header) for column in table.columns]
        names = [head or ("what" if k == 0 else f"column {k + 1}") for k, head in enumerate(heads)]
        rows = zip(*(list(column.cells) for column in table.columns), strict=True)
        found = [{name: in_json(_text(cell)) for name, cell in zip(names, row, strict=True)} for row in rows]
        self.now.tables.append({"title": _text(table.title), "rows": found})
        return True


machine_reads = MachineReads()


def in_json(cell: str) -> Any:
    """Return a cell as JSON has it: a number; a number with its unit, and what marks it; or the text.

    >>> in_json("0.04 %"), in_json("1e-3"), in_json("40 s*"), in_json("mean + 3 sigma")
    ({'value': 0.04, 'unit': '%'}, 0.001, {'value': 40.0, 'unit': 's', 'mark': '*'}, 'mean + 3 sigma')
    """
    found = QUANTITY.fullmatch(cell)
    if found is None:
        return cell
    value = float(found["value"])
    if not (found["unit"] or found["mark"]):
        return value
    mark = {"mark": found["mark"]} if found["mark"] else {}
    return {"value": value, "unit": found["unit"] or "1"} | mark


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell).replace("\n", " ")


def print_whole(table: Table, console: Console) -> None:
    """Print a table as wide as it is: a narrow terminal wraps its lines, but no number is cut off."""
    if machine_reads.take(table, console):
        return
    _print_at_least(_wide().measure(table).maximum, table, console)


def print_table(table: Table, console: Console) -> None:
    """Print a table that wraps between words, and is wider than the terminal where that would cut them off."""
    if machine_reads.take(table, console):
        return
    wide, needed = _wide(), 1
    for column in table.columns:
        sizes = [Measurement.get(wide, wide.options, cell) for cell in (column.header, *column.cells)]
        column.min_width = max(size.maximum if column.no_wrap else size.minimum for size in sizes)
        needed += column.min_width + EDGES
    _print_at_least(needed, table, console)


def _wide() -> Console:
    return Terminal(width=WIDEST, emoji=False, markup=False)


def _print_at_least(width: int, table: Table, console: Console) -> None:
    Terminal(file=console.file, width=max(console.width, width), emoji=False, markup=False).print(table)
