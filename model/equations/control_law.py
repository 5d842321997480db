"""The control law 4-4 with its networks and load relief: from measured motion to the engine angle."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..system.symbols import TableSymbols
from . import load_relief
from .bending import mode_column
from .block import Block
from .control import TransferFunction, transfer_function
from .coupling import Accelerations
from .motion import Motion
from .typical_sizes import SCALES
from .vehicle_numbers import Numbers


@dataclass(frozen=True, eq=False)
class ControlLaw:
    """States of the networks and of load relief, and the engine angle in terms of all states (rad)."""

    blocks: tuple[Block, ...]
    engine_angle: ca.SX


def control_law(
    numbers: Numbers, motion: Motion, solved: Accelerations, programme: tuple[ca.SX, ca.SX] | None = None
) -> ControlLaw:
    """Close the loop: T1 and T2 of what is measured (4-5, 4-6), load relief, and the actuator T3 (4-7).

    ``programme`` is attitude and attitude rate that are told beside those of the flight (rad, rad/s).
    """
    tables, networks = numbers.tables, numbers.networks
    slopes = mode_column(tables, numbers.modes, "slope_at_sensor")
    attitude, rate = motion.attitude + slopes.T @ motion.eta, motion.attitude_rate + slopes.T @ motion.eta_rate
    if programme is not None:
        attitude, rate = attitude - programme[0], rate - programme[1]
    T1 = transfer_function("T1", *networks["T1"], attitude)
    T2 = transfer_function("T2", *networks["T2"], rate)
    relief = load_relief.feedbacks(tables, numbers.sensors, motion, solved)
    attitude_factor, rate_factor = tables["control.attitude_factor"], tables["control.rate_factor"]
    command = attitude_factor * T1.output + rate_factor * T2.output
    T3 = transfer_function("T3", *networks["T3"], sum((F.output for F in relief.values()), command))
    blocks = (
        *(_network(name, T) for name, T in (("T1", T1), ("T2", T2), ("T3", T3))),
        *(load_relief.filter_block(name, F) for name, F in relief.items()),
    )
    return ControlLaw(blocks, engine_angle(tables, T3.output, motion.eta))


def engine_angle(tables: TableSymbols, actuator: ca.SX, eta: ca.SX) -> ca.SX:
    """beta = T3(s) {...} + sum_j Y'_j(X_E) eta_j, rad (4-4)."""
    return actuator + mode_column(tables, eta.numel(), "slope_at_gimbal").T @ eta


def _network(name: str, T: TransferFunction) -> Block:
    return Block.numbered(name, T.states, T.derivative, "rad", SCALES["angle"])
