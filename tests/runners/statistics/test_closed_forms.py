"""Systems whose variance is known in closed form, written by a user in a few lines of CasADi."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.special import exp1

from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import (
    DirectNoiseError,
    NonlinearSystemError,
    TimeRangeError,
    UnknownNameError,
    UnstableSystemWarning,
)
from ascentwind.runners import Cvodes, Study

TIGHT = Cvodes(relative_tolerance=1e-10)
TIMES = (0.5, 2.0, 7.5)


def variance(system: LinearSystem, times=TIMES, options=TIGHT) -> np.ndarray:
    """Combined variance of the first response."""
    return Study.from_system(system).response_statistics(times, engine=options).variance.values[:, 0, -1]


def lag() -> LinearSystem:
    """x' = -x / (1 + t) + n: x(t2) = integral of (1 + t)/(1 + t2) n dt."""
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    return define_system("lag", time=t, states={"x": (x, -x / (1 + t) + n)}, noises={"n": n}, outputs={"x": x})


def test_time_varying_lag_has_its_closed_form():
    expected = [((1 + t2) ** 3 - 1) / (3 * (1 + t2) ** 2) for t2 in TIMES]
    np.testing.assert_allclose(variance(lag()), expected, rtol=1e-8)


def test_lag_with_exponential_rate_has_its_closed_form():
    """x' = -a e^(-t) x + n: g = exp(a (e^-t2 - e^-t)); the variance is an exponential integral."""
    a = 1.3
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system(
        "decay", time=t, states={"x": (x, -a * ca.exp(-t) * x + n)}, noises={"n": n}, outputs={"x": x}
    )
    # integral_0^t2 exp(2 a (e^-t2 - e^-t)) dt with u = 2 a e^-t: e^(2 a e^-t2) [E1(2 a e^-t2) - E1(2 a)]
    expected = [np.exp(2 * a * np.exp(-t2)) * (exp1(2 * a * np.exp(-t2)) - exp1(2 * a)) for t2 in TIMES]
    np.testing.assert_allclose(variance(system), expected, rtol=1e-8)


def oscillator(w: float, z: float) -> LinearSystem:
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    return define_system(
        "oscillator",
        time=t,
        states={"x": (x, v), "v": (v, -2 * z * w * v - w**2 * x + n)},
        noises={"n": n},
        outputs={"x": x, "v": v},
        start=1.0,
    )


@pytest.mark.parametrize(("w", "z"), [(6.0, 0.005), (1.0, 0.4), (20.0, 0.05)])
def test_oscillator_switched_on_has_its_closed_form(w, z):
    """White noise from t0 = 1 s on a damped oscillator (Caughey and Stumpf 1961, transient response)."""
    wd = w * np.sqrt(1 - z**2)
    times = np.array([1.2, 3.0, 9.0])
    s = times - 1.0
    decay = np.exp(-2 * z * w * s)
    expected = (
        1 - decay * (w**2 / wd**2 + z * w / wd * np.sin(2 * wd * s) - (z * w / wd) ** 2 * np.cos(2 * wd * s))
    ) / (4 * z * w**3)
    np.testing.assert_allclose(variance(oscillator(w, z), times), expected, rtol=1e-7)


def euler_cauchy(start_covariance=None) -> LinearSystem:
    """t^2 y'' + 4 t y' + 2 y = t^2 n from t = 1: modes 1/t and 1/t^2, g(t2, t) = t^2 (1/t2 - t/t2^2) ... ."""
    t, y, v, n = (ca.SX.sym(s) for s in ("t", "y", "v", "n"))
    return define_system(
        "euler_cauchy",
        time=t,
        states={"y": (y, v), "v": (v, -4 * v / t - 2 * y / t**2 + n)},
        noises={"n": n},
        outputs={"y": y},
        start=1.0,
        start_covariance=start_covariance,
    )


def euler_cauchy_weight(t2, t):
    """Solution of the homogeneous equation with y(t) = 0, y'(t) = 1: t^2 / t2 - t^3 / t2^2."""
    return t**2 / t2 - t**3 / t2**2


def test_euler_cauchy_system_has_its_closed_form():
    times = np.array([1.5, 3.0, 8.0])
    # integral_1^t2 (t^2/t2 - t^3/t2^2)^2 dt, term by term
    expected = [(t2**5 - 1) / (5 * t2**2) - (t2**6 - 1) / (3 * t2**3) + (t2**7 - 1) / (7 * t2**4) for t2 in times]
    np.testing.assert_allclose(variance(euler_cauchy(), times), expected, rtol=1e-8)


def test_start_covariance_adds_its_propagated_part():
    """From y(1) = y0, y'(1) = v0: y(t2) = (2 y0 + v0)/t2 - (y0 + v0)/t2^2."""
    P0 = np.array([[2.0, 0.3], [0.3, 0.5]])
    times = np.array([1.5, 3.0])
    gain = np.array([[2 / t2 - 1 / t2**2, 1 / t2 - 1 / t2**2] for t2 in times])
    added = np.einsum("ki,ij,kj->k", gain, P0, gain)
    with_start = variance(euler_cauchy({"n": P0}), times)
    np.testing.assert_allclose(with_start - variance(euler_cauchy(), times), added, rtol=1e-7)


