"""What the command-line modules share: consoles, the vehicle argument and progress bars."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

console = Console()
errors = Console(stderr=True)

VehicleArgument = Annotated[str, typer.Argument(help="A shipped vehicle ('ascentwind vehicles') or a vehicle folder.")]


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
