"""The wind behind a load, held against its flight by CVODES, its white noise and closed covariances."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.stats import chi2

import ascentwind as aw
from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.tables import Table
from ascentwind.model.wind.propagation import transitions
from ascentwind.model.wind.statistics import WindModel
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.flight_load.request import NoVarianceError
from ascentwind.runners.solvers.mean_response import mean_response

TIME = 70.0


@pytest.fixture(scope="module")
def behind(as504):
    return {name: as504.design_wind(name, TIME) for name in ("bending_moment", "angle_of_attack", "engine_angle")}


def flown(study, profile, name: str) -> float:
    """Return a response at TIME to a profile of straight lines in the place of the mean wind, by CVODES forward."""
    wind = Table("wind.mean", "m/s", profile["altitude"].values, profile["wind"].values, "linear")
    vehicle = replace(study.vehicle, wind=WindModel(wind, study.vehicle.wind.shaping_filter))
    other = aw.Study.from_vehicle(vehicle, compile=False)
    times = np.linspace(study.system.start, TIME, 1201)
    found = mean_response(other.executable, times, 1e-11)
    return float(found.outputs[-1, study.system.output_index(name)])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bending_moment", "angle_of_attack", "engine_angle"])
def test_flown_back_it_makes_the_load(as504, behind, name):
    assert flown(as504, behind[name].profile, name) == pytest.approx(behind[name].load, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "changes"), [("falcon1", {}), ("as504", {"options.gust_zones": 5})])
def test_with_zones_flown_back_it_makes_the_load(vehicle, changes, cache):
    """Of Falcon 1 the zones are milliseconds apart, so that the weights turn within metres below h(t2)."""
    study = aw.Study.load(vehicle, changes=changes)
    found = study.design_wind("bending_moment", TIME)
    h, last = found.profile["altitude"].values, float(Climb.of(study).altitude(TIME))
    assert np.abs(h - last).min() < 1e-6
    assert np.diff(h[np.abs(h - last) < 300]).max() <= 25 + 1e-5
    assert flown(study, found.profile, "bending_moment") == pytest.approx(found.load, rel=1e-6)
    assert found.norm == pytest.approx(3.0, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("sigmas", [-3.0, 0.0])
def test_the_other_side_and_the_mean(as504, sigmas):
    found = as504.design_wind("bending_moment", TIME, sigmas=sigmas)
    assert flown(as504, found.profile, "bending_moment") == pytest.approx(found.load, rel=1e-6)
    assert ("below" in repr(found)) == (sigmas < 0)
    if not sigmas:
        np.testing.assert_allclose(found.profile["wind"], found.profile["mean"], atol=1e-3)
        assert "the mean itself" in repr(found)


def test_load_is_mean_and_sigmas_of_the_wind(as504, behind):
    known = as504.response_statistics([TIME], engine=aw.Sweep(relative_tolerance=1e-10))
    for name, found in behind.items():
        at = {"response": name, "time": TIME}
        assert found.mean_response == pytest.approx(float(known.mean.sel(source="combined", **at)), rel=1e-7)
        assert found.std == pytest.approx(float(known.std.sel(source="wind", **at)), rel=1e-7)
        assert found.load == pytest.approx(found.mean_response + 3 * found.std)


def test_its_norm_in_white_noise_is_k(behind):
    for found in behind.values():
        assert found.norm == pytest.approx(3.0, rel=1e-7)


def test_a_node_at_the_altitude_of_the_load_and_dense_about_it(as504, behind):
    last = float(Climb.of(as504).altitude(TIME))
    for found in behind.values():
        h = found.profile["altitude"].values
        assert np.abs(h - last).min() < 1e-6
        assert np.diff(h[np.abs(h - last) < 300]).max() <= 25 + 1e-5
        assert np.diff(h).max() <= 250 + 1e-5
        assert abs(found.added_sigmas) < 3e-3


@pytest.mark.parametrize("name", ["bending_moment", "angle_of_attack"])
def test_the_corner_has_its_closed_form(behind, name):
    """The filter's noise makes cov(w(h), w(h2)) turn by -H G G' H' at h2, and y holds the weight of w(h2)."""
    found = behind[name]
    points, h2 = found.points, found.altitude_at_time
    k = int(np.abs(points.altitude - h2).argmin())
    slopes = []
    for side in (slice(k - 4, k + 1), slice(k, k + 5)):
        polynomial = np.polyfit(points.altitude[side] - h2, points.wind_covariance[side, 0], 4)
        slopes.append(polynomial[-2])
    noise = points.output[k, 0] @ points.noise[k]
    assert slopes[1] - slopes[0] == pytest.approx(-float(found.weights.direct[0]) * float(noise @ noise), rel=1e-4)


def test_of_its_own_wind_alpha_takes_what_is_closest(behind):
    """What the wind does is no more than what correlation allows: |E[w | y] - mean| <= k sigma_w."""
    for found in behind.values():
        assert np.abs(found.profile["local_sigmas"]).max() <= 3.0 + found.added_sigmas + 1e-9


