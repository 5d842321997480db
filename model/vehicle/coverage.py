"""Whether tables cover the part of a flight that loads it: where the dynamic pressure exceeds a tenth of its peak."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, ExtrapolationWarning, WindWarning
from ..tables import Table
from ..wind.propagation import standard_deviation
from ..wind.record import WindRecord
from ..wind.statistics import LARGEST_ALTITUDE, LARGEST_DEVIATION, WindModel
from ..wind.two_components import TwoComponentFilter, TwoComponentWind, wind_correlation

SHARE = 0.1  # of the peak dynamic pressure
POINTS = 500
EVERY = 8  # of the points a standard deviation is compared
MARGIN = 50.0  # m: statistics from the surface on need not begin at the launch pad
LARGEST_DIFFERENCE = 0.1  # of the filter's own standard deviation from the table's, before it is told
LARGEST_FACTOR = 2.0  # between both, before it is refused
APART, LARGEST_APART = 0.15, 0.5  # of the correlations of two winds: filter and table, before it is told, or refused


@dataclass(frozen=True, eq=False)
class LoadedFlight:
    """The times (k,) in s and altitudes (k,) in m passed, and where the flight is loaded (k,)."""

    time: NDArray[np.float64]
    altitude: NDArray[np.float64]
    loaded: NDArray[np.bool_]


def loaded_flight(tables: dict[str, Table], start: float, end: float) -> LoadedFlight:
    """Return where a flight from ``start`` to ``end`` (s) has more than a tenth of its peak dynamic pressure."""
    time = np.linspace(start, end, POINTS)
    pressure = tables["dynamic_pressure"].polynomial(time)
    return LoadedFlight(time, tables["altitude"].polynomial(time), pressure > SHARE * pressure.max())


def check_schedule(name: str, table: Table, flight: LoadedFlight, file: Path) -> None:
    """Refuse a schedule over time that lies beside the loaded flight; warn of one that is held there.

    Raises
    ------
    DataError

    Warns
    -----
    ExtrapolationWarning
    """
    times = flight.time[flight.loaded]
    first, last = float(table.argument[0]), float(table.argument[-1])
    ends = np.inf if table.interpolation == "step" else last  # the last row of a step holds from there on
    if first > times[-1] or ends < times[0]:
        raise DataError(
            f"covers {first:g} to {last:g} s, but the flight is loaded from {times[0]:.0f} to {times[-1]:.0f} s, and "
            "one value would be held all that time; give rows there",
            file=file,
            column="time",
        )
    parts = []
    if first > times[0]:
        parts.append(f"before its first row at {first:g} s from {times[0]:.0f} s on")
    if ends < times[-1]:
        parts.append(f"after its last row at {last:g} s until {times[-1]:.0f} s")
    if parts:
        warnings.warn(
            ExtrapolationWarning(
                f"{file}: the flight is loaded {' and '.join(parts)}, and {name} is held there; give rows for it"
            ),
            stacklevel=3,
        )


def check_winds(wind: WindModel | TwoComponentWind, flight: LoadedFlight) -> None:
    """Hold a wind of one or two components against the flight through it; see :func:`check_wind`."""
    if isinstance(wind, WindModel):
        check_wind(wind, flight)
        return
    for part in wind.components.values():
        check_wind(replace(part, shaping_filter=replace(part.shaping_filter, origin=None), record=wind.record), flight)


def check_joint_correlation(
    filters: TwoComponentFilter, altitude: NDArray[np.float64], stated: NDArray[np.float64]
) -> None:
    """Hold the correlation that two filters give their winds at equal altitudes (m) against the table's.

    Raises
    ------
    DataError
        A correlation beyond 1, or further from the filters' than ``LARGEST_APART``.

    Warns
    -----
    WindWarning
        Further than ``APART``.
    """
    if not (np.abs(stated) <= 1).all():
        i = int(np.argmax(np.abs(stated)))
        raise DataError(f"the table's correlation of the two winds at {altitude[i]:g} m is {stated[i]:g}, beyond 1")
    inside = (altitude >= filters.joint.altitude[0]) & (altitude <= filters.joint.altitude[-1])
    h, stated = altitude[inside], stated[inside]
    own = wind_correlation(filters.joint, filters.zonal.order, h)
    i = int(np.argmax(np.abs(own - stated)))
    why = (
        f"the filters' winds have a correlation of {own[i]:.3g} at {h[i]:g} m, the table says {stated[i]:.3g}; "
        "'ascentwind wind apply --components both' writes both of one wind"
    )
    if abs(own[i] - stated[i]) > LARGEST_APART:
        raise DataError(why)
    if abs(own[i] - stated[i]) > APART:
        warnings.warn(WindWarning(why), stacklevel=3)


def check_wind(wind: WindModel, flight: LoadedFlight) -> None:
    """Hold a wind against the flight through it, and its filter against its standard deviation.

    Raises
    ------
    DataError
        A mean or filter beside the loaded flight; a standard deviation of the filter that no wind has, or more than a
        factor of two from the table's.

    Warns
    -----
    ExtrapolationWarning
        The loaded flight leaves the altitudes of the mean or the filter, beyond what the wind's record declares.
    """
    altitudes = {
        "the mean wind": wind.mean.argument,
        f"wind filter '{wind.shaping_filter.name}'": wind.shaping_filter.altitude,
    }
    _warn_of_ends(altitudes, flight, wind.record)
    _check_deviation(wind, flight)


def check_intensity(intensity: Table, flight: LoadedFlight) -> None:
    """Hold a table of turbulence's intensity against the flight through it.

    Raises
    ------
    DataError
        It lies beside the loaded flight.

    Warns
    -----
    ExtrapolationWarning
        The loaded flight leaves its altitudes.
    """
    _warn_of_ends({"the turbulence's intensity": intensity.argument}, flight, None)


def _warn_of_ends(
    altitudes: Mapping[str, NDArray[np.float64]], flight: LoadedFlight, record: WindRecord | None
) -> None:
    told: dict[str, list[str]] = {}
    for name, altitude in altitudes.items():
        beyond = _beyond(name, float(altitude[0]), float(altitude[-1]), flight, record)
        if beyond:
            told.setdefault(beyond, []).append(name)
    for beyond, names in told.items():
        warnings.warn(
            ExtrapolationWarning(
                f"{' and '.join(names)}: the flight is {beyond}; values are held at the last ones there, so that the "
                "wind goes on with the statistics of that end"
            ),
            stacklevel=4,
        )


def _beyond(name: str, low: float, high: float, flight: LoadedFlight, record: WindRecord | None) -> str:
    """Return where the loaded flight leaves the altitudes, in words; nothing where the record declares it."""
    if high > LARGEST_ALTITUDE:
        raise DataError(f"{name} goes up to {high:g} m; are these feet or millimetres? Convert them to metres")
    time, altitude = flight.time[flight.loaded], flight.altitude[flight.loaded]
    if high < altitude[0] or low > altitude[-1]:
        cure = "are these kilometres? Convert them to metres" if 1e3 * high <= LARGEST_ALTITUDE else "give levels there"
        raise DataError(
            f"{name} covers {low:g} to {high:g} m, but the flight is loaded from {altitude[0]:.0f} to "
            f"{altitude[-1]:.0f} m, and one value would be held all that way; {cure}"
        )
    parts = []
    if altitude[0] < low - MARGIN:
        parts.append(f"below {low:g} m until {time[altitude < low - MARGIN][-1]:.0f} s")
    declared = record is not None and high >= record.held_above
    if altitude[-1] > high + MARGIN and not declared:
        parts.append(f"above {high:g} m from {time[altitude > high + MARGIN][0]:.0f} s on")
    return " and ".join(parts)


def _check_deviation(wind: WindModel, flight: LoadedFlight) -> None:
    name, table = wind.shaping_filter.name, wind.standard_deviation
    if table is None:
        h = flight.altitude[flight.loaded][::EVERY]
        own = standard_deviation(wind.shaping_filter, h)
        i = int(np.argmax(own))
        if not 0 < own[i] <= LARGEST_DEVIATION:
            raise DataError(
                f"wind filter '{name}' has a standard deviation of {own[i]:.3g} m/s at {h[i]:.0f} m, which no wind "
                "has; its H must be in m/s by unit of the state"
            )
        return
    inside = (flight.altitude >= table.argument[0]) & (flight.altitude <= table.argument[-1])
    h, loaded = flight.altitude[inside][::EVERY], flight.loaded[inside][::EVERY]
    own, stated = standard_deviation(wind.shaping_filter, h), table.polynomial(h)
    apart = np.abs(np.log(np.maximum(own, 1e-300) / stated))
    for where, limit in ((loaded, np.log(LARGEST_FACTOR)), (np.ones_like(loaded), np.log1p(LARGEST_DIFFERENCE))):
        i = int(np.argmax(np.where(where, apart, 0.0)))
        if apart[i] <= limit or not where[i]:
            continue
        why = (
            f"wind filter '{name}' has a standard deviation of {own[i]:.3g} m/s at {h[i]:.0f} m, the table of the "
            f"wind's statistics {stated[i]:.3g} m/s: two winds, or two units. 'ascentwind wind apply' writes filter, "
            "mean and standard deviation of one wind"
        )
        if where is loaded:
            raise DataError(why)
        warnings.warn(WindWarning(why), stacklevel=3)
