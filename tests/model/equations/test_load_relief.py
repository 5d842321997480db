"""Load relief: what the sensors measure, derived by other means, and how it enters the assembled loop."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import sympy as sp
from lagrangian import (
    A_X,
    MODES,
    X_CG,
    X_S,
    Y_S,
    accelerations,
    across,
    coordinates,
    derive,
    eta,
    m_S,
    phi,
    point,
    rates,
    rest,
    slope_S,
    xi,
)

from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import Study

ACCELEROMETER, VANE = "control.accelerometer", "control.angle_of_attack"
GAINS = {f"{ACCELEROMETER}.gain": 0.02, f"{VANE}.gain": 0.15}


@pytest.fixture(scope="session")
def relief_folder(tmp_path_factory):
    """A copy of AS-504 with load_relief.toml appended, as docs/design.md says."""
    folder = tmp_path_factory.mktemp("relief") / "relief"
    shutil.copytree(built_in_vehicles()["as504"], folder)
    with (folder / "vehicle.toml").open("a") as file:
        file.write((folder / "load_relief.toml").read_text())
    return folder


@pytest.fixture(scope="session")
def relief(cache, relief_folder) -> Study:
    return Study.load(relief_folder)


def test_accelerometer_is_a_slosh_mass_too_stiff_to_move():
    """A mass on a stiff spring measures -w^2 xi: its equation from the Lagrangian, at xi = 0, is the sensed force."""
    for k in range(2):
        row = sp.expand(derive().residual()[2 + MODES + k] / m_S[k])
        still = {xi[k]: 0, rates[2 + MODES + k]: 0, accelerations[2 + MODES + k]: 0}
        sensed = (
            accelerations[0]
            - A_X * phi
            + (X_S[k] - X_CG) * accelerations[1]
            + sum(Y_S[i, k] * accelerations[2 + i] - A_X * slope_S[i, k] * eta[i] for i in range(MODES))
        )
        assert sp.expand(row.subs(still) - sensed) == 0


def test_sensed_angle_of_attack_is_the_direction_of_the_air_past_a_moving_and_turning_place():
    V, W, X = sp.symbols("V W X")
    Y, slope = sp.symbols(f"Y1:{MODES + 1}"), sp.symbols(f"s1:{MODES + 1}")
    position = point(X, sum(y * e for y, e in zip(Y, eta, strict=True)))
    velocity = position.jacobian(coordinates) * rates
    air = sp.Matrix([-V, W]) - velocity
    axis = phi + sum(s * e for s, e in zip(slope, eta, strict=True))
    exact = (air.T * across(axis))[0] / V
    signals = sp.Matrix([*coordinates, *rates, W])
    zero = {**rest, W: 0}
    linear = (sp.Matrix([exact]).jacobian(signals).subs(zero) * signals)[0]
    motion = rates[0] + (X - X_CG) * rates[1] + sum(y * r for y, r in zip(Y, rates[2:], strict=False))
    assert sp.expand(linear - axis - (W - motion) / V) == 0


@pytest.mark.parametrize("coupling", [False, True])
@pytest.mark.parametrize("time", [47.0, 75.0, 110.0])
@pytest.mark.slow
def test_assembled_filters_take_what_the_sensors_measure(relief_folder, relief, coupling, time):
    study = Study.load(relief_folder, compile=False, changes={"options.full_coupling": True}) if coupling else relief
    study = study.with_parameters(GAINS)
    A, _, C, _ = study.matrices(time)
    v, names = study.tables(time), study.system.state_names
    row, state = (lambda name: A[names.index(name)]), (lambda name: np.eye(len(names))[names.index(name)])
    modes = (1, 2)
    acceleration = row("lateral_velocity") - (v["thrust"] - v["axial_drag"]) / v["mass"] * state("attitude")
    acceleration = acceleration + (43.2 - v["center_of_gravity"]) * row("attitude_rate")
    for i in modes:
        acceleration = acceleration + v[f"{ACCELEROMETER}.displacement_{i}"] * row(f"bending_rate_{i}")
        acceleration = acceleration - v["axial_acceleration"] * v[f"{ACCELEROMETER}.slope_{i}"] * state(f"bending_{i}")
    sigma = study.parameters["thrust.sigma"].value
    at = names.index("deviation_thrust")
    acceleration[at] -= sigma * v["thrust"] / v["mass"] * v["mean.attitude"]  # thrust along the axis is not sensed
    vane = C[study.system.output_index("angle_of_attack")].copy()
    vane = vane - (105.156 - v["center_of_gravity"]) / v["relative_velocity"] * state("attitude_rate")
    for i in modes:
        vane = vane + v[f"{VANE}.slope_{i}"] * state(f"bending_{i}")
        vane = vane - v[f"{VANE}.displacement_{i}"] / v["relative_velocity"] * state(f"bending_rate_{i}")
    for name, signal in (("accelerometer_filter_1", acceleration), ("angle_of_attack_filter_1", vane)):
        expected = (signal - state(name)) / 0.5  # a lag of 0.5 s
        np.testing.assert_allclose(row(name), expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("time", "factor"), [(50.0, 0.5), (75.0, 1.0), (100.0, 0.5), (120.0, 0.0)])
def test_sensors_reach_the_engine_through_gain_schedule_and_actuator(relief, time, factor):
    study = relief.with_parameters(GAINS)
    A, _, C, _ = study.matrices(time)
    names = study.system.state_names
    actuator = [names.index("T3_1"), names.index("T3_2")]
    beta = C[study.system.output_index("engine_angle")]
    T3 = study.vehicle.transfer_functions["T3"]
    for w in (0.5, 7.0):
        through = beta[actuator] @ np.linalg.inv(1j * w * np.eye(2) - A[np.ix_(actuator, actuator)]) @ A[actuator]
        rational = np.polyval(T3.numerator, 1j * w) / np.polyval(T3.denominator, 1j * w)
        for name, gain in (("accelerometer_filter_1", 0.02), ("angle_of_attack_filter_1", 0.15)):
            assert through[names.index(name)] == pytest.approx(gain * factor * rational, rel=1e-9, abs=1e-15)


def test_gains_of_zero_change_nothing(relief, as504):
    found, expected = (study.response_statistics([60.0, 80.0, 110.0]) for study in (relief, as504))
    np.testing.assert_allclose(found.std.values, expected.std.values, rtol=1e-9)
    np.testing.assert_allclose(found["mean"].values, expected["mean"].values, rtol=1e-7, atol=1e-9)


@pytest.mark.slow
def test_engines_agree_with_the_sensors_on(relief):
    study = relief.with_parameters(GAINS)
    found = {e: study.response_statistics([75.0], engine=e) for e in ("sweep", "cvodes", "covariance")}
    for other in ("cvodes", "covariance"):
        np.testing.assert_allclose(found[other].std.values, found["sweep"].std.values, rtol=2e-5)
    without = relief.response_statistics([75.0])
    assert found["sweep"].std.values[0, 0, -1] < 0.95 * without.std.values[0, 0, -1]


LAG = "denominator = [0.5, 1.0]"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (LAG, "denominator = [1.0]", "as many zeros as poles.*add a pole"),
        ("[control.accelerometer.modes]", "[control.accelerometer.mode]", "'control.accelerometer.mode': is not a key"),
        ("accelerometer_modes.csv", "load_relief_schedule.csv", r"column 'displacement_1 \[1\]' is missing"),
        ("gain = 0.0", 'gain = "high"', "valid number"),
    ],
)
def test_bad_sensors_are_refused(vehicle_folder, old, new, message):
    text = (vehicle_folder / "load_relief.toml").read_text()
    assert old in text
    with (vehicle_folder / "vehicle.toml").open("a") as file:
        file.write(text.replace(old, new, 1))
    with pytest.raises(DataError, match=message):
        Study.load(vehicle_folder, compile=False)


def test_missing_modes_name_the_columns(vehicle_folder):
    lines = (vehicle_folder / "load_relief.toml").read_text().split("[control.accelerometer.modes]")
    with (vehicle_folder / "vehicle.toml").open("a") as file:
        file.write(lines[0])
    with pytest.raises(
        DataError, match=r"accelerometer.modes': is missing; name a table of displacement_1 \[1\], slope_1"
    ):
        Study.load(vehicle_folder, compile=False)
