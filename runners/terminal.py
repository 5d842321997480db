"""What the command-line modules share: consoles, the vehicle argument, changes to it, and progress bars."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from ..model.errors import DataError

console = Console(emoji=False)  # '40:100:5' is no emoji
errors = Console(stderr=True, emoji=False)

WIDEST = 1000  # columns

VehicleArgument = Annotated[str, typer.Argument(help="A shipped vehicle ('ascentwind vehicles') or a vehicle folder.")]


def parse_changes(texts: Sequence[str]) -> dict[str, Any]:
    """Return changes to a vehicle's file from 'KEY=VALUE' with a dotted key and a TOML value.

    Raises
    ------
    DataError
        With the form expected.
    """
    changes: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise DataError(f"'{text}' changes nothing; write KEY=VALUE, such as options.full_coupling=true")
        try:
            read = tomllib.loads(f"value = {value}")
        except tomllib.TOMLDecodeError:
            raise DataError(f"'{value}' is not a TOML value; text needs quotes, true and numbers none") from None
        if list(read) != ["value"]:
            raise DataError(f"'{value}' is more than one TOML value; write one --set for each key")
        changes[key.strip()] = read["value"]
    return changes


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
    needed = Console(width=WIDEST, emoji=False).measure(table).maximum
    Console(file=console.file, width=max(console.width, needed), emoji=False).print(table)
