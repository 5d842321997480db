"""Gusts from any direction: the worst against brute force, at azimuth 0 one plane alone, sheets of resultants."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from planes import EACH, HORIZONTAL, in_both, in_one
from scipy.stats import norm

import ascentwind as aw
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.gusts.along_vehicle import gust_along_vehicle
from ascentwind.runners.gusts.clocking import largest, towards, worst_direction
from ascentwind.runners.gusts.combined import combined_loads, inside_gust
from ascentwind.runners.gusts.figures import along_vehicle_figure, gust_figure
from ascentwind.runners.gusts.files import write_gusts
from ascentwind.runners.gusts.response import gust_products
from ascentwind.runners.gusts.weights import wind_weights

TIME, ZONES = 70.0, {"options.gust_zones": 5}
RESPONSES = ["pitch_bending_moment", "yaw_bending_moment", "resultant_bending_moment", "total_angle_of_attack"]


@pytest.fixture(scope="module")
def both(cache) -> aw.Study:
    return aw.Study.load("as504", changes={"planes": "both"})


@pytest.fixture(scope="module")
def sweep(both):
    return both.gust_sweep(aw.QuasiSquare(), times=[TIME], responses=RESPONSES, lengths=[120.0, 240.0])


@pytest.mark.parametrize("rows", [1, 2])
def test_the_worst_direction_is_that_of_brute_force(rows):
    """Of random rows, equal and opposite ones, and none: 0.1 degrees apart, the size is within 2e-6."""
    random = np.random.default_rng(rows)
    J = random.standard_normal((200, rows, 2))
    J[0], J[1], J[2, :, 0], J[3] = 0.0, np.eye(2)[:rows], 0.0, -J[4]
    chi = np.arange(0, 2 * math.pi, math.radians(0.1))
    tried = np.array([np.linalg.norm(towards(J, c), axis=-1) for c in chi])
    np.testing.assert_allclose(largest(J), tried.max(axis=0), rtol=2e-6, atol=1e-300)
    np.testing.assert_allclose(largest(J), np.linalg.norm(J, ord=2, axis=(1, 2)), rtol=1e-12, atol=1e-300)
    at_worst = np.array([towards(j, float(c)) for j, c in zip(J, worst_direction(J), strict=True)])
    np.testing.assert_allclose(np.linalg.norm(at_worst, axis=1), largest(J), rtol=1e-12, atol=1e-300)
    if rows == 1:
        assert (at_worst[1:] > 0).all(), "one row is made positive"


def test_worst_gusts_against_gusts_in_all_directions(both, sweep):
    for name in RESPONSES:
        worst = sweep.worst(name)
        assert worst.value > 0
        tried = [
            float(both.gust_response(worst.gust, worst.start_altitude, [worst.time], responses=[name],
                                     direction=float(chi))["response_to_gust"][0, 0])
            for chi in np.linspace(0.0, 2 * math.pi, 181)
        ]  # fmt: skip
        assert max(tried) <= worst.value * (1 + 1e-8)
        assert max(tried) == pytest.approx(worst.value, rel=2e-4)
        own = both.gust_response(
            worst.gust, worst.start_altitude, [worst.time], responses=[name], direction=worst.direction
        )
        assert float(own["response_to_gust"][0, 0]) == pytest.approx(worst.value, rel=1e-9)
        assert worst.value >= float(sweep.dataset["largest"].sel(response=name).max()) * (1 - 1e-8)
    moments = [sweep.worst(name).value for name in RESPONSES[:3]]  # rows at right angles
    assert moments[2] == pytest.approx(max(moments[:2]), rel=1e-6), "planes that do not couple answer each on its own"


def test_the_resultant_is_the_norm_of_both_planes(both):
    names = ["pitch_bending_moment", "yaw_bending_moment", "resultant_bending_moment"]
    found = both.gust_response(aw.OneMinusCosine(), 8300.0, [69.5, 70.0], responses=names, direction=0.7)
    pitch, yaw, resultant = found["response_to_gust"].values.T
    np.testing.assert_allclose(resultant, np.hypot(pitch, yaw), rtol=1e-12)
    assert found.attrs["direction_rad"] == 0.7


@pytest.mark.parametrize(
    ("plane", "component", "direction"), [("yaw", "zonal", math.pi / 2), ("pitch", "meridional", 0)]
)
def test_azimuth_zero_is_the_plane_alone(plane, component, direction):
    """Weights of the component that a plane meets are those of the plane alone, of the other none; gusts likewise."""
    joint = aw.Study.from_vehicle(in_both(HORIZONTAL | EACH | ZONES, independent=True), compile=False)
    joint = joint.with_parameters({"wind.azimuth": 0.0})
    alone = aw.Study.from_vehicle(in_one(plane, component, HORIZONTAL | ZONES), compile=False)
    of_both, of_one = (
        wind_weights(study, [TIME], [f"{prefix}bending_moment"], 5.0)[0]
        for study, prefix in ((joint, f"{plane}_"), (alone, ""))
    )
    mine, other = (0, 1) if component == "zonal" else (1, 0)
    at = np.linspace(TIME - 4.0, TIME, 50)
    scale = np.abs(of_one.at(at)).max()
    np.testing.assert_allclose(of_both.at(at)[:, mine], of_one.at(at)[:, 0], rtol=1e-9, atol=1e-9 * scale)
    assert np.abs(of_both.at(at)[:, other]).max() < 1e-12 * scale
    climb, starts = Climb.of(joint), np.array([8200.0, 8500.0])
    found = gust_products(of_both, climb, aw.QuasiSquare(), starts)[:, mine]
    expected = gust_products(of_one, climb, aw.QuasiSquare(), starts)[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    worst = joint.gust_sweep(times=[TIME], responses=[f"{plane}_bending_moment"], lengths=[150.0])
    single = alone.gust_sweep(times=[TIME], responses=["bending_moment"], lengths=[150.0])
    one, other = worst.worst(f"{plane}_bending_moment"), single.worst("bending_moment")
    assert one.value == pytest.approx(abs(other.value), rel=1e-9)
    assert math.cos(2 * (one.direction - direction)) == pytest.approx(1.0, abs=1e-12)


def test_sheet_and_files(both, sweep, tmp_path):
    """A resultant has its joint levels alone, in the law of a norm, which a simulation passes as often."""
    sheet = combined_loads(sweep)
    row = sheet.sel(response="resultant_bending_moment")
    assert all(math.isnan(float(row[name])) for name in ("random_wind", "vehicle", "root_sum_square"))
    worst = sweep.worst("resultant_bending_moment")
    assert float(row["without_gust"]) < float(row["joint_inside"]) < float(row["joint_worst"])
    assert float(row["joint_worst"]) < float(row["without_gust"]) + worst.value * (1 + 1e-9)
    names = ["pitch_bending_moment", "yaw_bending_moment"]
    at = both.response_statistics([worst.time], responses=names).dataset
    at = at.sel(source="combined").isel(time=0)
    S = at["covariance"].transpose("response", "other_response").values
    random, count = np.random.default_rng(3), 400_000
    drawn = random.multivariate_normal(at["mean"].values, S, count) + random.choice(inside_gust(sweep, worst), count)
    passed = (np.linalg.norm(drawn, axis=1) > float(row["joint_inside"])).mean()
    assert abs(passed - norm.sf(3)) < 4 * math.sqrt(norm.sf(3) / count)
    write_gusts([sweep], [sheet], tmp_path)
    head, *rows = (tmp_path / "worst_gusts.csv").read_text().splitlines()
    assert head.endswith("blows_towards_deg")
    assert float(rows[2].split(",")[-1]) == pytest.approx(math.degrees(worst.direction) % 360, rel=1e-8)
    assert ",," in (tmp_path / "combined_loads.csv").read_text().splitlines()[3]


@pytest.mark.slow
def test_along_the_vehicle_the_resultant(both, sweep):
    worst = sweep.worst("resultant_bending_moment")
    found = gust_along_vehicle(sweep, worst, slosh_reaction=False)
    assert np.interp(25.0, found["station"], found["in_worst_gust"]) == pytest.approx(worst.value, rel=2e-3)
    assert (found["envelope"].values >= found["in_worst_gust"].values).all()


def test_figures_say_that_it_is_the_resultant(sweep):
    worst = sweep.worst("resultant_bending_moment")
    along = xr.Dataset(
        {"envelope": ("station", [1e6, 2e6], {"units": "N m"}), "in_worst_gust": ("station", [1e6, 1e6])},
        {"station": [0.0, 10.0]},
        {"load": "bending_moment"},
    )
    assert along_vehicle_figure([along], [worst], "title").axes[0].get_ylabel() == "resultant bending moment (MN m)"
    in_one = replace(worst, direction=None)
    assert along_vehicle_figure([along], [in_one], "title").axes[0].get_ylabel() == "|bending moment| (MN m)"
    over_time = sweep.over_time("resultant_bending_moment")
    above = gust_figure([sweep], [over_time], "resultant_bending_moment", "title").axes[0]
    assert above.get_ylabel() == "resultant bending moment (MN m)"
