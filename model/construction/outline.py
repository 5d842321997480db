"""The outline of a vehicle: its radius along the axis, where equivalent loads and drag stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from .structure import Tank
from .tank_shape import TankShape

JUST_FORWARD = 1e-6  # m
SLACK = 1e-3  # of the radius


@dataclass(frozen=True, eq=False)
class Outline:
    """The radius of a vehicle at stations, linear between; a step is a repeated station.

    Attributes
    ----------
    station, radius : (n,) arrays
        m, from the aft end of the vehicle to its forward end.
    """

    station: NDArray[np.float64]
    radius: NDArray[np.float64]

    def __post_init__(self):
        if self.station.size < 2 or (np.diff(self.station) < 0).any():
            raise DataError("the outline needs at least two stations that do not decrease")
        if not (self.radius >= 0).all() or not self.radius.max() > 0:
            raise DataError("the outline needs radii of 0 or more, and one above")

    def at(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the radius at stations (m), at a step that just forward of it."""
        return np.interp(
            np.minimum(np.asarray(station, float) + JUST_FORWARD, self.station[-1]), self.station, self.radius
        )

    def drag_forward(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the share of the drag that acts forward of stations: of the area that faces forward.

        Friction and the pressure on the base are in no share of their own.
        """
        # squares of the radius by pieces: from the tip aft, only what widens meets the air
        x = np.asarray(station, float)
        widening = np.diff(self.radius[::-1] ** 2)
        inner, outer = self.radius[1:][::-1], self.radius[:-1][::-1]  # of each piece, from the tip aft
        begin, end = self.station[1:][::-1], self.station[:-1][::-1]
        length = np.where(begin > end, begin - end, 1.0)
        share = np.clip((begin - x[..., None]) / length, 0.0, 1.0)
        share = np.where(begin > end, share, begin > x[..., None] + JUST_FORWARD)
        here = inner + share * (outer - inner)
        met = np.where(widening > 0, here**2 - inner**2, 0.0).sum(axis=-1) + self.radius[-1] ** 2
        return met / (np.maximum(widening, 0.0).sum() + self.radius[-1] ** 2)

    def require_around(self, tank: Tank) -> None:
        """Refuse a tank that is wider than the vehicle.

        Raises
        ------
        DataError
        """
        shape = TankShape.of(tank)
        stations = np.linspace(shape.edges[0], shape.edges[-1], 200)[1:-1]
        inside, outside = shape.radius(stations), self.at(stations)
        over = inside - outside * (1 + SLACK)
        if (over > 0).any():
            k = int(np.argmax(over))
            raise DataError(
                f"tank '{tank.name}' has the radius {inside[k]:.4g} m at station {stations[k]:.4g} m, where the "
                f"outline has {outside[k]:.4g} m; correct one"
            )
