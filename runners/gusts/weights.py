"""Weighting functions of the wind: what an impulse of wind at t puts into responses at t2, between points too.

A row c of the states at t2 and its adjoint lambda(t) = Phi(t2, t)' c give g(t) = lambda' E, smooth between the jumps
of a flight, and the wind at t2 itself the weight G. With gust penetration each zone of the vehicle would have its own
column of E and G, and its own delay; here the whole vehicle feels the wind at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from ...codegen.system.evaluation import MatrixEvaluator
from ..case.case import Case
from ..solvers.discretisation import exact_transitions
from ..solvers.time_nodes import Interval, interval_before, intervals, time_nodes

SPACING, RADIANS = 0.02, 0.4  # s, and of the fastest oscillation, at most, between points
FINER, FINE = 4, 0.2  # times finer in the last seconds before t2, where what decays fast has not decayed
DEGREE = 5  # of the splines between points


@dataclass(frozen=True, eq=False)
class WindWeights:
    """Weights of the wind for r quantities at one time.

    Attributes
    ----------
    time : float
        t2, s.
    pieces : tuple of BSpline
        g(t2, t) between jumps of the flight, (..., r) per m, in order of time.
    edges : (pieces + 1,) array
        s; the first is where the weights begin, the last t2.
    direct : (r,) array
        Weight of the wind at t2 itself.
    """

    time: float
    pieces: tuple[BSpline, ...]
    edges: NDArray[np.float64]
    direct: NDArray[np.float64]

    @property
    def begin(self) -> float:
        """Where they begin, s."""
        return float(self.edges[0])

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return g(t2, t) at times (k,) between ``begin`` and t2, from the left where it jumps, (k, r)."""
        which = np.clip(np.searchsorted(self.edges, times) - 1, 0, len(self.pieces) - 1)
        found = np.zeros((times.size, self.direct.size))
        for number, piece in enumerate(self.pieces):
            found[which == number] = piece(times[which == number])
        return found


def spacing_of(case: Case, begin: float, end: float) -> float:
    """Return the distance of points (s) that the fastest oscillation between two flight times (s) asks for."""
    fastest = max(float(np.linalg.eigvals(case.matrices(t)[0]).imag.max()) for t in np.linspace(begin, end, 5))
    return min(SPACING, RADIANS / fastest) if fastest > 0 else SPACING


def wind_weights(
    case: Case, times: Sequence[float], responses: Sequence[str], reach: float, spacing: float | None = None
) -> list[WindWeights]:
    """Return the weights of responses at many times, kept with the case.

    Parameters
    ----------
    case : Case
    times : sequence of float
        t2, increasing, s.
    responses : sequence of str
    reach : float
        How far back from each, s; not beyond the start of the flight.
    spacing : float, optional
        Largest distance between points, s; what the system's oscillations ask for without it.

    Raises
    ------
    TimeRangeError, IntegrationError
    """
    rows = [case.system.output_index(name) for name in responses]
    question = ("wind weights", tuple(times), tuple(responses), reach, spacing)
    return case.kept(question, lambda: _weights_of_outputs(case, times, rows, reach, spacing))


def _weights_of_outputs(
    case: Case, times: Sequence[float], rows: list[int], reach: float, spacing: float | None
) -> list[WindWeights]:
    executable, wind = case.with_means, case.wind_input("a gust")
    evaluate = MatrixEvaluator(executable, ("C", "G"))
    ends = []
    for node in time_nodes(executable, times):
        here = interval_before(executable, float(node))
        C, G = evaluate(float(node), here.low, here.high)
        ends.append((C[rows], G[rows, wind]))
    return weights_of_rows(case, times, ends, reach, spacing)


