"""Levels for any percentile, how well a wind's statistics know them, and what Monte Carlo would need: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import foldnorm, nct, norm

from ascentwind.model.errors import ParameterValueError
from ascentwind.runners.statistics.percentiles import (
    instant_level,
    level_sampling_interval,
    monte_carlo_runs,
    std_sampling_interval,
)

THREE_SIGMA = float(norm.sf(3.0))


@pytest.mark.parametrize("p", [0.9, 0.5, 0.01, THREE_SIGMA, 1e-9, 1e-40])
def test_one_side_is_the_normal_quantile(p):
    mean, std = np.array([-2.0, 0.0, 5.0]), np.array([1.0, 3.0, 0.5])
    np.testing.assert_allclose(instant_level(mean, std, p, "upper"), mean + norm.isf(p) * std, rtol=1e-12)
    np.testing.assert_allclose(instant_level(mean, std, p, "lower"), -mean + norm.isf(p) * std, rtol=1e-12)


def test_three_sigma_is_the_upper_level_of_its_own_probability():
    assert instant_level(10.0, 2.0, THREE_SIGMA, "upper") == pytest.approx(16.0, rel=1e-13)


@pytest.mark.parametrize("p", [0.9, 0.3, THREE_SIGMA, 1e-12])
@pytest.mark.parametrize("mean", [0.0, 0.3, -0.3, 2.0, -40.0])
def test_both_sides_are_the_folded_normal(p, mean):
    found = instant_level(mean, 1.5, p, "both")
    assert norm.sf((found - mean) / 1.5) + norm.cdf((-found - mean) / 1.5) == pytest.approx(p, rel=1e-9)
    if p > 1e-9:  # SciPy's quantile beyond loses digits
        assert found == pytest.approx(foldnorm.isf(p, abs(mean) / 1.5, scale=1.5), rel=1e-8)


def test_both_sides_with_a_mean_of_zero_share_the_probability():
    assert instant_level(0.0, 2.0, 0.1, "both") == pytest.approx(2.0 * norm.isf(0.05), rel=1e-12)


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3), st.floats(1e-12, 0.999), st.floats(1e-6, 1e6))
def test_both_sides_lie_between_the_bounds_and_scale(mean, std, p, factor):
    both, upper, lower = (float(instant_level(mean, std, p, sides)) for sides in ("both", "upper", "lower"))
    larger = max(upper, lower)
    half = abs(mean) + norm.isf(0.5 * p) * std
    assert larger - 1e-9 * (abs(larger) + std) <= both <= half + 1e-9 * (abs(half) + std)
    assert instant_level(factor * mean, factor * std, p, "both") == pytest.approx(factor * both, rel=1e-6)


def test_what_does_not_vary_has_its_mean_as_level():
    assert instant_level(-3.0, 0.0, 0.01, "upper") == -3.0
    assert instant_level(-3.0, 0.0, 0.01, "lower") == 3.0
    assert instant_level(-3.0, 0.0, 0.01, "both") == 3.0


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.5, float("nan"), float("inf")])
def test_levels_of_impossible_probabilities_are_refused(p):
    with pytest.raises(ParameterValueError, match="between 0 and 1"):
        instant_level(0.0, 1.0, p)


def test_spread_intervals_cover():
    """Sample covariances of 30 correlated levels from N = 12 profiles, a fixed weighting: chi-square whatever it is."""
    random, N, runs = np.random.default_rng(3), 12, 4000
    h = np.linspace(0, 1, 30)
    root = np.linalg.cholesky(np.exp(-np.abs(h[:, None] - h) / 0.3))
    weighting = np.sin(7 * h)
    sigma = np.linalg.norm(root.T @ weighting)
    profiles = random.standard_normal((runs, N, 30)) @ root.T
    estimates = (profiles @ weighting).std(axis=1, ddof=1)
    inside = sum(low < sigma < high for low, high in (std_sampling_interval(s, N) for s in estimates))
    assert inside / runs == pytest.approx(0.95, abs=4 * np.sqrt(0.05 * 0.95 / runs))


@pytest.mark.parametrize(("N", "other", "loose"), [(12, 0.0, 0.0), (80, 0.0, 0.0), (80, 1.0, 0.015), (1000, 2.0, 0.0)])
def test_level_intervals_cover(N, other, loose):
    """Mean and sigma of the wind's part from N profiles; exact without other sources, first order with them."""
    random, runs, sigmas, mean, wind = np.random.default_rng(4), 4000, 3.0, 5.0, 1.5
    true = mean + sigmas * np.hypot(wind, other)
    means = mean + wind / np.sqrt(N) * random.standard_normal(runs)
    spreads = wind * np.sqrt(random.chisquare(N - 1, runs) / (N - 1))
    found = [level_sampling_interval(m, s, other, sigmas, N) for m, s in zip(means, spreads, strict=True)]
    inside = np.mean([low < true < high for low, high in found])
    assert inside == pytest.approx(0.95, abs=4 * np.sqrt(0.05 * 0.95 / runs) + loose)


