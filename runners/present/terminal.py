"""The terminal: consoles, progress, and tables that lose no digit."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

# '40:100:5' is no emoji, and a folder called '[/red]' no markup
console = Console(emoji=False, markup=False)


errors = Console(stderr=True, emoji=False, markup=False)


WIDEST = 1000  # columns


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
    needed = Console(width=WIDEST, emoji=False, markup=False).measure(table).maximum
    Console(file=console.file, width=max(console.width, needed), emoji=False, markup=False).print(table)
