"""Figures of sensitivities: tornado, curves over flight time, and kilometres of wind."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import rc_context
from matplotlib.axes import Axes

from ...model.system.names import COMBINED
from ..present.style import COLORS, SHADES, STYLE, Figure
from ..present.wording import display, words
from ..statistics.larger_side import LABEL, LARGER_SIDE, side

BARS = 14
CURVES = 6
EARLIER = 30.0  # s before t2 that the curves show
LABELS = {LARGER_SIDE: LABEL, "std": "σ", "variance": "variance", "mean": "mean", "mean_plus_3sigma": "mean + 3σ"}


def heading(found: xr.Dataset) -> str:
    """Return what was differentiated, in words: '|mean| + 3σ (mean + 3σ) of bending moment at 74.7 s: 24.7 MN m'."""
    a = found.attrs
    factor, unit = display(a["response_unit"], a["value"])
    if "probability" in a:
        chance = f"passed with {a['probability']:.3g} at {a['t2_s']:.4g} s"
        return f"the level of {words(a['response'])} {chance}: {factor * a['value']:.4g} {unit}"
    source = "" if a["source"] == COMBINED else f" from {words(a['source'])} alone"
    label = LABELS[a["quantity"]] + (f" ({side(a['mean'])})" if a["quantity"] == LARGER_SIDE else "")
    what = f"{label} of {words(a['response'])}{source} at {a['t2_s']:.4g} s"
    if a["quantity"] == "variance":
        return what
    return f"{what}: {factor * a['value']:.4g} {unit}"


def largest(names: np.ndarray, sizes: np.ndarray, count: int) -> list[tuple[str, float]]:
    """Return names and values of the ``count`` largest absolute values that are not zero, largest first."""
    order = [i for i in np.argsort(-np.abs(sizes), kind="stable") if sizes[i] != 0]
    return [(str(names[i]), float(sizes[i])) for i in order[:count]]


def tornado_figure(found: xr.Dataset) -> Figure:
    """Return bars of the largest elasticities: parameters and, where there are any, whole tables."""
    panels = [("parameter", found["parameter"].values, found["elasticity"].values)]
    if "table_elasticity" in found:
        panels.append(("table", found["table"].values, found["table_elasticity"].values))
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 0.8 + 0.3 * BARS * len(panels)), layout="constrained")
        for axes, (kind, names, sizes) in zip(figure.subplots(len(panels), squeeze=False)[:, 0], panels, strict=True):
            _bars(axes, largest(names, sizes, BARS))
            axes.set_title(f"by {kind}", loc="left")
        figure.supxlabel("percent per percent")
        figure.suptitle(f"What drives {heading(found)}")
    return figure


def _bars(axes: Axes, chosen: list[tuple[str, float]]) -> None:
    place = np.arange(len(chosen))
    sizes = np.array([size for _, size in chosen])
    colors = [COLORS["wind"] if size > 0 else COLORS[COMBINED] for size in sizes]
    axes.barh(place, sizes, color=colors)
    axes.set_yticks(place, [name for name, _ in chosen])
    axes.invert_yaxis()
    axes.axvline(0, color="black", lw=0.6)
    axes.margins(x=0.12)
    axes.grid(axis="y", visible=False)
    for k, size in enumerate(sizes):
        axes.annotate(
            f"{size:+.2g}", (size, k), xytext=(4 if size > 0 else -4, 0), textcoords="offset points",
            ha="left" if size > 0 else "right", va="center", fontsize=9,
        )  # fmt: skip


def time_figure(found: xr.Dataset) -> Figure:
    """Return which second of the most important tables matters; the part at t2 itself stands in the legend."""
    value, t2 = found.attrs["value"], found.attrs["t2_s"]
    last = found["table_derivative_at_end"] * found["table_value"].isel(t=-1) / value
    over_time = found["table_elasticity"] - last
    chosen = largest(found["table"].values, over_time.values, CURVES)
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 1.5 * len(chosen) + 1.2), layout="constrained")
        panels = figure.subplots(len(chosen), sharex=True, squeeze=False)[:, 0]
        for axes, (name, _), color in zip(panels, chosen, SHADES, strict=False):
            part = found.sel(table=name)
            axes.plot(part["t"], part["table_derivative"] * part["table_value"] / value, color=color, lw=1.4)
            axes.axhline(0, color="black", lw=0.6)
            end = float(last.sel(table=name))
            text = f"{name}   whole table {float(part['table_elasticity']):+.3g}"
            axes.set_title(text + (f", of it at t₂ {end:+.3g}" if abs(end) > 1e-9 else ""), loc="left", fontsize=10)
        panels[-1].set(xlabel="flight time (s)", xlim=(max(float(found["t"].min()), t2 - EARLIER), t2))
        figure.supylabel("percent per percent and second")
        figure.suptitle(f"Which second of which table drives\n{heading(found)}")
    return figure


def altitude_figure(found: xr.Dataset) -> Figure:
    """Return which kilometre of wind matters: its sigma and its mean."""
    titles = {"wind_sigma_elasticity": "sigma of the wind", "wind_mean_elasticity": "mean wind"}
    panels = [name for name in titles if name in found]
    height = found["band"].values / 1000
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 4.6), layout="constrained")
        axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for one, name in zip(axes, panels, strict=True):
            sizes = found[name].values
            one.barh(height, sizes, 0.85, color=[COLORS["wind"] if s > 0 else COLORS[COMBINED] for s in sizes])
            one.axvline(0, color="black", lw=0.6)
            one.set_title(f"{titles[name]}: {sizes.sum():+.3g} in all", loc="left")
            one.set_xlabel("percent per percent in a kilometre")
        axes[0].set(ylabel="altitude (km)", ylim=(0, height.max() + 0.6))
        figure.suptitle(f"Which kilometre of wind drives\n{heading(found)}")
    return figure
