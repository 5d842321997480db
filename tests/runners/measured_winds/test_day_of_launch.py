"""The day of launch and the predictor: against the dense Gaussian vector, their limits, and simulated soundings."""

from __future__ import annotations

import datetime
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import ascentwind as aw
from ascentwind.model.errors import ParameterValueError
from ascentwind.model.wind.soundings.collection import Soundings
from ascentwind.model.wind.soundings.sounding import Sounding, SoundingError
from ascentwind.runners.flight_load.limit_table import LimitError
from ascentwind.runners.measured_winds.conditioning import Measured
from ascentwind.runners.measured_winds.persistence import DAY, MEASURED, MEASURED_LEVELS, Persistence
from ascentwind.runners.measured_winds.random_wind import random_wind
from ascentwind.runners.measured_winds.wind_field import default_persistence, wind_field

WINDOW = (55.0, 85.0)
THREE = ["bending_moment", "angle_of_attack", "engine_angle"]
LIMITS = aw.Limits.over_time([0.0, 150.0], {"bending_moment": [2.3e7, 2.3e7]}, {"bending_moment": "N m"})

ALONG = aw.Limits(None, np.array([0.0, 50.0]), {"bending_moment": np.ones((1, 2))}, {"bending_moment": "N m"})


def balloon(
    case, seed: int = 5, top: float = 13000.0, spacing: float = 300.0, factor: float = 1.0, hour: int = 12
) -> Sounding:
    levels = np.arange(300.0, top, spacing)
    wind = random_wind(case, levels).drawn(np.random.default_rng(seed), 1)[0]
    return Sounding("balloon", "", datetime.datetime(2003, 3, 1, hour), levels, factor * wind, 0 * wind)


def asked(case, soundings, hours, **more):
    return case.day_of_launch(soundings, hours, window=WINDOW, **({"responses": THREE} | more))


def test_conditioning_equals_the_dense_gaussian_vector(as504):
    """Two balloons of different lags and errors: all blocks written out, and the textbook's formula."""
    first, second = balloon(as504), balloon(as504, 6, 9000.0, 450.0, hour=16)
    persistence = Persistence(40.0, 0.8, 8000.0, 0.7)
    found = asked(as504, [first, second], [6.0, 2.0], persistence=persistence, error=1.3)
    field, flight = found.flight.field, found.flight
    W = field.waves

    def rho(hours: float) -> np.ndarray:
        waves = 2 * W.shape[0] * (field.levels[1] - field.levels[0]) / np.maximum(np.arange(W.shape[0]), 1e-300)
        return np.exp(-((hours / (40.0 * np.minimum(1, waves / 8000.0) ** 0.7)) ** 0.8))

    H = []
    for sounding in (first, second):
        rows = np.zeros((sounding.altitude.size, field.levels.size))
        for k, h in enumerate(sounding.altitude):
            i = int(np.searchsorted(field.levels, h, side="right")) - 1
            share = (h - field.levels[i]) / (field.levels[i + 1] - field.levels[i])
            rows[k, i], rows[k, i + 1] = 1 - share, share
        H.append(rows)
    lags = (0.0, 4.0), (4.0, 0.0)
    K = np.block([[H[a] @ (W * rho(lags[a][b])) @ W.T @ H[b].T for b in (0, 1)] for a in (0, 1)])
    K += 1.3**2 * np.eye(len(K))
    cross = np.vstack([H[0] @ (W * rho(6)) @ W.T, H[1] @ (W * rho(2)) @ W.T])  # with the wind at launch
    A = flight.weights.weight
    c = np.einsum("kl,mrl->kmr", cross, A)
    z = np.concatenate([s.u - rows @ field.wind.mean for s, rows in zip((first, second), H, strict=True)])
    mean = flight.mean + np.einsum("kmr,k->mr", c, np.linalg.solve(K, z))
    taken = np.einsum("kmr,kmr->mr", c, np.linalg.solve(K, c.reshape(len(K), -1)).reshape(c.shape))
    np.testing.assert_allclose(found.mean, mean, rtol=0, atol=1e-9 * np.abs(mean).max())
    std = np.sqrt(flight.std**2 - taken)
    assert (np.abs(found.std / std - 1).max(axis=0) < 1e-9).all()
    expected = field.wind.mean + cross.T @ np.linalg.solve(K, z)
    np.testing.assert_allclose(found.wind["mean"], expected, atol=1e-9)


