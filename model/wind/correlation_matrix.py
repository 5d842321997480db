"""Correlation matrices: what makes one valid, and the nearest valid one for those that are not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import AscentwindWarning, DataError

TOLERANCE = 1e-8  # of symmetry, unit diagonal and, times the size, of the smallest eigenvalue


class NotPositiveSemidefiniteError(DataError):
    """A matrix given as correlation or covariance is not one."""


class RepairWarning(AscentwindWarning):
    """A matrix was replaced by the nearest valid one, on request."""


@dataclass(frozen=True, eq=False)
class Repair:
    """The nearest correlation matrix and what it changed.

    Attributes
    ----------
    matrix : (k, k) array
    largest_change, rms_change : float
        Of the entries off the diagonal.
    where : (int, int)
        Entry of the largest change.
    smallest_eigenvalue : float
        Of the matrix as given.
    """

    matrix: NDArray[np.float64]
    largest_change: float
    rms_change: float
    where: tuple[int, int]
    smallest_eigenvalue: float

    def __str__(self) -> str:
        return (
            f"nearest correlation matrix: smallest eigenvalue was {self.smallest_eigenvalue:.3g}; entries moved by "
            f"{self.rms_change:.3g} rms, at most {self.largest_change:.3g} at {self.where}"
        )


def check_correlation(matrix: NDArray[np.float64], what: str) -> None:
    """Refuse a matrix that is not a correlation matrix.

    Raises
    ------
    DataError
        Not square, not finite, not symmetric, or its diagonal is not one.
    NotPositiveSemidefiniteError
        It has a negative eigenvalue.
    """
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise DataError(f"{what} has shape {matrix.shape}; give a square matrix")
    if not np.isfinite(matrix).all():
        i, j = np.argwhere(~np.isfinite(matrix))[0]
        raise DataError(f"{what} holds a value that is not finite at ({i}, {j}); fill it or drop the level")
    if np.abs(matrix - matrix.T).max() > TOLERANCE:
        i, j = np.unravel_index(np.argmax(np.abs(matrix - matrix.T)), matrix.shape)
        raise DataError(f"{what} is not symmetric: ({i}, {j}) and ({j}, {i}) differ; make them equal")
    if np.abs(np.diag(matrix) - 1).max() > TOLERANCE:
        i = int(np.argmax(np.abs(np.diag(matrix) - 1)))
        raise DataError(f"{what} has {matrix[i, i]:g} on its diagonal at ({i}, {i}); a correlation with itself is 1")
    smallest = float(np.linalg.eigvalsh(matrix).min())
    if smallest < -TOLERANCE * len(matrix):
        raise NotPositiveSemidefiniteError(
            f"{what} is not positive semidefinite (smallest eigenvalue {smallest:.3g}): no wind has it; correct the "
            "entries, or ask for the nearest valid matrix with repair=True"
        )


def nearest_correlation_matrix(matrix: ArrayLike, iterations: int = 500) -> Repair:
    """Return the correlation matrix nearest to a symmetric matrix in the Frobenius norm.

    Alternating projections with Dykstra's correction: Higham, "Computing the nearest correlation matrix", IMA
    Journal of Numerical Analysis 22 (2002) 329-343, algorithm 3.3.
    """
    given = np.asarray(matrix, float)
    given = 0.5 * (given + given.T)
    eigenvalues = np.linalg.eigvalsh(given)
    y, correction = given.copy(), np.zeros_like(given)
    for _ in range(iterations):
        r = y - correction
        values, vectors = np.linalg.eigh(r)
        x = (vectors * np.maximum(values, 0.0)) @ vectors.T
        correction = x - r
        previous, y = y, x.copy()
        np.fill_diagonal(y, 1.0)
        if np.abs(y - previous).max() < 1e-12:
            break
    # the last projection was onto the unit diagonal: scale a semidefinite matrix instead, exactly valid
    values, vectors = np.linalg.eigh(y)
    y = (vectors * np.maximum(values, 0.0)) @ vectors.T
    scale = np.sqrt(np.diag(y))
    y = y / np.outer(scale, scale)
    np.fill_diagonal(y, 1.0)
    change = np.abs(y - given)
    np.fill_diagonal(change, 0.0)
    i, j = np.unravel_index(int(np.argmax(change)), change.shape)
    off = ~np.eye(len(given), dtype=bool)
    rms = float(np.sqrt(np.mean(change[off] ** 2))) if off.any() else 0.0
    return Repair(y, float(change.max()), rms, (int(i), int(j)), float(eigenvalues.min()))
