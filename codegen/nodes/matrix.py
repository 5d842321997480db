"""A matrix at many points: its structural nonzeros and where they stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class NodeMatrix:
    """A sparse matrix at many points.

    Attributes
    ----------
    pattern : Sparsity
    values : (k, nonzeros) array
        In the order of the pattern, column by column.
    """

    pattern: ca.Sparsity
    values: NDArray[np.float64]

    @cached_property
    def dense(self) -> NDArray[np.float64]:
        """All of it, (k, rows, columns)."""
        found = np.zeros((self.values.shape[0], *self.pattern.shape))
        found[:, self.pattern.row(), self.pattern.get_col()] = self.values
        return found

    def times(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the products with vectors (k, columns), shape (k, rows)."""
        return self._product(x, self.pattern.size1(), self.pattern.row(), self.pattern.get_col())

    def transposed_times(self, a: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the products of the transpose with vectors (k, rows), shape (k, columns)."""
        return self._product(a, self.pattern.size2(), self.pattern.get_col(), self.pattern.row())

    def _product(self, x: NDArray, size: int, to: list[int], of: list[int]) -> NDArray[np.float64]:
        found = np.zeros((size, x.shape[0]))
        for k, (i, j) in enumerate(zip(to, of, strict=True)):
            found[i] += self.values[:, k] * x[:, j]
        return np.ascontiguousarray(found.T)

    def first(self, count: int) -> NodeMatrix:
        """Return the matrix at the first ``count`` points."""
        return NodeMatrix(self.pattern, self.values[:count])