def test_one_balloon_after_the_other_is_both_at_once(as504):
    first, second = balloon(as504), balloon(as504, 6, hour=16)
    both = asked(as504, [first, second], [6.0, 2.0])
    updated = asked(as504, first, 6.0).update(second, 2.0)
    np.testing.assert_allclose(updated.mean, both.mean, rtol=1e-12)
    np.testing.assert_allclose(updated.std, both.std, rtol=1e-10)
    assert (both.std <= asked(as504, first, 6.0).std * (1 + 1e-12)).all()


def test_limits_of_lag_and_error(as504):
    sounding = balloon(as504)
    forgotten = asked(as504, sounding, 1e9)
    np.testing.assert_allclose(forgotten.mean, forgotten.flight.mean, rtol=1e-9)
    np.testing.assert_allclose(forgotten.std, forgotten.flight.std, rtol=1e-9)
    useless = asked(as504, sounding, 0.0, error=1e9)
    np.testing.assert_allclose(useless.std, useless.flight.std, rtol=1e-9)
    exact = as504.response_statistics([70.0], responses=THREE)
    at = int(np.argmin(np.abs(forgotten.times - 70.0)))
    assert forgotten.times[at] == pytest.approx(70.0)
    np.testing.assert_allclose(forgotten.std[at], exact.std.sel(source="combined").values.ravel(), rtol=1e-5)
    # variances do not know what was measured, only where
    other = asked(as504, balloon(as504, 9), 3.0)
    np.testing.assert_allclose(other.std, asked(as504, sounding, 3.0).std, rtol=1e-12)
    assert np.abs(other.mean - asked(as504, sounding, 3.0).mean).max() > 0


def test_everything_measured_just_now_without_error_is_the_profile_itself(as504):
    """Every grid level at lag zero: the response flies the profile, what stays is the vehicle and the wind between."""
    field = asked(as504, balloon(as504), 1.0).flight.field
    levels = field.levels[::3]  # 75 m apart: none is passed over
    wind = field.wind.drawn(np.random.default_rng(1), 1)[0][::3]
    straight = np.interp(field.levels, levels, wind)
    sounding = Sounding("all", "", None, levels, wind, 0 * levels)
    found = asked(as504, sounding, 0.0, error=0.0)
    assert found.measured.condition < 1e7
    assert found.measured.jitter <= 1e-13
    flown = as504.fly(Sounding("all", "", None, field.levels, straight, 0 * straight), found.times, responses=THREE)
    assert (np.abs(found.mean - flown.values[0]).max(axis=0) < 2e-3 * found.flight.std.max(axis=0)).all()
    np.testing.assert_allclose(found.wind["mean"].values[::3], wind, atol=1e-6)
    vehicle = as504.response_statistics(found.times[::40], responses=THREE).variance
    rest = (vehicle.sel(source="combined") - vehicle.sel(source="wind")).transpose("time", "response").values
    left = found.std[::40] ** 2 - rest
    assert (np.abs(left) < 0.03 * found.flight.std[::40] ** 2).all()  # the wind between levels, which is rough


