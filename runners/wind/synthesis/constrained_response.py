"""Constrained response optimisation (report 3.4.4): the coefficients of (3-10), fitted to the covariances.

H of the filter (runners/wind/synthesis/response_form.py) is scaled so that the standard deviation is met at every
altitude; rates a1' and a2' are kept positive. The states' covariance at the lowest altitude is fitted too: it stands
for the response to noise below it, and gives the wind its full variance from there up.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.errors import UnknownNameError
from ....model.wind.propagation import GAUSS, divided
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, Residuals, fit_least_squares, residual_functions
from ..fitting.altitude_grid import covariance_data, covariance_symbols, knots_for, natural_spline, second_differences
from .appendix_c import search_appendix_c
from .response_form import ResponseForm, response_result
from .result import SynthesisResult

METHOD = "constrained-response"
FIT_STEP = 0.5  # km
START_FLOOR = 0.25  # km, of each state's start variance: what unit noise brings over so much altitude
SMOOTHNESS, RIDGE = 0.3, 0.1  # m2/s2 a unit of second difference and of value: choose among equal fits
# Integrals from each of two Gauss points to the end of a unit step, by the straight line through both
TO_THE_END = tuple(
    tuple((GAUSS * (0.5 - g) - sign * (0.125 - g * g / 2)) / (2 * GAUSS) for sign in (1, -1)) for g in (-GAUSS, GAUSS)
)
SEARCHES = ("least-squares", "appendix-c")

Search = Literal["least-squares", "appendix-c"]


def synthesise_constrained_response(
    statistics: WindStatistics, order: int = 3, options: FitOptions | None = None, search: Search = "least-squares"
) -> SynthesisResult:
    """Fit the coefficients of (3-10) over altitude to all covariances.

    Parameters
    ----------
    statistics : WindStatistics
    order : int
        3 is the report's; each further pair of states adds a term like the second.
    search : {'least-squares', 'appendix-c'}
        Levenberg-Marquardt, or the report's own descent, for comparison.
    """
    if search not in SEARCHES:
        raise UnknownNameError("search", search, SEARCHES)
    options = options or FitOptions()
    form = ResponseForm(order)
    knots = knots_for(statistics.altitude) / 1000.0
    start = _start(form, knots.size)
    errors, residuals, groups = _residuals(tuple(statistics.altitude.tolist()), order)
    data = covariance_data(statistics)
    if search == "least-squares":
        fit = fit_least_squares(residuals, start, options, data)
    else:
        fit = search_appendix_c(errors, start, groups, options, data)
    split = knots.size * form.functions
    lower = np.zeros((order, order))
    lower[np.tril_indices(order)] = fit.unknowns[split:]
    values = fit.unknowns[:split].reshape(form.functions, knots.size)
    return response_result(METHOD, statistics, form, knots, values, lower @ lower.T + START_FLOOR * np.eye(order), fit)


def _start(form: ResponseForm, knots: int) -> NDArray[np.float64]:
    return np.concatenate([np.repeat(form.start(), knots), np.eye(form.order)[np.tril_indices(form.order)] * 1.5])


@lru_cache(maxsize=8)
def _residuals(altitude: tuple[float, ...], order: int) -> tuple[ca.Function, Residuals, NDArray[np.int_]]:
    """Return the cost with its gradient, the residuals of least squares, and the set of each unknown."""
    form, levels = ResponseForm(order), np.array(altitude)
    h, knots = levels / 1000.0, knots_for(levels) / 1000.0
    table = ca.SX.sym("coefficients", knots.size, form.functions)
    root = ca.SX.sym("root", order * (order + 1) // 2)
    x = ca.vertcat(ca.vec(table), root)
    data, deviation, covariance = covariance_symbols(h.size)
    n, gains = form.order, ca.DM(form.gains())
    lower = ca.SX.zeros(n, n)
    for value, i, j in zip(ca.vertsplit(root), *np.tril_indices(n), strict=True):
        lower[int(i), int(j)] = value
    basis = natural_spline(knots, np.eye(knots.size))

    def at(height: float) -> ca.SX:
        return ca.vec(ca.DM(basis(height)).T @ table)

    def direction(height: float) -> ca.SX:
        row = form.split(at(height))[2]
        return row / ca.sqrt(ca.dot(row, P @ row) + 1e-12)

    P = lower @ lower.T + START_FLOOR * ca.SX.eye(n)
    columns = P @ direction(h[0])
    errors = []
    for i, edges in enumerate(divided(h, FIT_STEP), start=1):
        phi = ca.SX.eye(n)
        for a, b in itertools.pairwise(edges):
            sides = [form.split(at(0.5 * (a + b) + x * (b - a))) for x in (-GAUSS, GAUSS)]
            rates = [(ca.exp(decay), turn) for decay, turn, _ in sides]

            def step(first: float, second: float, rates=rates, length=b - a) -> ca.SX:
                (d1, t1), (d2, t2) = rates
                return form.step(length * (first * d1 + second * d2), length * (first * t1 + second * t2))

            E = step(0.5, 0.5)
            P, phi = E @ P @ E.T, E @ phi
            for weights in TO_THE_END:
                impulse = step(*weights) @ gains
                P += 0.5 * (b - a) * (impulse @ impulse.T)
        columns = phi @ columns
        row = direction(h[i])
        errors += [ca.dot(row, columns[:, j]) * deviation[i] * deviation[j] - covariance[i, j] for j in range(i)]
        columns = ca.horzcat(columns, P @ row)
    misfit = ca.vertcat(*errors)
    smooth = ca.vec(ca.DM(second_differences(knots.size)) @ table)
    pull = x - _start(form, knots.size)
    groups = np.concatenate([np.repeat(np.arange(form.functions), knots.size), np.full(root.numel(), form.functions)])
    return (
        ca.Function("errors", [x, data], [ca.sumsqr(misfit) / 2, ca.gradient(ca.sumsqr(misfit) / 2, x)]),
        residual_functions(ca.vertcat(misfit, SMOOTHNESS * smooth, RIDGE * pull), x, data),
        groups,
    )
