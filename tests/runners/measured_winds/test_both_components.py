"""Measured winds in both planes: against the study's own statistics, one component alone, and the dense vector."""

from __future__ import annotations

import numpy as np
import pytest
import sounding_files as files
import xarray as xr
from planes import EACH, in_both, in_one
from scipy import stats

import ascentwind as aw
from ascentwind.model.errors import DataError, ParameterValueError, PlanesError, UnknownNameError
from ascentwind.model.wind.soundings.collection import Soundings
from ascentwind.model.wind.soundings.sounding import Sounding, SoundingError
from ascentwind.runners import Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.measured_winds.conditioning import Measured
from ascentwind.runners.measured_winds.level_weights import level_weights
from ascentwind.runners.measured_winds.persistence import DAY, MEASURED, MEASURED_LEVELS
from ascentwind.runners.measured_winds.random_wind import random_wind
from ascentwind.runners.measured_winds.wind_field import wind_field

MOMENTS = ["pitch_bending_moment", "yaw_bending_moment"]
WINDOW = (55.0, 85.0)


@pytest.fixture(scope="module")
def both(cache):
    return Study.load("as504", changes={"planes": "both"})


def drawn(case, levels, count: int, seed: int = 1) -> Soundings:
    wind = random_wind(case, levels).drawn(np.random.default_rng(seed), count)
    none, k = np.full(count, np.datetime64("NaT", "m"), "datetime64[m]"), levels.size
    return Soundings(levels, wind[:, :k], wind[:, k:], none, tuple(map(str, range(count))), "", "drawn")


def balloon(case, seed: int = 5, top: float = 13000.0) -> Sounding:
    levels = np.arange(300.0, top, 300.0)
    one = drawn(case, levels, 1, seed)
    return Sounding("balloon", "", None, levels, one.u[0], one.v[0])


def test_weights_turn_with_the_heading_and_the_mean_wind_gives_the_mean(both):
    """Az + 90 deg: what u did v does, what v did -u does; and the mean wind at close levels makes the mean response."""
    times, levels = [60.0, 75.0], np.arange(150.0, 20001.0, 20.0)
    here = level_weights(both, times, levels, both.system.output_names)
    azimuth = both.parameters["wind.azimuth"].value
    turned = both.with_parameters({"wind.azimuth": azimuth + np.pi / 2})
    there = level_weights(turned, times, levels, both.system.output_names)
    by_u, by_v = np.split(here.weight, 2, axis=2)
    largest = np.abs(here.weight).max(axis=2, keepdims=True)
    assert (np.abs(there.weight - np.concatenate([by_v, -by_u], axis=2)) <= 1e-9 * largest).all()
    mean = both.response_statistics(times).mean.sel(source="combined").transpose("time", "response").values
    found = here.responses(random_wind(both, levels).mean)
    assert (np.abs(found - mean).max(axis=0) < 1e-4 * np.abs(mean).max(axis=0) + 1e-12).all()


def test_independent_components_at_azimuth_zero_are_each_planes_own(cache):
    """Az = 0: u blows across (yaw), v along (pitch); each plane by itself in its component, to rounding."""
    together = Study.from_vehicle(in_both(EACH, independent=True), compile=False)
    together = together.with_parameters({"wind.azimuth": 0.0})
    levels = np.arange(100.0, 20001.0, 400.0)
    winds = drawn(together, levels, 3)
    flown = together.fly(winds, [60.0, 75.0], responses=MOMENTS)
    for plane, component in (("yaw", "zonal"), ("pitch", "meridional")):
        alone = Study.from_vehicle(in_one(plane, component, EACH), compile=False)
        wanted = alone.fly(winds, [60.0, 75.0], responses=["bending_moment"], component=component)
        r = MOMENTS.index(f"{plane}_bending_moment")
        np.testing.assert_allclose(flown.values[:, :, r], wanted.values[:, :, 0], rtol=1e-7)
        np.testing.assert_allclose(flown.predicted_std[:, r], wanted.predicted_std[:, 0], rtol=1e-7)