def test_total_variance_over_simulated_soundings(as504):
    """E Var + Var E = Var: over 1500 winds at launch and the soundings 3 h before that go with them."""
    sounding, error, hours = balloon(as504), 1.0, 3.0
    found = asked(as504, sounding, hours)
    field, random = found.flight.field, np.random.default_rng(8)
    n = field.levels.size
    now, other = random.standard_normal((2, 1500, n))
    rho = field.kept(found.persistence, hours)
    before = rho * now + np.sqrt(1 - rho**2) * other
    z = before @ field.rows(sounding.altitude).T + error * random.standard_normal((1500, sounding.altitude.size))
    gain = found._gain
    expected = (found.measured.whitened(z.T).T @ gain).reshape(1500, *found.mean.shape)
    wind_only = np.einsum("mrn,sn->smr", found.flight.by_wave, now)
    remains = (wind_only - expected).var(axis=0)
    by_wind = (found.flight.by_wave**2).sum(axis=2)
    taken = found.flight.std**2 - found.std**2
    chi = stats.chi2.ppf([0.00005, 0.99995], 1500) / 1500  # 99 % together, of some hundred correlated ones
    assert (expected.var(axis=0) / taken > chi[0]).all() and (expected.var(axis=0) / taken < chi[1]).all()
    assert (remains / (by_wind - taken) > chi[0]).all() and (remains / (by_wind - taken) < chi[1]).all()


def test_the_default_persistence_has_the_measured_correlation_after_a_day(as504):
    field = wind_field(as504, 30000.0)
    for component in ("zonal", "meridional"):
        found = default_persistence(field, [component])
        correlation = field.correlation_in_time(found, np.array(MEASURED_LEVELS), DAY)
        assert correlation.mean() == pytest.approx(np.mean(MEASURED[component]), abs=1e-8)
        assert "assumed" in found.source
    slow, fast = default_persistence(field, ["zonal"], 1.0), default_persistence(field, ["zonal"])
    level = np.array([5830.0])
    assert field.correlation_in_time(slow, level, 3.0) > field.correlation_in_time(fast, level, 3.0)


def test_a_field_of_waves_has_the_winds_covariance_and_one_rho_is_separable(as504):
    field = wind_field(as504, 12000.0)
    np.testing.assert_allclose(field.waves @ field.waves.T, field.wind.covariance, atol=1e-9)
    alike = Persistence(30.0, 1.0, 10_000.0, 0.0)
    rho = field.kept(alike, 6.0)
    np.testing.assert_allclose((field.waves * rho) @ field.waves.T, np.exp(-0.2) * field.wind.covariance, rtol=1e-9)


def test_ones_own_pairs_give_the_persistence_back(as504):
    """Winds drawn every 6 h with a known persistence: hours and exponent within their sampling error."""
    field, true = wind_field(as504, 12000.0), Persistence(30.0, 1.0, source="true")
    random, count = np.random.default_rng(4), 3000
    rho = field.kept(true, 6.0)  # of p = 1, a first-order process
    x = [random.standard_normal(field.levels.size)]
    for _ in range(count - 1):
        x.append(rho * x[-1] + np.sqrt(1 - rho**2) * random.standard_normal(rho.size))
    levels = np.array([1000.0, 3000.0, 6000.0, 9000.0])
    u = field.wind.mean[0] + np.array(x) @ field.rows(levels).T
    time = np.datetime64("2003-03-01T00:00", "m") + np.timedelta64(360, "m") * np.arange(count)
    read = Soundings(levels, u, 0 * u, time, tuple(map(str, range(count))), "", "drawn", hours_stated=True)
    found = as504.persistence(read)
    assert found.hours == pytest.approx(30.0, rel=0.15)
    assert found.exponent == pytest.approx(1.0, abs=0.1)
    assert "6, 12, 18, 24" in found.source
    with pytest.raises(SoundingError, match="no lag has 20 pairs"):
        as504.persistence(Soundings(levels, u[:10], u[:10], time[:10], tuple(map(str, range(10))), "", "few"))


@pytest.mark.slow
def test_the_chance_of_passing_a_limit(as504):
    """Far from the wind of the day it is the season's; a calm day is better, a stormy one worse, and go follows."""
    forgotten = asked(as504, balloon(as504), 1e9, limits=LIMITS, responses=None)
    season = as504.limit_passage(LIMITS, WINDOW, draws=4000).probability
    for estimate in (forgotten.passage.probability, forgotten.climatological_passage.probability):
        spread = np.hypot(estimate.standard_error, season.standard_error)
        assert abs(estimate.value - season.value) < 4 * spread + 0.08 * season.value  # of both grids
    levels = np.arange(300.0, 13000.0, 300.0)
    mean = random_wind(as504, levels).mean
    calm, storm = (Sounding("s", "", None, levels, f * mean, 0 * mean) for f in (0.5, 1.9))
    good = asked(as504, calm, 2.0, limits=LIMITS, responses=None)
    bad = asked(as504, storm, 2.0, limits=LIMITS, responses=None)
    assert good.go and good.probability < 0.1 * season.value
    assert not bad.go and bad.probability > 10 * season.value
    assert np.nanmin(good.margin_in_sigmas()) > np.nanmin(good.margin_in_sigmas(climatology=True))
    assert "no-go" in repr(bad)
    dataset = bad.to_dataset()
    assert dataset["margin_in_sigmas"].sizes == {"time": bad.times.size, "response": 1}


