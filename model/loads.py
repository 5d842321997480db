"""Bending moment at a station: equation 4-13."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from .symbols import TableSymbols


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
