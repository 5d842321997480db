"""The 1976 standard atmosphere up to 80 km of geopotential altitude, where the ICAO's (Doc 7488, 1993) is the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

LOWEST, HIGHEST = -5_000.0, 81_000.0  # m, geometric: of the tables
GAS_CONSTANT, HEAT_RATIO = 287.05287, 1.4  # J/(kg K), 1
EARTH_RADIUS, GRAVITY = 6_356_766.0, 9.80665  # m, m/s2
_BASE, _TEMPERATURE, _LAPSE, _PRESSURE = np.array(
    [  # geopotential altitude m, temperature K and its rise K/m, pressure Pa, where each layer begins
        (-5_000.0, 320.65, -6.5e-3, 177_687.0),
        (0.0, 288.15, -6.5e-3, 101_325.0),
        (11_000.0, 216.65, 0.0, 22_632.0),
        (20_000.0, 216.65, 1.0e-3, 5_474.87),
        (32_000.0, 228.65, 2.8e-3, 868.014),
        (47_000.0, 270.65, 0.0, 110.906),
        (51_000.0, 270.65, -2.8e-3, 66.9384),
        (71_000.0, 214.65, -2.0e-3, 3.95639),
    ]
).T


def standard_air(altitude: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the density (kg/m3) and temperature (K) of the air at geometric altitudes (m), in any shape.

    The first and last layer go on beyond the tables.
    """
    h = np.asarray(altitude, float)
    geopotential = EARTH_RADIUS * h / (EARTH_RADIUS + h)
    layer = np.clip(np.searchsorted(_BASE, geopotential, side="right") - 1, 0, _BASE.size - 1)
    above, base, lapse = geopotential - _BASE[layer], _TEMPERATURE[layer], _LAPSE[layer]
    temperature, fall = base + lapse * above, -GRAVITY / GAS_CONSTANT
    rise = np.where(lapse == 0, 1.0, lapse)
    share = np.where(lapse == 0, np.exp(fall / temperature * above), (1 + rise / base * above) ** (fall / rise))
    return _PRESSURE[layer] * share / (GAS_CONSTANT * temperature), temperature
