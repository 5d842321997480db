"""The commands that check results: ``verify`` and ``tolerance``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ..present.terminal import Terminal, console, print_table
from .job import Job, load_study, on_terminal
from .terminal import Changes, Turbulence, VehicleArgument, results_folder, whole

if TYPE_CHECKING:
    from ..statistics.agreement_of_resultants import ResultantAgreement

WIDE = 150  # columns: tables that a narrow terminal wraps but a file keeps whole


def verify(
    vehicle: VehicleArgument,
    times: Annotated[
        str | None, typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...; four of the vehicle's without it.")
    ] = None,
    runs: Annotated[int, typer.Option(parser=whole, help="Simulated flights of the ensemble.")] = 500,
    seed: Annotated[int, typer.Option(parser=whole, help="Of the ensemble's noise.")] = 504,
    out: Annotated[Path | None, typer.Option(help="Folder for a figure of sample paths; none without it.")] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """The same statistics by independent engines, with a verdict; exit code 1 when they disagree."""
    from ..case.times import parse_times, spread_over
    from ..statistics.agreement import agreement
    from ..statistics.ensemble import Ensemble

    ensemble = Ensemble(runs=runs, seed=seed, paths=min(30, runs) if out else 0)
    study = load_study(vehicle, changes, [] if times else ["default_times"], turbulence=turbulence)
    flown = study.vehicle_for("default times")
    end_times = parse_times(times) if times else spread_over(parse_times(flown.file.default_times), 4)
    study.checked_times(end_times)
    job = Job(out) if out else None
    with on_terminal():
        found = agreement(study, end_times, ensemble)
    _print_agreement(found)
    if found.resultants is not None:
        _print_resultants(found.resultants)
    if job:
        from ..present.style import write_figure
        from ..statistics.response_figures import sample_path_figure

        with on_terminal():
            start, last = study.system.start, max(end_times)
            at = [start + (last - start) * k / 60 for k in range(1, 61)]
            title = f"{study.system.name}: simulated flights and the adjoint's mean ± 3σ"
            adjoint = study.response_statistics(at, engine="cvodes")
            figure = sample_path_figure(found.statistics["ensemble"].dataset, adjoint.dataset, title)
        job.replace_earlier("verify", study)
        job.written += write_figure(figure, job.folder, "sample_paths")
        job.end()
    console.print(found.verdict(), style="green" if found.agree else "bold red", highlight=False)
    if not found.agree:
        raise typer.Exit(1)


def _print_agreement(found) -> None:
    from ..present.wording import display, words
    from ..statistics.agreement import REFERENCE
    from ..statistics.engines import ENGINES

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
    Terminal(file=console.file, width=max(console.width, WIDE), emoji=False, markup=False).print(table)


def _print_resultants(found: ResultantAgreement) -> None:
    from ..present.wording import display, words
    from ..statistics.agreement import REFERENCE
    from ..statistics.engines import ENGINES

    low, high = found.interval
    title = f"Levels that resultants pass with {found.probability:g} at an instant, by independent engines"
    table = Table("time", "resultant", title=title)
    table.add_column(f"level, {ENGINES[REFERENCE].label}", justify="right")
    for engine in found.differences:
        table.add_column(f"{ENGINES[engine].label}, difference", justify="right")
    table.add_column(f"of {found.flights} flights pass", justify="right")
    table.add_column(f"{found.confidence:.0%} interval", justify="right")
    table.add_column("inside")
    for k, time in enumerate(found.times):
        for r, resultant in enumerate(found.resultants):
            factor, unit = display(found.units[r], found.level[:, r])
            table.add_row(
                f"{time:g} s", words(resultant), f"{factor * found.level[k, r]:.5g} {unit}",
                *(f"{d[k, r]:.1e}" for d in found.differences.values()),
                str(found.passed[k, r]), f"{low} to {high}", "yes" if found.inside[k, r] else "no",
                end_section=r + 1 == len(found.resultants),
            )  # fmt: skip
    Terminal(file=console.file, width=max(console.width, WIDE), emoji=False, markup=False).print(table)


def tolerance(
    vehicle: VehicleArgument,
    times: Annotated[
        str | None,
        typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...; greatest dynamic pressure without it."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the figure; VEHICLE-tolerance without it.")] = None,
    changes: Changes = None,
) -> None:
    """Error and run time of each engine against tolerance, and the variable that paces the step."""
    from ..case.times import parse_times, time_of_greatest_dynamic_pressure
    from ..present.style import write_figure
    from ..statistics.tolerance import TOLERANCES, measure, pacing
    from ..statistics.tolerance_figure import tolerance_figure

    end_times = parse_times(times) if times else []
    study = load_study(vehicle, changes)
    flown = study.vehicle_for("default times")
    end_times = end_times or [time_of_greatest_dynamic_pressure(flown)]
    study.checked_times(end_times)
    named = times or f"{end_times[0]:g}"
    job = Job(out or results_folder(vehicle, "tolerance"))
    with on_terminal():
        measured = measure(study, end_times)
        paces = pacing(study, max(end_times))
    table = Table("engine", title=f"Largest relative error of a σ, and run time, end times {named} s")
    for value in TOLERANCES:
        table.add_column(f"{value:.0e}", justify="right")
    for engine in dict.fromkeys(m.engine for m in measured):
        rows = [m for m in measured if m.engine == engine]
        table.add_row(engine, *(f"{m.error:.0e}  {1e3 * m.seconds:.0f} ms" for m in rows))
    print_table(table, console)
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
    print_table(table, console)
    job.replace_earlier("tolerance", study)
    figure = tolerance_figure(measured, paces, f"{study.system.name}: end times {named} s")
    job.written += write_figure(figure, job.folder, "tolerance")
    job.end()


def _root(value: complex) -> str:
    return f"{value.real:.3g}" if value.imag == 0 else f"{value.real:.3g} ± {value.imag:.3g}j"
