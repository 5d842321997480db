"""The figure of a grid: the peak over one quantity as a line, over two as contours."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ...model.system.names import COMBINED
from ..present.style import COLORS, STYLE, Figure, wrapped
from .compute import COMPUTED, FAILED, STATUS, UNSTABLE
from .measures import PEAK, displayed
from .measures import label as label_of
from .run import ParameterStudy


def grid_figure(result: ParameterStudy, measured: xr.Dataset, response: str) -> Figure:
    """Return the peaks of stable members over one quantity as a line, over two as contours."""
    factor, unit = displayed(measured, response)
    status = result.data["status"].values
    peak = np.full(status.size, np.nan)
    peak[measured["member"].values] = factor * measured["sample"].sel(measure=PEAK, response=response).values
    peak[status != COMPUTED] = np.nan
    values = result.data["value"].values
    labels = [q.name if q.unit == "1" else f"{q.name} ({q.unit})" for q in result.quantities]
    label = f"peak {label_of(measured, response)} ({unit})"
    nominal = [q.nominal for q in result.quantities]
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 5.2), layout="constrained")
        axes = figure.subplots()
        if len(labels) == 1:
            order = np.argsort(values[:, 0])
            axes.plot(values[order, 0], peak[order], "o-", color=COLORS["wind"], lw=1.8, label="computed")
            axes.ticklabel_format(axis="y", useOffset=False)
            shown = factor * measured["nominal"].sel(measure=PEAK, response=response).item()
            axes.plot(nominal[0], shown, "s", color="black", label="nominal")
            axes.set(xlabel=labels[0], ylabel=label)
            points, place = np.stack([values[:, 0], np.zeros(status.size)]), axes.get_xaxis_transform()
        else:
            x, y = (np.unique(values[:, k]) for k in (0, 1))
            grid = np.full((y.size, x.size), np.nan)
            grid[np.searchsorted(y, values[:, 1]), np.searchsorted(x, values[:, 0])] = peak
            if min(x.size, y.size) >= 2 and np.isfinite(grid).any():
                filled = axes.contourf(x, y, np.ma.masked_invalid(grid), levels=14, cmap="viridis")
                figure.colorbar(filled, ax=axes, label=label)
            mark = {"ms": 4, "color": "white", "mec": "black", "mew": 0.5, "clip_on": False}
            axes.plot(*values[status == COMPUTED].T, "o", label="computed", **mark)
            axes.plot(*nominal, "s", color=COLORS[COMBINED], label="nominal")
            axes.set(xlabel=labels[0], ylabel=labels[1])
            points, place = values.T, axes.transData
        for other, mark in ((UNSTABLE, "^"), (FAILED, "x")):
            if (status == other).any():
                at = points[:, status == other]
                axes.plot(*at, mark, color="red", clip_on=False, transform=place, label=STATUS[other])
        figure.legend(loc="outside lower center", ncols=4)
        axes.set_title(wrapped(result.plan.title), fontsize=11)
    return figure
