"""The wind of the report's Appendices A, D and E, and the exact third-order filter, against independent routes."""

from __future__ import annotations

import csv
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad, solve_ivp

from ascentwind.model import load_vehicle
from ascentwind.model.wind.shaping_filter import TwoPartKernel
from ascentwind.model.wind.statistics import report_standard_deviation

ROOT = Path(__file__).parents[3]
SHARED = ROOT.parent / "shared" / "data" / "wind"
SHIPPED_TABLE = SHARED / "march_zonal_corr_reconstructed_third_order_0_20km.csv"
KM = np.arange(17) * 1000.0

# knots (km) of the reconstruction's third-order variant, as published with it: L_long, L_short, b^2
LONG = ([0, 4.5, 11, 15, 20], [15.13, 16.47, 12.80, 10.0, 7.0])
SHORT = ([0, 11, 15, 20], [1.374, 2.959, 2.0, 1.2])
SHARE = ([0, 2.3, 5.0, 11, 15, 20], [0.651, 0.327, 0.145, 0.233, 0.27, 0.35])


@pytest.fixture(scope="module")
def vehicle(closed_form_folder):
    return load_vehicle(closed_form_folder)


@pytest.fixture(scope="module")
def kernel(vehicle) -> TwoPartKernel:
    """The kernel of the vehicle's own file."""
    knots = vehicle.file.wind.correlation
    profiles = (knots.long_scale_m, knots.short_scale_m, knots.short_fraction)
    long, short, fraction = ((np.array(p.altitude_m), np.array(p.value)) for p in profiles)
    return TwoPartKernel(long, short, fraction)


def warp(knots, h):
    """Return the integral of dh / L from 0 to h (km) by adaptive quadrature between the knots."""
    x, log_scale = knots[0], np.log(knots[1])
    edges = [0.0, *(k for k in x if 0 < k < h), h]
    pieces = itertools.pairwise(edges)
    return sum(quad(lambda s: np.exp(-np.interp(s, x, log_scale)), a, b, epsrel=1e-13)[0] for a, b in pieces)


def reconstructed_correlation(altitude_km):
    """rho = a a' (1 + r) exp(-r) + b b' exp(-d), r = sqrt(3) |s_L - s_L'|, d = |s_S - s_S'|."""
    p = np.array(SHARE[1])
    b2 = 1 / (1 + np.exp(-np.interp(altitude_km, SHARE[0], np.log(p / (1 - p)))))
    s_long, s_short = (np.array([warp(k, h) for h in altitude_km]) for k in (LONG, SHORT))
    r = np.sqrt(3) * np.abs(np.subtract.outer(s_long, s_long))
    d = np.abs(np.subtract.outer(s_short, s_short))
    return np.sqrt(np.outer(1 - b2, 1 - b2)) * (1 + r) * np.exp(-r) + np.sqrt(np.outer(b2, b2)) * np.exp(-d)


def test_kernel_equals_the_formula_integrated_independently(kernel):
    h = np.array([0.0, 0.4, 1.0, 2.3, 2.75, 5.0, 7.7, 11.0, 12.3, 16.0, 20.0])
    np.testing.assert_allclose(kernel.correlation(h * 1000), reconstructed_correlation(h), rtol=0, atol=1e-11)


@pytest.mark.skipif(not SHIPPED_TABLE.exists(), reason="the reconstruction's table is not beside the repository")
def test_kernel_equals_the_published_table_within_its_rounding(kernel):
    with SHIPPED_TABLE.open() as file:
        rows = np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])
    found = kernel.correlation(rows[:, 0] * 1000)
    assert rows.shape == (21, 22)
    assert np.abs(found - rows[:, 1:]).max() <= 0.5e-4 + 1e-6  # four decimals, of a trapezoidal warp with 5 m steps


