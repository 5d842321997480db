"""Linear regression (report 3.4.2, Appendix B): denominators by regression, numerators from jumps of the derivative.

Expected to be poor, as the report found: b of the highest power is the root of a jump of the covariance's derivative
at equal altitudes (B-7), which data 1 km apart cannot show, and the fitted derivatives of third order are mostly error.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions
from ..fitting.altitude_grid import propagated_covariance
from ..fitting.analytic_fits import AnalyticCovariance, fit_covariance
from .result import SynthesisError, SynthesisResult

METHOD = "linear-regression"

# First and higher derivatives at equidistant points from the values there: (B-8) to (B-11), (B-14) to (B-22)
FIRST_2 = np.array([[-3, 4, -1], [-1, 0, 1], [1, -4, 3]]) / 2
SECOND_2 = np.array([[1, -2, 1]] * 3)
FIRST_3 = np.array([[-11, 18, -9, 2], [0, -9, 12, -3], [3, -12, 9, 0], [-2, 9, -18, 11]]) / 6
SECOND_3 = np.array([[2, -5, 4, -1], [1, -2, 1, 0], [0, 1, -2, 1], [-1, 4, -5, 2]])
THIRD_3 = np.array([[-1, 3, -3, 1]] * 4)


def synthesise_linear_regression(
    statistics: WindStatistics, order: int = 3, options: FitOptions | None = None
) -> SynthesisResult:
    """Make a filter of second or third order by regression; nothing is optimised, so it always 'converges'.

    Raises
    ------
    SynthesisError
        Levels that are not equidistant, as the difference formulas need.
    """
    a, b = regression_coefficients(statistics, order)
    shaping_filter = companion_filter(METHOD, statistics, a, b)
    covariance = propagated_covariance(shaping_filter, statistics.altitude)
    if not np.isfinite(covariance).all():
        raise SynthesisError(
            f"linear regression of order {order} for {statistics.name} gives a filter whose covariance grows without "
            "bound; use another method"
        )
    h = statistics.altitude
    coefficients = {f"a_{i}": (h, a[:, i]) for i in range(order)} | {f"b_{i}": (h, b[:, i]) for i in range(order)}
    return SynthesisResult(
        METHOD, statistics, shaping_filter, covariance, True, "regression", coefficients=coefficients
    )


def regression_coefficients(statistics: WindStatistics, order: int) -> tuple[NDArray, NDArray]:
    """Return a_i and b_i of x^(n) + a_(n-1) x^(n-1) + ... + a_0 x = b_(n-1) eta^(n-1) + ... + b_0 eta, each (k, n).

    Altitude in km. Levels that have too few below or above take the coefficients of the nearest level that has enough.
    """
    h = statistics.altitude / 1000.0
    steps = np.diff(h)
    if np.ptp(steps) > 0.01 * steps.mean():
        raise SynthesisError("linear regression needs equidistant levels; take statistics.between() two of them")
    analytic = fit_covariance(statistics)
    a = _denominators(analytic, order)
    jump = _derivative_jump(statistics.covariance, steps.mean())
    b = np.array([_numerator(a, i, np.sqrt(max(0.0, jump[i])), steps.mean(), order) for i in range(h.size)])
    return a, b


def _denominators(analytic: AnalyticCovariance, order: int) -> NDArray[np.float64]:
    """Return a (k, n) by (3-5): for each altitude a regression over the levels below it."""
    h = analytic.levels
    curves = np.array([analytic.derivatives(i, h) for i in range(h.size)])  # of reference, derivative, altitude
    a = np.zeros((h.size, order))
    for k in range(order, h.size):
        below = curves[:k, :, k]
        a[k] = np.linalg.lstsq(below[:, :order], -below[:, order], rcond=None)[0]
    a[:order] = a[order]
    return a


def _derivative_jump(covariance: NDArray, step: float) -> NDArray[np.float64]:
    """Return dC/dh below less above at equal altitudes (B-6) by differences over one interval of the data."""
    variance, next_one = np.diag(covariance), np.diag(covariance, 1)
    below, above = (variance[1:] - next_one) / step, (next_one - variance[:-1]) / step
    jump = np.empty(variance.size)
    jump[1:-1] = below[:-1] - above[1:]
    jump[0], jump[-1] = jump[1], jump[-2]
    return jump


def _numerator(a: NDArray, level: int, first: float, step: float, order: int) -> NDArray[np.float64]:
    """Return b_0 ... b_(n-1) at a level from its response g at the next points, (B-12), (B-24), (B-25)."""
    points = np.minimum(np.arange(level, level + order + 1), len(a) - 1)
    derivatives = [np.eye(order + 1)]
    tables = (FIRST_2, SECOND_2) if order == 2 else (FIRST_3, SECOND_3, THIRD_3)
    derivatives += [table / step ** (d + 1) for d, table in enumerate(tables)]
    equation = derivatives[order] + sum(a[points, d][:, None] * derivatives[d] for d in range(order))
    # the homogeneous equations at the points are set equal, one to the next
    difference = equation[:-1] - equation[1:]
    g = np.concatenate([[first], np.linalg.solve(difference[:, 1:], -difference[:, 0] * first)])
    slope, curvature = derivatives[1][0] @ g, derivatives[2][0] @ g
    if order == 2:
        return np.array([slope + a[level, 1] * first, first])
    a1, a2 = a[level, 1], a[level, 2]
    b1 = slope + a2 * first
    return np.array([curvature + a2 * b1 + a1 * first - a2**2 * first, b1, first])


def companion_filter(
    name: str, statistics: WindStatistics, a: NDArray, b: NDArray, start: NDArray | None = None
) -> ShapingFilter:
    """Return x^(n) + ... + a_0 x = noise, W = b_0 x + ... + b_(n-1) x^(n-1), with the derivatives in km as states.

    Without a start covariance it starts from rest at the lowest level, as the report's filters do.
    """
    k, order = a.shape
    F = np.zeros((k, order, order))
    F[:, :-1, 1:] = np.eye(order - 1)
    F[:, -1, :] = -a
    G = np.zeros((k, order, 1))
    G[:, -1, 0] = 1.0
    return ShapingFilter(
        name.replace("-", "_"),
        statistics.altitude,
        F / 1000.0,
        G / np.sqrt(1000.0),
        b,
        np.zeros((order, order)) if start is None else start,
        tuple(statistics.altitude[1:-1].tolist()),
        f"{name} of {statistics.name}: {statistics.source}",
    )
