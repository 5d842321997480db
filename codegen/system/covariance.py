"""The right-hand side of the covariance equation: y holds covariances of all sources, then the mean.

Of each covariance the lower triangle, row by row, one source after another; states by their scales.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.system.linear_system import LinearSystem
from ..toolchain.library import Library
from .functions import state_scales

Rate = Callable[[float, float, float, NDArray], NDArray]


def packed(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower triangles of symmetric matrices (k, n, n), row by row, (k, n (n + 1) / 2)."""
    return matrices[(slice(None), *np.tril_indices(matrices.shape[-1]))]


def unpacked(triangles: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Return symmetric matrices (k, n, n) from their lower triangles, in one vector or (k, n (n + 1) / 2)."""
    rows, columns = np.tril_indices(n)
    triangles = triangles.reshape(-1, rows.size)
    found = np.empty((len(triangles), n, n))
    found[:, rows, columns] = triangles
    found[:, columns, rows] = triangles
    return found


def size_of(system: LinearSystem) -> int:
    """Return how many numbers y holds."""
    n = len(system.states)
    return len(system.sources) * n * (n + 1) // 2 + n


def interpreted_derivative(
    system: LinearSystem,
) -> Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray], NDArray]:
    """Return (A, B, E u, y) -> dy/dt by NumPy, the matrices in the system's own units."""
    scale, noises = state_scales(system), [system.noise_columns(source) for source in system.sources]
    n = scale.size

    def derivative(
        A: NDArray[np.float64], B: NDArray[np.float64], known: NDArray[np.float64], y: NDArray
    ) -> NDArray[np.float64]:
        A, B = A * scale / scale[:, None], B / scale[:, None]
        half = A @ unpacked(y[: y.size - n], n)
        driven = np.array([B[:, columns] @ B[:, columns].T for columns in noises]).reshape(half.shape)
        moving = packed(half + half.transpose(0, 2, 1) + driven)
        return np.concatenate([moving.ravel(), A @ y[y.size - n :] + known / scale])

    return derivative


def compiled_rate(
    system: LinearSystem, library: Library, parameters: NDArray[np.float64], tables: NDArray[np.float64]
) -> Rate:
    """Return (time, low, high, y) -> dy/dt by the library of a system; it serves one thread.

    Tables are looked up within [low, high].
    """
    at, given, found = np.zeros(3), np.zeros(size_of(system)), np.zeros(size_of(system))
    evaluate = library.bound("covariance_rate", at, np.ascontiguousarray(parameters, dtype=float), tables, given, found)

    def rate(time: float, low: float, high: float, y: NDArray) -> NDArray:
        at[:] = time, low, high
        given[:] = y
        evaluate()
        return found.copy()

    return rate
