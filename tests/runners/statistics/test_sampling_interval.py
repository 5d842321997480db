"""What so many soundings of the wind leave open of sigma and level at an instant: closed forms, and the record's N."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, nct
from two_noises import MEAN, two_noises

from ascentwind.model.errors import ParameterValueError, TimeRangeError, UnknownNameError
from ascentwind.runners.statistics.results import ResponseStatistics

WIND, OTHER, TIME = 2.0, 1.5, 30.0


def statistics(wind: float = WIND, other: float = OTHER, mean: float = MEAN, name: str = "wind") -> ResponseStatistics:
    return two_noises(wind, other, mean, name).response_statistics([20.0, TIME], engine="covariance")


def test_wind_alone_is_chi_square_and_noncentral_t(cache):
    found = statistics(other=0.0, mean=-MEAN).sampling_interval("y", TIME, samples=25, confidence=0.9)
    assert found.side == "mean - 3σ"
    assert found.level == pytest.approx(MEAN + 3 * WIND, rel=1e-6)
    expected = WIND * np.sqrt(24 / chi2.ppf([0.95, 0.05], 24))
    np.testing.assert_allclose(found.wind_std_interval, expected, rtol=1e-6)
    np.testing.assert_allclose(found.std_interval, expected, rtol=1e-6)
    level = MEAN + WIND / 5 * nct.ppf([0.05, 0.95], 24, 15.0)
    np.testing.assert_allclose(found.level_interval, level, rtol=1e-6)


def test_what_other_sources_add_is_known(cache):
    found = statistics().sampling_interval("y", TIME, samples=101, sigmas=2.0)
    total = np.hypot(WIND, OTHER)
    wind = WIND * np.sqrt(100 / chi2.ppf([0.975, 0.025], 100))
    np.testing.assert_allclose(found.std_interval, np.hypot(wind, OTHER), rtol=1e-6)
    half = 1.959964 * WIND * np.sqrt(1 / 101 + (2 * WIND / total) ** 2 / 200)
    level = MEAN + 2 * total
    np.testing.assert_allclose(found.level_interval, [level - half, level + half], rtol=1e-6)
    assert found.side == "mean + 2σ"


def test_a_response_without_wind_is_known(cache):
    found = statistics(wind=0.0).sampling_interval("y", TIME, samples=30)
    np.testing.assert_allclose(found.level_interval, MEAN + 3 * OTHER, rtol=1e-6)
    np.testing.assert_allclose(found.std_interval, OTHER, rtol=1e-6)


def test_the_number_is_that_of_the_winds_record(as504):
    found = as504.response_statistics([45.0], engine="covariance")
    assert as504.vehicle.wind.record.independent_samples == 80
    assert found.attrs["wind_independent_samples"] == 80
    by_record, given = (found.sampling_interval("bending_moment", 45.0, n) for n in (None, 80))
    assert by_record == given
    assert found.sampling_interval("bending_moment", 45.0, 20).level_interval[1] > given.level_interval[1]


def test_what_cannot_be_known_is_refused(cache):
    found = statistics()
    with pytest.raises(ParameterValueError, match=r"not known; give samples=.*wind.record"):
        found.sampling_interval("y", TIME)
    refused: list[Any] = [1, 0, -4, float("nan"), float("inf"), "many"]
    for samples in refused:
        with pytest.raises(ParameterValueError):
            found.sampling_interval("y", TIME, samples)
    for more in ({"confidence": 1.0}, {"confidence": float("nan")}, {"sigmas": -1.0}, {"sigmas": float("inf")}):
        with pytest.raises(ParameterValueError):
            found.sampling_interval("y", TIME, 80, **more)
    with pytest.raises(TimeRangeError, match="25 s is not among the end times"):
        found.sampling_interval("y", 25.0, 80)
    with pytest.raises(UnknownNameError, match="y"):
        found.sampling_interval("z", TIME, 80)
    with pytest.raises(UnknownNameError, match="wind"):
        statistics(name="gust").sampling_interval("y", TIME, 80)