def test_report_standard_deviation_meets_the_range_reference_atmosphere(vehicle):
    table = {float(r[0]): float(r[2]) for r in statistics_rows(vehicle)}
    h = np.arange(1, 17) * 1000.0
    rms = np.sqrt(np.mean((report_standard_deviation(h) - [table[x] for x in h]) ** 2))
    assert rms <= 0.73 + 0.005
    assert np.abs(report_standard_deviation(h) - [table[x] for x in h]).max() < 1.3


def statistics_rows(vehicle):
    lines = (vehicle.folder / "wind_march_zonal.csv").read_text().splitlines()
    return list(csv.reader(line for line in lines if not line.startswith("#")))[1:]


def test_report_standard_deviation_is_appendix_a_and_its_printed_b3_explodes():
    h, B1, B2, B3, B4, B5, B6, B7 = sp.symbols("h B1:8")
    sigma = B1 + B2 * sp.exp(B3 * (h - B4) ** 2) + B5 * (h / 22) ** B6 * (1 - h / 22) ** B7
    printed = {B1: 6.64392, B2: 3.63807, B3: 0.157801, B4: 11.379, B5: 121.02, B6: 2.11731, B7: 2.36174}
    for altitude in (1, 8, 11.379, 16):
        value = float(sigma.subs({**printed, B3: -printed[B3], h: altitude}))
        assert report_standard_deviation(altitude * 1000.0) == pytest.approx(value, rel=1e-12)
    assert float(sigma.subs({**printed, h: 0})) > 1e9
    assert report_standard_deviation(0.0) == pytest.approx(6.64, abs=0.01)


def test_d_10_follows_from_d_6_and_d_8_lacks_one_h():
    h, B, psi = sp.symbols("h B psi")
    damping, frequency = sp.Function("alpha2")(h), sp.Function("omega")(h)
    g = B * sp.exp(damping * h) * sp.cos(frequency * h + psi)
    a, w = damping + damping.diff(h) * h, frequency + frequency.diff(h) * h
    a1, w1 = 2 * damping.diff(h) + damping.diff(h, 2) * h, 2 * frequency.diff(h) + frequency.diff(h, 2) * h
    d10 = (a1 - w**2 - a**2 - w1 / w * a) * g + (2 * a + w1 / w) * g.diff(h)
    assert sp.simplify(g.diff(h, 2) - d10) == 0
    envelope = B * sp.exp(damping * h)
    cosine, sine = envelope * sp.cos(frequency * h + psi), envelope * sp.sin(frequency * h + psi)
    d8 = a**2 * cosine + a1 * cosine - a * sine * w - a * (frequency + frequency.diff(h)) * sine
    d8 = d8 - w**2 * cosine - w1 * sine
    assert sp.simplify(g.diff(h, 2) - d8) != 0
    misprint = -a * frequency.diff(h) * (h - 1) * sine
    assert sp.simplify(g.diff(h, 2) - (d8 + misprint)) == 0


def test_appendix_e_holds_for_the_homogeneous_filter():
    t, height = sp.symbols("t height")
    C2, C3 = (sp.Function(n)(height) for n in ("C2", "C3"))
    climb, g = sp.Function("h")(t), sp.Function("g")
    z, v = g(climb), climb.diff(t)
    derivatives: list[Any] = [g(height).diff(height, n).subs(height, climb) for n in (1, 2)]
    g_h, g_hh = derivatives
    R2, R3 = v.diff(t) / v + v * C2.subs(height, climb), v**2 * C3.subs(height, climb)
    residual = z.diff(t, 2) - R2 * z.diff(t) - R3 * z
    law = v**2 * (g_hh - C2.subs(height, climb) * g_h - C3.subs(height, climb) * g(climb))
    assert sp.simplify((residual - law).doit()) == 0


def closed_form_matrices(long, short):
    """F and G of the filter for constant scales."""
    root = sp.sqrt(3)
    F = sp.Matrix([[0, 1 / long, 0], [-3 / long, -2 * root / long, 0], [0, 0, -1 / short]])
    return F, sp.Matrix([[0, 0], [sp.sqrt(12 * root / long), 0], [0, sp.sqrt(2 / short)]])


