"""The form of impulse response that the report gives to a filter, (3-10), as a filter and as a covariance.

    g(h2, h) = A(h2) e^(alpha1(h) h) + B(h2) e^(alpha2(h) h) cos(omega(h) h + psi(h2))                    (3-10)

Only the products alpha1(h) h, alpha2(h) h and omega(h) h count: a1(h), a2(h) and theta(h) here. Appendix D turns the
second term into a differential equation of second order for g itself, and divides by theta' = omega + omega' h, which
may vanish. A first-order mode and a rotating pair need no division:

    z1' = -a1' z1 + n,   [z2; z3]' = [-a2' -theta'; theta' -a2'] [z2; z3] + [c; c] n,   W = H(h) z,

c = cos(pi/4), H = [A e^a1, B e^a2 cos(theta + psi + pi/4), B e^a2 sin(theta + psi + pi/4)]; its response to an impulse
at h is (3-10). A response at h2 to an impulse at h < h2 grows with h, so a1 and a2 increase.
"""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ....model.wind.shaping_filter import ShapingFilter
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import Fit
from ..fitting.altitude_grid import dense_samples, natural_spline, transition
from .result import SynthesisResult

GAUSS_POINTS = 8  # of each step of the response integral
DRIVE = np.pi / 4  # direction in which noise enters a rotating pair: neither state dies out where theta' vanishes


class ResponseForm:
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
        return np.array([1.0] * self.real + [np.cos(DRIVE), np.sin(DRIVE)] * self.pairs)

    def state_matrix(self, values: NDArray) -> NDArray[np.float64]:
        decay, turn, _ = self.split(values)
        decay = np.exp(decay)
        blocks = [-decay[:1].reshape(1, 1)] * self.real
        blocks += [np.array([[-a, -w], [w, -a]]) for a, w in zip(decay[self.real :], turn, strict=True)]
        return np.asarray(block_diag(*blocks))

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


def response_result(
    method: str,
    statistics: WindStatistics,
    form: ResponseForm,
    knots: NDArray,
    values: NDArray,
    start: NDArray,
    fit: Fit,
) -> SynthesisResult:
    """Return the filter of fitted coefficients.

    Parameters
    ----------
    knots : (k,) array
        km.
    values : (functions, k) array
        Of the form's functions at the knots; H is scaled to meet the standard deviation at every altitude.
    start : (n, n) array
        Covariance of the states at the lowest altitude.
    """
    spline = natural_spline(knots, values.T)
    altitude = dense_samples(statistics.altitude)
    h = altitude / 1000.0
    F = np.array([form.state_matrix(spline(x)) for x in h])
    G = form.gains()[:, None]
    P = [start]
    for a, b in itertools.pairwise(h):
        phi, added = transition(lambda x: (form.state_matrix(spline(x)), G), a, b)
        P.append(phi @ P[-1] @ phi.T + added)
    direction = np.array([form.split(spline(x))[2] for x in h])
    size = np.sqrt(np.einsum("ki,kij,kj->k", direction, P, direction) + 1e-12)
    deviation = statistics.standard_deviation_table().polynomial(altitude)
    H = direction * (deviation / size)[:, None]
    coefficients = _response_coefficients(form, spline, altitude, H)
    covariance = _response_covariance(form, spline, statistics.altitude, altitude, H, start)
    # Scaled by their own size s(h), states stay near one; with P' = -2 a' P + 1 that turns the decay a' into 1 / (2 P)
    # of a real mode and 1 / (2 trace P) of a pair, so the filter stays stable at every altitude
    F, scale = _scaled(form, F, np.array(P))
    shaping_filter = ShapingFilter(
        method.replace("-", "_"),
        altitude,
        F / 1000.0,
        G[None] / scale[:, :, None] / np.sqrt(1000.0),
        H * scale,
        P[0] / np.outer(scale[0], scale[0]),
        source=f"{method} fitted to {statistics.name}: {statistics.source}",
    )
    return SynthesisResult(
        method,
        statistics,
        shaping_filter,
        covariance,
        fit.converged,
        fit.message,
        fit.evaluations,
        fit.seconds,
        coefficients,
    )


