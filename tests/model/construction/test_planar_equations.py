"""The nonlinear planar equations, the linear model as their linearisation, and the mean response from them."""

from __future__ import annotations

import re

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planar_rows import COLUMNS, planar_rows

from ascentwind.model.construction.planar_equations import planar_motion
from ascentwind.model.errors import DataError, ParameterValueError
from ascentwind.model.system.symbols import TableSymbols
from ascentwind.runners import Study
from ascentwind.runners.solvers.planar_mean import RESPONSES, planar_mean
from ascentwind.runners.solvers.stability import matrices_at

TABLES = {
    "mass": 1.9e6,
    "moment_of_inertia": 8.2e8,
    "center_of_gravity": 29.0,
    "center_of_pressure": 43.0,
    "thrust": 3.8e7,
    "control_thrust": 3.05e7,
    "axial_drag": 1.4e6,
    "dynamic_pressure": 3.3e4,
    "relative_velocity": 404.0,
    "normal_force_slope": 4.7,
}
AREA = 79.46
angle = st.floats(-1.0, 1.0)


@settings(max_examples=40, deadline=None)
@given(st.floats(100, 900), st.floats(-90, 90), angle, angle, st.floats(-90, 90))
def test_planar_motion_is_the_sum_of_forces_in_the_plane(speed, lateral, attitude, engine_angle, wind):
    """The plane as the complex numbers: 1 along the flight, i across it."""
    symbols = TableSymbols(tuple(TABLES))
    motion = planar_motion(
        symbols, ca.SX(AREA), ca.SX(7.0), *map(ca.SX, (speed, lateral, attitude, engine_angle, wind))
    )
    numbers = ca.Function(
        "f", [symbols.vector], [ca.vertcat(motion.forward, motion.lateral, motion.rotation, motion.angle_of_attack)]
    )
    t = TABLES
    through_air = speed + 1j * (lateral - wind)
    body = np.exp(1j * attitude)
    alpha = np.angle(body / through_air)
    pressure = t["dynamic_pressure"] * abs(through_air) ** 2 / t["relative_velocity"] ** 2
    normal = pressure * AREA * t["normal_force_slope"] * alpha * 1j * body
    drag = -t["axial_drag"] * pressure / t["dynamic_pressure"] * body
    gimballed = t["control_thrust"] * np.exp(1j * (attitude + engine_angle))
    force = (t["thrust"] - t["control_thrust"]) * body + gimballed + drag + normal
    along = force.real / t["mass"] - (t["thrust"] - t["axial_drag"]) / t["mass"] + 7.0
    levers = {normal: t["center_of_pressure"], gimballed: 0.0}
    moment = sum((np.conj((x - t["center_of_gravity"]) * body) * f).imag for f, x in levers.items())
    expected = [along, force.imag / t["mass"], moment / t["moment_of_inertia"], alpha]
    found = numbers(list(TABLES.values())).full().ravel()
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("time", [10.0, 30.0, 60.0, 75.0, 90.0, 134.0, 134.34, 145.0])
def test_rigid_body_rows_are_the_linearised_planar_equations(as504, time):
    """4-1 to 4-3 of the assembled model: every column of A and of the wind's input, from the Jacobian about the flight.

    The mean tables are zero here, so that the columns of the vehicle noises are zero too.
    """
    executable, system = as504.executable, as504.system
    m, states = matrices_at(executable, time), system.state_names
    rows = planar_rows(as504.tables(time), as504.parameters["reference_area"].value)
    beta = m["C"][system.output_index("engine_angle")]
    per = dict(zip(COLUMNS, rows.T, strict=True))
    wind_states = [i for i, name in enumerate(states) if name.startswith("wind_")]
    # the shaping filter's output in terms of its states, from the angle of attack: alpha = ... + W / V
    output = np.zeros(len(states))
    output[wind_states] = m["C"][system.output_index("angle_of_attack"), wind_states] * speed(as504, time)
    columns = np.outer(per["engine_angle"], beta) + np.outer(per["wind"], output)
    columns[:, states.index("lateral_velocity")] += per["lateral_velocity"]
    columns[:, states.index("attitude")] += per["attitude"]
    for name, matrix, row in (
        ("lateral_velocity", m["A"], 1),
        ("attitude_rate", m["A"], 2),
    ):
        found = matrix[states.index(name)]
        np.testing.assert_allclose(
            found, columns[row], rtol=1e-10, atol=1e-10 * np.abs(columns[row]).max(), err_msg=name
        )
        assert m["E"][states.index(name), 0] == pytest.approx(per["wind"][row], rel=1e-10)
        assert not m["B"][states.index(name)].any()
    found = m["C"][system.output_index("angle_of_attack")]
    np.testing.assert_allclose(found, columns[3], rtol=1e-10, atol=1e-14)
    assert m["G"][system.output_index("angle_of_attack"), 0] == pytest.approx(per["wind"][3], rel=1e-10)
    # the speed along the flight neither moves nor is moved, to first order
    assert not rows[1:, 0].any()
    assert not rows[0, 1:].any()


