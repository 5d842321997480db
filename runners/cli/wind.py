"""The command line of the wind: ``ascentwind wind apply``, ``read``, ``stats``, ``fit``, ``check``, and so on."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ...model.errors import DataError, OutputFolderError
from ..present.terminal import console, print_table
from .availability import months
from .job import Job, load_study, on_terminal, steps
from .soundings import read
from .terminal import Changes, VehicleArgument, given, number, refuse_unused, whole

if TYPE_CHECKING:
    from ...model.wind.shaping_filter import ShapingFilter
    from ...model.wind.soundings.collection import Soundings as MeasuredWinds
    from ...model.wind.statistics import TwoComponentStatistics

wind = typer.Typer(no_args_is_help=True, help="Wind statistics, and filters that turn white noise into that wind.")
wind.command()(read)
wind.command()(months)

Period = Annotated[str, typer.Option(help="Month in English, or annual.")]
Component = Annotated[str, typer.Option(help="zonal or meridional.")]
Edition = Annotated[str, typer.Option(help="Range Reference Atmosphere: 1983 or 2006.")]
Top = Annotated[float, typer.Option(parser=number, help="Highest level, m.")]
Soundings = Annotated[Path | None, typer.Option(help="Soundings at common levels instead of the shipped tables.")]
Out = Annotated[Path, typer.Option(help="Folder for results.")]


TOP = 30000.0  # m, of the shipped tables


def _statistics(
    context: typer.Context,
    period: str,
    component: str,
    edition: str,
    top: float,
    soundings: Path | None,
    site: str | None = None,
):
    """Return the statistics that the options name; ``site`` is that of the soundings."""
    from ...model.errors import UnknownNameError
    from ...model.wind.range_reference import shipped_statistics
    from ...model.wind.record import COMPONENTS
    from ...model.wind.soundings.read import read_soundings

    if component not in COMPONENTS:
        raise UnknownNameError("wind component", component, COMPONENTS)
    if soundings is None:
        refuse_unused(context, ["site"], "without --soundings: the shipped tables are of Cape Canaveral")
        return shipped_statistics(period, component, edition=edition, top=top)
    refuse_unused(context, ["period", "edition"], "with --soundings, whose days the statistics are of")
    read = read_soundings(soundings)
    _say_incomplete(read)
    found = getattr(read.statistics(soundings.stem, site), component)
    return found.between(-math.inf, top) if given(context, "top") else found


def _statistics_of(
    context: typer.Context,
    shaping_filter: ShapingFilter,
    period: str,
    component: str,
    edition: str,
    top: float,
    soundings: Path | None,
):
    """Return the statistics that the options name, and where they are silent those that the filter was fitted to."""
    from ...model.wind.range_reference import EDITIONS

    origin = shaping_filter.origin
    if origin is not None:
        component = component if given(context, "component") else origin.component
        period = period if given(context, "period") else origin.period
        edition = edition if given(context, "edition") else origin.edition
        if soundings is None and edition not in EDITIONS:
            raise DataError(
                f"filter '{shaping_filter.name}' was fitted to {origin}; give --soundings, or --period and "
                "--edition of a shipped table"
            )
    return _statistics(context, period, component, edition, top, soundings)


@wind.command()
def apply(
    context: typer.Context,
    vehicle: Annotated[str, typer.Argument(help="Vehicle folder; its vehicle.toml is changed.")],
    component: Annotated[
        str | None, typer.Option(help="zonal (towards the east) or meridional (towards the north).")
    ] = None,
    components: Annotated[
        str | None, typer.Option(help="'both': zonal and meridional wind together, for planes = \"both\".")
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(parser=number, help="Of the flight, deg from north towards east; construction.toml's without it."),
    ] = None,
    sign: Annotated[
        int,
        typer.Option(
            parser=whole, help="1: +Y is the component's positive direction, east or north; -1: west or south."
        ),
    ] = 1,
    period: Period = "march",
    edition: Edition = "1983",
    soundings: Soundings = None,
    site: Annotated[str | None, typer.Option(help="Of the soundings or the matrix.")] = None,
    matrix: Annotated[
        Path | None, typer.Option(help="CSV of means and a covariance matrix, of one component or both.")
    ] = None,
    samples: Annotated[
        float | None, typer.Option(parser=number, help="Independent soundings behind the matrix.")
    ] = None,
    repair: Annotated[
        bool, typer.Option("--repair", help="The nearest valid correlations where no wind has the matrix's.")
    ] = False,
) -> None:
    """Give a vehicle a wind: filter, mean, standard deviation and record together."""
    from ...model.errors import UnknownNameError
    from ...model.vehicle.shipped import built_in_vehicles
    from ..wind.apply import apply_wind, flight_azimuth

    folder = Path(vehicle)
    if not folder.is_dir() and vehicle in built_in_vehicles():
        raise OutputFolderError(
            f"'{vehicle}' ships with ascentwind; make a copy with 'ascentwind new-vehicle DIR --from {vehicle}'"
        )
    if soundings is not None and site is None:
        raise DataError("soundings do not say where they were taken; give --site")
    if matrix is None:
        refuse_unused(context, ["samples", "repair"], "without --matrix")
    across = flight_azimuth(folder, azimuth)
    if components is not None:
        refuse_unused(context, ["component", "sign"], "with --components, which are taken as they blow")
        if components != "both":
            raise UnknownNameError("choice of components", components, ["both"])
        both = (
            _two_components(context, period, edition, soundings, site)
            if matrix is None
            else _of_matrix(context, matrix, site, period, samples, repair)
        )
        if isinstance(both, dict):
            raise DataError(f"holds the {next(iter(both))} component alone; leave --components out", file=matrix)
        where = _where(period, edition, soundings, site, matrix, samples)
        _apply_both(folder, across, both, where)
        return
    if component is None:
        raise DataError("it is not said which wind: give --component zonal|meridional, or --components both")
    if matrix is None:
        s = _statistics(context, period, component, edition, TOP, soundings, site)
    else:
        found = _of_matrix(context, matrix, site, period, samples, repair)
        of = found if isinstance(found, dict) else {"zonal": found.zonal, "meridional": found.meridional}
        if component not in of:
            raise UnknownNameError(f"component in {matrix.name}", component, of)
        s = of[component]
    where = _where(period, edition, soundings, site, matrix, samples)
    command = (
        f"ascentwind wind apply --component {component} --azimuth {math.degrees(across):.9g} --sign {sign} {where}"
    )
    with on_terminal():
        applied = apply_wind(folder, s, across, sign, command)
    share = applied.record.share_across
    for line in (
        f"{s.name}: filter within {applied.fit.rms_error:.3g} m²/s² rms",
        f"{', '.join(path.name for path in applied.files)} written in {folder}",
        f"no longer used: {', '.join(applied.unused)}" if applied.unused else None,
        f"{share:.0%} of the component is across a path of azimuth {math.degrees(across):g}°; the whole of it is taken",
        f"the vehicle's title is still '{applied.title}'",
    ):
        if line:
            console.print(line, soft_wrap=True, highlight=False, markup=False)


def _where(
    period: str, edition: str, soundings: Path | None, site: str | None, matrix: Path | None, samples: float | None
) -> str:
    """Return the options that say where a wind is from, for the comment of the files."""
    if matrix is not None:
        return f"--matrix {matrix.name} --site '{site}' --period {period} --samples {samples:g}"
    if soundings is not None:
        return f"--soundings {soundings.name} --site '{site}'"
    return f"--period {period} --edition {edition}"


def _apply_both(folder: Path, azimuth: float, s: TwoComponentStatistics, where: str) -> None:
    from ..wind.apply import apply_components

    command = f"ascentwind wind apply --components both --azimuth {math.degrees(azimuth):.9g} {where}"
    with on_terminal():
        applied = apply_components(folder, s, azimuth, command)
    zonal, meridional = (fit.rms_error for fit in applied.fits)
    for line in (
        f"filters within {zonal:.3g} (zonal) and {meridional:.3g} m²/s² rms (meridional), the correlation of the two "
        f"winds at equal levels within {applied.correlation_error:.3g}",
        f"{', '.join(path.name for path in applied.files)} written in {folder}",
        'used with planes = "both" in vehicle.toml, or --set planes=both',
    ):
        console.print(line, soft_wrap=True, highlight=False, markup=False)


def _two_components(context: typer.Context, period: str, edition: str, soundings: Path | None, site: str | None):
    from ...model.wind.range_reference import shipped_two_components
    from ...model.wind.soundings.read import read_soundings

    if soundings is None:
        refuse_unused(context, ["site"], "without --soundings: the shipped tables are of Cape Canaveral")
        return shipped_two_components(period, edition=edition, top=TOP)
    refuse_unused(context, ["period", "edition"], "with --soundings, whose days the statistics are of")
    read = read_soundings(soundings)
    _say_incomplete(read)
    return read.statistics(soundings.stem, site)


def _say_incomplete(read: MeasuredWinds) -> None:
    partly = int((~read.complete).sum())
    if partly:
        console.print(f"{partly} of {len(read.u)} profiles lack levels and count where they are", style="dim")


def _of_matrix(context: typer.Context, file: Path, site: str | None, period: str, samples: float | None, repair: bool):
    """Return the statistics of a matrix of one's own, by component or of both."""
    from ...model.wind.matrix_file import read_matrix

    refuse_unused(context, ["edition", "soundings"], "with --matrix, which the statistics are of")
    if site is None or samples is None or not given(context, "period"):
        raise DataError(
            "a matrix does not say of what it is; give --site, --period and --samples, of independent soundings"
        )
    return read_matrix(file, site, period, samples, repair)


