"""Figures of response statistics, weighting functions and sample paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib import rc_context

from ...model.system.names import COMBINED
from ..present.style import COLORS, STYLE, Figure, wrapped
from ..present.wording import display, words
from .larger_side import LABEL, SIGMAS, side, sign
from .peaks import peaks


def response_figure(statistics: xr.Dataset, response: str, title: str, drawn: xr.Dataset | None = None) -> Figure:
    """Return the mean, both sides mean ± 3 sigma from all sources, and that of the peak from the first one, over time.

    Parameters
    ----------
    statistics : xarray.Dataset
        Whose peak is named.
    response, title : str
    drawn : xarray.Dataset, optional
        The same at more times, for curves that are not jagged.
    """
    part = (statistics if drawn is None else drawn).sel(response=response)
    (peak,) = peaks(statistics.sel(response=[response]))
    factor, unit = display(peak.unit, peak.value)
    first = str(statistics["source"].values[0])
    time = part["time"].values
    toward = part["mean"] + sign(peak.mean) * SIGMAS * part["std"]
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        curves = (
            ("mean", part["mean"].sel(source=COMBINED), "mean", "-"),
            ("wind", toward.sel(source=first), f"{peak.side}, {words(first)} alone", "-"),
            (COMBINED, toward.sel(source=COMBINED), f"{peak.side}, all sources", "--"),
        )
        marker = "o" if time.size < 3 else None
        mean, sigma = part["mean"].sel(source=COMBINED), part["std"].sel(source=COMBINED)
        axes.fill_between(
            time, factor * (mean - 3 * sigma), factor * (mean + 3 * sigma),
            color=COLORS[COMBINED], alpha=0.08, lw=0,
        )  # fmt: skip
        for color, values, label, line in curves:
            axes.plot(time, factor * values, line, color=COLORS[color], label=label, lw=2, marker=marker)
        other = mean - sign(peak.mean) * SIGMAS * sigma
        label = f"{side(-sign(peak.mean))}, all sources"
        axes.plot(time, factor * other, ":", color=COLORS[COMBINED], label=label, lw=1.4, marker=marker)
        late = peak.time > 0.4 * time[0] + 0.6 * time[-1]  # the note stands on the side that has room
        axes.annotate(
            f"{LABEL}: {factor * peak.value:.3g} {unit} at {peak.time:g} s",
            (peak.time, factor * sign(peak.mean) * peak.value),
            xytext=(-12 if late else 12, 4 * sign(peak.mean)),
            textcoords="offset points",
            ha="right" if late else "left",
            color=COLORS[COMBINED],
        )
        axes.margins(y=0.12)
        if min(axes.get_ylim()) < 0 < max(axes.get_ylim()):
            axes.axhline(0, color="black", lw=0.6)
        axes.set(xlabel="flight time (s)", ylabel=f"{words(response)} ({unit})", title=wrapped(title))
        axes.legend()
    return figure


def weighting_figure(families: Sequence[xr.Dataset], response: str, unit: str, title: str) -> Figure:
    """Return the weighting functions from the wind to one response for several end times t2."""
    factor, shown = display(unit, [np.abs(f["input_weighting"].sel(response=response)).max() for f in families])
    latest = max(f.attrs["t2_s"] for f in families)
    first = max(min(float(f["t"].min()) for f in families), latest - 45)
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 1.6 * len(families) + 1.4), layout="constrained")
        panels = figure.subplots(len(families), sharex=True, sharey=True, squeeze=False)
        for family, axes in zip(families, panels[:, 0], strict=True):
            values = family["input_weighting"].sel(response=response).isel(input=0)
            axes.plot(family["t"], factor * values, color=COLORS["wind"], lw=1.2)
            axes.axhline(0, color="black", lw=0.6)
            axes.text(0.01, 0.86, f"t₂ = {family.attrs['t2_s']:g} s", transform=axes.transAxes, weight="bold")
        panels[0, 0].set(xlim=(first, latest + 1))
        panels[-1, 0].set(xlabel="time of the wind impulse t (s)")
        figure.supylabel(f"g(t₂, t): {words(response)} at t₂ in {shown} / ((m/s) · s)")
        figure.suptitle(wrapped(title))
    return figure


def sample_path_figure(ensemble: xr.Dataset, statistics: xr.Dataset, title: str) -> Figure:
    """Return the sample paths of an ensemble within mean and mean ± 3 sigma computed without it."""
    names = [str(name) for name in ensemble["response"].values]
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 2.6 * len(names) + 1.0), layout="constrained")
        panels = figure.subplots(len(names), sharex=True, squeeze=False)[:, 0]
        for name, axes in zip(names, panels, strict=True):
            factor, unit = display(
                str(ensemble["unit"].sel(response=name).item()), ensemble["sample_path"].sel(response=name)
            )
            paths = factor * ensemble["sample_path"].sel(response=name).values
            axes.plot(ensemble["t"], paths.T, color="#7f8c9a", lw=0.5, alpha=0.7)
            part = statistics.sel(response=name, source=COMBINED)
            for side in (-3, 3):
                label = "mean ± 3σ, adjoint" if side > 0 else None
                edge = factor * (part["mean"] + side * part["std"])
                axes.plot(statistics["time"], edge, "--", color=COLORS[COMBINED], lw=1.8, label=label)
            axes.plot(statistics["time"], factor * part["mean"], color=COLORS["mean"], lw=1.8, label="mean")
            axes.set_ylabel(f"{words(name)} ({unit})")
        panels[0].plot([], [], color="#7f8c9a", label=f"{ensemble.sizes['path']} simulated flights")
        panels[0].legend(loc="upper left")
        panels[-1].set_xlabel("flight time (s)")
        figure.suptitle(title)
    return figure