def test_simulated_soundings_give_the_resultants_percentiles(both):
    """2000 winds every 50 m: variances, percentiles of the norm, its flight maxima within four standard errors."""
    times = np.arange(50.0, 81.0, 2.0)
    flown = both.fly(drawn(both, np.arange(150.0, 14000.0, 50.0), 2000), times, responses=MOMENTS)
    exact = both.response_statistics(times, responses=MOMENTS)
    variance = exact.variance.sel(source="wind").transpose("time", "response").values
    off = flown.values.var(axis=0, ddof=1) / (variance * (1 - flown.missed_share)) - 1
    assert np.abs(off).max() < 4 * np.sqrt(2 / 1999)
    found = flown.resultants
    np.testing.assert_allclose(found.values[..., 0], np.hypot(flown.values[..., 0], flown.values[..., 1]))
    percentiles = found.percentiles([0.05, 0.5, 0.95])
    low, high = percentiles["interval"].values
    assert ((low <= percentiles["predicted"]) & (percentiles["predicted"] <= high)).values.mean() > 0.8
    beyond = (found.values[..., 0] > percentiles["predicted"].sel(probability=0.95).values[:, 0]).mean(axis=0)
    assert np.abs(beyond - 0.05).max() < 4 * np.sqrt(0.05 * 0.95 / 2000)
    chance = np.asarray(stats.ks_2samp(found.maxima[:, 0], found.predicted_maxima[:, 0]))[1]
    assert chance > 6e-5  # four standard errors
    name, _, value, time = found.worst("resultant_bending_moment", 1)[0]
    assert value == found.values[int(name), list(times).index(time), 0] == found.maxima.max()
    assert found.to_dataset()["value"].sizes == {"profile": 2000, "time": 16, "response": 1}
    wanted = exact.norm(*MOMENTS, source="wind").percentile(0.05)  # of all wind, not only what is straight
    assert np.abs(percentiles["predicted"].sel(probability=0.95).values[:, 0] / wanted - 1).max() < 0.01


def test_what_one_component_lacks_the_other_helps_to_complete(both):
    """Above a burst both components follow from both below: the dense vector's conditional mean and covariance."""
    levels = np.arange(150.0, 14001.0, 250.0)
    winds, hidden = drawn(both, levels, 40), levels > 9000
    u, v = winds.u.copy(), winds.v.copy()
    u[:, hidden] = v[:, hidden] = np.nan
    burst = Soundings(levels, u, v, winds.time, winds.names, "", "burst")
    flown = both.fly(burst, [75.0, 85.0], responses=MOMENTS)
    R, mean, unseen = random_wind(both, levels).covariance, random_wind(both, levels).mean, np.tile(hidden, 2)
    gain = R[np.ix_(unseen, ~unseen)] @ np.linalg.inv(R[np.ix_(~unseen, ~unseen)])
    seen = np.concatenate([u, v], axis=1)[:, ~unseen]
    wanted = mean[unseen] + (seen - mean[~unseen]) @ gain.T
    at = np.isin(flown.profiles.levels, levels)
    np.testing.assert_allclose(flown.profiles.wind[:, np.tile(at, 2)][:, unseen], wanted, atol=1e-7)
    assert (flown.residual_std > 0).all()
    assert len(flown.resultants.completed) == 2000