@wind.command()
def stats(
    context: typer.Context,
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    normality: Annotated[
        Path | None, typer.Option(help="Folder for a figure of quantiles; with --soundings, tests are printed too.")
    ] = None,
) -> None:
    """Mean, standard deviation with its 90 % interval, and correlation with the level below; how normal they are."""
    import numpy as np

    from ..wind.fitting.intervals import covariance_interval

    if soundings is None:
        refuse_unused(context, ["normality"], "without --soundings: the shipped tables hold no profiles")
    s = _statistics(context, period, component, edition, top, soundings)
    low, high = covariance_interval(s.covariance, s.independent_samples)
    table = Table(title=f"{s.name}, {s.independent_samples:.0f} independent samples", caption=s.source)
    for column in ("altitude, m", "mean, m/s", "σ, m/s", "90 % interval", "correlation with the level below"):
        table.add_column(column, justify="right")
    for i, h in enumerate(s.altitude):
        below = f"{s.correlation[i, i - 1]:.3f}" if i else ""
        interval = f"{np.sqrt(low[i, i]):.2f} - {np.sqrt(high[i, i]):.2f}"
        table.add_row(f"{h:g}", f"{s.mean[i]:.2f}", f"{s.standard_deviation[i]:.2f}", interval, below)
    print_table(table, console)
    if soundings is not None and normality is not None:
        _print_normality(soundings, component, normality)


