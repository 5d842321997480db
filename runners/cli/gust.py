"""The command ``gust``: discrete gusts, the worst of them, and their place beside mean, random wind and vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ...model.errors import UnknownNameError
from ..present.terminal import console, print_table
from .job import Job, load_study, steps
from .terminal import Changes, Turbulence, VehicleArgument, number, results_folder

if TYPE_CHECKING:
    import xarray as xr

    from ..gusts.search import GustSweep

LATERAL = ("bending_moment", "shear_force")  # loads across the vehicle, which have resultants
SHAPES = ("one-minus-cosine", "quasi-square")


def gust(
    vehicle: VehicleArgument,
    shape: Annotated[
        list[str] | None,
        typer.Option(help="one-minus-cosine, quasi-square or ramp-and-hold, several times; the first two without it."),
    ] = None,
    response: Annotated[list[str] | None, typer.Option(help="Response, several times; all without it.")] = None,
    amplitude: Annotated[float, typer.Option(parser=number, help="Of the gust, m/s.")] = 9.0,
    length: Annotated[
        list[float] | None,
        typer.Option(parser=number, help="Length along altitude in m, several times; 60 to 300 m without it."),
    ] = None,
    times: Annotated[
        str | None, typer.Option(help="End times START:STOP:STEP or T1,T2,... in s; 21 default times without it.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-gust without it.")] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """Discrete gusts of all lengths at all altitudes: the worst of them, and combined loads."""
    from ..case.times import parse_times
    from ..gusts.along_vehicle import gust_along_vehicle
    from ..gusts.combined import combined_loads
    from ..gusts.figures import along_vehicle_figure, gust_figure
    from ..gusts.files import write_gusts
    from ..gusts.shapes import LENGTHS
    from ..gusts.shapes import SHAPES as KNOWN
    from ..present.style import write_figure
    from ..present.wording import words
    from ..station_loads.loads_along_vehicle import known_loads

    for name in shape or ():
        if name not in KNOWN:
            raise UnknownNameError("shape of a gust", name, list(KNOWN))
    ends = None if times is None else parse_times(times)
    gusts = [KNOWN[name](LENGTHS[1], amplitude) for name in dict.fromkeys(shape or SHAPES)]
    study = load_study(
        vehicle, changes, ["title", "default_times"] if times is None else ["title"], turbulence=turbulence
    )
    known = study.vehicle_for("a gust")
    names = list(dict.fromkeys(response)) if response else None
    sweeps = [study.gust_sweep(each, ends, responses=names, lengths=length or None) for each in gusts]
    job = Job(out or results_folder(vehicle, "gust"))
    sheets = []
    with steps("gusts", len(sweeps)) as bar:
        for sweep in sweeps:
            _ = sweep.dataset
            sheets.append(combined_loads(sweep))
            bar.done(words(sweep.gust.name))
    job.replace_earlier("gust", study)
    job.written += write_gusts(sweeps, sheets, job.folder)
    drawn = [name for name in sweeps[0].responses if any(sweep.worst(name).value for sweep in sweeps)]
    with steps("figures", len(drawn)) as bar:
        for name in drawn:
            over_time = [sweep.over_time(name) for sweep in sweeps]
            job.written += write_figure(gust_figure(sweeps, over_time, name, known.title), job.folder, f"gust_{name}")
            bar.done()
        both = sweeps[0].from_any_direction
        along = {f"resultant_{load}": load for load in LATERAL} if both else {load: load for load in known_loads(known)}
        for name, load in ((name, load) for name, load in along.items() if name in sweeps[0].responses):
            worst = [sweep.worst(name) for sweep in sweeps]
            if not any(each.value for each in worst):
                continue
            found = [gust_along_vehicle(sweep, w, load) for sweep, w in zip(sweeps, worst, strict=True)]
            heading = f"{known.title}\n{words(name).capitalize()} along the vehicle in gusts of {amplitude:g} m/s"
            job.written += write_figure(
                along_vehicle_figure(found, worst, heading), job.folder, f"along_vehicle_{name}"
            )
    print_gusts(sweeps, sheets)
    job.end()


def print_gusts(sweeps: list[GustSweep], sheets: list[xr.Dataset]) -> None:
    """Print the worst gusts, and the sheet of combined loads."""
    import numpy as np

    from ..present.wording import display, words

    amplitude = sweeps[0].gust.amplitude
    table = Table("response", "shape", title=f"Worst gusts of {amplitude:g} m/s, the gust alone")
    both = sweeps[0].from_any_direction
    for column in ("size", "at", "length", "from", *(["towards"] if both else [])):
        table.add_column(column, justify="right", no_wrap=True)
    for name in sweeps[0].responses:
        for sweep in sweeps:
            w = sweep.worst(name)
            if not w.value:
                table.add_row(words(name), words(w.gust.name), "not reached", *[""] * (len(table.columns) - 3))
                continue
            factor, unit = display(w.unit, w.value)
            table.add_row(
                words(name), words(w.gust.name), f"{factor * w.value:.4g} {unit}", f"{w.time:.2f} s",
                f"{w.gust.length:.0f} m", f"{w.start_altitude:.0f} m",
                *([] if w.direction is None else [f"{np.degrees(w.direction) % 360:.0f}°"]),
            )  # fmt: skip
    print_table(table, console)
    columns = ("mean", "random_wind", "gust", "vehicle", "root_sum_square", "joint_inside", "joint_worst")
    for sweep, sheet in zip(sweeps, sheets, strict=True):
        table = Table("response", title=f"Combined loads at the time of the worst {words(sweep.gust.name)} gust")
        for column in columns:
            table.add_column(words(column).replace("root sum square", "|mean| + rss"), justify="right")
        for k, name in enumerate(sweep.responses):
            values = [float(sheet[column][k]) for column in columns]
            factor, unit = display(sweep.units[k], [value for value in values if value == value])
            cells = ("" if value != value else f"{factor * value:.4g}" for value in values)
            table.add_row(f"{words(name)}, {unit}", *cells)
        print_table(table, console)
    sides = "any direction" if both else "either side"
    console.print(
        "Random wind and vehicle: 3 sigma. Joint: passed by 0.00135 of flights that are inside the gust at that time "
        f"from {sides}, or meet it where it does most harm. The random wind holds scales down to some hundred "
        "metres already: mean + 3 sigma and the whole gust count those twice.",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