@pytest.fixture(scope="module")
def levels(behind):
    """Some levels of the profile, below, at and above the load's, and the unconditional covariance between them."""
    found = behind["bending_moment"]
    h = found.profile["altitude"].values
    at = np.array([int(np.abs(h - x).argmin()) for x in (1000.0, 6000.0, 8000.0, 8700.0, 8875.46, 9100.0, 12000.0)])
    shaping_filter = found.case.vehicle.wind.shaping_filter
    marks = np.unique([shaping_filter.altitude[0], *h[at], *(x for x in shaping_filter.altitude if x < h[at[-1]])])
    P, states = {float(marks[0]): shaping_filter.start_covariance}, {}
    for (a, b), Phi, Q in zip(pairwise(marks.tolist()), *transitions(shaping_filter, marks), strict=True):
        P[b] = Phi @ P[a] @ Phi.T + Q
        states[a] = Phi
    H = shaping_filter.at(h[at])[2]
    R = np.zeros((at.size, at.size))
    for i, low in enumerate(h[at]):
        carried = P[float(low)]
        R[i, i] = H[i] @ carried @ H[i]
        for a, b in pairwise(marks[marks >= low].tolist()):
            carried = states[a] @ carried
            for j in np.flatnonzero(h[at] == b):
                R[i, j] = R[j, i] = H[j] @ carried @ H[i]
    return at, R


@pytest.mark.slow
def test_draws_have_the_conditional_law(behind, levels):
    found, (at, R) = behind["bending_moment"], levels
    count = 12_000
    drawn = found.draws(count, seed=11).values[:, at]
    profile = found.profile.isel(altitude=at)
    c = profile["deviation"].values / (found.sigmas + found.added_sigmas)  # cov(w, y) / sigma
    known = R - np.outer(c, c)
    np.testing.assert_allclose(profile["conditional_std"], np.sqrt(np.diag(known)), rtol=1e-4)
    mean = drawn.mean(axis=0) - profile["wind"].values
    z = 2.576 + 0.9  # 99 % of all seven at once
    assert (np.abs(mean) < z * np.sqrt(np.diag(known) / count) + 5e-3).all()
    sample = np.cov(drawn.T)
    error = np.sqrt((known**2 + np.outer(np.diag(known), np.diag(known))) / (count - 1))
    assert (np.abs(sample - known) < (z + 0.5) * error).all()
    low, high = (chi2.ppf(q, count - 1) / (count - 1) for q in (0.005 / 7, 1 - 0.005 / 7))
    assert ((low < np.diag(sample) / np.diag(known)) & (np.diag(sample) / np.diag(known) < high)).all()


def test_every_draw_makes_the_load(behind):
    """By the weights at the levels alone, which leave out how rough the wind is between them."""
    found = behind["angle_of_attack"]
    drawn = found.draws(50, seed=5)
    h = found.points.altitude
    weight = found.points.weight[:, 0]
    made = [weight @ np.interp(h, drawn["altitude"], wind) for wind in drawn.values]
    exact = found.load - found.mean_response + weight @ found.mean_wind[:, 0]
    assert np.abs(np.array(made) - exact).max() < 0.05 * found.std
    np.testing.assert_array_equal(drawn.values, found.draws(50, seed=5).values)


@pytest.mark.slow
def test_combined_with_the_vehicles_deviations(as504):
    """Profile and deviations together make mean + 3 sigma of all sources; the profile alone its share."""
    name = "bending_moment"
    found = as504.design_wind(name, TIME, combined=True)
    known = as504.response_statistics([TIME], responses=[name])
    assert found.load == pytest.approx(float(known["mean_plus_3sigma"].sel(source="combined").squeeze()), rel=1e-6)
    system, executable, climb = as504.system, as504.with_means, Climb.of(as504)
    profile, deviations = found.profile, found.deviations
    sigma = [as504.parameters[f"{source}.sigma"].value for source in deviations["source"].values]
    states = [system.state_names.index(f"deviation_{source}") for source in deviations["source"].values]
    t, values = deviations["t"].values, deviations["deviation"].values
    spline = [CubicSpline(t, row / s) for row, s in zip(values, sigma, strict=True)]
    evaluate = MatrixEvaluator(executable, ("A", "E"))

    def rate(time, x, with_deviations):
        A, E = evaluate(time, system.start, TIME)
        x = x.copy()
        x[states] = [float(s(time)) for s in spline] if with_deviations else 0.0
        wind = np.interp(climb.altitude(time), profile["altitude"].values, profile["wind"].values)
        dx = A @ x + E @ np.array([wind, 1.0])
        dx[states] = 0.0
        return dx

    C, G = MatrixEvaluator(executable, ("C", "G"))(TIME, system.start, TIME)
    row = system.output_index(name)
    wind = float(np.interp(found.altitude_at_time, profile["altitude"], profile["wind"]))
    made = []
    for with_deviations in (True, False):
        run = solve_ivp(
            rate, (system.start, TIME), np.zeros(len(system.states)), "DOP853", rtol=1e-8, atol=1e-10, max_step=0.02,
            args=(with_deviations,),
        )  # fmt: skip
        x = run.y[:, -1].copy()
        x[states] = [float(s(TIME)) for s in spline] if with_deviations else 0.0
        made.append(float(C[row] @ x + G[row] @ np.array([wind, 1.0])))
    assert made[0] == pytest.approx(found.load, rel=1e-5)
    assert made[1] == pytest.approx(found.load_by_wind, rel=1e-5)
    share = found.points.variance / found.std**2
    assert found.load_by_wind == pytest.approx(found.mean_response + 3 * found.std * share)


