"""The commands ``availability`` and ``wind months``: how often a month lets a vehicle fly."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ...model.errors import DataError, ParameterValueError, TimeRangeError
from ..present.terminal import console, print_table
from .flight_load import parse_window
from .job import Job, load_study, on_terminal, steps
from .soundings import parse_months
from .terminal import Changes, VehicleArgument, given, number, refuse_unused, results_folder, whole

if TYPE_CHECKING:
    from ...model.wind.statistics import TwoComponentStatistics

TOP = 30000.0  # m
FEW = 3  # azimuths, whose intervals are printed
MOST_ROSES = 6  # of the largest loads
FEWEST_OF_A_ROSE = 2  # azimuths


def availability(
    context: typer.Context,
    vehicle: VehicleArgument,
    limit: Annotated[
        Path, typer.Option(help="CSV: 'time [s]' and/or 'station [m]', then limits such as 'bending_moment [N m]'.")
    ],
    months: Annotated[str, typer.Option(help="By name or number, commas between, or all.")] = "all",
    azimuths: Annotated[
        str | None, typer.Option(help="START:STOP:STEP or A1,A2,... in deg; the vehicle's own without it.")
    ] = None,
    winds: Annotated[
        Path | None, typer.Option(help="Folder written by 'ascentwind wind months'; Cape Canaveral without it.")
    ] = None,
    window: Annotated[
        str | None, typer.Option(help="BEGIN:END of the flight in s; the vehicle's default times without it.")
    ] = None,
    check_hours: Annotated[
        float | None, typer.Option(parser=number, help="With a sounding so many hours before launch.")
    ] = None,
    threshold: Annotated[float, typer.Option(parser=number, help="Of the check's go.")] = 0.01,
    sides: Annotated[str, typer.Option(help="both, upper or lower.")] = "both",
    draws: Annotated[int, typer.Option(parser=whole, help="Paths of the importance sampling.")] = 2000,
    seed: Annotated[int, typer.Option(parser=whole, help="Of the draws.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-availability without it.")] = None,
    changes: Changes = None,
) -> None:
    """The chance that a flight keeps its limits, by month and launch azimuth."""
    import numpy as np

    from ...model.wind.range_reference import MONTHS
    from ..case.times import parse_times
    from ..flight_load.limit_table import Limits
    from ..measured_winds.availability_figure import availability_figure, load_rose
    from ..present.files import write_text
    from ..present.netcdf import one_unit_a_variable, with_conventions, write_netcdf
    from ..present.style import write_figure
    from ..statistics.percentiles import checked_sides

    if check_hours is None:
        refuse_unused(context, ["threshold"], "without --check-hours")
    chosen, flown = checked_sides(sides), None if window is None else parse_window(window)
    try:
        angles = None if azimuths is None else np.radians(parse_times(azimuths))
    except TimeRangeError:
        raise ParameterValueError(f"'{azimuths}' names no azimuths; write START:STOP:STEP or A1,A2 in deg") from None
    names = None
    if months != "all":
        names = [m if isinstance(m, str) else MONTHS[m - 1] if 1 <= m <= 12 else str(m) for m in parse_months(months)]
    limits = Limits.read(limit)
    study = load_study(vehicle, changes, ["title", "default_times"] if window is None else ["title"])
    job = Job(out or results_folder(vehicle, "availability"))
    with on_terminal():
        found = study.availability(
            limits, months=names, azimuths=angles, winds=winds, window=flown, check_hours=check_hours,
            threshold=threshold, sides=chosen, draws=draws, seed=seed,
        )  # fmt: skip
    job.replace_earlier("availability", study)
    kept = [
        "probability",
        "lower",
        "upper",
        "standard_error",
        "spacing_error",
        *(["stopped", "remaining_risk"] if check_hours is not None else []),
    ]
    rows = [",".join(["month", "azimuth_deg", *kept])]
    for month in found["month"].values:
        for angle in found["azimuth"].values:
            cells = (float(found[name].sel(month=month, azimuth=angle)) for name in kept)
            rows.append(",".join([str(month), f"{np.degrees(angle):.6g}", *(f"{x:.6g}" for x in cells)]))
    text = "\n".join(rows) + "\n"
    units = [str(unit) for unit in found["unit"].values]
    level = found.drop_vars("unit")
    level["level"].attrs["unit_rule"] = "response"
    whole_file = one_unit_a_variable(level, {"response": units}, words={})
    job.written.append(write_netcdf(with_conventions(whole_file), job.folder / "availability.nc"))
    job.written.append(write_text(job.folder / "availability.csv", text))
    title = study.vehicle_for("availability").title
    planes = "both planes" if found.attrs["plane"] == "both" else f"{found.attrs['plane']} plane"
    heading = f"{title}\n{planes.capitalize()}: the months' winds of {found.attrs['site']}, not the vehicle's own"
    job.written += write_figure(availability_figure(found, heading), job.folder, "availability")
    worst = found["level"].max(dim=("month", "azimuth")).values
    around = found["azimuth"].size >= FEWEST_OF_A_ROSE
    for name in found["response"].values[np.argsort(-worst, kind="stable")[: MOST_ROSES if around else 0]]:
        job.written += write_figure(load_rose(found, str(name), heading), job.folder, f"rose_{name}")
    table = Table("month", title=f"Flights that pass a limit, {planes}, winds of {found.attrs['site']}")
    shown = found["azimuth"].values
    for angle in shown:
        table.add_column(f"{np.degrees(angle):.4g}°", justify="right", no_wrap=True)
    for month in found["month"].values:
        part = found.sel(month=month)
        cells = []
        for angle in shown:
            at = part.sel(azimuth=angle)
            cell = f"{float(at['probability']):.1e}"
            if shown.size <= FEW:
                cell += f" ({float(at['lower']):.0e} to {float(at['upper']):.0e})"
            if check_hours is not None:
                cell += f"\nstops {100 * float(at['stopped']):.0f} %, then {float(at['remaining_risk']):.1g}"
            cells.append(cell)
        table.add_row(str(month), *cells)
    print_table(table, console)
    console.print(
        f"The grid of times leaves up to {100 * float(found['spacing_error'].max()):.1f} % of a chance open, the draws "
        f"{100 * float((found['standard_error'] / found['probability'].clip(1e-300)).max()):.0f} % (one standard "
        "error). The files hold, and few azimuths show, 90 % by the sampling of the wind's statistics alone: errors of "
        "filters, of reconstructed correlations and of the model are not in them.",
        style="dim", soft_wrap=True,
    )  # fmt: skip
    job.end()


def months(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for a file a month.")],
    edition: Annotated[str, typer.Option(help="Range Reference Atmosphere: 1983 or 2006.")] = "1983",
    soundings: Annotated[
        Path | None, typer.Option(help="Soundings at common levels with dates instead, split by month.")
    ] = None,
    site: Annotated[str | None, typer.Option(help="Of the soundings.")] = None,
    chosen: Annotated[str, typer.Option("--months", help="By name or number, commas between, or all.")] = "all",
) -> None:
    """Fit filters of both wind components for every month, for 'ascentwind availability'."""
    import time

    from ...model.errors import UnknownNameError
    from ...model.wind.month_winds import month_file
    from ...model.wind.range_reference import MONTHS, SITE, shipped_two_components
    from ..present.files import prepare_folder, write_text
    from ..wind.month_fit import fit_month

    if soundings is None:
        refuse_unused(context, ["site"], "without --soundings: the shipped tables are of Cape Canaveral")
    else:
        refuse_unused(context, ["edition"], "with --soundings")
        if site is None:
            raise DataError("soundings do not say where they were taken; give --site")
    wanted: list[str] = list(MONTHS)
    if chosen != "all":
        wanted = [m if isinstance(m, str) else MONTHS[m - 1] if 1 <= m <= 12 else str(m) for m in parse_months(chosen)]
    for month in wanted:
        if month not in MONTHS:
            raise UnknownNameError("month", month, MONTHS)
    statistics: dict[str, TwoComponentStatistics] = {}
    if soundings is None:
        for month in wanted:
            statistics[month] = shipped_two_components(month, edition=edition, top=TOP)
    else:
        statistics = _by_month(soundings, wanted, str(site), given(context, "chosen"))
    prepare_folder(out)
    begun = time.perf_counter()
    with steps("months", len(statistics)) as bar:
        for month, both in statistics.items():
            origin = both.zonal.origin
            kept = edition if origin is None or soundings is None else origin.edition
            made = fit_month(both, month, SITE if soundings is None else str(site), kept)
            write_text(out / month_file(month), made.text())
            bar.done(month)
    took = time.perf_counter() - begun
    console.print(f"{len(statistics)} months in {out}, {took:.0f} s", soft_wrap=True, highlight=False)


def _by_month(soundings: Path, wanted: list[str], site: str, named: bool) -> dict[str, TwoComponentStatistics]:
    """Return statistics of the months that soundings have; those asked for by name must be there."""
    from ...model.wind.range_reference import MONTHS
    from ...model.wind.soundings.read import read_profiles, read_soundings
    from ...model.wind.soundings.sounding import SoundingError

    there = {MONTHS[p.time.month - 1] for p in read_profiles(soundings)[0] if p.time is not None}
    if not there:
        raise SoundingError("its profiles have no dates, which say their month; add a column 'date'", file=soundings)
    found, why = {}, {}
    for month in wanted:
        if month not in there and not named:
            continue
        try:
            found[month] = read_soundings(soundings, months=[month]).statistics(f"{site} {month}", site)
        except SoundingError as error:
            if named:
                raise
            why[month] = str(error)
    if not found:
        raise SoundingError(f"no month has statistics: {next(iter(why.values()))}", file=soundings)
    for month, reason in why.items():
        console.print(f"{month} left out: {reason}", style="dim", soft_wrap=True, markup=False, highlight=False)
    return found
