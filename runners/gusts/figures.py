"""Figures of gusts: the tuned length, the response over time, and a load along the vehicle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped
from ..present.wording import display, words
from .search import GustSweep, WorstGust

MARGIN = 1.08  # above the largest, for its dot


def gust_figure(sweeps: Sequence[GustSweep], responses: Sequence[xr.Dataset], name: str, title: str) -> Figure:
    """Return the largest response over length, and over time that to the worst gust of each shape.

    Parameters
    ----------
    sweeps : sequence of GustSweep
        One a shape.
    responses : sequence of Dataset
        Of each shape, ``response_to_gust`` over (time, response) of its worst gust.
    name : str
        Of the response.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    worst = [sweep.worst(name) for sweep in sweeps]
    factor, unit = display(worst[0].unit, [each.value for each in worst])
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 7.2), layout="constrained")
        above, below = figure.subplots(2)
        for sweep, each, over_time, color in zip(sweeps, worst, responses, SHADES, strict=False):
            of_time = sweep.dataset["largest"].sel(response=name)
            largest = factor * abs(of_time).max("time")
            above.plot(sweep.lengths, largest, color=color, lw=1.4, marker=".", ms=5, label=words(sweep.gust.name))
            above.plot(each.gust.length, factor * abs(each.value), "o", color=color)
            values = over_time["response_to_gust"].sel(response=name)
            label = f"{each.gust.length:.0f} m from {each.start_altitude / 1000:.2f} km"
            below.plot(over_time["time"] - each.time_met, factor * values, color=color, lw=1.8, label=label)
        amplitude = abs(sweeps[0].gust.amplitude)
        top = MARGIN * max(factor * abs(each.value) for each in worst)
        size = f"|{words(name)}|" if worst[0].direction is None else words(name)  # which is a size already
        above.set(xlabel="length of the gust (m)", ylabel=f"{size} ({unit})", ylim=(0, top))
        above.set_title(
            "largest of all altitudes and times; large dots: located between them and between lengths", fontsize=10
        )
        above.legend()
        below.axhline(0.0, color=COLORS["mean"], lw=0.8)
        below.set(xlabel="time since the vehicle met the gust (s)", ylabel=f"{words(name)} ({unit})")
        below.legend()
        figure.suptitle(wrapped(f"{title}\n{words(name)} in a gust of {amplitude:g} m/s, the gust alone"))
    return figure


def along_vehicle_figure(found: Sequence[xr.Dataset], worst: Sequence[WorstGust], title: str) -> Figure:
    """Return a load along the vehicle in the worst gust of each shape, and the largest of all lengths and altitudes.

    Parameters
    ----------
    found : sequence of Dataset
        As :func:`gust_along_vehicle` returns them, one a shape.
    worst : sequence of WorstGust
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    first = found[0]["envelope"]
    factor, unit = display(first.attrs["units"], first.values)
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for each, gust, color in zip(found, worst, SHADES, strict=False):
            label = f"{words(gust.gust.name)}, t = {gust.time:.1f} s"
            axes.plot(
                each["station"], factor * each["envelope"], color=color, lw=2, marker=".", label=f"largest, {label}"
            )
            size = factor * np.abs(each["in_worst_gust"])
            axes.plot(each["station"], size, "--", color=color, lw=1.4, label=f"in the worst one, {label}")
        load = words(str(found[0].attrs["load"]))
        # in both planes each gust blows where it does most harm, and what it makes is a size already
        load = f"|{load}|" if worst[0].direction is None else f"resultant {load}"
        axes.set(xlabel="vehicle station (m)", ylabel=f"{load} ({unit})", ylim=(0, None), title=wrapped(title))
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    return figure
