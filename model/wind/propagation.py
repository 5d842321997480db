"""The covariance of a wind filter carried upward over altitude."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from .shaping_filter import ShapingFilter

SPACING = 250.0  # m, at most, of the steps, which end at the filter's samples
GAUSS = 0.5 / np.sqrt(3.0)
LARGEST_NORM, TERMS = 0.5, 14  # of an exponent whose series is summed, which leaves less than a rounding


def divided(altitude: NDArray[np.float64], spacing: float) -> list[NDArray[np.float64]]:
    """Divide each interval between altitudes equally, into steps of at most ``spacing``; one array of edges each."""
    return [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / spacing - 1e-9))) + 1) for a, b in itertools.pairwise(altitude)
    ]


def transitions(shaping_filter: ShapingFilter, edges: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
    """Return Phi and the covariance that the noise adds, for each step between edges (k + 1,), both (k, n, n).

    One Magnus step of fourth order each; coefficients must be smooth inside a step.
    """
    step = np.diff(edges)[:, None, None]
    middle, n = 0.5 * (edges[:-1] + edges[1:]), shaping_filter.order
    sides = [shaping_filter.at(middle + side * step[:, 0, 0])[:2] for side in (-GAUSS, GAUSS)]
    F, added = np.array([F for F, _ in sides]), np.array([G @ G.swapaxes(1, 2) for _, G in sides])
    size = float(np.abs(added).max()) / (float(np.abs(F).max()) or 1.0) or 1.0  # any unit of states will do
    blocks = np.zeros((2, middle.size, 2 * n, 2 * n))
    blocks[..., :n, :n], blocks[..., :n, n:], blocks[..., n:, n:] = F, added / size, -F.swapaxes(-1, -2)
    first, second = blocks
    exponential = exponentials(
        0.5 * step * (first + second) + np.sqrt(3) / 12 * step**2 * (second @ first - first @ second)
    )
    phi = exponential[:, :n, :n]
    return phi, size * exponential[:, :n, n:] @ phi.swapaxes(1, 2)


def exponentials(X: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return e^X of many small matrices (k, n, n) at once, by Taylor's series, halvings and squares."""
    norm = float(np.abs(X).sum(axis=2).max(initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(norm / LARGEST_NORM)))) if np.isfinite(norm) and norm > 0 else 0
    part, one = X / 2.0**halvings, np.eye(X.shape[1])
    found = one + part / TERMS
    for k in range(TERMS - 1, 0, -1):
        found = one + part @ found / k
    for _ in range(halvings):
        found = found @ found
    return found


def standard_deviation(shaping_filter: ShapingFilter, altitude: ArrayLike) -> NDArray[np.float64]:
    """Return the standard deviation of the wind that a filter makes at altitudes (m), m/s, as it flies.

    Below the filter's first altitude it is that of its start; above the last its coefficients are held.

    Raises
    ------
    DataError
        A covariance that grows beyond all bounds.
    """
    wanted = np.asarray(altitude, float)
    start = float(shaping_filter.altitude[0])
    points, inverse = np.unique(np.maximum(wanted, start), return_inverse=True)
    top = float(points[-1])
    P = shaping_filter.start_covariance
    found = {start: P}
    if top > start:
        samples = shaping_filter.altitude
        corners = np.unique(np.concatenate([[start], samples[samples < top], points]))
        edges = np.concatenate([[start], *(part[1:] for part in divided(corners, SPACING))])
        with np.errstate(all="ignore"):
            for high, phi, added in zip(edges[1:], *transitions(shaping_filter, edges), strict=True):
                P = phi @ P @ phi.T + added
                found[float(high)] = P
    H = shaping_filter.at(points)[2]
    variance = np.array([h @ found[float(x)] @ h for x, h in zip(points, H, strict=True)])
    if not np.isfinite(variance).all():
        at = points[int(np.argmin(np.isfinite(variance)))]
        raise DataError(
            f"the wind of filter '{shaping_filter.name}' has no finite variance at {at:g} m; its F must be in 1/m and "
            "decay"
        )
    return np.sqrt(np.maximum(variance, 0.0))[inverse].reshape(wanted.shape)