@pytest.mark.parametrize(("N", "close"), [(80, 0.05), (1000, 0.005)])
def test_delta_method_goes_to_the_noncentral_t(N, close):
    exact = np.array(level_sampling_interval(1.0, 2.0, 0.0, 3.0, N))
    delta = np.array(level_sampling_interval(1.0, 2.0, 1e-9, 3.0, N))
    np.testing.assert_allclose(delta, exact, rtol=close)
    # sqrt(N) (L - mean) / s is noncentral t, L the true level and mean and s those of the profiles
    again = 1.0 + 2.0 * nct.ppf([0.025, 0.975], N - 1, 3.0 * np.sqrt(N)) / np.sqrt(N)
    np.testing.assert_allclose(exact, again, rtol=1e-9)


def test_infinitely_many_profiles_leave_no_interval():
    for N, close in ((1e6, 3e-3), (1e10, 3e-5)):
        np.testing.assert_allclose(std_sampling_interval(2.0, N), 2.0, rtol=close)
        np.testing.assert_allclose(level_sampling_interval(1.0, 2.0, 1.0, 3.0, N), 1 + 3 * np.sqrt(5), rtol=close)
        np.testing.assert_allclose(level_sampling_interval(1.0, 2.0, 0.0, 3.0, N), 7.0, rtol=close)


@pytest.mark.parametrize(("samples", "confidence"), [(1, 0.95), (0, 0.95), (-3, 0.95), (float("nan"), 0.95),
                                                     (float("inf"), 0.95), (9, 0.0),
                                                     (9, 1.0), (9, float("nan"))])  # fmt: skip
def test_intervals_that_cannot_be_are_refused(samples, confidence):
    with pytest.raises(ParameterValueError):
        std_sampling_interval(1.0, samples, confidence)
    with pytest.raises(ParameterValueError):
        level_sampling_interval(0.0, 1.0, 1.0, 3.0, samples, confidence)


def test_runs_without_a_failure_have_their_closed_form():
    """(1 - p)^n <= risk: 1705 runs say as much as 99.865 % at 10 % consumer's risk."""
    assert monte_carlo_runs(0.00135) == 1705
    for p, risk in ((0.00135, 0.1), (0.01, 0.05), (0.5, 0.4), (1e-7, 0.1)):
        assert monte_carlo_runs(p, risk) == int(np.ceil(np.log(risk) / np.log1p(-p)))


@pytest.mark.parametrize(("p", "risk", "failures"), [(0.01, 0.1, 1), (0.05, 0.05, 4), (0.3, 0.9, 2), (0.00135, 0.1, 3)])
def test_runs_with_failures_are_the_least_that_show_it(p, risk, failures):
    def accepted(n: int) -> float:
        """Sum over j <= failures of binom(n, j) p^j (1 - p)^(n - j), a term after another."""
        term = total = (1 - p) ** n
        for j in range(1, failures + 1):
            term *= (n - j + 1) / j * p / (1 - p)
            total += term
        return total

    n = monte_carlo_runs(p, risk, failures)
    assert accepted(n) <= risk < accepted(n - 1)


@pytest.mark.parametrize(
    ("p", "risk", "failures"),
    [(0.0, 0.1, 0), (1.0, 0.1, 0), (0.1, 0.0, 0), (0.1, 1.0, 0), (0.1, 0.1, -1), (0.1, 0.1, 1.5), (1e-12, 0.1, 1),
     (5e-324, 0.1, 0), (float("nan"), 0.1, 0), (0.1, float("nan"), 0),
     (0.1, 0.1, float("nan")), (0.1, 0.1, float("inf"))],
)  # fmt: skip
def test_runs_that_cannot_be_counted_are_refused(p, risk, failures):
    with pytest.raises(ParameterValueError):
        monte_carlo_runs(p, risk, failures)