def test_start_covariance_is_stationary_and_gives_the_kernel():
    long, short, d = sp.symbols("L S d", positive=True)
    b2 = sp.Symbol("b2", positive=True)
    F, G = closed_form_matrices(long, short)
    P = sp.diag(1, 3, 1)
    assert (F * P + P * F.T + G * G.T).applyfunc(sp.simplify).is_zero_matrix
    # Cov(x(h + d), x(h)) = exp(F d) P: the matrix below starts there and obeys the same equation
    r = sp.sqrt(3) * d / long
    lag = sp.Matrix([[1 + r, d / long, 0], [-3 * d / long, 1 - r, 0], [0, 0, 0]]) * sp.exp(-r)
    lag += sp.diag(0, 0, sp.exp(-d / short))
    assert lag.subs(d, 0) == sp.eye(3)
    assert (lag.diff(d) - F * lag).applyfunc(sp.simplify).is_zero_matrix
    H = sp.Matrix([[sp.sqrt(1 - b2), 0, sp.sqrt(b2)]])
    correlation = (H * lag * P * H.T)[0]
    kernel = (1 - b2) * (1 + r) * sp.exp(-r) + b2 * sp.exp(-d / short)
    assert sp.simplify(correlation - kernel) == 0


def test_filter_coefficients_are_the_closed_form(vehicle, kernel):
    shaping_filter = vehicle.wind.shaping_filter
    for i in range(0, shaping_filter.altitude.size, 7):
        long, short, b2 = kernel.scales(shaping_filter.altitude[i])
        F, G = (np.array(m, float) for m in closed_form_matrices(float(long), float(short)))
        np.testing.assert_allclose(shaping_filter.F[i], F, rtol=1e-14)
        np.testing.assert_allclose(shaping_filter.G[i], G, rtol=1e-14)
        shares = np.array([np.sqrt(1 - b2), 0, np.sqrt(b2)])
        np.testing.assert_allclose(shaping_filter.H[i] / np.linalg.norm(shaping_filter.H[i]), shares, rtol=1e-12)
    assert np.array_equal(shaping_filter.start_covariance, np.diag([1.0, 3.0, 1.0]))


def propagated_covariance(shaping_filter, altitude):
    """Return the covariance of the wind at the altitudes: dP/dh = F P + P F' + G G', dK/dh = F K from each level."""
    n, count = shaping_filter.order, altitude.size
    covariance = np.zeros((count, count))
    stack = [shaping_filter.start_covariance]
    knots = [x for x in shaping_filter.kinks if altitude[0] < x < altitude[-1]]
    H = [shaping_filter.at(h)[2] for h in altitude]

    def rate(h, flat):
        F, G, _ = shaping_filter.at(h)
        P, *others = flat.reshape(-1, n, n)
        return np.concatenate([(F @ P + P @ F.T + G @ G.T).ravel(), *((F @ K).ravel() for K in others)])

    for j, h in enumerate(altitude):
        stack.append(stack[0])
        covariance[j, : j + 1] = covariance[: j + 1, j] = [H[j] @ K @ H[i] for i, K in enumerate(stack[1:])]
        edges = [] if j + 1 == count else [h, *(k for k in knots if h < k < altitude[j + 1]), altitude[j + 1]]
        for low, high in itertools.pairwise(edges):
            start = np.concatenate([K.ravel() for K in stack])
            flat = solve_ivp(rate, (low, high), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
            stack = list(flat.reshape(-1, n, n))
    return covariance


def test_propagating_the_filter_gives_the_covariance_it_was_made_for(vehicle, kernel):
    shaping_filter = vehicle.wind.shaping_filter
    rows = statistics_rows(vehicle)
    table = {float(r[0]): float(r[2]) for r in rows}
    altitude = np.append(float(rows[0][0]), KM[1:])
    sigma = np.array([table[h] for h in altitude])
    expected = np.outer(sigma, sigma) * kernel.correlation(altitude)
    found = propagated_covariance(shaping_filter, altitude)
    assert np.abs(found / expected - 1).max() < 1e-6
