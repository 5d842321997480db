"""The derivative of a variance or mean with respect to every parameter and table value, by one adjoint pair.

With a' = -A'a, a(t2) = C_i', the covariance P occurs only in y = P a, and y' = A y + B B' a, y(t0) = P0 a(t0), needs
no covariance matrix (docs/sensitivity.md):

    dVar/dq = integral [ 2 a'(dA/dq) y + a' d(BB')/dq a ] dt + a(t0)'(dP0/dq) a(t0) + 2 (dC_i/dq) y(t2)

The noise columns depend on the mean response m = (alpha, beta, phi); that path is a second adjoint, driven by
dVar/dm. The mean itself is C_i x + G_i u with x' = A x + E u.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..codegen.compiled import ExecutableSystem
from ..codegen.node_functions import NodeFunctions
from ..model.assemble import MEAN_TABLES
from ..model.system import LinearSystem
from .collocation import Grid, collocation, collocation_grid, longest_step, tables_at
from .integration import intervals

FROZEN = 7  # times at which the roots of A are looked at
SLOPE_STEP = 1e-3  # s, of central differences of the output matrices, which are cubic in time


@dataclass(frozen=True, eq=False)
class Gradient:
    """A number and its derivatives.

    Attributes
    ----------
    value : float
    parameters : (n_p,) array
    times : (k,) array
        Nodes, s.
    weights : (k,) array
        Of the nodes in an integral over time, s.
    tables : (k, n_v) array
        Derivative with respect to a table's value at a time, per second.
    tables_at_end : (n_v,) array
        Weight of the delta that the latter holds at t = t2.
    """

    value: float
    parameters: NDArray[np.float64]
    times: NDArray[np.float64]
    weights: NDArray[np.float64]
    tables: NDArray[np.float64]
    tables_at_end: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _MeanPath:
    """Derivatives of a variance with respect to the mean: along the flight per second, and at t2."""

    on_states: NDArray[np.float64]
    on_outputs: NDArray[np.float64]
    on_states_at_end: NDArray[np.float64]
    on_outputs_at_end: NDArray[np.float64]


class AdjointPair:
    """Adjoint, its product with the covariance, and the mean, for one response, time and set of sources.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    functions : NodeFunctions
    response : int
        Row of C.
    time : float
        t2, s; on a discontinuity it is seen from the left.
    sources : tuple of str
    step : float, optional
        Longest step, s; from the roots of A without it.
    """

    def __init__(
        self,
        executable: ExecutableSystem,
        functions: NodeFunctions,
        response: int,
        time: float,
        sources: tuple[str, ...],
        step: float | None = None,
    ):
        system = executable.system
        self.executable, self.functions = executable, functions
        self.response, self.time, self.sources = response, time, sources
        if step is None:
            spread = system.start + (time - system.start) * (np.arange(FROZEN) + 0.5) / FROZEN
            frozen = functions.matrices(spread, tables_at(executable.groups, spread), executable.parameters)
            step = longest_step(frozen["A"])
        self.grid: Grid = collocation_grid(system, executable.groups, time, step)
        self.mask = np.array([float(noise.source in sources) for noise in system.noises])
        last = intervals(system, system.start, time)[-1]
        self._low, self.end = last.low, last.high  # the end from the left, where it is a discontinuity
        self.tables_at_end = tables_at(executable.groups, np.array([self.end]))[0]
        self.at_end = executable.matrices(time, last.low, last.high)
        times, shape = self.grid.nodes.ravel(), self.grid.nodes.shape
        self.tables = tables_at(executable.groups, times)
        flat = functions.matrices(times, self.tables, executable.parameters)
        self.matrices = {name: value.reshape(*shape, *value.shape[1:]) for name, value in flat.items()}
        self.solver = collocation(self.grid, self.matrices["A"], functions.shared_library)

        self.adjoint, self.adjoint_at_start = self.solver.backward(
            self.at_end["C"][response], np.zeros((*shape, len(system.states)))
        )
        B = self.matrices["B"]
        white = self.mask * np.einsum("kinw,kin->kiw", B, self.adjoint)
        covariance = sum(
            (system.start_covariance_matrix(s, executable.parameters) for s in sources),
            np.zeros((len(system.states),) * 2),
        )
        start = covariance @ self.adjoint_at_start
        self.dual, self.dual_at_end = self.solver.forward(start, np.einsum("kinw,kiw->kin", B, white))
        self.variance = float(np.sum(self.grid.weights[..., None] * white**2) + self.adjoint_at_start @ start)
        known = np.einsum("kinu,kiu->kin", self.matrices["E"], self.matrices["inputs"][..., 0])
        self.states, self.states_at_end = self.solver.forward(np.zeros(len(system.states)), known)
        self.mean = float(
            self.at_end["C"][response] @ self.states_at_end + self.at_end["G"][response] @ self.at_end["inputs"][:, 0]
        )

    @cached_property
    def slopes(self) -> tuple[float, float]:
        """Derivatives of variance and mean with respect to t2, between discontinuities."""
        low, high = self._low, self.end
        if high < self.time:  # on a discontinuity: its left side
            before, after = self.time - 2 * SLOPE_STEP, self.time
        else:
            jumps = [*self.executable.system.discontinuities, self.executable.system.end]
            before, after = self.time - SLOPE_STEP, self.time + SLOPE_STEP
            high = min([np.nextafter(j, -np.inf) for j in jumps if j > self.time], default=np.inf)
            after, before = min(after, high), max(before, low)
        first, second = (self.executable.matrices(t, low, high) for t in (before, after))
        i, m, span = self.response, self.at_end, after - before
        C, u = m["C"][i], m["inputs"][:, 0]
        C_rate = (second["C"][i] - first["C"][i]) / span + C @ m["A"]
        direct = (second["G"][i] @ second["inputs"][:, 0] - first["G"][i] @ first["inputs"][:, 0]) / span
        variance = 2 * C_rate @ self.dual_at_end + float(np.sum(self.mask * (C @ m["B"]) ** 2))
        mean = C_rate @ self.states_at_end + C @ m["E"] @ u + direct
        return float(variance), float(mean)

    def gradient(self, variance_factor: float, mean_factor: float) -> Gradient:
        """Return the derivatives of ``variance_factor`` variance + ``mean_factor`` mean."""
        system, p = self.executable.system, self.executable.parameters
        n, r, n_p = len(system.states), len(system.outputs), system.p.numel()
        times, weights = self.grid.nodes.ravel(), self.grid.weights.ravel()
        v, functions = self.tables, self.functions
        end, v_end = np.array([self.end]), self.tables_at_end[None]
        none, selected = np.zeros(r), np.eye(r)[self.response]
        total = np.zeros((times.size, n_p + v.shape[1]))
        total_end = np.zeros(n_p + v.shape[1])
        at_start = np.zeros(n_p)
        adjoint = mean_factor * self.adjoint
        on_outputs, on_outputs_end = np.zeros((times.size, r)), mean_factor * selected
        if variance_factor:
            rows, dual = self.adjoint.reshape(-1, n), self.dual.reshape(-1, n)
            total += variance_factor * functions.quadratic_gradient(times, v, p, rows, dual, none, self.mask)
            still = np.zeros((1, n))
            total_end += (
                variance_factor
                * functions.quadratic_gradient(end, v_end, p, still, self.dual_at_end[None], selected, self.mask)[0]
            )
            at_start = variance_factor * self._start_gradient(system, p)
            path = self._mean_path(total[:, n_p:], total_end[n_p:])
            adjoint = adjoint + self.solver.backward(path.on_states_at_end, path.on_states)[0]
            on_outputs, on_outputs_end = on_outputs + path.on_outputs, on_outputs_end + path.on_outputs_at_end
        if adjoint.any() or on_outputs_end.any():
            states = self.states.reshape(-1, n)
            total += functions.linear_gradient(times, v, p, adjoint.reshape(-1, n), states, on_outputs)
            total_end += functions.linear_gradient(
                end, v_end, p, np.zeros((1, n)), self.states_at_end[None], on_outputs_end[None]
            )[0]
        value = variance_factor * self.variance + mean_factor * self.mean
        parameters = weights @ total[:, :n_p] + total_end[:n_p] + at_start
        return Gradient(value, parameters, times, weights, total[:, n_p:], total_end[n_p:])

    def _start_gradient(self, system: LinearSystem, p: NDArray) -> NDArray:
        a, found = ca.DM(self.adjoint_at_start), np.zeros(p.size)
        for source in self.sources:
            given = system.start_covariance.get(source)
            if isinstance(given, ca.SX):
                form = ca.gradient(ca.bilin(given, a, a), system.p)
                found += np.array(ca.Function("start", [system.p], [ca.densify(form)])(p)).ravel()
        return found

    def _mean_path(self, on_tables: NDArray, on_tables_end: NDArray) -> _MeanPath:
        """Move what the variance owes to the tables of the mean response on to the mean's states and outputs."""
        system = self.executable.system
        names = [name for g in self.executable.groups for name in g.names]
        k, n, r = self.grid.steps.size, len(system.states), len(system.outputs)
        path = _MeanPath(np.zeros((k, 3, n)), np.zeros((k * 3, r)), np.zeros(n), np.zeros(r))
        for name in (name for name in MEAN_TABLES if name in names):
            (kind, what), column = MEAN_TABLES[name], names.index(name)
            along, last = on_tables[:, column], on_tables_end[column]
            if kind == "output":
                row = system.output_index(what)
                path.on_outputs[:, row] += along
                path.on_outputs_at_end[row] += last
                path.on_states[:] += along.reshape(k, 3, 1) * self.matrices["C"][:, :, row]
                path.on_states_at_end[:] += last * self.at_end["C"][row]
            else:
                state = system.state_names.index(what)
                path.on_states[:, :, state] += along.reshape(k, 3)
                path.on_states_at_end[state] += last
        return path
