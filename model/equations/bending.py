"""Bending modes: equations 4-8 to 4-10, and what bending adds to sensors and engine angle (4-4)."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ..system.symbols import TableSymbols


def mode_column(tables: TableSymbols, modes: int, quantity: str) -> ca.SX:
    """Return one quantity of every mode as a column, such as the displacements Y_i(X_E)."""
    return ca.vertcat(ca.SX(0, 1), *(tables[f"bending.{i}.{quantity}"] for i in range(1, modes + 1)))


def generalized_force(
    tables: TableSymbols,
    reference_area: ca.SX,
    damping: ca.SX,
    eta: ca.SX,
    eta_rate: ca.SX,
    alpha: ca.SX,
    beta: ca.SX,
) -> ca.SX:
    """Return T_mu_i eta_i'' without its slosh part, N, shape (modes,).

    Engine force F_TCY Y_i(X_E) beta (4-9), aerodynamic force q A sum_j C'_N Y_ij alpha (4-10), and the
    structure's own damping and stiffness (4-8). F_TCY, the lateral force of the control engines per radian, is
    their thrust F_TCX.
    """
    modes = eta.numel()
    mass = mode_column(tables, modes, "generalized_mass")
    frequency = mode_column(tables, modes, "frequency")
    engine = tables["control_thrust"] * mode_column(tables, modes, "displacement_at_gimbal") * beta
    aerodynamic = (
        tables["dynamic_pressure"]
        * reference_area
        * mode_column(tables, modes, "normal_force_slope_times_displacement")
        * alpha
    )
    return engine + aerodynamic - mass * (2 * damping * frequency * eta_rate + frequency**2 * eta)


def gimbal_displacement(tables: TableSymbols, eta: ca.SX) -> ca.SX:
    """Return sum_j Y_j(X_E) eta_j, m."""
    return mode_column(tables, eta.numel(), "displacement_at_gimbal").T @ eta


def displacements(tables: TableSymbols, modes: int, tanks: Sequence[str]) -> ca.SX:
    """Return Y_i(X_Sk), shape (modes, tanks)."""
    return _by_tank(tables, modes, tanks, "displacement_at_")


def slopes(tables: TableSymbols, modes: int, tanks: Sequence[str]) -> ca.SX:
    """Return Y'_i(X_Sk) in 1/m, shape (modes, tanks)."""
    return _by_tank(tables, modes, tanks, "slope_at_")


def _by_tank(tables: TableSymbols, modes: int, tanks: Sequence[str], quantity: str) -> ca.SX:
    columns = (mode_column(tables, modes, quantity + tank) for tank in tanks)
    return ca.horzcat(ca.SX(modes, 0), *columns)
