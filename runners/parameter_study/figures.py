"""Figures of parameter studies: spread and band of a dispersion, tornado, line and contour of a grid."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import rc_context
from matplotlib.figure import Figure
from scipy import stats

from ..figures import COLORS, STYLE, words
from ..statistics import COMBINED
from .measures import PEAK, displayed
from .run import ParameterStudy

BINS = 40


def histogram_figure(result: ParameterStudy, measured: xr.Dataset, found: xr.Dataset, response: str) -> Figure:
    """Return the distribution of the peak mean + 3 sigma beside the first-order normal one."""
    factor, unit = displayed(measured, response)
    at = found.sel(measure=PEAK, response=response)
    values = np.sort(factor * measured["sample"].sel(measure=PEAK, response=response).values)
    centre, sigma = (factor * at[name].item() for name in ("first_order_mean", "first_order_std"))
    with rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.6), layout="constrained")
        density, cumulative = figure.subplots(1, 2)
        density.hist(
            values, bins=min(BINS, max(5, values.size // 10)), density=True, color=COLORS["wind"], alpha=0.45,
            label=f"{values.size} members: σ {factor * at['sample_std'].item():.3g} {unit}",
        )  # fmt: skip
        steps = np.arange(1, values.size + 1) / values.size
        cumulative.step(values, 100 * steps, where="post", color=COLORS["wind"], label="members")
        if np.isfinite(sigma) and sigma > 0:
            x = np.linspace(min(values[0], centre - 3.5 * sigma), max(values[-1], centre + 3.5 * sigma), 300)
            label = f"first order: σ {sigma:.3g} {unit}"
            density.plot(x, stats.norm.pdf(x, centre, sigma), "--", color=COLORS[COMBINED], lw=2, label=label)
            below = stats.norm.cdf(x, centre, sigma)
            cumulative.plot(x, 100 * below, "--", color=COLORS[COMBINED], lw=2, label="first order")
        for axes in (density, cumulative):
            axes.axvline(factor * at["nominal"].item(), color="black", lw=1, ls=":", label="nominal")
            axes.set_xlabel(f"peak of mean + 3σ {words(response)} ({unit})")
        high = at.sel(percent=95.0)
        if np.isfinite(high["percentile_low"]) and np.isfinite(high["percentile_high"]):
            edges = [[factor * (high["percentile"] - high["percentile_low"]).item()],
                     [factor * (high["percentile_high"] - high["percentile"]).item()]]  # fmt: skip
            cumulative.errorbar(
                factor * high["percentile"].item(), 95, xerr=edges, fmt="o", ms=4, color="black", capsize=3,
                label="95th percentile, 95 % interval",
            )  # fmt: skip
        density.set_ylabel(f"density (1/{unit})")
        cumulative.set_ylabel("members below (%)")
        top = density.get_ylim()[1]
        density.set_ylim(0, 1.25 * top)
        density.legend(fontsize=9, loc="upper right")
        cumulative.legend(fontsize=9, loc="lower right")
        figure.suptitle(f"{result.plan.title}\nPeak of mean + 3σ {words(response)}")
    return figure


def band_figure(result: ParameterStudy, found: xr.Dataset, response: str) -> Figure:
    """Return mean + 3 sigma over flight time: percentiles of the members, and the first-order band at the peak."""
    data = result.data.sel(response=response)
    factor, unit = displayed(found, response)
    time = data["time"].values
    upper = factor * (data["mean"] + 3 * data["std"].sel(source=COMBINED)).values[result.computed]
    nominal = factor * (data["nominal_mean"] + 3 * data["nominal_std"].sel(source=COMBINED)).values
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
        at = found.sel(measure="mean_plus_3sigma", response=response)
        centre, sigma = (factor * at[name].item() for name in ("first_order_mean", "first_order_std"))
        if np.isfinite(sigma):
            half = float(stats.norm.ppf(0.95)) * sigma
            axes.errorbar(
                at["peak_time"].item(), centre, yerr=half, fmt="s", ms=4, color=COLORS[COMBINED], capsize=4, lw=1.8,
                label="5 to 95 %, first order",
            )  # fmt: skip
        axes.margins(y=0.12)
        axes.set(xlabel="flight time (s)", ylabel=f"mean + 3σ {words(response)} ({unit})")
        axes.set_title(f"{result.plan.title}\nMean + 3σ {words(response)} of {upper.shape[0]} members", fontsize=11)
        axes.legend(fontsize=9)
    return figure


def tornado_figure(result: ParameterStudy, found: xr.Dataset, response: str) -> Figure:
    """Return the changes of the peak mean + 3 sigma, the largest on top, with the first-order ones as marks."""
    part = found.sel(measure=PEAK, response=response)
    factor, unit = displayed(found, response)
    change, predicted = (factor * part[name].values for name in ("change", "first_order_change"))
    size = np.nanmax(np.abs(np.concatenate([change, predicted], axis=1)), axis=1, initial=0.0)
    order = np.argsort(-size, kind="stable")
    place = np.arange(order.size)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.9 + 0.42 * order.size), layout="constrained")
        axes = figure.subplots()
        for k, (end, color) in enumerate((("low", COLORS["wind"]), ("high", COLORS[COMBINED]))):
            axes.barh(place, np.nan_to_num(change[order, k]), color=color, alpha=0.75, label=f"at the {end} value")
        axes.plot(predicted[order].T.ravel(), np.tile(place, 2), "d", color="black", ms=5, ls="", label="first order")
        labels = []
        for q in order:
            low, high = part["value"].values[q]
            labels.append(f"{part['quantity'].values[q]}\n{low:.4g} … {high:.4g}")
        axes.set_yticks(place, labels, fontsize=8.5)
        axes.invert_yaxis()
        axes.axvline(0, color="black", lw=0.6)
        axes.grid(axis="y", visible=False)
        nominal = factor * part["nominal"].item()
        axes.set_xlabel(f"change of the peak mean + 3σ {words(response)} from {nominal:.4g} {unit} ({unit})")
        axes.set_title(result.plan.title, fontsize=11)
        axes.legend(fontsize=9, loc="best")
    return figure


def grid_figure(result: ParameterStudy, measured: xr.Dataset, response: str) -> Figure:
    """Return the peak mean + 3 sigma over one quantity as a line, over two as contours."""
    factor, unit = displayed(measured, response)
    peak = np.full(result.data.sizes["member"], np.nan)
    peak[measured["member"].values] = factor * measured["sample"].sel(measure=PEAK, response=response).values
    values = result.data["value"].values
    labels = [q.name if q.unit == "1" else f"{q.name} ({q.unit})" for q in result.quantities]
    label = f"peak mean + 3σ {words(response)} ({unit})"
    nominal = [q.nominal for q in result.quantities]
    with rc_context(STYLE):
        figure = Figure(figsize=(8.0, 5.2), layout="constrained")
        axes = figure.subplots()
        if len(labels) == 1:
            order = np.argsort(values[:, 0])
            axes.plot(values[order, 0], peak[order], "o-", color=COLORS["wind"], lw=1.8, label="computed")
            shown = factor * measured["nominal"].sel(measure=PEAK, response=response).item()
            axes.plot(nominal[0], shown, "s", color="black", label="nominal")
            axes.set(xlabel=labels[0], ylabel=label)
            axes.legend()
        else:
            x, y = (np.unique(values[:, k]) for k in (0, 1))
            grid = np.full((y.size, x.size), np.nan)
            grid[np.searchsorted(y, values[:, 1]), np.searchsorted(x, values[:, 0])] = peak
            shape = (min(x.size, y.size) >= 2) and np.isfinite(grid).any()
            if shape:
                filled = axes.contourf(x, y, np.ma.masked_invalid(grid), levels=14, cmap="viridis")
                figure.colorbar(filled, ax=axes, label=label)
            axes.plot(values[:, 0], values[:, 1], ".", color="white", ms=3, mec="black", mew=0.4)
            axes.plot(*nominal, "s", color=COLORS[COMBINED], label="nominal")
            failed = ~np.isfinite(peak)
            if failed.any():
                axes.plot(values[failed, 0], values[failed, 1], "x", color="red", label="failed")
            axes.set(xlabel=labels[0], ylabel=labels[1])
            axes.legend(loc="upper right", frameon=True)
        axes.set_title(result.plan.title, fontsize=11)
    return figure
