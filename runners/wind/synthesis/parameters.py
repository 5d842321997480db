"""Parameter optimisation of a second-order filter (report 3.4.3): common factors first, then free at all altitudes.

    x'' + a1 x' + a0 x = n,   W = b1 x' + b0 x

The start is the linear regression. Beyond the report the states' covariance at the lowest level is fitted too.
"""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.wind.propagation import divided
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, fit_least_squares, residual_functions
from ..fitting.altitude_grid import propagated_covariance
from .linear_regression import companion_filter, regression_coefficients
from .result import SynthesisResult

METHOD = "parameter-optimisation"
FIT_STEP = 0.25  # km
TAYLOR = 4  # terms of the exponential over a step
SMOOTHNESS = 0.1  # m2/s2 a unit of second difference of ln a and b
LEAST = 1e-2  # of a0 and a1 at the start, 1/km2 and 1/km: regression may give an unstable filter


def synthesise_parameters(
    statistics: WindStatistics, order: int = 2, options: FitOptions | None = None
) -> SynthesisResult:
    """Fit a1, a0 (kept positive) and b1, b0 over altitude to all covariances."""
    options = options or FitOptions()
    above = statistics.between(statistics.altitude[1], statistics.altitude[-1])
    a, b = regression_coefficients(above, 2)
    k = statistics.altitude.size
    # the surface level is not equidistant with the others: it takes the coefficients of the next one
    a, b = (np.vstack([c[:1], c]) for c in (a, b))
    first = np.concatenate([np.log(np.maximum(a, LEAST)).ravel("F"), b.ravel("F")])
    root = np.array([1.0, 0.0, 1.0])
    x, covariance = _symbolic_covariance(statistics)
    upper = np.triu_indices(k)
    misfit = ca.vertcat(
        *(covariance[int(i), int(j)] - statistics.covariance[i, j] for i, j in zip(*upper, strict=True))
    )

    common = ca.SX.sym("common", 4 + 3)
    factors = [ca.DM(first[: 2 * k]) + ca.vertcat(*[common[i] * ca.DM.ones(k) for i in range(2)])]
    factors += [ca.vertcat(*[common[2 + i] * ca.DM(first[(2 + i) * k : (3 + i) * k]) for i in range(2)]), common[4:]]
    scaled = ca.substitute(misfit, x, ca.vertcat(*factors))
    together = fit_least_squares(
        residual_functions(scaled, common), np.concatenate([[0.0, 0.0, 1.0, 1.0], root]), options
    )
    start = np.array(ca.Function("start", [common], [ca.vertcat(*factors)])(together.unknowns)).ravel()

    difference = np.diff(np.eye(k), 2, axis=0)
    smooth = ca.vec(ca.DM(difference) @ ca.reshape(x[: 4 * k], k, 4))
    fit = fit_least_squares(residual_functions(ca.vertcat(misfit, SMOOTHNESS * smooth), x), start, options)
    values = fit.unknowns[: 4 * k].reshape(4, k).T
    lower = np.zeros((2, 2))
    lower[np.tril_indices(2)] = fit.unknowns[4 * k :]
    shaping_filter = companion_filter(METHOD, statistics, np.exp(values[:, :2]), values[:, 2:], lower @ lower.T)
    h = statistics.altitude
    count = len(upper[0])
    return SynthesisResult(
        METHOD,
        statistics,
        shaping_filter,
        propagated_covariance(shaping_filter, h),
        fit.converged,
        f"common factors reached {np.sqrt(2 * together.cost / count):.3g} m2/s2 rms; then {fit.message}",
        together.evaluations + fit.evaluations,
        together.seconds + fit.seconds,
        {
            "a_0": (h, np.exp(values[:, 0])),
            "a_1": (h, np.exp(values[:, 1])),
            "b_0": (h, values[:, 2]),
            "b_1": (h, values[:, 3]),
        },
    )


def _symbolic_covariance(statistics: WindStatistics) -> tuple[ca.SX, ca.SX]:
    """Return the unknowns (ln a0, ln a1, b0, b1 at each level, root of the start covariance) and the covariance."""
    h = statistics.altitude / 1000.0
    k = h.size
    x = ca.SX.sym("x", 4 * k + 3)
    table = ca.reshape(x[: 4 * k], k, 4)
    a = ca.exp(table[:, :2])
    lower = ca.SX.zeros(2, 2)
    lower[0, 0], lower[1, 0], lower[1, 1] = x[4 * k], x[4 * k + 1], x[4 * k + 2]
    P = lower @ lower.T
    result = ca.SX.zeros(k, k)
    columns = ca.SX(2, 0)
    for i in range(k):
        if i:
            edges = divided(h[i - 1 : i + 1], FIT_STEP)[0]
            total = ca.SX.eye(2)
            for low, high in itertools.pairwise(edges):
                share = (0.5 * (low + high) - h[i - 1]) / (h[i] - h[i - 1])
                middle = (1 - share) * a[i - 1, :] + share * a[i, :]
                phi, added = _step(middle, high - low)
                P, total = phi @ P @ phi.T + added, phi @ total
            columns = total @ columns
        row = table[i, 2:].T
        columns = ca.horzcat(columns, P @ row)
        values = columns.T @ row
        for j in range(i + 1):
            result[i, j] = result[j, i] = values[j]
    return x, result


def _step(a: ca.SX, length: float) -> tuple[ca.SX, ca.SX]:
    """Return transition and noise covariance over a step with constant coefficients."""
    F = ca.vertcat(ca.horzcat(0, 1), ca.horzcat(-a[0], -a[1]))
    phi, term = ca.SX.eye(2), ca.SX.eye(2)
    Q: NDArray | ca.SX = ca.SX.zeros(2, 2)
    noise: ca.SX = ca.SX(ca.DM([[0, 0], [0, 1]]))
    # Taylor series of both: Q' = F Q + Q F' + G G'
    rate = noise
    for q in range(1, TAYLOR + 1):
        term = length / q * (F @ term)
        phi += term
        Q += length**q / float(np.prod(np.arange(1, q + 1))) * rate
        rate = F @ rate + rate @ F.T
    return phi, Q
