"""Where a flight leaves the altitudes of a wind filter."""

from __future__ import annotations

import warnings

import numpy as np

from ..model.errors import ExtrapolationWarning
from ..model.vehicle import Vehicle
from ..model.wind_filter import ShapingFilter

MARGIN = 50.0  # m: a filter from the lowest level of soundings on need not warn about the launch pad


def warn_beyond(shaping_filter: ShapingFilter, vehicle: Vehicle) -> None:
    """Warn when the trajectory passes altitudes that the filter does not cover; its end values are held there."""
    table = vehicle.tables["altitude"]
    times = np.linspace(vehicle.start, vehicle.end, 500)
    altitude = table.polynomial(times)
    low, high = shaping_filter.altitude[[0, -1]]
    above, below = times[altitude > high + MARGIN], times[altitude < low - MARGIN]
    if not (above.size or below.size):
        return
    parts = []
    if below.size:
        parts.append(f"below {low:g} m until {below[-1]:.0f} s")
    if above.size:
        parts.append(f"above {high:g} m from {above[0]:.0f} s on")
    warnings.warn(
        ExtrapolationWarning(
            f"wind filter '{shaping_filter.name}': the flight is {' and '.join(parts)}; coefficients are "
            "held at their last values, so that the wind goes on with the statistics of that end"
        ),
        stacklevel=3,
    )
