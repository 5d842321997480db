"""The command line of the wind: ``ascentwind wind stats``, ``fit``, ``check``, ``plot`` and ``compare``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from .terminal import VehicleArgument, console

app = typer.Typer(no_args_is_help=True, help="Wind statistics, and filters that turn white noise into that wind.")

Period = Annotated[str, typer.Option(help="Month in English, or annual.")]
Component = Annotated[str, typer.Option(help="zonal or meridional.")]
Edition = Annotated[str, typer.Option(help="Range Reference Atmosphere: 1983 or 2006.")]
Top = Annotated[float, typer.Option(help="Highest level, m.")]
Soundings = Annotated[Path | None, typer.Option(help="CSV of soundings instead of the shipped tables.")]
Out = Annotated[Path, typer.Option(help="Folder for results.")]


def _statistics(period: str, component: str, edition: str, top: float, soundings: Path | None):
    from ..model.errors import UnknownNameError
    from ..model.range_reference import COMPONENTS, shipped_statistics
    from ..model.soundings import read_soundings

    if component not in COMPONENTS:
        raise UnknownNameError("wind component", component, COMPONENTS)
    if soundings is None:
        return shipped_statistics(period, component, edition=edition, top=top)
    read = read_soundings(soundings, drop_incomplete=True)
    if read.dropped:
        console.print(f"{read.dropped} incomplete profiles left out", style="dim")
    return getattr(read.statistics(soundings.stem), component)


@app.command()
def stats(
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
) -> None:
    """Mean, standard deviation with its 90 % interval, and correlation with the level below."""
    import numpy as np

    from .covariance_intervals import covariance_interval

    s = _statistics(period, component, edition, top, soundings)
    low, high = covariance_interval(s.covariance, s.independent_samples)
    table = Table(title=f"{s.name}, {s.independent_samples:.0f} independent samples", caption=s.source)
    for column in ("altitude, m", "mean, m/s", "σ, m/s", "90 % interval", "correlation with the level below"):
        table.add_column(column, justify="right")
    for i, h in enumerate(s.altitude):
        below = f"{s.correlation[i, i - 1]:.3f}" if i else ""
        interval = f"{np.sqrt(low[i, i]):.2f} - {np.sqrt(high[i, i]):.2f}"
        table.add_row(f"{h:g}", f"{s.mean[i]:.2f}", f"{s.standard_deviation[i]:.2f}", interval, below)
    console.print(table)


@app.command()
def fit(
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    method: Annotated[
        str, typer.Option(help="state-space, constrained-response, impulse-response, ...")
    ] = "state-space",
    order: Annotated[int | None, typer.Option(help="Number of states; 3 where the method allows it.")] = None,
    noises: Annotated[int, typer.Option(help="White noises that drive the filter; state-space only.")] = 1,
    time_limit: Annotated[float, typer.Option(help="Seconds.")] = 60.0,
    out: Annotated[Path, typer.Option(help="File for the filter.")] = Path("wind_filter.json"),
) -> None:
    """Synthesise a filter and write it; \\[wind] of a vehicle takes it as filter = "FILE"."""
    from dataclasses import replace

    from ..model.wind_filter_file import filter_text
    from .fit_progress import fit_progress
    from .least_squares import FitOptions
    from .output import prepare_folder, write_whole
    from .synthesis import synthesise
    from .synthesis_result import SynthesisError

    if noises != 1 and method != "state-space":
        raise SynthesisError(f"method '{method}' makes filters of one noise; take --method state-space")
    settings = {"noises": noises} if noises != 1 else {}
    prepare_folder(out.parent)
    s = _statistics(period, component, edition, top, soundings)
    with fit_progress(console, f"{method} for {s.name}", time_limit) as progress:
        result = synthesise(s, method, order, FitOptions(time_limit=time_limit, progress=progress), **settings)
    made = result.shaping_filter
    command = f"ascentwind wind fit --method {method} --order {made.order} --noises {made.noise_count}" + (
        f" --period {period} --component {component} --edition {edition} --top {top:g}"
        if soundings is None
        else f" --soundings {soundings.name} --component {component}"
    )
    made = replace(made, source=f"{made.source}; written by '{command}'")
    write_whole(out, lambda p: p.write_text(filter_text(made), encoding="utf-8"))
    state = "converged" if result.converged else f"NOT converged: {result.message}"
    console.print(
        f"{method}, order {result.shaping_filter.order}, {state} in {result.seconds:.1f} s: "
        f"{result.rms_error:.3g} m²/s² rms, {100 * result.share_inside():.1f} % inside the 90 % interval; "
        f"written to {out}",
        soft_wrap=True,
    )


@app.command()
def check(
    filter_file: Annotated[Path, typer.Argument(help="Filter written by 'ascentwind wind fit'.")],
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    profiles: Annotated[int, typer.Option(help="Simulated profiles.")] = 5000,
) -> None:
    """Hold a filter against data: covariances by the adjoint, intervals, poles, and an ensemble of profiles."""
    from ..model.wind_filter_file import read_filter
    from .wind_verification import ensemble_share_inside, verify

    shaping_filter = read_filter(filter_file)
    s = _statistics(period, component, edition, top, soundings)
    v = verify(shaping_filter, s)
    share = ensemble_share_inside(shaping_filter, v.covariance, s.altitude, profiles)
    table = Table("what", "found", title=f"{shaping_filter.name} against {s.name}")
    table.add_row("rms error of the covariances", f"{v.rms_error:.3g} m²/s²")
    table.add_row("inside the 90 % interval of the data", f"{100 * v.share_inside:.1f} %")
    table.add_row("largest real part of a frozen pole", f"{v.largest_pole:.3g} 1/m")
    table.add_row("largest over smallest state", f"{v.state_ratio:.3g}")
    table.add_row(f"inside the 99 % band of {profiles} profiles", f"{100 * share:.1f} %")
    console.print(table)


@app.command()
def plot(
    filter_file: Annotated[Path, typer.Argument(help="Filter written by 'ascentwind wind fit'.")],
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    vehicle: Annotated[str, typer.Option(help="Whose trajectory makes flight time of altitude.")] = "as504",
    out: Out = Path("wind-figures"),
) -> None:
    """Figures after the report's 3-7 to 3-16 and A1."""
    import numpy as np

    from ..model.shipped import find_vehicle
    from ..model.vehicle import load_vehicle
    from ..model.wind_filter_file import read_filter
    from .analytic_fits import fit_deviation
    from .figures import write_figure
    from .output import prepare_folder
    from .wind_figures import coefficient_figure, covariance_figure, deviation_figure, interval_figure
    from .wind_verification import verify

    prepare_folder(out)
    shaping_filter = read_filter(filter_file)
    s = _statistics(period, component, edition, top, soundings)
    loaded = load_vehicle(find_vehicle(vehicle))
    time = np.linspace(loaded.start, loaded.end, 1000)
    altitude = loaded.tables["altitude"].polynomial(time)
    keep = altitude <= shaping_filter.altitude[-1]
    covariance = verify(shaping_filter, s).covariance
    figures = {
        "filter_coefficients": coefficient_figure(shaping_filter, time[keep], altitude[keep]),
        "covariances": covariance_figure(s, covariance, s.name),
        "interval_9km": interval_figure(s, covariance),
        "standard_deviation": deviation_figure(s, fit_deviation(s.altitude[1:], s.standard_deviation[1:])),
    }
    written = [p for name, figure in figures.items() for p in write_figure(figure, out, name)]
    console.print(f"{len(written)} files in {out}: {', '.join(p.name for p in written)}", soft_wrap=True)


