"""Figures after the report's 5-1, 5-6 and 5-7, and families of weighting functions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import rc_context
from matplotlib.figure import Figure

from .output import write_whole
from .statistics import COMBINED, ResponseStatistics

# what people read: label, factor from SI, unit
DISPLAY = {
    "N m": (1e-6, "MN m"),
    "rad": (180 / np.pi, "deg"),
    "m": (1.0, "m"),
    "m/s": (1.0, "m/s"),
    "Pa rad": (1e-3 * 180 / np.pi, "kPa deg"),
    "1": (1.0, "1"),
}
STYLE: dict[Any, Any] = {
    "figure.figsize": (8.0, 5.0),
    "figure.dpi": 110,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "font.size": 10.5,
    "svg.hashsalt": "ascentwind",
}
COLORS = {"mean": "#444444", "wind": "#1f6fb4", COMBINED: "#c8442c"}


def display(unit: str) -> tuple[float, str]:
    """Return the factor from SI and the unit in which a response is shown."""
    return DISPLAY.get(unit, (1.0, unit))


def words(name: str) -> str:
    """Return a name as words: 'bending_moment' becomes 'bending moment'."""
    return name.replace("_", " ")


def response_figure(statistics: ResponseStatistics, response: str, title: str) -> Figure:
    """Return mean, mean + 3 sigma from the first source alone, and from all, over flight time."""
    part = statistics.sel(response=response)
    factor, unit = display(str(part["unit"].item()))
    first = str(statistics["source"].values[0])
    time = statistics["time"].values
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        curves = (
            ("mean", part["mean"].sel(source=COMBINED), "mean", "-"),
            ("wind", part["mean_plus_3sigma"].sel(source=first), f"mean + 3σ, {words(first)} alone", "-"),
            (COMBINED, part["mean_plus_3sigma"].sel(source=COMBINED), "mean + 3σ, all sources", "--"),
        )
        marker = "o" if time.size < 3 else None
        mean, sigma = part["mean"].sel(source=COMBINED), part["std"].sel(source=COMBINED)
        axes.fill_between(
            time, factor * (mean - 3 * sigma), factor * (mean + 3 * sigma),
            color=COLORS[COMBINED], alpha=0.08, lw=0, label="mean ± 3σ, all sources",
        )  # fmt: skip
        for color, values, label, line in curves:
            axes.plot(time, factor * values, line, color=COLORS[color], label=label, lw=2, marker=marker)
        total = part["mean_plus_3sigma"].sel(source=COMBINED)
        peak = int(np.argmax(total.values))
        axes.annotate(
            f"{factor * float(total[peak]):.3g} {unit} at {time[peak]:g} s",
            (time[peak], factor * float(total[peak])),
            xytext=(12, 4),
            textcoords="offset points",
            color=COLORS[COMBINED],
        )
        axes.axhline(0, color="black", lw=0.6)
        axes.margins(y=0.12)
        axes.set(xlabel="flight time (s)", ylabel=f"{words(response)} ({unit})", title=title)
        axes.legend()
    return figure


def weighting_figure(families: Sequence[xr.Dataset], response: str, unit: str, title: str) -> Figure:
    """Return the weighting functions from the wind to one response for several end times t2."""
    factor, shown = display(unit)
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
        figure.supylabel(f"g(t₂, t): {words(response)} at t₂ ({shown} per m/s · s)")
        figure.suptitle(title)
    return figure


def write_figure(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG."""
    with rc_context(STYLE):
        return [
            write_whole(folder / f"{name}.png", lambda p: figure.savefig(p, dpi=150)),
            write_whole(folder / f"{name}.svg", lambda p: figure.savefig(p, metadata={"Date": None})),
        ]
