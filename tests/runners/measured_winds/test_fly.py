"""Measured winds flown: against integration, simulated soundings, and the dense vector where parts are missing."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
import sounding_files as files
from lag import lag
from scipy import stats

from ascentwind.model.errors import DataError, NoVehicleError, TimeRangeError, UnknownNameError
from ascentwind.model.tables import Table
from ascentwind.model.wind.soundings.collection import Soundings
from ascentwind.model.wind.soundings.sounding import Sounding, SoundingError
from ascentwind.model.wind.statistics import WindModel
from ascentwind.runners import Study
from ascentwind.runners.case.chain import chain_at
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.flight_load.process import joint_covariance
from ascentwind.runners.measured_winds.level_weights import level_weights
from ascentwind.runners.measured_winds.profiles import UnlikelyWindWarning
from ascentwind.runners.measured_winds.random_wind import random_wind
from ascentwind.runners.solvers.mean_response import mean_response
from ascentwind.runners.wind.verification import verify

THREE = ["bending_moment", "angle_of_attack", "engine_angle"]
TIMES = [41.0, 60.0, 75.0, 79.5, 90.0]


def soundings(levels, wind, names=None) -> Soundings:
    n = len(wind)
    none = np.full(n, np.datetime64("NaT", "m"), "datetime64[m]")
    return Soundings(np.asarray(levels, float), wind, 0 * wind, none, names or tuple(map(str, range(n))), "", "drawn")


def jagged(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return a profile of a wild wind at uneven levels from the start of the flight to above its end."""
    random = np.random.default_rng(seed)
    levels = np.unique(np.concatenate([[100.0], np.sort(random.uniform(150, 30000, 70)), [31000.0]]))
    return levels, random.normal(10, 12, levels.size)


@pytest.mark.slow  # CVODES without compiled code
def test_a_deterministic_profile_equals_its_integration(as504):
    """The mean response in the profile as a mean wind, by the mean's own integrator: 1e-6 of the largest."""
    levels, wind = jagged()
    ends = np.arange(12.0, 93.0, 2.0)
    flown = as504.fly(soundings(levels, wind[None]), ends, responses=THREE)
    old = as504.vehicle.wind
    table = Table("wind.mean", "m/s", levels, wind, "linear")
    vehicle = replace(as504.vehicle, wind=WindModel(table, old.shaping_filter, old.standard_deviation))
    study = Study.from_vehicle(vehicle, compile=False)
    times = np.array([study.system.start, *ends])
    wanted = mean_response(study.with_means, times, 1e-10).outputs[1:, [study.system.output_index(n) for n in THREE]]
    assert (np.abs(flown.values[0] - wanted).max(axis=0) < 1e-6 * np.abs(wanted).max(axis=0)).all()


@pytest.mark.filterwarnings("ignore::ascentwind.errors.UnlikelyWindWarning")
def test_a_file_of_one_profile_is_flown(as504, tmp_path):
    levels, wind = jagged(1)
    rows = [f"{h!r},{u!r},0" for h, u in zip(levels.tolist(), wind.tolist(), strict=True)]
    file = tmp_path / "profile.csv"
    file.write_text("\n".join(["altitude [m],u [m/s],v [m/s]", *rows]))
    flown = as504.fly(file, TIMES, responses=THREE)
    np.testing.assert_allclose(flown.values, as504.fly(soundings(levels, wind[None]), TIMES, responses=THREE).values)
    assert flown.profiles.names == ("profile",)
    sounding = Sounding("one", "", None, levels, wind, 0 * wind)
    np.testing.assert_allclose(as504.fly(sounding, TIMES, responses=THREE).values, flown.values)


def test_the_mean_wind_at_its_own_levels_gives_nearly_the_mean(as504):
    """Straight lines every 10 m against the monotone cubic of the mean's table."""
    levels = np.unique(np.concatenate([np.arange(150.0, 30001.0, 10.0), as504.vehicle.wind.mean.argument]))
    weights = level_weights(as504, TIMES, levels, as504.system.output_names)
    found = weights.responses(random_wind(as504, levels).mean)
    wanted = as504.response_statistics(TIMES).mean.sel(source="combined").transpose("time", "response").values
    scale = np.abs(wanted).max(axis=0)
    assert (np.abs(found - wanted).max(axis=0) < 1e-5 * scale + 1e-12).all()