def _print_normality(soundings: Path, component: str, folder: Path) -> None:
    """Print tests of normality by level and write the figure of quantiles."""
    from ...model.wind.soundings.collection import independent_samples
    from ...model.wind.soundings.normality import normality
    from ...model.wind.soundings.read import read_soundings
    from ..present.style import write_figure
    from ..wind.normality_figure import normality_figure

    read = read_soundings(soundings)
    values = read.component(component)
    found = normality(values, independent_samples(values, read.day))
    job = Job(folder)
    caption = "chances of values at least as far off if winds were normal; 4.55 % lie beyond 2 sigma then"
    table = Table(title=f"{component}, as of {found.independent:.0f} independent profiles", caption=caption)
    for column in ("altitude, m", "skewness", "kurtosis", "chance of both", "beyond 2 σ", "chance", "beyond 3 σ"):
        table.add_column(column, justify="right")
    for i, h in enumerate(read.altitude):
        table.add_row(
            f"{h:g}", f"{found.skewness[i]:+.2f}", f"{found.kurtosis[i]:+.2f}", f"{found.probability[i]:.2g}",
            f"{100 * found.beyond[i]:.1f} %", f"{found.tail_probability[i]:.2g}", f"{100 * found.far_beyond[i]:.2f} %",
        )  # fmt: skip
    print_table(table, console)
    job.replace_earlier("wind-stats", read.source)
    job.written += write_figure(normality_figure(read, f"{read.source}, {read.period}"), folder, "normality")
    job.end()


