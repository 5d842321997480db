"""Direct fit of a state-space filter whose states keep unit covariance at every altitude.

With P(h) = I the covariance equation P' = F P + P F' + G G' = 0 says F = S - G G'/2, S skew. The states all stay near
one and the start covariance is I, so that the wind has its variance from the ground up. Rotations of the states and
noises bring the first noise to the last state alone and make S a chain of neighbours, S[i, i+1] > 0 (Schwarz's form):

    F = [[0, s1, 0], [-s1, 0, s2], [0, -s2, -g^2/2]],   G = [0, 0, g]',   W = sigma(h) u(h)' z,   |u| = 1

A frozen mode without decay would be orthogonal to G, so zero in the last state, and by the chain in all: every such
filter is strictly stable at every altitude, and with one noise between samples too, where entries keep their signs.
The standard deviation is met exactly at every altitude and only correlations are fitted: for one noise n - 1
rotations, the gain and n - 1 components of u, 2 n - 1 functions of altitude. Further noises reach the states before
the last with gains of their own.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.wind.propagation import divided
from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, Residuals, fit_least_squares
from ..fitting.altitude_grid import (
    covariance_data,
    dense_samples,
    knots_for,
    natural_spline,
    second_differences,
    transition,
)
from .result import SynthesisError, SynthesisResult

METHOD = "state-space"
FIT_STEP = 0.25  # km, of the propagation inside the fit
SMOOTHNESS, RIDGE = 0.5, 0.1  # m2/s2 a unit of second difference and of value: choose among equal fits
ENOUGH = 0.004  # rms error over mean variance; above it other starts are drawn, against local minima
FURTHER_STARTS, SPREAD = 6, 0.5  # a start is shifted by a normal deviate, one a function, 1/km or ln
TAYLOR = 6  # terms of the exponential over a step of the fit
SMALLEST, LARGEST = 0.05, 3.0  # rotations, 1/km, and gain, 1/sqrt(km): strictly stable; the series holds over a step
START_ROTATION, START_GAIN, START_FURTHER = 0.4, 0.6, 0.2
START_DIRECTION = (1.0, 1.0, 0.5, 0.3, 0.2)  # of H, in units of its last component


class _Form:
    """Positions of the unknown functions of altitude in F (n, n), G (n, m) and the direction of H (n,)."""

    def __init__(self, order: int, noises: int):
        self.order, self.noises = order, noises
        self.chain = [(i, i + 1) for i in range(order - 1)]
        self.further = [(i, j) for j in range(1, noises) for i in range(order - j)]

    @property
    def functions(self) -> int:
        return 2 * self.order - 1 + len(self.further)

    def start(self) -> NDArray[np.float64]:
        """Return a value of each function, before its bounds."""
        bounded = [START_ROTATION / (i + 1) for i in range(self.order - 1)] + [START_GAIN]
        share = (np.array(bounded) - SMALLEST) / (LARGEST - SMALLEST)
        return np.array(
            [*np.log(share / (1 - share)), *START_DIRECTION[: self.order - 1], *(0.2 for _ in self.further)]
        )

    def matrices(self, values, zeros, exp):
        """Return F, G and the unit vector along H for the values of the functions, symbolic or numeric."""
        n = self.order
        G, S, H = zeros(n, self.noises), zeros(n, n), zeros(n, 1)
        bounded = [SMALLEST + (LARGEST - SMALLEST) / (1 + exp(-values[f])) for f in range(n)]
        for (i, j), rotation in zip(self.chain, bounded, strict=False):
            S[i, j], S[j, i] = rotation, -rotation
        G[n - 1, 0] = bounded[n - 1]
        for f, position in enumerate(self.further, start=2 * n - 1):
            G[position] = values[f]
        H[n - 1, 0] = 1
        for i in range(n - 1):
            H[i, 0] = values[n + i]
        return S - G @ G.T / 2, G, H / (H.T @ H) ** 0.5


def synthesise_state_space(
    statistics: WindStatistics, order: int = 3, options: FitOptions | None = None, noises: int = 1
) -> SynthesisResult:
    """Fit a filter of any order and number of noises.

    Parameters
    ----------
    statistics : WindStatistics
    order : int
        Number of states.
    noises : int
        White noises, up to the order.
    """
    if not 1 <= noises <= order:
        raise SynthesisError(f"a filter of order {order} takes 1 to {order} noises, not {noises}")
    form = _Form(order, noises)
    knots = knots_for(statistics.altitude) / 1000.0
    options = options or FitOptions()
    functions = _residuals(statistics.altitude, form)
    data, random = covariance_data(statistics), np.random.default_rng(options.seed)
    # half the sum of squares at which the root mean square error is a small share of the mean variance
    enough = 0.5 * statistics.altitude.size**2 / 2 * (ENOUGH * np.mean(statistics.standard_deviation**2)) ** 2
    fit = fit_least_squares(functions, np.repeat(form.start(), knots.size), options, data)
    for _ in range(FURTHER_STARTS):
        left = options.time_limit - fit.seconds
        if fit.cost < enough or left <= 0:
            break
        drawn = np.repeat(form.start() + SPREAD * random.standard_normal(form.functions), knots.size)
        other = fit_least_squares(functions, drawn, replace(options, time_limit=left), data)
        best = min(fit, other, key=lambda f: f.cost)
        fit = replace(best, evaluations=fit.evaluations + other.evaluations, seconds=fit.seconds + other.seconds)
    values = fit.unknowns.reshape(form.functions, knots.size)
    return SynthesisResult(
        METHOD,
        statistics,
        _shaping_filter(statistics, form, knots, values),
        _own_covariance(statistics, form, knots, values),
        fit.converged,
        fit.message,
        fit.evaluations,
        fit.seconds,
    )


def _residuals(altitude: NDArray[np.float64], form: _Form) -> Residuals:
    """Return the errors of the distinct covariances, m2/s2, and what chooses among equal fits."""
    h, knots = altitude / 1000.0, knots_for(altitude) / 1000.0
    correlations = _Correlations(h, knots, form)
    upper, lower = correlations.pairs
    smooth = np.kron(np.eye(form.functions), SMOOTHNESS * second_differences(knots.size))
    start = np.repeat(form.start(), knots.size)
    always = np.vstack([smooth, RIDGE * np.eye(start.size)])
    target = np.concatenate([np.zeros(len(smooth)), RIDGE * start])

    def products(data: NDArray) -> tuple[NDArray, NDArray]:
        deviation, covariance = data[: h.size], data[h.size :].reshape(h.size, h.size)
        return deviation[upper] * deviation[lower], covariance[upper, lower]

    def value(x: NDArray, data: NDArray) -> NDArray:
        scale, wanted = products(data)
        return np.concatenate([scale * correlations.value(x) - wanted, always @ x - target])

    def jacobian(x: NDArray, data: NDArray) -> NDArray:
        return np.vstack([products(data)[0][:, None] * correlations.jacobian(x), always])

    return Residuals(upper.size + len(always), start.size, value, jacobian)


class _Correlations:
    """Correlations of the wind at all pairs of levels, H_i Phi(i, j) H_j', and their derivatives.

    A step of the propagation takes the functions' values v at its middle alone, so that with s between the levels

        d (H_i Phi(i, j) H_j') / d v_s = [H_i Phi(i, end of s)] [d Phi_s / d v_s] [Phi(start of s, j) H_j'],

    and only one step is differentiated symbolically.
    """

    def __init__(self, h: NDArray[np.float64], knots: NDArray[np.float64], form: _Form):
        edges = divided(h, FIT_STEP)
        self.steps_of = [e.size - 1 for e in edges]
        middles = np.concatenate([0.5 * (e[1:] + e[:-1]) for e in edges])
        self.lengths = np.concatenate([np.diff(e) for e in edges])
        basis = natural_spline(knots, np.eye(knots.size))
        self.at_middles, self.at_levels = basis(middles), basis(h)
        self.shape = form.functions, knots.size
        self.order, self.pairs = form.order, np.tril_indices(h.size, -1)
        v, d = ca.SX.sym("v", form.functions), ca.SX.sym("d")
        F, _, H = form.matrices(v, ca.SX.zeros, ca.exp)
        phi = term = ca.SX.eye(form.order)
        for q in range(1, TAYLOR + 1):
            term = d / q * (F @ term)
            phi += term
        flat = ca.vec(phi.T)
        self.step = ca.Function("step", [v, d], [flat, ca.vec(ca.jacobian(flat, v).T)]).map(middles.size)
        self.direction = ca.Function("direction", [v], [H, ca.vec(ca.jacobian(H, v).T)]).map(h.size)

    def _parts(self, x: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Return Phi (s, n, n) and d Phi (s, n, n, f) of all steps, H (k, n) and d H (k, n, f) at all levels."""
        n, table = self.order, x.reshape(self.shape)
        phi, slopes = (np.array(a).T for a in self.step(table @ self.at_middles.T, self.lengths[None]))
        H, turns = (np.array(a).T for a in self.direction(table @ self.at_levels.T))
        return phi.reshape(-1, n, n), slopes.reshape(-1, n, n, self.shape[0]), H, turns.reshape(-1, n, self.shape[0])

    def value(self, x: NDArray) -> NDArray[np.float64]:
        """Return the correlations of the pairs, (p,)."""
        phi, _, H, _ = self._parts(x)
        found, columns, s = [], H[:1].T, 0
        for i, count in enumerate(self.steps_of, start=1):
            for k in range(s, s + count):
                columns = phi[k] @ columns
            s += count
            found.append(H[i] @ columns)
            columns = np.column_stack([columns, H[i]])
        return np.concatenate(found)

    def jacobian(self, x: NDArray) -> NDArray[np.float64]:
        """Return their derivatives, (p, n)."""
        phi, slopes, H, turns = self._parts(x)
        k, n = H.shape[0], self.order
        # columns[s, :, j] = Phi(start of s, j) H_j', rows[s, i] = H_i Phi(i, end of s), zero where s is not between
        columns, rows = np.zeros((len(phi), n, k)), np.zeros((len(phi), k, n))
        here, forward = np.zeros((n, k)), np.zeros((k, n, k))
        ends = np.cumsum(self.steps_of)
        for i, (first, end) in enumerate(zip(ends - self.steps_of, ends, strict=True)):
            here[:, i] = H[i]
            for s in range(first, end):
                columns[s], here = here, phi[s] @ here
            forward[i + 1] = here
        there, backward = np.zeros((k, n)), np.zeros((k, k, n))
        for i, (first, end) in reversed(list(enumerate(zip(ends - self.steps_of, ends, strict=True)))):
            there[i + 1] = H[i + 1]
            for s in range(end - 1, first - 1, -1):
                rows[s], there = there, there @ phi[s]
            backward[i] = there
        inside = rows[:, None] @ slopes.transpose(0, 3, 1, 2) @ columns[:, None]
        upper, lower = self.pairs
        by_step = np.tensordot(inside[:, :, upper, lower], self.at_middles, (0, 0))
        # H_i from the left, H_j from the right
        left = np.einsum("pn,pnf->pf", forward[upper, :, lower], turns[upper])
        right = np.einsum("pn,pnf->pf", backward[lower, upper], turns[lower])
        at = self.at_levels
        whole = (
            by_step.transpose(1, 0, 2) + left[:, :, None] * at[upper][:, None] + right[:, :, None] * at[lower][:, None]
        )
        return whole.reshape(upper.size, -1)


