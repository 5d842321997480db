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
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.wind.propagation import divided
from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, Residuals, fit_least_squares, residual_functions
from ..fitting.altitude_grid import (
    covariance_data,
    covariance_symbols,
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
    functions = _residuals(tuple(statistics.altitude.tolist()), order, noises)
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


@lru_cache(maxsize=8)
def _residuals(altitude: tuple[float, ...], order: int, noises: int) -> Residuals:
    """Return the errors of the distinct covariances, m2/s2, and what chooses among equal fits."""
    form, levels = _Form(order, noises), np.array(altitude)
    h, knots = levels / 1000.0, knots_for(levels) / 1000.0
    x = ca.SX.sym("x", knots.size * form.functions)
    table = ca.reshape(x, knots.size, form.functions)
    data, deviation, covariance = covariance_symbols(h.size)
    basis = natural_spline(knots, np.eye(knots.size))

    def matrices(x: float):
        return form.matrices(ca.vec(ca.DM(basis(x)).T @ table), ca.SX.zeros, ca.exp)

    columns, errors = matrices(h[0])[2], []
    for i, edges in enumerate(divided(h, FIT_STEP), start=1):
        phi = ca.SX.eye(order)
        for a, b in pairwise(edges):
            F, _, _ = matrices(0.5 * (a + b))
            term = phi
            for q in range(1, TAYLOR + 1):
                term = (b - a) / q * (F @ term)
                phi += term
        columns = phi @ columns
        H = matrices(h[i])[2]
        errors += [ca.dot(H, columns[:, j]) * deviation[i] * deviation[j] - covariance[i, j] for j in range(i)]
        columns = ca.horzcat(columns, H)
    smooth = ca.vec(ca.DM(second_differences(knots.size)) @ table)
    pull = x - np.repeat(form.start(), knots.size)
    return residual_functions(ca.vertcat(*errors, SMOOTHNESS * smooth, RIDGE * pull), x, data)


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
