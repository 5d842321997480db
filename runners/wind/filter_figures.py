"""Figures of a wind filter after the report's 3-7 to 3-16 and A1."""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from numpy.typing import NDArray

from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.statistics import WindStatistics, report_standard_deviation
from ..present.style import STYLE, Figure
from .fitting.intervals import covariance_interval
from .synthesis.result import SynthesisResult

DATA, FILTER, BAND = "#444444", "#1f6fb4", "#1f6fb430"


def coefficient_figure(
    shaping_filter: ShapingFilter, time: NDArray[np.float64], altitude: NDArray[np.float64]
) -> Figure:
    """Return the coefficients over flight time, after figures 3-7 to 3-12.

    Parameters
    ----------
    time, altitude : (k,) arrays
        s and m of a trajectory, as far as the filter goes.
    """
    rate = np.gradient(altitude, time)
    values = [shaping_filter.at(h) for h in altitude]
    panels = {
        "ḣ F (1/s)": (shaping_filter.order, shaping_filter.order, lambda v, r: r * v[0]),
        "√ḣ G (1/√s)": (
            shaping_filter.order,
            shaping_filter.noise_count,
            lambda v, r: np.sqrt(max(r, 0.0)) * v[1],
        ),
        "H (m/s)": (1, shaping_filter.order, lambda v, r: v[2][None]),
    }
    with rc_context(STYLE):
        figure = Figure(figsize=(8, 9), layout="constrained")
        for axes, (label, (rows, columns, take)) in zip(
            figure.subplots(3, 1, sharex=True), panels.items(), strict=True
        ):
            data = np.array([take(v, r) for v, r in zip(values, rate, strict=True)])
            for i in range(rows):
                for j in range(columns):
                    if np.abs(data[:, i, j]).max() > 0:
                        axes.plot(time, data[:, i, j], label=f"{i + 1},{j + 1}" if rows > 1 else f"{j + 1}")
            axes.set_ylabel(label)
            axes.legend(ncols=4, fontsize=8)
        figure.axes[-1].set_xlabel("flight time (s)")
        figure.suptitle(f"Filter coefficients over flight time\n{shaping_filter.name.replace('_', ' ')}")
    return figure


def covariance_figure(statistics: WindStatistics, covariance: NDArray[np.float64], title: str) -> Figure:
    """Return covariance curves of the filter against the data, after figures 3-13 to 3-15."""
    h, data = statistics.altitude / 1000.0, statistics.covariance
    thirds = np.array_split(np.arange(h.size), 3)
    with rc_context(STYLE):
        figure = Figure(figsize=(11, 5), layout="constrained")
        for axes, group in zip(figure.subplots(1, 3, sharey=True), thirds, strict=True):
            for n, i in enumerate(group):
                axes.plot(h, covariance[i], color=f"C{n}", label=f"{h[i]:.3g} km")
                axes.plot(h, data[i], "o", color=f"C{n}", markersize=3.5)
            axes.set_xlabel("altitude (km)")
            axes.legend(title="with the wind at", fontsize=8, title_fontsize=8)
        figure.axes[0].set_ylabel("covariance (m²/s²)")
        figure.suptitle(f"{title}\nlines: filter, dots: data")
    return figure


def interval_figure(statistics: WindStatistics, covariance: NDArray[np.float64], level: float = 9000.0) -> Figure:
    """Return the covariance with one level and its 90 % band, after figure 3-16."""
    i = int(np.argmin(np.abs(statistics.altitude - level)))
    h = statistics.altitude / 1000.0
    low, high = covariance_interval(statistics.covariance, statistics.independent_samples)
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.fill_between(h, low[i], high[i], color=BAND, label="90 % interval", linewidth=0)
        axes.plot(h, statistics.covariance[i], "o", color=DATA, markersize=4, label="data")
        axes.plot(h, covariance[i], color=FILTER, label="filter")
        axes.set_xlabel("altitude (km)")
        axes.set_ylabel("covariance (m²/s²)")
        axes.legend()
        axes.set_title(f"Covariance with {h[i]:.3g} km, {statistics.name}, N = {statistics.independent_samples:.0f}")
    return figure


def deviation_figure(statistics: WindStatistics, coefficients: NDArray[np.float64]) -> Figure:
    """Return the standard deviation, the fit of Appendix A to it and the report's own, after figure A1."""
    from .fitting.analytic_fits import deviation_form

    h = np.linspace(0.0, min(16.0, statistics.altitude[-1] / 1000.0), 200)
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        axes.plot(statistics.altitude / 1000.0, statistics.standard_deviation, "o", color=DATA, label="data")
        axes.plot(h, [float(deviation_form(x, coefficients)) for x in h], color=FILTER, label="fit of the same form")
        axes.plot(h, report_standard_deviation(1000.0 * h), "--", color="#c8442c", label="report's fit (Appendix A)")
        axes.set_ylim(0.0)
        axes.set_xlabel("altitude (km)")
        axes.set_ylabel("standard deviation (m/s)")
        axes.legend()
        axes.set_title(f"Standard deviation, {statistics.name}")
    return figure


def error_figure(results: list[SynthesisResult]) -> Figure:
    """Return the error of the covariances by altitude for several syntheses."""
    with rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for result in results:
            label = f"{result.method}, order {result.shaping_filter.order}: {result.rms_error:.3g} m²/s²"
            axes.semilogy(
                result.statistics.altitude / 1000.0, result.error_by_altitude, marker="o", markersize=3, label=label
            )
        axes.set_xlabel("altitude (km)")
        axes.set_ylabel("rms error of the covariances (m²/s²)")
        axes.legend()
        axes.set_title(f"Syntheses for {results[0].statistics.name}")
    return figure