def _own_covariance(statistics: WindStatistics, form: _Form, knots: NDArray, values: NDArray) -> NDArray[np.float64]:
    """Return sigma sigma' Phi_11, with P = I, by fine steps of the splines themselves."""
    h = statistics.altitude / 1000.0
    spline = natural_spline(knots, values.T)

    def matrices(x: float) -> tuple[NDArray, NDArray, NDArray]:
        return form.matrices(spline(x), lambda *s: np.zeros(s), np.exp)

    correlation, columns = np.eye(h.size), matrices(h[0])[2]

    for i, edges in enumerate(divided(h, 0.05), start=1):
        for a, b in pairwise(edges):
            columns = transition(lambda x: matrices(x)[:2], a, b)[0] @ columns
        H = matrices(h[i])[2]
        correlation[i, :i] = correlation[:i, i] = (H.T @ columns)[0]
        columns = np.hstack([columns, H])
    return correlation * np.outer(statistics.standard_deviation, statistics.standard_deviation)


def _shaping_filter(statistics: WindStatistics, form: _Form, knots: NDArray, values: NDArray) -> ShapingFilter:
    altitude = dense_samples(statistics.altitude)
    found = [
        form.matrices(v, lambda *s: np.zeros(s), np.exp) for v in natural_spline(knots, values.T)(altitude / 1000.0)
    ]
    F, G, direction = (np.array(part) for part in zip(*found, strict=True))
    return ShapingFilter(
        "state_space_fit",
        altitude,
        F / 1000.0,
        G / np.sqrt(1000.0),
        statistics.standard_deviation_table().polynomial(altitude)[:, None] * direction[:, :, 0],
        np.eye(form.order),
        source=f"direct state-space fit to {statistics.name}: {statistics.source}",
    )
