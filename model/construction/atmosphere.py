"""The 1976 standard atmosphere as splines over altitude, times the site's factors."""

from __future__ import annotations

from dataclasses import dataclass

import ambiance
import casadi as ca
import numpy as np
from scipy.interpolate import make_interp_spline

from .flight import AtmosphereFactors

TOP = 81_000.0  # m; ambiance's tables end 20 m above
_BOTTOM, _SPACING = -1000.0, 10.0
_GAS_CONSTANT, _HEAT_RATIO = 287.05287, 1.4  # J/(kg K), 1: of the standard atmosphere


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
    kinks of temperature and factors and 1e-8 elsewhere. They end at ``TOP``; who integrates must stop there.

    Parameters
    ----------
    altitude : MX scalar
        m; taken as the geometric altitude above sea level.
    factors : AtmosphereFactors or None
    """
    heights = np.arange(_BOTTOM, TOP + _SPACING / 2, _SPACING)
    standard = ambiance.Atmosphere(heights)
    density, temperature = standard.density, standard.temperature
    if factors is not None:
        density = density * np.interp(heights, factors.altitude, factors.density)
        temperature = temperature * np.interp(heights, factors.altitude, factors.temperature)
    spline = make_interp_spline(heights, np.log(np.stack([density, temperature], axis=1)), k=3)
    lookup = ca.Function.bspline("air", [spline.t.tolist()], spline.c.ravel().tolist(), [3], 2)
    logarithms = lookup(ca.fmin(ca.fmax(altitude, _BOTTOM), TOP))
    rho, t = ca.exp(logarithms[0]), ca.exp(logarithms[1])
    return Atmosphere(rho, rho * _GAS_CONSTANT * t, ca.sqrt(_HEAT_RATIO * _GAS_CONSTANT * t))
