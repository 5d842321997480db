"""Gauss-Legendre collocation of the linear system and its adjoint on one grid.

Three stages, order six, A-stable and symplectic: it keeps quadratic invariants, so that the discrete adjoint of the
method is the method applied to the adjoint, and a gradient computed with it is the exact derivative of the
discretised variance (Sanz-Serna 2016, SIAM Review 58, 3-33).
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from ..model.errors import IntegrationError
from ..model.system import LinearSystem
from ..model.tables import TableGroup

STEP = 0.05  # s, the longest
PHASE = 0.35  # rad, the longest step of the fastest lightly damped root: its error is then 6e-9 rad
LIGHT = 0.3  # damping ratio below which a root rings on through the flight
FIRST_STEP = 5e-4  # s, beside the ends and discontinuities, where filter poles near 100 rad/s leave fast transients
GROWTH = 0.15  # of the step with distance from there, s/s

_factorise, _solve = get_lapack_funcs(("getrf", "getrs"), dtype=np.float64)
_R = np.sqrt(15.0)
NODES = np.array([0.5 - _R / 10, 0.5, 0.5 + _R / 10])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18
STAGES = np.array(
    [
        [5 / 36, 2 / 9 - _R / 15, 5 / 36 - _R / 30],
        [5 / 36 + _R / 24, 2 / 9, 5 / 36 - _R / 24],
        [5 / 36 + _R / 30, 2 / 9 + _R / 15, 5 / 36],
    ]
)


@dataclass(frozen=True, eq=False)
class Grid:
    """Steps from the start of a system to t2.

    Attributes
    ----------
    edges : (k + 1,) array
        s.
    """

    edges: NDArray[np.float64]

    @property
    def steps(self) -> NDArray[np.float64]:
        return np.diff(self.edges)

    @property
    def nodes(self) -> NDArray[np.float64]:
        """Collocation times, (k, 3)."""
        return self.edges[:-1, None] + self.steps[:, None] * NODES

    @property
    def weights(self) -> NDArray[np.float64]:
        """Quadrature weights of the nodes, s, (k, 3)."""
        return self.steps[:, None] * WEIGHTS


def collocation_grid(system: LinearSystem, groups: Sequence[TableGroup], end: float, step: float = STEP) -> Grid:
    """Return a grid whose steps end on discontinuities and table knots and are short beside the former and the ends.

    Tables are cubic between knots and less smooth across them; a step that held a knot would lose its order.
    """
    begin = system.start
    ends = [begin, *(d for d in system.discontinuities if begin < d < end), end]
    edges = [np.array([begin])]
    knots = _knot_times(groups, begin, end, step)
    for low, high in pairwise(ends):
        breaks = np.concatenate([[low], knots[(knots > low + FIRST_STEP) & (knots < high - FIRST_STEP)], [high]])
        marks = _steps_from_edge(breaks, low, high, step)
        for a, b in pairwise(marks):
            count = max(1, int(np.ceil(b - a - 1e-9)))
            edges.append(_time_at(np.linspace(a, b, count + 1)[1:], low, high, step))
        edges[-1][-1] = high
    return Grid(np.concatenate(edges))


def longest_step(matrices: NDArray[np.float64]) -> float:
    """Return the longest step (s) that follows the lightly damped roots of state matrices (k, n, n)."""
    roots = np.linalg.eigvals(matrices).ravel()
    ringing = np.abs(roots[-roots.real < LIGHT * np.abs(roots)])
    return float(min(STEP, PHASE / max(ringing.max(initial=0.0), PHASE / STEP)))


def _steps_from_edge(times: NDArray, low: float, high: float, step: float) -> NDArray:
    """Return how many steps lie between ``low`` and each time, a smooth and increasing function."""
    middle = 0.5 * (low + high)
    from_edge = _count(np.minimum(times - low, high - times), step)
    return np.where(times <= middle, from_edge, 2 * _count(np.array(middle - low), step) - from_edge)


def _count(distance: NDArray, step: float) -> NDArray:
    reach = (step - FIRST_STEP) / GROWTH
    near = np.log1p(GROWTH * np.minimum(distance, reach) / FIRST_STEP) / GROWTH
    return near + np.maximum(distance - reach, 0.0) / step


def _time_at(count: NDArray, low: float, high: float, step: float) -> NDArray:
    total = 2 * float(_count(np.array(0.5 * (high - low)), step))
    from_edge = np.minimum(count, total - count)
    reach = (step - FIRST_STEP) / GROWTH
    most = float(_count(np.array(reach), step))
    near = np.expm1(GROWTH * np.minimum(from_edge, most)) * FIRST_STEP / GROWTH
    distance = near + np.maximum(from_edge - most, 0.0) * step
    return np.where(count <= 0.5 * total, low + distance, high - distance)


def _knot_times(groups: Sequence[TableGroup], begin: float, end: float, step: float) -> NDArray:
    """Return the times at which a table passes a knot; a group sampled as finely as the steps is smooth for them."""
    found = [np.zeros(0)]
    fine = np.linspace(begin, end, 2 + int((end - begin) / (0.25 * step)))
    for group in groups:
        if np.median(np.diff(group.knots)) <= step and group.argument == "time":
            continue
        if group.argument == "time":
            found.append(group.knots)
            continue
        argument = _values(groups, group.argument, fine)
        passed = (argument[:-1, None] < group.knots) != (argument[1:, None] < group.knots)
        step_of, knot_of = np.nonzero(passed)
        low, high, knot = fine[step_of], fine[step_of + 1], group.knots[knot_of]
        f_low, f_high = argument[step_of] - knot, argument[step_of + 1] - knot
        for _ in range(3):  # secants: the table is nearly straight over a quarter of a step
            rise = np.where(f_high == f_low, np.inf, f_high - f_low)
            low, high, f_low = high, high - f_high * (high - low) / rise, f_high
            f_high = _values(groups, group.argument, high) - knot
        found.append(high)
    times = np.unique(np.concatenate(found))
    times = times[(times > begin) & (times < end)]
    return times[np.concatenate([[True], np.diff(times) > FIRST_STEP])] if times.size else times


def _values(groups: Sequence[TableGroup], name: str, times: NDArray) -> NDArray[np.float64]:
    return tables_at(groups, times)[:, [n for g in groups for n in g.names].index(name)]


def tables_at(groups: Sequence[TableGroup], times: NDArray) -> NDArray[np.float64]:
    """Return all table values at many times, (k, n_v)."""
    found, names = [np.zeros((times.size, 0))], []
    for group in groups:
        known = np.concatenate(found, axis=1)
        argument = times if group.argument == "time" else known[:, names.index(group.argument)]
        found.append(group.evaluate(argument))
        names += group.names
    return np.concatenate(found, axis=1)


class Collocation:
    """The system and its adjoint on a grid by LAPACK: every step factorised once, solved forward and backward.

    Parameters
    ----------
    grid : Grid
    A : (k, 3, n, n) array
        State matrix at the nodes.

    Raises
    ------
    IntegrationError
    """

    def __init__(self, grid: Grid, A: NDArray[np.float64]):
        self.grid = grid
        k, n = A.shape[0], A.shape[-1]
        self._n, self._A = n, A
        # N = I - h A (a x I), the equations of the stage derivatives
        blocks = -grid.steps[:, None, None, None, None] * STAGES[:, None, :, None] * self._A[:, :, :, None, :]
        matrices = blocks.reshape(k, 3 * n, 3 * n)
        matrices[:, np.arange(3 * n), np.arange(3 * n)] += 1.0
        self._factors = []
        for step, matrix in enumerate(matrices):
            lu, pivots, info = _factorise(matrix.T)  # of the transpose, whose memory order LAPACK takes as it is
            if info != 0:
                raise IntegrationError(f"the collocation equations are singular at {grid.edges[step]:g} s")
            self._factors.append((lu, pivots))

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve x' = A x + f.

        Parameters
        ----------
        start : (n,) array
        forcing : (k, 3, n) array
            At the nodes.

        Returns
        -------
        stages : (k, 3, n) array
        end : (n,) array
        """
        x, stages = start, np.empty_like(forcing)
        for step, h in enumerate(self.grid.steps):
            lu, pivots = self._factors[step]
            right = (self._A[step] @ x + forcing[step]).ravel()
            rates = _solve(lu, pivots, right, trans=1)[0].reshape(3, self._n)
            stages[step] = x + h * (STAGES @ rates)
            x = x + h * (WEIGHTS @ rates)
        return stages, x

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        """Solve a' = -A' a - f from the end.

        Returns
        -------
        stages : (k, 3, n) array
        start : (n,) array
        """
        a, stages = end, np.empty((self.grid.steps.size, 3, self._n))
        for step in reversed(range(self.grid.steps.size)):
            h, (lu, pivots) = self.grid.steps[step], self._factors[step]
            right = np.outer(WEIGHTS, a) + h * STAGES.T @ (WEIGHTS[:, None] * forcing[step])
            weighted = _solve(lu, pivots, right.ravel(), trans=0)[0].reshape(3, self._n)
            stages[step] = weighted / WEIGHTS[:, None]
            a = a + h * (np.einsum("iab,ia->b", self._A[step], weighted) + WEIGHTS @ forcing[step])
        return stages, a


