"""The motion of a vehicle as symbols: declared once, for the model and for the report's equations alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion: states, and the angles that forces and loads are written in.

    Attributes
    ----------
    lateral_position, lateral_velocity, attitude, attitude_rate : SX
        Y (m), Y' (m/s), phi_Z (rad), phi_Z' (rad/s). The position is a state where an output asks for it.
    eta, eta_rate : (modes,) SX
        Bending (m), m/s.
    xi, xi_rate : (tanks,) SX
        Slosh relative to the tank (m), m/s.
    alpha, beta : SX
        Angle of attack and engine angle (rad). What 4-3 and 4-4 say of them is put in their place last.
    zone_angles : (zones,) SX
        What each gust zone's wind adds to the angle of attack (rad), likewise; empty where all feel one wind.
    """

    lateral_position: ca.SX
    lateral_velocity: ca.SX
    attitude: ca.SX
    attitude_rate: ca.SX
    eta: ca.SX
    eta_rate: ca.SX
    xi: ca.SX
    xi_rate: ca.SX
    alpha: ca.SX
    beta: ca.SX
    zone_angles: ca.SX

    @staticmethod
    def of(modes: int, tanks: Sequence[str], zones: int = 1) -> Motion:
        """Declare the motion of a vehicle; every symbol carries its full name."""
        numbers = range(1, modes + 1)
        return Motion(
            *(ca.SX.sym(name) for name in ("lateral_position", "lateral_velocity", "attitude", "attitude_rate")),
            eta=named(f"bending_{i}" for i in numbers),
            eta_rate=named(f"bending_rate_{i}" for i in numbers),
            xi=named(f"slosh_{tank}" for tank in tanks),
            xi_rate=named(f"slosh_rate_{tank}" for tank in tanks),
            alpha=ca.SX.sym("angle_of_attack"),
            beta=ca.SX.sym("engine_angle"),
            zone_angles=named(f"zone_angle_{j}" for j in range(1, zones + 1) if zones > 1),
        )


def named(names: Iterable[str]) -> ca.SX:
    """Return a column of new symbols."""
    return ca.vertcat(ca.SX(0, 1), *(ca.SX.sym(name) for name in names))
