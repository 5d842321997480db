"""Bending moment at a station: equation 4-13, the rigid body's answer to slosh, and what moments are made of."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from ..system.symbols import TableSymbols
from ..tables import Table
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


def slosh_reaction(
    tables: TableSymbols,
    output: str,
    tanks: Sequence[str],
    forward_of_gimbal: float,
    xi: ca.SX,
    xi_acceleration: ca.SX,
) -> ca.SX:
    """What 4-13 leaves out of slosh: the weight of displaced liquid, and the answer of the whole vehicle, N m.

    sum_k m_k [S_1 / m + (X_Sk - X_CG) S_2 / I_ZZ] xi_k'' + A_X m_k [1 (X_Sk > s) - S_2 / I_ZZ] xi_k
    """
    coefficients = tables.under(f"loads.{output}.")
    mass = tank_column(tables, tanks, "mass")
    turning = coefficients["second_moment"] / tables["moment_of_inertia"]
    inertia = mass * (coefficients["first_moment"] / tables["mass"] + attach_arms(tables, tanks) * turning)
    forward = tank_column(tables, tanks, "attach_point") > forward_of_gimbal
    weight = tables["axial_acceleration"] * mass * (forward - turning)
    return ca.dot(inertia, xi_acceleration) + ca.dot(weight, xi)
