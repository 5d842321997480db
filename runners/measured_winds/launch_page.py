"""One page for the launch console: go or no-go, what drives it, and a figure of wind and responses."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..flight_load.passage import LimitedLoad
from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped
from ..present.wording import display, words
from .day_of_launch import BAND, DayOfLaunch
from .limited_loads import Limit
from .persistence import EXPONENTS
from .wind_field import default_persistence

MOST_SENTENCES = 6  # on what drives it
CAVEAT = (
    "Gaussian winds: changes of wind have heavier tails (excess kurtosis of 24-h changes at the Cape up to 1.9), so "
    "that small chances are too small. Errors of the wind's filter and of the vehicle's model are not in them."
)


def bracket(launch: DayOfLaunch) -> list[tuple[float, float]]:
    """Return the exponents of growth with lag that bracket what is assumed, and the chance of passing with each.

    Empty where the persistence was given or measured.

    Parameters
    ----------
    launch : DayOfLaunch
    """
    if "assumed" not in launch.persistence.source or "at the Cape" not in launch.persistence.source:
        return []
    field = launch.flight.field
    return [
        (p, launch.with_persistence(default_persistence(field, launch.met.components, p)).probability)
        for p in EXPONENTS
    ]


def drivers(launch: DayOfLaunch) -> list[str]:
    """Return sentences on what drives the chance: which limits, when, where, and of which uncertainty.

    Parameters
    ----------
    launch : DayOfLaunch
    """
    passage, told, climb = launch.passage, [], launch.flight.weights
    taken = launch.flight.std**2 - launch.std**2
    by_wind = (launch.flight.by_wave**2).sum(axis=2) - taken
    for chance, load, limit, values in often_passed(launch, MOST_SENTENCES):
        factor, unit = display(load.unit, values)
        if len(limit.rows) == 2:
            level = launch.law(load.label).percentile(passage.design)
            at = int((level / values).argmax())
            told.append(
                f"{load_words(load)}: passed by {chance:.2g} of flights; nearest at {launch.times[at]:.1f} s, "
                f"{climb.altitude[at] / 1000:.1f} km: {factor * level[at]:.4g} is passed with {passage.design:g} at "
                f"that instant, limit {factor * values[at]:.4g} {unit}"
            )
            continue
        r, margin = limit.rows[0], launch.margin_in_sigmas()[:, limit.rows[0]]
        at = int(np.nanargmin(margin))
        share = float(np.clip(by_wind[at, r] / launch.std[at, r] ** 2, 0, 1)) if launch.std[at, r] > 0 else 0.0
        told.append(
            f"{load_words(load)}: passed by {chance:.2g} of flights; nearest at {launch.times[at]:.1f} s, "
            f"{climb.altitude[at] / 1000:.1f} km: expected {factor * launch.mean[at, r]:.4g}, one sigma "
            f"{factor * launch.std[at, r]:.3g}, limit {factor * values[at]:.4g} {unit}, {margin[at]:.1f} sigma off; "
            f"{100 * share:.0f} % of that variance is wind that may still change or was not seen, the rest the "
            "vehicle's and what is finer than 25 m"
        )
    return told


def load_words(load: LimitedLoad) -> str:
    """Return what is limited, in words."""
    return words(load.name) if np.isnan(load.station) else f"{words(load.name)} at station {load.station:.4g} m"


def often_passed(launch: DayOfLaunch, most: int) -> list[tuple[float, LimitedLoad, Limit, NDArray[np.float64]]]:
    """Return the limits that are passed most often: with what chance, what of, and their values over the times."""
    loads, passage = launch.flight.loads, launch.passage
    grid = launch.chance.value / passage.probability.value if passage.probability.value > 0 else 1.0
    chance, values, found = np.minimum(passage.by_load.values * grid, 1.0), loads.values(launch.times), []
    by_label = {limit.load.label: k for k, limit in enumerate(loads.limits)}
    for k in np.argsort(-chance)[:most]:
        load = passage.loads[int(k)]
        number = by_label[load.label]
        found.append((float(chance[k]), load, loads.limits[number], values[:, number]))
    return found


def launch_page(launch: DayOfLaunch, title: str, by_season: float | None = None) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    launch : DayOfLaunch
        With limits.
    title : str
    by_season : float, optional
        The chance with the vehicle's deviations acting on the season's mean flight.
    """
    p, season = launch.chance, launch.climatological_chance
    (low, high), open_part = p.interval, p.spacing_error * p.value
    lines = [
        f"# {'GO' if launch.go else 'NO-GO'}: {title}",
        "",
        f"- Chance of passing any limit: **{p.value:.2g}** (95 % of the sampling: {low:.2g} to {high:.2g}; threshold "
        f"{launch.threshold:g}; the grid of times leaves {100 * p.spacing_error:.1f} % of it open)",
        *(
            ["- The threshold lies within what the draws and the grid leave open: the answer hangs on them"]
            if low - open_part < launch.threshold < high + open_part
            else []
        ),
        f"- Of the season, nothing measured: {season.value:.2g}",
        *(
            []
            if by_season is None
            else [f"- With the vehicle's deviations as in the season's mean flight: {by_season:.2g}"]
        ),
        *(f"- With growth of winds' change by lag to the power {q:.2g}: {chance:.2g}" for q, chance in bracket(launch)),
        *(f"- Measured: {name}" for name in launch.balloons.names),
        f"- {int((launch.balloons.component == 0).sum())} levels from {launch.balloons.altitude.min():.0f} to "
        f"{launch.balloons.altitude.max():.0f} m, error {launch.error:g} m/s",
        "",
        "## What drives it",
        "",
        *(f"- {sentence}" for sentence in drivers(launch)),
        "",
        "## What it rests on",
        "",
        f"- Persistence: {launch.persistence.source}",
        f"- {CAVEAT}",
        "",
        "![wind and responses](day_of_launch.png)",
        "",
    ]
    return "\n".join(lines)


