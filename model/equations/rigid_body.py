"""Translation, rotation and angle of attack: equations 4-1 to 4-3.

Signs (docs/equations.md): Y lateral in the yaw plane, x metres forward of the gimbal plane, angles positive nose
towards +Y, wind W positive towards +Y, engine angle positive when it pushes the tail towards +Y.
"""

from __future__ import annotations

import casadi as ca

from ..system.symbols import TableSymbols


def angle_of_attack(tables: TableSymbols, attitude: ca.SX, lateral_velocity: ca.SX, wind: ca.SX) -> ca.SX:
    """alpha = phi_Z + (W - Ydot) / V_RS, rad (4-3)."""
    return attitude + (wind - lateral_velocity) / tables["relative_velocity"]


def normal_force_slope(tables: TableSymbols, reference_area: ca.SX) -> ca.SX:
    """q A C'_N, N/rad."""
    return tables["dynamic_pressure"] * reference_area * tables["normal_force_slope"]


def lateral_force(tables: TableSymbols, reference_area: ca.SX, alpha: ca.SX, beta: ca.SX, attitude: ca.SX) -> ca.SX:
    """m Y'' = q A C'_N alpha + F_TCX beta + (F_TX - F_AX) phi_Z, N (4-1; printed delta is a misread phi)."""
    return (
        normal_force_slope(tables, reference_area) * alpha
        + tables["control_thrust"] * beta
        + (tables["thrust"] - tables["axial_drag"]) * attitude
    )


def yaw_moment(tables: TableSymbols, reference_area: ca.SX, alpha: ca.SX, beta: ca.SX) -> ca.SX:
    """I_ZZ phi_Z'' = q A C'_N (X_CP - X_CG) alpha - F_TCX X_CG beta, N m (4-2)."""
    arm = tables["center_of_pressure"] - tables["center_of_gravity"]
    return (
        normal_force_slope(tables, reference_area) * arm * alpha
        - tables["control_thrust"] * tables["center_of_gravity"] * beta
    )
