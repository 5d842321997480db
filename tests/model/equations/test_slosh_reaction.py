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