def launch_figure(launch: DayOfLaunch, title: str) -> Figure:
    """Return the wind at launch over altitude, and responses over time with band and limits.

    Parameters
    ----------
    launch : DayOfLaunch
        With limits.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    shown = often_passed(launch, 3)
    with rc_context(STYLE):
        figure = Figure(figsize=(11.0 if not launch.met.both else 14.0, 2.6 + 2.4 * len(shown)), layout="constrained")
        columns = len(launch.met.components)
        grid = figure.add_gridspec(len(shown), columns + 1, width_ratios=(*([1.0] * columns), 1.6))
        for number, component in enumerate(launch.met.components):
            axes = figure.add_subplot(grid[:, number])
            draw_wind(axes, launch, number)
            axes.set_xlabel(f"{component} wind (m/s)" if launch.met.both else "wind along +Y (m/s)")
            if not number:
                axes.legend(fontsize=8)
        for k, (_, load, limit, values) in enumerate(shown):
            panel = figure.add_subplot(grid[k, -1])
            factor, unit = display(load.unit, values)
            for season, color, strength, label in (
                (True, "#bbbbbb", 0.35, "season, 90 %"),
                (False, COLORS["wind"], 0.3, "at launch, 90 %"),
            ):
                low, middle, high = factor * band(launch, limit, season)
                panel.fill_between(launch.times, low, high, color=color, alpha=strength, lw=0, label=label)
                if not season:
                    panel.plot(launch.times, middle, color=color, lw=1.6)
            both = (1,) if len(limit.rows) == 2 else (1, -1)
            for side in {"both": both, "upper": (1,), "lower": (-1,)}[launch.sides]:
                panel.plot(launch.times, side * factor * values, color=COLORS["combined"], lw=1.8,
                           label="limit" if side == 1 or launch.sides == "lower" else None)  # fmt: skip
            panel.set(
                ylabel=load_words(load).replace(" at station", "\nat station") + f" ({unit})",
                xlim=(launch.times[0], launch.times[-1]),
            )
            if not k:
                panel.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
            if k == len(shown) - 1:
                panel.set_xlabel("flight time (s)")
        told = (
            f"\n{'GO' if launch.go else 'NO-GO'}: {launch.probability:.2g} of flights pass a limit, threshold "
            f"{launch.threshold:g}"
        )
        figure.suptitle(wrapped(f"{title}{told}"))
    return figure


def band(launch: DayOfLaunch, limit: Limit, season: bool) -> NDArray[np.float64]:
    """Return the lower end, the middle and the upper end of what holds 90 % of what is limited, (3, m)."""
    if len(limit.rows) == 2:
        law = launch.law(limit.load.label, season)
        return np.array([law.percentile(1 - p) for p in (0.05, 0.5, 0.95)])
    of, r = launch.flight if season else launch, limit.rows[0]
    return np.array([of.mean[:, r] + k * BAND * of.std[:, r] for k in (-1, 0, 1)])


def draw_wind(axes: Axes, launch: DayOfLaunch, number: int) -> None:
    """Draw one component of the wind at launch over altitude, with its bands, the season's and the balloons.

    Parameters
    ----------
    axes : Axes
    launch : DayOfLaunch
    number : int
        Of the component.
    """
    found = launch.wind.isel(component=number) if launch.met.both else launch.wind
    h, mean, std = found["altitude"].values / 1000, found["mean"].values, found["std"].values
    season, wide = found["climatology"].values, BAND * found["climatological_std"].values
    axes.fill_betweenx(h, season - wide, season + wide, color="#bbbbbb", alpha=0.35, lw=0, label="season, 90 %")
    axes.plot(season, h, color=COLORS["mean"], lw=1, label="season, mean")
    axes.fill_betweenx(h, mean - BAND * std, mean + BAND * std, color=COLORS["wind"], alpha=0.3, lw=0,
                       label="at launch, 90 %")  # fmt: skip
    axes.plot(mean, h, color=COLORS["wind"], lw=1.6)
    balloons = launch.balloons
    for hours, color in zip(np.unique(balloons.hours)[::-1], SHADES[1:], strict=False):
        i = (balloons.hours == hours) & (balloons.component == number)
        axes.plot(balloons.wind[i], balloons.altitude[i] / 1000, ".", ms=3, color=color,
                  label=f"measured {hours:g} h before")  # fmt: skip
    axes.set(ylabel="altitude (km)", ylim=(0, h[-1]))
