"""The commands about vehicle folders: ``vehicles``, ``new-vehicle``, ``import-structure`` and ``build-vehicle``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from ...model.errors import OutputFolderError
from ...model.vehicle.shipped import built_in_vehicles
from ..present.terminal import console, print_table
from .job import Job, on_terminal, print_files, steps
from .terminal import number


def vehicles() -> None:
    """The vehicles that ship with ascentwind."""
    from ...model.vehicle.reader import load_vehicle
    from ...model.vehicle.shipped import built_in_vehicles

    table = Table("name", "what", "times (s)", "folder")
    for name, folder in built_in_vehicles().items():
        vehicle = load_vehicle(folder)
        table.add_row(name, vehicle.title, f"{vehicle.start:g} - {vehicle.end:g}", str(folder))
    print_table(table, console)


def new_vehicle(
    folder: Annotated[Path, typer.Argument(help="Folder to make.")],
    source: Annotated[str, typer.Option("--from", help="Vehicle to start from.")] = "as504",
    name: Annotated[str | None, typer.Option(help="Letters, digits and _; the folder's without it.")] = None,
    title: Annotated[str | None, typer.Option(help="Of figures and files.")] = None,
    site: Annotated[str | None, typer.Option(help="NAME or NAME,LATITUDE (deg) of the launch.")] = None,
    azimuth: Annotated[
        float | None, typer.Option(parser=number, help="Of the flight, deg from north towards east.")
    ] = None,
    month: Annotated[str | None, typer.Option(help="Of the wind: month in English, or annual.")] = None,
) -> None:
    """A vehicle folder of your own to edit: one TOML file and CSV tables. At a terminal, asks for what is not given."""
    from .first_choices import Choices, asked, put_in_place, site_of
    from .new_vehicle import copy_vehicle

    choices = asked(Choices(name, title, *site_of(site), azimuth, month), folder)
    said: list[str] = []
    copied = copy_vehicle(
        source, folder, choices.name, choices.title, lambda made: said.extend(put_in_place(choices, made))
    )
    for sentence in said:
        console.print(sentence, soft_wrap=True, markup=False)
    console.print(f"{len(copied)} files in {folder}; edit vehicle.toml, then 'ascentwind run {folder}'", soft_wrap=True)


def import_structure(
    source: Annotated[
        Path, typer.Argument(help="Mapping file (.toml) of a NASTRAN deck and its results, or a workbook (.xlsx).")
    ],
    out: Annotated[Path, typer.Option(help="Folder for masses.csv, stiffness.csv and modes.csv.")],
) -> None:
    """Masses, stiffness and bending modes from NASTRAN or a spreadsheet, as tables of a construction."""
    from ..construct.sources.import_structure import import_structure as import_tables

    with steps("reading"):
        written, checks = import_tables(source, out)
    for sentence in checks:
        console.print(sentence, soft_wrap=True, markup=False)
    print_files(written, out)


def build_vehicle(
    vehicle: Annotated[str, typer.Argument(help="Vehicle folder with vehicle.toml and construction.toml.")],
    out: Annotated[
        Path | None, typer.Option(help="New folder for the whole vehicle; without it the tables are replaced.")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Folder for figures; figures/ in the vehicle's without it.")
    ] = None,
    spacing: Annotated[float, typer.Option(parser=number, help="Seconds between rows.")] = 1.0,
) -> None:
    """The tables of a vehicle from masses, tanks, stiffness, aerodynamics, engines and programme; with figures."""
    from ..construct.build_vehicle import build_vehicle as build
    from ..construct.vehicle_figures import FIGURES
    from ..present.style import write_figure

    shipped = built_in_vehicles()
    if vehicle in shipped and not Path(vehicle).is_dir() and out is None:
        raise OutputFolderError(
            f"'{vehicle}' ships with ascentwind; choose a folder for the built copy with --out, or name its folder "
            f"({shipped[vehicle]}) to replace its tables"
        )
    folder = Path(vehicle) if Path(vehicle).is_dir() or vehicle not in shipped else shipped[vehicle]
    with on_terminal():
        numbers, written = build(folder, out, spacing=spacing)
    job = Job(figures or (out or folder) / "figures")
    with steps("figures", len(FIGURES)) as bar:
        for name, draw in FIGURES.items():
            job.written += write_figure(draw(numbers), job.folder, name)
            bar.done()
    flight = numbers.flight
    table = Table("event", title=f"Mean flight of {numbers.construction.name}")
    for column in ("time\n(s)", "Mach", "speed\n(m/s)", "altitude\n(km)", "q\n(kPa)", "mass\n(t)"):
        table.add_column(column, justify="right", no_wrap=True)
    for event, time in sorted(flight.events.items(), key=lambda item: item[1]):
        at = flight.at_events[event]
        table.add_row(
            event.replace("_", " "), f"{time:.2f}", f"{at['mach']:.3f}", f"{at['relative_velocity']:.1f}",
            f"{at['altitude'] / 1e3:.2f}", f"{at['dynamic_pressure'] / 1e3:.2f}", f"{at['mass'] / 1e3:.1f}",
        )  # fmt: skip
    print_table(table, console)
    print_files(written, out or folder)
    job.end()
