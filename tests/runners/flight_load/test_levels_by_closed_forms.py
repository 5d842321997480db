"""The largest value of a flight where its law is known: levels, probabilities, intervals, seeds, bounds."""

from __future__ import annotations

import numpy as np
import pytest
from maxima import (
    brownian,
    constants,
    integrated,
    largest_of_integrated,
    ornstein_uhlenbeck,
    passing_of_ornstein_uhlenbeck,
)
from scipy.stats import norm

from ascentwind.runners import Study
from ascentwind.runners.flight_load.crossings import Boundary
from ascentwind.runners.flight_load.probability import Level, find_level
from ascentwind.runners.flight_load.process import Grid, JointOutputs
from ascentwind.runners.flight_load.sampling import draw_beyond
from ascentwind.runners.statistics.percentiles import instant_level

SIDES = ("upper", "lower", "both")


def within(found, expected: float, errors: float = 4.0) -> None:
    """Assert that an estimate lies within standard errors of a number, and that they are small."""
    assert found.standard_error < 0.12 * found.value
    assert abs(found.value - expected) < errors * found.standard_error + 0.005 * expected


def same_level(found: Level, expected: float, errors: float = 4.0) -> None:
    """Assert that a level lies within standard errors of a number, and that they are small."""
    error = (found.interval[1] - found.interval[0]) / 3.92
    assert error < 0.03 * abs(found.value)
    assert abs(found.value - expected) < errors * error


@pytest.fixture(scope="module")
def wiener() -> Study:
    return brownian(end=4.0)


@pytest.fixture(scope="module")
def stationary() -> Study:
    return ornstein_uhlenbeck()


@pytest.mark.slow
def test_brownian_motion_passes_by_reflection(wiener):
    load = wiener.flight_load("x", sides="upper", seed=3)
    for sigmas in (1.0, 2.0, 3.5, 6.0):
        within(load.probability(2.0 * sigmas), 2 * float(norm.sf(sigmas)))


def test_without_bridges_brownian_motion_is_low_by_the_known_shift(wiener):
    """The largest of a grid is low by 0.5826 sqrt(dt) (Chernoff 1965; Broadie, Glasserman and Kou 1997)."""
    load = wiener.flight_load("x", sides="upper", seed=4)
    at = slice(None, None, 8)
    times = load.process.drawn.times[at]
    bare = Grid(times, np.zeros((times.size, 1)), np.zeros((times.size, 1)))
    on_grid = JointOutputs(bare, load.process.covariance[at][:, :, at])
    u, dt = 5.0, times[1] - times[0]
    boundary = Boundary.around(np.full(bare.mean.shape, u), "upper")
    found = draw_beyond(on_grid, boundary, np.random.default_rng(1), 20_000).contributions(boundary)
    true, shifted = (2 * float(norm.sf(x / 2)) for x in (u, u + 0.5826 * np.sqrt(dt)))
    error = found.std(ddof=1) / np.sqrt(found.size)
    assert found.mean() == pytest.approx(shifted, abs=4 * error)
    assert found.mean() < true - 8 * error  # 15 % of the probability is missed
    within(load.probability(u), true)


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("p", [0.01, 1e-4])
def test_ornstein_uhlenbeck_against_its_equation(stationary, sides, p):
    load = stationary.flight_load("y", probabilities=p, sides=sides, draws=4000, seed=5)
    (found,) = load.levels
    u = found.value
    bounds = {"upper": (-np.inf, u), "lower": (-u, np.inf), "both": (-u, u)}[sides]
    expected = passing_of_ornstein_uhlenbeck(*bounds, end=4.0)
    assert found.probability.value == pytest.approx(p, rel=1e-6)
    within(found.probability, expected)
    within(load.probability(u), expected)  # from draws of its own
    if sides == "both":
        assert expected == pytest.approx(2 * passing_of_ornstein_uhlenbeck(-np.inf, u, end=4.0), rel=0.01)


