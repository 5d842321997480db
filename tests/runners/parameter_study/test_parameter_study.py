"""Parameter studies: members against closed forms and other roads, failures kept, first order beside the sample."""

from __future__ import annotations

import numpy as np
import pytest
from lag import GAIN, TAU, closed_form, dispersion, lag, normal, plan

from ascentwind.model.errors import DataError, ParameterValueError
from ascentwind.runners import Study
from ascentwind.runners.parameter_study import compute, run_parameter_study
from ascentwind.runners.parameter_study.changes import changes
from ascentwind.runners.parameter_study.spread import PERCENT, percentiles, spread

TABLE = "tables.center_of_pressure"


@pytest.fixture(scope="module")
def study(cache):
    return lag()


def test_members_against_the_closed_form(study, tmp_path):
    found = run_parameter_study(dispersion(23, normal("tau", 0.2), normal("gain", 0.5)), tmp_path, study=study)
    tau, gain = found.data["value"].values.T
    for k, time in enumerate((1.0, 3.0)):
        mean, std = closed_form(time, tau, gain)
        np.testing.assert_allclose(found.data["mean"].values[:, k, 0], mean, rtol=1e-7)
        np.testing.assert_allclose(found.data["std"].sel(source="combined").values[:, k, 0], std, rtol=1e-7)
    assert found.data["nominal_std"].values[0, 0] == pytest.approx(closed_form(1.0)[1], rel=1e-7)
    assert found.data["status"].values.tolist() == 23 * [0]


def test_relative_values_multiply_every_target(study, tmp_path):
    both = {"name": "both", "parameters": ["tau", "gain"], "relative": True, "values": [0.5, 2.0]}
    found = run_parameter_study(plan(grid={"quantity": [both]}), tmp_path, study=study)
    for m, factor in enumerate((0.5, 2.0)):
        std = closed_form(3.0, factor * TAU, factor * GAIN)[1]
        assert found.data["std"].values[m, 1, 0, -1] == pytest.approx(std, rel=1e-7)


def test_a_factor_on_a_table_is_a_vehicle_with_that_table(as504, vehicle_folder, tmp_path):
    """The other road: the column multiplied in the CSV file, through the loader."""
    path = vehicle_folder / "aerodynamics.csv"
    lines = path.read_text().splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("time"))
    for i in range(head + 1, len(lines)):
        t, slope, center = lines[i].split(",")
        lines[i] = f"{t},{slope},{float(center) * 1.1!r}"
    path.write_text("\n".join(lines) + "\n")
    given = {
        "format": 1,
        "title": "t",
        "times": "40,75",
        "grid": {
            "quantity": [{"name": TABLE, "values": [1.0, 1.1]}, {"name": "wind.mean_scale", "values": [1.0, 1.2]}]
        },
    }
    found = run_parameter_study(given, tmp_path / "out", study=as504)
    edited = Study.load(vehicle_folder).batch([{"wind.mean_scale": 1.2}], [40.0, 75.0])
    np.testing.assert_allclose(found.data["std"].values[3], edited.std.values[0], rtol=1e-9)
    np.testing.assert_allclose(found.data["mean"].values[3], edited.mean.values[0, ..., 0], rtol=1e-9)
    plain = as504.batch([{}], [40.0, 75.0])
    np.testing.assert_array_equal(found.data["std"].values[0], plain.std.values[0])
    grid = {**given, "grid": {"quantity": [{"name": "tables.wind.mean", "values": [1.2]}]}}
    scaled = run_parameter_study(grid, tmp_path / "wind", study=as504)
    np.testing.assert_allclose(scaled.data["mean"].values[0], found.data["mean"].values[1], rtol=1e-9)


def test_members_that_fail_are_kept_with_their_reason(study, tmp_path):
    values = [2.0, 0.0, -5.0, -0.001, 3.0]
    found = run_parameter_study(plan(grid={"quantity": [{"name": "tau", "values": values}]}), tmp_path, study=study)
    assert found.data["status"].values.tolist() == [0, 2, 1, 2, 0]
    reasons = found.data["reason"].values.tolist()
    assert "not finite" in reasons[1]
    assert "unstable: root +0.2" in reasons[2]
    assert "grows without bound" in reasons[3]
    assert reasons[0] == reasons[4] == ""
    std = found.data["std"].values[:, 1, 0, -1]
    assert np.isnan(std).tolist() == [False, True, False, True, False]
    for m in (0, 2, 4):
        assert std[m] == pytest.approx(closed_form(3.0, values[m])[1], rel=1e-6)


def test_a_refused_value_fails_one_member(as504, tmp_path):
    values = [1.0, -1.0]
    given = {"format": 1, "title": "t", "times": "40"}
    given["grid"] = {"quantity": [{"name": "thrust.correlation_time", "values": values}]}
    found = run_parameter_study(given, tmp_path, study=as504)
    assert found.data["status"].values.tolist() == [0, 2]
    assert "cannot be -1" in found.data["reason"].values[1]


def test_a_nominal_that_fails_is_an_error(study, tmp_path):
    with pytest.raises(ParameterValueError, match="nothing varied, fails.*grows without bound"):
        run_parameter_study(dispersion(2, normal("gain", 0.1)), tmp_path, study=study.with_parameters({"tau": -0.001}))


def test_bits_do_not_depend_on_chunks(as504, tmp_path, monkeypatch):
    given = {"format": 1, "title": "t", "times": "40,75"}
    given["dispersion"] = {"members": 7, "seed": 3, "quantity": [normal(TABLE, 0.05), normal("wind.sigma_scale", 0.1)]}
    found = []
    for size in (1, 3, 7):
        monkeypatch.setattr(compute, "CHUNK", size)
        run_parameter_study(given, tmp_path / str(size), study=as504)
        found.append((tmp_path / str(size) / "study.nc").read_bytes())
    assert found[0] == found[1] == found[2]