def test_the_covariance_of_the_wind_is_the_filters(as504):
    """Against the covariances by the adjoint that verify a filter, at the levels of its statistics."""
    from ascentwind.model.wind.range_reference import shipped_statistics

    march = shipped_statistics("march", "zonal")
    wanted = verify(as504.vehicle.wind.shaping_filter, march).covariance
    np.testing.assert_allclose(random_wind(as504, march.altitude).covariance, wanted, rtol=1e-6)


def fine_levels(case, last: float) -> np.ndarray:
    climb = Climb.of(case)
    return np.unique(
        np.concatenate([[float(climb.altitudes[0])], np.arange(200.0, float(climb.altitude(last)) + 25, 25)])
    )


def test_simulated_soundings_have_the_direct_answers_variance_and_maxima(as504):
    """2000 winds drawn from the filter, every 25 m: within four standard errors of the statistics and of the flight."""
    times = np.arange(50.0, 81.0, 2.0)
    levels = fine_levels(as504, times[-1])
    wind = random_wind(as504, levels).drawn(np.random.default_rng(11), 2000)
    flown = as504.fly(soundings(levels, wind), times, responses=THREE)
    exact = as504.response_statistics(times, responses=THREE)
    variance = exact.variance.sel(source="wind").transpose("time", "response").values
    mean = exact.mean.sel(source="combined").transpose("time", "response").values
    assert (flown.missed_share > -1e-4).all() and flown.missed_share.max() < 0.01
    off = flown.values.var(axis=0, ddof=1) / (variance * (1 - flown.missed_share)) - 1
    assert np.abs(off).max() < 4 * np.sqrt(2 / 1999)
    assert (np.abs(flown.values.mean(axis=0) - mean) < 4 * np.sqrt(variance / 2000)).all()
    # flight maxima of the direct answer: the wind's part of the states' own covariance between all times
    chain = chain_at(as504, times)
    rows = chain.output[:, [as504.system.output_index(name) for name in THREE]]
    between = joint_covariance(chain, rows, [as504.system.sources.index("wind")])
    for r in range(3):
        drawn = np.random.default_rng(12).multivariate_normal(mean[:, r], between[:, r, :, r], 20000, method="eigh")
        direct = np.abs(drawn).max(axis=1)
        for other in (direct, flown.predicted_maxima[:, r]):
            chance = np.asarray(stats.ks_2samp(flown.maxima[:, r], other))[1]
            assert chance > 6e-5  # four standard errors
        off = flown.maxima[:, r].mean() - direct.mean()
        assert abs(off) < 4 * np.hypot(flown.maxima[:, r].std() / np.sqrt(2000), direct.std() / np.sqrt(20000))
    found = flown.percentiles([0.05, 0.5, 0.95])
    inside = (found["interval"][0] <= found["predicted"]) & (found["predicted"] <= found["interval"][1])
    assert float(inside.mean()) > 0.8
    assert flown.normality("bending_moment").probability.min() > 1e-4
    assert np.abs(flown.skewed_levels("bending_moment")).max() < 0.5


def test_partly_observed_profiles_are_completed_by_the_dense_gaussian_vector(as504):
    """A burst at 9 km and a gap: conditional mean and covariance by the textbook's formula, and total variance."""
    levels = np.concatenate([[150.0], np.arange(500.0, 16001.0, 500.0)])
    random = random_wind(as504, levels)
    wind = random.drawn(np.random.default_rng(3), 600)
    seen = np.ones((600, levels.size), bool)
    seen[::2, levels > 9000] = False
    seen[::3, (levels > 3000) & (levels < 5000)] = False
    flown = as504.fly(soundings(levels, np.where(seen, wind, np.nan)), [75.0, 85.0], responses=THREE)
    assert flown.profiles.levels.tolist() == levels.tolist()
    R, o = random.covariance, seen[0]
    gain = R[np.ix_(~o, o)] @ np.linalg.inv(R[np.ix_(o, o)])
    wanted = random.mean[~o] + gain @ (wind[0, o] - random.mean[o])
    np.testing.assert_allclose(flown.profiles.wind[0, ~o], wanted, rtol=1e-8)
    np.testing.assert_array_equal(flown.profiles.wind[seen], wind[seen])
    left = R[np.ix_(~o, ~o)] - gain @ R[np.ix_(o, ~o)]
    A = flown.weights.weight[:, :, ~o]
    np.testing.assert_allclose(flown.residual_std[0], np.sqrt(np.einsum("mrk,kl,mrl->mr", A, left, A)), rtol=1e-7)
    total = flown.values.var(axis=0, ddof=1) + (flown.residual_std**2).mean(axis=0)
    assert np.abs(total / flown.predicted_std**2 - 1).max() < 4 * np.sqrt(2 / 599)
    assert len(flown.completed) == 2400
    assert np.abs(flown.completed.var(axis=0) / flown.predicted_std**2 - 1).max() < 4 * np.sqrt(2 / 599)