def test_weighting_function_is_the_closed_form_and_gives_the_variance():
    study = Study.from_system(euler_cauchy())
    found = study.weighting_function(4.0, spacing=0.01, engine=TIGHT)
    t, g = found["t"].values, found["noise_weighting"].values[0, 0]
    np.testing.assert_allclose(g, euler_cauchy_weight(4.0, t), atol=1e-8)


def test_mean_by_convolution_holds_the_direct_part():
    """x' = -x + u, y = x + 3 u, u = sin t: the delta at t2 adds 3 sin t2."""
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    system = define_system(
        "direct",
        time=t,
        states={"x": (x, -x + u + n)},
        noises={"n": n},
        inputs={"u": (u, ca.sin(t))},
        outputs={"y": x + 3 * u},
    )
    found = Study.from_system(system).response_statistics(TIMES, engine=TIGHT)
    expected = [0.5 * (np.sin(t2) - np.cos(t2) + np.exp(-t2)) + 3 * np.sin(t2) for t2 in TIMES]
    np.testing.assert_allclose(found.mean.values[:, 0, 0], expected, rtol=1e-8)


def test_sources_are_kept_apart_and_add_up():
    t, x, n1, n2, n3 = (ca.SX.sym(s) for s in ("t", "x", "n1", "n2", "n3"))
    system = define_system(
        "two_sources",
        time=t,
        states={"x": (x, -x + n1 + 2 * n2 + 3 * n3)},
        noises={"n1": n1, "n2": n2, "n3": n3},
        sources={"n1": "a", "n2": "b", "n3": "b"},
        outputs={"x": x},
    )
    found = Study.from_system(system).response_statistics([2.0], engine=TIGHT)
    unit = 0.5 * (1 - np.exp(-4.0))
    assert list(found["source"].values) == ["a", "b", "combined"]
    np.testing.assert_allclose(found.variance.values[0, 0], [unit, 13 * unit, 14 * unit], rtol=1e-8)


def test_parameters_change_the_numbers_without_new_code():
    t, x, n, tau = (ca.SX.sym(s) for s in ("t", "x", "n", "tau"))
    system = define_system(
        "gauss_markov",
        time=t,
        states={"x": (x, -x / tau + ca.sqrt(2 / tau) * n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"tau": (tau, 2.0)},
    )
    study = Study.from_system(system)
    other = study.with_parameters({"tau": 0.5})
    assert other.executable.shared_library == study.executable.shared_library
    for s, value in ((study, 2.0), (other, 0.5)):
        found = s.response_statistics([1.0], engine=TIGHT).variance.values[0, 0, 0]
        assert found == pytest.approx(1 - np.exp(-2 / value), rel=1e-8)


def test_discontinuities_are_seen_from_the_right_side():
    """x' = a(t) x + n with a jumping from -1 to +0.5 at t = 1."""
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    rate = ca.if_else(t < 1, -1.0, 0.5)
    system = define_system(
        "jump",
        time=t,
        states={"x": (x, rate * x + n)},
        noises={"n": n},
        outputs={"x": x},
        discontinuities=[1.0],
    )
    before = 0.5 * (1 - np.exp(-2.0))
    after = before * np.exp(1.0) + (np.exp(1.0) - 1)
    with pytest.warns(UnstableSystemWarning, match=r"frozen at 1 s is unstable: root \+0.5.* in x"):
        found = variance(system, [1.0, 2.0])
    np.testing.assert_allclose(found, [before, after], rtol=1e-8)


def test_white_noise_on_an_output_is_refused_with_source_output_and_way_out():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system(
        "direct_noise", time=t, states={"x": (x, -x + n)}, noises={"gust": n}, outputs={"load": x + n, "angle": x}
    )
    study = Study.from_system(system)
    with pytest.raises(DirectNoiseError, match="'gust' reaches 'load' directly.*colour the noise"):
        study.response_statistics([1.0])
    assert study.response_statistics([1.0], responses=["angle"]).std.size == 2


def test_nonlinear_and_undeclared_expressions_are_refused():
    t, x, n, k = (ca.SX.sym(s) for s in ("t", "x", "n", "k"))
    with pytest.raises(NonlinearSystemError, match="derivative of 'x' is not linear"):
        define_system("square", time=t, states={"x": (x, -(x**2) + n)}, noises={"n": n}, outputs={"x": x})
    with pytest.raises(NonlinearSystemError, match="output 'y' is not linear"):
        define_system("offset", time=t, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"y": x + 1})
    with pytest.raises(NonlinearSystemError, match="symbol 'k'"):
        define_system("free", time=t, states={"x": (x, -k * x + n)}, noises={"n": n}, outputs={"x": x})


def test_names_and_times_are_checked():
    study = Study.from_system(euler_cauchy())
    with pytest.raises(UnknownNameError, match="no response 'z'"):
        study.response_statistics([2.0], responses=["z"])
    with pytest.raises(TimeRangeError, match="before the start at 1 s"):
        study.response_statistics([0.5])
    with pytest.raises(TimeRangeError, match="no end time"):
        study.response_statistics([])
    with pytest.raises(TimeRangeError, match="ends at 0 s, before its start"):
        t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
        define_system("r", time=t, states={"x": (x, n)}, noises={"n": n}, outputs={"x": x}, start=1.0, end=0.0)
