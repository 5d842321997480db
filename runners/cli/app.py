"""The command line: ``ascentwind run``, ``inspect``, ``vehicles`` and others, and how errors end."""

from __future__ import annotations

import logging
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer
from rich.logging import RichHandler
from rich.table import Table
from rich.text import Text

from ...model.errors import AscentwindError, AscentwindWarning, UnusedOptionError
from ..present.terminal import console, errors, progress_bar
from .build import build_vehicle
from .checks import equations, sensitivity, tolerance, verify
from .design import design
from .mean import mean
from .reproduce import reproduce
from .study import study
from .terminal import VehicleArgument, parse_changes, results_folder, use_plain_characters
from .wind import app as wind_app

if TYPE_CHECKING:
    from ..statistics.peak_check import PeakCheck
    from ..statistics.results import ResponseStatistics
    from ..study import Study

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Response statistics of ascending launch vehicles in a random wind, by the method of adjoint systems.",
)
app.add_typer(wind_app, name="wind")
for command in (verify, tolerance, sensitivity, equations, study, mean, design, reproduce):
    app.command()(command)
app.command("build-vehicle")(build_vehicle)


@app.command()
def run(
    vehicle: VehicleArgument,
    times: Annotated[str | None, typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-results without it.")] = None,
    engine: Annotated[
        str | None, typer.Option(help="sweep, cvodes, covariance or ensemble; the sweep where a compiler is found.")
    ] = None,
    method: Annotated[str | None, typer.Option(help="CVODES formulas, adams or bdf; chooses cvodes.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Relative tolerance of the integration.")] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE in the place of vehicle.toml's, e.g. options.full_coupling=true."),
    ] = None,
    along_vehicle: Annotated[
        str | None,
        typer.Option(help="Bending moment along the vehicle at this time (s, or 'peak'), and its envelope."),
    ] = None,
) -> None:
    """Mean, variance and |mean| + 3 sigma of all responses over flight time: tables and figures.

    Every peak is computed again by CVODES, one adjoint run back from it; exit code 1 when they disagree.
    """
    from ..case.times import parse_times
    from ..present.files import prepare_folder
    from ..present.manifest import Manifest
    from ..present.style import words, write_figure
    from ..statistics.engines import engine_options
    from ..statistics.figures import response_figure, weighting_figure
    from ..statistics.files import write_statistics
    from ..statistics.larger_side import LABEL
    from ..statistics.peak_check import weighting_at, with_peak_check
    from ..study import Study
    from ..views.along_vehicle_files import prepare_along_vehicle, write_along_vehicle

    folder = out or results_folder(vehicle, "results")
    settings = {"method": method, "relative_tolerance": tolerance}
    engine_options(engine, **settings)  # refused before anything is computed
    wanted = parse_changes(changes or [])
    if times and "default_times" in wanted:
        raise UnusedOptionError("--set default_times is not used with --times; leave one of them out")
    with console.status("loading and preparing code"):
        study = Study.load(vehicle, changes=wanted)
    assert study.vehicle is not None
    engine, options = engine_options(engine, compiled=study.executable.shared_library is not None, **settings)
    end_times = parse_times(times or study.vehicle.file.default_times)
    moment_time = None if along_vehicle is None else prepare_along_vehicle(study, along_vehicle)
    families = [t for t in study.vehicle.file.weighting_times_s if study.system.start < t <= study.system.end]
    study.checked_times(end_times)
    prepare_folder(folder)
    with progress_bar() as progress:
        task = progress.add_task("end times", total=len(end_times))
        statistics = study.response_statistics(
            end_times,
            engine=engine,
            options=options,
            progress=lambda t: progress.update(task, advance=1, description=f"end time {t:g} s"),
        )
        manifest = Manifest.begin(folder, "run", study.system.name)
        written = write_statistics(statistics, folder)
        progress.update(progress.add_task("peaks again by another road", total=None))
        check = _check_peaks(study, statistics)
        if check is not None:
            statistics = with_peak_check(statistics, check, study)
            write_statistics(statistics, folder)
            families = sorted({*families, *(p.time for p in check.peaks[:1] if p.time > study.system.start)})
        task = progress.add_task("figures", total=len(statistics["response"]) + len(families) + 1)
        for output in study.system.outputs:
            title = f"{study.vehicle.title}\n{words(output.name).capitalize()}, mean and {LABEL}"
            figure = response_figure(statistics, output.name, title)
            written += write_figure(figure, folder, output.name)
            progress.advance(task)
        weighting = []
        for t in families:
            weighting.append(study.weighting_function(t) if check is None else weighting_at(study, check, t))
            progress.advance(task)
        if weighting:
            first = study.system.outputs[0]
            title = f"{study.vehicle.title}\nWeighting function from wind to {words(first.name)}"
            figure = weighting_figure(weighting, first.name, first.unit, title)
            written += write_figure(figure, folder, "weighting_functions")
        progress.advance(task)
    if along_vehicle is not None:
        with console.status("bending moment along the vehicle"):
            written += write_along_vehicle(study, end_times, moment_time, folder)
    _print_peaks(statistics)
    top = study.vehicle.wind.mean.argument[-1]
    if study.tables(end_times[-1])["altitude"] > top:
        console.print(f"Above {top / 1000:g} km the wind tables end and their last values are held.", style="dim")
    console.print(f"{len(written)} files in {folder}: {', '.join(p.name for p in written)}", soft_wrap=True)
    for sentence in manifest.finish(written):
        console.print(sentence, style="dim", soft_wrap=True, markup=False)
    agree = check is not None and check.agree
    if check is not None:
        console.print(
            check.verdict(), style="green" if agree else "bold red", markup=False, highlight=False, soft_wrap=True
        )
    if not agree:
        raise typer.Exit(1)


