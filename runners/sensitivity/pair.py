"""The derivative of a variance or mean with respect to every parameter and table value, by one adjoint pair.

With a' = -A'a, a(t2) = C_i', the covariance P occurs only in y = P a, and y' = A y + B B' a, y(t0) = P0 a(t0), needs
no covariance matrix (docs/sensitivity.md):

    dVar/dq = integral [ 2 a'(dA/dq) y + a' d(BB')/dq a ] dt + a(t0)'(dP0/dq) a(t0) + 2 (dC_i/dq) y(t2)

A parameter that moves a switch of the equations adds what it moves (switches.py, gradient.py).

The noise columns depend on the mean response m = (alpha, beta, phi); that path is a second adjoint, driven by
dVar/dm. The mean itself is C_i x + G_i u with x' = A x + E u.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.gauss_legendre import STAGES
from ..solvers.collocation_grid import tables_at
from ..solvers.flight_nodes import FlightNodes
from ..solvers.start_functions import start_functions
from ..solvers.time_nodes import interval_after, interval_before

SLOPE_STEP = 1e-6  # of the flight, of central differences of the output matrices, which are cubic in time


@dataclass(frozen=True, eq=False)
class MeanPath:
    """Derivatives of a variance with respect to the mean's states and outputs: per second of flight, and at t2."""

    on_states: NDArray[np.float64]
    on_outputs: NDArray[np.float64]
    on_states_at_end: NDArray[np.float64]
    on_outputs_at_end: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Combination:
    """Derivatives of a combination of variance and mean, and the adjoint of the linear form that they come from.

    Attributes
    ----------
    numbers : (n_z,) array
    tables : (k, n_v) array
        Per second.
    tables_at_end : (n_v,) array
    adjoint : (k, n) array
        Of the mean's states.
    on_outputs : (k, n_y) array
        Derivatives with respect to the mean's outputs, per second.
    on_outputs_at_end : (n_y,) array
    """

    numbers: NDArray[np.float64]
    tables: NDArray[np.float64]
    tables_at_end: NDArray[np.float64]
    adjoint: NDArray[np.float64]
    on_outputs: NDArray[np.float64]
    on_outputs_at_end: NDArray[np.float64]


