"""The command ``flight-load``: the largest value of every response over the flight, with its odds, and limits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ...model.errors import AscentwindError, TimeRangeError, UnusedOptionError
from ...model.files.numbers import parse_number
from ..present.terminal import complain, console, print_table
from .job import Job, load_study, steps
from .terminal import Changes, Turbulence, VehicleArgument, number, results_folder, whole

SHOWN_LIMITS = 8
SHOWN_PARAMETERS = 8
ONE_SIDE = 0.995  # of the flights that pass, at least

if TYPE_CHECKING:
    import xarray as xr

    from ..flight_load.load import FlightLoad
    from ..flight_load.passage import Passage
    from ..study import Study


def flight_load(
    vehicle: VehicleArgument,
    window: Annotated[
        str | None, typer.Option(help="BEGIN:END of the flight in s; the vehicle's default times without it.")
    ] = None,
    response: Annotated[
        list[str] | None, typer.Option(help="Response or resultant of both planes, several times; all without it.")
    ] = None,
    probability: Annotated[
        list[float] | None,
        typer.Option(parser=number, help="Chance with which the level is passed, several times; 0.00135 without it."),
    ] = None,
    limit: Annotated[
        Path | None,
        typer.Option(help="CSV: time in s, station in m or both, then limits such as 'bending_moment [N m]'."),
    ] = None,
    sides: Annotated[str, typer.Option(help="both, upper or lower.")] = "both",
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Derivatives of the first level by parameters, ranked.")
    ] = False,
    wind_error: Annotated[
        float | None,
        typer.Option(parser=number, help="Relative spread of the wind's sigma from flight to flight, e.g. 0.08."),
    ] = None,
    draws: Annotated[int, typer.Option(parser=whole, help="Paths of the importance sampling.")] = 2000,
    seed: Annotated[int, typer.Option(parser=whole, help="Of the draws.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for results; VEHICLE-flight-load without it.")] = None,
    changes: Changes = None,
    turbulence: Turbulence = None,
) -> None:
    """The load of the whole flight: levels that its largest values pass, exceedance, limits and margins.

    Of a vehicle in both planes, resultants stand beside the responses of each plane; limits of a load along the vehicle
    are then of its resultant.
    """
    from ..flight_load.capability_figure import capability_figure
    from ..flight_load.exceedance_figure import exceedance_figure
    from ..flight_load.files import write_flight_loads, write_passage, write_sensitivities
    from ..flight_load.limit_table import Limits
    from ..flight_load.limits import checked_limits
    from ..flight_load.margin_figure import margin_figure
    from ..flight_load.request import DESIGN, NoVarianceError, checked_draws
    from ..flight_load.uncertain_parameter import checked_spread
    from ..flight_load.window import checked_window
    from ..present.style import write_figure
    from ..present.wording import words
    from ..statistics.percentiles import checked_probabilities, checked_sides
    from ..statistics.resultants import response_or_resultant

    asked, chosen = checked_probabilities(probability or [DESIGN]), checked_sides(sides)
    flown = None if window is None else parse_window(window)
    limits = None if limit is None else Limits.read(limit)
    checked_draws(draws, seed)
    if wind_error is not None:
        checked_spread(wind_error)
    study = load_study(
        vehicle, changes, ["title", "default_times"] if window is None else ["title"], turbulence=turbulence
    )
    names = (
        [response_or_resultant(study, name) for name in dict.fromkeys(response)]
        if response
        else known_loads(study, chosen)
    )
    flown = checked_window(study, flown)
    if limits is not None:
        checked_limits(study, limits, flown)
    over_time = limits if limits is not None and limits.station is None else None
    if over_time is not None and not set(over_time.values) & set(names):
        raise UnusedOptionError(f"{limit} holds no limit of {', '.join(names)}; it has {', '.join(over_time.values)}")
    job = Job(out or results_folder(vehicle, "flight-load"))
    title = study.vehicle_for("a flight's load").title
    loads = []
    with steps("loads of the flight", len(names)) as bar:
        for name in names:
            own = over_time if over_time is not None and name in over_time.values else None
            try:
                load = study.flight_load(name, flown, asked, limit=own, sides=chosen, draws=draws, seed=seed)
                _ = load.exceedance, load.time_of_maximum, load.shares
                loads.append(load)
            except NoVarianceError as error:
                if response or own is not None or (name == names[-1] and not loads):
                    raise
                console.print(f"Left out: {error}", style="dim", soft_wrap=True, markup=False)
            bar.done(words(name))
    passage = None
    if limits is not None and (over_time is None or len(over_time.values) > 1):
        with steps("limits together"):
            passage = study.limit_passage(limits, flown, asked[0], sides=chosen, draws=2 * draws, seed=seed)
            _ = passage.probability, passage.factor
    job.replace_earlier("flight-load", study)
    job.written += write_flight_loads(loads, job.folder)
    if passage is not None:
        job.written += write_passage(passage, job.folder)
        if over_time is None:
            heading = f"{title}\nLimits along the vehicle, {passage.design:g} of flights"
            job.written += write_figure(capability_figure(passage, heading), job.folder, "limits_along_vehicle")
    with steps("figures", len(loads)) as bar:
        for load in loads:
            heading = f"{title}\nLargest {words(load.response)} of the flight"
            job.written += write_figure(exceedance_figure(load, heading), job.folder, f"exceedance_{load.response}")
            if load.limits is not None:
                heading = f"{title}\n{words(load.response).capitalize()} and its limit"
                job.written += write_figure(margin_figure(load, heading), job.folder, f"limit_{load.response}")
            bar.done()
    print_loads(loads)
    if wind_error is not None:
        _print_uncertain(loads, wind_error)
    if passage is not None:
        print_passage(passage)
    if sensitivity:
        found = _sensitivities(loads)
        if found:
            job.written.append(write_sensitivities(found, job.folder))
        for part in found:
            print_sensitivity(part)
    job.end()


def parse_window(text: str) -> tuple[float, float]:
    """Return begin and end of a window from BEGIN:END in seconds.

    Raises
    ------
    TimeRangeError
    """
    try:
        begin, end = (parse_number(part) for part in text.split(":"))
    except ValueError:
        raise TimeRangeError(f"'{text}' is no window; write BEGIN:END in seconds, such as 40:100") from None
    return begin, end


def known_loads(study: Study, sides: str = "both") -> list[str]:
    """Return the responses that a flight's load is known of, and the resultants, which have no sides."""
    from ..statistics.resultants import resultant_pairs

    names = study.checked_responses(None)
    return [*names, *resultant_pairs(names)] if sides == "both" else names


