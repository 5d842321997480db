"""How well so many soundings know a flight's level, and what Monte Carlo would need to say as much."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from two_noises import MEAN, two_noises

from ascentwind.model.errors import ParameterValueError, UnknownNameError
from ascentwind.runners.statistics.percentiles import level_sampling_interval

WINDOW = (25.0, 35.0)


@pytest.mark.parametrize(("other", "mean"), [(0.0, MEAN), (0.0, -MEAN), (1.5, MEAN)])
def test_of_a_stationary_response_it_is_that_of_its_instants(cache, other, mean):
    """Mean and sigmas are the same at all times, and k = (level - mean) / sigma."""
    load = two_noises(2.0, other, mean).flight_load("y", WINDOW, [0.01, 0.2])
    found = load.wind_interval(40, 0.9)
    assert found.dims == ("probability", "bound")
    for level, interval in zip(load.level.values, found.values, strict=True):
        sigmas = (level - MEAN) / np.hypot(2.0, other)
        expected = level_sampling_interval(MEAN, 2.0, other, sigmas, 40, 0.9)
        np.testing.assert_allclose(interval, expected, rtol=1e-5)
        assert interval[0] < level < interval[1]
    assert load.side == ["upper" if mean > 0 else "lower"] * 2
    np.testing.assert_allclose(load.side_shares.sum("side"), 1.0)


def test_without_a_mean_both_sides_share(cache):
    load = two_noises(2.0, 0.0, 0.0).flight_load("y", WINDOW, [0.01])
    np.testing.assert_allclose(load.side_shares, 0.5, atol=0.05)
    sigmas = float(load.level[0]) / 2.0
    np.testing.assert_allclose(load.wind_interval(60)[0], level_sampling_interval(0.0, 2.0, 0.0, sigmas, 60), rtol=1e-4)


def test_what_cannot_be_known_is_refused(cache):
    load = two_noises(2.0, 1.0).flight_load("y", WINDOW, [0.01])
    assert load.wind_samples is None
    with pytest.raises(ParameterValueError, match=r"not known; give samples=.*wind.record"):
        load.wind_interval()
    refused: list[tuple[Any, float]] = [(1, 0.95), (float("nan"), 0.95), ("many", 0.95), (80, 1.0)]
    for samples, confidence in refused:
        with pytest.raises(ParameterValueError):
            load.wind_interval(samples, confidence)
    other = two_noises(2.0, 1.0, name="gust").flight_load("y", WINDOW, [0.01])
    with pytest.raises(UnknownNameError, match="wind"):
        other.wind_interval(80)


def test_simulated_flights_that_would_say_as_much(cache):
    load = two_noises(2.0, 0.0).flight_load("y", WINDOW, [0.00135, 0.01])
    assert load.monte_carlo_runs() == 1705
    assert load.monte_carlo_runs(0.01, risk=0.05) == 299  # (1 - 0.01)^299 <= 0.05
    assert load.monte_carlo_runs(0.01, failures=1) > load.monte_carlo_runs(0.01)
    with pytest.raises(ParameterValueError, match="no level was asked for"):
        load.monte_carlo_runs(0.02)
    with pytest.raises(ParameterValueError):
        load.monte_carlo_runs(risk=1.0)


@pytest.mark.slow
def test_a_vehicles_interval_follows_from_the_envelope_of_its_level(as504):
    """1.96^2 (sigma_w^2 / N + E^2 / (2 (N - 1))), E the exact derivative by ln sigma_w: another road."""
    load = as504.flight_load("bending_moment", (60.0, 90.0), [0.00135])
    low, high = load.wind_interval()[0].values
    assert load.wind_samples == 80
    peak = float(
        load.process.seen.times[load.levels[0].draws.places(load.levels[0].boundary).sum(axis=(1, 2)).argmax()]
    )
    wind = float(as504.response_statistics([peak], responses=["bending_moment"]).std.sel(source="wind").squeeze())
    names = ["wind.sigma_scale"]
    owed = float(load.sensitivity(parameters=names)["envelope_elasticity"].sel(parameter=names[0]) * load.level[0])
    half = 1.96 * np.sqrt(wind**2 / 80 + owed**2 / (2 * 79))
    assert 0.5 * (high - low) == pytest.approx(half, rel=0.03)
    assert 0.5 * (high + low) == pytest.approx(float(load.level[0]), rel=1e-9)
