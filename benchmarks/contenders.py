"""The methods that are compared: each computes standard deviations of AS-504, (end times, responses, sources)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import casadi as ca
import numpy as np
from numpy_ensembles import Scheme, ensemble, euler_maruyama, fourth_order
from scipy.integrate import solve_ivp

from ascentwind.codegen.system.functions import state_scales
from ascentwind.runners import Cvodes, Ensemble, Study, Sweep
from ascentwind.runners.solvers.covariance import covariance_equation
from ascentwind.runners.solvers.time_nodes import intervals
from ascentwind.runners.statistics.engine import Engine

FLIGHTS = 4  # simulated one by one; 500 take 125 times as long
ENSEMBLE_STEP = 0.02  # s; the fastest root, near 100 rad/s, allows 0.028 s to a fourth-order formula
EULER_STEP = 5e-5  # s; by proportion from 0.2 ms, where the error reaches the sampling error of 500 flights, 3 %
EULER_SECONDS = 1.0  # of the flight


@dataclass(frozen=True)
class Contender:
    """A method at one setting.

    Attributes
    ----------
    method, setting : str
    run : callable
        End times to standard deviations.
    each : bool
        True if it works an end time after another, so that its time on all end times follows from some.
    scale : float
        Factor on the time, for a method that did a known part of its work.
    part : float or None
        Run over this many seconds of the flight only, and the time scaled: every second costs the same.
    """

    method: str
    setting: str
    run: Callable[[np.ndarray], np.ndarray]
    each: bool
    scale: float = 1.0
    part: float | None = None


class Adjoint:
    """The adjoint of all responses, variances as additional states, for integrators that take a Python function."""

    def __init__(self, study: Study):
        self.executable, self.system = study.with_means, study.system
        self.r, self.s = len(self.system.outputs), len(self.system.sources)
        self.scale, self.outputs = state_scales(self.system), np.array([o.scale for o in self.system.outputs])
        self.covariances = [
            self.system.start_covariance_matrix(name, self.executable.parameters) for name in self.system.sources
        ]
        function = self.executable.functions.adjoint
        self._buffer, self._evaluate = function.buffer()
        self.columns = function.size1_in(1)
        self._t, self._x = np.zeros(1), np.zeros(self.columns)
        self._p = np.zeros(function.size1_in(3))
        self._ode, self._quad = np.zeros(self.columns), np.zeros(function.nnz_out(2))
        for i, argument in ((0, self._t), (1, self._x), (3, self._p)):
            self._buffer.set_arg(i, memoryview(argument))
        for i, result in ((0, self._ode), (2, self._quad)):
            self._buffer.set_res(i, memoryview(result))

    def rate(self, t: float, y: np.ndarray, out: np.ndarray) -> None:
        self._t[0] = t
        self._x[:] = y[: self.columns]
        self._evaluate()
        out[: self.columns], out[self.columns :] = self._ode, self._quad

    def std(self, time: float, integrate: Callable[[np.ndarray, float], np.ndarray]) -> np.ndarray:
        """Run back from ``time``; ``integrate`` takes the state over pseudo-time 0 to 1 and gives it at 1."""
        last = intervals(self.executable, self.system.start, time)[-1]
        C = self.executable.matrices(time, last.low, last.high)["C"]
        y = np.concatenate([(self.scale[:, None] * C.T / self.outputs).ravel("F"), np.zeros(self._quad.size)])
        for piece in reversed(intervals(self.executable, self.system.start, time)):
            span = piece.end - piece.begin
            self._p[:] = self.executable.integrator_parameters(piece.end, span, piece.low, piece.high)
            y = integrate(y, span)
        adjoint = y[: self.columns].reshape(-1, self.r, order="F") / self.scale[:, None] * self.outputs
        variance = y[self.columns :].reshape(self.r, self.s + 1)[:, : self.s] * self.outputs[:, None] ** 2
        for k, covariance in enumerate(self.covariances):
            variance[:, k] += np.einsum("ir,ij,jr->r", adjoint, covariance, adjoint)
        return np.sqrt(variance)


def contenders(study: Study) -> tuple[list[Contender], list[str]]:
    """Return the methods, and a line for each that is missing."""
    found, missing = [], []
    for method, label in (("adams", "Adams"), ("bdf", "BDF")):
        for tolerance in (1e-5, 1e-7, 1e-9):
            engine = Cvodes(method=method, relative_tolerance=tolerance)
            found.append(Contender(f"CVODES {label}", f"{tolerance:g}", _engine(study, engine), True))
    for step in (0.02, 0.01, 0.005):
        found.append(Contender("CasADi rk, compiled rhs", f"{1e3 * step:g} ms", _casadi_rk(study, step), True))
    for tolerance in (1e-5, 1e-8):
        found.append(Contender("SciPy DOP853, adjoints", f"{tolerance:g}", _scipy_adjoints(study, tolerance), True))
        found.append(
            Contender(
                "SciPy DOP853, covariance equation", f"{tolerance:g}",
                lambda times, tolerance=tolerance: np.sqrt(
                    covariance_equation(study.with_means, times.tolist(), tolerance).variance
                ),
                False,
            )
        )  # fmt: skip
    if find_spec("sksundae"):
        for tolerance in (1e-5, 1e-7, 1e-9):
            found.append(Contender("scikit-sundae CVODE", f"{tolerance:g}", _sundae(study, tolerance), True))
    else:
        missing.append("scikit-sundae is not installed: skipped (pip install -e '.[bench]')")
    if find_spec("diffrax"):
        from diffrax_adjoint import diffrax_adjoints

        for tolerance in (1e-5, 1e-8):
            found.append(Contender("diffrax Dopri8, CPU", f"{tolerance:g}", diffrax_adjoints(study, tolerance), True))
    else:
        missing.append("diffrax is not installed: skipped (pip install -e '.[bench]')")
    taylor, euler = fourth_order(ENSEMBLE_STEP), euler_maruyama(EULER_STEP)
    found.append(Contender("NumPy ensemble of 500, order 4", "20 ms", _numpy_ensemble(study, taylor, 500), False))
    few = _numpy_one_by_one(study, taylor, FLIGHTS)
    found.append(Contender("NumPy ensemble of 500, order 4, flight by flight", "20 ms", few, False, 500 / FLIGHTS))
    found.append(
        Contender(
            "NumPy ensemble of 500, Euler-Maruyama", f"{1e3 * EULER_STEP:g} ms",
            _numpy_ensemble(study, euler, 500), False, part=EULER_SECONDS,
        )
    )  # fmt: skip
    found.append(Contender("ensemble of 500, compiled", "50 ms", _engine(study, Ensemble(runs=500)), False))
    for tolerance in (1e-4, 1e-6, 1e-8):
        found.append(Contender("sweep", f"{tolerance:g}", _engine(study, Sweep(tolerance)), False))
    return found, missing


def _engine(study: Study, engine: Engine) -> Callable[[np.ndarray], np.ndarray]:
    names = list(study.system.output_names)

    def run(times: np.ndarray) -> np.ndarray:
        return engine.compute(study, times.tolist(), names)["std"].values[:, :, :-1]

    return run


def _casadi_rk(study: Study, step: float) -> Callable[[np.ndarray], np.ndarray]:
    adjoint = Adjoint(study)
    function = adjoint.executable.functions.adjoint

    def integrate(y: np.ndarray, span: float) -> np.ndarray:
        options = {"number_of_finite_elements": max(1, round(span / step))}
        result = ca.integrator("rk", "rk", function, 0.0, 1.0, options)(x0=y[: adjoint.columns], p=adjoint._p)
        return np.concatenate([result["xf"].full()[:, 0], y[adjoint.columns :] + result["qf"].full()[:, 0]])

    return lambda times: np.array([adjoint.std(float(t), integrate) for t in times])


def _scipy_adjoints(study: Study, tolerance: float) -> Callable[[np.ndarray], np.ndarray]:
    adjoint = Adjoint(study)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        out = np.empty(y.size)
        adjoint.rate(t, y, out)
        return out

    def integrate(y: np.ndarray, span: float) -> np.ndarray:
        return solve_ivp(rate, (0, 1), y, method="DOP853", rtol=tolerance, atol=1e-3 * tolerance).y[:, -1]

    return lambda times: np.array([adjoint.std(float(t), integrate) for t in times])


def _sundae(study: Study, tolerance: float) -> Callable[[np.ndarray], np.ndarray]:
    from sksundae.cvode import CVODE

    adjoint = Adjoint(study)
    solver = CVODE(
        lambda t, y, yp: adjoint.rate(t, y, yp), method="Adams", rtol=tolerance, atol=1e-3 * tolerance,
        linsolver="dense", max_num_steps=1_000_000,
    )  # fmt: skip
    return lambda times: np.array(
        [adjoint.std(float(t), lambda y, _: solver.solve(np.array([0.0, 1.0]), y).y[-1]) for t in times]
    )


def _numpy_ensemble(study: Study, scheme: Scheme, runs: int) -> Callable[[np.ndarray], np.ndarray]:
    """Vectorised: all runs side by side share the transition of a step."""

    def run(times: np.ndarray) -> np.ndarray:
        return ensemble(study, scheme, runs, times, np.random.default_rng(504)).std(axis=3, ddof=1)

    return run


def _numpy_one_by_one(study: Study, scheme: Scheme, runs: int) -> Callable[[np.ndarray], np.ndarray]:
    """As a simulation is run again and again: one flight after another."""

    def run(times: np.ndarray) -> np.ndarray:
        random = np.random.default_rng(504)
        return np.concatenate([ensemble(study, scheme, 1, times, random) for _ in range(runs)], axis=3).std(
            axis=3, ddof=1
        )

    return run
