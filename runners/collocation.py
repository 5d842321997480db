"""Gauss-Legendre collocation of the linear system and its adjoint on one grid.

Three stages, order six, A-stable and symplectic: it keeps quadratic invariants, so that the discrete adjoint of the
method is the method applied to the adjoint, and a gradient computed with it is the exact derivative of the
discretised variance (Sanz-Serna 2016, SIAM Review 58, 3-33).
"""

from __future__ import annotations

import ctypes
import logging
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from ..codegen.elimination import elimination_plan
from ..codegen.node_functions import NodeMatrix
from ..model.errors import IntegrationError
from .collocation_grid import WEIGHTS, Grid

log = logging.getLogger(__name__)

_factorise, _solve = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)
_R = np.sqrt(15.0)
STAGES = np.array(
    [
        [5 / 36, 2 / 9 - _R / 15, 5 / 36 - _R / 30],
        [5 / 36 + _R / 24, 2 / 9, 5 / 36 - _R / 24],
        [5 / 36 + _R / 30, 2 / 9 + _R / 15, 5 / 36],
    ]
)
SINGULAR = 1  # as in the template


class Collocation:
    """The system and its adjoint on a grid by LAPACK: every step factorised once, solved forward and backward.

    Parameters
    ----------
    grid : Grid
        Of k steps.
    A : NodeMatrix
        State matrix at the 3 k nodes.

    Raises
    ------
    IntegrationError
    """

    def __init__(self, grid: Grid, A: NodeMatrix):
        self.grid = grid
        k, n = grid.steps.size, A.pattern.size1()
        self._n, self._A = n, A.dense.reshape(k, 3, n, n)
        self._factors = []
        for step, h in enumerate(grid.steps):
            # N = I - h A (a x I), the equations of the stage derivatives
            blocks = -h * STAGES[:, None, :, None] * self._A[step][:, :, None, :]
            matrix = blocks.reshape(3 * n, 3 * n) + np.eye(3 * n)
            lu, pivots, info = _factorise(matrix.T)  # of the transpose, whose memory order LAPACK takes as it is
            if info != 0:
                raise IntegrationError(f"the collocation equations are singular at {grid.edges[step]:g} s")
            self._factors.append((lu, pivots))

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve x' = A x + f from the start of the grid.

        Parameters
        ----------
        start : (n,) array
        forcing : (s, 3, n) array
            At the nodes of the first s steps.

        Returns
        -------
        stages : (s, 3, n) array
        edges : (s + 1, n) array
            At the ends of the steps.
        """
        edges, stages = [start], np.empty_like(forcing)
        for step, force in enumerate(forcing):
            x, h, (lu, pivots) = edges[-1], self.grid.steps[step], self._factors[step]
            right = (self._A[step] @ x + force).ravel()
            rates = _solve(lu, pivots, right, trans=1)[0].reshape(3, self._n)
            stages[step] = x + h * (STAGES @ rates)
            edges.append(x + h * (WEIGHTS @ rates))
        return stages, np.array(edges)

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve a' = -A' a - f back from the end of step s to the start; arguments and results as above."""
        count = forcing.shape[0]
        stages, edges = np.empty_like(forcing), np.empty((count + 1, self._n))
        edges[count] = end
        for step in reversed(range(count)):
            a, h, (lu, pivots) = edges[step + 1], self.grid.steps[step], self._factors[step]
            right = np.outer(WEIGHTS, a) + h * STAGES.T @ (WEIGHTS[:, None] * forcing[step])
            weighted = _solve(lu, pivots, right.ravel(), trans=0)[0].reshape(3, self._n)
            stages[step] = weighted / WEIGHTS[:, None]
            edges[step] = a + h * (np.einsum("iab,ia->b", self._A[step], weighted) + WEIGHTS @ forcing[step])
        return stages, edges


class CompiledCollocation:
    """The same in C by sparse elimination without exchanges; where that fails, LAPACK takes over."""

    def __init__(self, grid: Grid, A: NodeMatrix, library: Path):
        self.grid, self.A = grid, A
        self._code = ctypes.CDLL(str(library))
        given = (elimination_plan(A.pattern), grid.steps, A.values, np.append(STAGES.ravel(), WEIGHTS))
        self._arrays = tuple(np.ascontiguousarray(x) for x in given)

    @cached_property
    def _with_exchanges(self) -> Collocation:
        return Collocation(self.grid, self.A)

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve("forward", start, forcing)

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve("backward", end, forcing)

    def _solve(self, direction: str, first: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        state, stages = np.array(first, float), np.empty(forcing.shape)
        edges = np.empty((forcing.shape[0] + 1, state.size))
        arrays = (*self._arrays, np.ascontiguousarray(forcing), state, stages, edges)
        code = getattr(self._code, f"collocation_{direction}")
        result = code(ctypes.c_long(forcing.shape[0]), *(x.ctypes.data_as(ctypes.c_void_p) for x in arrays))
        if result == SINGULAR:
            log.info("a pivot of the collocation is nearly singular: the equations are solved with exchanges")
            return getattr(self._with_exchanges, direction)(first, forcing)
        if result:
            raise IntegrationError("there is not enough memory for the collocation; free some")
        return stages, edges


def collocation(grid: Grid, A: NodeMatrix, library: Path | None) -> Collocation | CompiledCollocation:
    """Return the solver of a grid, compiled where there is a library."""
    return Collocation(grid, A) if library is None else CompiledCollocation(grid, A, library)