@wind.command()
def fit(
    context: typer.Context,
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    method: Annotated[
        str, typer.Option(help="state-space, constrained-response, impulse-response, ...")
    ] = "state-space",
    order: Annotated[int | None, typer.Option(parser=whole, help="States; 3 where the method allows it.")] = None,
    noises: Annotated[int, typer.Option(parser=whole, help="White noises that drive it; state-space only.")] = 1,
    time_limit: Annotated[float, typer.Option(parser=number, help="Seconds.")] = 60.0,
    out: Annotated[Path, typer.Option(help="File for the filter.")] = Path("wind_filter.json"),
) -> None:
    """Synthesise a filter by any method and write it; 'ascentwind wind apply' puts a whole wind into a vehicle."""
    from dataclasses import replace

    from ...model.wind.filter_file import filter_text
    from ..present.files import prepare_folder, write_text
    from ..solvers.least_squares import FitOptions
    from ..wind.synthesis.result import SynthesisError
    from ..wind.synthesis.synthesise import synthesise

    if noises != 1 and method != "state-space":
        raise SynthesisError(f"method '{method}' makes filters of one noise; take --method state-space")
    if method == "linear-regression":
        refuse_unused(context, ["time_limit"], "by linear regression, which optimises nothing")
    settings = {"noises": noises} if noises != 1 else {}
    prepare_folder(out.parent)
    s = _statistics(context, period, component, edition, top, soundings)
    with on_terminal():
        result = synthesise(s, method, order, FitOptions(time_limit=time_limit), **settings)
    made = result.shaping_filter
    command = f"ascentwind wind fit --method {method} --order {made.order} --noises {made.noise_count}" + (
        f" --period {period} --component {component} --edition {edition} --top {top:g}"
        if soundings is None
        else f" --soundings {soundings.name} --component {component} --top {s.altitude[-1]:g}"
    )
    made = replace(made, source=f"{made.source}; written by '{command}'")
    written = "written over the one that stood in" if out.exists() else "written to"
    write_text(out, filter_text(made))
    state = "converged" if result.converged else f"NOT converged: {result.message}"
    console.print(
        f"{method}, order {result.shaping_filter.order}, {state} in {result.seconds:.1f} s: "
        f"{result.rms_error:.3g} m²/s² rms, {100 * result.share_inside():.1f} % inside the 90 % interval; "
        f"{written} {out}",
        soft_wrap=True,
    )