def test_conditioning_equals_the_dense_gaussian_vector(both):
    """Both components of two balloons, each with a persistence of its own: all blocks written out."""
    first, second = balloon(both), balloon(both, 6, 9000.0)
    zonal, meridional = aw.Persistence(40.0, 0.8, 8000.0, 0.7), aw.Persistence(20.0, 1.0, 9000.0, 1.0)
    lasting = aw.ComponentPersistence(zonal, meridional)
    found = both.day_of_launch([first, second], [6.0, 2.0], window=WINDOW, responses=MOMENTS, persistence=lasting)
    field, flight = found.flight.field, found.flight
    W, h = field.waves, field.levels
    np.testing.assert_allclose(W @ W.T, random_wind(both, h).covariance, atol=1e-9)
    waves = 2 * h.size * (h[1] - h[0]) / np.maximum(np.arange(h.size), 1e-300)

    def rho(hours: float) -> np.ndarray:
        slow = np.exp(-((hours / (40.0 * np.minimum(1, waves / 8000.0) ** 0.7)) ** 0.8))
        return np.concatenate([slow, np.exp(-(hours / (20.0 * np.minimum(1, waves / 9000.0))))])

    H = []
    for sounding in (first, second):
        one = np.array([np.interp(sounding.altitude, h, unit) for unit in np.eye(h.size)]).T
        H.append(np.kron(np.eye(2), one))
    lags = (0.0, 4.0), (4.0, 0.0)
    K = np.block([[H[a] @ (W * rho(lags[a][b])) @ W.T @ H[b].T for b in (0, 1)] for a in (0, 1)])
    K += np.eye(len(K))
    cross = np.vstack([H[0] @ (W * rho(6)) @ W.T, H[1] @ (W * rho(2)) @ W.T])
    pairs = zip((first, second), H, strict=True)
    z = np.concatenate([np.concatenate([s.u, s.v]) - rows @ field.wind.mean for s, rows in pairs])
    c = np.einsum("kl,mrl->kmr", cross, flight.weights.weight)
    mean = flight.mean + np.einsum("kmr,k->mr", c, np.linalg.solve(K, z))
    solved = np.linalg.solve(K, c.reshape(len(K), -1)).reshape(c.shape)
    covariance = flight.covariance - np.einsum("kmr,kms->mrs", c, solved)
    np.testing.assert_allclose(found.mean, mean, rtol=0, atol=1e-9 * np.abs(mean).max())
    np.testing.assert_allclose(found.covariance, covariance, rtol=0, atol=1e-9 * covariance.max())
    expected = field.wind.mean + cross.T @ np.linalg.solve(K, z)
    np.testing.assert_allclose(found.wind["mean"].values.ravel(), expected, atol=1e-9)
    assert found.resultants == ("resultant_bending_moment",)
    law = found.law("resultant_bending_moment")
    np.testing.assert_allclose(law.covariance, found.covariance, rtol=1e-12)
    updated = both.day_of_launch(first, 6.0, window=WINDOW, responses=MOMENTS, persistence=lasting).update(second, 2.0)
    np.testing.assert_allclose(updated.mean, found.mean, rtol=1e-9)


def test_far_from_launch_it_is_the_seasons_resultant(both):
    found = both.day_of_launch(balloon(both), 1e9, window=WINDOW, responses=MOMENTS)
    exact = both.response_statistics([70.0], responses=MOMENTS)
    at = int(np.argmin(np.abs(found.times - 70.0)))
    wanted = exact.norm(*MOMENTS).percentile()
    np.testing.assert_allclose(found.law("resultant_bending_moment").percentile()[at], wanted[0], rtol=1e-5)
    dataset = found.to_dataset()
    level = dataset["climatological_resultant_level"].values
    np.testing.assert_allclose(dataset["resultant_level"].values, level, rtol=1e-8)
    with pytest.raises(UnknownNameError, match="no resultant"):
        found.law("resultant_moment")


def test_each_component_lasts_as_measured_at_the_cape(both):
    launch = both.day_of_launch(balloon(both), 3.0, window=WINDOW, responses=MOMENTS)
    levels, found = np.array(MEASURED_LEVELS), launch.persistence
    for number, component in enumerate(("zonal", "meridional")):
        correlation = launch.flight.field.correlation_in_time(found, levels, DAY, number)
        assert correlation.mean() == pytest.approx(np.mean(MEASURED[component]), abs=1e-6)
    assert found.zonal.hours > found.meridional.hours
    assert wind_field(both, 5000.0).components == 2


