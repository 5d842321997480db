"""Exact steps of a noise-driven linear system between grid points, by matrix exponentials.

Over a substep h the state matrix is held in the manner of Magnus to fourth order (two Gauss points and their
commutator; Blanes, Casas, Oteo and Ros, Physics Reports 470, 2009, section 5.4), which takes one matrix exponential,
by scaling and squaring: many small ones at once, where SciPy's expm takes them one by one. The covariance that the
noise adds, the integral of e^(A u) B B' e^(A' u) over the substep, is taken by Gauss-Legendre quadrature over the
2^-m part of it and doubled m times: Q(2 d) = Q(d) + Phi(d) Q(d) Phi(d)'. Substeps compose without error. Nothing here
integrates a differential equation, and no code is shared with the adjoint, CVODES or the sweep.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from ...codegen.ensemble.simulation import Steps
from ...codegen.system.evaluation import MatrixEvaluator
from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import state_scales
from ...model.errors import IntegrationError
from .time_nodes import Interval, interval_before, intervals, time_nodes

LARGEST_NORM = 1.0  # of an exponent whose series is summed; with TERMS terms it leaves 1e-13
TERMS = 15
MOST_SUBSTEPS = 200_000
TOGETHER = 64  # substeps computed at once: their matrices stay in the second-level cache
NOT_FINITE = (
    "the state matrix is not finite somewhere on this flight; see what divides by zero there, or which table holds an "
    "impossible value (see 'ascentwind inspect')"
)
GAUSS = (0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6)
MISSED = 1e-4  # of the exponent of a substep, by a straight line through the Gauss points
NOISE_CHANGE = 0.05  # of the noise matrix within a substep; what is added goes by its square, in the middle
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True, eq=False)
class Discretisation:
    """Steps, and the mean that goes with them.

    Attributes
    ----------
    times : (k,) array
        Ends of the steps, s.
    steps : Steps
        In states balanced by scales of their own.
    added : (k, sources, n, n) array
        Covariance that each source adds in a step, scaled.
    mean : (k, n_y) array
        Response to the known inputs alone.
    """

    times: NDArray[np.float64]
    steps: Steps
    added: NDArray[np.float64]
    mean: NDArray[np.float64]

    def variance(self) -> NDArray[np.float64]:
        """Return the variance of the responses that infinitely many runs would have, (k, n_y, sources)."""
        P = self.steps.start @ self.steps.start.transpose(0, 2, 1)
        found = []
        for Phi, Q, C in zip(self.steps.transition, self.added, self.steps.output, strict=True):
            P = Phi @ P @ Phi.T + Q
            found.append(np.einsum("ri,sij,rj->rs", C, P, C))
        return np.array(found)


@dataclass(frozen=True, eq=False)
class ExactSteps:
    """Steps from one time to the next, of states divided by scales of their own, and the outputs at their ends.

    Attributes
    ----------
    scale : (n,) array
    transition : (k, n, n) array
    added : (k, sources, n, n) array
    forced : (k, n) array
        What the known inputs add.
    output : (k, n_y, n) array
    direct : (k, n_y) array
        Of the known inputs in the outputs.
    """

    scale: NDArray[np.float64]
    transition: NDArray[np.float64]
    added: NDArray[np.float64]
    forced: NDArray[np.float64]
    output: NDArray[np.float64]
    direct: NDArray[np.float64]


def discretise(executable: ExecutableSystem, times: Sequence[float], substep: float) -> Discretisation:
    """Return the exact steps from the start of the system through ``times``.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : sequence of float
        Grid points after the start, increasing, s; one on a discontinuity is taken from the left.
    substep : float
        Largest span over which the matrices are taken as linear in time, s; where they are not, it is halved.

    Raises
    ------
    IntegrationError
        If the system grows beyond the range of numbers.
    """
    found = exact_steps(executable, times, substep)
    mean, state = [], np.zeros(found.scale.size)
    for Phi, b, C, direct in zip(found.transition, found.forced, found.output, found.direct, strict=True):
        state = Phi @ state + b
        mean.append(C @ state + direct)
    start = [executable.system.start_covariance_matrix(s, executable.parameters) for s in executable.system.sources]
    relative = np.array(start).reshape(-1, *found.transition.shape[1:]) / np.outer(found.scale, found.scale)
    steps = Steps(symmetric_root(relative), found.transition, symmetric_root(found.added), found.output)
    return Discretisation(np.asarray(times, float), steps, found.added, np.array(mean))


def exact_steps(
    executable: ExecutableSystem, times: Sequence[float], substep: float, graded: bool = True
) -> ExactSteps:
    """Return the steps of :func:`discretise`; without ``graded``, substeps of one length, whatever they miss."""
    system, scale = executable.system, _balanced_scales(executable)
    n, s = len(system.states), len(system.sources)
    rates = MatrixEvaluator(executable, ("A", "B", "E", "inputs"))
    outputs = MatrixEvaluator(executable, ("C", "G", "inputs"))
    columns = [system.noise_columns(source) for source in system.sources]
    nodes = time_nodes(executable, times).tolist()
    pieces = [
        (number, interval)
        for number, (begin, end) in enumerate(pairwise([system.start, *nodes]))
        for interval in (intervals(executable, begin, end) if end > begin else [])
    ]
    substeps = _substeps(rates, [interval for _, interval in pieces], scale, columns, substep, graded)
    transition = np.tile(np.eye(n), (len(times), 1, 1))
    added, forced = np.zeros((len(times), s, n, n)), np.zeros((len(times), n))
    with np.errstate(over="ignore", invalid="ignore"):  # growth beyond numbers is reported below, with its time
        for (number, _), part in zip(pieces, substeps, strict=True):
            before = transition[number], added[number], forced[number]
            transition[number], added[number], forced[number] = _compose(before, part)
    C, direct = [], []
    for time, Phi, Q in zip(nodes, transition, added, strict=True):
        if not (np.isfinite(Phi).all() and np.isfinite(Q).all()):
            raise IntegrationError(
                f"the transition before {time:g} s left the range of numbers; the system grows without "
                "bound there or a table holds an impossible value (see 'ascentwind inspect')"
            )
        last = interval_before(executable, time)
        y, G, inputs = outputs(time, last.low, last.high)
        C.append(y * scale)
        direct.append(G @ inputs[:, 0])
    return ExactSteps(scale, transition, added, forced, np.array(C), np.array(direct))


def exact_transitions(executable: ExecutableSystem, pieces: Sequence[Interval]) -> NDArray[np.float64]:
    """Return the transition matrix over each of several short pieces of flight that hold no jump, (k, n, n).

    Parameters
    ----------
    executable : ExecutableSystem
    pieces : sequence of Interval
        Each a step, halved where the state matrix is not nearly linear over it.

    Raises
    ------
    IntegrationError
    """
    scale = _balanced_scales(executable)
    n = scale.size
    found = np.tile(np.eye(n), (len(pieces), 1, 1))
    leaves = _leaves(MatrixEvaluator(executable, ("A", "B", "E", "inputs")), list(pieces), scale, np.inf, True)
    while batch := list(islice(leaves, TOGETHER)):
        wide = np.array([leaf.span for leaf in batch])[:, None, None]
        first, second = (np.array([leaf.M[side, :n, :n] for leaf in batch]) for side in (0, 1))
        exponent = 0.5 * wide * (first + second) + np.sqrt(3) / 12 * wide**2 * (second @ first - first @ second)
        norm = np.abs(exponent).sum(axis=1).max()
        doublings = max(0, int(np.ceil(np.log2(max(norm, 1e-12) / LARGEST_NORM))))
        Phi = _exponential(exponent / 2**doublings, np.eye(n))
        for _ in range(doublings):
            Phi = Phi @ Phi
        for leaf, step in zip(batch, Phi, strict=True):
            found[leaf.piece] = step @ found[leaf.piece]
    if not np.isfinite(found).all():
        at = pieces[int(np.argmin(np.isfinite(found).all(axis=(1, 2))))]
        raise IntegrationError(f"the transition from {at.begin:g} s left the range of numbers")
    return found * (scale[:, None] / scale)


def _balanced_scales(executable: ExecutableSystem) -> NDArray[np.float64]:
    """Return scales of the states that make the state matrix small, so that exponentials need few squarings."""
    system, scale = executable.system, state_scales(executable.system)
    first = intervals(executable, system.start, min(system.end, system.start + 100.0))[0]
    (A,) = MatrixEvaluator(executable, ("A",))(0.5 * (first.begin + first.end), first.low, first.high)
    if not np.isfinite(A).all():
        raise IntegrationError(NOT_FINITE)
    _, (balance, _) = scipy.linalg.matrix_balance(A * scale / scale[:, None], permute=False, separate=True)
    return scale * balance


def _substeps(
    rates: MatrixEvaluator,
    pieces: list[Interval],
    scale: NDArray,
    columns: list[list[int]],
    substep: float,
    graded: bool,
) -> Iterator[tuple[NDArray, NDArray, NDArray]]:
    """Yield transition matrix, added covariances and added mean of each piece, which holds no jump."""
    n = scale.size
    needed = sum((p.end - p.begin) / substep for p in pieces)
    if needed > MOST_SUBSTEPS:
        raise IntegrationError(
            f"substeps of {substep:g} s make {needed:.3g} over the flight; choose longer ones, "
            f"{MOST_SUBSTEPS:,} at most"
        )
    leaves = _leaves(rates, pieces, scale, substep, graded)
    carried: dict[int, tuple[NDArray, ...]] = {}
    done = 0
    while batch := list(islice(leaves, TOGETHER)):
        of = np.array([leaf.piece for leaf in batch])
        wide = np.array([leaf.span for leaf in batch])[:, None, None]
        M, B = (np.stack([getattr(leaf, name) for leaf in batch], axis=1) for name in ("M", "B"))
        M = _with_straight_inputs(M, wide)
        exponent = 0.5 * wide * (M[0] + M[1]) + np.sqrt(3) / 12 * wide**2 * (M[1] @ M[0] - M[0] @ M[1])
        Phi, Q = _added_covariance(exponent, 0.5 * (B[0] + B[1]) * np.sqrt(wide), columns)
        for piece in np.unique(of):
            forced = Phi[:, :n, n + 1] - 0.5 * Phi[:, :n, n]
            part = tuple(x[of == piece] for x in (Phi[:, :n, :n], Q, forced))
            while (count := part[0].shape[0]) > 1:
                even = count - count % 2
                pairs = _compose(tuple(x[:even:2] for x in part), tuple(x[1:even:2] for x in part))
                part = tuple(np.concatenate([x, y[even:]]) for x, y in zip(pairs, part, strict=True))
            one = tuple(x[0] for x in part)
            carried[piece] = _compose(carried[piece], one) if piece in carried else one
        while done < of[-1]:  # the last may go on in the next batch
            yield carried.pop(done)  # type: ignore[misc]
            done += 1
    if done in carried:
        yield carried.pop(done)  # type: ignore[misc]


def _with_straight_inputs(M: NDArray[np.float64], wide: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return matrices (2, k, n + 2, n + 2) of the states, the part of the substep gone from its middle, and one.

    Known inputs are straight lines through both Gauss points. Averages of them would do for slow states only: what is
    fast against the substep, such as the delay of a gust from zone to zone, follows them as they rise.
    """
    n = M.shape[-1] - 1
    found = np.zeros((*M.shape[:2], n + 2, n + 2))
    found[..., :n, :n] = M[..., :n, :n]
    found[..., :n, n] = np.sqrt(3) * (M[1, :, :n, n] - M[0, :, :n, n])
    found[..., :n, n + 1] = 0.5 * (M[0, :, :n, n] + M[1, :, :n, n])
    found[..., n, n + 1] = 1 / wide[:, 0, 0]
    return found


