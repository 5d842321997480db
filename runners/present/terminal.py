"""The terminal: consoles, progress, and tables that lose no digit."""

from __future__ import annotations

from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

# '40:100:5' is no emoji, and a folder called '[/red]' no markup
console = Console(emoji=False, markup=False)


errors = Console(stderr=True, emoji=False, markup=False)


warned: list[str] = []  # warnings that the command under way has printed


WIDEST = 1000  # columns
EDGES = 3  # of a column: a space on either side and a line


def progress_bar() -> Progress:
    """Return a bar that says what is done, how much of it, and for how long."""
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )


def print_whole(table: Table, console: Console) -> None:
    """Print a table as wide as it is: a narrow terminal wraps its lines, but no number is cut off."""
    _print_at_least(_wide().measure(table).maximum, table, console)


def print_table(table: Table, console: Console) -> None:
    """Print a table that wraps between words, and is wider than the terminal where that would cut them off."""
    wide, needed = _wide(), 1
    for column in table.columns:
        sizes = [Measurement.get(wide, wide.options, cell) for cell in (column.header, *column.cells)]
        column.min_width = max(size.maximum if column.no_wrap else size.minimum for size in sizes)
        needed += column.min_width + EDGES
    _print_at_least(needed, table, console)


def _wide() -> Console:
    return Console(width=WIDEST, emoji=False, markup=False)


def _print_at_least(width: int, table: Table, console: Console) -> None:
    Console(file=console.file, width=max(console.width, width), emoji=False, markup=False).print(table)
