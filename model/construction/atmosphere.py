"""The 1976 standard atmosphere as splines over altitude, times the site's factors."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy

from ..standard_atmosphere import GAS_CONSTANT, HEAT_RATIO, HIGHEST, standard_air
from .flight import AtmosphereFactors

_BOTTOM, _SPACING = -1000.0, 10.0


@dataclass(frozen=True, eq=False)
class Atmosphere:
    """Expressions of the air at an altitude.

    Attributes
    ----------
    density, pressure, speed_of_sound : MX
        kg/m3, Pa, m/s.
    """

    density: ca.MX
    pressure: ca.MX
    speed_of_sound: ca.MX


def atmosphere(altitude: ca.MX, factors: AtmosphereFactors | None) -> Atmosphere:
    """Return the air at an altitude.

    The factors on density and temperature are linear between their altitudes and held outside; the pressure follows
    by the gas law. Cubic splines over 10 m of the logarithms of density and temperature carry them, within 2e-5 at the
    kinks of temperature and factors and 1e-8 elsewhere. They end at ``HIGHEST``; who integrates must stop there.

    Parameters
    ----------
    altitude : MX scalar
        m; taken as the geometric altitude above sea level.
    factors : AtmosphereFactors or None
    """
    heights = np.arange(_BOTTOM, HIGHEST + _SPACING / 2, _SPACING)
    density, temperature = standard_air(heights)
    if factors is not None:
        density = density * np.interp(heights, factors.altitude, factors.density)
        temperature = temperature * np.interp(heights, factors.altitude, factors.temperature)
    spline = scipy.interpolate.make_interp_spline(heights, np.log(np.stack([density, temperature], axis=1)), k=3)
    lookup = ca.Function.bspline("air", [spline.t.tolist()], spline.c.ravel().tolist(), [3], 2)
    logarithms = lookup(ca.fmin(ca.fmax(altitude, _BOTTOM), HIGHEST))
    rho, t = ca.exp(logarithms[0]), ca.exp(logarithms[1])
    return Atmosphere(rho, rho * GAS_CONSTANT * t, ca.sqrt(HEAT_RATIO * GAS_CONSTANT * t))