@app.command()
def compare(
    vehicle: VehicleArgument,
    time: Annotated[float | None, typer.Option(help="End time, s; greatest dynamic pressure without it.")] = None,
    response: Annotated[str, typer.Option(help="Response.")] = "bending_moment",
) -> None:
    """A response under different winds: months, editions, the closed form, and filters as poor as the report's."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from ..model.range_reference import shipped_statistics
    from .fit_progress import fit_progress
    from .least_squares import FitOptions
    from .study import Study
    from .times import time_of_greatest_dynamic_pressure
    from .wind_comparison import CASES, REPORT_ERRORS, TOP, compare_winds, shipped_winds, stretched_to_error

    study = Study.load(vehicle)
    assert study.vehicle is not None
    time = time_of_greatest_dynamic_pressure(study.vehicle) if time is None else time
    limit = FitOptions().time_limit
    with fit_progress(console, "fitting filters", limit * len(CASES)) as fitting:
        winds: dict = shipped_winds(FitOptions(progress=fitting))
        march = shipped_statistics(top=TOP)
        for rms in REPORT_ERRORS:
            poorer = stretched_to_error(winds["march, fitted"].shaping_filter, march, rms)
            winds[f"march, wrong by {rms:.0f} m²/s² rms"] = poorer
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("responses", total=len(winds) + 1)
        found = compare_winds(study, winds, time, response, progress=lambda: bar.advance(task))
    table = Table(title=f"{response} at {time:g} s, wind alone")
    for column in ("wind", "mean", "σ", "variance against the first"):
        table.add_column(column, justify="left" if column == "wind" else "right")
    for case in found:
        change = (case.deviation / found[0].deviation) ** 2 - 1
        table.add_row(case.wind, f"{case.mean:.4g}", f"{case.deviation:.4g}", f"{100 * change:+.1f} %")
    console.print(table)
