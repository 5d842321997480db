"""The figure of a limit over time: what a response may be, and what it reaches."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .load import FlightLoad


def margin_figure(load: FlightLoad, title: str) -> Figure:
    """Return limit, mean and level at the design probability over time, with the level of the flight.

    Parameters
    ----------
    load : FlightLoad
        With a limit.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    passage, process = load.passage, load.process
    times, mean = process.drawn.times[passage.told], process.drawn.mean[passage.told, 0]
    limit, level = passage.limit_told[:, 0], passage.level.values[:, 0]
    factor, unit = display(load.unit, [limit.max()])
    size = np.abs(mean) if load.sides == "both" else mean if load.sides == "upper" else -mean
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.plot(times, factor * limit, color="black", lw=2.2, label="limit")
        axes.plot(times, factor * limit * passage.factor.value, ":", color="black", lw=1.4,
                  label=f"limit times {passage.factor.value:.3g}: passed by {passage.design:g} of flights")  # fmt: skip
        axes.plot(times, factor * level, color=COLORS["combined"], lw=2,
                  label=f"passed with {passage.design:g} at each instant")  # fmt: skip
        axes.fill_between(times, factor * level, factor * limit, where=limit > level, color="#3a923a", alpha=0.12, lw=0)
        label = "resultant of the means" if load.of.is_resultant else "mean"
        axes.plot(times, factor * size, color=COLORS["mean"], lw=1.6, label=label)
        axes.set(xlabel="flight time (s)", ylabel=f"{words(load.response)} ({unit})", xlim=load.window)
        axes.set_ylim(min(0.0, axes.get_ylim()[0]), None)
        axes.set_title(wrapped(f"{title}\nlimit passed by {passage.probability.value:.2g} of flights"))
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    return figure
