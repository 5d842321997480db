"""Local angle of attack: what bending and rotation add to the air forces along the vehicle.

The report takes the angle of attack of the rigid body for every segment (4.1.2, assumption 4) and names the error: 4
to 5 % of the bending moment. A segment at x is turned by the modes' slopes and moves with their rates,

    alpha(x) - alpha = sum_j Y'_j(x) eta_j - [(x - X_CG) phi_Z' + sum_j Y_j(x) eta_j'] / V_RS,

so that every air force gains integrals of c'_N over products of 1, (x - X_CG), Y_i and Y'_j. Those integrals are
tables of a vehicle that 'ascentwind build-vehicle' wrote; a deviation of the centre of pressure does not move them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..system.symbols import TableSymbols
from ..vehicle.columns import PREFIX


@dataclass(frozen=True)
class LocalForces:
    """What the local angle of attack adds: lateral force (N), yaw moment (N m), generalised forces (modes,) (N)."""

    force: ca.SX
    moment: ca.SX
    modal: ca.SX


def local_forces(
    tables: TableSymbols, reference_area: ca.SX, attitude_rate: ca.SX, eta: ca.SX, eta_rate: ca.SX
) -> LocalForces:
    """Integrate q A c'_N (alpha(x) - alpha) against 1, (x - X_CG) and Y_i(x)."""
    modes = eta.numel()
    local = tables.under(PREFIX)
    turn = attitude_rate / tables["relative_velocity"]
    sink = eta_rate / tables["relative_velocity"]
    pressure = tables["dynamic_pressure"] * reference_area
    numbers = range(modes)
    force, moment = -local["arm"] * turn, -local["arm_squared"] * turn
    modal = []
    for i in numbers:
        displacement = tables[f"bending.{i + 1}.normal_force_slope_times_displacement"]
        force += local[f"slope_{i + 1}"] * eta[i] - displacement * sink[i]
        moment += local[f"arm_slope_{i + 1}"] * eta[i] - local[f"arm_displacement_{i + 1}"] * sink[i]
        work = -local[f"arm_displacement_{i + 1}"] * turn
        for j in numbers:
            work += local[f"displacement_{i + 1}_slope_{j + 1}"] * eta[j] - _pair(local, i, j) * sink[j]
        modal.append(pressure * work)
    return LocalForces(pressure * force, pressure * moment, ca.vertcat(ca.SX(0, 1), *modal))


def local_load(tables: TableSymbols, output: str, attitude_rate: ca.SX, eta: ca.SX, eta_rate: ca.SX) -> ca.SX:
    """What the local angle of attack adds to a load, the rigid body's reaction to it included, N m or N."""
    local = tables.under(f"{PREFIX}loads.{output}.")
    moment = local["attitude_rate"] * attitude_rate
    for i in range(eta.numel()):
        moment += local[f"bending_displacement_{i + 1}"] * eta[i] + local[f"bending_rate_{i + 1}"] * eta_rate[i]
    return moment


def _pair(local: Mapping[str, ca.SX], i: int, j: int) -> ca.SX:
    low, high = min(i, j) + 1, max(i, j) + 1
    return local[f"displacement_{low}_displacement_{high}"]