def print_levels(loads: list[FlightLoad]) -> None:
    """Print the levels of flights beside those of their worst instants."""
    from ..present.wording import display, words

    begin, end = loads[0].window
    sides = {"both": "size", "upper": "upper side", "lower": "lower side"}[loads[0].sides]
    title = f"Largest values of a whole flight, {begin:g} to {end:g} s, {sides}"
    table = Table("response", title=title)
    for column in ("chance", "level", "side", "± 95 %", "worst instant", "ratio"):
        table.add_column(column, justify="right", no_wrap=True)
    for load in loads:
        rows = zip(load.probabilities, load.levels, load.instant_level.values, load.side, strict=True)
        for k, (p, found, instant, side) in enumerate(rows):
            factor, unit = display(load.unit, found.value)
            share = float(load.side_shares[k].max())
            half = 0.5 * (found.interval[1] - found.interval[0])
            table.add_row(
                words(load.response), f"{p:g}", f"{factor * found.value:.4g} {unit}",
                f"{side} {100 * share:.0f} %" if share <= ONE_SIDE else side, f"{factor * half:.2g}",
                f"{factor * instant:.4g} {unit}", f"{found.value / instant:.3f}",
            )  # fmt: skip
    print_table(table, console)


def print_wind_intervals(loads: list[FlightLoad]) -> None:
    """Print how well the wind's soundings know the levels, and how many simulated flights would say as much."""
    from ..present.wording import display, words

    samples = loads[0].wind_samples
    if samples is None:
        console.print(
            "How well the wind is known is not stated: give independent_samples in [wind.record] of vehicle.toml.",
            style="dim", soft_wrap=True, markup=False,
        )  # fmt: skip
    else:
        table = Table(
            "response", title=f"95 % intervals of the levels by {samples:g} independent soundings of the wind"
        )
        for column in ("chance", "from", "to", "of the level"):
            table.add_column(column, justify="right", no_wrap=True)
        for load in loads:
            for p, found, (low, high) in zip(load.probabilities, load.levels, load.wind_interval().values, strict=True):
                factor, unit = display(load.unit, found.value)
                relative = f"{100 * (low / found.value - 1):+.1f} % {100 * (high / found.value - 1):+.1f} %"
                ends = (f"{factor * x:.4g} {unit}" for x in (low, high))
                table.add_row(words(load.response), f"{p:g}", *ends, relative if found.value > 0 else "")
        print_table(table, console)
        console.print(
            "By sampling of the wind alone: errors of its filter, of reconstructed correlations and of the model are "
            "not in them.", style="dim", soft_wrap=True,
        )  # fmt: skip
    for p in loads[0].probabilities:
        console.print(
            f"{loads[0].monte_carlo_runs(p):,} simulated flights without a failure would say as much of {p:g}, at a "
            "consumer's risk of 10 %.", highlight=False, soft_wrap=True,
        )  # fmt: skip


