"""The command ``run``: the main job, tables and figures of all responses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ...model.errors import AscentwindError, OutputFolderError, UnusedOptionError
from ..present.terminal import complain, console, print_table
from ..statistics.larger_side import LARGER_SIDE
from .flight_load import known_loads, print_levels
from .job import SHOWN, Job, load_study, on_terminal, steps
from .report import write_report
from .system import run_system
from .terminal import Changes, OptionalVehicle, Turbulence, number, parse_changes, results_folder

if TYPE_CHECKING:
    import xarray as xr

    from ..flight_load.load import FlightLoad
    from ..statistics.engine import Engine
    from ..statistics.peak_check import PeakCheck
    from ..statistics.peaks_of_resultants import ResultantCheck
    from ..statistics.resultants import Resultants
    from ..statistics.results import ResponseStatistics
    from ..study import Study
    from ..views.along_vehicle_files import LargestAlong

RESULTANTS_DRAWN = 100  # times of a curve, of which each costs as much as a percentile


def run(
    vehicle: OptionalVehicle = None,
    times: Annotated[str | None, typer.Option(help="End times in s: START:STOP:STEP or T1,T2,...")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-results without it.")] = None,
    engine: Annotated[
        str | None, typer.Option(help="sweep, cvodes, covariance or ensemble; the sweep where a compiler is found.")
    ] = None,
    method: Annotated[str | None, typer.Option(help="CVODES formulas, adams or bdf; chooses cvodes.")] = None,
    tolerance: Annotated[
        float | None, typer.Option(parser=number, help="Relative tolerance of the integration.")
    ] = None,
    probability: Annotated[
        list[float] | None,
        typer.Option(
            parser=number, help="Level passed with this chance besides, at an instant and in a flight; several times."
        ),
    ] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
    azimuths: Annotated[
        str | None,
        typer.Option(help="Azimuths in deg, START:STOP:STEP or A1,A2,...: resultants of both planes by each."),
    ] = None,
    along_vehicle: Annotated[
        str | None,
        typer.Option(help="Loads along the vehicle at this time (s, or 'peak'), and its envelope."),
    ] = None,
    system: Annotated[
        Path | None,
        typer.Option(help="A system of one's own in the place of a vehicle: the TOML file of its matrices."),
    ] = None,
    report: Annotated[
        bool, typer.Option("--report", help="Sensitivities and exceedance too, and all of it as one HTML page.")
    ] = False,
) -> None:
    """Mean, variance and |mean| + 3 sigma of all responses over flight time: tables and figures.

    Every peak, of resultants too, is computed again by CVODES, one adjoint run back from it; exit code 1 when they
    disagree.
    """
    if vehicle is None and system is None:
        raise typer.BadParameter("name a vehicle, or a system of one's own with --system FILE.toml")
    if report:
        from ..report.library import checked_libraries

        checked_libraries()
    from ...model.equations.stated_twice import compare_stated_twice
    from ...model.vehicle.planes import BOTH
    from ..case.times import DRAWN, parse_times
    from ..flight_load.files import with_flight_levels
    from ..flight_load.request import DESIGN
    from ..present.files import write_text
    from ..present.style import write_figure
    from ..present.wording import words
    from ..statistics.engines import engine_from
    from ..statistics.files import write_stored
    from ..statistics.larger_side import LABEL
    from ..statistics.norm import LIKE_3_SIGMA
    from ..statistics.peak_check import with_peak_check
    from ..statistics.peaks_of_resultants import with_resultant_check
    from ..statistics.percentiles import checked_probabilities
    from ..statistics.response_figures import response_figure, weighting_figure
    from ..statistics.resultants import has_resultants
    from ..views.along_vehicle_files import prepare_along_vehicle, write_along_vehicle
    from ..views.azimuth_sweep import check_turns, checked_azimuths
    from ..views.resultants_along_vehicle import write_resultants_along
    from ..views.trajectory_angle import air_speed_in_words, in_words, trajectory_angle, trajectory_angle_csv

    chances = checked_probabilities(probability) if probability else ()
    settings = {"method": method, "relative_tolerance": tolerance}
    if system is not None:
        of_vehicle = {
            "VEHICLE": vehicle, "--set": changes, "--turbulence": turbulence, "--azimuths": azimuths,
            "--along-vehicle": along_vehicle,
        }  # fmt: skip
        folder = run_system(system, times, out, engine_from(engine, **settings), tuple(chances), of_vehicle)
        if report:
            write_report(folder)
        return
    assert vehicle is not None
    turns = checked_azimuths(parse_times(azimuths)) if azimuths else []
    engine_from(engine, **settings)  # refused before anything is computed
    if times and "default_times" in parse_changes(changes or []):
        raise UnusedOptionError("--set default_times is not used with --times; leave one of them out")
    study = load_study(vehicle, changes, SHOWN, turbulence=turbulence)
    flown = study.vehicle_for("a run")
    compare_stated_twice(flown)
    chosen = engine_from(engine, compiled=study.executable.shared_library is not None, **settings)
    end_times = parse_times(times or flown.file.default_times)
    moment_time = None if along_vehicle is None else prepare_along_vehicle(study, along_vehicle)
    families = [t for t in flown.file.weighting_times_s if study.system.start < t <= study.system.end]
    study.checked_times(end_times)
    if turns:
        check_turns(study)
    job = Job(out or results_folder(vehicle, "results"))
    with on_terminal():
        statistics = study.response_statistics(end_times, engine=chosen)
    if chances:
        statistics = statistics.with_percentiles(chances)
    both = statistics.resultants((LIKE_3_SIGMA, *chances)) if has_resultants(statistics.dataset) else None
    job.replace_earlier("run", study)
    job.written += statistics.save(job.folder)
    if both is not None:
        job.written += both.save(job.folder)
    own = trajectory_angle(flown, end_times) if flown.file.planes != "yaw" else None
    if own is not None:
        job.written.append(write_text(job.folder / "trajectory_angle_of_attack.csv", trajectory_angle_csv(own)))
    computed = statistics
    try:
        with on_terminal():
            check = _check_peaks(study, statistics)
        if check is not None:
            statistics = with_peak_check(statistics, check, study)
            families = sorted({*families, *(p.time for p in check.peaks[:1] if p.time > study.system.start)})
        both_check = None
        if both is not None:
            with on_terminal():
                both_check = _check_resultants(study, both)
            if both_check is not None:
                statistics = with_resultant_check(statistics, both_check)
        loads = _flight_loads(study, end_times, (DESIGN, *chances))
        if loads:
            statistics = with_flight_levels(statistics, loads)
    finally:  # once for all of them, and in time for an interrupt
        if statistics is not computed:
            write_stored(statistics.dataset, job.folder)
    with steps("figures", len(study.system.outputs) + 2) as bar:
        if both is not None:
            finer = _drawn(study, statistics, end_times, chosen, RESULTANTS_DRAWN)
            smooth = None if finer is None else finer.resultants((LIKE_3_SIGMA,))
            job.written += _resultant_figures(both, smooth, flown.title, job.folder)
        drawn = _drawn(study, statistics, end_times, chosen, DRAWN)
        for output in study.system.outputs:
            title = f"{flown.title}\n{words(output.name).capitalize()}, mean and {LABEL}"
            figure = response_figure(statistics.dataset, output.name, title, None if drawn is None else drawn.dataset)
            job.written += write_figure(figure, job.folder, output.name)
            bar.done()
        weighting = _weighting(study, statistics, check, families)
        bar.done()
        if weighting:
            first = study.system.outputs[0]
            title = f"{flown.title}\nWeighting function from wind to {words(first.name)}"
            figure = weighting_figure(weighting, first.name, first.unit, title)
            job.written += write_figure(figure, job.folder, "weighting_functions")
        bar.done()
    along: list[LargestAlong] = []
    if turns:
        with on_terminal():
            job.written += _write_azimuths(study, turns, end_times, flown.title, job.folder)
    if along_vehicle is not None:
        with steps("loads along the vehicle"):
            if flown.file.planes == BOTH:
                job.written += write_resultants_along(study, end_times, moment_time, job.folder)
            else:
                files, along = write_along_vehicle(study, end_times, moment_time, job.folder)
                job.written += files
    _print_peaks(statistics)
    if both is not None:
        _print_resultants(both)
    if flown.file.planes != "yaw":
        for sentence in (*(in_words(own) if own is not None else ()), air_speed_in_words(flown, end_times)):
            console.print(sentence, style="dim", markup=False, highlight=False, soft_wrap=True)
    for chance in chances:
        _print_instant_levels(statistics, chance)
    if loads:
        print_levels(loads)
    if along:
        _print_along(along)
    top = min(mean.argument[-1] for mean in flown.wind.means)
    if study.tables(end_times[-1])["altitude"] > top:
        job.notes.append(f"Above {top / 1000:g} km the wind tables end and their last values are held.")
        console.print(job.notes[-1], style="dim")
    if report:
        _compute_for_report(study, loads, job)
    agree = check is not None and check.agree
    if both is not None:
        agree = agree and both_check is not None and both_check.agree
    if both_check is not None:
        job.notes.append(both_check.verdict())
    zoned = flown.zones is not None and both is None  # each of both planes has the delays of one alone
    delays = _check_delays(study, check) if zoned and check is not None else None
    if delays is not None:
        job.notes.append(delays[0])
        agree = agree and delays[1]
    job.end()
    if check is not None:
        _print_verdict(check.verdict(), check.agree)
    if both_check is not None:
        _print_verdict(both_check.verdict(), both_check.agree)
    if delays is not None:
        _print_verdict(*delays)
    if report:
        write_report(job.folder)
    if not agree:
        raise typer.Exit(1)


def _drawn(
    study: Study, statistics: ResponseStatistics, end_times: list[float], engine: Engine | None, count: int
) -> ResponseStatistics | None:
    """Return the statistics at more times, where the engine takes them all in one pass; None elsewhere."""
    from ..case.times import drawn_times
    from ..statistics.sweep import Sweep

    if statistics.attrs["engine"] != Sweep.name:
        return None
    times = drawn_times(end_times, study.executable.stops(end_times[-1]).times, count)
    return study.response_statistics(times, engine=engine)


def _weighting(
    study: Study, statistics: ResponseStatistics, check: PeakCheck | None, times: list[float]
) -> list[xr.Dataset]:
    """Return the weighting functions of end times: the check's own, the others by one sweep where the run is one."""
    from ..statistics.peak_check import SPACING, weighting_at
    from ..statistics.sweep import Sweep

    others = [time for time in times if check is None or time not in check.histories]
    found = {}
    if others and statistics.attrs["engine"] == Sweep.name:
        swept = study.weighting_functions(others, spacing=SPACING)
        found = {time: swept.sel(time=time, t=slice(None, time)).assign_attrs(t2_s=time) for time in others}
    return [found[time] if time in found else weighting_at(study, check, time) for time in times]


