"""Direct fit of a state-space filter whose states keep unit covariance at every altitude.

With P(h) = I the covariance equation P' = F P + P F' + G G' = 0 says F = S - G G'/2, S skew: any G and S give a filter
that is stable at every altitude (its symmetric part is -G G'/2), whose states all stay near one, and whose start
covariance is I, so that the wind has its variance from the ground up. A rotation of the states makes the wind
sigma(h) times the first state: the standard deviation is met exactly at every altitude, and only the correlations are
fitted. For one noise another rotation leaves two gains and two bands of S, 2 n - 1 functions of altitude.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.wind_filter import ShapingFilter
from ..model.wind_statistics import WindStatistics
from .altitude_grid import (
    covariance_data,
    covariance_symbols,
    dense_samples,
    divided,
    knots_for,
    natural_spline,
    second_differences,
    transition,
)
from .least_squares import FitOptions, Residuals, fit_least_squares, residual_functions
from .synthesis_result import SynthesisError, SynthesisResult

METHOD = "state-space"
FIT_STEP = 0.25  # km, of the propagation inside the fit
SMOOTHNESS, RIDGE = 0.5, 0.1  # m2/s2 a unit of second difference and of value: choose among equal fits
ENOUGH = 0.004  # rms error over mean variance; above it other starts are drawn, against local minima
FURTHER_STARTS, SPREAD = 6, 0.5  # a start is shifted by a normal deviate, one a function, 1/km or ln
TAYLOR = 6  # terms of the exponential over a step of the fit
LARGEST_GAIN = 3.0  # 1/sqrt(km): keeps decay over a step of the fit near one, where the series holds


class _Form:
    """Positions of the unknown functions of altitude in G (n, m) and the skew matrix S (n, n)."""

    def __init__(self, order: int, noises: int):
        self.order, self.noises = order, noises
        if noises == 1:
            self.gains = [(i, 0) for i in range(min(2, order))]
            bands: tuple[int, ...] = (1, 2)
        else:
            self.gains = [(i, j) for j in range(noises) for i in range(j, order)]
            bands = tuple(range(1, order))
        self.skew = [(i, i + b) for b in bands for i in range(order - b)]
        self.positive = [i == j or noises == 1 for i, j in self.gains]

    @property
    def functions(self) -> int:
        return len(self.gains) + len(self.skew)

    def start(self) -> NDArray[np.float64]:
        """Return a value of each function, in 1/km: gains fall and rotations are of the order of 0.3 rad/km."""
        gains = [np.log(0.4 / (LARGEST_GAIN - 0.4)) if p else 0.2 for p in self.positive]
        return np.array([*gains, *(0.3 / (j - i) for i, j in self.skew)])

    def matrices(self, values, zeros, exp):
        """Return F and G for the values of the functions, symbolic or numeric."""
        G, S = zeros(self.order, self.noises), zeros(self.order, self.order)
        for f, ((i, j), positive) in enumerate(zip(self.gains, self.positive, strict=True)):
            G[i, j] = LARGEST_GAIN / (1 + exp(-values[f])) if positive else values[f]
        for f, (i, j) in enumerate(self.skew, start=len(self.gains)):
            S[i, j], S[j, i] = values[f], -values[f]
        return S - G @ G.T / 2, G


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
    first = ca.SX.zeros(order, 1)
    first[0] = 1
    columns, errors = first, []
    basis = natural_spline(knots, np.eye(knots.size))
    for i, edges in enumerate(divided(h, FIT_STEP), start=1):
        phi = ca.SX.eye(order)
        for a, b in pairwise(edges):
            weights = ca.DM(basis(0.5 * (a + b))).T
            F, _ = form.matrices(ca.vec(weights @ table), ca.SX.zeros, ca.exp)
            term = phi
            for q in range(1, TAYLOR + 1):
                term = (b - a) / q * (F @ term)
                phi += term
        columns = phi @ columns
        errors += [columns[0, j] * deviation[i] * deviation[j] - covariance[i, j] for j in range(i)]
        columns = ca.horzcat(columns, first)
    smooth = ca.vec(ca.DM(second_differences(knots.size)) @ table)
    pull = x - np.repeat(form.start(), knots.size)
    return residual_functions(ca.vertcat(*errors, SMOOTHNESS * smooth, RIDGE * pull), x, data)


def _own_covariance(statistics: WindStatistics, form: _Form, knots: NDArray, values: NDArray) -> NDArray[np.float64]:
    """Return sigma sigma' Phi_11, with P = I, by fine steps of the splines themselves."""
    h = statistics.altitude / 1000.0
    first = np.eye(form.order)[:, :1]
    correlation, columns = np.eye(h.size), first

    spline = natural_spline(knots, values.T)

    def matrices(x: float) -> tuple[NDArray, NDArray]:
        return form.matrices(spline(x), lambda *s: np.zeros(s), np.exp)

    for i, edges in enumerate(divided(h, 0.05), start=1):
        for a, b in pairwise(edges):
            columns = transition(matrices, a, b)[0] @ columns
        correlation[i, :i] = correlation[:i, i] = columns[0]
        columns = np.hstack([columns, first])
    return correlation * np.outer(statistics.standard_deviation, statistics.standard_deviation)


def _shaping_filter(statistics: WindStatistics, form: _Form, knots: NDArray, values: NDArray) -> ShapingFilter:
    altitude = dense_samples(statistics.altitude)
    pairs = [
        form.matrices(v, lambda *s: np.zeros(s), np.exp) for v in natural_spline(knots, values.T)(altitude / 1000.0)
    ]
    H = np.zeros((altitude.size, form.order))
    H[:, 0] = statistics.standard_deviation_table().polynomial(altitude)
    return ShapingFilter(
        "state_space_fit",
        altitude,
        np.array([F for F, _ in pairs]) / 1000.0,
        np.array([G for _, G in pairs]) / np.sqrt(1000.0),
        H,
        np.eye(form.order),
        source=f"direct state-space fit to {statistics.name}: {statistics.source}",
    )
