"""Which winds a vehicle meets: one component across its flight, or both where it flies in both planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataError, UnknownNameError
from ...model.vehicle.planes import one_wind
from ...model.wind.record import COMPONENTS
from ...model.wind.soundings.collection import Soundings
from ...model.wind.soundings.sounding import Sounding
from ...model.wind.two_components import TwoComponentWind
from ..case.case import Case


@dataclass(frozen=True)
class MetWinds:
    """The winds of a sounding that a vehicle meets.

    Attributes
    ----------
    components : tuple of {'zonal', 'meridional'}
        One, or both in this order.
    sign : {1, -1}
        1 where their positive direction is the vehicle's: +Y of one plane, east and north of both.
    """

    components: tuple[str, ...]
    sign: int

    @property
    def both(self) -> bool:
        """Whether the vehicle flies in both planes."""
        return len(self.components) > 1

    def of(self, soundings: Sounding | Soundings) -> tuple[NDArray[np.float64], ...]:
        """Return the winds of each component as the vehicle meets them, over altitude, m/s."""
        by_name: dict[str, NDArray[np.float64]] = dict(zip(COMPONENTS, (soundings.u, soundings.v), strict=True))
        return tuple(self.sign * by_name[name] for name in self.components)


def met_winds(case: Case, component: str | None, sign: int) -> MetWinds:
    """Return the winds that a case's vehicle meets; of one plane the component that a person gives, or the record's.

    Raises
    ------
    DataError
        The record does not say the component; a vehicle in both planes is given one.
    UnknownNameError
    """
    vehicle = case.vehicle_for("a measured wind")
    if isinstance(vehicle.wind, TwoComponentWind):
        if component is not None or sign != 1:
            raise DataError(
                f"'{vehicle.name}' flies in both planes and meets both components; leave component and sign out"
            )
        return MetWinds(COMPONENTS, 1)
    record = one_wind(vehicle, "a measured wind").record
    if component is None:
        if record is None:
            raise DataError(
                "does not say which component of the wind blows across the flight; add [wind.record], or give "
                "component= ('zonal' or 'meridional')", file=vehicle.folder / "vehicle.toml", column="wind.record",
            )  # fmt: skip
        return MetWinds((record.origin.component,), record.sign)
    if component not in COMPONENTS:
        raise UnknownNameError("wind component", component, COMPONENTS)
    if sign not in (1, -1):
        raise DataError(f"the sign of a wind is {sign!r}; give 1 or -1")
    return MetWinds((component,), sign)