def _compute_for_report(study: Study, loads: list[FlightLoad], job: Job) -> None:
    """Write what a report shows beside a run: exceedance, and sensitivities of the first response at its peak."""
    from ..flight_load.files import write_flight_loads
    from ..sensitivity.report import write_sensitivity

    with steps("for the report", 2) as bar:
        try:
            if loads:
                bar.done("exceedance")
                job.written += write_flight_loads(loads, job.folder)
            bar.done("sensitivities")
            found = study.sensitivity(study.system.output_names[0], "peak", quantity=LARGER_SIDE)
            job.written += write_sensitivity(found, job.folder)
        except OutputFolderError:
            raise
        except AscentwindError as error:
            text = f"Not all for the report could be computed, all else stands: {error}"
            job.notes.append(text)
            complain(text)


def _print_verdict(text: str, good: bool) -> None:
    console.print(text, style="green" if good else "bold red", markup=False, highlight=False, soft_wrap=True)


def _check_delays(study: Study, check: PeakCheck) -> tuple[str, bool]:
    """Hold rational delays of gusts against exact ones at the first response's peak: a sentence, and if they agree."""
    from ..statistics.exact_penetration import verdict

    try:
        with on_terminal():
            return verdict(study.check_gust_penetration(check.peaks[0].time))
    except AscentwindError as error:
        return f"The delays of gusts along the vehicle stand unchecked: {error}", False


