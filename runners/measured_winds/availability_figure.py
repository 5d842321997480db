"""Figures of availability: the chance of passing a limit by month and azimuth, and the load over the compass."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import colormaps, rc_context
from matplotlib.colors import LogNorm
from matplotlib.projections.polar import PolarAxes

from ..present.style import STYLE, Figure, wrapped
from ..present.wording import display, words

LEAST = 1e-6  # of the colours
MOST_OF_SECTOR, EDGE = 120.0, 10.0  # deg of azimuths drawn as a sector, and beside them
NARROWEST, LOWEST = 8.0, 3.2  # in, of a figure whose title and colour bar have room
ROUNDING = 1e-9  # rad


def availability_figure(found: xr.Dataset, title: str) -> Figure:
    """Return a heat map of the chance of passing any limit.

    Parameters
    ----------
    found : Dataset
        As :meth:`Study.availability` returns it.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    p = np.maximum(found["probability"].values, LEAST)
    months, angles = [str(m).capitalize() for m in found["month"].values], np.degrees(found["azimuth"].values)
    with rc_context({**STYLE, "axes.grid": False}):
        size = max(NARROWEST, 2.5 + 0.75 * angles.size), max(LOWEST, 1.8 + 0.42 * len(months))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        image = axes.imshow(p, aspect="auto", cmap="YlOrRd", norm=LogNorm(min(p.min(), 1e-4), max(p.max(), 1e-2)))
        for i, j in np.ndindex(*p.shape):
            shade = float(np.asarray(image.norm(p[i, j])))
            value = found["probability"].values[i, j]
            axes.text(j, i, f"{value:.2g}" if value >= LEAST else f"< {LEAST:g}", ha="center", va="center", fontsize=8,
                      color="white" if shade > 0.65 else "black")  # fmt: skip
        axes.set_xticks(range(angles.size), [f"{a:.4g}" for a in angles])
        axes.set_yticks(range(len(months)), months)
        axes.set(xlabel="launch azimuth (deg)")
        beyond = "min" if (found["probability"].values < LEAST).any() else "neither"
        figure.colorbar(image, label="share of flights that pass a limit", extend=beyond)
        figure.suptitle(wrapped(title), fontsize=11)
    return figure


def load_rose(found: xr.Dataset, response: str, title: str) -> Figure:
    """Return the largest level of a response over the azimuths, by month, on a compass.

    Parameters
    ----------
    found : Dataset
    response : str
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    values = found["level"].sel(response=response).values
    factor, unit = display(str(found["unit"].sel(response=response).values), values)
    months, angles = [str(m).capitalize() for m in found["month"].values], found["azimuth"].values
    colors = colormaps["turbo"](np.linspace(0.05, 0.95, len(months)))
    with rc_context(STYLE):
        figure = Figure(figsize=(7.5, 6.5), layout="constrained")
        axes = figure.add_subplot(projection="polar")
        assert isinstance(axes, PolarAxes)
        axes.set_theta_zero_location("N")
        axes.set_theta_direction(-1)
        steps = np.diff(angles)
        whole = steps.size > 1 and 0 < angles[0] + 2 * np.pi - angles[-1] <= steps.max() + ROUNDING
        closed = [*range(angles.size), *([0] if whole else [])]  # a line from the last azimuth to the first
        for row, month, color in zip(values, months, colors, strict=True):
            axes.plot(angles[closed], factor * row[closed], "o-", ms=3, lw=1.4, color=color, label=month)
        axes.set_rlim(0)
        first, last = np.degrees(angles.min()), np.degrees(angles.max())
        if 0 < last - first <= MOST_OF_SECTOR:  # the rest of the compass is empty
            axes.set_thetamin(EDGE * np.floor(first / EDGE) - EDGE)
            axes.set_thetamax(EDGE * np.ceil(last / EDGE) + EDGE)
            axes.set_xticks(np.radians(np.arange(EDGE * np.floor(first / EDGE), last + EDGE, EDGE)))
        axes.legend(loc="center left", bbox_to_anchor=(1.08, 0.5), fontsize=8)
        told = f"{title}\n{words(response)} ({unit}): largest level passed with 0.00135 at an instant"
        axes.set_title(wrapped(told), fontsize=10)
    return figure
