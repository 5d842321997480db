"""The command line: its commands, and how errors end."""

from __future__ import annotations

import logging
import sys
import warnings
from typing import Annotated, TextIO

import typer
from rich.logging import RichHandler
from rich.text import Text

from ...model.errors import AscentwindError, AscentwindWarning
from ..present.terminal import errors, warned
from .commands import LazyGroup
from .terminal import use_plain_characters

app = typer.Typer(cls=LazyGroup, no_args_is_help=True, pretty_exceptions_enable=False)


def _print_version(wanted: bool) -> None:
    if wanted:
        from ascentwind import __version__

        typer.echo(f"ascentwind {__version__}")
        raise typer.Exit()


@app.callback()
def ascentwind(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Response statistics of ascending launch vehicles in a random wind, by the method of adjoint systems."""


def main() -> None:
    """Run the command line; errors that ascentwind raises on purpose end with their sentence and exit code 2."""
    use_plain_characters()
    warned.clear()
    logging.basicConfig(
        level=logging.INFO,
        format="%(message)s",
        handlers=[RichHandler(console=errors, show_time=False, show_path=False)],
    )
    warnings.showwarning = _show_warning
    try:
        app()
    except AscentwindError as error:
        errors.print(Text.assemble(("error:", "bold red"), f" {error}"), soft_wrap=True)
        sys.exit(2)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    if issubclass(category, AscentwindWarning):
        warned.append(str(message))
        errors.print(Text.assemble(("warning:", "yellow"), f" {message}"), soft_wrap=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))
