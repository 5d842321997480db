"""Figures of resultants: over flight time, the ellipse at the peak, and the load by direction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ...model.system.names import COMBINED
from ...model.vehicle.planes import PLANES
from ..present.style import COLORS, SHADES, STYLE, Figure, wrapped
from ..present.wording import display, words
from .larger_side import SIGMAS
from .norm import NormOfNormal
from .resultants import ResultantPeak, Resultants

Array = NDArray[np.float64]
AROUND = np.linspace(0.0, 2.0 * np.pi, 361)
HEADROOM = 1.2  # of the axes beyond what is drawn


def history_figure(resultants: Resultants, resultant: str, title: str, drawn: Resultants | None = None) -> Figure:
    """Return the level of a resultant over time, beside |mean| + 3 sigma of each plane.

    Parameters
    ----------
    resultants : Resultants
    resultant, title : str
    drawn : Resultants, optional
        At times close enough for smooth curves; the same without it.
    """
    data, chance = (drawn or resultants).dataset.sel(resultant=resultant), _chance(resultants)
    peak = _peak(resultants, resultant)
    factor, unit = display(peak.unit, peak.value)
    time, level = data["time"].values, data["level"].sel(source=COMBINED, probability=chance).values
    mean, covariance = data["plane_mean"].values, data["plane_covariance"].sel(source=COMBINED).values
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.plot(time, factor * level, color=COLORS[COMBINED], lw=2, label=f"passed with {chance:.3g} at an instant")
        for k, plane in enumerate(PLANES):
            values = np.abs(mean[:, k]) + SIGMAS * np.sqrt(covariance[:, k, k])
            axes.plot(time, factor * values, "--", color=SHADES[2 + k], lw=1.4, label=f"{plane} alone, |mean| + 3σ")
        size = np.linalg.norm(mean, axis=1)
        axes.plot(time, factor * size, color=COLORS["mean"], lw=1.4, label="resultant of the means")
        late = peak.time > 0.4 * time[0] + 0.6 * time[-1]
        axes.annotate(
            f"{factor * peak.value:.3g} {unit} at {peak.time:g} s",
            (peak.time, factor * peak.value),
            xytext=(-12 if late else 12, 4),
            textcoords="offset points",
            ha="right" if late else "left",
            color=COLORS[COMBINED],
        )
        axes.margins(y=0.12)
        axes.set_ylim(bottom=0)
        axes.set(xlabel="flight time (s)", ylabel=f"{words(resultant)} ({unit})", title=wrapped(title))
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    return figure


def direction_figure(resultants: Resultants, resultant: str, title: str) -> Figure:
    """Return, at the peak, the ellipses of 1, 2 and 3 sigma in both planes, and the load by direction."""
    peak, chance = _peak(resultants, resultant), _chance(resultants)
    norm = resultants.norm(resultant)
    k = int(np.argmin(np.abs(resultants.dataset["time"].values - peak.time)))
    law = NormOfNormal(norm.mean[k], norm.covariance[k])
    factor, unit = display(peak.unit, peak.value)
    with rc_context(STYLE):
        figure = Figure(figsize=(10.0, 6.6), layout="constrained")
        left = figure.add_subplot(1, 2, 1)
        right: Any = figure.add_subplot(1, 2, 2, projection="polar")
        _ellipses(left, law, peak, factor, unit, chance)
        e = np.stack([np.cos(AROUND), np.sin(AROUND)])
        along = law.mean @ e
        toward = along + SIGMAS * np.sqrt(np.einsum("it,ij,jt->t", e, law.covariance, e))
        right.plot(
            AROUND, factor * np.maximum(toward, 0.0), color=COLORS["wind"], lw=2, label="mean + 3σ along each direction"
        )
        right.plot(
            AROUND, factor * np.maximum(along, 0.0), color=COLORS["mean"], lw=1.4, label="mean along each direction"
        )
        circle = np.full(AROUND.size, factor * peak.value)
        right.plot(AROUND, circle, "--", color=COLORS[COMBINED], lw=1.4, label=f"resultant, passed with {chance:.3g}")
        right.plot([peak.direction], [factor * peak.value], "o", color=COLORS[COMBINED])
        right.set_rlabel_position(math.degrees(peak.direction) + 180.0 + 22.5)  # away from the peak, between two rays
        right.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.1),
            title=f"{unit}, from +pitch (0°) towards +yaw (90°)",
        )
        figure.suptitle(wrapped(f"{title}, t = {peak.time:g} s"))
    return figure


def _ellipses(axes: Axes, law: NormOfNormal, peak: ResultantPeak, factor: float, unit: str, chance: float) -> None:
    root = np.linalg.cholesky(law.covariance + 1e-14 * np.trace(law.covariance) * np.eye(2))
    unit_circle = np.stack([np.cos(AROUND), np.sin(AROUND)])
    for n in (1, 2, 3):
        x, y = factor * (law.mean[:, None] + n * root @ unit_circle)
        axes.plot(x, y, color=COLORS["wind"], lw=1.4, alpha=1.1 - 0.25 * n, label="1σ, 2σ, 3σ" if n == 1 else None)
    x, y = factor * peak.value * unit_circle
    axes.plot(x, y, "--", color=COLORS[COMBINED], lw=1.4, label=f"resultant, passed with {chance:.3g}")
    axes.plot(*(factor * law.mean), "+", color=COLORS["mean"], ms=10, mew=2, label="mean")
    at = factor * peak.value * np.array([np.cos(peak.direction), np.sin(peak.direction)])
    axes.plot(*at, "o", color=COLORS[COMBINED], label="most likely direction there")
    reach = HEADROOM * factor * peak.value
    axes.axhline(0, color="black", lw=0.6)
    axes.axvline(0, color="black", lw=0.6)
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel=f"pitch ({unit})", ylabel=f"yaw ({unit})")
    axes.set_aspect("equal")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)


def _chance(resultants: Resultants) -> float:
    return float(resultants.dataset["probability"].values[0])


def _peak(resultants: Resultants, resultant: str) -> ResultantPeak:
    return next(peak for peak in resultants.peaks() if peak.resultant == resultant)
