"""Discrete gusts by weighting functions, held against forward integration and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import ascentwind as aw
from ascentwind.model.tables import Table
from ascentwind.model.wind.statistics import WindModel
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.cli.app import app
from ascentwind.runners.gusts.along_vehicle import gust_along_vehicle
from ascentwind.runners.gusts.combined import combined_loads, inside_gust, mixture_level
from ascentwind.runners.gusts.response import gust_products
from ascentwind.runners.gusts.shapes import SHAPES, GustError
from ascentwind.runners.gusts.weights import wind_weights
from ascentwind.runners.solvers.mean_response import mean_response

RESPONSES = ["bending_moment", "angle_of_attack", "engine_angle"]
TIME = 70.0


@pytest.fixture(scope="module")
def climb(as504) -> Climb:
    return Climb.of(as504)


@pytest.fixture(scope="module")
def weights(as504):
    (found,) = wind_weights(as504, [TIME], RESPONSES, TIME - as504.system.start)
    return found


def flown(vehicle, profile: Table, times: np.ndarray) -> np.ndarray:
    """Return the responses to a wind over altitude alone, by CVODES forward, (times, responses)."""
    wind = WindModel(profile, vehicle.wind.shaping_filter)
    study = aw.Study.from_vehicle(replace(vehicle, wind=wind), compile=False)
    found = mean_response(study.executable, np.concatenate([[study.system.start], times]), 1e-11)
    return found.outputs[1:, [study.system.output_index(name) for name in RESPONSES]]


def against_integration(study: aw.Study, gust, start: float, times: np.ndarray) -> None:
    """Hold a gust's product with the weights against its integration, within 1e-6 of the largest response."""
    corners = start + np.array(gust.corners)
    inside = np.concatenate([np.linspace(a, b, 121)[:-1] for a, b in pairwise(corners)])
    above = np.linspace(corners[-1], 60e3, 400)
    altitude = np.concatenate([np.linspace(0, start, 400)[:-1], inside, above])
    profile = Table("wind.mean", "m/s", altitude, gust.at(altitude - start), "cubic", tuple(corners))
    late = slice(-25, None, 4)
    by_product = study.gust_response(gust, start, times[late], responses=RESPONSES)["response_to_gust"].values
    by_integration = flown(study.vehicle, profile, times)[late]
    assert np.abs(by_product).max(axis=0).min() > 0
    scale = np.abs(by_integration).max(axis=0)
    assert (np.abs(by_product - by_integration) / scale).max() < 1e-6