@dataclass(frozen=True, eq=False)
class _Leaf:
    """A substep of a piece: its span, and at its two Gauss points the state matrix with the known inputs, and B."""

    piece: int
    span: float
    M: NDArray[np.float64]
    B: NDArray[np.float64]


def _leaves(
    rates: MatrixEvaluator, pieces: list[Interval], scale: NDArray, substep: float, graded: bool
) -> Iterator[_Leaf]:
    """Yield substeps in order of time; ``graded`` halves those over which the matrices are not nearly linear.

    A is looked at in the middle as well: what it is off its mean of the Gauss points, times the span, is the part of
    the exponent that a straight line misses. The noise matrix is held, so that it may change by a part only.
    """
    n = scale.size

    def at(time: float, piece: Interval) -> tuple[NDArray, NDArray]:
        A, noise, E, inputs = rates(time, piece.low, piece.high)
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[:n, n] = A * scale / scale[:, None], E @ inputs[:, 0] / scale
        return M, noise / scale[:, None]

    made = 0
    for number, piece in enumerate(pieces):
        count = 2 ** max(0, int(np.ceil(np.log2(max(1.0, (piece.end - piece.begin) / substep)) - 1e-9)))
        edges = np.linspace(piece.begin, piece.end, count + 1)
        waiting = list(pairwise(edges.tolist()))[::-1]
        while waiting:
            begin, end = waiting.pop()
            span, middle = end - begin, 0.5 * (begin + end)
            (M0, B0), (M1, B1) = (at(begin + offset * span, piece) for offset in GAUSS)
            if graded:
                missed = span * np.abs(at(middle, piece)[0] - 0.5 * (M0 + M1))[:n, :n].sum(axis=1).max(initial=0.0)
                change = np.abs(B1 - B0).max(initial=0.0) > NOISE_CHANGE * np.abs(B0 + B1).max(initial=0.0)
                if not np.isfinite(missed):
                    raise IntegrationError(f"{NOT_FINITE}, near {middle:g} s")
                if missed > MISSED or change:
                    made += 1
                    if made > MOST_SUBSTEPS or span < 1e-12 * (piece.end - piece.begin):
                        raise IntegrationError(
                            f"the matrices change too fast near {middle:g} s for exact steps; look for a singularity "
                            "or a jump that is not declared, or use another engine"
                        )
                    waiting += [(middle, end), (begin, middle)]
                    continue
            yield _Leaf(number, span, np.stack([M0, M1]), np.stack([B0, B1]))


