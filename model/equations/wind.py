"""The wind block: a shaping filter over altitude, carried to flight time along the trajectory (Appendix E).

With hdot the rate of climb, z' = hdot F z + sqrt(hdot) G n: white noise of unit intensity in altitude becomes unit
intensity in time with the gain sqrt(hdot), because delta(h - h') = delta(t - t') / hdot.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..system.symbols import TableSymbols
from ..wind.shaping_filter import entry_name
from ..wind.statistics import WindModel
from ..wind.two_components import TwoComponentWind


@dataclass(frozen=True)
class WindBlock:
    """Filter states, their derivative, the white noises and the random parts of its winds (m/s)."""

    states: ca.SX
    derivative: ca.SX
    white: ca.SX
    winds: tuple[ca.SX, ...]


def wind_block(wind: WindModel | TwoComponentWind, tables: TableSymbols, rate: ca.SX, scale: ca.SX) -> WindBlock:
    """Return the filter of one wind, or of two components, in flight time at a rate of climb (m/s).

    ``scale`` multiplies its output.
    """
    shaping_filter = wind.shaping_filter
    n, m = shaping_filter.order, shaping_filter.noise_count
    matrices = {"F": ca.SX(n, n), "G": ca.SX(n, m), "H": ca.SX(1, n)}
    for label, i, j in shaping_filter.entries:
        matrices[label][i, j] = tables[entry_name(label, i, j)]
    z, white = ca.SX.sym("wind", n), ca.SX.sym("white_wind", m)
    derivative = rate * (matrices["F"] @ z) + ca.sqrt(rate) * (matrices["G"] @ white)
    if isinstance(wind, WindModel):
        return WindBlock(z, derivative, white, (scale * (matrices["H"] @ z),))
    H, first = matrices["H"], wind.zonal.shaping_filter.order
    return WindBlock(z, derivative, white, (scale * (H[:, :first] @ z[:first]), scale * (H[:, first:] @ z[first:])))