@pytest.mark.parametrize("gust", [aw.OneMinusCosine(180.0), aw.QuasiSquare(120.0), aw.RampAndHold(90.0, -5.0)], ids=str)
def test_against_integration_by_cvodes(as504, gust):
    # equidistant from the start on, close enough for CVODES to see the gust, which is met at 68.6 s
    against_integration(as504, gust, 8300.0, as504.system.start + np.arange(1, 1201) * 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("gust", [aw.QuasiSquare(120.0), aw.RampAndHold(90.0, -5.0)], ids=str)
@pytest.mark.parametrize(("vehicle", "changes"), [("as504", {"options.gust_zones": 5}), ("falcon1", {})])
def test_zones_against_integration_by_cvodes(vehicle, changes, gust, cache):
    """Nose first; the zones of Falcon 1 are milliseconds apart, whose delays need points of their own close to t2."""
    study = aw.Study.load(vehicle, changes=changes)
    assert study.vehicle is not None
    assert study.vehicle.zones is not None
    met = float(Climb.of(study).time_at(8300.0))
    last = np.floor((met + 1.2 - study.system.start) / 0.05)
    against_integration(study, gust, 8300.0, study.system.start + np.arange(1, int(last) + 1) * 0.05)


def test_nose_first_the_response_is_smaller_and_later(as504, cache):
    """Of the bending moment of AS-504 to a gust of 60 m, which the whole vehicle otherwise meets at once."""
    zoned = aw.Study.load("as504", changes={"options.gust_zones": 5})
    once, zones = (
        study.gust_sweep(aw.OneMinusCosine(), times=[69.0, 70.0], responses=["bending_moment"], lengths=[60.0])
        for study in (as504, zoned)
    )
    at_once, nose_first = (np.abs(sweep.dataset["largest"].values).max() for sweep in (once, zones))
    assert 0.5 * at_once < nose_first < 0.95 * at_once


def test_narrow_box_is_an_impulse(weights, climb):
    width = 1e-3  # m
    at = np.array([7000.0, 7900.0])
    found = gust_products(weights, climb, aw.QuasiSquare(width, 2.0, 0.0), at)
    time = climb.time_at(at + width / 2)
    impulse = weights.at(time) * (2.0 * width / climb.polynomial(time, 1))[:, None]
    np.testing.assert_allclose(found, impulse, rtol=1e-5)


def test_impulse_weights_are_those_of_cvodes(as504, weights):
    known = as504.weighting_function(TIME, spacing=0.5, engine=aw.Cvodes(relative_tolerance=1e-10))
    by_cvodes = known["input_weighting"].sel(response=RESPONSES, input="wind").values.T
    ours = weights.at(known["t"].values)
    assert (np.abs(ours - by_cvodes) / np.abs(by_cvodes).max(axis=0)).max() < 1e-6
    np.testing.assert_allclose(weights.direct, known["direct"].sel(response=RESPONSES, input="wind"), rtol=1e-12)


def test_long_ramp_is_the_step_response(weights, climb):
    """A step that starts at h is the integral of the weights from there on, whatever the length of a short ramp."""
    start = np.array([6000.0])
    met = float(climb.time_at(6000.0))
    spans = pairwise(np.maximum(weights.edges, met))
    step = weights.direct + sum(g.integrate(*span) for g, span in zip(weights.pieces, spans, strict=True))
    found = {length: gust_products(weights, climb, aw.RampAndHold(length, 1.0), start)[0] for length in (1e-3, 1.0)}
    np.testing.assert_allclose(found[1e-3], step, rtol=1e-5)
    np.testing.assert_allclose(found[1.0], found[1e-3], rtol=1e-2)


def test_linear_and_symmetric(weights, climb):
    start = np.array([7500.0, 8100.0])
    one, other = (gust_products(weights, climb, aw.QuasiSquare(200.0, a), start) for a in (3.0, -6.0))
    np.testing.assert_allclose(other, -2 * one, rtol=1e-12)


def test_two_ramps_make_a_pulse(weights, climb):
    """MIL-F-8785C's pulse is a ramp and, later, the same ramp from the other side: that is a quasi-square gust."""
    start = np.array([7600.0])
    pulse = gust_products(weights, climb, aw.QuasiSquare(200.0, 9.0, 40.0), start)
    up = gust_products(weights, climb, aw.RampAndHold(40.0), start)
    down = gust_products(weights, climb, aw.RampAndHold(40.0, -9.0), start + 160.0)
    np.testing.assert_allclose(pulse, up + down, rtol=1e-8)


def test_quasi_square_without_plateau_is_a_full_wave(weights, climb):
    start = np.array([7600.0, 7950.0])
    found = [gust_products(weights, climb, gust, start) for gust in (aw.QuasiSquare(60.0), aw.OneMinusCosine(60.0))]
    np.testing.assert_allclose(*found, rtol=1e-8)


def test_zero_before_it_is_met(as504, climb):
    met = float(climb.time_at(8300.0))
    found = as504.gust_response(aw.OneMinusCosine(), 8300.0, [met - 1.0, met - 1e-3, met + 1.0], responses=RESPONSES)
    assert not found["response_to_gust"].values[:2].any()
    assert found["response_to_gust"].values[2].all()


def test_points_of_the_weights_are_dense_enough(as504, climb):
    at = [72.0]
    fine, coarse = (wind_weights(as504, at, RESPONSES, 5.0, spacing)[0] for spacing in (0.0065, None))
    starts = climb.altitude(72.0 - np.linspace(0.1, 4.0, 20))
    for gust in (aw.OneMinusCosine(100.0), aw.QuasiSquare(200.0)):
        found = [gust_products(each, climb, gust, starts) for each in (fine, coarse)]
        scale = np.abs(found[0]).max(axis=0)
        assert (np.abs(found[0] - found[1]) / scale).max() < 2e-7


@pytest.fixture(scope="module")
def small_sweep(as504):
    return as504.gust_sweep(times=[66.0, 68.0, 70.0], responses=["bending_moment"], lengths=[100.0, 180.0, 260.0])


def test_worst_gust_is_a_maximum(as504, small_sweep):
    worst = small_sweep.worst("bending_moment")
    assert not small_sweep.dataset["at_edge"].values.any()
    assert abs(worst.value) >= np.abs(small_sweep.dataset["largest"].values).max()
    assert 100 < worst.gust.length < 260
    assert 66 < worst.time < 70
    one = as504.gust_response(worst.gust, worst.start_altitude, [worst.time], responses=["bending_moment"])
    assert float(one["response_to_gust"][0, 0]) == pytest.approx(worst.value, rel=1e-7)
    for length, shift in ((1.0, 0), (-1.0, 0), (0, 5.0), (0, -5.0)):
        near = as504.gust_response(
            replace(worst.gust, length=worst.gust.length + length), worst.start_altitude + shift, [worst.time],
            responses=["bending_moment"],
        )  # fmt: skip
        assert abs(float(near["response_to_gust"][0, 0])) <= abs(worst.value)


@pytest.mark.slow
def test_along_vehicle_at_the_output_station(as504, small_sweep):
    """Without the answer to slosh the load along the vehicle is the output's, whose rows stand in other equations."""
    worst = small_sweep.worst("bending_moment")
    found = gust_along_vehicle(small_sweep, worst, slosh_reaction=False)
    at = np.interp(25.0, found["station"], found["in_worst_gust"])
    assert at == pytest.approx(worst.value, rel=2e-3)
    assert (found["envelope"].values >= np.abs(found["in_worst_gust"].values)).all()
    with_reaction = gust_along_vehicle(small_sweep, worst)["in_worst_gust"].values
    assert abs(with_reaction[0]) < 1e-3 * np.abs(with_reaction).max(), "no moment at a free end"


def test_combined_sheet(as504, small_sweep):
    sheet, worst = combined_loads(small_sweep), small_sweep.worst("bending_moment")
    found = {str(name): float(sheet[name][0]) for name in sheet}
    assert found["gust"] == pytest.approx(abs(worst.value))
    # the larger side alone, where the mean is far from zero
    sigma = math.hypot(found["random_wind"], found["vehicle"]) / 3
    assert found["joint_worst"] == pytest.approx(abs(found["mean"]) + found["gust"] + 3 * sigma, rel=1e-3)
    assert found["without_gust"] < found["joint_inside"] < found["joint_worst"]
    assert found["without_gust"] < found["root_sum_square"] < found["joint_worst"]
    # by simulation of the same law
    random = np.random.default_rng(7)
    drawn = found["mean"] + random.choice(inside_gust(small_sweep, worst)[:, 0], 400_000)
    drawn = np.abs(drawn + sigma * random.standard_normal(drawn.size))
    passed = (drawn > found["joint_inside"]).mean()
    assert abs(passed - 0.00135) < 4 * math.sqrt(0.00135 / drawn.size)


def test_mixture_of_one_is_the_normal_law():
    assert mixture_level(np.array([5.0]), 1.0, 0.00135) == pytest.approx(8.0, abs=1e-4)
    assert mixture_level(np.array([5.0, -5.0]), 1.0, 0.00135) == pytest.approx(8.0, abs=1e-4)
    assert mixture_level(np.array([1.0, -4.0]), 0.0, 0.00135) == 4.0


BAD = [
    (lambda s: aw.OneMinusCosine(0.0), "no extent"),
    (lambda s: aw.OneMinusCosine(-60.0), "no extent"),
    (lambda s: aw.RampAndHold(math.nan), "length"),
    (lambda s: aw.RampAndHold("60"), "length"),  # pyright: ignore[reportArgumentType]
    (lambda s: aw.OneMinusCosine(60.0, 0.0), "blows nothing"),
    (lambda s: aw.OneMinusCosine(60.0, math.inf), "amplitude"),
    (lambda s: aw.QuasiSquare(50.0), "no room"),
    (lambda s: aw.QuasiSquare(50.0, 9.0, -1.0), "edges"),
    (lambda s: s.gust_response(aw.OneMinusCosine(), -10.0, [70.0]), "below the ground"),
    (lambda s: s.gust_response(aw.OneMinusCosine(), 50.0, [70.0]), "below the start"),
    (lambda s: s.gust_response(aw.OneMinusCosine(), math.nan, [70.0]), "cannot start"),
    (lambda s: s.gust_response(aw.OneMinusCosine(), 1e6, [70.0]), "never met"),
    (lambda s: s.gust_response(aw.OneMinusCosine(1e6), 1000.0, [70.0]), "longer than the flight"),
    (lambda s: s.gust_sweep(lengths=[60.0, 1e6]), "longer than the flight"),
    (lambda s: s.gust_sweep(aw.QuasiSquare(), lengths=[40.0]), "no room"),
    (lambda s: s.gust_sweep(aw.QuasiSquare(500.0, 9.0, 200.0)), "give lengths"),
]


@pytest.mark.parametrize(("ask", "says"), BAD, ids=[says for _, says in BAD])
def test_bad_gusts(as504, ask, says):
    with pytest.raises(GustError, match=says):
        ask(as504)


def test_other_bad_input(as504):
    with pytest.raises(aw.errors.TimeRangeError, match="before the start"):
        as504.gust_response(aw.OneMinusCosine(), 8000.0, [5.0])
    with pytest.raises(aw.errors.UnknownNameError, match="bending_moment"):
        as504.gust_sweep(responses=["bending_momentum"])
    with pytest.raises(aw.errors.ParameterValueError, match="no length"):
        as504.gust_sweep(lengths=[])
    with pytest.raises(aw.errors.ParameterValueError, match="no list of lengths"):
        as504.gust_sweep(lengths="long")
    assert set(SHAPES) == {"one-minus-cosine", "quasi-square", "ramp-and-hold"}


@pytest.mark.slow
def test_command(as504, tmp_path):
    arguments = ["gust", "as504", "--response", "bending_moment", "--times", "66,68,70", "--length", "180"]
    found = CliRunner().invoke(app, [*arguments, "--shape", "one-minus-cosine", "--out", str(tmp_path)])
    assert found.exit_code == 0, found.output
    with xr.open_dataset(tmp_path / "gusts_one-minus-cosine.nc", engine="scipy") as written:
        largest = written["bending_moment_largest"]
        assert largest.attrs["units"] == "N m"
        own = as504.gust_sweep(times=[66.0, 68.0, 70.0], responses=["bending_moment"], lengths=[180.0])
        np.testing.assert_array_equal(largest.values, own.dataset["largest"].values[:, 0])
    row = (tmp_path / "worst_gusts.csv").read_text().splitlines()[1].split(",")
    assert row[:3] == ["bending_moment", "N m", "one-minus-cosine"]
    assert abs(float(row[4])) >= np.abs(own.dataset["largest"].values).max()
    assert (tmp_path / "along_vehicle_bending_moment.png").stat().st_size > 10_000


def test_command_with_an_unknown_shape(as504):
    found = CliRunner().invoke(app, ["gust", "as504", "--shape", "one-minus-cosin"])
    assert isinstance(found.exception, aw.errors.UnknownNameError)
    assert "one-minus-cosine" in str(found.exception)
