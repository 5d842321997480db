"""Both planes of a vehicle with a product of inertia: each turns the other.

With T = (I_pitch phi_pitch'^2 + I_yaw phi_yaw'^2) / 2 + I_py phi_pitch' phi_yaw' the other plane's turning is a couple
on a plane,

    I_pitch phi_pitch'' = M_pitch - I_py phi_yaw'',    I_yaw phi_yaw'' = M_yaw - I_py phi_pitch'',

which acts where the moments M do; modes, slosh and what deviates follow as they follow any couple. Loads keep the
coefficients of their plane: the product is spread along the vehicle as the moments of inertia are, so that what lies
forward of a station answers the couple as it answers the moments.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from .block import Block
from .plane import PlaneEquations


def coupled(
    pitch: PlaneEquations, yaw: PlaneEquations, product: ca.SX
) -> tuple[tuple[PlaneEquations, PlaneEquations], ca.SX]:
    """Return the equations of both planes with each other's couple put in, and what it was divided by.

    Parameters
    ----------
    pitch, yaw : PlaneEquations
    product : SX
        I_py, kg m2.

    Returns
    -------
    (pitch, yaw) : tuple of PlaneEquations
    determinant : SX
        1 - I_py^2 / (I_pitch I_yaw), or what slosh that reacts on the planes makes of it; above zero.
    """
    alone, by_couple = zip(*(_of_couple(part) for part in (pitch, yaw)), strict=True)
    determinant = 1 - by_couple[0] * by_couple[1] * product**2
    turned = [(alone[k] - by_couple[k] * product * alone[1 - k]) / determinant for k in (0, 1)]
    return (_with_couple(pitch, -product * turned[1]), _with_couple(yaw, -product * turned[0])), determinant


def _of_couple(part: PlaneEquations) -> tuple[ca.SX, ca.SX]:
    """Return the acceleration of the attitude without the couple, and by a couple of 1 N m."""
    return ca.substitute(part.rotation, part.couple, 0), ca.jacobian(part.rotation, part.couple)


def _with_couple(part: PlaneEquations, couple: ca.SX) -> PlaneEquations:
    def put(expression: ca.SX) -> ca.SX:
        return ca.substitute(expression, part.couple, couple)

    blocks, positions = (
        tuple(Block(b.states, b.symbols, put(b.rates)) for b in some) for some in (part.blocks, part.positions)
    )
    return replace(part, blocks=blocks, positions=positions, output=put(part.output), rotation=put(part.rotation))
