"""The figure of a flight's load: how often a level is passed, and when."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .load import FlightLoad
from .sampling import instant_levels

MAXIMUM = "#c8442c"


def exceedance_figure(load: FlightLoad, title: str) -> Figure:
    """Return the chance of passing each level, of the flight and of its worst instant, over the times of the maximum.

    Parameters
    ----------
    load : FlightLoad
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    curve, density = load.exceedance, load.time_of_maximum
    factor, unit = display(load.unit, curve["level"].values)
    size = {"both": "|{}|", "upper": "{}", "lower": "-{}"}[load.sides]
    size = ("{}" if load.of.is_resultant else size).format(words(load.response))
    chances = np.geomspace(0.5, 1e-7, 24 if load.of.is_resultant else 80)
    instants = [float(instant_levels(load.process, p, load.sides).max()) for p in chances]
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 7.2), layout="constrained")
        above, below = figure.subplots(2, height_ratios=(3, 2))
        above.semilogy(factor * curve["level"], curve, color=MAXIMUM, lw=2, label="largest value of the flight")
        above.semilogy(factor * np.array(instants), chances, "--", color=COLORS["wind"], lw=1.6, label="worst instant")
        for p, level in zip(load.probabilities, load.level.values, strict=True):
            above.plot(factor * level, p, "o", color=MAXIMUM)
            above.annotate(
                f"{factor * level:.4g} {unit}, {p:g}", (factor * level, p), xytext=(8, 4), textcoords="offset points"
            )
        above.set(xlabel=f"{size} ({unit})", ylabel="probability of passing", ylim=(1e-7, 1.0))
        above.legend(loc="lower left")
        width = float(density["time"][1] - density["time"][0])
        below.step(density["time"], density[0], where="mid", color=COLORS["mean"], label="any flight")
        name = f"flights that pass {factor * float(load.level[0]):.4g} {unit}"
        if load.sides == "both" and not load.of.is_resultant:
            name += f", {100 * float(load.side_shares[0].max()):.3g} % on the {load.side[0]} side"
        below.fill_between(density["time"], density[1], step="mid", color=MAXIMUM, alpha=0.35, lw=0, label=name)
        below.set(
            xlabel=f"flight time of the largest value (s), in bins of {width:.3g} s",
            ylabel="density (per s)",
            xlim=load.window,
            ylim=(0, None),
        )
        below.legend()
        figure.suptitle(wrapped(title))
    return figure
