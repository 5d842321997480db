"""Reconstruct the correlation between all altitudes from a few measured pairs of levels.

The two-part kernel (model/wind/shaping_filter.py) is fitted to the correlations of four levels and one layer mean. They
do not determine it above and below: there its knots stay as near to those of March as the rest allows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...model.tables import Table
from ...model.wind.range_reference import (
    LAYER,
    LEVELS,
    MONTHS,
    WIND_DATA,
    range_reference,
    read_rows,
)
from ...model.wind.shaping_filter import TwoPartKernel

# March, as reconstructed by hand from the same soundings; the scale factors of other months start here.
MARCH: dict[str, tuple[tuple[list[float], list[float]], ...]] = {
    "zonal": (
        ([0, 4.5, 11, 15, 20], [16.25, 17.05, 12.71, 10.0, 7.0]),
        ([0, 11, 15, 20], [1.263, 2.914, 2.0, 1.2]),
        ([0, 2.3, 5.0, 11, 15, 20], [0.646, 0.332, 0.138, 0.236, 0.27, 0.35]),
    ),
    "meridional": (
        ([0, 4.5, 11, 15, 20], [5.86, 7.43, 10.55, 8.5, 6.5]),
        ([0, 11, 15, 20], [1.125, 2.931, 2.0, 1.2]),
        ([0, 2.3, 5.0, 11, 15, 20], [0.795, 0.416, 0.153, 0.116, 0.2, 0.3]),
    ),
    "third_order": (
        ([0, 4.5, 11, 15, 20], [15.13, 16.47, 12.80, 10.0, 7.0]),
        ([0, 11, 15, 20], [1.374, 2.959, 2.0, 1.2]),
        ([0, 2.3, 5.0, 11, 15, 20], [0.651, 0.327, 0.145, 0.233, 0.27, 0.35]),
    ),
}
QUANTITIES = ("long_scale", "short_scale", "short_fraction")
LAYER_ALTITUDES = np.linspace(100.0, 3100.0, 7)
LEVEL_ERROR, LAYER_ERROR = 0.015, 0.05  # trusted; the file does not say how the layer mean is weighted
WANDER = 0.25  # standard deviation of the change of ln(scale) or logit(fraction) against March, from knot to knot


@dataclass(frozen=True)
class LevelPair:
    """A measured correlation between two levels (keys of LEVELS, or LAYER)."""

    first: str
    second: str
    correlation: float


def march_kernel(variant: str) -> TwoPartKernel:
    """Return the kernel of March: 'zonal', 'meridional', or the zonal one of 'third_order'."""
    long, short, fraction = ((np.array(h) * 1000.0, np.array(v)) for h, v in MARCH[variant])
    return TwoPartKernel(
        (long[0], long[1] * 1000.0),
        (short[0], short[1] * 1000.0),
        fraction,
        short_smoothness=0.5 if variant == "third_order" else 0.7,
    )


def measured_pairs(period: str, component: str) -> list[LevelPair]:
    """Return the measured correlations of a month and component; 'annual' mixes the months and their means."""
    letter = "u" if component == "zonal" else "v"
    if period != "annual":
        return [p for p in _pairs(str(MONTHS.index(period) + 1), letter)]
    levels = [LAYER, *LEVELS]
    total, weight, means = np.zeros((5, 5)), 0.0, []
    for month in range(1, 13):
        statistics = {
            r["level [hPa]"]: r
            for r in read_rows(WIND_DATA / "level_statistics_2008_2022.csv")
            if r["month"] == str(month)
        }
        sd = np.array([float(statistics[k][f"standard_deviation_{letter} [m/s]"]) for k in levels])
        n = float(statistics["850"]["soundings [1]"])
        r = np.eye(5)
        for pair in _pairs(str(month), letter):
            i, j = levels.index(pair.first), levels.index(pair.second)
            r[i, j] = r[j, i] = pair.correlation
        total += n * r * np.outer(sd, sd)
        weight += n
        means.append((n, [float(statistics[k][f"mean_{letter} [m/s]"]) for k in levels]))
    n, m = np.array([x for x, _ in means]), np.array([x for _, x in means])
    m = m - n @ m / weight
    covariance = (total + (n[:, None] * m).T @ m) / weight
    sd = np.sqrt(np.diag(covariance))
    return [
        LevelPair(levels[i], levels[j], covariance[i, j] / (sd[i] * sd[j])) for i in range(5) for j in range(i + 1, 5)
    ]


def _pairs(month: str, letter: str) -> list[LevelPair]:
    return [
        LevelPair(row["level_a [hPa]"], row["level_b [hPa]"], float(row["correlation [1]"]))
        for row in read_rows(WIND_DATA / "interlevel_correlation_2008_2022.csv")
        if row["month"] == month and row["component_a"] == letter == row["component_b"]
    ]


def kernel_correlations(kernel: TwoPartKernel, pairs: list[LevelPair], deviation: Table) -> NDArray[np.float64]:
    """Return what a kernel says about measured pairs; the layer is weighted by pressure."""
    altitude = np.concatenate([LAYER_ALTITUDES, list(LEVELS.values())])
    correlation = kernel.correlation(altitude)
    n = LAYER_ALTITUDES.size
    layer = np.zeros(altitude.size)
    layer[:n] = np.exp(-LAYER_ALTITUDES / 8000.0) * deviation.polynomial(LAYER_ALTITUDES)
    weights = {key: np.eye(altitude.size)[n + i] for i, key in enumerate(LEVELS)} | {LAYER: layer}

    def inner(a: str, b: str) -> float:
        return float(weights[a] @ correlation @ weights[b])

    return np.array(
        [inner(p.first, p.second) / np.sqrt(inner(p.first, p.first) * inner(p.second, p.second)) for p in pairs]
    )


def fit_kernel(pairs: list[LevelPair], deviation: Table, start: TwoPartKernel) -> TwoPartKernel:
    """Fit a kernel to measured pairs.

    Parameters
    ----------
    deviation : Table
        Standard deviation over altitude, m/s, for the layer mean.
    start : TwoPartKernel
        Kept where the pairs say nothing: the changes against it are a random walk from knot to knot.
    """
    sizes = [start.long_scale[0].size, start.short_scale[0].size, start.short_fraction[0].size]
    measured = np.array([p.correlation for p in pairs])
    error = np.array([LAYER_ERROR if LAYER in (p.first, p.second) else LEVEL_ERROR for p in pairs])

    def kernel(change: NDArray) -> TwoPartKernel:
        long, short, fraction = np.split(change, np.cumsum(sizes)[:-1])
        x, b2 = start.short_fraction
        return TwoPartKernel(
            (start.long_scale[0], start.long_scale[1] * np.exp(long)),
            (start.short_scale[0], start.short_scale[1] * np.exp(short)),
            (x, 1 / (1 + (1 - b2) / b2 * np.exp(-fraction))),
            start.source,
            start.short_smoothness,
        )

    def residuals(change: NDArray) -> NDArray:
        walk = [np.concatenate([[c[0] / 2], np.diff(c)]) for c in np.split(change, np.cumsum(sizes)[:-1])]
        misfit = (kernel_correlations(kernel(change), pairs, deviation) - measured) / error
        return np.concatenate([misfit, np.concatenate(walk) / WANDER])

    # the kernel holds Bessel functions, which CasADi does not differentiate: differences serve for 15 unknowns
    return kernel(least_squares(residuals, np.zeros(sum(sizes)), method="lm", diff_step=1e-5).x)


def reconstructed_kernel(period: str, component: str) -> TwoPartKernel:
    """Return the kernel of a month (or 'annual') and component, fitted to its measured pairs; March is given."""
    if period == "march":
        return march_kernel(component)
    table = range_reference(period)
    deviation = Table("sigma", "m/s", table.altitude, table.standard_deviation[component], "pchip")
    return fit_kernel(measured_pairs(period, component), deviation, march_kernel(component))
