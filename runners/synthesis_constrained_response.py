"""Constrained response optimisation (report 3.4.4): the response to an impulse has a given form.

    g(h2, h) = A(h2) e^(alpha1(h) h) + B(h2) e^(alpha2(h) h) cos(omega(h) h + psi(h2))                    (3-10)

Only the products alpha1(h) h, alpha2(h) h and omega(h) h count: a1(h), a2(h) and theta(h) here. Appendix D turns the
second term into a differential equation of second order for g itself, and divides by theta' = omega + omega' h, which
may vanish. A first-order mode and a rotating pair need no division:

    z1' = -a1' z1 + n,   [z2; z3]' = [-a2' -theta'; theta' -a2'] [z2; z3] + [1; 0] n,   W = H(h) z,

H = [A e^a1, B e^a2 cos(theta + psi), -B e^a2 sin(theta + psi)]; its response to an impulse at h is (3-10). Rates a1' and
a2' are kept positive, so the filter is stable at every altitude. In the fit H is scaled so that the standard deviation
is met at every altitude, and the states' covariance at the lowest altitude is fitted too: it stands for the response
to noise below it, and gives the wind its full variance from there up.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ..model.errors import UnknownNameError
from ..model.wind_filter import ShapingFilter
from ..model.wind_statistics import WindStatistics
from .altitude_grid import GAUSS, dense_samples, divided, knots_for, natural_spline, second_differences, transition
from .least_squares import Fit, FitOptions, fit_least_squares
from .search_appendix_c import search_appendix_c
from .synthesis_result import SynthesisResult

METHOD = "constrained-response"
FIT_STEP = 0.5  # km
SMOOTHNESS, RIDGE = 0.3, 0.1  # m2/s2 a unit of second difference and of value: choose among equal fits
GAUSS_POINTS = 8  # of each step of the response integral
# Integrals from each of two Gauss points to the end of a unit step, by the straight line through both
TO_THE_END = tuple(
    tuple((GAUSS * (0.5 - g) - sign * (0.125 - g * g / 2)) / (2 * GAUSS) for sign in (1, -1)) for g in (-GAUSS, GAUSS)
)
SEARCHES = ("least-squares", "appendix-c")

Search = Literal["least-squares", "appendix-c"]


class _Form:
    """A real mode when the order is odd, and rotating pairs."""

    def __init__(self, order: int):
        self.order, self.real, self.pairs = order, order % 2, order // 2
        self.rates = self.real + self.pairs  # log of a', one a mode
        self.functions = self.rates + self.pairs + order  # then theta' of each pair, then the direction of H

    def start(self) -> NDArray[np.float64]:
        """Return values from which every case starts: decays over a few km, slow rotation, equal parts."""
        decay = np.log(0.1 * 3.0 ** np.arange(self.rates))
        return np.concatenate([decay, np.full(self.pairs, 0.3), np.ones(self.order)])

    def split(self, values):
        """Return rates a' (1/km), rotations theta' (rad/km) and the direction of H."""
        return values[: self.rates], values[self.rates : self.rates + self.pairs], values[self.rates + self.pairs :]

    def gains(self) -> NDArray[np.float64]:
        return np.array([1.0] * self.real + [1.0, 0.0] * self.pairs)

    def state_matrix(self, values: NDArray) -> NDArray[np.float64]:
        decay, turn, _ = self.split(values)
        decay = np.exp(decay)
        blocks = [-decay[:1].reshape(1, 1)] * self.real
        blocks += [np.array([[-a, -w], [w, -a]]) for a, w in zip(decay[self.real :], turn, strict=True)]
        return block_diag(*blocks)

    def step(self, decay: ca.SX, turn: ca.SX) -> ca.SX:
        """Return the transition over which the phases a and theta grow by ``decay`` and ``turn``."""
        E = ca.SX.zeros(self.order, self.order)
        if self.real:
            E[0, 0] = ca.exp(-decay[0])
        for p in range(self.pairs):
            i = self.real + 2 * p
            size = ca.exp(-decay[self.real + p])
            E[i, i] = E[i + 1, i + 1] = size * ca.cos(turn[p])
            E[i + 1, i] = size * ca.sin(turn[p])
            E[i, i + 1] = -E[i + 1, i]
        return E


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
    form = _Form(order)
    h = statistics.altitude / 1000.0
    knots = knots_for(statistics.altitude) / 1000.0
    table = ca.SX.sym("coefficients", knots.size, form.functions)
    root = ca.SX.sym("root", order * (order + 1) // 2)
    x = ca.vertcat(ca.vec(table), root)
    start = np.concatenate([np.repeat(form.start(), knots.size), np.eye(order)[np.tril_indices(order)] * 1.5])
    misfit = _misfit(statistics, form, table, root, knots, h)
    smooth = ca.vec(ca.DM(second_differences(knots.size)) @ table)
    if search == "least-squares":
        residuals = ca.vertcat(misfit, SMOOTHNESS * smooth, RIDGE * (x - start))
        fit = fit_least_squares(residuals, x, start, options)
    else:
        groups = np.concatenate([np.repeat(np.arange(form.functions), knots.size), np.full(root.numel(), form.functions)])
        fit = search_appendix_c(misfit, x, start, groups, options)
    return _result(statistics, form, knots, fit)


def _lower(values: NDArray, order: int) -> NDArray[np.float64]:
    root = np.zeros((order, order))
    root[np.tril_indices(order)] = values
    return root


def _misfit(
    statistics: WindStatistics, form: _Form, table: ca.SX, root: ca.SX, knots: NDArray, h: NDArray
) -> ca.SX:
    """Return the errors of the distinct covariances of different altitudes, m2/s2."""
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

    P = lower @ lower.T
    columns = P @ direction(h[0])
    errors = []
    covariance, deviation = statistics.covariance, statistics.standard_deviation
    for i, edges in enumerate(divided(h, FIT_STEP), start=1):
        phi = ca.SX.eye(n)
        for a, b in zip(edges[:-1], edges[1:], strict=True):
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
    return ca.vertcat(*errors)


def _result(statistics: WindStatistics, form: _Form, knots: NDArray, fit: Fit) -> SynthesisResult:
    n = form.order
    split = knots.size * form.functions
    values = fit.unknowns[:split].reshape(form.functions, knots.size)
    root = _lower(fit.unknowns[split:], n)
    spline = natural_spline(knots, values.T)
    altitude = dense_samples(statistics.altitude)
    h = altitude / 1000.0
    F = np.array([form.state_matrix(spline(x)) for x in h])
    G = form.gains()[:, None]
    P = [root @ root.T]
    for a, b in zip(h[:-1], h[1:], strict=True):
        phi, added = transition(lambda x: (form.state_matrix(spline(x)), G), a, b)
        P.append(phi @ P[-1] @ phi.T + added)
    direction = np.array([form.split(spline(x))[2] for x in h])
    size = np.sqrt(np.einsum("ki,kij,kj->k", direction, P, direction) + 1e-12)
    deviation = statistics.standard_deviation_table().polynomial(altitude)
    H = direction * (deviation / size)[:, None]
    coefficients = _response_coefficients(form, spline, altitude, H)
    covariance = _response_covariance(form, spline, statistics.altitude, altitude, H, root @ root.T)
    # each state on a constant scale of its own, so that all stay near one
    scale = np.sqrt(np.exp(np.mean(np.log([np.diag(p) for p in P]), axis=0)))
    if form.pairs:
        for p in range(form.pairs):
            i = form.real + 2 * p
            scale[i : i + 2] = np.sqrt(scale[i] * scale[i + 1])
    shaping_filter = ShapingFilter(
        "constrained_response",
        altitude,
        F / 1000.0,
        np.repeat((G / scale[:, None] / np.sqrt(1000.0))[None], h.size, axis=0),
        H * scale,
        root @ root.T / np.outer(scale, scale),
        source=f"constrained response fitted to {statistics.name}: {statistics.source}",
    )
    result = SynthesisResult(
        METHOD, statistics, shaping_filter, covariance, fit.converged, fit.message, fit.evaluations, fit.seconds
    )
    return replace(result, coefficients=coefficients)


def _phases(form: _Form, spline, h: NDArray) -> tuple[NDArray, NDArray]:
    """Return a (k, modes) and theta (k, pairs), integrals of the rates from the lowest altitude."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    a, theta = [np.zeros(form.rates)], [np.zeros(form.pairs)]
    for low, high in zip(h[:-1], h[1:], strict=True):
        decay, turn, _ = form.split(spline(0.5 * (low + high) + 0.5 * (high - low) * nodes).T)
        a.append(a[-1] + 0.5 * (high - low) * (np.exp(decay) @ weights))
        theta.append(theta[-1] + 0.5 * (high - low) * (turn @ weights))
    return np.array(a), np.array(theta)


