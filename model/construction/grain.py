"""The grain of a solid motor: a tube of propellant that burns from its port outwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError


@dataclass(frozen=True)
class Grain:
    """Propellant of motors that burn alike, between two stations, in a case of one radius.

    The port widens alike everywhere, so that the mass per length stays uniform and the centre where it is:
    r^2 = R^2 - m / (density pi L) with m the propellant left in one motor.

    Attributes
    ----------
    name : str
    count : int
        How many motors.
    begin, end : float
        Stations (m).
    radius : float
        Outer radius R of the grain (m).
    distance : float
        Of the motors' axes from that of the vehicle (m); several stand evenly around it.
    density : float
        kg/m3.
    propellant : float
        kg in all of them at release.
    """

    name: str
    count: int
    begin: float
    end: float
    radius: float
    distance: float
    density: float
    propellant: float

    def __post_init__(self):
        if not self.end > self.begin:
            raise DataError(
                f"the grain ends at {self.end:g} m, not forward of its begin at {self.begin:g} m; swap them"
            )
        if self.count < 1 or not (self.radius > 0 and self.density > 0 and self.propellant > 0 and self.distance >= 0):
            raise DataError(
                "the grain needs positive count, radius, density and propellant, and a distance of 0 or more"
            )
        if self.propellant > self.capacity:
            raise DataError(
                f"the grain has {self.propellant / self.count:g} kg in a motor, more than the "
                f"{self.capacity / self.count:.6g} kg of a full cylinder; correct propellant, density or sizes"
            )
        if 0 < self.distance < self.radius:
            raise DataError(
                f"the grain's motors stand {self.distance:g} m off the axis, within their own radius of "
                f"{self.radius:g} m; correct distance_m"
            )

    @property
    def capacity(self) -> float:
        """Propellant of as many full cylinders (kg)."""
        return self.count * self.density * math.pi * self.radius**2 * (self.end - self.begin)

    def port_radius(self, left: ArrayLike) -> NDArray[np.float64]:
        """Return the radius of the port (m) with a propellant left in all motors (kg)."""
        share = np.clip(np.asarray(left, dtype=float) / self.capacity, 0.0, 1.0)
        return self.radius * np.sqrt(1.0 - share)

    def rotary_inertia(self, left: ArrayLike) -> NDArray[np.float64]:
        """Return the sections' moment of inertia about lateral axes through the vehicle's axis (kg m2).

        Of a ring m (R^2 + r^2) / 4, and of motors around the axis at a distance d half of m d^2: all of it in the mean
        over lateral axes, and exactly for three motors or more.
        """
        left = np.asarray(left, dtype=float)
        return left * (0.25 * (self.radius**2 + self.port_radius(left) ** 2) + 0.5 * self.distance**2)