def weights_of_rows(
    case: Case,
    times: Sequence[float],
    ends: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    reach: float,
    spacing: float | None = None,
) -> list[WindWeights]:
    """Return the weights of any quantities that are rows of the states and of the wind.

    Parameters
    ----------
    case, times, reach, spacing
        As for :func:`wind_weights`.
    ends : sequence of (array, array)
        Rows (r, n) of the states and (r,) of the wind, at each time.

    Raises
    ------
    TimeRangeError, IntegrationError
    """
    nodes = time_nodes(case.with_means, times)
    begins = np.maximum(case.system.start, nodes - reach)
    found: list[WindWeights] = []
    groups = np.split(np.arange(nodes.size), 1 + np.flatnonzero(begins[1:] > nodes[:-1]))  # those that share points
    for group in groups:
        begin = float(begins[group[0]])
        step = spacing or spacing_of(case, begin, float(nodes[group[-1]]))
        grid = WeightGrid.of(case, begin, nodes[group], step)
        found += [grid.weights(float(nodes[k]), float(begins[k]), *ends[k]) for k in group]
    return found


@dataclass(frozen=True, eq=False)
class WeightGrid:
    """Points of a part of the flight, and what carries weights from one to the one before.

    Attributes
    ----------
    times : (m,) array
        s; all jumps of the flight are among them.
    pieces : tuple of Interval
        Between jumps.
    transition : (m - 1, n, n) array
        Phi of each step.
    inputs : tuple of (k, n) arrays
        E of the wind at the points of each piece, its ends from inside.
    """

    times: NDArray[np.float64]
    pieces: tuple[Interval, ...]
    transition: NDArray[np.float64]
    inputs: tuple[NDArray[np.float64], ...]

    @classmethod
    def of(cls, case: Case, begin: float, nodes: NDArray[np.float64], spacing: float) -> WeightGrid:
        """Return points at most ``spacing`` (s) apart from ``begin`` (s) on, the nodes (s) among them."""
        executable, wind = case.with_means, case.wind_input("a gust")
        pieces = tuple(intervals(executable, begin, float(nodes[-1]))) if nodes[-1] > begin else ()
        marks = np.unique([begin, *nodes.tolist(), *(piece.end for piece in pieces)])
        parts = []
        for a, b in pairwise(marks):
            last = max(a, b - FINE) if b in nodes else b
            for low, high, step in ((a, last, spacing), (last, b, spacing / FINER)):
                parts.append(np.linspace(low, high, int(np.ceil((high - low) / step - 1e-9)) + 1)[:-1])
        times = np.concatenate([*parts, marks[-1:]])
        steps, inputs = [], []
        for piece in pieces:
            at = times[(times >= piece.begin) & (times <= piece.end)]
            steps += [Interval(a, b, piece.low, piece.high) for a, b in pairwise(at.tolist())]
            inputs.append(executable.input_matrices(at, piece.low, piece.high)[1][:, :, wind])
        n = len(case.system.states)
        transition = exact_transitions(executable, steps) if steps else np.zeros((0, n, n))
        return cls(times, pieces, transition, tuple(inputs))

    def adjoint(self, rows: NDArray[np.float64], last: int, first: int = 0) -> NDArray[np.float64]:
        """Return rows (r, n) of the states at point ``last`` carried back to each point, (last - first + 1, r, n)."""
        found = [rows]
        for Phi in self.transition[first:last][::-1]:
            found.append(found[-1] @ Phi)
        return np.array(found[::-1])

    def weights(self, node: float, begin: float, rows: NDArray[np.float64], direct: NDArray[np.float64]) -> WindWeights:
        """Return the weights at a node (s), from ``begin`` (s) on, of rows (r, n) of the states, (r,) of the wind."""
        last = int(np.searchsorted(self.times, node))
        first = max(0, int(np.searchsorted(self.times, begin, side="right")) - 1)
        adjoint, splines, edges = self.adjoint(rows, last, first), [], [float(self.times[first])]
        for piece, E in zip(self.pieces, self.inputs, strict=True):
            whole = np.flatnonzero((self.times >= piece.begin) & (self.times <= piece.end))
            mine = (whole >= first) & (whole <= last)
            if mine.sum() < 2:
                continue
            at = self.times[whole[mine]]
            values = np.einsum("krn,kn->kr", adjoint[whole[mine] - first], E[mine])
            splines.append(make_interp_spline(at, values, k=DEGREE if at.size > DEGREE else 1))
            edges.append(float(at[-1]))
        return WindWeights(node, tuple(splines), np.array(edges), direct)
