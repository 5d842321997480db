"""Loads at a station: the bending moment of 4-13, the shear force by the same form, the axial force.

Shear force is positive where it pushes the part forward of the station towards +Y, so that dM/ds = -V but for couples:
rotary inertia and the weight of displaced liquid. The axial force is positive in compression.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ..system.symbols import ParameterSymbols, TableSymbols
from ..tables import Table
from ..vehicle.noise_loads import axial_tables
from ..vehicle.vehicle import Vehicle
from .slosh import attach_arms, tank_column

TYPICAL_DEVIATION = 0.01  # of thrust
TYPICAL_ANGLE = 0.1  # rad: of the angle of attack in strong wind near the greatest dynamic pressure


def typical_load(angle_of_attack_coefficient: Table) -> float:
    """Return the size of a load that weighs integration errors: the largest M'_alpha or V'_alpha times 0.1 rad.

    A power of ten, since scales are written into the generated code: numbers of a table may change, and only one that
    changes by a decade costs a compilation.
    """
    return _decade(TYPICAL_ANGLE * float(np.abs(angle_of_attack_coefficient.values).max()))


def _decade(size: float) -> float:
    return 10.0 ** round(np.log10(size)) if size > 0 else 1.0


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
    moment = _without_slosh(coefficients, alpha, beta, eta_acceleration)
    for i, tank in enumerate(tanks):
        moment += coefficients[f"slosh_{tank}"] * xi_acceleration[i]
    return moment


def bent_axis_load(tables: TableSymbols, output: str, thrust: ca.SX, eta: ca.SX) -> ca.SX:
    """What thrust on the displaced gimbal adds to a load, N m or N: F_TX / m sum_j (p_delta_j) eta_j.

    The forces along the axis pull at the bent axis forward of the station, less the answer of the rigid body to the
    couple -F_TX sum_j Y_j(X_E) eta_j; drag is spread as the mass. Shear is across the unbent axis: the answer alone
    loads it.
    """
    coefficients = tables.under(f"loads.{output}.")
    columns = ca.vertcat(ca.SX(0, 1), *(coefficients[f"p_delta_{i + 1}"] for i in range(eta.numel())))
    return thrust / tables["mass"] * ca.dot(columns, eta)


def shear_force(
    tables: TableSymbols,
    output: str,
    tanks: Sequence[str],
    forward: ca.SX,
    alpha: ca.SX,
    beta: ca.SX,
    eta_acceleration: ca.SX,
    xi_acceleration: ca.SX,
) -> ca.SX:
    """V'_alpha alpha + V'_beta beta + sum V'_eta_j eta_j'' - sum m_k xi_k'' of the tanks ``forward`` of s, N."""
    force = _without_slosh(tables.under(f"loads.{output}."), alpha, beta, eta_acceleration)
    return force - ca.dot(tank_column(tables, tanks, "mass") * forward, xi_acceleration)


def _without_slosh(coefficients: Mapping[str, ca.SX], alpha: ca.SX, beta: ca.SX, eta_acceleration: ca.SX) -> ca.SX:
    load = coefficients["angle_of_attack"] * alpha + coefficients["engine_angle"] * beta
    for i in range(eta_acceleration.numel()):
        load += coefficients[f"bending_{i + 1}"] * eta_acceleration[i]
    return load


def axial_force(coefficients: Mapping[str, Any], flight: Any, forward_of_gimbal: Any) -> Any:
    """Return what compresses a station, N: m_s (F_TX - F_AX) / m + d_s F_AX, less F_TX aft of the gimbal plane.

    Mass m_s and the share d_s of the drag act forward of the station. By symbols or by numbers; thrust and drag are
    the tables, so that they deviate here as noises do, and the flight does not follow.

    Parameters
    ----------
    coefficients : mapping
        Columns of the axial table.
    flight : mapping
        Tables of the flight, by name.
    forward_of_gimbal : float or array
        Of the station, m.
    """
    thrust, drag = flight["thrust"], flight["axial_drag"]
    pushed = coefficients["mass_forward"] * (thrust - drag) / flight["mass"] + coefficients["drag_forward"] * drag
    return pushed - thrust * (forward_of_gimbal < 0)


def axial_noise(tables: Iterable[str], coefficients: Mapping[str, Any], flight: Any, forward_of_gimbal: Any) -> Any:
    """Return the axial force (N) for a relative deviation of 1 of all these tables, as :func:`axial_force` has it."""
    force = 0.0
    for table in axial_tables(tables):
        if table == "mass":
            pushed = flight["thrust"] - flight["axial_drag"]
            force = force - coefficients["mass_forward"] * pushed / flight["mass"]
        else:
            other = "axial_drag" if table == "thrust" else "thrust"  # the force is linear in both
            force = force + axial_force(coefficients, flight | {other: 0.0}, forward_of_gimbal)
    return force


def typical_axial_force(mass_forward: Table, acceleration: Table) -> float:
    """Return the size of the axial force's deviations (N), a power of ten: a hundredth of the largest m_s A_X."""
    return _decade(TYPICAL_DEVIATION * float(np.abs(mass_forward.values).max() * np.abs(acceleration.values).max()))


def tanks_forward(
    vehicle: Vehicle, output: str, forward_of_gimbal: float, time: ca.SX, parameters: ParameterSymbols
) -> ca.SX:
    """Return 1 where a tank's slosh mass is forward of a load station and 0 where it is aft, shape (tanks,).

    A condition on a table has no known times; the times (s) at which draining liquid passes the station are found here
    and become parameters, so that integrators stop there.
    """
    found = []
    for tank in vehicle.slosh:
        table = vehicle.tables[f"slosh.{tank.name}.attach_point"]
        is_forward, times = passes(table, forward_of_gimbal, vehicle.start, vehicle.end)
        forward = ca.SX(is_forward)
        for k, passed in enumerate(times, start=1):
            is_forward = 1 - is_forward
            name = f"loads.{output}.{tank.name}_passes_{k}"
            meaning = f"time at which the slosh mass of {tank.name} passes the station of {output}"
            forward += (2 * is_forward - 1) * (time >= parameters.add(name, passed, "s", meaning))
        found.append(forward)
    return ca.vertcat(ca.SX(0, 1), *found)


def passes(table: Table, station: float, start: float, end: float) -> tuple[int, list[float]]:
    """Return whether a table lies above a station (m) at the start, 0 or 1, and the times (s) at which it passes it."""
    polynomial = table.polynomial
    roots = polynomial.passes(station)
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
    """What 4-13 leaves out of slosh: the weight of displaced liquid, and the answer of the whole vehicle, N m or N.

    sum_k m_k [S_1 / m + (X_Sk - X_CG) S_2 / I_ZZ] xi_k'' + A_X m_k [1 (X_Sk > s) - S_2 / I_ZZ] xi_k, where ``forward``,
    shape (tanks,), is 1 (X_Sk > s), 0 or 1; of a shear force 0, since the weight makes a couple and no lateral force.
    """
    coefficients = tables.under(f"loads.{output}.")
    mass = tank_column(tables, tanks, "mass")
    turning = coefficients["second_moment"] / tables["moment_of_inertia"]
    inertia = mass * (coefficients["first_moment"] / tables["mass"] + attach_arms(tables, tanks) * turning)
    weight = tables["axial_acceleration"] * mass * (forward - turning)
    return ca.dot(inertia, xi_acceleration) + ca.dot(weight, xi)
