"""What the command-line modules share: consoles, the vehicle argument, changes to it, and progress bars."""

from __future__ import annotations

import codecs
import io
import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...model.errors import DataError, UnusedOptionError
from ...model.files.numbers import parse_number

# for consoles whose encoding has no such character
_PLAIN = {"σ": "sigma", "±": "+-", "·": ".", "²": "2", "₂": "2", "µ": "u", "–": "-", "…": "..."}


def _plain_character(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_PLAIN.get(c, "?") for c in error.object[error.start : error.end]), error.end


def use_plain_characters() -> None:
    """Print what a console's encoding lacks (sigma on cp1252) in other characters instead of ending there."""
    codecs.register_error("plain", _plain_character)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="plain")


def results_folder(vehicle: str, ending: str) -> Path:
    """Return the folder for results where none is named: the vehicle's name and ``ending``, where one stands."""
    return Path(f"{Path(vehicle).resolve().name or 'vehicle'}-{ending}")


def _shipped(incomplete: str) -> list[str]:
    """Return the shipped vehicles that a shell may complete; where there is none, it offers folders."""
    from ...model.vehicle.shipped import built_in_vehicles

    return [name for name in built_in_vehicles() if name.startswith(incomplete)]


_VEHICLE = typer.Argument(
    help="A shipped vehicle ('ascentwind vehicles') or a vehicle folder.", autocompletion=_shipped
)
VehicleArgument = Annotated[str, _VEHICLE]
OptionalVehicle = Annotated[str | None, _VEHICLE]
WORD = re.compile(r"(?!(true|false|inf|nan)$)[A-Za-z][A-Za-z_]*")  # no TOML value, and so text
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE in the place of vehicle.toml's, e.g. options.full_coupling=true."),
]

Turbulence = Annotated[
    str | None,
    typer.Option(help="off, light, moderate or severe (MIL-F-8785C), in the place of vehicle.toml's."),
]


def number(typed: str | float) -> float:
    """Return a number typed as an option, in the notation of files: neither '1_0' nor 'nan'."""
    try:
        return parse_number(str(typed))
    except ValueError as error:
        raise typer.BadParameter(f"{error}; write it such as 12.5 or 1e-6") from None


def whole(typed: str | int) -> int:
    """Return a whole number typed as an option: neither '1_0' nor '1.5'."""
    if not re.fullmatch(r"[+-]?[0-9]{1,18}", str(typed).strip()):
        raise typer.BadParameter(f"'{str(typed)[:40]}' is not a whole number; write it such as 12")
    return int(typed)


def parse_changes(texts: Sequence[str]) -> dict[str, Any]:
    """Return changes to a vehicle's file from 'KEY=VALUE' with a dotted key and a TOML value.

    A word alone is text, which shells rob of its quotes: planes=both.

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
            read = tomllib.loads(f"value = {value}") if not WORD.fullmatch(value) else {"value": value}
        except (ValueError, RecursionError):
            raise DataError(f"'{value:.60}' is not a TOML value; text needs quotes, true and numbers none") from None
        if list(read) != ["value"]:
            raise DataError(f"'{value}' is more than one TOML value; write one --set for each key")
        changes[key.strip()] = read["value"]
    return changes


def given(context: typer.Context, name: str) -> bool:
    """Return whether an option was typed on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def refuse_unused(context: typer.Context, names: Sequence[str], why: str) -> None:
    """Refuse options that were typed but would change nothing.

    Raises
    ------
    UnusedOptionError
    """
    for parameter in context.command.params:
        if parameter.name in names and given(context, parameter.name):
            raise UnusedOptionError(f"{parameter.opts[0]} is not used {why}; leave it out")
