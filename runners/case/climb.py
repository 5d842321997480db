"""Altitude over flight time of a vehicle, and the other way round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...model.errors import DataError
from ...model.polynomials import PiecewisePolynomial
from .case import Case

SAMPLES = 0.05  # s
NEWTON_STEPS = 4


@dataclass(frozen=True, eq=False)
class Climb:
    """A flight that always climbs, by the altitude at which the vehicle meets its wind.

    Attributes
    ----------
    polynomial : PiecewisePolynomial
        Altitude (m) over flight time (s).
    times, altitudes : (k,) arrays
        Samples from the start to the end of the flight, s and m, increasing.
    """

    polynomial: PiecewisePolynomial
    times: NDArray[np.float64]
    altitudes: NDArray[np.float64]

    @classmethod
    def of(cls, case: Case) -> Climb:
        """Return the climb of a case's vehicle.

        Raises
        ------
        NoVehicleError
        DataError
            It descends, so that an altitude is passed twice.
        """
        vehicle = case.vehicle_for("a wind over altitude")
        start, end = case.system.start, case.system.end
        times = np.linspace(start, end, max(2, int(np.ceil((end - start) / SAMPLES)) + 1))
        polynomial = vehicle.met_altitude
        altitudes = polynomial(times)
        if not (np.diff(altitudes) > 0).all():
            at = times[int(np.argmin(np.diff(altitudes) > 0))]
            raise DataError("the vehicle does not climb, and a wind over altitude is met twice or never", time=at)
        return cls(polynomial, times, altitudes)

    def altitude(self, times: ArrayLike) -> NDArray[np.float64]:
        """Return altitudes (m) at flight times (s), in any shape."""
        return self.polynomial(np.asarray(times, float))

    def time_at(self, altitudes: ArrayLike) -> NDArray[np.float64]:
        """Return flight times (s) at altitudes (m), in any shape; the flight's ends for those beyond it."""
        wanted = np.clip(np.asarray(altitudes, float), self.altitudes[0], self.altitudes[-1])
        found = np.interp(wanted, self.altitudes, self.times)
        for _ in range(NEWTON_STEPS):
            found = found - (self.polynomial(found) - wanted) / self.polynomial(found, 1)
            found = np.clip(found, self.times[0], self.times[-1])
        return found
