"""The rigid body's answer to slosh in the bending moment, against the accelerations of the assembled equations."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from test_assembled import TIMES, VEHICLE, Assembled, NumericEquations, acceleration_rows

from ascentwind.codegen.system.functions import core_functions
from ascentwind.model import load_vehicle
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.equations.loads import passes
from ascentwind.model.tables import Table
from ascentwind.model.vehicle.shipped import built_in_vehicles

FORWARD = 22.46


@dataclass(frozen=True)
class Case:
    model: Assembled
    full: bool


@pytest.fixture(scope="module", params=[True, False], ids=["full coupling", "as reported"])
def case(request) -> Case:
    changes = {"options.slosh_reaction": True, "options.full_coupling": request.param}
    vehicle = load_vehicle(Path(VEHICLE), changes)
    system = assemble(vehicle, np.diag([1.0, 3.0, 1.0]))
    return Case(Assembled(vehicle, system, core_functions(system)), request.param)


@pytest.mark.parametrize("time", TIMES)
def test_moment_is_forces_less_inertia_of_the_part_forward(case, time):
    """Forces on the forward part less its inertia, with the vehicle's own accelerations where slosh moves it.

    Without full coupling the equations of motion hold no answer to slosh; Newton's law then gives it.
    """
    v, A, _, C = case.model.at(time)
    e = NumericEquations(case.model, v, C)
    rows = acceleration_rows(case.model, A)
    translation, rotation, slosh = rows[0], rows[1], rows[2 + e.modes :]
    force = e.external(e.alpha, e.beta, e.identity["attitude"])
    weight = v["axial_acceleration"] * e.slosh_mass[:, None] * e.xi
    if not case.full:
        translation = translation - e.slosh_mass @ slosh / v["mass"]
        rotation = rotation + (weight.sum(axis=0) - (e.slosh_mass * e.arm) @ slosh) / v["moment_of_inertia"]
    load = "loads.bending_moment."
    first, second = v[load + "first_moment"], v[load + "second_moment"]
    forward = e.arm + v["center_of_gravity"] > FORWARD
    # 4-13's M'_alpha and M'_beta already hold the inertia against air and engine forces
    expected = v[load + "angle_of_attack"] * e.alpha + v[load + "engine_angle"] * e.beta
    expected = expected - first * (translation - force[0] / v["mass"])
    expected = expected - second * (rotation - force[1] / v["moment_of_inertia"])
    for i in range(e.modes):
        expected = expected + v[load + f"bending_{i + 1}"] * rows[2 + i]
    for k, tank in enumerate(case.model.vehicle.slosh):
        expected = expected + v[load + f"slosh_{tank.name}"] * slosh[k] + forward[k] * weight[k]
    noise = [i for i, n in enumerate(e.states) if not n.startswith("deviation")]
    found = C[e.outputs.index("bending_moment")]
    np.testing.assert_allclose(found[noise], expected[noise], rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_passing_times_of_a_broken_line():
    """Up through 5 at t = 2.5, a step down to 1 at t = 4 and up again through 5 at t = 6."""
    table = Table("x", "m", np.array([0.0, 3.9, 4.1, 8.0]), np.array([0.0, 7.8, 1.2, 9.0]), "linear", breaks=(4.0,))
    above, times = passes(table, 5.0, 0.0, 8.0)
    assert above == 0
    np.testing.assert_allclose(times, [2.5, 4.0, 6.0], rtol=1e-12)
    assert passes(table, 5.0, 3.0, 8.0)[0] == 1
    assert passes(table, 20.0, 0.0, 8.0) == (0, [])


@pytest.mark.parametrize("name", built_in_vehicles())
def test_liquid_passes_the_station_where_its_table_does(name):
    """A condition on time stands in the equations; the table has the station's value there."""
    vehicle = load_vehicle(VEHICLE.parent / name, {"options.slosh_reaction": True})
    system = assemble(vehicle, np.eye(vehicle.wind.shaping_filter.order))
    found = [p for p in system.parameters if "_passes_" in p.name]
    assert len(found) == len(system.conditions) == 1  # the first stage's oxidiser, in both
    load, tank = vehicle.file.loads[0], vehicle.slosh[0]
    assert found[0].name == f"loads.{load.output}.{tank.name}_passes_1"
    station = vehicle.tables[f"slosh.{tank.name}.attach_point"].polynomial(found[0].value)
    assert station == pytest.approx(load.forward_of_gimbal_m, rel=1e-12)
