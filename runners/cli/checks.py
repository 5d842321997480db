"""The commands that check and study results: ``verify``, ``tolerance``, ``sensitivity`` and ``equations``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ...model.errors import DataError
from ..present.terminal import console, progress_bar
from ..statistics.larger_side import LARGER_SIDE
from .terminal import VehicleArgument, refuse_unused, results_folder

WIDE = 150  # columns: tables that a narrow terminal wraps but a file keeps whole


def sensitivity(
    context: typer.Context,
    vehicle: VehicleArgument,
    response: Annotated[str | None, typer.Option(help="Response; the vehicle's first without it.")] = None,
    time: Annotated[str, typer.Option(help="End time in s, or 'peak'.")] = "peak",
    source: Annotated[str, typer.Option(help="A noise source, or 'combined'.")] = "combined",
    quantity: Annotated[
        str, typer.Option(help=f"{LARGER_SIDE}, mean_plus_3sigma, mean, std or variance.")
    ] = LARGER_SIDE,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-sensitivity without it.")] = None,
) -> None:
    """Which parameter, second of a table and kilometre of wind drives a response: exact derivatives, ranked."""
    from ..case.times import parse_time_or_peak
    from ..present.files import prepare_folder
    from ..present.manifest import Manifest
    from ..sensitivity.report import print_sensitivity, write_sensitivity
    from ..study import Study

    at = parse_time_or_peak(time)
    if quantity == "mean":
        refuse_unused(context, ["source"], "with --quantity mean, to which no noise contributes")
    folder = out or results_folder(vehicle, "sensitivity")
    with console.status("loading and preparing code"):
        study = Study.load(vehicle)
    prepare_folder(folder)
    with console.status("finding the peak and differentiating" if at == "peak" else "differentiating"):
        found = study.sensitivity(response or study.system.output_names[0], at, source=source, quantity=quantity)
    print_sensitivity(found, console)
    manifest = Manifest.begin(folder, "sensitivity", study.system.name)
    written = write_sensitivity(found, folder)
    console.print(f"{len(written)} files in {folder}: {', '.join(p.name for p in written)}", soft_wrap=True)
    for sentence in manifest.finish(written):
        console.print(sentence, style="dim", soft_wrap=True, markup=False)


def equations(
    context: typer.Context,
    vehicle: VehicleArgument = "as504",
    of: Annotated[
        str | None,
        typer.Option(help="'4-1' to '4-13', an output, or a state for its rate; all of 4-1 to 4-13 without."),
    ] = None,
    by: Annotated[str | None, typer.Option(help="The derivative by this table, parameter, state or input.")] = None,
    page: Annotated[Path | None, typer.Option(help="Write 4-1 to 4-13 and their derivatives to this file.")] = None,
) -> None:
    """The equations and any derivative of them as LaTeX, with the report's symbols."""
    from ..present.files import write_whole
    from ..study import Study
    from ..views.equation_latex import equation_latex, equation_names
    from ..views.equation_page import equations_page

    if by is not None and of is None:
        raise DataError(f"--by {by} needs --of, the equation to differentiate; 4-1 to 4-13, an output or a state")
    if page is not None:
        refuse_unused(context, ["of", "by"], "with --page, which holds all equations")
    study = Study.load(vehicle)
    if page is not None:
        text = equations_page(study)
        write_whole(page, lambda p: p.write_text(text, encoding="utf-8"))
        console.print(f"{page} written", soft_wrap=True)
    elif of is not None:
        typer.echo(equation_latex(study, of, by))
    else:
        for name in equation_names(study):
            if name.startswith("4-"):
                typer.echo(f"{name}: {equation_latex(study, name)}")


def verify(
    vehicle: VehicleArgument,
    times: Annotated[
        str | None, typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...; four of the vehicle's without it.")
    ] = None,
    runs: Annotated[int, typer.Option(help="Simulated flights of the ensemble.")] = 500,
    seed: Annotated[int, typer.Option(help="Of the ensemble's noise.")] = 504,
    out: Annotated[Path | None, typer.Option(help="Folder for a figure of sample paths; none without it.")] = None,
) -> None:
    """The same statistics by independent engines, with a verdict; exit code 1 when they disagree."""
    from ..case.times import parse_times, spread_over
    from ..present.files import prepare_folder
    from ..present.style import write_figure
    from ..solvers.ensemble import EnsembleOptions
    from ..statistics.figures import sample_path_figure
    from ..statistics.verify import verify as run_verification
    from ..study import Study

    options = EnsembleOptions(runs=runs, seed=seed, paths=min(30, runs) if out else 0)
    with console.status("loading and preparing code"):
        study = Study.load(vehicle)
    if out:
        prepare_folder(out)
    assert study.vehicle is not None
    end_times = parse_times(times) if times else spread_over(parse_times(study.vehicle.file.default_times), 4)
    with console.status("computing with every engine"):
        found = run_verification(study, end_times, options)
    _print_verification(found)
    if out:
        with console.status("drawing sample paths"):
            start, last = study.system.start, max(end_times)
            at = [start + (last - start) * k / 60 for k in range(1, 61)]
            title = f"{study.system.name}: simulated flights and the adjoint's mean ± 3σ"
            adjoint = study.response_statistics(at, engine="cvodes")
            figure = sample_path_figure(found.statistics["ensemble"], adjoint, title)
        for path in write_figure(figure, out, "sample_paths"):
            console.print(str(path), soft_wrap=True)
    console.print(found.verdict(), style="green" if found.agree else "bold red", highlight=False)
    if not found.agree:
        raise typer.Exit(1)


