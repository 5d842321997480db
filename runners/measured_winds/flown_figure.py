"""The figure of flown winds: every history over the band that a Gaussian wind predicts, and their flight maxima."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped
from ..present.wording import display, words
from .flown_resultants import FlownResultants
from .fly import FlownWinds
from .profile_statistics import number_of

MOST = 400  # histories drawn
BAND = 0.99


def flown_figure(flown: FlownWinds | FlownResultants, response: str, title: str) -> Figure:
    """Return histories of all profiles over time, the worst with its date, and the chance that a flight passes a level.

    Parameters
    ----------
    flown : FlownWinds or FlownResultants
    response : str
        One of its.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    r = number_of(response, flown.responses)
    values, times = flown.values[:, :, r], flown.times
    factor, unit = display(flown.unit(response), values)
    tail = 0.5 * (1 - BAND)
    low, middle, high = flown.percentiles([tail, 0.5, 1 - tail])["predicted"].isel(response=r).values
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 8.0), layout="constrained")
        above, below = figure.subplots(2)
        above.fill_between(
            times,
            factor * low,
            factor * high,
            color=COLORS["wind"],
            alpha=0.18,
            lw=0,
            label=f"holds {BAND:.0%} by prediction",
        )
        strength = max(0.12, min(0.8, 20.0 / len(values)))
        for i in np.linspace(0, len(values) - 1, min(len(values), MOST)).astype(int):
            above.plot(times, factor * values[i], color="#555555", lw=0.6, alpha=strength)
        above.plot(times, factor * middle, color="black", lw=1.4, label="median by prediction")
        if len(values) > 1:
            above.plot(
                times, factor * values.mean(axis=0), "--", color=COLORS["combined"], lw=1.6, label="mean of profiles"
            )
        (name, date, worst, at), *_ = flown.worst(response, 1)
        i = flown.profiles.names.index(name)
        label = f"largest: {date.replace('T', ' ') or name}"
        above.plot(times, factor * values[i], color=COLORS["combined"], lw=1.6, label=label)
        above.plot(at, factor * worst, "o", color=COLORS["combined"], ms=5)
        above.set(xlabel="flight time (s)", ylabel=f"{words(response)} ({unit})", xlim=(times[0], times[-1]))
        above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8)
        measured = np.sort(flown.maxima[:, r])
        below.step(factor * measured, 1 - (np.arange(measured.size) + 0.5) / measured.size, where="mid",
                   color=COLORS["combined"], lw=1.6, label=f"{len(values)} measured profiles")  # fmt: skip
        predicted = flown.predicted_maxima[:, r]
        below.plot(factor * predicted, 1 - (np.arange(predicted.size) + 0.5) / predicted.size, color=SHADES[0], lw=1.6,
                   label="Gaussian wind, at the same times")  # fmt: skip
        below.set(xlabel=f"largest size over the times ({unit})", ylabel="share of flights beyond", yscale="log")
        least = 0.5 / max(len(values), 100)
        below.set_ylim(least, 1.1)
        sizes = np.concatenate([measured, predicted])
        right = max(measured[-1], np.quantile(predicted, 1 - least))
        below.set_xlim(factor * sizes.min(), factor * (right + 0.03 * (right - sizes.min())))
        below.legend()
        figure.suptitle(wrapped(f"{title}\n{words(response).capitalize()} in measured winds"))
    return figure
