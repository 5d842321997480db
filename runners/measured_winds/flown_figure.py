"""The figure of flown winds: every history over the band that a Gaussian wind predicts, and their flight maxima."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from scipy.special import ndtri

from ..present.style import COLORS, SHADES, STYLE, display, words, wrapped
from .fly import FlownWinds

MOST = 400  # histories drawn
BAND = 0.99


def flown_figure(flown: FlownWinds, response: str, title: str) -> Figure:
    """Return histories of all profiles over time, the worst with its date, and the chance that a flight passes a level.

    Parameters
    ----------
    flown : FlownWinds
    response : str
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    r = flown.responses.index(response)
    values, times = flown.values[:, :, r], flown.weights.times
    mean, std = flown.predicted_mean[:, r], flown.predicted_std[:, r]
    unit = flown.case.system.outputs[flown.case.system.output_index(response)].unit
    factor, unit = display(unit, values)
    k = float(ndtri(0.5 + BAND / 2))
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 8.0), layout="constrained")
        above, below = figure.subplots(2)
        band = factor * (mean - k * std), factor * (mean + k * std)
        above.fill_between(
            times, *band, color=COLORS["wind"], alpha=0.18, lw=0, label=f"holds {BAND:.0%} by prediction"
        )
        strength = max(0.12, min(0.8, 20.0 / len(values)))
        for i in np.linspace(0, len(values) - 1, min(len(values), MOST)).astype(int):
            above.plot(times, factor * values[i], color="#555555", lw=0.6, alpha=strength)
        above.plot(times, factor * mean, color="black", lw=1.4, label="mean by prediction")
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
        above.legend(loc="upper right", fontsize=8)
        measured = np.sort(flown.maxima[:, r])
        below.step(factor * measured, 1 - (np.arange(measured.size) + 0.5) / measured.size, where="mid",
                   color=COLORS["combined"], lw=1.6, label=f"{len(values)} measured profiles")  # fmt: skip
        predicted = flown.predicted_maxima[:, r]
        below.plot(factor * predicted, 1 - (np.arange(predicted.size) + 0.5) / predicted.size, color=SHADES[0], lw=1.6,
                   label="Gaussian wind, at the same times")  # fmt: skip
        below.set(xlabel=f"largest size over the times ({unit})", ylabel="share of flights beyond", yscale="log")
        below.set_ylim(0.5 / max(len(values), 100), 1.1)
        below.legend()
        figure.suptitle(wrapped(f"{title}\n{words(response).capitalize()} in measured winds"))
    return figure