def _added_covariance(
    exponent: NDArray, B: NDArray, columns: list[list[int]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return e^exponent (k, n + 2, n + 2) and the covariances (k, sources, n, n) added over a substep.

    ``B`` comes multiplied by the square root of the span.
    """
    n = B.shape[1]
    norm = np.abs(exponent[:, :n, :n]).sum(axis=1).max()
    if not np.isfinite(norm):
        raise IntegrationError(NOT_FINITE)
    doublings = max(0, int(np.ceil(np.log2(max(norm, 1e-12) / LARGEST_NORM))))
    part = exponent / 2**doublings
    Q = np.zeros((B.shape[0], len(columns), n, n))
    for point, weight in zip(POINTS, WEIGHTS, strict=True):
        carried = _exponential(0.5 * (1 + point) * part[:, :n, :n], B)
        for s, of_source in enumerate(columns):
            b = carried[:, :, of_source]
            Q[:, s] += 0.5 * weight / 2**doublings * (b @ b.transpose(0, 2, 1))
    Phi = _exponential(part, np.eye(n + 2))
    for _ in range(doublings):
        A = Phi[:, None, :n, :n]
        Q = Q + A @ Q @ A.swapaxes(2, 3)
        Phi = Phi @ Phi
    return Phi, Q


def _exponential(X: NDArray, on: NDArray) -> NDArray[np.float64]:
    """Return e^X ``on`` for many small matrices by the Taylor series."""
    found = on + X @ on / TERMS
    for k in range(TERMS - 1, 0, -1):
        found = on + X @ found / k
    return found


def _compose(first: tuple[NDArray, ...], second: tuple[NDArray, ...]) -> tuple[NDArray, NDArray, NDArray]:
    """Return one step out of two (or arrays of them)."""
    (Phi1, Q1, b1), (Phi2, Q2, b2) = first, second
    A = Phi2[..., None, :, :]
    return Phi2 @ Phi1, A @ Q1 @ A.swapaxes(-1, -2) + Q2, (Phi2 @ b1[..., None])[..., 0] + b2


def symmetric_root(Q: NDArray) -> NDArray[np.float64]:
    """Return the symmetric square roots of covariance matrices; unlike other roots they are unique."""
    size = np.sqrt(np.maximum(np.einsum("...ii->...i", Q), 0.0))
    unit = np.where(size > 0, size, 1.0)
    weight = unit[..., :, None] * unit[..., None, :]
    values, vectors = np.linalg.eigh(0.5 * (Q + Q.swapaxes(-1, -2)) / weight)
    root = (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]) @ vectors.swapaxes(-1, -2)
    root = unit[..., :, None] * root
    root[(Q == 0).all(axis=-1)] = 0.0
    return np.where((Q == 0).all(axis=-2)[..., None, :], 0.0, root)
