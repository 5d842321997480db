"""Bending modes that others computed: frequencies, generalised masses and shapes at times of the flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError

SMALLEST_END = 1e-3  # of a mode's largest displacement, at the forward end


@dataclass(frozen=True, eq=False)
class GivenModes:
    """Bending modes at times, scaled to a displacement of 1 at the forward end.

    Attributes
    ----------
    time : (t,) array
        s, increasing.
    station : (n,) array
        m, increasing, in the vehicle's own count.
    frequency, generalized_mass : (t, k) arrays
        rad/s; kg, with the mode scaled as here.
    displacement : (t, k, n) array
        1.
    rotation : (t, k, n) array
        Of the sections, positive as the slope of the displacement over the station (1/m).
    """

    time: NDArray[np.float64]
    station: NDArray[np.float64]
    frequency: NDArray[np.float64]
    generalized_mass: NDArray[np.float64]
    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]

    def __post_init__(self):
        for values, what in ((self.frequency, "frequency"), (self.generalized_mass, "generalized_mass")):
            if not (values > 0).all():
                t, k = np.argwhere(~(values > 0))[0]
                raise DataError(
                    f"{what} of mode {k + 1} is {values[t, k]:g}; leave out rigid-body modes and give what is positive",
                    time=float(self.time[t]),
                )
        if self.station.size < 4 or not (np.diff(self.station) > 0).all():
            raise DataError("modes need four stations or more, each once")

    @classmethod
    def scaled(
        cls,
        time: NDArray[np.float64],
        station: NDArray[np.float64],
        frequency: NDArray[np.float64],
        generalized_mass: NDArray[np.float64],
        displacement: NDArray[np.float64],
        rotation: NDArray[np.float64],
    ) -> GivenModes:
        """Return modes of any normalisation and sign, scaled to 1 at the forward end.

        Raises
        ------
        DataError
            A mode does not move the forward end.
        """
        end, largest = displacement[..., -1], np.abs(displacement).max(axis=-1)
        still = np.abs(end) <= SMALLEST_END * largest
        if still.any():
            t, k = np.argwhere(still)[0]
            raise DataError(
                f"mode {k + 1} does not move the forward end, where modes are scaled to 1; leave it out",
                time=float(time[t]),
            )
        return cls(
            time,
            station,
            frequency,
            generalized_mass / end**2,
            displacement / end[..., None],
            rotation / end[..., None],
        )