class CompiledCollocation:
    """The same in C, which skips the zeros of A; arguments and results as :class:`Collocation`."""

    def __init__(self, grid: Grid, A: NDArray[np.float64], library: Path):
        k, n = A.shape[0], A.shape[-1]
        self._code = ctypes.CDLL(str(library))
        self._shape = (k, 3, n)
        factors, pivots = np.empty((k, 3 * n, 3 * n)), np.empty((k, 3 * n), np.intc)
        given = (np.ascontiguousarray(grid.steps), np.ascontiguousarray(A), np.append(STAGES.ravel(), WEIGHTS))
        self._arrays = (*given, factors, pivots)
        self._sizes = (ctypes.c_long(k), ctypes.c_long(n))
        self._code.collocation_factorise.restype = ctypes.c_long
        failed = self._code.collocation_factorise(*self._sizes, *map(_pointer, self._arrays))
        if failed:
            raise IntegrationError(f"the collocation equations are singular at {grid.edges[failed - 1]:g} s")

    def forward(self, start: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve(self._code.collocation_forward, start, forcing)

    def backward(self, end: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        return self._solve(self._code.collocation_backward, end, forcing)

    def _solve(self, code: Any, first: NDArray, forcing: NDArray) -> tuple[NDArray, NDArray]:
        state, stages = np.array(first, float), np.empty(self._shape)
        arrays = (np.ascontiguousarray(forcing), state, stages, np.empty(3 * self._shape[2]))
        code.restype = None
        code(*self._sizes, *map(_pointer, (*self._arrays, *arrays)))
        return stages, state


def _pointer(array: NDArray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def collocation(grid: Grid, A: NDArray[np.float64], library: Path | None) -> Collocation | CompiledCollocation:
    """Return the solver of a grid, compiled where there is a library."""
    return Collocation(grid, A) if library is None else CompiledCollocation(grid, A, library)
