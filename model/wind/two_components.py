"""Zonal and meridional wind together (report figure 3-1), and the wind in the yaw or pitch plane of a launch.

Both filters keep their own covariance. The meridional filter is driven partly by the noises of the zonal one, so that
the two winds are correlated at equal levels; which correlation of the noises gives a wanted correlation of the winds
depends on both filters and is found in runners/wind/two_component_fit.py.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, UnknownNameError
from ..tables import Table
from .propagation import standard_deviation
from .record import BOTH, COMPONENTS, WindOrigin, WindRecord
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


def wind_correlation(joint: ShapingFilter, states: int, altitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the correlation at equal altitudes (m) of the winds of a filter's first ``states`` and of its others."""
    first, second = joint.H.copy(), joint.H.copy()
    first[:, states:], second[:, :states] = 0.0, 0.0
    total, u, v = (standard_deviation(replace(joint, H=H), altitude) for H in (joint.H, first, second))
    return (total**2 - u**2 - v**2) / (2.0 * u * v)


def _scaled(shaping_filter: ShapingFilter, factor: float) -> ShapingFilter:
    f = shaping_filter
    return ShapingFilter(f.name, f.altitude, f.F, f.G, factor * f.H, f.start_covariance, f.kinks, f.source)


@dataclass(frozen=True, eq=False)
class TwoComponentFilter:
    """Shaping filters of both components and what joins them.

    Parameters
    ----------
    zonal, meridional : ShapingFilter
    noise_correlation : Table
        Correlation of their first noises over altitude (m).
    start_correlation : float
        Of the two winds at the lowest altitude.

    Raises
    ------
    DataError
        Correlations beyond 1 in size, filters of different site, period or edition, or that share no altitudes.
    """

    zonal: ShapingFilter
    meridional: ShapingFilter
    noise_correlation: Table
    start_correlation: float

    def __post_init__(self):
        r = self.noise_correlation.values
        if not (np.abs(r) <= 1).all() or not abs(self.start_correlation) <= 1:
            worst = max([*r, self.start_correlation], key=abs)
            raise DataError(f"a correlation of two winds' noises of {worst:g} is not between -1 and 1")
        _ = self.origin, self.joint

    @cached_property
    def origin(self) -> WindOrigin | None:
        """Of both, where the filters say of what they are."""
        origins = [f.origin for f in (self.zonal, self.meridional)]
        for origin, component in zip(origins, COMPONENTS, strict=True):
            if origin is not None and origin.component != component:
                raise DataError(f"the {component} filter was fitted to {origin}; give each component its own")
        first, second = origins
        if first is None or second is None:
            return None
        if replace(first, component=second.component) != second:
            raise DataError(
                f"the zonal filter was fitted to {first}, the meridional one to {second}; 'ascentwind wind apply "
                "--components both' writes both of one wind"
            )
        return replace(first, component=BOTH)

    @cached_property
    def joint(self) -> ShapingFilter:
        """One filter with the states and noises of both, the zonal ones first; its output is the sum of both winds."""
        made = add_filters(self.zonal, self.meridional, self.noise_correlation, self.start_correlation)
        return replace(made, name="two_components", origin=self.origin)


@dataclass(frozen=True, eq=False)
class TwoComponentWind:
    """The wind of a vehicle that flies in both planes, of the same statistics.

    Parameters
    ----------
    zonal, meridional : WindModel
        Mean, filter and standard deviation of each, positive towards the east and towards the north.
    filters : TwoComponentFilter
    record : WindRecord, optional

    Raises
    ------
    DataError
        Filters of other statistics than the record's.
    """

    zonal: WindModel
    meridional: WindModel
    filters: TwoComponentFilter
    record: WindRecord | None = None

    def __post_init__(self):
        made_for = self.filters.origin
        if self.record is not None and made_for is not None and made_for != self.record.origin:
            raise DataError(
                f"the filters were fitted to {made_for}, but mean and standard deviation are recorded as those of "
                f"{self.record.origin}; 'ascentwind wind apply' writes filter, mean and record of one wind"
            )

    @property
    def shaping_filter(self) -> ShapingFilter:
        """The states and noises of both components, the zonal ones first."""
        return self.filters.joint

    @property
    def components(self) -> dict[str, WindModel]:
        """Both, by name."""
        return dict(zip(COMPONENTS, (self.zonal, self.meridional), strict=True))

    @property
    def means(self) -> tuple[Table, ...]:
        """Mean winds over altitude, in the order of the components."""
        return self.zonal.mean, self.meridional.mean
