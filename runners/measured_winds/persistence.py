"""How much of today's wind is still there some hours later, by vertical scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...model.errors import ParameterValueError

DAY = 24.0  # h
# Correlation of one level with itself 24 h later, March, soundings of Cape Canaveral 2008-2022 (402 pairs of days;
# standard errors by whole years 0.03 to 0.07), altitude in m
MEASURED_LEVELS = (1530.0, 3140.0, 5830.0, 10720.0)
MEASURED = {"zonal": (0.481, 0.566, 0.623, 0.732), "meridional": (0.285, 0.373, 0.422, 0.510)}
EXPONENTS = (2.0 / 3.0, 1.0)  # of growth with lag: the -5/3 spectrum's, and a Markov process's
LONG_WAVELENGTH, SCALE_EXPONENT = 10_000.0, 1.0  # m; assumed
ASSUMED = (
    "24 h: measured at the Cape at four levels, 1.5 to 10.7 km; between 24 h and launch the growth with lag is assumed "
    "(exponent {exponent:.3g}), as is that shorter waves live shorter (in proportion below {wavelength:g} m)"
)


@dataclass(frozen=True)
class Persistence:
    """Correlation of waves of a wavelength over altitude with themselves some hours later, exp(-(hours / T)^p).

    T = ``hours`` for waves of ``wavelength`` and longer, shorter as (wave / wavelength)^``scale_exponent`` for others.
    With p up to 2 it is a valid correlation in time at every wavelength, so that any number of soundings and the wind
    at launch have a joint covariance, whatever the numbers.

    Parameters
    ----------
    hours : float
        T of long waves, h; infinite for winds that stay.
    exponent : float
        p, above 0 and up to 2; no unit.
    wavelength : float
        m.
    scale_exponent : float
        No unit; 0 makes all scales alike: every covariance is multiplied by one number.
    source : str

    Raises
    ------
    ParameterValueError
    """

    hours: float
    exponent: float = EXPONENTS[0]
    wavelength: float = LONG_WAVELENGTH
    scale_exponent: float = SCALE_EXPONENT
    source: str = "given"

    def __post_init__(self):
        good = {
            "hours": self.hours > 0,
            "exponent": 0 < self.exponent <= 2,
            "wavelength": 0 < self.wavelength < np.inf,
            "scale_exponent": 0 <= self.scale_exponent < np.inf,
        }
        for name, fits in good.items():
            if not fits:
                raise ParameterValueError(
                    f"a persistence of {name} = {getattr(self, name)!r} is none: hours, wavelength (m) and "
                    "scale_exponent are positive, exponent lies above 0 and up to 2"
                )

    @property
    def parts(self) -> tuple[Persistence, ...]:
        """Of each component of the wind that is met: itself."""
        return (self,)

    def correlation(self, wavelength: ArrayLike, hours: float) -> NDArray[np.float64]:
        """Return the correlation of waves over a lag.

        Parameters
        ----------
        wavelength : array_like
            m, infinite allowed.
        hours : float
            The lag, h.

        Returns
        -------
        array

        Raises
        ------
        ValueError
            A wavelength that is no number.
        """
        waves = np.asarray(wavelength, float)
        if hours == 0:
            return np.ones(waves.shape)
        lives = self.hours * np.minimum(1.0, waves / self.wavelength) ** self.scale_exponent
        return np.exp(-((hours / lives) ** self.exponent))


@dataclass(frozen=True)
class ComponentPersistence:
    """How long each component of the wind lasts, for vehicles that fly in both planes.

    Parameters
    ----------
    zonal, meridional : Persistence
    """

    zonal: Persistence
    meridional: Persistence

    @property
    def parts(self) -> tuple[Persistence, ...]:
        """Of each component of the wind that is met."""
        return self.zonal, self.meridional

    @property
    def source(self) -> str:
        """Where the numbers are from."""
        zonal, meridional = self.zonal.source, self.meridional.source
        return zonal if zonal == meridional else f"zonal: {zonal}; meridional: {meridional}"

    def correlation(self, wavelength: ArrayLike, hours: float) -> NDArray[np.float64]:
        """Return the correlation of waves of both components over a lag.

        Parameters
        ----------
        wavelength : (2, N) array_like
            m, infinite allowed.
        hours : float
            The lag, h.

        Returns
        -------
        (2, N) array

        Raises
        ------
        ValueError
            A wavelength that is no number.
        """
        return np.array([p.correlation(w, hours) for p, w in zip(self.parts, np.asarray(wavelength), strict=True)])
