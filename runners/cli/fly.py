"""The command ``fly``: a vehicle through measured winds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ..present.terminal import console, print_table
from .job import Job, load_study, on_terminal
from .soundings import parse_levels
from .terminal import Changes, VehicleArgument, refuse_unused, results_folder, whole

if TYPE_CHECKING:
    from ..measured_winds.fly import FlownWinds

SHOWN = 5  # of the worst profiles
RESTS = 1e-9  # of the mean: a response that winds change by less rests


def fly(
    context: typer.Context,
    vehicle: VehicleArgument,
    soundings: Annotated[Path, typer.Argument(help="IGRA, Wyoming, FSL, netCDF, GRIB or CSV.")],
    times: Annotated[
        str | None, typer.Option(help="START:STOP:STEP or T1,T2,... in s; the vehicle's default times without it.")
    ] = None,
    response: Annotated[list[str] | None, typer.Option(help="Response, several times; all without it.")] = None,
    levels: Annotated[
        str | None, typer.Option(help="START:STOP:STEP or H1,H2,... in m, for soundings that share none.")
    ] = None,
    component: Annotated[
        str | None, typer.Option(help="zonal or meridional, across the flight; as the wind's record says without it.")
    ] = None,
    sign: Annotated[int, typer.Option(parser=whole, help="With --component: 1 or -1 along the vehicle's +Y.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-flown without it.")] = None,
    changes: Changes = None,
) -> None:
    """Fly measured winds: histories, percentiles and flight maxima beside what the vehicle's Gaussian wind predicts."""
    import numpy as np

    from ...model.wind.soundings.read import read_soundings
    from ..case.times import parse_times
    from ..measured_winds.files import write_flown
    from ..measured_winds.flown_figure import flown_figure
    from ..present.style import write_figure
    from ..present.wording import words
    from ..statistics.resultants import resultant_pairs

    if component is None:
        refuse_unused(context, ["sign"], "without --component")
    ends = None if times is None else parse_times(times)
    read = read_soundings(soundings, None if levels is None else parse_levels(levels))
    study = load_study(vehicle, changes, ["title", "default_times"] if times is None else ["title"])
    names = study.checked_responses(response or None)
    job = Job(out or results_folder(vehicle, "flown"))
    with on_terminal():
        flown = study.fly(read, ends, responses=names, component=component, sign=sign)
        _ = flown.predicted_maxima
    job.replace_earlier("fly", study)
    job.written += write_flown(flown, job.folder)
    title = study.vehicle_for("a flown wind").title
    parts = [flown, flown.resultants] if resultant_pairs(names) else [flown]
    moved = flown.predicted_std.max(axis=0) > RESTS * np.abs(flown.predicted_mean).max(axis=0)
    still = [name for name, moves in zip(flown.responses, moved.tolist(), strict=True) if not moves]
    for part in parts:
        for name in part.responses:
            if name not in still:
                job.written += write_figure(flown_figure(part, name, title), job.folder, f"flown_{name}")
    for line in read.quality.lines():
        console.print(line, style="dim", soft_wrap=True, highlight=False, markup=False)
    if still:
        told = f"Without a figure, since winds do not move it: {', '.join(map(words, still))}"
        console.print(told, style="dim", soft_wrap=True, highlight=False, markup=False)
    print_flown(flown)
    last, name = parts[-1], parts[-1].responses[0]
    table = Table("profile", "date", title=f"Largest {words(name)}")
    for column in ("value", "time, s"):
        table.add_column(column, justify="right")
    for profile, date, value, time in last.worst(name, SHOWN):
        table.add_row(profile, date, f"{value:.4g} {last.unit(name)}", f"{time:g}")
    print_table(table, console)
    job.end()


def print_flown(flown: FlownWinds) -> None:
    """Print flight maxima of the profiles beside those of a Gaussian wind, and what non-normality does to 3 sigma."""
    import numpy as np

    from ..present.wording import display, words
    from ..statistics.resultants import resultant_pairs

    n = len(flown.values)
    drawn = "" if len(flown.completed) == n else ", what was not measured drawn"
    table = Table("response", title=f"Largest size over the flight: {n} profiles{drawn} / Gaussian wind")
    for column in ("median", "95 %", "99 %", "largest"):
        table.add_column(column, justify="right", no_wrap=True)
    for part in [flown, flown.resultants] if resultant_pairs(flown.responses) else [flown]:
        for r, name in enumerate(part.responses):
            measured, predicted = part.maxima[:, r], part.predicted_maxima[:, r]
            factor, shown = display(part.unit(name), measured)
            both = [[f"{factor * np.quantile(x, p):.4g}" for x in (measured, predicted)] for p in (0.5, 0.95, 0.99)]
            largest = f"{factor * np.abs(part.values[:, :, r]).max():.4g} {shown}"
            table.add_row(words(name), *(" / ".join(pair) for pair in both), largest)
    print_table(table, console)
    missed = flown.missed_share.max(axis=0)
    console.print(
        f"Winds straight between their levels miss up to {100 * missed.max():.1f} % of the wind's variance "
        f"({words(flown.responses[int(missed.argmax())])}).", soft_wrap=True, highlight=False,
    )  # fmt: skip
    for name in flown.responses:
        skewed = flown.skewed_levels(name)
        if skewed is None:
            continue
        side, at = np.unravel_index(int(np.abs(skewed).argmax()), skewed.shape)
        console.print(
            f"{words(name)}: skewness and kurtosis of the profiles move the level of 3 sigma by at most "
            f"{skewed[side, at]:+.2f} sigma ({('upper', 'lower')[int(side)]} side at {flown.weights.times[at]:g} s).",
            soft_wrap=True, highlight=False,
        )  # fmt: skip
