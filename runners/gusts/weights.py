"""Weighting functions of the wind: what an impulse of wind at t puts into responses at t2, between points too.

A row c of the states at t2 and its adjoint lambda(t) = Phi(t2, t)' c give g(t) = lambda' E, smooth between the jumps
of a flight, and the wind at t2 itself the weight G. A vehicle in both planes has them for both components of the wind,
one after the other for each quantity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly, make_interp_spline

from ...codegen.system.evaluation import MatrixEvaluator
from ..case.case import Case
from ..solvers.discretisation import exact_transitions
from ..solvers.time_nodes import Interval, interval_before, intervals, time_nodes

SPACING, RADIANS = 0.02, 0.25  # s, and of the fastest oscillation that lasts, at most, between points
FINER, FINE = 4, 0.2  # times finer in the last seconds before t2, where what decays fast has not decayed
LASTING = 20.0  # 1/s: what decays faster has points of its own close to t2, and none elsewhere
LAYER, SPREAD = 0.15, 36.0  # rad of such a mode between points at t2, and its decays in which they spread e-fold
IN_PIECE = 6  # steps in which the product is integrated at once there
DEGREE = 5  # of the splines between points


@dataclass(frozen=True, eq=False)
class WindWeights:
    """Weights of the wind for r quantities at one time; in both planes r counts each quantity twice, by components.

    Attributes
    ----------
    time : float
        t2, s.
    pieces : tuple of BSpline
        g(t2, t), (..., r) per m, in order of time; the same one several times where the flight does not jump but
        points get closer towards t2.
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

    @cached_property
    def polynomial(self) -> PPoly:
        """g(t2, t), (..., r), as one for all times between ``begin`` and t2 at which it does not jump."""
        breaks, parts = [self.edges[:1]], []
        for spline in dict.fromkeys(self.pieces):
            knots = np.unique(spline.t)
            powers = [spline(knots[:-1], k) / factorial(k) for k in range(spline.k, -1, -1)]
            parts.append(np.pad(powers, ((DEGREE - spline.k, 0), (0, 0), (0, 0))))
            breaks.append(knots[1:])
        if not parts:
            return PPoly(np.zeros((1, 1, self.direct.size)), self.edges[0] + np.array([0.0, 1.0]))
        return PPoly(np.concatenate(parts, axis=1), np.concatenate(breaks))

    def panels(self, longest: float, points: int) -> NDArray[np.float64]:
        """Return what to integrate at once of each piece, s: so many of its points at most, and ``longest`` (s)."""
        found = []
        for spline, low, high in zip(self.pieces, self.edges[:-1], self.edges[1:], strict=True):
            knots = spline.t[(spline.t >= low) & (spline.t <= high)]
            found.append(min(longest, points * float(np.diff(knots).max(initial=0.0)) or longest))
        return np.array(found)

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return g(t2, t) at times (k,) between ``begin`` and t2, from the left where it jumps, (k, r)."""
        which = np.clip(np.searchsorted(self.edges, times) - 1, 0, len(self.pieces) - 1)
        found = np.zeros((times.size, self.direct.size))
        for number, piece in enumerate(self.pieces):
            found[which == number] = piece(times[which == number])
        return found


def spacing_of(case: Case, begin: float, end: float) -> float:
    """Return the distance of points (s) that the fastest oscillation that lasts asks for between two times (s)."""
    modes = np.concatenate([np.linalg.eigvals(case.matrices(t)[0]) for t in np.linspace(begin, end, 5)])
    fastest = float(modes.imag[modes.real > -LASTING].max(initial=0.0))
    return min(SPACING, RADIANS / fastest) if fastest > 0 else SPACING


@dataclass(frozen=True, eq=False)
class Layer:
    """Points close to an end time.

    Attributes
    ----------
    points : (k,) array
        s, increasing to the end time.
    cuts : tuple of float
        Those between which an integral is taken at once, where points are closest, s.
    """

    points: NDArray[np.float64]
    cuts: tuple[float, ...]

    @classmethod
    def of(cls, case: Case, node: float, spacing: float) -> Layer:
        """Return points that grow apart to ``spacing`` (s).

        What a spline misses of a mode that decays fast does so too. Delays of gust zones that are metres apart are such
        modes, several of nearly the same rate.
        """
        modes = np.linalg.eigvals(case.matrices(node)[0])
        fast = modes[modes.real <= -LASTING]
        away, closest = [0.0], 0
        while True:
            step = spacing / FINER if away[-1] < FINE else spacing
            own = LAYER / np.abs(fast) * np.exp(np.minimum(-fast.real * away[-1] / SPREAD, 50.0))
            finest = float(own.min(initial=np.inf))
            if step == spacing and finest >= spacing:
                break
            closest += finest < FINER * step
            away.append(away[-1] + min(step, finest))
        return cls(node - np.array(away[::-1]), tuple(node - x for x in away[closest:0:-IN_PIECE]))


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
    executable, winds = case.with_means, case.wind_inputs("a gust")
    evaluate = MatrixEvaluator(executable, ("C", "G"))
    ends = []
    for node in time_nodes(executable, times):
        here = interval_before(executable, float(node))
        C, G = evaluate(float(node), here.low, here.high)
        ends.append((C[rows], G[np.ix_(rows, winds)]))
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
        Rows (r, n) of the states and (r, winds) of the wind or both its components, at each time.

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
    inputs : tuple of (k, n, winds) arrays
        E of the wind or both its components at the points of each piece, its ends from inside.
    layers : dict of float to Layer
        Of each node, s.
    """

    times: NDArray[np.float64]
    pieces: tuple[Interval, ...]
    transition: NDArray[np.float64]
    inputs: tuple[NDArray[np.float64], ...]
    layers: dict[float, Layer]

    @classmethod
    def of(cls, case: Case, begin: float, nodes: NDArray[np.float64], spacing: float) -> WeightGrid:
        """Return points at most ``spacing`` (s) apart from ``begin`` (s) on, the nodes (s) among them."""
        executable, winds = case.with_means, case.wind_inputs("a gust")
        pieces = tuple(intervals(executable, begin, float(nodes[-1]))) if nodes[-1] > begin else ()
        marks = np.unique([begin, *nodes.tolist(), *(piece.end for piece in pieces)])
        parts, layers = [], {float(node): Layer.of(case, float(node), spacing) for node in nodes}
        for a, b in pairwise(marks):
            close = layers[float(b)].points if b in nodes else np.array([b])
            close = close[close > a]
            parts.append(np.linspace(a, close[0], int(np.ceil((close[0] - a) / spacing - 1e-9)) + 1)[:-1])
            parts.append(close[:-1])
        times = np.concatenate([*parts, marks[-1:]])
        steps, inputs = [], []
        for piece in pieces:
            at = times[(times >= piece.begin) & (times <= piece.end)]
            steps += [Interval(a, b, piece.low, piece.high) for a, b in pairwise(at.tolist())]
            inputs.append(executable.input_matrices(at, piece.low, piece.high)[1][:, :, winds])
        n = len(case.system.states)
        transition = exact_transitions(executable, steps) if steps else np.zeros((0, n, n))
        return cls(times, pieces, transition, tuple(inputs), layers)

    def adjoint(self, rows: NDArray[np.float64], last: int, first: int = 0) -> NDArray[np.float64]:
        """Return rows (r, n) of the states at point ``last`` carried back to each point, (last - first + 1, r, n)."""
        found = [rows]
        for Phi in self.transition[first:last][::-1]:
            found.append(found[-1] @ Phi)
        return np.array(found[::-1])

    def weights(self, node: float, begin: float, rows: NDArray[np.float64], direct: NDArray[np.float64]) -> WindWeights:
        """Return the weights at a node (s), from ``begin`` (s) on, of rows of the states and the wind."""
        last = int(np.searchsorted(self.times, node))
        first = max(0, int(np.searchsorted(self.times, begin, side="right")) - 1)
        adjoint, splines, edges = self.adjoint(rows, last, first), [], [float(self.times[first])]
        for piece, E in zip(self.pieces, self.inputs, strict=True):
            whole = np.flatnonzero((self.times >= piece.begin) & (self.times <= piece.end))
            mine = (whole >= first) & (whole <= last)
            if mine.sum() < 2:
                continue
            at = self.times[whole[mine]]
            values = np.einsum("krn,knc->krc", adjoint[whole[mine] - first], E[mine]).reshape(at.size, -1)
            cut = [x for x in self.layers[node].cuts if at[0] < x < at[-1]]
            splines += [make_interp_spline(at, values, k=DEGREE if at.size > DEGREE else 1)] * (1 + len(cut))
            edges += [*cut, float(at[-1])]
        return WindWeights(node, tuple(splines), np.array(edges), direct.ravel())
