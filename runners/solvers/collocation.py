"""Gauss-Legendre collocation of the linear system and its adjoint on one grid.

Four stages, order eight, A-stable and symplectic: it keeps quadratic invariants, so that the discrete adjoint of the
method is the method applied to the adjoint, and a gradient computed with it is the exact derivative of the
discretised variance (Sanz-Serna 2016, SIAM Review 58, 3-33).
"""

from __future__ import annotations

import logging
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from ...codegen.nodes.elimination import elimination_plan
from ...codegen.nodes.matrix import NodeMatrix
from ...codegen.sweep.gauss_legendre import FROM_STAGES, STAGES, TABLEAU, WEIGHTS
from ...codegen.toolchain.library import Library
from ...model.errors import IntegrationError
from .collocation_grid import Grid

log = logging.getLogger(__name__)

_factorise, _solve = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)


class Collocation:
    """The system and its adjoint on a grid by LAPACK: every step factorised once, solved forward and backward.

    Parameters
    ----------
    grid : Grid
        Of k steps.
    A : NodeMatrix
        State matrix at the 4 k nodes.

    Raises
    ------
    IntegrationError
    """

    def __init__(self, grid: Grid, A: NodeMatrix):
        self.grid = grid
        k, n = grid.steps.size, A.pattern.size1()
        self._n, self._A = n, A.dense.reshape(k, STAGES, n, n)
        self._factors = []
        for step, h in enumerate(grid.steps):
            # N = I - h A (a x I), the equations of the stage derivatives
            blocks = -h * TABLEAU[:, None, :, None] * self._A[step][:, :, None, :]
            matrix = blocks.reshape(STAGES * n, STAGES * n) + np.eye(STAGES * n)
            lu, pivots, info = _factorise(matrix.T)  # of the transpose, whose memory order LAPACK takes as it is
            if info != 0:
                raise IntegrationError(f"the collocation equations are singular at {grid.edges[step]:g} s")
            self._factors.append((lu, pivots))

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve x' = A x + f from the start of the grid.

        Parameters
        ----------
        start : (n,) array
        forcing : (s, 4, n) array
            At the nodes of the first s steps.

        Returns
        -------
        stages : (s, 4, n) array
        edges : (s + 1, n) array
            At the ends of the steps.
        """
        edges, stages = [start], np.empty_like(forcing)
        for step, force in enumerate(forcing):
            x, h, (lu, pivots) = edges[-1], self.grid.steps[step], self._factors[step]
            right = (self._A[step] @ x + force).ravel()
            rates = _solve(lu, pivots, right, trans=1)[0].reshape(STAGES, self._n)
            stages[step] = x + h * (TABLEAU @ rates)
            edges.append(x + h * (WEIGHTS @ rates))
        return stages, np.array(edges)

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve a' = -A' a - f back from the end of step s to the start; arguments and results as above."""
        count = forcing.shape[0]
        stages, edges = np.empty_like(forcing), np.empty((count + 1, self._n))
        edges[count] = end
        for step in reversed(range(count)):
            a, h, (lu, pivots) = edges[step + 1], self.grid.steps[step], self._factors[step]
            right = np.outer(WEIGHTS, a) + h * TABLEAU.T @ (WEIGHTS[:, None] * forcing[step])
            weighted = _solve(lu, pivots, right.ravel(), trans=0)[0].reshape(STAGES, self._n)
            stages[step] = weighted / WEIGHTS[:, None]
            edges[step] = a + h * (np.einsum("iab,ia->b", self._A[step], weighted) + WEIGHTS @ forcing[step])
        return stages, edges


class CompiledCollocation:
    """The same in C by sparse elimination without exchanges; where a pivot nearly vanishes, LAPACK takes over.

    Parameters
    ----------
    grid, A :
        As above.
    library : Library
    keep : bool
        Keep the factors of all steps (27 KB a step of AS-504), which pays for more than a few solutions. Without it
        every solution makes them again, step by step in the processor's cache.
    """

    def __init__(self, grid: Grid, A: NodeMatrix, library: Library, keep: bool = False):
        self.grid, self._A, self._keep = grid, A, keep
        self._library, plan = library, elimination_plan(A.pattern)
        tableau = np.concatenate([TABLEAU.T.ravel(), WEIGHTS, FROM_STAGES])
        factors = np.empty((grid.steps.size if keep else 1, plan[1], STAGES**2))
        self._arrays = (plan, grid.steps, np.ascontiguousarray(A.values), tableau, factors)
        self._regular = True
        if keep:
            steps = np.long(grid.steps.size)
            self._regular = bool(library.call("collocation_factorise", steps, *self._arrays))

    @cached_property
    def _exchanging(self) -> Collocation:
        log.info("a pivot of the collocation equations is nearly singular: solved by LAPACK, which exchanges rows")
        return Collocation(self.grid, self._A)

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve("collocation_forward", start, forcing) or self._exchanging.forward(start, forcing)

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve("collocation_backward", end, forcing) or self._exchanging.backward(end, forcing)

    def _solve(self, function: str, first: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray] | None:
        if not self._regular:
            return None
        state, stages = np.array(first, float), np.empty(forcing.shape)
        edges = np.empty((forcing.shape[0] + 1, state.size))
        *given, factors = self._arrays
        if not self._keep:
            factors = np.empty_like(factors)  # several threads may solve at once
        arrays = (np.ascontiguousarray(forcing), state, stages, edges, np.empty(STAGES * state.size))
        steps = np.long(forcing.shape[0])
        regular = self._library.call(function, steps, *given, factors, int(self._keep), *arrays)
        return (stages, edges) if regular else None


def collocation(
    grid: Grid, A: NodeMatrix, library: Library | None, keep: bool = False
) -> Collocation | CompiledCollocation:
    """Return the solver of a grid, compiled where there is a library."""
    return Collocation(grid, A) if library is None else CompiledCollocation(grid, A, library, keep)