@pytest.mark.slow
def test_what_the_grid_of_times_misses_is_added(as504):
    """The whole flight on its grid of 0.04 s against 0.013 s: passed far out, a tenth is missed without it."""
    limits, given = aw.Limits.constant(1.7e7, "bending_moment", "N m"), balloon(as504, 7)
    whole, close = (
        as504.day_of_launch(given, 1.0, limits=limits, window=window, draws=6000) for window in (None, (60.0, 92.0))
    )
    spread = 4 * np.hypot(whole.chance.standard_error, close.chance.standard_error)
    assert whole.passage.probability.value < 0.94 * close.probability
    left = whole.chance.spacing_error * close.probability
    assert whole.probability == pytest.approx(close.probability, abs=spread + left)
    assert whole.chance.spacing_error < 0.08 and close.chance.spacing_error < 0.015


def test_simulated_launches_pass_as_often_as_said(as504):
    """5000 flights drawn given a sounding, on the fine grid, against the importance sampling of the same process."""
    storm = balloon(as504, factor=1.0)
    limits = aw.Limits.over_time([0.0, 150.0], {"bending_moment": [1.5e7, 1.5e7]}, {"bending_moment": "N m"})
    found = asked(as504, storm, 3.0, limits=limits, responses=None)
    process, p = found.passage.process, found.passage.probability
    paths = process.drawn.mean + process.deviations(np.random.default_rng(0), 5000)
    on_grid = (np.abs(paths) > 1.5e7).any(axis=(1, 2)).mean()
    assert on_grid == pytest.approx(p.value, abs=4 * np.sqrt(p.value / 5000) + 0.25 * p.value)
    assert on_grid <= p.value + 4 * np.sqrt(p.value / 5000)  # paths pass between points too


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"hours": -1.0}, ParameterValueError, "a sounding -1.0 h before launch"),
        ({"hours": "3"}, ParameterValueError, "a sounding '3' h before"),
        ({"hours": [1.0, 2.0]}, ParameterValueError, "1 soundings and 2 times"),
        ({"error": -1.0}, ParameterValueError, "error = -1.0"),
        ({"threshold": 1.5}, ParameterValueError, "threshold = 1.5"),
        ({"factor": 9.0}, SoundingError, r"standard deviations from the mean of the vehicle's wind.*is it in knots"),
        ({"limits": ALONG}, LimitError, "is over stations of the structure; leave responses out"),
        ({"limits": aw.Limits.constant(1.0, "bending_moment", "kN m")}, LimitError, r"\[kN m\], expected \[N m\]"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused(as504, change, error, says):
    hours, factor = change.pop("hours", 3.0), change.pop("factor", 1.0)
    with pytest.raises(error, match=says):
        asked(as504, balloon(as504, factor=factor), hours, **change)


def test_a_balloon_below_the_flight_is_refused_and_many_are_not_one(as504, tmp_path):
    low = Sounding("low", "", None, np.array([10.0, 100.0]), np.zeros(2), np.zeros(2))
    with pytest.raises(SoundingError, match=r"sounding low: holds 10 to 100 m, and the flight goes from 163"):
        asked(as504, low, 3.0)
    file = tmp_path / "two.csv"
    file.write_text("profile,altitude [m],u [m/s],v [m/s]\n1,500,3,0\n1,900,3,0\n2,500,3,0\n2,900,3,0\n")
    with pytest.raises(SoundingError, match="two.csv: holds 2 soundings, 1 to 2; give the one before launch"):
        asked(as504, file, 3.0)
    with pytest.raises(LimitError, match="there is no limit of the responses"):
        _ = asked(as504, balloon(as504), 3.0).probability


@pytest.mark.parametrize("bad", [{"hours": 0.0}, {"exponent": 2.5}, {"wavelength": -1.0}, {"scale_exponent": -0.1}])
def test_persistence_that_is_none(bad):
    with pytest.raises(ParameterValueError, match=rf"persistence of {next(iter(bad))}"):
        Persistence(**({"hours": 10.0} | bad))


@pytest.mark.parametrize("error", [0.0, 0.7])
def test_the_recursive_predictor_is_the_batch(as504, error):
    """A Kalman filter over altitude against conditioning all levels at once: 1e-9."""
    below = np.unique(np.concatenate([np.arange(200.0, 7001.0, 110.0), [6890.0]]))
    ahead = np.arange(7100.0, 15000.0, 330.0)
    random = random_wind(as504, np.concatenate([below, ahead]))
    wind = random.drawn(np.random.default_rng(2), 1)[0][: below.size]
    found = as504.predict_wind(below, wind, ahead, error=error)
    R, k = random.covariance, below.size
    K = Measured(R[:k, :k] + error**2 * np.eye(k))
    gain = K.whitened(R[:k, k:])
    mean = random.mean[k:] + K.whitened(wind - random.mean[:k]) @ gain
    std = np.sqrt(np.diagonal(R)[k:] - (gain**2).sum(axis=0))
    np.testing.assert_allclose(found["predicted"], mean, rtol=0, atol=1e-9 * np.abs(mean).max())
    np.testing.assert_allclose(found["std"], std, rtol=1e-9)
    # one step ahead at the last measured level, from those below
    less = Measured(R[: k - 1, : k - 1] + error**2 * np.eye(k - 1))
    step = random.mean[k - 1] + less.whitened(wind[:-1] - random.mean[: k - 1]) @ less.whitened(R[: k - 1, k - 1])
    assert float(found["one_step"][-1]) == pytest.approx(float(step), abs=1e-9)
    assert found["gain"].sizes == {"altitude": k, "state": 3}


def test_balloons_that_do_not_go_together(as504):
    """Of two stations; dated otherwise than their hours before launch say, by less than the hour of a file or more."""
    first = balloon(as504)  # of 12:00
    assert first.time is not None
    launch = asked(as504, first, 6.0)
    with pytest.raises(SoundingError, match="of station 'B', and balloon of 'A'; take balloons of one station"):
        asked(as504, [replace(first, station="A"), replace(first, station="B", time=None)], [6.0, 2.0])
    for minutes, fits in ((240, True), (200, True), (340, False), (0, False), (-240, False)):
        later = replace(balloon(as504, 6), time=first.time + datetime.timedelta(minutes=minutes))
        if fits:
            assert launch.update(later, 2.0).balloons.names[1] == "balloon, 2 h before"
            continue
        with pytest.raises(SoundingError, match=r"and 2 and 6 h before launch make that \+4 h; correct the hours"):
            launch.update(later, 2.0)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"ahead": [500.0]}, "500 m is not ahead of the last measurement at 900 m"),
        ({"wind": [1.0]}, "1 winds at 2 altitudes"),
        ({"altitude": [900.0, 300.0]}, "altitude does not increase"),
        ({"altitude": ["x"]}, "are no numbers"),
        ({"error": -1.0}, "an error of -1.0"),
        ({"ahead": [np.nan]}, "ahead is a list of finite numbers"),
        ({"wind": [1.0, 90.0]}, "90 m/s at 900 m is .* standard deviations from the mean .* is it in knots"),
    ],
)
def test_what_cannot_be_predicted_is_refused(as504, change, says):
    given = {"altitude": [300.0, 900.0], "wind": [1.0, 2.0], "ahead": [1000.0]} | change
    with pytest.raises(ParameterValueError, match=says):
        as504.predict_wind(**given)
