"""Derivatives of a flight's level: closed forms, an equation of their own, homogeneity; shares of two sources."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from maxima import passing_of_ornstein_uhlenbeck
from scipy.optimize import root_scalar
from scipy.stats import norm

from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import UnknownNameError
from ascentwind.runners import Study

RATE, SCALE, MEAN, END = 1.0, 2.0, 0.5, 4.0


@pytest.fixture(scope="module")
def study() -> Study:
    """y = scale (x + mean), x stationary of unit variance and a rate of its own: the level depends on rate times T."""
    x, n, u, rate, scale, mean = (ca.SX.sym(s) for s in ("x", "n", "u", "rate", "scale", "mean"))
    return Study.from_system(
        define_system(
            "stationary",
            time=ca.SX.sym("t"),
            states={"x": (x, -rate * x + ca.sqrt(2 * rate) * n)},
            noises={"n": n},
            inputs={"u": (u, mean)},
            outputs={"y": scale * (x + u)},
            parameters={"rate": (rate, RATE), "scale": (scale, SCALE), "mean": (mean, MEAN)},
            start_covariance={"n": np.eye(1)},
            end=END,
        )
    )


def level_of_rate(rate: float, p: float) -> float:
    """Level of x alone by its own equation, in time measured in 1 / rate."""

    def excess(u: float) -> float:
        return np.log(passing_of_ornstein_uhlenbeck(-np.inf, u, rate * END) / p)

    return float(root_scalar(excess, bracket=(2.0, 5.0), method="brentq", xtol=1e-9).root)


@pytest.mark.slow
def test_derivatives_have_their_closed_forms_and_that_of_an_equation(study):
    p, by_rate = 0.01, []
    for seed in range(8):
        load = study.flight_load("y", probabilities=p, sides="upper", seed=seed)
        found = load.sensitivity(parameters=["rate", "scale", "mean"])
        derivative = found["derivative"].to_series()
        assert derivative["scale"] == pytest.approx(load.level.item() / SCALE, rel=1e-6)
        assert derivative["mean"] == pytest.approx(SCALE, rel=2e-5)
        by_rate.append(derivative["rate"])
    step = 0.05
    expected = SCALE * (level_of_rate(RATE + step, p) - level_of_rate(RATE - step, p)) / (2 * step)
    error = np.std(by_rate, ddof=1) / np.sqrt(len(by_rate))
    assert error < 0.03 * expected
    # a tenth of it is what goes on between the points drawn, and as much would be lost by a band on one side
    assert np.mean(by_rate) == pytest.approx(expected, abs=3 * error)


def test_an_unknown_parameter_names_the_nearest(study):
    load = study.flight_load("y", probabilities=0.01, sides="upper", draws=200)
    with pytest.raises(UnknownNameError, match="'scale'"):
        load.sensitivity(parameters=["scal"])


@pytest.mark.slow
def test_all_loads_of_as504_scale_with_the_wind_and_shares_add_up(as504):
    load = as504.flight_load("bending_moment", (60.0, 90.0), 0.00135, seed=2)
    found = load.sensitivity(parameters=["wind.mean_scale", "wind.sigma_scale"])
    silent = load.shares["level_without"].sel(source="wind", probability=0.00135).item()
    assert silent < 0.7 * load.level.item()
    np.testing.assert_allclose(load.shares["share"].sum("source"), 1.0, rtol=1e-12)
    assert float(found["elasticity"].sum()) == pytest.approx(
        1.0, abs=1e-3
    )  # noise acts on the flow that the wind makes


def test_without_the_rough_source_no_white_noise_is_left():
    """y = Ornstein-Uhlenbeck + constant: without the first it is the constant, whose level is that of an instant."""
    load = Study.from_system(two_sources()).flight_load("y", probabilities=0.01, sides="upper", draws=4000, seed=4)
    only = load.of.process([1])
    assert not only.seen.diffusion.any()
    np.testing.assert_allclose(load.of.process([0]).seen.diffusion, np.sqrt(2), rtol=1e-12)
    assert load.shares["level_without"].sel(source="n").item() == pytest.approx(3.0 * norm.isf(0.01), rel=0.03)


def two_sources() -> LinearSystem:
    """A constant of spread 3 beside Ornstein-Uhlenbeck of spread 1."""
    x, b, n, m = (ca.SX.sym(s) for s in ("x", "b", "n", "m"))
    return define_system(
        "two",
        time=ca.SX.sym("t"),
        states={"x": (x, -x + np.sqrt(2) * n), "b": (b, 0 * m)},
        noises={"n": n, "m": m},
        outputs={"y": x + b},
        start_covariance={"n": np.diag([1.0, 0.0]), "m": np.diag([0.0, 9.0])},
        end=2.0,
    )


@pytest.mark.slow
def test_two_sources_share_as_their_equation_says():
    p = 1e-4
    load = Study.from_system(two_sources()).flight_load("y", probabilities=p, sides="upper", draws=4000, seed=3)
    u, constant = load.level.item(), np.linspace(-12.0, 18.0, 61)

    def passing(u: float) -> np.ndarray:
        """Chance of each constant to be lifted above u."""
        away = u - constant
        return np.array([1.0 if d < -8.9 else passing_of_ornstein_uhlenbeck(-np.inf, d, 2.0, 800, 200) for d in away])

    density = norm.pdf(constant, 0.0, 3.0) * (constant[1] - constant[0])
    error = load.levels[0].probability.standard_error
    assert density @ passing(u) == pytest.approx(p, abs=4 * error + 0.01 * p)
    # of the flights that just reach u, the constant's part: E[constant | max = u] / u
    weight = density * (passing(u) - passing(u + 0.02))
    share = load.shares["share"].sel(source="m").item()
    assert share == pytest.approx(constant @ weight / weight.sum() / u, rel=0.02)