def _check_peaks(study: Study, statistics: ResponseStatistics) -> PeakCheck | None:
    """Hold the peaks of written results against another road; where it fails say so, so that nothing is lost."""
    from ..statistics.peak_check import check_peaks

    try:
        return check_peaks(study, statistics)
    except AscentwindError as error:
        text = f"The peaks could not be computed a second time, by another road, and stand unchecked: {error}"
        complain(text)
        return None


def _check_resultants(study: Study, both: Resultants) -> ResultantCheck | None:
    """Hold the peaks of written resultants against CVODES; where it fails say so, so that nothing is lost."""
    from ..statistics.peaks_of_resultants import check_resultants

    try:
        return check_resultants(study, both)
    except AscentwindError as error:
        text = f"The resultants could not be computed a second time, by CVODES, and stand unchecked: {error}"
        complain(text)
        return None


def _flight_loads(study: Study, end_times: list[float], probabilities: tuple[float, ...]) -> list[FlightLoad]:
    """Return the flight's load of every response between the first and the last end time; where it fails say so."""
    from ..flight_load.request import NoVarianceError

    loads: list[FlightLoad] = []
    if end_times[-1] <= end_times[0]:
        return loads
    names = known_loads(study)
    with steps("loads of the flight", len(names)) as bar:
        for name in names:
            try:
                loads.append(study.flight_load(name, (end_times[0], end_times[-1]), probabilities))
                _ = loads[-1].levels
            except NoVarianceError:
                pass
            except AscentwindError as error:
                text = f"The flight's level of {name} could not be computed, all else stands: {error}"
                complain(text)
            bar.done()
    return loads


