"""First lateral slosh mode of a tank as it drains: mass, frequency, point of attachment."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...model.construction import Construction
from ...model.construction.tank_shape import TankShape
from ...model.errors import DataError, UnknownNameError
from .slosh_potential import first_slosh_mode

FIRST_ROOT = 1.8411837813406593  # of the derivative of the Bessel function J1
_SHALLOW_FRACTION = 2 / (FIRST_ROOT**2 - 1)  # of the liquid, in a cylinder with little in it


@dataclass(frozen=True, eq=False)
class SloshHistory:
    """The oscillator that stands for the first mode, over time.

    Attributes
    ----------
    mass : (n,) array
        kg.
    frequency : (n,) array
        rad/s, undamped.
    attach_point : (n,) array
        Metres forward of the gimbal plane.
    """

    mass: NDArray[np.float64]
    frequency: NDArray[np.float64]
    attach_point: NDArray[np.float64]


def slosh_history(
    construction: Construction,
    tank: str,
    liquid: ArrayLike,
    axial_acceleration: ArrayLike,
    time: ArrayLike | None = None,
) -> SloshHistory:
    """Compute the oscillator by the construction's ``slosh_method``.

    With R a radius, h a depth, a the axial acceleration and 1.841 the first root of J1', a cylinder has

        omega^2 = 1.841 a / R tanh(1.841 h / R),
        mass = density pi R^3 2 tanh(1.841 h / R) / (1.841 (1.841^2 - 1)),
        attach point 2 R / 1.841 tanh(1.841 h / (2 R)) below the surface (NASA SP-106).

    'cylinder' takes the tank's largest radius and the depth that holds the liquid; 'surface_radius' the radius of the
    free surface and the depth on the axis, the mass no more than the 0.837 of the liquid that slosh in a shallow
    cylinder; 'potential' solves for the flow in the tank's shape.

    Parameters
    ----------
    construction : Construction
    tank : str
    liquid, axial_acceleration : (n,) arrays
        kg, m/s2.
    time : (n,) array, optional
        For messages (s).

    Raises
    ------
    UnknownNameError
        A tank that the vehicle does not have.
    DataError
        No liquid, more than the tank holds, or no axial acceleration that would make it slosh.
    """
    tanks = {t.name: t for t in construction.tanks}
    if tank not in tanks:
        raise UnknownNameError("tank", tank, tanks)
    amount, acceleration = np.broadcast_arrays(
        np.asarray(liquid, dtype=float), np.asarray(axial_acceleration, dtype=float)
    )
    for values, what in ((amount, "kg of liquid"), (acceleration, "m/s2 of axial acceleration")):
        if not (values > 0).all():
            i = int(np.argmin(values.ravel() > 0))
            at = None if time is None else float(np.broadcast_to(np.asarray(time, dtype=float), values.shape).flat[i])
            raise DataError(
                f"tank '{tank}' cannot slosh with {values.flat[i]:g} {what}; end the flight before, raise the residual "
                "or set sloshes = false",
                time=at,
            )
    density, shape = tanks[tank].density, TankShape.of(tanks[tank])
    level = shape.level(amount / density)
    if construction.slosh_method == "potential":
        levels, where = np.unique(level, return_inverse=True)
        modes = [first_slosh_mode(shape, float(s)) for s in levels]
        wave_number, volume, depth = (
            np.array([getattr(m, name) for m in modes])[where].reshape(level.shape)
            for name in ("wave_number", "volume", "depth")
        )
        mass = density * volume
    else:
        if construction.slosh_method == "cylinder":
            radius = np.full_like(level, shape.largest_radius)
            height = amount / density / (math.pi * radius**2)
        else:
            radius, height = shape.radius(level), level - shape.edges[0]
        wave_number, mass, depth = _cylinder(radius, height, density)
        if construction.slosh_method == "surface_radius":
            mass = np.minimum(mass, _SHALLOW_FRACTION * amount)
    return SloshHistory(mass, np.sqrt(acceleration * wave_number), level - depth - construction.gimbal_station)


def _cylinder(
    radius: NDArray[np.float64], height: NDArray[np.float64], density: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return wave number (1/m), mass (kg) and depth of the oscillator below the surface (m)."""
    tanh = np.tanh(FIRST_ROOT * height / radius)
    return (
        FIRST_ROOT / radius * tanh,
        density * math.pi * radius**3 * 2 * tanh / (FIRST_ROOT * (FIRST_ROOT**2 - 1)),
        2 * radius / FIRST_ROOT * np.tanh(FIRST_ROOT * height / (2 * radius)),
    )
