"""Biases of a flight in the equations, as sources of every engine and in the vehicle's file."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.model import LinearSystem, define_system, load_vehicle
from ascentwind.model.errors import DataError, ParameterValueError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Ensemble, Study
from ascentwind.runners.statistics.covariance import CovarianceEquation

AS504 = built_in_vehicles()["as504"]
BIASES = {
    "thrust.standard_deviation": 0.01,
    "center_of_pressure.standard_deviation": 0.03,
    "center_of_gravity_offset.standard_deviation_m": 0.02,
    "thrust_misalignment.standard_deviation_deg": 0.1,
    "wind.standard_deviation": 0.1,
}
SOURCES = ("thrust_bias", "center_of_pressure_bias", "center_of_gravity_offset", "thrust_misalignment", "wind_bias")
CHANGES = {f"biases.{key}": value for key, value in BIASES.items()} | {"start_time_s": 60.0}
TIMES = [65.0, 75.0]


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return Study.load(AS504, changes=CHANGES)


def constant(gain: float, sigma: float, rate: float) -> LinearSystem:
    """A constant b of a flight through gain, and through x' = rate (gain b - x) from rest."""
    t, b, x, n = (ca.SX.sym(s) for s in ("t", "b", "x", "n"))
    return define_system(
        "constant",
        time=t,
        states={"b": (b, ca.SX(0)), "x": (x, rate * (gain * b - x))},
        noises={"n": n},
        outputs={"at_once": gain * b, "lagged": x},
        start_covariance={"n": np.diag([sigma**2, 0.0])},
    )


@pytest.mark.parametrize("engine", ["sweep", "cvodes", "covariance"])
def test_a_constant_through_a_static_response_and_a_lag_has_its_closed_form(engine, cache):
    """Variance (gain sigma)^2, and of the lag times (1 - exp(-rate t))^2; the two are one random number."""
    gain, sigma, rate, times = 3.0, 0.7, 0.8, np.array([0.5, 2.0, 6.0])
    found = Study.from_system(constant(gain, sigma, rate)).response_statistics(times, engine=engine)
    std = gain * sigma * np.stack([np.ones(3), 1 - np.exp(-rate * times)], axis=1)
    np.testing.assert_allclose(found["std"].sel(source="n").values, std, rtol=1e-6)
    if "covariance" in found:
        covariance = found["covariance"].sel(source="n").values
        np.testing.assert_allclose(covariance, np.einsum("ti,tj->tij", std, std), rtol=1e-6)


def test_a_flight_has_one_bias(cache):
    """R(t, s) is of rank one: along a path a static response stands still, and the lag is a factor of it."""
    rate = 0.8
    flown = Ensemble(runs=50, paths=50, path_spacing=0.5)
    found = Study.from_system(constant(3.0, 0.7, rate)).response_statistics([4.0], engine=flown)
    path, t = found["sample_path"].values, found["t"].values
    np.testing.assert_allclose(path[:, :, 0], path[:, :1, 0] * np.ones(t.size), rtol=1e-10)
    np.testing.assert_allclose(path[:, :, 1], path[:, :, 0] * (1 - np.exp(-rate * t)), rtol=1e-8, atol=1e-12)
    assert np.linalg.matrix_rank(path.reshape(50, -1), tol=1e-8) == 1
    assert path[:, 0, 0].std() == pytest.approx(3.0 * 0.7, rel=0.3)


@pytest.mark.parametrize("engine", ["cvodes", pytest.param(CovarianceEquation(1e-8), marks=pytest.mark.slow)])
def test_engines_agree_for_a_vehicle_with_every_bias(study, engine):
    assert study.system.sources == ("wind", "thrust", "center_of_pressure", *SOURCES)
    swept, other = study.response_statistics(TIMES), study.response_statistics(TIMES, engine=engine)
    # the shear that a misalignment leaves is a ten-thousandth of what its parts are: relative to the whole response
    whole = swept["std"].sel(source="combined").values[:, :, None]
    apart = np.abs(other["std"].values - swept["std"].values)
    assert (apart <= 2e-5 * swept["std"].values + 1e-7 * whole).all()
    np.testing.assert_allclose(other["mean"].values, swept["mean"].values, rtol=2e-5)


