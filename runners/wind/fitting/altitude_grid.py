"""What the syntheses share: spline knots over altitude, and the covariance of a filter carried upward."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly
from scipy.linalg import expm

from ....model.wind.propagation import GAUSS as GAUSS
from ....model.wind.propagation import divided as divided
from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics

KNOT_SPACING = 1000.0  # m, least distance of the knots of a coefficient
SAMPLE_SPACING = 62.5  # m, at most, of the samples of a fitted filter

Matrices = Callable[[float], tuple[NDArray, NDArray]]


def knots_for(altitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those altitudes that are at least a knot spacing apart, the first and the last among them."""
    knots = [altitude[0]]
    for h in altitude[1:]:
        if h - knots[-1] >= 0.99 * KNOT_SPACING:
            knots.append(h)
    knots[-1] = altitude[-1]
    return np.array(knots) if len(knots) > 2 else altitude[[0, -1]]


def dense_samples(altitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the altitudes and points between them at most a sample spacing apart."""
    return np.unique(np.concatenate(divided(altitude, SAMPLE_SPACING)))


def natural_spline(knots: NDArray[np.float64], values: NDArray[np.float64]) -> PPoly:
    """Return a natural cubic spline through values at knots (first axis), a straight line through two."""
    if knots.size == 2:
        return PPoly(np.stack([(values[1] - values[0]) / (knots[1] - knots[0]), values[0]])[:, None], knots)
    return CubicSpline(knots, values, bc_type="natural")


def second_differences(count: int) -> NDArray[np.float64]:
    """Return the matrix of second differences of values at knots, (count - 2, count)."""
    return np.diff(np.eye(count), 2, axis=0)


def covariance_data(statistics: WindStatistics) -> NDArray[np.float64]:
    """Return standard deviations and covariances as the data of residual functions."""
    return np.concatenate([statistics.standard_deviation, statistics.covariance.ravel()])


def covariance_symbols(count: int) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return the symbol of those data, and in it the standard deviations (k,) and covariances (k, k)."""
    data = ca.SX.sym("data", count + count * count)
    return data, data[:count], ca.reshape(data[count:], count, count)


def transition(matrices: Matrices, low: float, high: float) -> tuple[NDArray, NDArray]:
    """Return Phi(high, low) and the covariance that the noise adds between, by one Magnus step of fourth order."""
    step, middle = high - low, 0.5 * (low + high)
    n = matrices(middle)[0].shape[0]
    blocks = []
    for h in (middle - GAUSS * step, middle + GAUSS * step):
        F, G = matrices(h)
        blocks.append(np.block([[F, G @ G.T], [np.zeros((n, n)), -F.T]]))
    first, second = blocks
    exponential = expm(0.5 * step * (first + second) + np.sqrt(3) / 12 * step**2 * (second @ first - first @ second))
    phi = exponential[:n, :n]
    return phi, exponential[:n, n:] @ phi.T


def propagated_covariance(
    shaping_filter: ShapingFilter, altitude: NDArray[np.float64], spacing: float = 50.0
) -> NDArray[np.float64]:
    """Return the covariance (k, k), m2/s2, of a filter's output at altitudes, carried upward from its start.

    P' = F P + P F' + G G', R(h2, h1) = H(h2) Phi(h2, h1) P(h1) H(h1)'. A lower altitude than the filter's first is
    taken there.
    """
    start = float(shaping_filter.altitude[0])
    covariance, position = shaping_filter.start_covariance, start
    columns: list[NDArray] = []
    result = np.zeros((altitude.size, altitude.size))

    def matrices(h: float) -> tuple[NDArray, NDArray]:
        F, G, _ = shaping_filter.at(h)
        return F, G

    samples = shaping_filter.altitude
    for i, target in enumerate(np.maximum(altitude, start)):
        # coefficients are smooth between samples: no step goes across one
        inner = samples[(samples > position) & (samples < target)]
        for edges in divided(np.array([position, *inner, target]), spacing) if target > position else []:
            for a, b in itertools.pairwise(edges):
                phi, added = transition(matrices, a, b)
                covariance = phi @ covariance @ phi.T + added
                columns = [phi @ c for c in columns]
        position = target
        H = shaping_filter.at(target)[2]
        columns.append(covariance @ H)
        result[i, : i + 1] = result[: i + 1, i] = [H @ c for c in columns]
    return result