@pytest.mark.slow
def test_behind_the_load_of_a_flight(as504):
    load = as504.flight_load("bending_moment", (60.0, 80.0), 0.00135, draws=400)
    found = as504.design_wind(load)
    assert found.combined
    assert found.load == pytest.approx(float(load.level[0]), rel=1e-12)
    assert 60 < found.time < 80
    assert 3.0 < found.sigmas < 4.5, "a flight passes more than an instant"
    with pytest.raises(aw.errors.TimeRangeError, match="follows from the load"):
        as504.design_wind(load, 70.0)


def test_file_for_flight_simulations(as504, behind, tmp_path):
    found = behind["angle_of_attack"]
    path = found.write(tmp_path / "new" / "wind.csv")
    first, *rows = path.read_text().splitlines()
    assert first == "altitude [m],u [m/s],v [m/s]"
    h, u, v = np.array([[float(x) for x in row.split(",")] for row in rows]).T
    assert as504.vehicle.wind.record.origin.component == "zonal"
    np.testing.assert_allclose(h, found.profile["altitude"], rtol=1e-9)
    np.testing.assert_allclose(u, found.profile["wind"], rtol=1e-9)
    assert not v.any()


def test_without_a_record_u_and_v_are_unknown(as504, behind, tmp_path):
    wind = replace(as504.vehicle.wind, record=None)
    study = aw.Study(as504.executable, replace(as504.vehicle, wind=wind))
    with pytest.raises(aw.errors.DataError, match=r"wind\.record"):
        replace(behind["angle_of_attack"], case=study).write(tmp_path / "wind.csv")
    assert not list(tmp_path.iterdir())


BAD = [
    ({"time": 5.0}, aw.errors.TimeRangeError, "before the start"),
    ({"time": 10.0}, aw.errors.TimeRangeError, "nothing has been flown"),
    ({"time": 1e4}, aw.errors.TimeRangeError, "beyond"),
    ({"time": math.nan}, aw.errors.TimeRangeError, "not a time"),
    ({"time": None}, aw.errors.TimeRangeError, "of one time"),
    ({"time": "soon"}, aw.errors.TimeRangeError, "not a time"),
    ({"sigmas": math.inf}, aw.errors.ParameterValueError, "sigmas"),
    ({"sigmas": "3"}, aw.errors.ParameterValueError, "sigmas"),
    ({"sigmas": True}, aw.errors.ParameterValueError, "sigmas"),
    ({"response": "bending_momentum"}, aw.errors.UnknownNameError, "bending_moment"),
    ({"response": "axial_force"}, NoVarianceError, "does not reach"),
]


@pytest.mark.parametrize(("asked", "error", "says"), BAD, ids=[says for *_, says in BAD])
def test_bad_input(as504, asked, error, says):
    asked = {"response": "bending_moment", "time": TIME} | asked
    with pytest.raises(error, match=says):
        as504.design_wind(asked.pop("response"), asked.pop("time"), **asked)


def test_bad_draws(behind):
    for count, seed in ((0, 0), (1.5, 0), (10, -1), (True, 0)):
        with pytest.raises(aw.errors.ParameterValueError):
            behind["engine_angle"].draws(count, seed)


@pytest.mark.slow
def test_turbulence_is_a_deviation_beside_the_wind(cache):
    """Behind alpha at t2 there is turbulence too, of less than 3 of its own sigma."""
    study = aw.Study.load("as504", changes={"wind.turbulence.severity": "severe"})
    found = study.design_wind("angle_of_attack", TIME, combined=True)
    statistics = study.response_statistics([TIME], responses=["angle_of_attack"]).variance.squeeze()
    assert found.std**2 == pytest.approx(float(statistics.sel(source="combined")), rel=1e-6)
    assert found.deviations is not None
    turbulence = found.deviations["deviation"].sel(source="turbulence")
    assert 1.0 < float(turbulence.isel(t=-1)) < 3 * 3.0
    with pytest.raises(aw.errors.DataError, match="correlation out"):
        aw.Study.load(
            "as504", changes={"wind.turbulence.severity": "severe", "wind.turbulence.correlation": 0.2}, compile=False
        ).design_wind("angle_of_attack", TIME)