def _response_row(form: _Form, H: NDArray, a: NDArray, theta: NDArray) -> NDArray[np.float64]:
    """Return c(h2) with g(h2, h) = c(h2) phi(h): A, and B cos psi, -B sin psi of each pair."""
    row = np.empty_like(H)
    if form.real:
        row[:, 0] = H[:, 0] * np.exp(-a[:, 0])
    for p in range(form.pairs):
        i, size = form.real + 2 * p, np.exp(-a[:, form.real + p])
        c, s = np.cos(theta[:, p]), np.sin(theta[:, p])
        row[:, i] = size * (H[:, i] * c + H[:, i + 1] * s)
        row[:, i + 1] = size * (H[:, i + 1] * c - H[:, i] * s)
    return row


def _response_coefficients(form: _Form, spline, altitude: NDArray, H: NDArray) -> dict[str, tuple[NDArray, NDArray]]:
    """Return A, B, psi over the altitude of the response and alpha, omega over that of the impulse, in m."""
    a, theta = _phases(form, spline, altitude / 1000.0)
    row = _response_row(form, H, a, theta) / np.sqrt(1000.0)
    above = altitude > altitude[0]
    # the report measures phases from altitude zero; here they start at the lowest altitude
    length = (altitude - altitude[0])[above]
    found: dict[str, tuple[NDArray, NDArray]] = {}
    if form.real:
        found["A"] = (altitude, row[:, 0])
        found["alpha_1"] = (altitude[above], a[above, 0] / length)
    for p in range(form.pairs):
        i, mark = form.real + 2 * p, "" if p == 0 else f"_{p + 1}"
        found[f"B{mark}"] = (altitude, np.hypot(row[:, i], row[:, i + 1]))
        found[f"psi{mark}"] = (altitude, np.unwrap(np.arctan2(-row[:, i + 1], row[:, i])))
        found[f"alpha_{form.real + p + 1}"] = (altitude[above], a[above, form.real + p] / length)
        found[f"omega{mark}"] = (altitude[above], theta[above, p] / length)
    return found


