"""Normality of measured values: against SciPy's tests, by simulation, and the level that skewness moves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ascentwind.model.wind.soundings.normality import normality, quantile_band, skewed_level
from ascentwind.model.wind.soundings.sounding import SoundingError


@pytest.mark.parametrize("count", [20, 50, 400, 3000])
def test_scores_are_scipys(count):
    x = np.random.default_rng(count).gamma(3.0, size=(count, 4))
    found = normality(x)
    np.testing.assert_allclose(found.skewness_score, stats.skewtest(x).statistic, rtol=1e-10)
    np.testing.assert_allclose(found.kurtosis_score, stats.kurtosistest(x).statistic, rtol=1e-10)
    np.testing.assert_allclose(found.probability, stats.normaltest(x).pvalue, rtol=1e-9)
    np.testing.assert_allclose(found.skewness, stats.skew(x), rtol=1e-12)
    np.testing.assert_allclose(found.kurtosis, stats.kurtosis(x), rtol=1e-12)


def test_normal_values_pass_as_often_as_said():
    """1000 columns of 200 normal values: 5 % below 0.05, within four standard errors; shares of the tails likewise."""
    found = normality(np.random.default_rng(1).standard_normal((200, 1000)))
    assert abs((found.probability < 0.05).mean() - 0.05) < 4 * np.sqrt(0.05 * 0.95 / 1000) + 0.01
    assert found.beyond.mean() == pytest.approx(2 * stats.norm.sf(2), abs=4 * np.sqrt(0.0455 / 200_000))
    assert (found.tail_probability < 0.05).mean() < 0.06  # discrete: at most 5 % and a little


def test_heavy_tails_are_found_and_fewer_independent_values_find_less():
    x = np.random.default_rng(2).standard_t(4, size=(2000, 1))
    many, few = normality(x), normality(x, 50.0)
    assert many.probability[0] < 1e-10
    assert few.probability[0] > many.probability[0]
    assert many.far_beyond[0] > 0.006


def test_missing_values_are_left_out():
    x = np.random.default_rng(3).gamma(2.0, size=(300, 2))
    x[::3, 1] = np.nan
    found, alone = normality(x), normality(x[np.isfinite(x[:, 1]), 1])
    assert found.skewness[1] == pytest.approx(alone.skewness[0])
    assert found.independent == 200


def test_too_few_are_refused():
    with pytest.raises(SoundingError, match="19 independent values say nothing"):
        normality(np.zeros((19, 2)))
    with pytest.raises(SoundingError, match="12 independent"):
        normality(np.random.default_rng(0).standard_normal((400, 2)), 12.0)


def test_the_band_of_quantiles_holds_them():
    x = np.sort(np.random.default_rng(4).standard_normal((4000, 60)), axis=1)
    middle, low, high = quantile_band(60, 60.0)
    inside = ((x > low) & (x < high)).mean(axis=0)
    assert np.abs(inside - 0.9).max() < 0.03
    assert (low < middle).all() and (middle < high).all()


def test_skewness_moves_a_level_as_a_gamma_distribution_has_it():
    shape = 100.0
    exact = stats.gamma.ppf(stats.norm.cdf(3.0), shape)
    mean, std, skewness, kurtosis = shape, np.sqrt(shape), 2 / np.sqrt(shape), 6 / shape
    assert float(skewed_level(mean, std, skewness, kurtosis, 3.0)) == pytest.approx(exact, rel=2e-4)
    assert float(skewed_level(mean, std, 0.0, 0.0, 3.0)) == mean + 3 * std
