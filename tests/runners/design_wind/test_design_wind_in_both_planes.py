"""Design winds in both components, flown back by CVODES, and at azimuth 0 those of one plane."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planes import EACH, HORIZONTAL, in_both, in_one
from scipy.stats import norm

import ascentwind as aw
from ascentwind.model.tables import Table
from ascentwind.runners.solvers.mean_response import mean_response

TIME, PLANES = 70.0, ("pitch_bending_moment", "yaw_bending_moment")


@pytest.fixture(scope="module")
def both(cache) -> aw.Study:
    return aw.Study.load("as504", changes={"planes": "both"})


@pytest.fixture(scope="module")
def behind(both):
    return both.design_wind("resultant_bending_moment", TIME)


def flown(study, profile, names) -> np.ndarray:
    """Return responses at TIME to a profile of straight lines in the place of both mean winds, by CVODES forward."""
    h, wind = profile["altitude"].values, study.vehicle.wind
    parts = {
        name: replace(
            model, mean=Table(model.mean.name, "m/s", h, profile["wind"].sel(component=name).values, "linear")
        )
        for name, model in wind.components.items()
    }
    vehicle = replace(study.vehicle, wind=replace(wind, **parts))
    other = aw.Study.from_vehicle(vehicle, compile=False)
    found = mean_response(other.executable, np.linspace(study.system.start, TIME, 1201), 1e-11)
    return found.outputs[-1, [study.system.output_index(name) for name in names]]


@pytest.mark.slow
def test_flown_back_it_makes_the_resultant(both, behind):
    """Both planes' moments, by CVODES: their norm is the load to 1e-6, and it points where it most likely does."""
    moments = flown(both, behind.profile, PLANES)
    direction = np.array([math.cos(behind.direction), math.sin(behind.direction)])
    assert moments @ direction == pytest.approx(behind.load, rel=1e-6)
    assert np.linalg.norm(moments) == pytest.approx(behind.load, rel=1e-6)


@pytest.mark.slow
def test_flown_back_it_makes_the_load_of_a_plane(both):
    found = both.design_wind("yaw_bending_moment", TIME, sigmas=-3.0)
    assert found.side == "below the mean"
    (moment,) = flown(both, found.profile, PLANES[1:])
    assert moment == pytest.approx(found.load, rel=1e-6)


def test_the_load_is_the_level_of_the_norm(both, behind):
    """That the resultant passes by 1 - Phi(3) in the wind alone; the least white noise behind it is of that size."""
    known = both.response_statistics([TIME], responses=PLANES)
    mean = known.mean.sel(source="combined").squeeze().values
    S = known["covariance"].sel(source="wind").squeeze().values
    random = np.random.default_rng(1)
    drawn = np.linalg.norm(random.multivariate_normal(mean, S, 1_000_000), axis=1)
    passed = (drawn > behind.load).mean()
    assert abs(passed - norm.sf(3)) < 4 * math.sqrt(norm.sf(3) / drawn.size)
    assert behind.norm == pytest.approx(behind.sigmas, rel=1e-7)
    e = np.array([math.cos(behind.direction), math.sin(behind.direction)])
    assert behind.std == pytest.approx(math.sqrt(e @ S @ e), rel=1e-6)
    # the most likely point of the circle: S^-1 (M - m) is radial there
    radial = np.linalg.solve(S, behind.load * e - mean)
    assert abs(radial[0] * e[1] - radial[1] * e[0]) < 1e-5 * np.linalg.norm(radial)
    assert behind.sigmas == pytest.approx(np.sqrt((behind.load * e - mean) @ radial), rel=1e-6)


@pytest.mark.parametrize(("plane", "component"), [("yaw", "zonal"), ("pitch", "meridional")])
def test_azimuth_zero_is_the_plane_alone(plane, component):
    zones = {"options.gust_zones": 5}
    joint = aw.Study.from_vehicle(in_both(HORIZONTAL | EACH | zones, independent=True), compile=False)
    found = joint.with_parameters({"wind.azimuth": 0.0}).design_wind(f"{plane}_angle_of_attack", TIME)
    alone = aw.Study.from_vehicle(in_one(plane, component, HORIZONTAL | zones), compile=False)
    expected = alone.design_wind("angle_of_attack", TIME)
    assert found.std == pytest.approx(expected.std, rel=1e-9)
    assert found.mean_response == pytest.approx(expected.mean_response, rel=1e-7)
    mine = ("zonal", "meridional").index(component)
    h, at = expected.points.altitude, found.points.altitude
    shared = np.isin(np.round(h, 6), np.round(at, 6))
    assert shared.mean() > 0.5
    of_both = found.points.wind_covariance[np.isin(np.round(at, 6), np.round(h, 6))]
    scale = np.abs(of_both).max()
    np.testing.assert_allclose(of_both[:, mine], expected.points.wind_covariance[shared, 0], atol=1e-8 * scale)
    assert np.abs(of_both[:, 1 - mine]).max() < 1e-9 * scale, "the other component is not correlated with it"


def test_file_draws_and_deviations(both, behind, tmp_path):
    first, *rows = behind.write(tmp_path / "wind.csv").read_text().splitlines()
    assert first == "altitude [m],u [m/s],v [m/s]"
    h, u, v = np.array([[float(x) for x in row.split(",")] for row in rows]).T
    np.testing.assert_allclose(h, behind.profile["altitude"], rtol=1e-9)
    np.testing.assert_allclose(np.column_stack([u, v]), behind.profile["wind"], rtol=1e-8, atol=1e-8)
    assert np.abs(u).max() > 1
    assert np.abs(v).max() > 1
    drawn = behind.draws(3, seed=2)
    assert drawn.dims == ("draw", "altitude", "component")
    combined = both.design_wind("resultant_bending_moment", TIME, combined=True)
    assert combined.deviations is not None
    assert set(combined.deviations["source"].values) == {"thrust", "center_of_pressure"}
    assert combined.load > behind.load
    assert np.isfinite(combined.deviations["deviation"]).all()