@pytest.mark.slow
def test_first_order_is_exact_for_what_is_linear(study, tmp_path):
    """Mean and sigma are linear in the gain: the peak is, and its share of the variance is all."""
    found = spread(run_parameter_study(dispersion(400, normal("gain", 0.3)), tmp_path, study=study))
    mean, std = closed_form(3.0)
    exact = {"peak": mean + 3 * std, "abs_mean_plus_3sigma": mean + 3 * std, "mean": mean, "std": std}
    for measure, value in exact.items():
        at = found.sel(measure=measure, response="x")
        assert float(at["first_order_std"]) == pytest.approx(value / GAIN * 0.3, rel=1e-6)
        assert float(at["first_order_mean"]) == pytest.approx(value, rel=1e-6)
        assert float(at["ratio"]) == pytest.approx(1.0, abs=0.01)
        assert float(at["share"].squeeze()) == pytest.approx(1.0)
        normal_95 = value * (1 + 1.6449 * 0.3 / GAIN)
        low, high = (float(at[f"percentile_{end}"].sel(percent=95.0)) for end in ("low", "high"))
        assert low < normal_95 < high
    assert float(found["peak_time"][0]) == 3.0


@pytest.mark.slow
def test_first_order_of_correlated_quantities(study, tmp_path):
    """d sigma = sigma (dg/g) + (d sigma/d tau) dtau with correlated dg and dtau."""
    pair = [{"between": ["gain", "tau"], "coefficient": 0.8}]
    given = dispersion(1024, normal("gain", 0.03), normal("tau", 0.02), correlation=pair, sampling="sobol")
    found = spread(run_parameter_study(given, tmp_path, study=study)).sel(measure="std", response="x")
    std, h = closed_form(3.0)[1], 1e-5
    by_gain, by_tau = std / GAIN, (closed_form(3.0, TAU + h)[1] - closed_form(3.0, TAU - h)[1]) / (2 * h)
    variance = (by_gain * 0.03) ** 2 + (by_tau * 0.02) ** 2 + 2 * 0.8 * by_gain * 0.03 * by_tau * 0.02
    assert float(found["first_order_std"]) == pytest.approx(np.sqrt(variance), rel=1e-5)
    assert float(found["ratio"]) == pytest.approx(1.0, abs=0.01)


def test_changes_are_symmetric_about_the_derivative(as504, tmp_path):
    """Half the difference of both ends is the derivative to second order: sampled road against exact one."""
    quantities = [
        {"name": TABLE, "plus_minus": 0.005},
        {"name": "gains", "parameters": ["control.T1.gain", "control.T2.gain"], "relative": True, "plus_minus": 0.005},
        {"name": "thrust.sigma", "relative": True, "plus_minus": 0.05},
    ]
    given = {"format": 1, "title": "t", "times": "73:77:1", "responses": ["bending_moment"], "relative_tolerance": 1e-8}
    result = run_parameter_study(given | {"one_at_a_time": {"quantity": quantities}}, tmp_path, study=as504)
    found = changes(result).sel(response="bending_moment")
    for measure in ("peak", "mean", "std"):
        part = found.sel(measure=measure)
        low, high = (part["change"].sel(end=end).values for end in ("low", "high"))
        np.testing.assert_allclose((high - low) / 2, part["first_order_change"].sel(end="high").values, rtol=2e-3)
    with pytest.raises(DataError, match="has no spread"):
        spread(result)


def test_interval_of_a_percentile_covers_as_often_as_it_says():
    random = np.random.default_rng(5)
    value, low, high = percentiles(random.standard_normal((2000, 300)))
    for k, exact in enumerate((-2.326348, -1.644854, 0.0, 1.644854, 2.326348)):
        inside = np.mean(~(low[k] > exact) & ~(high[k] < exact))
        assert 0.94 < inside < 0.99, PERCENT[k]
        assert value[k].mean() == pytest.approx(exact, abs=0.08)


def test_too_few_members_with_numbers(study, tmp_path):
    given = dispersion(5, normal("tau", 1e-6, mean=-0.001))
    result = run_parameter_study(given, tmp_path, study=study)
    with pytest.raises(DataError, match="0 of the members have numbers"):
        spread(result)


def test_aerodynamics_is_one_factor_on_every_normal_force(as504, tmp_path):
    """The other road: the area of all forces of motion, and the coefficients of the loads."""
    columns = ("angle_of_attack", "center_of_pressure")
    of_load = [f"tables.loads.{load}.{name}" for load in ("bending_moment", "shear_force") for name in columns]
    other = {"name": "other", "parameters": ["reference_area", *of_load], "relative": True, "values": [1.0, 1.1]}
    found = []
    for quantity in ({"name": "aerodynamics", "values": [1.0, 1.1]}, other):
        given = {"format": 1, "title": "t", "times": "40,75", "grid": {"quantity": [quantity]}}
        folder = tmp_path / str(quantity["name"])
        found.append(run_parameter_study(given, folder, study=as504).data["std"].values)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    assert not np.allclose(found[0][0], found[0][1], rtol=1e-3)
    overlapping = [{"name": name, "values": [1.0, 1.1]} for name in ("aerodynamics", "tables.normal_force_slope")]
    with pytest.raises(DataError, match="'tables.normal_force_slope' already belongs to quantity 'aerodynamics'"):
        run_parameter_study(
            {"format": 1, "title": "t", "grid": {"quantity": overlapping}}, tmp_path / "three", study=as504
        )