def _print_peaks(statistics: ResponseStatistics) -> None:
    from ..present.wording import display, words
    from ..statistics.larger_side import LABEL

    found = statistics.peaks()
    table = Table("response", title=f"Peaks of {LABEL}")
    for column in ("time", LABEL, "side", "mean", "σ"):
        table.add_column(column, justify="right", no_wrap=True)
    for peak in found:
        factor, unit = display(peak.unit, peak.value)
        value, mean, std = (f"{factor * x:.4g} {unit}" for x in (peak.value, peak.mean, peak.std))
        table.add_row(words(peak.response), f"{peak.time:g} s{'*' if peak.at_end else ''}", value, peak.side, mean, std)
    print_table(table, console)
    table = Table("response", title="Share of the variance at the peak")
    for source in found[0].shares:
        table.add_column(words(source), justify="right")
    for peak in found:
        table.add_row(words(peak.response), *(f"{100 * share:.2f} %" for share in peak.shares.values()))
    print_table(table, console)
    at_end = any(peak.at_end for peak in found)
    if at_end:
        console.print("* on the first or last end time asked for; the peak of the flight may lie beyond", style="dim")


def _print_instant_levels(statistics: ResponseStatistics, probability: float) -> None:
    from ..present.wording import display, words

    found = statistics.percentile(probability)
    table = Table("response", title=f"Passed with {probability:g} at an instant, in size")
    for column in ("time", "level", "larger side"):
        table.add_column(column, justify="right", no_wrap=True)
    for name in found["response"].values:
        at = found.sel(response=name)
        at = at.isel(time=int(at.values.argmax()))
        factor, unit = display(str(at["unit"].item()), float(at))
        time = f"{float(at['time']):g} s"
        table.add_row(words(str(name)), time, f"{factor * float(at):.4g} {unit}", str(at["side"].item()))
    print_table(table, console)


