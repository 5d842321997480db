"""``ascentwind build-vehicle``: from what a vehicle is built of to its tables."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from ...model.errors import OutputFolderError
from ...model.vehicle.shipped import built_in_vehicles
from ..present.terminal import console, progress_bar


def build_vehicle(
    vehicle: Annotated[str, typer.Argument(help="Vehicle folder with vehicle.toml and construction.toml.")],
    out: Annotated[
        Path | None, typer.Option(help="New folder for the whole vehicle; without it the tables are replaced.")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Folder for figures; figures/ in the vehicle's without it.")
    ] = None,
    spacing: Annotated[float, typer.Option(help="Seconds between rows.")] = 1.0,
) -> None:
    """The tables of a vehicle from masses, tanks, stiffness, aerodynamics, engines and programme; with figures."""
    from ..construct.build_vehicle import build_vehicle as build
    from ..construct.figures import FIGURES
    from ..construct.vehicle_numbers import STEPS
    from ..present.files import prepare_folder
    from ..present.style import write_figure

    shipped = built_in_vehicles()
    if vehicle in shipped and not Path(vehicle).is_dir() and out is None:
        raise OutputFolderError(
            f"'{vehicle}' ships with ascentwind; choose a folder for the built copy with --out, or name its folder "
            f"({shipped[vehicle]}) to replace its tables"
        )
    folder = Path(vehicle) if Path(vehicle).is_dir() or vehicle not in shipped else shipped[vehicle]
    with progress_bar() as progress:
        task = progress.add_task(STEPS[0], total=len(STEPS) + len(FIGURES) + 1)

        def done(step: str) -> None:
            after = STEPS.index(step) + 1
            progress.update(task, advance=1, description=STEPS[after] if after < len(STEPS) else "tables")

        numbers, written = build(folder, out, spacing=spacing, progress=done)
        progress.update(task, advance=1, description="figures")
        pictures = figures or (out or folder) / "figures"
        prepare_folder(pictures)
        for name, draw in FIGURES.items():
            written += write_figure(draw(numbers), pictures, name)
            progress.advance(task)
    flight = numbers.flight
    table = Table("event", "time (s)", title=f"Mean flight of {numbers.construction.name}")
    for event, time in sorted(flight.events.items(), key=lambda item: item[1]):
        table.add_row(event.replace("_", " "), f"{time:.2f}")
    console.print(table)
    console.print(
        f"{len(written)} files: {', '.join(p.name for p in written if p.suffix != '.svg')} in {out or folder}, "
        f"figures in {pictures}",
        soft_wrap=True,
    )
