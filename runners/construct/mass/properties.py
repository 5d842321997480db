"""Mass, centre of gravity and pitch inertia of a vehicle as its tanks empty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....model.construction import Construction
from ....model.construction.tank_shape import TankShape
from ....model.errors import UnknownNameError


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Of the whole vehicle, for each state of its tanks.

    Attributes
    ----------
    mass : (n,) array
        kg.
    center_of_gravity : (n,) array
        Metres forward of the gimbal plane.
    moment_of_inertia : (n,) array
        Pitch, about the centre of gravity (kg m2).
    """

    mass: NDArray[np.float64]
    center_of_gravity: NDArray[np.float64]
    moment_of_inertia: NDArray[np.float64]


def mass_properties(construction: Construction, liquid: Mapping[str, ArrayLike]) -> MassProperties:
    """Sum masses and liquid by exact integrals.

    A mass between two stations is uniform there; a ring of its radius of gyration r adds m r^2 / 2. A grain is a tube
    whose port widens alike everywhere. Liquid is slices of
    the tank's area that count as points on the axis: without viscosity a slice does not turn with its wall.

    Parameters
    ----------
    construction : Construction
    liquid : mapping
        Tank, grain or dropped item to what is there of it (kg), each of shape (n,) or a number; what is left out is
        there as at release.

    Raises
    ------
    UnknownNameError
        A tank that the vehicle does not have.
    DataError
        More liquid than the tank holds.
    """
    require_known_stores(construction, liquid)
    mass = first = second = np.zeros(())
    for item in construction.masses:
        begin, end = (construction.forward_of_gimbal(s) for s in (item.begin, item.end))
        middle, there = 0.5 * (begin + end), np.asarray(liquid.get(item.name, item.mass), dtype=float)
        mass = mass + there
        first = first + there * middle
        second = second + there * (middle**2 + (end - begin) ** 2 / 12 + item.radius**2 / 2)
    for grain in construction.grains:
        begin, end = (construction.forward_of_gimbal(s) for s in (grain.begin, grain.end))
        middle, there = 0.5 * (begin + end), np.asarray(liquid.get(grain.name, grain.propellant), dtype=float)
        mass = mass + there
        first = first + there * middle
        second = second + there * (middle**2 + (end - begin) ** 2 / 12) + grain.rotary_inertia(there)
    for tank in construction.tanks:
        shape = TankShape.of(tank)
        level = shape.level(np.asarray(liquid.get(tank.name, tank.liquid), dtype=float) / tank.density)
        v0, v1, v2 = np.moveaxis(tank.density * shape.moments(level), -1, 0)
        x0 = construction.forward_of_gimbal(0.0)  # moments count from station 0
        mass = mass + v0
        first = first + v1 + x0 * v0
        second = second + v2 + 2 * x0 * v1 + x0**2 * v0
    center = first / mass
    return MassProperties(mass, center, second - mass * center**2)


def require_known_stores(construction: Construction, liquid: Mapping[str, object]) -> None:
    """Refuse the name of a tank, grain or dropped item that the vehicle does not have."""
    names = list(construction.stores)
    for name in liquid:
        if name not in names:
            raise UnknownNameError("tank", name, names)