def _print_verification(found) -> None:
    from ..present.style import display, words
    from ..statistics.engines import ENGINES
    from ..statistics.verify import REFERENCE

    reference, ensemble = found.statistics[REFERENCE], found.statistics["ensemble"]
    table = Table("time", "response", "source", title="Standard deviations by independent engines")
    table.add_column(f"σ, {ENGINES[REFERENCE].label}", justify="right")
    for engine in found.differences:
        table.add_column(f"{ENGINES[engine].label}, difference", justify="right")
    table.add_column(f"ensemble of {ensemble.attrs['runs']}", justify="right")
    table.add_column(f"{ensemble.attrs['confidence']:.0%} interval", justify="right")
    table.add_column("inside")
    for k, time in enumerate(reference["time"].values):
        for r, response in enumerate(reference["response"].values):
            factor, unit = display(str(reference["unit"].values[r]), reference["std"].values[:, r])
            for s, source in enumerate(reference["source"].values):
                low, high, std = (factor * ensemble[n].values[k, r, s] for n in ("std_low", "std_high", "std"))
                table.add_row(
                    f"{time:g} s", words(response), words(source),
                    f"{factor * reference['std'].values[k, r, s]:.5g} {unit}",
                    *(f"{d[k, r, s]:.1e}" for d in found.differences.values()),
                    f"{std:.4g}", f"{low:.4g} to {high:.4g}", "yes" if found.inside[k, r, s] else "no",
                    end_section=s + 1 == reference["source"].size,
                )  # fmt: skip
    Console(file=console.file, width=max(console.width, WIDE), emoji=False, markup=False).print(table)


def tolerance(
    vehicle: VehicleArgument,
    times: Annotated[
        str | None,
        typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...; greatest dynamic pressure without it."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the figure; VEHICLE-tolerance without it.")] = None,
) -> None:
    """Error and run time of each engine against tolerance, and the variable that paces the step."""
    from ..case.times import parse_times, time_of_greatest_dynamic_pressure
    from ..present.files import prepare_folder
    from ..present.style import write_figure
    from ..statistics.figures import tolerance_figure
    from ..statistics.tolerance import TOLERANCES, measure, pacing
    from ..study import Study

    folder = out or results_folder(vehicle, "tolerance")
    end_times = parse_times(times) if times else []
    with console.status("loading and preparing code"):
        study = Study.load(vehicle)
    assert study.vehicle is not None
    end_times = end_times or [time_of_greatest_dynamic_pressure(study.vehicle)]
    named = times or f"{end_times[0]:g}"
    prepare_folder(folder)
    with progress_bar() as progress:
        task = progress.add_task("tolerances", total=len(TOLERANCES))
        measured = measure(study, end_times, progress=lambda _: progress.update(task, advance=1))
    paces = pacing(study, max(end_times))
    table = Table("engine", title=f"Largest relative error of a σ, and run time, end times {named} s")
    for value in TOLERANCES:
        table.add_column(f"{value:.0e}", justify="right")
    for engine in dict.fromkeys(m.engine for m in measured):
        rows = [m for m in measured if m.engine == engine]
        table.add_row(engine, *(f"{m.error:.0e}  {1e3 * m.seconds:.0f} ms" for m in rows))
    console.print(table)
    table = Table("flight time", title="What paces the step of CVODES (Adams, 1e-7)")
    for column in ("fastest root, rad/s", "in", "limit 2/|root|", "step, functional", "step, Newton"):
        table.add_column(column, justify="right")
    for column in ("root with the largest local error", "pacing variable"):
        table.add_column(column)
    for pace in paces:
        table.add_row(
            f"{pace.begin:.4g} - {pace.end:.4g} s", _root(pace.fastest_root), " and ".join(pace.fastest_states),
            f"{1e3 * pace.functional_limit:.0f} ms", f"{1e3 * pace.functional_step:.0f} ms",
            f"{1e3 * pace.newton_step:.0f} ms", _root(pace.accuracy_root), pace.pacing_state,
        )  # fmt: skip
    console.print(table)
    figure = tolerance_figure(measured, paces, f"{study.system.name}: end times {named} s")
    for path in write_figure(figure, folder, "tolerance"):
        console.print(str(path), soft_wrap=True)


def _root(value: complex) -> str:
    return f"{value.real:.3g}" if value.imag == 0 else f"{value.real:.3g} ± {value.imag:.3g}j"