@pytest.mark.parametrize("error", [0.0, 0.7])
def test_the_recursive_predictor_is_the_batch(both, error):
    below, ahead = np.arange(200.0, 7001.0, 110.0), np.arange(7100.0, 15000.0, 330.0)
    random, k = random_wind(both, np.concatenate([below, ahead])), below.size
    whole = random.drawn(np.random.default_rng(2), 1)[0].reshape(2, -1)
    found = both.predict_wind(below, whole[:, :k].T, ahead, error=error)
    seen = np.tile(np.arange(k + ahead.size) < k, 2)
    R, mean = random.covariance, random.mean
    K = Measured(R[np.ix_(seen, seen)] + error**2 * np.eye(2 * k))
    gain = K.whitened(R[np.ix_(seen, ~seen)])
    wanted = mean[~seen] + K.whitened(whole.ravel()[seen] - mean[seen]) @ gain
    std = np.sqrt(np.diagonal(R)[~seen] - (gain**2).sum(axis=0))
    np.testing.assert_allclose(found["predicted"].values.T.ravel(), wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_allclose(found["std"].values.T.ravel(), std, rtol=1e-9)
    assert found["gain"].sizes == {"altitude": k, "component": 2, "state": 6}


def knots(s: Sounding) -> Sounding:
    return Sounding(s.name, "", None, s.altitude, s.u, 9 * s.v)


@pytest.mark.parametrize(
    ("ask", "error", "says"),
    [
        (lambda s, b: s.fly(b, [70.0], component="zonal"), DataError, "meets both components; leave component"),
        (lambda s, b: s.day_of_launch(b, 3.0, sign=-1), DataError, "meets both components; leave component"),
        (lambda s, b: s.day_of_launch(knots(b), 3.0), SoundingError, "of the vehicle's meridional wind.*in knots"),
        (lambda s, b: s.predict_wind([300.0], [5.0], [900.0]), ParameterValueError, "towards the east, towards the"),
        (lambda s, b: s.fly(b, [70.0], responses=["pitch_q_alpha"]).resultants, PlanesError, "is of both planes"),
    ],
)  # fmt: skip
def test_what_cannot_be_asked_is_refused(both, ask, error, says):
    with pytest.raises(error, match=says):
        ask(both, balloon(both))


def test_one_plane_has_one_persistence(as504):
    lasting = aw.ComponentPersistence(aw.Persistence(30.0), aw.Persistence(20.0))
    levels = np.arange(300.0, 9000.0, 300.0)
    one = Sounding("s", "", None, levels, np.full(levels.size, 5.0), 0 * levels)
    with pytest.raises(ParameterValueError, match="meets the zonal wind alone; give the Persistence"):
        as504.day_of_launch(one, 3.0, window=WINDOW, persistence=lasting)


def test_files_of_flown_resultants(both, tmp_path, monkeypatch):
    winds = drawn(both, np.arange(0.0, 16001.0, 1000.0), 25)
    file = tmp_path / "winds.csv"
    file.write_text(files.own_text(winds.altitude, winds.u, winds.v))
    asked = ["fly", "as504", file, "--set", "planes=both", "--times", "60:80:5", "--out", tmp_path / "out"]
    asked += ["--response", MOMENTS[0], "--response", MOMENTS[1]]
    monkeypatch.setattr("sys.argv", ["ascentwind", *map(str, asked)])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    with xr.open_dataset(tmp_path / "out" / "flown_resultants.nc") as found:
        assert found["resultant_bending_moment_value"].attrs["units"] == "N m"
    assert (tmp_path / "out" / "flown_resultant_bending_moment.png").exists()
    assert "resultant_bending_moment,N m,1," in (tmp_path / "out" / "worst_profiles.csv").read_text()
