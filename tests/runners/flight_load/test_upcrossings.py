"""Rice's rate of upcrossings: closed forms, the bound of the flight's probability, and where there is no rate."""

from __future__ import annotations

import warnings

import casadi as ca
import numpy as np
import pytest
from maxima import integrated, ornstein_uhlenbeck
from scipy.integrate import quad
from scipy.stats import norm

from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError
from ascentwind.runners import Study
from ascentwind.runners.flight_load.request import SpacingWarning
from ascentwind.runners.flight_load.upcrossings import NotDifferentiableError
from ascentwind.runners.statistics.percentiles import Sides

OMEGA, DAMPING = 3.0, 0.1


def oscillator(mean: float = 0.0, swell: float = 0.0) -> Study:
    """x'' + 2 z w x' + w^2 x = c n, stationary, of unit variance; y = (1 + swell t) x + mean t."""
    t, x, v, n, u = (ca.SX.sym(s) for s in ("t", "x", "v", "n", "u"))
    rate = -2 * DAMPING * OMEGA * v - OMEGA**2 * x + np.sqrt(4 * DAMPING * OMEGA**3) * n
    return Study.from_system(
        define_system(
            "oscillator",
            time=t,
            states={"x": (x, v), "v": (v, rate)},
            noises={"n": n},
            inputs={"u": (u, mean * t)},
            outputs={"y": (1 + swell * t) * x + u, "v": v, "none": 0 * x + u},
            start_covariance={"n": np.diag([1.0, OMEGA**2])},
            end=20.0,
        )
    )


def rice(m: float, s: float, a: float, b: float, u: float) -> float:
    """Integral of v p(u, v) over upward rates v, for y ~ N(m, s^2) and v given y = u ~ N(a, b^2), by quadrature."""
    integral, _ = quad(lambda v: v * norm.pdf(v, a, b), max(0.0, a - 12 * b), a + 12 * b, epsabs=0, epsrel=1e-10)
    return norm.pdf(u, m, s) * integral


@pytest.mark.parametrize("u", [0.0, 1.0, 4.0])
def test_a_stationary_oscillator_has_the_rate_of_rice(u):
    """omega / (2 pi) exp(-u^2 / 2) of each side, from any damping."""
    study = oscillator()
    expected = OMEGA / (2 * np.pi) * np.exp(-(u**2) / 2)
    counts: dict[Sides, int] = {"upper": 1, "lower": 1, "both": 2}
    for sides, count in counts.items():
        found = study.flight_load("y", (0.0, 10.0), 0.1, sides=sides, draws=200).upcrossing_rate(u)
        np.testing.assert_allclose(found, count * expected, rtol=1e-5)
        assert found.attrs["start_probability"] == pytest.approx(count * norm.sf(u), rel=1e-9)
        assert found.attrs["probability_bound"] == pytest.approx(count * (norm.sf(u) + 10 * expected), rel=1e-5)


def test_mean_and_output_that_move_in_time_are_in_the_rate():
    """y = (1 + k t) x + m t: y' = (1 + k t) v + k x + m, with x and v independent at an instant."""
    k, m, u = 0.3, 0.4, 5.0
    rate = oscillator(m, k).flight_load("y", (0.0, 10.0), 0.1, sides="upper", draws=200).upcrossing_rate(u)
    for t in (0.0, 2.5, 10.0):
        size = 1 + k * t
        expected = rice(m * t, size, m + k / size * (u - m * t), size * OMEGA, u)
        assert float(rate.sel(time=t, method="nearest")) == pytest.approx(expected, rel=1e-5)
    below = oscillator(m, k).flight_load("y", (0.0, 10.0), 0.1, sides="lower", draws=200).upcrossing_rate(u)
    expected = rice(-m * 2.5, 1 + k * 2.5, -m + k / (1 + k * 2.5) * (u + m * 2.5), (1 + k * 2.5) * OMEGA, u)
    assert float(below.sel(time=2.5, method="nearest")) == pytest.approx(expected, rel=1e-5)