def _response_covariance(
    form: _Form, spline, levels: NDArray, altitude: NDArray, H: NDArray, start: NDArray
) -> NDArray[np.float64]:
    """Return the integrals (3-9) of the products of (3-10), with the start covariance, at the levels."""
    h = altitude / 1000.0
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    a, theta = _phases(form, spline, h)
    M, moments = start.copy(), [start.copy()]
    for k, (low, high) in enumerate(zip(h[:-1], h[1:], strict=True)):
        for x, weight in zip(0.5 * (low + high) + 0.5 * (high - low) * nodes, weights, strict=True):
            inside_a, inside_theta = _phases(form, spline, np.array([low, x]))
            phi = _impulse_column(form, a[k] + inside_a[1], theta[k] + inside_theta[1])
            M = M + 0.5 * (high - low) * weight * np.outer(phi, phi)
        moments.append(M)
    at = np.searchsorted(altitude, levels)
    rows = _response_row(form, H, a, theta)[at]
    result = np.empty((levels.size, levels.size))
    for j, k in enumerate(at):
        result[j:, j] = result[j, j:] = rows[j:] @ moments[k] @ rows[j]
    return result


def _impulse_column(form: _Form, a: NDArray, theta: NDArray) -> NDArray[np.float64]:
    """Return phi(h): e^a1, and e^a2 cos theta, -e^a2 sin theta of each pair."""
    parts = [np.exp(a[:1])] * form.real
    for size, angle in zip(np.exp(a[form.real :]), theta, strict=True):
        parts.append(size * np.array([np.cos(angle), -np.sin(angle)]))
    return np.concatenate(parts)