@wind.command()
def check(
    context: typer.Context,
    filter_file: Annotated[Path, typer.Argument(help="Filter written by 'ascentwind wind fit'.")],
    period: Period = "march",
    component: Component = "zonal",
    edition: Edition = "1983",
    top: Top = 16000.0,
    soundings: Soundings = None,
    profiles: Annotated[int, typer.Option(parser=whole, help="Simulated profiles.")] = 5000,
) -> None:
    """Hold a filter against data: covariances by the adjoint, intervals, poles, and an ensemble of profiles."""
    from ...model.wind.filter_file import read_filter
    from ..wind.verification import ensemble_share_inside, verify

    shaping_filter = read_filter(filter_file)
    s = _statistics_of(context, shaping_filter, period, component, edition, top, soundings)
    with steps("the filter against its data", 2) as bar:
        v = verify(shaping_filter, s)
        bar.done(f"{profiles} profiles")
        share = ensemble_share_inside(shaping_filter, v.covariance, s.altitude, profiles)
    table = Table("what", "found", title=f"{shaping_filter.name} against {s.name}")
    table.add_row("rms error of the covariances", f"{v.rms_error:.3g} m²/s²")
    table.add_row("inside the 90 % interval of the data", f"{100 * v.share_inside:.1f} %")
    table.add_row("largest real part of a frozen pole", f"{v.largest_pole:.3g} 1/m")
    table.add_row("largest over smallest state", f"{v.state_ratio:.3g}")
    table.add_row(f"inside the 99 % band of {profiles} profiles", f"{100 * share:.1f} %")
    print_table(table, console)


@wind.command()
def plot(
    context: typer.Context,
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

    from ...model.vehicle.reader import load_vehicle
    from ...model.vehicle.shipped import find_vehicle
    from ...model.wind.filter_file import read_filter
    from ..present.style import write_figure
    from ..wind.filter_figures import coefficient_figure, covariance_figure, deviation_figure, interval_figure
    from ..wind.fitting.analytic_fits import fit_deviation
    from ..wind.verification import verify

    shaping_filter = read_filter(filter_file)
    s = _statistics_of(context, shaping_filter, period, component, edition, top, soundings)
    loaded = load_vehicle(find_vehicle(vehicle))
    job = Job(out)
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
    job.replace_earlier("wind-plot", shaping_filter.name)
    for name, figure in figures.items():
        job.written += write_figure(figure, out, name)
    job.end()


@wind.command()
def compare(
    vehicle: VehicleArgument,
    time: Annotated[float | None, typer.Option(parser=number, help="End time, s; of greatest q without it.")] = None,
    response: Annotated[str, typer.Option(help="Response.")] = "bending_moment",
    changes: Changes = None,
) -> None:
    """A response under different winds: months, editions, the closed form, and filters as poor as the report's."""
    from dataclasses import replace

    from ...model.wind.range_reference import shipped_statistics
    from ..case.times import time_of_greatest_dynamic_pressure
    from ..present.wording import display, words
    from ..views.wind_comparison import (
        REPORT_ERRORS,
        TOP,
        compare_winds,
        recorded_wind,
        shipped_winds,
        stretched_to_error,
    )

    study = load_study(vehicle, changes)
    flown = study.vehicle_for("a comparison of winds")
    record = recorded_wind(flown)
    component = record.origin.component
    time = time_of_greatest_dynamic_pressure(flown) if time is None else time
    with on_terminal():
        winds = shipped_winds(component, record.sign)
        march, fitted = shipped_statistics(component=component, top=TOP), winds["march, fitted"]
        for rms in REPORT_ERRORS:
            poorer = stretched_to_error(fitted.shaping_filter, march, rms)
            winds[f"march, wrong by {rms:.0f} m²/s² rms"] = replace(fitted, shaping_filter=poorer)
    with on_terminal():
        found = compare_winds(study, winds, time, response)
    factor, unit = display(found[0].unit, [c.deviation for c in found])
    table = Table(
        title=f"{words(response).capitalize()} at {time:g} s, {component} wind alone",
        caption=f"as in the vehicle: {record.origin}; the others: Cape Canaveral, edition 1983 unless named",
    )
    for column in ("wind", f"mean, {unit}", f"σ, {unit}", "variance against the first"):
        table.add_column(column, justify="left" if column == "wind" else "right")
    for case in found:
        change = (case.deviation / found[0].deviation) ** 2 - 1
        mean, sigma = (f"{factor * value:.4g}" for value in (case.mean, case.deviation))
        table.add_row(case.wind, mean, sigma, f"{100 * change:+.1f} %")
    print_table(table, console)