def _check_peaks(study: Study, statistics: ResponseStatistics) -> PeakCheck | None:
    """Hold the peaks of written results against another road; where it fails say so, so that nothing is lost."""
    from ..statistics.peak_check import check_peaks

    try:
        return check_peaks(study, statistics)
    except AscentwindError as error:
        text = f"The peaks could not be computed a second time, by another road, and stand unchecked: {error}"
        errors.print(text, style="bold red", markup=False, highlight=False, soft_wrap=True)
        return None


def _print_peaks(statistics) -> None:
    from ..present.style import display, words
    from ..statistics.larger_side import LABEL
    from ..statistics.peaks import peaks

    found = peaks(statistics)
    table = Table("response", title=f"Peaks of {LABEL}")
    for column in ("time", LABEL, "side", "mean", "σ"):
        table.add_column(column, justify="right", no_wrap=True)
    for peak in found:
        factor, unit = display(peak.unit, peak.value)
        value, mean, std = (f"{factor * x:.4g} {unit}" for x in (peak.value, peak.mean, peak.std))
        table.add_row(words(peak.response), f"{peak.time:g} s{'*' if peak.at_end else ''}", value, peak.side, mean, std)
    console.print(table)
    table = Table("response", title="Share of the variance at the peak")
    for source in found[0].shares:
        table.add_column(words(source), justify="right")
    for peak in found:
        table.add_row(words(peak.response), *(f"{100 * share:.2f} %" for share in peak.shares.values()))
    console.print(table)
    at_end = any(peak.at_end for peak in found)
    if at_end:
        console.print("* on the first or last end time asked for; the peak of the flight may lie beyond", style="dim")


@app.command()
def vehicles() -> None:
    """The vehicles that ship with ascentwind."""
    from ...model.vehicle.reader import load_vehicle
    from ...model.vehicle.shipped import built_in_vehicles

    table = Table("name", "what", "times (s)", "folder")
    for name, folder in built_in_vehicles().items():
        vehicle = load_vehicle(folder)
        table.add_row(name, vehicle.title, f"{vehicle.start:g} - {vehicle.end:g}", str(folder))
    console.print(table)


@app.command("new-vehicle")
def new_vehicle(
    folder: Annotated[Path, typer.Argument(help="Folder to make.")],
    source: Annotated[str, typer.Option("--from", help="Vehicle to start from.")] = "as504",
) -> None:
    """A vehicle folder of your own to edit: one TOML file and CSV tables."""
    from .new_vehicle import copy_vehicle

    copied = copy_vehicle(source, folder)
    console.print(f"{len(copied)} files in {folder}; edit vehicle.toml, then 'ascentwind run {folder}'", soft_wrap=True)


@app.command()
def inspect(
    vehicle: VehicleArgument,
    time: Annotated[float, typer.Option(help="Flight time, s.")],
    json: Annotated[bool, typer.Option("--json", help="As JSON instead of tables.")] = False,
) -> None:
    """Every table value, the matrices A, B, C, D and the roots at a time."""
    from ..study import Study
    from ..views.inspect_system import inspection, print_inspection

    found = inspection(Study.load(vehicle), time)
    if json:
        import json as json_module

        typer.echo(json_module.dumps(found, indent=1))
    else:
        print_inspection(found, console)


@app.command()
def regenerate(
    vehicle: Annotated[
        str | None, typer.Argument(help="A shipped vehicle or a vehicle folder; all shipped ones without it.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder in which each vehicle gets a folder of its own.")] = Path(
        "generated"
    ),
) -> None:
    """Write the readable C of a vehicle and its manifest anew."""
    from ...model.vehicle.shipped import built_in_vehicles
    from .regenerate import regenerate as write

    for name in [vehicle] if vehicle else built_in_vehicles():
        for path, state in write(name, out).items():
            console.print(f"{path}: {state}", soft_wrap=True)


@app.command()
def doctor() -> None:
    """Which compiler, CasADi, cache and engine would be used, and what is missing."""
    from .doctor import diagnose

    table = Table("what", "found", "")
    verdicts = diagnose()
    for line in verdicts:
        table.add_row(line.what, line.found, Text("ok", "green") if line.good else Text(line.advice, "yellow"))
    console.print(table)


@app.command()
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


def main() -> None:
    """Run the command line; errors that ascentwind raises on purpose end with their sentence and exit code 2."""
    use_plain_characters()
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
        errors.print(Text.assemble(("warning:", "yellow"), f" {message}"), soft_wrap=True)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))
