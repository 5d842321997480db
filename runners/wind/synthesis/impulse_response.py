"""Impulse response generation and curve fit (report 3.4.5), with the step the report left undone.

Averages of g(h2, h) over the intervals between levels follow one after the other from the covariances (3-11): together
they are the Cholesky factor, COV = L L', L(i, j) = g(h_i, interval j) sqrt(interval). The curves of (3-10) are then
fitted to these averages. The first column stands for what lies below the lowest level: a start vector of the states.
"""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.wind.propagation import GAUSS, divided
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, fit_least_squares, residual_functions
from ..fitting.altitude_grid import knots_for, natural_spline, second_differences
from .response_form import ResponseForm, response_result
from .result import SynthesisError, SynthesisResult

METHOD = "impulse-response"
FIT_STEP = 0.5  # km
SMOOTHNESS, RIDGE = 0.05, 0.02  # m/s a unit of second difference and of value


def average_responses(statistics: WindStatistics) -> NDArray[np.float64]:
    """Return L (k, k), m/s: average responses times the root of the interval, (3-11) and the lines after it.

    Raises
    ------
    SynthesisError
        If the covariance is singular.
    """
    try:
        return np.asarray(np.linalg.cholesky(statistics.covariance), float)
    except np.linalg.LinAlgError:
        raise SynthesisError(
            f"the covariance of {statistics.name} is singular, so that average responses do not exist; "
            "take fewer levels or another method"
        ) from None


def synthesise_impulse_response(
    statistics: WindStatistics, order: int = 3, options: FitOptions | None = None
) -> SynthesisResult:
    """Fit the curves of (3-10) to the average responses between the levels."""
    form = ResponseForm(order)
    factor = average_responses(statistics)
    h = statistics.altitude / 1000.0
    knots = knots_for(statistics.altitude) / 1000.0
    table, first = ca.SX.sym("coefficients", knots.size, form.functions), ca.SX.sym("first", order)
    x = ca.vertcat(ca.vec(table), first)
    start = np.concatenate([np.repeat(form.start(), knots.size), np.ones(order)])
    misfit = _misfit(statistics, form, table, first, knots, h, factor)
    smooth = ca.vec(ca.DM(second_differences(knots.size)) @ table)
    residuals = ca.vertcat(misfit, SMOOTHNESS * smooth, RIDGE * (x - start))
    fit = fit_least_squares(residual_functions(residuals, x), start, options or FitOptions())
    split = knots.size * form.functions
    values = fit.unknowns[:split].reshape(form.functions, knots.size)
    p = fit.unknowns[split:]
    return response_result(METHOD, statistics, form, knots, values, np.outer(p, p), fit)


def _misfit(
    statistics: WindStatistics,
    form: ResponseForm,
    table: ca.SX,
    first: ca.SX,
    knots: NDArray,
    h: NDArray,
    factor: NDArray,
) -> ca.SX:
    basis = natural_spline(knots, np.eye(knots.size))
    gains = ca.DM(form.gains())

    def at(height: float):
        return form.split(ca.vec(ca.DM(basis(height)).T @ table))

    columns = first
    errors = [statistics.standard_deviation[0] * ca.dot(at(h[0])[2], first) - factor[0, 0]]
    for i, edges in enumerate(divided(h, FIT_STEP), start=1):
        phi, average = ca.SX.eye(form.order), ca.SX.zeros(form.order, 1)
        for a, b in itertools.pairwise(edges):
            sides = [at(0.5 * (a + b) + x * (b - a)) for x in (-GAUSS, GAUSS)]
            decay = 0.5 * (b - a) * (ca.exp(sides[0][0]) + ca.exp(sides[1][0]))
            turn = 0.5 * (b - a) * (sides[0][1] + sides[1][1])
            E, half = form.step(decay, turn), form.step(decay / 2, turn / 2)
            average = E @ average + (b - a) / 6 * (gains + 4 * (half @ gains) + E @ gains)
            phi = E @ phi
        columns = ca.horzcat(phi @ columns, average / np.sqrt(h[i] - h[i - 1]))
        row = statistics.standard_deviation[i] * at(h[i])[2]
        errors.append(columns.T @ row - ca.DM(factor[i, : i + 1]))
    return ca.vertcat(*errors)
