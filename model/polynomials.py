"""Piecewise polynomials and the cubics between rows, by NumPy: SciPy's take longer to import than a vehicle to load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROUNDING = 1e-15
REAL = 1e-9  # imaginary part of a root, at most, that rounding made of a real one


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial:
    """Polynomials of one degree between knots, each in the distance from its left knot.

    ``scipy.interpolate.PPoly(p.c, p.x)`` is the same function with all that SciPy can do with it.

    Parameters
    ----------
    c : (order, k - 1) array
        Coefficients, highest power first.
    x : (k,) array
        Knots, increasing. The first and last polynomial go on beyond them.
    """

    c: NDArray[np.float64]
    x: NDArray[np.float64]

    def __call__(self, argument: ArrayLike, derivative: int = 0) -> NDArray[np.float64]:
        """Return values, or those of a derivative, in the shape of the argument."""
        if derivative:
            return self.derivative(derivative)(argument)
        at = np.asarray(argument, float)
        piece = np.clip(np.searchsorted(self.x, at, side="right") - 1, 0, self.x.size - 2)
        u = at - self.x[piece]
        found = self.c[0, piece]
        for row in self.c[1:]:
            found = found * u + row[piece]
        return found

    def derivative(self, times: int = 1) -> PiecewisePolynomial:
        """Return the derivative, taken once or as often as said."""
        c = self.c
        for _ in range(times):
            c = c[:-1] * np.arange(c.shape[0] - 1, 0, -1)[:, None] if c.shape[0] > 1 else np.zeros_like(c)
        return PiecewisePolynomial(c, self.x)

    def passes(self, value: float) -> NDArray[np.float64]:
        """Return the arguments between the knots at which the polynomials have a value, one at a knot perhaps twice."""
        width = np.diff(self.x)
        c = self.c * width ** np.arange(self.c.shape[0] - 1, -1, -1)[:, None]  # of the share of a piece, 0 to 1
        c[-1] -= value
        size = np.abs(c)
        found = []
        for k in np.flatnonzero(size[-1] <= size[:-1].sum(axis=0) * (1 + ROUNDING)):
            roots = np.roots(np.where(size[:, k] > ROUNDING * size[:, k].max(), c[:, k], 0.0))
            share = roots.real[np.abs(roots.imag) <= REAL]
            found.append(self.x[k] + width[k] * share[(share >= 0) & (share <= 1)])
        return np.concatenate([np.zeros(0), *found])


def straight_lines(x: NDArray[np.float64], y: NDArray[np.float64]) -> PiecewisePolynomial:
    """Return straight lines between rows, as cubics."""
    slope = np.diff(y) / np.diff(x)
    return PiecewisePolynomial(np.vstack([np.zeros((2, slope.size)), slope, y[:-1]]), x)


def not_a_knot_spline(x: NDArray[np.float64], y: NDArray[np.float64]) -> PiecewisePolynomial:
    """Return the cubic spline through three rows or more whose first two pieces are one cubic, and whose last two are.

    Raises
    ------
    ZeroDivisionError
        Rows so close that their distances vanish beside each other.
    """
    h = np.diff(x)
    slope = np.diff(y) / h
    if x.size == 3:
        bend = (slope[1] - slope[0]) / (h[0] + h[1])
        return _hermite(x, y, np.array([slope[0] - bend * h[0], slope[0] + bend * h[0], slope[1] + bend * h[1]]))
    first, last = h[0] + h[1], h[-2] + h[-1]
    begin = ((h[0] + 2 * first) * h[1] * slope[0] + h[0] ** 2 * slope[1]) / first
    end = (h[-1] ** 2 * slope[-2] + (2 * last + h[-1]) * h[-2] * slope[-1]) / last
    middle = 3 * (h[1:] * slope[:-1] + h[:-1] * slope[1:])
    below, above = [*h[1:].tolist(), float(last)], [float(first), *h[:-1].tolist()]
    diagonal = [float(h[1]), *(2 * (h[:-1] + h[1:])).tolist(), float(h[-2])]
    right = [float(begin), *middle.tolist(), float(end)]
    return _hermite(x, y, np.array(_tridiagonal_solution(below, diagonal, above, right)))


def _tridiagonal_solution(
    below: list[float], diagonal: list[float], above: list[float], right: list[float]
) -> list[float]:
    """Solve for the slopes of a spline; no pivot comes near zero, also not in the rows of its ends."""
    for k, left in enumerate(below, start=1):
        factor = left / diagonal[k - 1]
        diagonal[k] -= factor * above[k - 1]
        right[k] -= factor * right[k - 1]
    right[-1] /= diagonal[-1]
    for k in range(len(above) - 1, -1, -1):
        right[k] = (right[k] - above[k] * right[k + 1]) / diagonal[k]
    return right


def monotone_cubics(x: NDArray[np.float64], y: NDArray[np.float64]) -> PiecewisePolynomial:
    """Return cubics through three rows or more that rise and fall only where the rows do (PCHIP).

    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300: slopes are weighted harmonic means; at the ends those
    of three rows, held to the nearest line.
    """
    h = np.diff(x)
    slope = np.diff(y) / h
    before, after = slope[:-1], slope[1:]
    w1, w2 = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    found = np.zeros(x.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (w1 + w2) / (w1 / before + w2 / after)
    found[1:-1] = np.where(np.sign(before) * np.sign(after) > 0, mean, 0.0)
    found[0] = _end_slope(h[0], h[1], slope[0], slope[1])
    found[-1] = _end_slope(h[-1], h[-2], slope[-1], slope[-2])
    return _hermite(x, y, found)


def _end_slope(h0: float, h1: float, slope0: float, slope1: float) -> float:
    found = ((2 * h0 + h1) * slope0 - h0 * slope1) / (h0 + h1)
    if np.sign(found) != np.sign(slope0):
        return 0.0
    if np.sign(slope0) != np.sign(slope1) and abs(found) > 3 * abs(slope0):
        return 3 * slope0
    return found


def _hermite(x: NDArray, y: NDArray, slopes: NDArray) -> PiecewisePolynomial:
    """Return the cubics with these values and slopes at their ends."""
    h = np.diff(x)
    slope = np.diff(y) / h
    bend = (slopes[:-1] + slopes[1:] - 2 * slope) / h
    return PiecewisePolynomial(np.array([bend / h, (slope - slopes[:-1]) / h - bend, slopes[:-1], y[:-1]]), x)
