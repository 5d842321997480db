"""The command ``day-of-launch``: the last balloons, and go or no-go."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ...model.errors import UnusedOptionError
from ..present.terminal import console
from .flight_load import parse_window
from .job import Job, load_study, on_terminal
from .terminal import Changes, VehicleArgument, given, number, refuse_unused, results_folder, whole

if TYPE_CHECKING:
    from ..measured_winds.wind_field import Lasting
    from ..study import Study


def day_of_launch(
    context: typer.Context,
    vehicle: VehicleArgument,
    sounding: Annotated[list[Path], typer.Option(help="File of one sounding, several times.")],
    hours_before: Annotated[list[float], typer.Option(parser=number, help="Launch, h; one for each sounding.")],
    limit: Annotated[
        Path, typer.Option(help="CSV: 'time [s]' and/or 'station [m]', then limits such as 'bending_moment [N m]'.")
    ],
    window: Annotated[
        str | None, typer.Option(help="BEGIN:END of the flight in s; the vehicle's default times without it.")
    ] = None,
    threshold: Annotated[
        float, typer.Option(parser=number, help="Chance of passing a limit above which it is no-go.")
    ] = 0.01,
    error: Annotated[float, typer.Option(parser=number, help="One sigma of a measured wind, m/s.")] = 1.0,
    pairs: Annotated[
        Path | None, typer.Option(help="Soundings at common levels with hours: how long winds last here.")
    ] = None,
    lasts: Annotated[
        float | None, typer.Option(parser=number, help="Hours after which long waves have a correlation of 1/e.")
    ] = None,
    exponent: Annotated[float, typer.Option(parser=number, help="Of growth with lag, with --lasts: 2/3 to 1.")] = 2.0
    / 3.0,
    sides: Annotated[str, typer.Option(help="both, upper or lower.")] = "both",
    component: Annotated[
        str | None, typer.Option(help="zonal or meridional, across the flight; as the wind's record says without it.")
    ] = None,
    sign: Annotated[int, typer.Option(parser=whole, help="With --component: 1 or -1 along the vehicle's +Y.")] = 1,
    draws: Annotated[int, typer.Option(parser=whole, help="Paths of the importance sampling.")] = 2000,
    seed: Annotated[int, typer.Option(parser=whole, help="Of the draws.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-day-of-launch without it.")] = None,
    changes: Changes = None,
) -> None:
    """Go or no-go from winds measured some hours before launch, and what drives it."""
    from ..flight_load.limit_table import Limits
    from ..measured_winds.launch_page import launch_figure, launch_page
    from ..present.files import write_text
    from ..present.netcdf import one_unit_a_variable, with_conventions, write_netcdf
    from ..present.style import write_figure
    from ..statistics.percentiles import checked_sides

    if component is None:
        refuse_unused(context, ["sign"], "without --component")
    if lasts is None:
        refuse_unused(context, ["exponent"], "without --lasts")
    if lasts is not None and pairs is not None:
        raise UnusedOptionError("--pairs and --lasts both say how long winds last; give one of the two")
    chosen, flown = checked_sides(sides), None if window is None else parse_window(window)
    limits = Limits.read(limit)
    study = load_study(vehicle, changes, ["title", "default_times"] if window is None else ["title"])
    persistence = _persistence(study, pairs, component, lasts, exponent if given(context, "exponent") else 2.0 / 3.0)
    job = Job(out or results_folder(vehicle, "day-of-launch"))
    with on_terminal():
        asked = study.day_of_launch(
            list(sounding), list(hours_before), limits=limits, window=flown, persistence=persistence, error=error,
            threshold=threshold, sides=chosen, draws=draws, seed=seed, component=component, sign=sign,
        )  # fmt: skip
        title = study.vehicle_for("a day of launch").title
        launch = asked.about_its_mean()
        page = launch_page(launch, title, asked.probability)
    job.replace_earlier("day-of-launch", study)
    found = launch.to_dataset()
    units = {"response": found["unit"].values.tolist()}
    if launch.resultants:
        units["resultant"] = found["resultant_unit"].values.tolist()
    bare = found.drop_vars(["unit", "resultant_unit"], errors="ignore")
    whole_file = one_unit_a_variable(bare, units, words={})
    job.written.append(write_netcdf(with_conventions(whole_file), job.folder / "day_of_launch.nc"))
    job.written.append(write_text(job.folder / "day_of_launch.md", page))
    job.written += write_figure(launch_figure(launch, title), job.folder, "day_of_launch")
    for line in page.splitlines():
        if line.strip() and not line.startswith("!"):
            style = "bold green" if line.startswith("# GO") else "bold red" if line.startswith("# NO-GO") else None
            console.print(line.lstrip("# "), style=style, soft_wrap=True, highlight=False, markup=False)
    job.end()


def _persistence(
    study: Study, pairs: Path | None, component: str | None, lasts: float | None, exponent: float
) -> Lasting | None:
    """Return how long winds last as the options say; None where they are silent."""
    from ...model.wind.soundings.read import read_soundings
    from ..measured_winds.persistence import Persistence

    if pairs is not None:
        return study.persistence(read_soundings(pairs), component)
    if lasts is None:
        return None
    return Persistence(lasts, exponent, source=f"given: {lasts:g} h, exponent {exponent:.3g}")
