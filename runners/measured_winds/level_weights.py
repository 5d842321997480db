"""What the wind at each of some levels puts into responses: the weighting functions, integrated over profiles.

A profile that is straight between its levels is W(h) = sum of w_i phi_i(h), phi_i one at level i and zero at all
others, so that with the weighting function g and the direct weight G a response is linear in its levels,

    y(t2) = rest(t2) + sum of A_i(t2) w_i,   A_i(t2) = integral of g(t2, t) phi_i(h(t)) dt + G phi_i(h(t2)),

rest what the other known inputs do. All end times share one pass up the flight: the columns of responses x_i to phi_i
are carried from step to step exactly, x' = A x + E phi_i, by one exponential of Magnus' method of fourth order a step
with the powers 1, s and s^2 / 2 of the time in it as further states; phi_i is linear in altitude, and altitude
quadratic in a step. Once there, any number of profiles costs a product of matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.evaluation import MatrixEvaluator
from ...codegen.system.functions import state_scales
from ...model.system.names import WIND
from ...model.wind.propagation import exponentials
from ...model.wind.record import COMPONENTS
from ..case.case import Case
from ..case.climb import Climb
from ..solvers.time_nodes import intervals, time_nodes

WINDS = (WIND, *(f"{WIND}_{component}" for component in COMPONENTS))  # inputs, of one plane and of both
STEP = 0.05  # s, at most
TOGETHER = 400  # steps whose exponentials are computed at once
GAUSS = 0.5 / np.sqrt(3.0)
POWERS = 3  # 1, s, s^2 / 2


@dataclass(frozen=True, eq=False)
class LevelWeights:
    """Responses as a linear function of the wind at levels.

    Attributes
    ----------
    times : (m,) array
        End times, s.
    levels : (k,) array
        m; below the first and above the last the wind is held.
    weight : (m, r, c k) array
        A, response by m/s: of the one wind that is met, or of both components one after the other.
    rest : (m, r) array
        What known inputs other than the wind do.
    altitude : (m,) array
        Of the vehicle at the end times, m.
    """

    times: NDArray[np.float64]
    levels: NDArray[np.float64]
    weight: NDArray[np.float64]
    rest: NDArray[np.float64]
    altitude: NDArray[np.float64]

    def responses(self, wind: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the responses (..., m, r) to profiles (..., c k) of the whole wind at the levels, m/s."""
        m, r, k = self.weight.shape
        return (wind @ self.weight.reshape(m * r, k).T).reshape(*wind.shape[:-1], m, r) + self.rest


def level_weights(
    case: Case, times: Sequence[float], levels: NDArray[np.float64], responses: Sequence[str]
) -> LevelWeights:
    """Return the weights of some responses, kept with the case.

    Parameters
    ----------
    case : Case
        Of a vehicle.
    times : sequence of float
        End times, increasing, s.
    levels : (k,) array
        Of profiles, increasing, m.
    responses : sequence of str

    Raises
    ------
    NoVehicleError, DataError, TimeRangeError
    """
    rows = [case.system.output_index(name) for name in responses]
    question = ("level weights", tuple(times), tuple(levels.tolist()), tuple(rows))
    outputs = MatrixEvaluator(case.with_means, ("C", "G"))

    def matrices(number: int, node: float, low: float, high: float) -> tuple[NDArray, NDArray]:
        C, G = outputs(node, low, high)
        return C[rows], G[rows]

    return case.kept(question, lambda: _level_weights(case, times, levels, len(rows), matrices))


def weights_of_rows(
    case: Case,
    times: Sequence[float],
    levels: NDArray[np.float64],
    state: NDArray[np.float64],
    direct: NDArray[np.float64],
) -> LevelWeights:
    """Return the weights of what is a linear combination of the states at each time.

    Parameters
    ----------
    case, times, levels
        As for :func:`level_weights`.
    state : (m, r, n) array
    direct : (m, r, n_u) array
        Of the known inputs.
    """

    def matrices(number: int, node: float, low: float, high: float) -> tuple[NDArray, NDArray]:
        return state[number], direct[number]

    return _level_weights(case, times, levels, state.shape[1], matrices)


