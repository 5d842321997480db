"""Quantiles of measured winds against normal ones, by level."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context

from ...model.wind.soundings.collection import Soundings, independent_samples
from ...model.wind.soundings.normality import quantile_band
from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped

LEVELS = 6  # shown


def normality_figure(soundings: Soundings, title: str) -> Figure:
    """Return standardised quantiles of u and v against normal quantiles at some levels, with the band of normal values.

    Parameters
    ----------
    soundings : Soundings
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    levels = np.unique(np.linspace(0, soundings.altitude.size - 1, LEVELS).round().astype(int))
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.0), layout="constrained")
        for axes, values, name in zip(figure.subplots(1, 2), (soundings.u, soundings.v), "uv", strict=True):
            independent = independent_samples(values, soundings.day)
            count = int(np.isfinite(values).sum(axis=0).min())
            q, low, high = quantile_band(count, independent)
            axes.fill_between(q, low, high, color="#bbbbbb", alpha=0.5, lw=0, label="90 % of normal ones")
            axes.plot(q, q, color=COLORS["mean"], lw=1)
            for level, color in zip(levels, SHADES, strict=False):
                x = values[np.isfinite(values[:, level]), level]
                x = np.sort((x - x.mean()) / x.std(ddof=1))
                axes.plot(quantile_band(x.size, independent)[0], x, ".", ms=3, color=color,
                          label=f"{soundings.altitude[level] / 1000:.3g} km")  # fmt: skip
            axes.set(xlabel="normal quantile", ylabel=f"{name}, standard deviations from its mean")
            axes.set_title(f"{name}: {count} profiles, {independent:.0f} independent", fontsize=10)
        figure.axes[0].legend(fontsize=8)
        figure.suptitle(wrapped(title))
    return figure