def _scaled(form: ResponseForm, F: NDArray, P: NDArray) -> tuple[NDArray, NDArray]:
    """Return F of the scaled states, 1/km, and the scales (k, n)."""
    scale, scaled = np.empty((len(F), form.order)), F.copy()
    if form.real:
        scale[:, 0] = np.sqrt(P[:, 0, 0])
        scaled[:, 0, 0] = -0.5 / P[:, 0, 0]
    for p in range(form.pairs):
        i = form.real + 2 * p
        trace = P[:, i, i] + P[:, i + 1, i + 1]
        scale[:, i] = scale[:, i + 1] = np.sqrt(trace / 2)
        scaled[:, i, i] = scaled[:, i + 1, i + 1] = -0.5 / trace
    return scaled, scale


def _phases(form: ResponseForm, spline, h: NDArray) -> tuple[NDArray, NDArray]:
    """Return a (k, modes) and theta (k, pairs), integrals of the rates from the lowest altitude."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    a, theta = [np.zeros(form.rates)], [np.zeros(form.pairs)]
    for low, high in itertools.pairwise(h):
        decay, turn, _ = form.split(spline(0.5 * (low + high) + 0.5 * (high - low) * nodes).T)
        a.append(a[-1] + 0.5 * (high - low) * (np.exp(decay) @ weights))
        theta.append(theta[-1] + 0.5 * (high - low) * (turn @ weights))
    return np.array(a), np.array(theta)


def _response_row(form: ResponseForm, H: NDArray, a: NDArray, theta: NDArray) -> NDArray[np.float64]:
    """Return c(h2) with g(h2, h) = c(h2) phi(h): A, and B cos, B sin of psi + pi/4 of each pair."""
    row = np.empty_like(H)
    if form.real:
        row[:, 0] = H[:, 0] * np.exp(-a[:, 0])
    for p in range(form.pairs):
        i, size = form.real + 2 * p, np.exp(-a[:, form.real + p])
        c, s = np.cos(theta[:, p]), np.sin(theta[:, p])
        row[:, i] = size * (H[:, i] * c + H[:, i + 1] * s)
        row[:, i + 1] = size * (H[:, i + 1] * c - H[:, i] * s)
    return row


def _response_coefficients(
    form: ResponseForm, spline, altitude: NDArray, H: NDArray
) -> dict[str, tuple[NDArray, NDArray]]:
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
        found[f"psi{mark}"] = (altitude, np.unwrap(np.arctan2(row[:, i + 1], row[:, i])) - DRIVE)
        found[f"alpha_{form.real + p + 1}"] = (altitude[above], a[above, form.real + p] / length)
        found[f"omega{mark}"] = (altitude[above], theta[above, p] / length)
    return found


def _response_covariance(
    form: ResponseForm, spline, levels: NDArray, altitude: NDArray, H: NDArray, start: NDArray
) -> NDArray[np.float64]:
    """Return the integrals (3-9) of the products of (3-10), with the start covariance, at the levels."""
    h = altitude / 1000.0
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    a, theta = _phases(form, spline, h)
    M, moments = start.copy(), [start.copy()]
    for k, (low, high) in enumerate(itertools.pairwise(h)):
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


def _impulse_column(form: ResponseForm, a: NDArray, theta: NDArray) -> NDArray[np.float64]:
    """Return phi(h): e^a1, and e^a2 cos(theta - pi/4), -e^a2 sin(theta - pi/4) of each pair."""
    parts = [np.exp(a[:1])] * form.real
    for size, angle in zip(np.exp(a[form.real :]), theta, strict=True):
        parts.append(size * np.array([np.cos(angle - DRIVE), -np.sin(angle - DRIVE)]))
    return np.concatenate(parts)