def test_simulated_flights_draw_a_bias_each(study):
    swept = study.response_statistics(TIMES)
    flown = study.response_statistics(TIMES, engine=Ensemble(runs=2000, confidence=0.9999))
    low, high = (flown[f"std_{end}"].values for end in ("low", "high"))
    assert ((low <= swept["std"].values) & (swept["std"].values <= high)).all()  # zero where a source does not reach


def test_relative_error_of_the_wind_is_that_share_of_the_mean(study):
    """The mean answers the mean wind from rest, linearly: sigma times |mean|, of every response across the axis."""
    across = ["bending_moment", "angle_of_attack", "engine_angle", "shear_force", "q_alpha"]
    found = study.response_statistics(TIMES, responses=across)
    mean = np.abs(found["mean"].sel(source="combined").values)
    np.testing.assert_allclose(found["std"].sel(source="wind_bias").values, 0.1 * mean, rtol=1e-5)


def test_biases_of_tables_are_the_columns_of_noise_of_those_tables(study):
    A, B, C, _ = study.matrices(75.0)
    names, noises = study.system.state_names, study.system.noise_names
    columns = np.vstack([A, C])
    for bias, noise, sigmas in (("thrust_bias", "thrust", 1.0), ("center_of_pressure_bias", "center_of_pressure", 0.6)):
        k, j = names.index(f"deviation_{bias}"), names.index(f"deviation_{noise}")
        expected = sigmas * columns[:, j]
        expected[j] = 0.0  # the noise forgets
        np.testing.assert_allclose(columns[:, k], expected, rtol=1e-12)
    for source in SOURCES:
        assert not A[names.index(f"deviation_{source}")].any()
        assert not B[:, noises.index(source)].any()


def test_weighting_functions_of_biases_vanish(study):
    found = study.weighting_functions([70.0])
    assert not found["noise_weighting"].sel(noise=list(SOURCES)).values.any()


@pytest.mark.parametrize("source", SOURCES)
def test_sensitivity_to_the_sigma_of_a_bias(study, source):
    """Of its own variance 2 % per %; of all sources together as a central difference."""
    name = f"{source}.standard_deviation"
    own = study.sensitivity("bending_moment", 75.0, source=source, quantity="variance", parameters=[name])
    assert own["elasticity"].item() == pytest.approx(2.0, rel=1e-7)
    found = study.sensitivity("bending_moment", 75.0, quantity="std", parameters=[name])
    value = study.parameters[name].value

    def variance(factor: float) -> float:
        changed = study.with_parameters({name: factor * value}).response_statistics(
            [75.0], responses=["bending_moment"]
        )
        return changed["variance"].sel(source="combined").item()

    difference = (variance(1.5) - variance(0.5)) / value  # exact: the variance is quadratic in sigma
    expected = difference / (2 * np.sqrt(variance(1.0)))
    assert found["derivative"].item() == pytest.approx(expected, rel=1e-4)


def test_a_vehicle_without_biases_has_none():
    system = Study.load(AS504, compile=False).system
    assert system.sources == ("wind", "thrust", "center_of_pressure")
    assert not any("bias" in name or "offset" in name or "misalign" in name for name in system.parameter_names)
    assert "biases" not in system.structure


