"""What a wind is of: site, component, month and edition, and how it blows across a vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import DataError

COMPONENTS = ("zonal", "meridional")
BOTH = "both"  # a wind of two components
SMALLEST_SHARE = 0.05  # of a component's speed across the flight path; below, it blows along the path


@dataclass(frozen=True)
class WindOrigin:
    """Which statistics a mean, a standard deviation or a filter comes from.

    Parameters
    ----------
    site : str
    component : {'zonal', 'meridional', 'both'}
        Positive towards the east, towards the north.
    period : str
        A month, 'annual', or the days of the soundings.
    edition : str
        Of the Range Reference Atmosphere, or the file of soundings.
    """

    site: str
    component: str
    period: str
    edition: str

    def __str__(self) -> str:
        return f"{self.period} {self.component}, {self.site}, edition {self.edition}"


@dataclass(frozen=True)
class WindRecord:
    """One wind of a vehicle: its statistics, and which way they are taken across the flight.

    Parameters
    ----------
    origin : WindOrigin
    azimuth : float
        Of the flight, rad from north towards east.
    sign : {1, -1}
        1 when the component's positive direction (east, north) is the vehicle's +Y.
    held_above : float
        m; the statistics end there and their last values are held.
    source : str
    independent_samples : float, optional
        Soundings behind the statistics, reduced for their correlation from day to day, where that is known: what the
        statistics' own sampling error follows from.
    plane : {'yaw', 'pitch'}
        That a single component is taken in.

    Raises
    ------
    DataError
        A component that blows along the flight path, a sign other than 1 and -1, numbers that are not finite, one
        independent sounding or less.
    """

    origin: WindOrigin
    azimuth: float
    sign: int
    held_above: float
    source: str
    independent_samples: float | None = None
    plane: str = "yaw"

    def __post_init__(self):
        if self.sign not in (1, -1):
            raise DataError(f"the sign of a wind is {self.sign!r}; give 1 or -1")
        if not (math.isfinite(self.azimuth) and math.isfinite(self.held_above)):
            raise DataError("azimuth and highest altitude of a wind must be finite numbers")
        samples = self.independent_samples
        if samples is not None and not (samples > 1 and math.isfinite(samples)):
            raise DataError(
                f"a wind of {samples:g} independent soundings has no standard deviation; give a finite number above 1, "
                "or leave independent_samples out"
            )
        if self.share_across < SMALLEST_SHARE:
            other = next(c for c in COMPONENTS if c != self.origin.component)
            along, across = ("along", "across") if self.plane == "yaw" else ("across", "along")
            raise DataError(
                f"the {self.origin.component} wind blows {along} a flight path of azimuth "
                f"{math.degrees(self.azimuth):g} deg, not {across} it; take the {other} one"
            )

    @property
    def share_across(self) -> float:
        """How much of the component's speed is in the plane that it is taken in, 0 to 1; the whole speed is taken."""
        if self.origin.component == BOTH:
            return 1.0
        eastward = math.cos if self.plane == "yaw" else math.sin
        northward = math.sin if self.plane == "yaw" else math.cos
        return abs((eastward if self.origin.component == "zonal" else northward)(self.azimuth))
