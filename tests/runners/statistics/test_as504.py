"""AS-504: the adjoint against the covariance equation, and the study's interface."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from ascentwind.model.errors import ParameterValueError, TimeRangeError, UnknownNameError
from ascentwind.runners import Cvodes, Study
from ascentwind.runners.solvers.covariance import covariance_equation
from ascentwind.runners.solvers.mean_response import mean_response

TIMES = (40.0, 60.0, 75.0, 90.0, 105.6, 140.0)  # 105.6 s is a gain switch, seen from the left


@pytest.fixture(scope="module")
def forward(as504):
    return covariance_equation(as504.with_means, TIMES, 1e-9)


@pytest.mark.parametrize(("method", "iteration"), [("adams", "newton"), ("bdf", "newton"), ("adams", "functional")])
@pytest.mark.slow
def test_adjoint_meets_the_covariance_equation(as504, forward, method, iteration):
    """Another method, another integrator, no adjoint: every response and source to 1e-5, also behind all jumps."""
    tolerance = 1e-9 if method == "bdf" else 1e-8
    options = Cvodes(method=method, iteration=iteration, relative_tolerance=tolerance)
    found = as504.response_statistics(TIMES, engine=options)
    np.testing.assert_allclose(found.variance.values[:, :, :3], forward.variance, rtol=1e-5)
    np.testing.assert_allclose(found.variance.values[:, :, 3], forward.variance.sum(axis=2), rtol=1e-5)
    np.testing.assert_allclose(found.mean.values[:, :, 0], forward.mean, rtol=1e-5, atol=1e-9)


@pytest.mark.slow
def test_the_default_tolerance_keeps_the_promise(as504, forward):
    found = as504.response_statistics(TIMES[:4])
    np.testing.assert_allclose(found.variance.values[:, :, :3], forward.variance[:4], rtol=1e-5)


def test_an_end_time_on_a_discontinuity_is_seen_from_the_left(as504):
    """At engine cutoff thrust and axial acceleration jump, and the bending moment with them."""
    options = Cvodes(relative_tolerance=1e-9)
    at, before, after = (
        as504.response_statistics([time], engine=options).std.sel(response="bending_moment").values
        for time in (134.34, 134.34 - 2e-7, 134.34 + 2e-7)
    )
    np.testing.assert_allclose(at, before, rtol=1e-6)
    assert (np.abs(after / before - 1) > 1e-4).any()


def test_convolved_mean_is_the_forward_mean(as504):
    """The weighting function convolved with the mean wind against the forward integration."""
    times = np.linspace(as504.system.start, 80.0, 15)
    forward = mean_response(as504.with_means, times)
    found = as504.response_statistics(times[5:])
    np.testing.assert_allclose(found.mean.values[:, :, 0], forward.outputs[5:], rtol=2e-5)


def test_weighting_function_squared_and_integrated_is_the_variance(as504):
    """By the trapezoidal rule on a fine grid, thrust noise, whose start covariance is forgotten long before."""
    found = as504.weighting_function(60.0, spacing=0.01)
    g = found["noise_weighting"].isel(noise=2).values
    assert found["source"].values[2] == "thrust"
    variance = np.trapezoid(g**2, found["t"].values, axis=1)
    expected = as504.response_statistics([60.0]).variance.sel(source="thrust").values[0]
    np.testing.assert_allclose(variance, expected, rtol=1e-4)


def test_results_are_labelled(as504, tmp_path):
    """The calls of the README, letter by letter, and a round trip through NetCDF."""
    stats = as504.response_statistics(times=range(70, 81, 5))
    equivalent = [f"equivalent_axial_load_{side}_y" for side in ("plus", "minus")]
    loads = ["shear_force", "axial_force", *equivalent, "q_alpha"]
    assert list(stats["response"].values) == ["bending_moment", "angle_of_attack", "engine_angle", *loads]
    assert list(stats["source"].values) == ["wind", "thrust", "center_of_pressure", "combined"]
    assert stats["unit"].sel(response="bending_moment") == "N m"
    sigma = stats.std.sel(response="bending_moment", source="wind", time=75)
    assert float(sigma) ** 2 == pytest.approx(
        float(stats.variance.sel(response="bending_moment", source="wind", time=75))
    )
    total = stats.mean.sel(time=75, source="combined") + 3 * stats.std.sel(time=75, source="combined")
    np.testing.assert_allclose(total, stats.mean_plus_3sigma.sel(time=75, source="combined"))
    np.testing.assert_allclose(
        stats.variance.sel(source="combined"), stats.variance.isel(source=slice(3)).sum("source"), rtol=1e-12
    )
    for attribute in ("data_sha256", "ascentwind", "casadi", "engine", "relative_tolerance", "structure"):
        assert attribute in stats.attrs
    stats.save(tmp_path)
    with xr.open_dataset(tmp_path / "statistics.nc", engine="scipy") as again:
        for read in (again, stats):  # the same line on both
            assert read["bending_moment_std"].sel(source="wind", time=75) == sigma
        assert again["bending_moment_std"].attrs["units"] == "N m"
        assert again.attrs["data_sha256"] == stats.attrs["data_sha256"]


def test_matrices_follow_the_equations(as504):
    """Rows of A, B and C against the printed equations with table values taken by hand."""
    A, B, C, D = as504.matrices(75.0)
    v, names = as504.tables(75.0), as504.system.state_names
    column = names.index
    area = as504.parameters["reference_area"].value
    slope = v["dynamic_pressure"] * area * v["normal_force_slope"]
    Y, phi, rate = column("lateral_velocity"), column("attitude"), column("attitude_rate")
    # 4-3 in C, then 4-1 and 4-2 through alpha
    alpha = C[1]
    assert alpha[phi] == 1
    assert alpha[Y] == pytest.approx(-1 / v["relative_velocity"], rel=1e-13)
    assert A[Y, phi] == pytest.approx((slope + v["thrust"] - v["axial_drag"]) / v["mass"], rel=1e-12)
    arm = v["center_of_pressure"] - v["center_of_gravity"]
    assert A[rate, phi] == pytest.approx(slope * arm / v["moment_of_inertia"], rel=1e-12)
    beta = C[2]
    expected = -slope * arm / v["moment_of_inertia"] / v["relative_velocity"]
    assert A[rate, Y] == pytest.approx(expected, rel=1e-12)
    eta = column("bending_1")
    moment = -v["control_thrust"] * v["center_of_gravity"] * beta[eta] / v["moment_of_inertia"]
    assert A[rate, eta] == pytest.approx(moment, rel=1e-12)
    assert beta[eta] == pytest.approx(v["bending.1.slope_at_gimbal"], rel=1e-13)
    # thrust noise in 4-1 at the mean response
    deviation = column("deviation_thrust")
    force = v["control_thrust"] * v["mean.engine_angle"] + v["thrust"] * v["mean.attitude"]
    assert A[Y, deviation] == pytest.approx(0.01 * force / v["mass"], rel=1e-12)
    pressure = column("deviation_center_of_pressure")
    moment = 0.05 * slope * v["center_of_pressure"] * v["mean.angle_of_attack"] / v["moment_of_inertia"]
    assert A[rate, pressure] == pytest.approx(moment, rel=1e-12)
    # wind filter in flight time
    assert B[column("wind_3"), 0] == pytest.approx(np.sqrt(v["altitude_rate"]) * v["wind_filter.G_3_1"], rel=1e-13)
    assert A[column("wind_1"), column("wind_2")] == pytest.approx(
        v["altitude_rate"] * v["wind_filter.F_1_2"], rel=1e-13
    )
    assert not D.any()


def test_rigid_and_bending_roots_are_where_the_report_puts_them(as504):
    """Rigid about 1 rad/s, first bending about 6 rad/s (report 3.1), stable from 10 to 150 s (equations.md)."""
    for time in np.arange(10.0, 150.0, 5.0):
        assert max(r.value.real for r in as504.roots(time)) < 0
    by_state = {r.states[0]: r for r in as504.roots(75.0)}
    assert 0.8 < by_state["T2_1"].frequency < 1.4
    assert by_state["bending_1"].frequency == pytest.approx(6.5, rel=0.1)


def test_parameters_are_listed_changed_and_refused(as504):
    assert as504.parameters["control.T1.numerator.s3"].value == 37.63
    assert as504.parameters["thrust.correlation_time"].unit == "s"
    doubled = as504.with_parameters({"wind.sigma_scale": 2.0})
    a, b = (s.response_statistics([60.0]) for s in (as504, doubled))
    ratio = (b.variance / a.variance).sel(source="wind").drop_sel(response="axial_force").values
    np.testing.assert_allclose(ratio, 4.0, rtol=1e-4)
    np.testing.assert_allclose(b.variance.sel(source="thrust"), a.variance.sel(source="thrust"), rtol=1e-6)
    assert "wind.sigma_scale = 2" in b.attrs["changed_parameters"]
    with pytest.raises(UnknownNameError, match=r"did you mean 'wind.sigma_scale'"):
        as504.with_parameters({"wind.sigma_scal": 2.0})
    with pytest.raises(ParameterValueError, match="thrust.correlation_time.*-1"):
        as504.with_parameters({"thrust.correlation_time": -1.0})
    with pytest.raises(ParameterValueError):
        as504.with_parameters({"bending.1.damping": float("nan")})


def test_noise_follows_the_mean_response(as504):
    """Thrust and centre-of-pressure noise are proportional to the mean, so to the mean wind, but along the axis."""
    doubled = as504.with_parameters({"wind.mean_scale": 2.0})
    across = ["bending_moment", "angle_of_attack", "engine_angle", "shear_force", "q_alpha"]
    engine = Cvodes(relative_tolerance=1e-9)
    a, b = (s.response_statistics([70.0], responses=across, engine=engine) for s in (as504, doubled))
    np.testing.assert_allclose(b.mean.values, 2 * a.mean.values, rtol=1e-6)
    for source, factor in (("thrust", 4.0), ("center_of_pressure", 4.0), ("wind", 1.0)):
        np.testing.assert_allclose((b.variance / a.variance).sel(source=source), factor, rtol=1e-5)


def test_times_outside_the_flight_are_refused(as504):
    with pytest.raises(TimeRangeError, match="before the start at 10 s"):
        as504.response_statistics([5.0])
    with pytest.raises(TimeRangeError, match=r"beyond the last row of \w+\.csv at 150 s"):
        as504.response_statistics([151.0])
    with pytest.raises(TimeRangeError, match="not a time"):
        as504.matrices(float("nan"))


def test_interpreter_gives_the_same_statistics(as504):
    interpreted = Study.load("as504", compile=False)
    assert (as504.executable.code, interpreted.executable.code) == ("compiled", "interpreter")
    options = Cvodes(relative_tolerance=1e-9)
    a, b = (s.response_statistics([30.0], engine=options) for s in (as504, interpreted))
    np.testing.assert_allclose(a.variance.values, b.variance.values, rtol=1e-6)


def test_progress_is_told_every_end_time(as504):
    seen: list[float] = []
    as504.response_statistics([30.0, 20.0], progress=seen.append)
    assert seen == [20.0, 30.0]