def test_angles_are_read_in_degrees_and_kept_in_radians(study):
    parameter = study.parameters["thrust_misalignment.standard_deviation"]
    assert (parameter.value, parameter.unit) == (pytest.approx(np.radians(0.1)), "rad")
    assert study.parameters["center_of_gravity_offset.standard_deviation"].unit == "m"


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("biases.thrust.standard_deviation", 0.0, "without spread, which is no bias; remove its section"),
        ("biases.wind.standard_deviation", 0, "without spread"),
        ("biases.thrust_misalignment.standard_deviation_deg", 0.0, "without spread"),
        ("biases.center_of_gravity_offset.standard_deviation_m", -0.01, "greater than 0"),
        ("biases.thrust.standard_deviation", float("nan"), "finite number"),
        ("biases.thrust.standard_deviation", float("inf"), "finite number"),
        ("biases.thrust.standard_deviation", "1 %", "valid number"),
        ("biases.thrust.standard_deviation", True, "valid number"),
        ("biases.thrust", 0.01, "biases.thrust"),
        ("biases.thrust.sigma", 0.01, "sigma': is not a key here"),
        ("biases.thrust_misalignment.standard_deviation", 0.1, "did you mean 'standard_deviation_deg'"),
        ("biases.thurst.standard_deviation", 0.01, "did you mean 'thrust'"),
        ("biases.center_of_gravity.standard_deviation", 0.01, "did you mean 'center_of_gravity_offset'"),
        ("options.p_delta", 1, "p_delta.*boolean"),
    ],
)
def test_biases_that_are_none_are_refused(key, value, why):
    with pytest.raises(DataError, match=why) as caught:
        load_vehicle(AS504, {key: value})
    assert "vehicle.toml" in str(caught.value)


def test_a_source_has_one_name(vehicle_folder):
    toml = vehicle_folder / "vehicle.toml"
    toml.write_text(toml.read_text().replace("[noise.thrust]", "[noise.thrust_bias]"))
    load_vehicle(vehicle_folder)
    with pytest.raises(DataError, match=r"noise\.thrust_bias': is called as the source of biases\.thrust; rename it"):
        load_vehicle(vehicle_folder, {"biases.thrust.standard_deviation": 0.01})


def test_a_relative_error_of_nothing_is_refused(vehicle_folder):
    table = vehicle_folder / "wind_march_zonal.csv"
    lines = table.read_text().splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    mean = next(k for k, name in enumerate(lines[head].split(",")) if name.startswith("mean"))
    rows = [line.split(",") for line in lines[head + 1 :]]
    still = [",".join([*row[:mean], "0", *row[mean + 1 :]]) for row in rows]
    table.write_text("\n".join(lines[: head + 1] + still) + "\n")
    toml = vehicle_folder / "vehicle.toml"
    text = toml.read_text()
    first = text.index("\n[wind.record]")
    toml.write_text(text[:first] + text[text.index("\n[wind.correlation]", first) :])
    with pytest.warns(Warning, match=r"wind\.record"), pytest.raises(DataError, match=r"biases\.wind.*no spread"):
        Study.load(vehicle_folder, compile=False, changes={"biases.wind.standard_deviation": 0.1})


@pytest.mark.parametrize(
    ("column", "key", "value"),
    [
        ("center_of_gravity_offset", "biases.center_of_gravity_offset.standard_deviation_m", 0.01),
        ("p_delta_2", "options.p_delta", True),
    ],
)
def test_a_table_without_a_column_says_what_needs_it_and_what_writes_it(vehicle_folder, column, key, value):
    table = vehicle_folder / "loads_station_25m.csv"
    lines = table.read_text().splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    k = lines[head].split(",").index(f"{column} [kg]")
    rows = [line.split(",") for line in lines[head:]]
    table.write_text("\n".join(",".join(row[:k] + row[k + 1 :]) for row in rows) + "\n")
    load_vehicle(vehicle_folder)
    needs = key.removesuffix(".standard_deviation_m")
    with pytest.raises(DataError, match=rf"{column} \[kg\]': is missing, but {needs} needs it; .*build-vehicle"):
        load_vehicle(vehicle_folder, {key: value})


@pytest.mark.parametrize("value", [0.0, -0.01, float("nan")])
def test_a_bias_keeps_its_spread_as_a_parameter(study, value):
    with pytest.raises(ParameterValueError, match=r"thrust_bias\.standard_deviation"):
        study.with_parameters({"thrust_bias.standard_deviation": value})