def speed(study: Study, time: float) -> float:
    return study.tables(time)["relative_velocity"]


def test_linear_mean_is_that_of_the_assembled_model_without_bending_and_slosh():
    rigid = Study.load("as504", compile=False, changes={"bending": [], "slosh": [], "loads": []})
    assert rigid.vehicle is not None
    found = planar_mean(rigid.vehicle, rigid.executable)
    group = next(g for g in rigid.with_means.groups if g.kind == "mean")
    for i, name in enumerate(RESPONSES):
        expected = group.evaluate(found.times)[:, group.names.index(f"mean.{name}")]
        size = np.abs(expected).max()
        # looser at the kinks of the wind table, where CVODES steps differ
        np.testing.assert_allclose(found.linear[:, i], expected, atol=1e-6 * size, err_msg=name)


def test_nonlinear_part_grows_with_the_third_power_of_the_wind(as504):
    """Mirrored wind, mirrored flight: the first nonlinear term is cubic."""
    parts = []
    for factor in (0.1, 0.2):
        study = as504.with_parameters({"wind.mean_scale": factor})
        found = planar_mean(study.vehicle, study.executable)
        parts.append(found.nonlinear - found.linear)
    for i, name in enumerate(RESPONSES):
        assert np.abs(parts[1][:, i]).max() == pytest.approx(8 * np.abs(parts[0][:, i]).max(), rel=0.02), name


def test_mean_flight_of_as504_is_nearly_linear(as504):
    found = planar_mean(as504.vehicle, as504.executable)
    difference = np.abs(found.nonlinear - found.linear).max(axis=0) / np.abs(found.linear).max(axis=0)
    assert (difference < 3e-3).all()
    assert (difference > 1e-4).all()


def test_nonlinear_mean_is_a_choice(as504):
    study = Study.load("as504", changes={"options.mean_response": "nonlinear"})
    assert study.vehicle is not None
    found = planar_mean(study.vehicle, study.executable)
    k = int(np.argmin(abs(found.times - 75.0)))
    for i, name in enumerate(RESPONSES):
        moved = study.tables(75.0)[f"mean.{name}"] - as504.tables(75.0)[f"mean.{name}"]
        assert moved == pytest.approx(found.nonlinear[k, i] - found.linear[k, i], rel=1e-3, abs=1e-9)
    both = [s.response_statistics([75.0]).std.sel(response="bending_moment", time=75) for s in (study, as504)]
    ratio = (both[0] / both[1]).sel(source=["thrust", "center_of_pressure"]).values
    assert (ratio != 1).all()
    assert ratio == pytest.approx(1, abs=3e-3)
    # the wind's part does not see the mean; only the step control of the common sweep does
    wind = [float(b.sel(source="wind")) for b in both]
    assert wind[0] == pytest.approx(wind[1], rel=1e-9)
    noise = ["thrust", "center_of_pressure"]
    member = study.batch([{}], [75.0]).std.sel(member=0, response="bending_moment", source=noise, time=75)
    np.testing.assert_allclose(member, both[0].sel(source=noise), rtol=1e-4)
    assert (abs(member / both[1].sel(source=noise) - 1) > 2e-4).any()
    for ask in (
        lambda: study.sensitivity("bending_moment", 75.0),
        lambda: study.check_sensitivity("bending_moment", 75.0),
    ):
        with pytest.raises(ParameterValueError, match="linear mean response"):
            ask()


def test_unstable_mean_flight_names_its_time(as504):
    study = as504.with_parameters({"control.T1.gain": -1.0})
    with pytest.raises(DataError, match=r"the mean flight is unstable.*control law") as caught:
        planar_mean(study.vehicle, study.executable)
    assert caught.value.time is not None and 10 < caught.value.time < 60
    angles = [abs(float(a)) for a in re.findall(r"(-?\d+) deg", str(caught.value))]
    assert 45 <= max(angles) < 60  # told when it begins, not when it tumbles
