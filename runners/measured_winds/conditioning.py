"""What is known of a Gaussian vector when some linear combinations of it were measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

JITTER = (0.0, 1e-13, 1e-11, 1e-9)  # of a correlation of one, added to its diagonal where it has no Cholesky factor


@dataclass(frozen=True, eq=False)
class Measured:
    """Measurements z of covariance K, error included, and the gains that follow.

    Attributes
    ----------
    covariance : (k, k) array
        K = cov(z, z).
    """

    covariance: NDArray[np.float64]

    @cached_property
    def _root(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        size = np.sqrt(np.diagonal(self.covariance))
        unit = np.asarray(np.where(size > 0, size, 1.0), float)
        correlation = self.covariance / np.outer(unit, unit)
        for jitter in JITTER:
            try:
                return np.asarray(np.linalg.cholesky(correlation + jitter * np.eye(size.size)), float), unit, jitter
            except np.linalg.LinAlgError:
                continue
        values, vectors = np.linalg.eigh(correlation)
        roots = np.sqrt(np.maximum(values, JITTER[-1]))
        return np.linalg.qr((vectors * roots).T)[1].T, unit, JITTER[-1]

    @property
    def condition(self) -> float:
        """Of the correlation matrix of the measurements: what is lost of their digits."""
        unit = self._root[1]
        return float(np.linalg.cond(self.covariance / np.outer(unit, unit)))

    @property
    def jitter(self) -> float:
        """What was added to the diagonal of the correlation to have a factor: 0 where nothing was."""
        return self._root[2]

    def whitened(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return L^-1 values (k, ...) for K = L L'.

        With c' the covariances of what is wanted with z, whitened(c)' whitened(z) is what z lets expect of it, and
        whitened(c)' whitened(c) the variance that knowing z takes away.
        """
        factor, unit, _ = self._root
        wide = (values.T / unit).T
        return solve_triangular(factor, wide, lower=True, check_finite=False)
