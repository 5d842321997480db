"""Zonal and meridional wind together (report figure 3-1), and the wind in the yaw or pitch plane of a launch.

Both filters keep their own covariance. The meridional filter is driven partly by the noises of the zonal one, so that
the two winds are correlated at equal levels; which correlation of the noises gives a wanted correlation of the winds
depends on both filters and is found in runners/wind/two_component_fit.py.
"""

from __future__ import annotations

import numpy as np

from ..errors import DataError, UnknownNameError
from ..tables import Table
from .shaping_filter import ShapingFilter
from .statistics import WindModel
from .turbulence import add_filters

PLANES = ("yaw", "pitch")


def plane_weights(azimuth: float, plane: str) -> tuple[float, float]:
    """Return the weights of u (east) and v (north) for a launch azimuth in rad from north towards east.

    In the pitch plane, positive downrange: u sin Az + v cos Az. In the yaw plane, positive to the right seen downrange:
    u cos Az - v sin Az.
    """
    if plane not in PLANES:
        raise UnknownNameError("plane", plane, PLANES)
    if not -2 * np.pi <= azimuth <= 2 * np.pi:
        raise DataError(
            f"an azimuth of {azimuth:g} rad is more than a full turn; are these degrees? Convert them to rad"
        )
    s, c = np.sin(azimuth), np.cos(azimuth)
    return (float(s), float(c)) if plane == "pitch" else (float(c), float(-s))


def wind_in_plane(
    zonal: WindModel,
    meridional: WindModel,
    azimuth: float,
    plane: str = "yaw",
    noise_correlation: Table | None = None,
    start_correlation: float = 0.0,
) -> WindModel:
    """Return the wind in a plane of the launch from its two components.

    Parameters
    ----------
    zonal, meridional : WindModel
    azimuth : float
        rad.
    plane : {'yaw', 'pitch'}
    noise_correlation : Table, optional
        Correlation of the filters' first noises over altitude, m; independent components without it.
    start_correlation : float
        Of u and v at the lowest altitude.
    """
    weights = plane_weights(azimuth, plane)
    parts = [_scaled(w.shaping_filter, x) for w, x in zip((zonal, meridional), weights, strict=True)]
    # a negative weight turns the sign of a component, and of its correlation with the other
    start = start_correlation * float(np.sign(weights[0] * weights[1]))
    total = add_filters(parts[0], parts[1], noise_correlation, start)
    h = np.union1d(zonal.mean.argument, meridional.mean.argument)
    h = h[
        (h >= max(t.mean.argument[0] for t in (zonal, meridional)))
        & (h <= min(t.mean.argument[-1] for t in (zonal, meridional)))
    ]
    values = weights[0] * zonal.mean.polynomial(h) + weights[1] * meridional.mean.polynomial(h)
    return WindModel(Table("wind.mean", "m/s", h, values, "pchip"), total)


def _scaled(shaping_filter: ShapingFilter, factor: float) -> ShapingFilter:
    f = shaping_filter
    return ShapingFilter(f.name, f.altitude, f.F, f.G, factor * f.H, f.start_covariance, f.kinks, f.source)