class AdjointPair:
    """Adjoint, its product with the covariance, and the mean, for one response, time and set of sources.

    The response may be a linear form of several, such as the component of a moment along a direction in two planes.

    Parameters
    ----------
    flight : FlightNodes
        To ``time`` at least.
    response : int or (n_y,) array
        Row of C, or the weights of a linear form of them.
    time : float
        t2, s, one of those that the grid was made for; on a discontinuity it is seen from the left.
    sources : tuple of str
    """

    def __init__(self, flight: FlightNodes, response: int | NDArray[np.float64], time: float, sources: tuple[str, ...]):
        self.flight, self.executable = flight, flight.executable
        system, executable = self.executable.system, self.executable
        whole = np.eye(len(system.outputs))[response] if isinstance(response, int | np.integer) else response
        self.form, self.time, self.sources = np.asarray(whole, float), time, sources
        n, steps = len(system.states), int(np.argmin(np.abs(flight.grid.edges - time)))
        self.steps, self.node = steps, float(flight.grid.edges[steps])
        self.mask = np.array([float(noise.source in sources) for noise in system.noises])
        last = interval_before(executable, self.node)
        self._low, self.end = last.low, last.high  # the end from the left, where it is a discontinuity
        self.times, self.weights = flight.grid.nodes[:steps].ravel(), flight.grid.weights[:steps].ravel()
        self.tables = flight.tables[: STAGES * steps]
        self.tables_at_end = tables_at(executable.groups, np.array([self.end]))[0]
        self.matrices = {name: matrix.first(STAGES * steps) for name, matrix in flight.matrices.items()}
        self.at_end = executable.matrices(self.node, last.low, last.high)

        still = np.zeros((steps, STAGES, n))
        stages, edges = flight.solver.backward(self.form @ self.at_end["C"], still)
        self.adjoint, self.adjoint_at_start, self.adjoint_at_edges = stages.reshape(-1, n), edges[0], edges
        B = self.matrices["B"]
        white = self.mask * B.transposed_times(self.adjoint)
        product = start_functions(system, sources)[0]
        start = np.array(product(executable.parameters, self.adjoint_at_start), float).ravel()
        stages, edges = flight.solver.forward(start, B.times(white).reshape(steps, STAGES, n))
        self.dual, self.dual_at_end, self.dual_at_edges = stages.reshape(-1, n), edges[-1], edges
        self.variance = float(self.weights @ np.sum(white**2, axis=1) + self.adjoint_at_start @ start)
        self.states, self.states_at_end = flight.mean[0][:steps].reshape(-1, n), flight.mean[1][steps]
        self.mean = float(
            self.form @ (self.at_end["C"] @ self.states_at_end + self.at_end["G"] @ self.at_end["inputs"][:, 0])
        )

    @cached_property
    def slopes(self) -> tuple[float, float]:
        """Derivatives of variance and mean with respect to t2, between discontinuities."""
        low, high, at = self._low, self.end, self.end
        step = SLOPE_STEP * (self.node - self.executable.system.start)
        if high >= self.node:  # else on a discontinuity: its left side
            high, at = interval_after(self.executable, self.node).high, self.node
        step = min(step, 0.5 * (high - low))
        middle = min(max(at, low + step), high - step)
        three = [self.executable.matrices(t, low, high) for t in (middle - step, middle, middle + step)]
        form, m = self.form, self.at_end
        C, u = form @ m["C"], m["inputs"][:, 0]

        def rate(first: Any, second: Any, third: Any) -> Any:
            """Of the parabola through three values, at ``at``."""
            return ((third - first) / 2 + (at - middle) / step * (third - 2 * second + first)) / step

        C_rate = rate(*(form @ n["C"] for n in three)) + C @ m["A"]
        direct = rate(*(form @ n["G"] @ n["inputs"][:, 0] for n in three))
        variance = 2 * C_rate @ self.dual_at_end + float(np.sum(self.mask * (C @ m["B"]) ** 2))
        mean = C_rate @ self.states_at_end + C @ m["E"] @ u + direct
        return float(variance), float(mean)

    def combine(self, variance_factor: float, mean_factor: float) -> Combination:
        """Return the sums over nodes and end of the gradients of both forms, for a combination of both numbers."""
        functions, n, r = self.flight.functions, self.adjoint.shape[1], self.at_end["C"].shape[0]
        at = (self.weights, self.times, self.tables, self.flight.numbers)
        at_end = (np.ones(1), np.array([self.end]), self.tables_at_end[None], self.flight.numbers)
        selected, still = self.form, np.zeros((1, n))
        numbers, along = np.zeros(self.flight.numbers.size), np.zeros_like(self.tables)
        last, adjoint = np.zeros(self.tables.shape[1]), mean_factor * self.adjoint
        on_outputs, on_outputs_end = np.zeros((self.times.size, r)), mean_factor * selected

        def add(inside: tuple[NDArray, NDArray], end: tuple[NDArray, NDArray], factor: float) -> None:
            numbers[:] += factor * (inside[0] + end[0])
            along[:] += factor * inside[1]
            last[:] += factor * end[1][0]

        if variance_factor:
            add(
                functions.quadratic_gradient(*at, self.adjoint, self.dual, np.zeros(r), self.mask),
                functions.quadratic_gradient(*at_end, still, self.dual_at_end[None], selected, self.mask),
                variance_factor,
            )
            path = self.mean_path(along, last)
            if path is not None:
                on_states = path.on_states + self.matrices["C"].transposed_times(path.on_outputs)
                at_last = path.on_states_at_end + path.on_outputs_at_end @ self.at_end["C"]
                stages, _ = self.flight.solver.backward(at_last, on_states.reshape(-1, STAGES, n))
                adjoint = adjoint + stages.reshape(-1, n)
                on_outputs, on_outputs_end = on_outputs + path.on_outputs, on_outputs_end + path.on_outputs_at_end
        if adjoint.any() or on_outputs_end.any():
            add(
                functions.linear_gradient(*at, adjoint, self.states, on_outputs),
                functions.linear_gradient(*at_end, still, self.states_at_end[None], on_outputs_end[None]),
                1.0,
            )
        return Combination(numbers, along, last, adjoint, on_outputs, on_outputs_end)

    def mean_path(self, on_tables: NDArray, on_tables_end: NDArray) -> MeanPath | None:
        """Give what the variance owes to the tables of the mean response to the mean's states and outputs."""
        system = self.executable.system
        if not system.mean_sources:
            return None
        k, n, r = self.times.size, len(system.states), len(system.outputs)
        path = MeanPath(np.zeros((k, n)), np.zeros((k, r)), np.zeros(n), np.zeros(r))
        for value, (kind, of) in system.mean_sources.items():
            along, last = on_tables[:, value], on_tables_end[value]
            if kind == "output":
                path.on_outputs[:, of] += along
                path.on_outputs_at_end[of] += last
            else:
                path.on_states[:, of] += along
                path.on_states_at_end[of] += last
        return path
