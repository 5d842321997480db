"""Masses, tanks and stiffness along the vehicle. Stations are metres, forward positive, in the vehicle's own count."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError


@dataclass(frozen=True)
class LumpedMass:
    """A mass spread evenly between two stations.

    Attributes
    ----------
    name : str
    begin, end : float
        Stations (m); equal for a point mass.
    mass : float
        kg.
    radius : float
        Radius of gyration about the vehicle's axis (m): a ring of that radius adds mass radius^2 / 2 to the pitch
        inertia.
    """

    name: str
    begin: float
    end: float
    mass: float
    radius: float = 0.0

    def __post_init__(self):
        if not (math.isfinite(self.begin) and math.isfinite(self.end) and self.end >= self.begin):
            raise DataError(
                f"mass '{self.name}' ends at {self.end:g} m, aft of its begin at {self.begin:g} m; swap them"
            )
        if not (self.mass > 0 and math.isfinite(self.mass)):
            raise DataError(f"mass '{self.name}' is {self.mass:g} kg; give a positive mass")
        if not self.radius >= 0:
            raise DataError(f"mass '{self.name}' has the radius {self.radius:g} m; give 0 or more")

    def require_within(self, aft_end: float, forward_end: float) -> None:
        """Refuse a mass that reaches beyond the vehicle's ends."""
        if self.begin < aft_end or self.end > forward_end:
            raise DataError(
                f"mass '{self.name}' lies from {self.begin:g} to {self.end:g} m, beyond the vehicle's ends at "
                f"{aft_end:g} and {forward_end:g} m; correct its stations"
            )


@dataclass(frozen=True)
class TankSection:
    """A part of a tank's volume, bounded by a body of revolution about the vehicle's axis.

    Attributes
    ----------
    kind : {'cylinder', 'cone', 'ellipsoid'}
    begin, end : float
        Stations (m).
    radius : float
        Cylinder: its radius. Cone: at ``begin``. Ellipsoid: at ``center`` (m).
    end_radius : float
        Cone: at ``end`` (m).
    center, semi_axis : float
        Ellipsoid: station of its centre and half its length along the vehicle (m).
    sign : {1, -1}
        -1 takes the volume away: a bulkhead that bulges into the tank, a tunnel.
    count : int
        How many of them, side by side (tunnels).
    """

    kind: Literal["cylinder", "cone", "ellipsoid"]
    begin: float
    end: float
    radius: float
    end_radius: float = 0.0
    center: float = 0.0
    semi_axis: float = 1.0
    sign: Literal[1, -1] = 1
    count: int = 1

    def __post_init__(self):
        if not self.end > self.begin:
            raise DataError(f"a tank section ends at {self.end:g} m, not forward of its begin at {self.begin:g} m")
        if not self.radius > 0 or not self.end_radius >= 0 or not self.semi_axis > 0 or self.count < 1:
            raise DataError(f"the tank section from {self.begin:g} m needs positive radius, semi-axis and count")
        if self.kind == "ellipsoid":
            slack = 1e-6 * self.semi_axis
            low, high = self.center - self.semi_axis - slack, self.center + self.semi_axis + slack
            if self.begin < low or self.end > high:
                raise DataError(
                    f"the ellipsoid section from {self.begin:g} to {self.end:g} m reaches beyond its tips at "
                    f"{low + slack:g} and {high - slack:g} m; correct begin, end, center or semi_axis"
                )


@dataclass(frozen=True)
class Tank:
    """A tank and the liquid in it when the vehicle is released.

    Attributes
    ----------
    name : str
    sections : tuple of TankSection
    density : float
        kg/m3.
    liquid : float
        kg in the tank at release.
    sloshes : bool
        Whether its first lateral slosh mode is a state of the model.
    """

    name: str
    sections: tuple[TankSection, ...]
    density: float
    liquid: float
    sloshes: bool

    def __post_init__(self):
        if not self.sections:
            raise DataError(f"tank '{self.name}' has no sections; describe its shape")
        if not self.density > 0 or not self.liquid >= 0:
            raise DataError(f"tank '{self.name}' needs a positive density and a liquid mass of zero or more")

    @property
    def bottom(self) -> float:
        """Station of its lowest point (m)."""
        return min(s.begin for s in self.sections if s.sign > 0)

    @property
    def top(self) -> float:
        """Station of its highest point (m)."""
        return max(s.end for s in self.sections if s.sign > 0)


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Bending and shear stiffness at stations, both logarithmic between them; a jump is a repeated station.

    Attributes
    ----------
    station : (n,) array
        m, from the aft end of the beam to its forward end.
    bending : (n,) array
        E I (N m2).
    shear : (n,) array
        k G A (N).
    """

    station: NDArray[np.float64]
    bending: NDArray[np.float64]
    shear: NDArray[np.float64]

    def __post_init__(self):
        if self.station.size < 2 or (np.diff(self.station) < 0).any():
            raise DataError("stiffness needs at least two stations that do not decrease")
        for name, values in (("bending", self.bending), ("shear", self.shear)):
            if not (values > 0).all():
                at = self.station[int(np.argmin(values > 0))]
                raise DataError(f"{name} stiffness is not positive at station {at:g} m; correct it")