def _level_weights(
    case: Case,
    times: Sequence[float],
    levels: NDArray[np.float64],
    r: int,
    matrices: Callable[[int, float, float, float], tuple[NDArray, NDArray]],
) -> LevelWeights:
    """Return the weights of r rows; ``matrices`` returns C and G of an end time by its number."""
    climb, executable = Climb.of(case), case.with_means
    system, n = executable.system, len(executable.system.states)
    nodes = time_nodes(executable, times)
    winds = [i for i, name in enumerate(system.input_names) if name in WINDS]
    scale = state_scales(system)
    begin, end, low, high = _steps(case, climb, nodes, levels)
    evaluate, known = MatrixEvaluator(executable, ("A", "E", "inputs")), MatrixEvaluator(executable, ("inputs",))
    k, c = levels.size, len(winds)
    X, rest = np.zeros((c, n, k)), np.zeros(n)
    weight, of_rest = np.zeros((nodes.size, r, c, k)), np.zeros((nodes.size, r))
    done = 0

    def read(node: float, low: float, high: float) -> None:
        nonlocal done
        others = known(node, low, high)[0][:, 0].copy()
        others[winds] = 0.0
        phi = np.zeros(k)
        i, share, _ = _place(levels, float(climb.altitude(node)))
        phi[i] += 1 - share
        phi[min(i + 1, k - 1)] += share
        while done < nodes.size and nodes[done] <= node:
            C, G = matrices(done, node, low, high)
            C = C * scale
            weight[done] = (C @ X).swapaxes(0, 1) + G[:, winds, None] * phi
            of_rest[done] = C @ rest + G @ others
            done += 1

    if nodes[0] <= system.start:
        read(system.start, low[0], high[0])
    for first in range(0, begin.size, TOGETHER):
        part = slice(first, first + TOGETHER)
        Phi, of_powers, of_others = _exact(evaluate, scale, winds, begin[part], end[part], low[part], high[part])
        for j, at in enumerate(range(first, min(first + TOGETHER, begin.size))):
            a, b = float(begin[at]), float(end[at])
            h0, h1, h2 = climb.altitude([a, 0.5 * (a + b), b])
            rate, bend = (4 * h1 - 3 * h0 - h2) / (b - a), 4 * (h2 - 2 * h1 + h0) / (b - a) ** 2
            i, _, span = _place(levels, float(h1))
            last = min(i + 2, k)
            X[..., :last] = Phi[j] @ X[..., :last]
            if span > 0:
                by_altitude = (rate * of_powers[j, ..., 1] + bend * of_powers[j, ..., 2]) / span
                share = (h0 - levels[i]) / span
                X[..., i] += (1 - share) * of_powers[j, ..., 0] - by_altitude
                X[..., i + 1] += share * of_powers[j, ..., 0] + by_altitude
            else:
                X[..., i] += of_powers[j, ..., 0]
            rest = Phi[j] @ rest + of_others[j]
            if done < nodes.size and nodes[done] <= b:
                read(b, low[at], high[at])
    return LevelWeights(
        np.asarray(times, float), levels, weight.reshape(nodes.size, r, c * k), of_rest, climb.altitude(nodes)
    )


def _place(levels: NDArray[np.float64], h: float) -> tuple[int, float, float]:
    """Return the level below an altitude (m), its share of the way to the next, and that way; 0 where wind is held."""
    if h <= levels[0]:
        return 0, 0.0, 0.0
    if h >= levels[-1]:
        return levels.size - 1, 0.0, 0.0
    i = int(np.searchsorted(levels, h, side="right")) - 1
    span = float(levels[i + 1] - levels[i])
    return i, (h - float(levels[i])) / span, span


def _steps(case: Case, climb: Climb, nodes: NDArray, levels: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Return begin, end and the limits of tables of steps that end at levels, end times and jumps."""
    executable, start = case.with_means, case.system.start
    last = float(nodes[-1])
    inside = levels[(levels > climb.altitudes[0]) & (levels < climb.altitudes[-1])]
    marks = np.concatenate([nodes, climb.time_at(inside)])
    parts = []
    for piece in intervals(executable, start, last) if last > start else []:
        own = marks[(marks > piece.begin) & (marks < piece.end)]
        edges = np.unique(np.concatenate([[piece.begin], own, [piece.end]]))
        edges = edges[np.concatenate([[True], np.diff(edges) > 1e-9])]
        edges[-1] = piece.end
        fine = [np.linspace(a, b, max(1, int(np.ceil((b - a) / STEP - 1e-9))) + 1)[:-1] for a, b in pairwise(edges)]
        times = np.concatenate([*fine, [piece.end]])
        parts.append((times[:-1], times[1:], np.full(times.size - 1, piece.low), np.full(times.size - 1, piece.high)))
    if not parts:
        none, at_start = np.zeros(0), np.array([start])
        return none, none, at_start, at_start
    begin, end, low, high = (np.concatenate(column) for column in zip(*parts, strict=True))
    return begin, end, low, high


def _exact(
    evaluate: MatrixEvaluator,
    scale: NDArray,
    winds: list[int],
    begin: NDArray,
    end: NDArray,
    low: NDArray,
    high: NDArray,
) -> tuple[NDArray, NDArray, NDArray]:
    """Return Phi (s, n, n), what winds of the powers 1, s, s^2 / 2 add (s, c, n, 3), other inputs (s, n), scaled."""
    n, steps, c = scale.size, begin.size, len(winds)
    size = n + POWERS * c + 1
    first_power = n + POWERS * np.arange(c)
    sides = []
    for side in (-GAUSS, GAUSS):
        M = np.zeros((steps, size, size))
        for j in range(steps):
            a, b = begin[j], end[j]
            A, E, inputs = evaluate(0.5 * (a + b) + side * (b - a), low[j], high[j])
            others = inputs[:, 0].copy()
            others[winds] = 0.0
            M[j, :n, :n] = A * scale / scale[:, None]
            M[j, :n, first_power] = (E[:, winds] / scale[:, None]).T
            M[j, :n, -1] = E @ others / scale
        for power in range(POWERS - 1):
            M[:, first_power + power, first_power + power + 1] = 1.0
        sides.append(M)
    step = (end - begin)[:, None, None]
    first, second = sides
    found = exponentials(0.5 * step * (first + second) + np.sqrt(3) / 12 * step**2 * (second @ first - first @ second))
    of_powers = found[:, :n, n:-1].reshape(steps, n, c, POWERS).swapaxes(1, 2)
    return found[:, :n, :n], of_powers, found[:, :n, -1]