@pytest.mark.filterwarnings("ignore::ascentwind.errors.UnlikelyWindWarning")
def test_worst_profiles_are_named_with_their_dates(as504, tmp_path):
    levels, wind = jagged(2)
    both = np.stack([wind, 3 * wind, -wind])
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(levels, both, 0 * both))
    flown = as504.fly(file, TIMES, responses=["bending_moment"])
    (name, date, value, time), *rest = flown.worst("bending_moment", 2)
    assert (name, date) == ("1 of 2003-03-02T12:00", "2003-03-02T12:00")
    assert abs(value) == flown.maxima.max() and time in TIMES
    assert len(rest) == 1
    dataset = flown.to_dataset()
    assert dataset["value"].sizes == {"profile": 3, "time": 5, "response": 1}


@pytest.mark.filterwarnings("ignore::ascentwind.errors.UnlikelyWindWarning")
def test_the_component_across_the_flight(as504):
    levels, wind = jagged(3)
    read = soundings(levels, wind[None])
    east = as504.fly(read, TIMES, responses=THREE).values
    flown = as504.fly(read, TIMES, responses=THREE, component="zonal", sign=-1)
    rest = flown.weights.rest
    np.testing.assert_allclose(flown.values - rest, -(east - rest), rtol=1e-10)
    meridional = as504.fly(read, TIMES, responses=THREE, component="meridional")
    np.testing.assert_allclose(meridional.values[0], rest, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"component": "east"}, UnknownNameError, "no wind component 'east'"),
        ({"component": "zonal", "sign": 2}, DataError, "the sign of a wind is 2"),
        ({"responses": ["moment"]}, UnknownNameError, "no response 'moment'; did you mean 'bending_moment'"),
        ({"times": [500.0]}, TimeRangeError, "500 s lies beyond"),
        ({"profiles": 3.0}, DataError, "3.0 are no soundings"),
        ({"profiles": "none.csv"}, SoundingError, "none.csv: cannot be read"),
    ],
)
def test_what_cannot_be_flown_is_refused(as504, change, error, says):
    levels, wind = jagged()
    asked = {"profiles": soundings(levels, wind[None]), "times": TIMES} | change
    with pytest.raises(error, match=says):
        as504.fly(asked.pop("profiles"), asked.pop("times"), **asked)


def test_winds_far_off_the_vehicles_are_told(as504):
    """Drawn winds are not, their values in knots are; one wind of many sigmas is, with its level."""
    levels = np.arange(0.0, 16000.0, 500.0)
    drawn = random_wind(as504, levels).drawn(np.random.default_rng(4), 40)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        as504.fly(soundings(levels, drawn), TIMES)
    with pytest.warns(UnlikelyWindWarning, match=r"root mean square of 40 profiles.*are they in knots"):
        as504.fly(soundings(levels, drawn * 3600 / 1852), TIMES)
    drawn[3, 8] = -80.0
    with pytest.warns(UnlikelyWindWarning, match=r"drawn, sounding 3, 4000 m: -80 m/s is .* standard deviations"):
        as504.fly(soundings(levels, drawn), TIMES)


def test_a_sounding_beside_the_flight_is_refused(as504):
    levels, wind = np.array([60000.0, 61000.0]), np.zeros((1, 2))
    with pytest.raises(SoundingError, match="sounding 0: holds 60000 to 61000 m, and the flight goes from"):
        as504.fly(soundings(levels, wind), TIMES)


def test_a_system_of_ones_own_has_no_measured_wind():
    with pytest.raises(NoVehicleError, match="flying a measured wind"):
        lag().fly(soundings([0, 1], np.zeros((1, 2))), [1.0])
