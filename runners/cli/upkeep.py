"""The commands that look after an installation: ``regenerate``, ``doctor`` and ``cache``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from ...model.errors import UnusedOptionError
from ..present.terminal import console, print_table
from .job import checked_changes
from .terminal import Changes


def regenerate(
    vehicle: Annotated[
        str | None, typer.Argument(help="A shipped vehicle or a vehicle folder; all shipped ones without it.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder in which each vehicle gets a folder of its own.")] = Path(
        "generated"
    ),
    changes: Changes = None,
) -> None:
    """Write the readable C of a vehicle and its manifest anew."""
    from ...model.vehicle.shipped import built_in_vehicles
    from .regenerate import regenerate as write

    wanted = checked_changes(changes)
    if wanted and vehicle is None:
        raise UnusedOptionError("--set needs a vehicle; name the one to change")
    for name in [vehicle] if vehicle else built_in_vehicles():
        for path, state in write(name, out, wanted).items():
            console.print(f"{path}: {state}", soft_wrap=True)


def doctor() -> None:
    """Which compiler, CasADi, cache and engine would be used, and what is missing."""
    from .doctor import diagnose

    table = Table("what", "found", "")
    verdicts = diagnose()
    for line in verdicts:
        table.add_row(line.what, line.found, Text("ok", "green") if line.good else Text(line.advice, "yellow"))
    print_table(table, console)


def cache(
    clean: Annotated[bool, typer.Option("--clean", help="Remove the libraries; they are compiled anew.")] = False,
) -> None:
    """Where compiled code is kept and how much room it takes; what killed runs left there is removed."""
    from ...codegen.toolchain.cache import cache_contents, cache_folder, clean_cache, remove_leftovers

    folder = cache_folder()
    removed = clean_cache(folder) if clean else remove_leftovers(folder)
    held = cache_contents(folder)
    console.print(f"{folder}: {held.libraries} compiled libraries, {held.size / 1e6:.1f} MB", soft_wrap=True)
    console.print(f"{removed} files and folders removed", style="dim")