def _resultant_figures(both: Resultants, smooth: Resultants | None, title: str, folder: Path) -> list[Path]:
    from ..present.style import write_figure
    from ..present.wording import words
    from ..statistics.resultant_figures import direction_figure, history_figure

    written = []
    for name in (str(name) for name in both.dataset["resultant"].values):
        head = f"{title}\n{words(name).capitalize()}"
        written += write_figure(history_figure(both, name, head, smooth), folder, name)
        written += write_figure(direction_figure(both, name, head), folder, f"{name}_by_direction")
    return written


def _write_azimuths(
    study: Study, azimuths: list[float], end_times: list[float], title: str, folder: Path
) -> list[Path]:
    """Write and print the resultants by azimuth."""
    from ..present.files import write_text
    from ..present.style import write_figure
    from ..present.wording import display, words
    from ..views.azimuth_sweep import AZIMUTH, azimuth_csv, azimuth_figure, azimuth_sweep

    found = azimuth_sweep(study, azimuths, end_times)
    text, flown = azimuth_csv(found), math.degrees(study.parameters[AZIMUTH].value)
    written = [write_text(folder / "azimuths.csv", text)]
    table = Table("azimuth", title=f"Peaks of resultants by azimuth, passed with {found.attrs['probability']:.3g}")
    names = [str(name) for name in found["resultant"].values]
    units = [display(str(found["unit"].sel(resultant=n).item()), found["level"].sel(resultant=n)) for n in names]
    for name, (_, unit) in zip(names, units, strict=True):
        table.add_column(f"{words(name)}, {unit}", justify="right")
        head = f"{title}\n{words(name).capitalize()} by azimuth"
        written += write_figure(azimuth_figure(found, name, flown, head), folder, f"{name}_by_azimuth")
    for azimuth, row in zip(found["azimuth"].values, found["level"].values, strict=True):
        values = (f"{factor * value:.4g}" for (factor, _), value in zip(units, row, strict=True))
        table.add_row(f"{azimuth:g}°", *values)
    print_table(table, console)
    return written


def _print_resultants(both: Resultants) -> None:
    from ..present.wording import display, words

    for chance in (float(p) for p in both.dataset["probability"].values):
        table = Table("resultant", title=f"Resultants of pitch and yaw, passed with {chance:.3g} at an instant")
        for column in ("time", "level", "direction", "spread", "mean in pitch", "in yaw"):
            table.add_column(column, justify="right", no_wrap=True)
        for peak in both.peaks(chance):
            factor, unit = display(peak.unit, peak.value)
            level, first, second = (f"{factor * x:.4g}" for x in (peak.value, *peak.mean))
            angles = (f"{math.degrees(angle):.0f}°" for angle in (peak.direction, peak.spread))
            time = f"{peak.time:g} s{'*' if peak.at_end else ''}"
            table.add_row(words(peak.resultant), time, f"{level} {unit}", *angles, first, second)
        print_table(table, console)
    console.print(
        "Direction from +pitch (nose pitching over) towards +yaw (to the right); a norm has no mean + 3 sigma.",
        style="dim",
    )


def _print_along(found: list[LargestAlong]) -> None:
    from ..present.wording import display, words
    from ..statistics.larger_side import LABEL

    table = Table("load", title=f"Largest {LABEL} along the vehicle")
    for column in (LABEL, "side", "station", "time"):
        table.add_column(column, justify="right", no_wrap=True)
    for load in found:
        factor, unit = display(load.unit, load.value)
        value = f"{factor * load.value:.4g} {unit}"
        table.add_row(words(load.load), value, load.side, f"{load.station:.4g} m", f"{load.time:g} s")
    print_table(table, console)
