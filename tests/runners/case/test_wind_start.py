"""The covariance of the wind filter at the altitude where the flight starts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ascentwind.model.wind.shaping_filter import ShapingFilter
from ascentwind.model.wind.turbulence import realisation, turbulence_filter
from ascentwind.runners.case.wind_start import covariance_at


def test_stationary_filter_keeps_its_covariance(as504_closed_form):
    """The closed-form filter has diag(1, 3, 1) at every altitude; the study starts with it at 10 s (100 m)."""
    as504 = as504_closed_form
    shaping_filter = as504.vehicle.wind.shaping_filter
    for altitude in (3.0, 100.0, 9000.0):
        np.testing.assert_allclose(covariance_at(shaping_filter, altitude), np.diag([1.0, 3.0, 1.0]), atol=1e-8)
    first = as504.system.state_names.index("wind_1")
    start = as504.system.start_covariance_matrix("wind", as504.executable.parameters)
    np.testing.assert_allclose(start[first : first + 3, first : first + 3], np.diag([1.0, 3.0, 1.0]), atol=1e-8)


def test_filter_from_a_known_start_has_its_closed_form():
    """z' = -z/L + g n from Var 4 at 0 m: Var(h) = g^2 L/2 + (4 - g^2 L/2) exp(-2 h/L)."""
    length, gain, h = 2000.0, 0.05, np.linspace(0.0, 5000.0, 6)
    shaping_filter = ShapingFilter(
        "lag", h, np.full((6, 1, 1), -1 / length), np.full((6, 1, 1), gain), np.ones((6, 1)), np.array([[4.0]])
    )
    level = gain**2 * length / 2
    for altitude in (0.0, 700.0, 4321.0):
        expected = level + (4.0 - level) * np.exp(-2 * altitude / length)
        assert covariance_at(shaping_filter, altitude)[0, 0] == pytest.approx(expected, rel=1e-9)
    assert covariance_at(shaping_filter, -50.0)[0, 0] == 4.0


@pytest.mark.parametrize("length", [5.0, 20.0, 50.0, 500.0])
@pytest.mark.parametrize("altitude", [100.0, 163.0, 700.0, 19_999.0])
def test_fast_turbulence_stays_as_it_was(length, altitude):
    """Constant coefficients keep the stationary covariance, however long a step is against the filter."""
    shaping_filter = turbulence_filter("von-karman-3", length=length)
    np.testing.assert_allclose(covariance_at(shaping_filter, altitude), shaping_filter.start_covariance, atol=1e-10)


@pytest.mark.parametrize("size", [1e-6, 1e3, 1e8])
def test_units_of_the_states_do_not_matter(size):
    A, B, _ = realisation("dryden")
    h = np.arange(0.0, 1001.0, 250.0)
    F = A / 300.0 * (1 + 0.3 * np.sin(h / 300.0))[:, None, None]

    def of(size: float) -> np.ndarray:
        G = np.repeat(B[None] / 300.0**0.5 * size, h.size, axis=0)
        return covariance_at(ShapingFilter("sized", h, F, G, np.ones((h.size, 2)), np.eye(2) * size**2), 900.0)

    np.testing.assert_allclose(of(size) / size**2, of(1.0), rtol=1e-11)


def test_a_variance_that_vanishes_is_carried():
    """Two states that turn into each other without noise: after a quarter of a turn all is in the second."""
    w, h = np.pi / 2 / 700.0, np.array([0.0, 1000.0])
    F = np.repeat(np.array([[[0.0, -w], [w, 0.0]]]), 2, axis=0)
    turning = ShapingFilter("turning", h, F, np.zeros((2, 2, 1)), np.ones((2, 2)), np.diag([1.0, 0.0]))
    np.testing.assert_allclose(covariance_at(turning, 700.0), np.diag([0.0, 1.0]), atol=1e-12)


def test_start_is_that_of_the_differential_equation(as504):
    """By SciPy's DOP853 from sample to sample, where the coefficients have no corners."""
    shaping_filter, n = as504.vehicle.wind.shaping_filter, as504.vehicle.wind.shaping_filter.order
    samples = shaping_filter.altitude

    def rate(h, p):
        F, G, _ = shaping_filter.at(h)
        P = p.reshape(n, n)
        return (F @ P + P @ F.T + G @ G.T).ravel()

    for altitude in (as504.vehicle.start_altitude, 2345.6):
        P = shaping_filter.start_covariance.ravel()
        for span in pairwise([*samples[samples < altitude], altitude]):
            P = solve_ivp(rate, span, P, method="DOP853", rtol=1e-13, atol=1e-16).y[:, -1]
        deviation = np.sqrt(np.diag(P.reshape(n, n)))
        off = covariance_at(shaping_filter, altitude) - P.reshape(n, n)
        assert np.abs(off / np.outer(deviation, deviation)).max() < 1e-13
