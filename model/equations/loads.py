"""Bending moment at a station: equation 4-13, the rigid body's answer to slosh, and what moments are made of."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ..system.symbols import ParameterSymbols, TableSymbols
from ..tables import Table
from ..vehicle.vehicle import Vehicle
from ..vehicle.vehicle_file import LoadEntry
from .slosh import attach_arms, tank_column

TYPICAL_ANGLE = 0.1  # rad: of the angle of attack in strong wind near the greatest dynamic pressure


def typical_moment(angle_of_attack_coefficient: Table) -> float:
    """Return the size of the bending moment (N m) that weighs integration errors: the largest M'_alpha times 0.1 rad.

    A power of ten, since scales are written into the generated code: numbers of a table may change, and only one that
    changes by a decade costs a compilation.
    """
    largest = TYPICAL_ANGLE * float(np.abs(angle_of_attack_coefficient.values).max())
    return 10.0 ** round(np.log10(largest)) if largest > 0 else 1.0


def bending_moment(
    tables: TableSymbols,
    output: str,
    tanks: Sequence[str],
    alpha: ca.SX,
    beta: ca.SX,
    eta_acceleration: ca.SX,
    xi_acceleration: ca.SX,
) -> ca.SX:
    """M'_alpha alpha + M'_beta beta + sum M'_eta_j eta_j'' + sum M'_xi_k xi_k'', N m (4-13)."""
    coefficients = tables.under(f"loads.{output}.")
    moment = coefficients["angle_of_attack"] * alpha + coefficients["engine_angle"] * beta
    for i in range(eta_acceleration.numel()):
        moment += coefficients[f"bending_{i + 1}"] * eta_acceleration[i]
    for i, tank in enumerate(tanks):
        moment += coefficients[f"slosh_{tank}"] * xi_acceleration[i]
    return moment


def bent_axis_moment(tables: TableSymbols, output: str, thrust: ca.SX, eta: ca.SX) -> ca.SX:
    """What thrust on the displaced gimbal adds to 4-13, N m: F_TX / m sum_j (p_delta_j) eta_j.

    The forces along the axis pull at the bent axis forward of the station, less the answer of the rigid body to the
    couple -F_TX sum_j Y_j(X_E) eta_j; drag is spread as the mass.
    """
    coefficients = tables.under(f"loads.{output}.")
    columns = ca.vertcat(ca.SX(0, 1), *(coefficients[f"p_delta_{i + 1}"] for i in range(eta.numel())))
    return thrust / tables["mass"] * ca.dot(columns, eta)


def tanks_forward(vehicle: Vehicle, load: LoadEntry, time: ca.SX, parameters: ParameterSymbols) -> ca.SX:
    """Return 1 where a tank's slosh mass is forward of a load station and 0 where it is aft, shape (tanks,).

    A condition on a table has no known times; the times (s) at which draining liquid passes the station are found here
    and become parameters, so that integrators stop there.
    """
    assert load.forward_of_gimbal_m is not None  # checked by load_vehicle
    found = []
    for tank in vehicle.slosh:
        table = vehicle.tables[f"slosh.{tank.name}.attach_point"]
        is_forward, times = passes(table, load.forward_of_gimbal_m, vehicle.start, vehicle.end)
        forward = ca.SX(is_forward)
        for k, passed in enumerate(times, start=1):
            is_forward = 1 - is_forward
            name = f"loads.{load.output}.{tank.name}_passes_{k}"
            meaning = f"time at which the slosh mass of {tank.name} passes the station of {load.output}"
            forward += (2 * is_forward - 1) * (time >= parameters.add(name, passed, "s", meaning))
        found.append(forward)
    return ca.vertcat(ca.SX(0, 1), *found)


def passes(table: Table, station: float, start: float, end: float) -> tuple[int, list[float]]:
    """Return whether a table lies above a station (m) at the start, 0 or 1, and the times (s) at which it passes it."""
    polynomial = table.polynomial
    roots = polynomial.solve(station, extrapolate=False)
    times = np.unique(np.concatenate([[start, end], roots[(roots > start) & (roots < end)], polynomial.x]))
    times = times[(times >= start) & (times <= end)]
    above = polynomial((times[:-1] + times[1:]) / 2) > station
    changes = np.flatnonzero(above[1:] != above[:-1]) + 1
    return int(above[0]), times[changes].tolist()


def slosh_reaction(
    tables: TableSymbols,
    output: str,
    tanks: Sequence[str],
    forward: ca.SX,
    xi: ca.SX,
    xi_acceleration: ca.SX,
) -> ca.SX:
    """What 4-13 leaves out of slosh: the weight of displaced liquid, and the answer of the whole vehicle, N m.

    sum_k m_k [S_1 / m + (X_Sk - X_CG) S_2 / I_ZZ] xi_k'' + A_X m_k [1 (X_Sk > s) - S_2 / I_ZZ] xi_k, where ``forward``,
    shape (tanks,), is 1 (X_Sk > s), 0 or 1.
    """
    coefficients = tables.under(f"loads.{output}.")
    mass = tank_column(tables, tanks, "mass")
    turning = coefficients["second_moment"] / tables["moment_of_inertia"]
    inertia = mass * (coefficients["first_moment"] / tables["mass"] + attach_arms(tables, tanks) * turning)
    weight = tables["axial_acceleration"] * mass * (forward - turning)
    return ca.dot(inertia, xi_acceleration) + ca.dot(weight, xi)