def test_integrated_white_noise_from_rest_is_bounded_from_above():
    """Var z = t^3 / 3, Cov = t^2 / 2, Var w = t: given z = u, w ~ N(3 u / 2 t, t / 4)."""
    load = integrated(2.0).flight_load("z", probabilities=1e-3, sides="upper", draws=4000)
    u = load.level.item()
    rate = load.upcrossing_rate(u)
    for t in (0.5, 1.0, 2.0):
        expected = rice(0.0, np.sqrt(t**3 / 3), 1.5 * u / t, np.sqrt(t / 4), u)
        assert float(rate.sel(time=t, method="nearest")) == pytest.approx(expected, rel=1e-5)
    assert float(rate[0]) == 0.0  # from rest
    assert rate.attrs["start_probability"] == 0.0
    found = load.probability(u)
    bound = rate.attrs["probability_bound"]
    assert found.value - 4 * found.standard_error < bound
    assert bound < 1.2 * found.value  # a high level is seldom crossed twice


def test_a_narrow_band_is_crossed_in_clumps_and_bounded_all_the_same():
    load = oscillator().flight_load("y", (0.0, 10.0), [0.05, 1e-4], sides="both", draws=4000)
    for found in load.levels:
        bound = load.upcrossing_rate(found.value).attrs["probability_bound"]
        assert found.probability.value < bound < 3 * found.probability.value


@pytest.mark.parametrize("u", [float("nan"), float("inf"), "3", None, True, [1.0, 2.0], np.zeros(2)])
def test_levels_that_are_none_are_refused(u):
    load = oscillator().flight_load("y", (0.0, 10.0), 0.1, draws=200)
    assert load.probability(load.level[0].item()).value == load.probability(float(load.level[0])).value
    with pytest.raises(ParameterValueError, match="finite level"):
        load.upcrossing_rate(u)
    with pytest.raises(ParameterValueError, match="finite level"):
        load.probability(u)


def test_a_rough_response_has_no_rate():
    with pytest.raises(NotDifferentiableError, match=r"rate of 'y' directly at t = 0 s \(C B != 0\)"):
        ornstein_uhlenbeck().flight_load("y", probabilities=0.1, draws=200).upcrossing_rate(3.0)
    with pytest.raises(NotDifferentiableError, match="'v'"):
        oscillator().flight_load("v", (0.0, 10.0), 0.1, draws=200).upcrossing_rate(3.0)


@pytest.mark.slow
def test_the_engine_angle_of_as504_is_bounded_and_the_others_are_rough(as504):
    load = as504.flight_load("engine_angle", (40.0, 100.0), [0.01, 1e-4], draws=4000)
    for found in load.levels:
        bound = load.upcrossing_rate(found.value).attrs["probability_bound"]
        assert found.probability.value - 4 * found.probability.standard_error < bound < 2 * found.probability.value
    for name in ("bending_moment", "angle_of_attack"):
        with pytest.raises(NotDifferentiableError):
            as504.flight_load(name, (40.0, 100.0), 0.01, draws=200).upcrossing_rate(1.0)


def oscillation(frequency: float) -> Study:
    """A stationary oscillation of one rad/s after another, sigma 1, damped so much that its crests hardly clump."""
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    rate = -0.2 * frequency * v - frequency**2 * x + np.sqrt(0.4 * frequency**3) * n
    system = define_system(
        "oscillation", time=t, states={"x": (x, v), "v": (v, rate)}, noises={"n": n}, outputs={"y": x},
        start_covariance={"n": np.diag([1.0, frequency**2])}, end=120.0,
    )  # fmt: skip
    return Study.from_system(system)


@pytest.mark.slow
@pytest.mark.parametrize("frequency, end, told", [(20.0, 40.0, False), (130.0, 20.0, False), (130.0, 40.0, True)])
def test_a_fast_oscillation_is_resolved_or_told(frequency, end, told):
    """Rice: a level u is crossed w / 2 pi exp(-u^2 / 2) times a second, passed nearly as often; no level is higher."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load = oscillation(frequency).flight_load("y", (10.0, end), 1e-3, sides="upper")
    said = [w for w in caught if issubclass(w.category, SpacingWarning) and "swings within steps" in str(w.message)]
    assert bool(said) == told
    crossed = np.sqrt(2 * np.log(frequency / (2 * np.pi) * (end - 10.0) / 1e-3))
    assert load.level.item() == pytest.approx(crossed, rel=0.05 if told else 0.006)
