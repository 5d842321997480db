"""Slosh masses: equations 4-11 and 4-12, read with the signs of docs/equations.md.

Y'' + (X_S - X_CG) phi_Z'' + sum_j Y_j(X_S) eta_j'' + xi''
    = A_X phi_Z + A_X sum_j Y'_j(X_S) eta_j - 2 zeta w xi' - w^2 xi

xi is the displacement relative to the tank; all liquid stays in the vehicle's mass, inertia and modes.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ..system.symbols import TableSymbols


def tank_column(tables: TableSymbols, tanks: Sequence[str], quantity: str) -> ca.SX:
    """Return one quantity of every tank as a column, such as the slosh masses."""
    return ca.vertcat(ca.SX(0, 1), *(tables[f"slosh.{tank}.{quantity}"] for tank in tanks))


def slosh_forcing(
    tables: TableSymbols,
    tanks: Sequence[str],
    damping: ca.SX,
    xi: ca.SX,
    xi_rate: ca.SX,
    attitude: ca.SX,
    eta: ca.SX,
    slopes: ca.SX,
) -> ca.SX:
    """Return the right-hand side of 4-12 above, m/s2, shape (tanks,)."""
    frequency = tank_column(tables, tanks, "frequency")
    tilt = attitude + slopes.T @ eta
    return tables["axial_acceleration"] * tilt - 2 * damping * frequency * xi_rate - frequency**2 * xi


def attach_arms(tables: TableSymbols, tanks: Sequence[str]) -> ca.SX:
    """Return X_S - X_CG, m, shape (tanks,)."""
    return tank_column(tables, tanks, "attach_point") - tables["center_of_gravity"]


def slosh_stiffness_force(tables: TableSymbols, tanks: Sequence[str], slopes: ca.SX, xi: ca.SX) -> ca.SX:
    """Return A_X m_S Y'_i(X_S) xi on the modes (4-11), N, shape (modes,)."""
    return tables["axial_acceleration"] * (slopes @ (tank_column(tables, tanks, "mass") * xi))
