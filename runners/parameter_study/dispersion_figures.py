"""Figures of what parameters do together and alone: spread and band of a dispersion, tornado."""

from __future__ import annotations

from textwrap import wrap

import numpy as np
import xarray as xr
from matplotlib import rc_context
from scipy import stats

from ...model.system.names import COMBINED
from ..present.style import COLORS, STYLE, Figure, wrapped
from .compute import COMPUTED, STATUS
from .measures import PEAK, displayed, loads, timed
from .measures import label as label_of
from .run import ParameterStudy

BINS = 40
HALF_WIDTH = 44  # characters of a label below one of two panels


def histogram_figure(result: ParameterStudy, measured: xr.Dataset, found: xr.Dataset, response: str) -> Figure:
    """Return the distribution of the peaks beside the first-order normal one.

    The axes are those of the stable members; unstable ones beyond them are counted.
    """
    factor, unit = displayed(measured, response)
    at = found.sel(measure=PEAK, response=response)
    values = np.sort(factor * measured["sample"].sel(measure=PEAK, response=response).values)
    centre, sigma = (factor * at[name].item() for name in ("first_order_mean", "first_order_std"))
    stable = result.data["status"].values[measured["member"].values] == COMPUTED
    of_stable = factor * measured["sample"].sel(measure=PEAK, response=response).values[stable]
    first, last = (of_stable.min(), of_stable.max()) if stable.any() else (values[0], values[-1])
    inside = values[(values >= first) & (values <= last)]
    beyond = f", {values.size - inside.size} beyond the axis" if inside.size < values.size else ""
    with rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        density, cumulative = figure.subplots(1, 2)
        heights, edges = np.histogram(inside, bins=min(BINS, max(5, values.size // 10)))
        density.stairs(
            heights / (values.size * np.diff(edges)), edges, fill=True, color=COLORS["wind"], alpha=0.45,
            label=f"{values.size} members{beyond}: σ {factor * at['sample_std'].item():.3g} {unit}",
        )  # fmt: skip
        steps = np.arange(1, values.size + 1) / values.size
        cumulative.step(values, 100 * steps, where="post", color=COLORS["wind"], label="members")
        if np.isfinite(sigma) and sigma > 0:
            x = np.linspace(min(first, centre - 3.5 * sigma), max(last, centre + 3.5 * sigma), 300)
            first, last = float(x[0]), float(x[-1])
            label = f"first order: σ {sigma:.3g} {unit}"
            density.plot(x, stats.norm.pdf(x, centre, sigma), "--", color=COLORS[COMBINED], lw=2, label=label)
            below = stats.norm.cdf(x, centre, sigma)
            cumulative.plot(x, 100 * below, "--", color=COLORS[COMBINED], lw=2, label="first order")
        for axes in (density, cumulative):
            axes.axvline(factor * at["nominal"].item(), color="black", lw=1, ls=":", label="nominal")
            axes.set_xlabel("\n".join(wrap(f"peak of {label_of(found, response)} ({unit})", HALF_WIDTH)))
            if last > first:
                axes.set_xlim(first - 0.03 * (last - first), last + 0.03 * (last - first))
        high = at.sel(percent=95.0)
        if np.isfinite(high["percentile_low"]) and np.isfinite(high["percentile_high"]):
            edges = [[factor * (high["percentile"] - high["percentile_low"]).item()],
                     [factor * (high["percentile_high"] - high["percentile"]).item()]]  # fmt: skip
            cumulative.errorbar(
                factor * high["percentile"].item(), 95, xerr=edges, fmt="o", ms=4, color="black", capsize=3,
                label="95th percentile, 95 % interval",
            )  # fmt: skip
        density.set_ylabel(f"density (1/({unit}))" if " " in unit else f"density (1/{unit})")
        cumulative.set_ylabel("members below (%)")
        top = density.get_ylim()[1]
        density.set_ylim(0, 1.25 * top)
        density.legend(fontsize=9, loc="upper right", frameon=True)
        cumulative.legend(fontsize=9, loc="lower right")
        figure.suptitle(f"{wrapped(result.plan.title)}\nPeak of {label_of(found, response)}")
    return figure


def band_figure(result: ParameterStudy, found: xr.Dataset, response: str) -> Figure:
    """Return what peaks are of over flight time: percentiles of the members, and the first-order band at the peak."""
    factor, unit = displayed(found, response)
    time, label = result.data["time"].values, label_of(found, response)
    members, nominal = (factor * values for values in loads(result, response))
    upper = members[result.computed]
    marker = "o" if time.size < 3 else None
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for low, high, alpha in ((1, 99, 0.15), (5, 95, 0.3)):
            edges = np.percentile(upper, [low, high], axis=0)
            axes.fill_between(time, *edges, color=COLORS["wind"], alpha=alpha, lw=0, label=f"{low} to {high} %")
        median = np.median(upper, axis=0)
        axes.plot(time, median, color=COLORS["wind"], lw=1.6, label="median", marker=marker)
        axes.plot(time, nominal, ":", color="black", lw=1.6, label="nominal", marker=marker)
        at = found.sel(measure=timed(found, response), response=response)
        centre, sigma = (factor * at[name].item() for name in ("first_order_mean", "first_order_std"))
        if np.isfinite(sigma):
            half = float(stats.norm.ppf(0.95)) * sigma
            axes.errorbar(
                at["peak_time"].item(), centre, yerr=half, fmt="s", ms=4, color=COLORS[COMBINED], capsize=4, lw=1.8,
                label="5 to 95 %, first order",
            )  # fmt: skip
        axes.margins(y=0.12)
        stable = (result.data["status"].values == COMPUTED)[result.computed]
        if stable.any() and not stable.all():
            shown = np.concatenate([upper[stable].ravel(), nominal])
            axes.set_ylim(shown.min() - 0.12 * np.ptp(shown), shown.max() + 0.12 * np.ptp(shown))
        axes.set(xlabel="flight time (s)", ylabel=f"{label} ({unit})")
        axes.set_title(f"{wrapped(result.plan.title)}\n{label}, {upper.shape[0]} members", fontsize=11)
        axes.legend(fontsize=9)
    return figure


def tornado_figure(result: ParameterStudy, found: xr.Dataset, response: str) -> Figure:
    """Return the changes of the peak, the largest on top, with the first-order ones as marks.

    Members that are unstable or failed are named; the axis is that of the others.
    """
    part = found.sel(measure=PEAK, response=response)
    factor, unit = displayed(found, response)
    change, predicted = (factor * part[name].values for name in ("change", "first_order_change"))
    status = part["status"].values
    stable, predicted = (np.where(status == COMPUTED, x, np.nan) for x in (change, predicted))
    size = np.nanmax(np.abs(np.concatenate([stable, predicted], axis=1)), axis=1, initial=0.0)
    order = np.argsort(-size, kind="stable")
    place = np.arange(order.size)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.9 + 0.42 * order.size), layout="constrained")
        axes = figure.subplots()
        for k, (end, color) in enumerate((("low", COLORS["wind"]), ("high", COLORS[COMBINED]))):
            axes.barh(place, np.nan_to_num(stable[order, k]), color=color, alpha=0.75, label=f"at the {end} value")
        axes.plot(predicted[order].T.ravel(), np.tile(place, 2), "d", color="black", ms=5, ls="", label="first order")
        labels = []
        for row, q in enumerate(order):
            low, high = part["value"].values[q]
            shown = f"{low:.4g} … {high:.4g} {part['quantity_unit'].values[q]}".removesuffix(" 1")
            labels.append(f"{part['quantity'].values[q]}\n{shown}")
            other = [f"{STATUS[s]} at the {end} value" for s, end in zip(status[q], ("low", "high"), strict=True) if s]
            axes.annotate(
                ", ".join(other), (1, row), xycoords=("axes fraction", "data"), ha="right", va="center",
                fontsize=8.5, color="red",
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
            )  # fmt: skip
        axes.set_yticks(place, labels, fontsize=8.5)
        axes.invert_yaxis()
        axes.axvline(0, color="black", lw=0.6)
        axes.grid(axis="y", visible=False)
        nominal = factor * part["nominal"].item()
        axes.set_xlabel(wrapped(f"change of the peak {label_of(found, response)} from {nominal:.4g} {unit} ({unit})"))
        axes.set_title(wrapped(result.plan.title), fontsize=11)
        figure.legend(fontsize=9, loc="outside lower center", ncols=3)
    return figure