def test_the_equation_that_is_compared_with_has_converged():
    coarse, fine = (passing_of_ornstein_uhlenbeck(-np.inf, 3.0, 4.0, n, n // 2) for n in (2000, 4000))
    assert coarse == pytest.approx(fine, rel=1e-4)
    # without time it is the instant's chance of being outside
    assert passing_of_ornstein_uhlenbeck(-1.0, 2.0, 1e-9) == pytest.approx(norm.sf(1.0) + norm.sf(2.0), rel=2e-3)


def test_a_mean_and_a_scale_move_the_level_with_them(stationary):
    plain = stationary.flight_load("y", probabilities=0.01, sides="upper", seed=6)
    scaled = ornstein_uhlenbeck(scale=3e6).flight_load("y", probabilities=0.01, sides="upper", seed=6)
    assert scaled.level.item() == pytest.approx(3e6 * plain.level.item(), rel=1e-6)
    moved = ornstein_uhlenbeck(scale=3e6, mean=2.0).flight_load("y", probabilities=0.01, sides="upper", seed=6)
    turned = ornstein_uhlenbeck(scale=-3e6, mean=2.0).flight_load("y", probabilities=0.01, sides="lower", seed=6)
    same_level(moved.levels[0], 3e6 * (plain.level.item() + 2.0))
    same_level(turned.levels[0], moved.level.item())


@pytest.mark.parametrize("sides", SIDES)
def test_a_constant_passes_as_at_an_instant(sides):
    """A constant of the flight, alone: its largest value is its value."""
    load = constants({"a": 2.0}, mean=1.0).flight_load("y", probabilities=[0.1, 0.01, 1e-6], sides=sides)
    for p, found in zip(load.probabilities, load.levels, strict=True):
        same_level(found, float(instant_level(1.0, 2.0, p, sides)))
    u, z = 5.0, np.array([2.0, 3.0])
    expected = {"upper": norm.sf(z[0]), "lower": norm.sf(z[1]), "both": norm.sf(z).sum()}[sides]
    found = load.probability(u)
    assert found.value == pytest.approx(expected, rel=1e-9)  # S / N without any spread
    assert found.standard_error < 1e-9 * expected


def test_two_independent_constants_are_one_of_their_joint_spread():
    load = constants({"a": 3.0, "b": 4.0}).flight_load("y", probabilities=[0.01, 1e-5], sides="upper")
    for p, found in zip(load.probabilities, load.levels, strict=True):
        same_level(found, 5.0 * float(norm.isf(p)))
    np.testing.assert_allclose(load.shares["share"].sel(source="n_a"), 9 / 25, rtol=1e-4)
    np.testing.assert_allclose(load.shares["share"].sum("source"), 1.0, rtol=1e-12)
    without = load.shares["level_without"].sel(probability=0.01, source=["n_a", "n_b"])
    np.testing.assert_allclose(without, np.array([4.0, 3.0]) * norm.isf(0.01), rtol=0.02)


@pytest.mark.slow
def test_integrated_white_noise_against_plain_flights():
    load = integrated(2.0).flight_load("z", probabilities=0.01, sides="upper", draws=4000, seed=8)
    largest = largest_of_integrated(2.0, 200_000, seed=8)
    for u in (load.level.item(), 2.5, 4.0):
        plain = float((largest > u).mean())
        found = load.probability(u)
        both = np.hypot(found.standard_error, np.sqrt(plain / largest.size))
        assert found.value == pytest.approx(plain, abs=4 * both)


@pytest.mark.slow
def test_intervals_cover_and_seeds_reproduce(stationary):
    true, runs = 3.0, 40
    p = passing_of_ornstein_uhlenbeck(-np.inf, true, end=4.0)
    process = stationary.flight_load("y", probabilities=0.01, sides="upper", seed=0).process

    def boundary(u: float) -> Boundary:
        return Boundary.around(np.full(process.seen.mean.shape, u), "upper")

    def level(seed: int) -> Level:
        return find_level(process, p, boundary, 1.0, np.random.default_rng(seed), 500)

    found = [level(seed) for seed in range(runs)]
    values = np.array([each.value for each in found])
    covered = sum(each.interval[0] < true < each.interval[1] for each in found)
    assert covered >= 34  # of 40 by 95 %: fewer has a chance of 1.4 %
    assert values.mean() == pytest.approx(true, abs=4 * values.std() / np.sqrt(runs))
    assert level(7).value == values[7]
    assert np.unique(values).size == runs


@pytest.mark.slow
def test_bounds_and_sides_hold_each_other(stationary):
    loads = {sides: stationary.flight_load("y", sides=sides, draws=4000, seed=9) for sides in SIDES}
    for u in (2.0, 3.0, 5.0):
        found = {sides: load.probability(u) for sides, load in loads.items()}
        for each in found.values():
            error = 4 * each.standard_error
            assert each.largest_instant - error < each.value < each.sum_of_instants + error
        both, upper, lower = (found[sides] for sides in ("both", "upper", "lower"))
        error = 4 * np.hypot(both.standard_error, upper.standard_error)
        assert max(upper.value, lower.value) - error < both.value < upper.value + lower.value + 2 * error


@pytest.mark.slow
def test_level_and_probability_invert_each_other(stationary):
    load = stationary.flight_load("y", probabilities=[0.5, 0.1, 1e-3, 1e-6], draws=4000, seed=10)
    for p, found in zip(load.probabilities, load.levels, strict=True):
        back = load.probability(found.value)
        error = np.hypot(back.standard_error, found.probability.standard_error)
        assert back.value == pytest.approx(p, abs=4 * error)
    assert (np.diff(load.level.values) > 0).all()
    curve = load.exceedance
    assert (np.diff(curve.values) <= 0).all()
    between = np.interp(load.level.values[1:3], curve["level"].values, np.log(curve.values))
    np.testing.assert_allclose(np.exp(between), load.probabilities[1:3], rtol=0.25)


def test_times_of_the_maximum_are_a_density(stationary):
    density = stationary.flight_load("y", probabilities=[0.01], seed=11).time_of_maximum
    width = float(density["time"][1] - density["time"][0])
    np.testing.assert_allclose(density.sum("time") * width, 1.0, rtol=1e-9)
    # a stationary process has no preferred time, but for the ends
    middle = density.sel(given="0.01").values[5:-5]
    assert abs(middle[: middle.size // 2].mean() / middle[middle.size // 2 :].mean() - 1) < 0.25


@pytest.mark.slow
def test_the_largest_value_of_brownian_motion_comes_by_the_arcsine_law(wiener):
    """Levy: P(the time of the maximum < t) = (2 / pi) arcsin sqrt(t / T)."""
    load = wiener.flight_load("x", sides="upper", draws=4000, seed=12)
    density = load.time_of_maximum.sel(given="any flight")
    width = float(density["time"][1] - density["time"][0])
    found = np.cumsum(density.values) * width
    ends = np.linspace(0, 1, 61)[1:]
    np.testing.assert_allclose(
        found, 2 / np.pi * np.arcsin(np.sqrt(ends)), atol=1.63 / np.sqrt(4000)
    )  # Kolmogorov, 1 %
