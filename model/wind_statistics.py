"""Mean and standard deviation of the wind over altitude, and the report's analytic fit of the latter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .tables import Table
from .wind_filter import ShapingFilter, TwoPartKernel

FILTER_SPACING = 250.0  # m, of the samples on which a closed-form filter is tabulated


def report_standard_deviation(altitude: ArrayLike) -> NDArray[np.float64]:
    """Return the report's fit of the March standard deviation (m/s), Appendix A, figure A1.

    sigma(h) = B1 + B2 exp(B3 (h - B4)^2) + B5 (h/22)^B6 (1 - h/22)^B7, h in km, valid from 0 to 16 km and held
    above. B3 is printed positive; only the negative sign meets the data (docs/equations.md).
    """
    h = np.clip(np.asarray(altitude, float) / 1000.0, 0.0, 16.0)
    s = h / 22.0
    return 6.64392 + 3.63807 * np.exp(-0.157801 * (h - 11.379) ** 2) + 121.02 * s**2.11731 * (1 - s) ** 2.36174


@dataclass(frozen=True, eq=False)
class WindModel:
    """The mean wind over altitude (m, m/s) and the filter for its variations."""

    mean: Table
    shaping_filter: ShapingFilter


def closed_form_filter(kernel: TwoPartKernel, standard_deviation: Table, top: float | None = None) -> ShapingFilter:
    """Return the exact filter of a kernel for a tabulated standard deviation (m/s over m)."""
    knots = standard_deviation.argument
    low, high = float(knots[0]), float(top if top is not None else knots[-1])
    samples = np.arange(np.ceil(low / FILTER_SPACING), np.floor(high / FILTER_SPACING) + 1) * FILTER_SPACING
    corners = [x for x in (*kernel.kinks, *knots) if low < x < high]
    altitude = np.unique(np.concatenate([[low], samples, corners, [high]]))
    keep = np.concatenate([[True], np.diff(altitude) > 1e-6])
    altitude = altitude[keep]
    sigma = standard_deviation.polynomial(np.clip(altitude, knots[0], knots[-1]))
    return kernel.shaping_filter(altitude, sigma, kinks=[x for x in knots if low < x < high])