def _sensitivities(loads: list[FlightLoad]) -> list[xr.Dataset]:
    """Return derivatives of the first levels; where one fails say so, so that what is written stands."""
    from ..present.wording import words

    found = []
    with steps("derivatives of the levels", len(loads)) as bar:
        for load in loads:
            try:
                found.append(load.sensitivity())
            except AscentwindError as error:
                text = f"The derivatives of {load.response} could not be computed, all else stands: {error}"
                complain(text)
            bar.done(words(load.response))
    return found


def _print_uncertain(loads: list[FlightLoad], wind_error: float) -> None:
    """Print the levels of flights of which each has its own sigma of the wind."""
    from ..present.wording import display, words

    table = Table(
        "response", title=f"Levels with the wind's σ uncertain by {100 * wind_error:.3g} % from flight to flight"
    )
    for column in ("chance", "level", "± 95 %", "against one σ"):
        table.add_column(column, justify="right", no_wrap=True)
    with steps("levels with an uncertain wind", len(loads)) as bar:
        for load in loads:
            found = load.level_with_uncertain(spread=wind_error)
            for k, p in enumerate(load.probabilities):
                factor, unit = display(load.unit, float(found[k]))
                half = f"{1.96 * factor * found.attrs['standard_error'][k]:.2g}"
                more = f"{100 * (float(found[k]) / load.levels[k].value - 1):+.2g} %"
                table.add_row(words(load.response), f"{p:g}", f"{factor * float(found[k]):.4g} {unit}", half, more)
            bar.done(words(load.response))
    print_table(table, console)


def print_sensitivity(found: xr.Dataset) -> None:
    """Print the parameters that a level owes most to."""
    from ..present.wording import display, words

    a = found.attrs
    factor, unit = display(a["unit"], a["level"])
    title = f"What drives the level of {words(a['response'])} passed with {a['probability']:g}: "
    table = Table("parameter", title=f"{title}{factor * a['level']:.4g} {unit}")
    for column in ("value", "% per %", f"derivative ({a['unit']} per unit)"):
        table.add_column(column, justify="right", no_wrap=True)
    for k, name in enumerate(found["parameter"].values[:SHOWN_PARAMETERS]):
        value = f"{float(found['parameter_value'][k]):.5g} {found['parameter_unit'].values[k]}".removesuffix(" 1")
        table.add_row(
            str(name), value, f"{float(found['elasticity'][k]):+.4f}", f"{float(found['derivative'][k]):+.4g}"
        )
    print_table(table, console)


def print_loads(loads: list[FlightLoad]) -> None:
    """Print levels, the shares of the sources, and what limits leave."""
    from ..present.wording import words

    print_levels(loads)
    print_wind_intervals(loads)
    table = Table("response", title="Shares of the sources where the level is reached")
    for source in loads[0].of.case.system.sources:
        table.add_column(words(source), justify="right")
    for load in loads:
        shares = load.shares["share"].isel(probability=0).values
        table.add_row(words(load.response), *(f"{100 * share:.2f} %" for share in shares))
    print_table(table, console)
    for load in loads:
        if load.limits is not None:
            passage = load.passage
            p = passage.probability
            console.print(
                f"The limit of {words(load.response)} is passed by {p.value:.3g} of flights (95 %: {p.interval[0]:.2g} "
                f"to {p.interval[1]:.2g}; worst instant alone {p.largest_instant:.2g}); at {passage.design:g} the "
                f"margin of safety is {passage.margin_of_safety:+.3f}.",
                highlight=False, soft_wrap=True,
            )  # fmt: skip


def print_passage(passage: Passage) -> None:
    """Print the chance to pass any of several limits, and where it comes from."""
    p, chance = passage.probability, passage.by_load.values
    table = Table("limit of", title="Limits passed most often")
    for column in ("chance", "least margin", "side", "at"):
        table.add_column(column, justify="right", no_wrap=True)
    from ..present.wording import display

    margin, times, mean = passage.margin.values, passage.margin["time"].values, passage.process.drawn.mean[passage.told]
    for r in sorted(range(chance.size), key=lambda r: -chance[r])[:SHOWN_LIMITS]:
        load, at = passage.loads[r], int(margin[:, r].argmin())
        factor, unit = display(load.unit, passage.limit[:, r])
        left = f"{factor * margin[at, r]:.3g} {unit}"
        side = passage.sides if passage.sides != "both" else "lower" if mean[at, r] < 0 else "upper"
        side = "" if load.resultant else side
        table.add_row(str(load), f"{chance[r]:.3g}", left, side, f"{times[at]:.4g} s")
    print_table(table, console)
    console.print(
        f"Any of {len(passage.loads)} limits is passed by {p.value:.3g} of flights (95 %: {p.interval[0]:.2g} to "
        f"{p.interval[1]:.2g}), jointly; the worst single instant would say {p.largest_instant:.2g}, adding the "
        f"chances {chance.sum():.2g}. At {passage.design:g} the margin of safety is {passage.margin_of_safety:+.3f}.",
        highlight=False,
        soft_wrap=True,
    )
