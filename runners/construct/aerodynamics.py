"""Normal force along the vehicle: its slope, its centre of pressure and its share of each element over Mach number."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly

from ...model.construction import Construction
from ...model.construction.flight import NormalForceComponent
from ...model.errors import DataError


def normal_force(
    construction: Construction, mach: ArrayLike, time: ArrayLike | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the normal-force slope C_N_alpha (1/rad) and the centre of pressure (m forward of the gimbal plane).

    Parameters
    ----------
    construction : Construction
    mach : (n,) array
    time : (n,) array, optional
        Flight times of the Mach numbers (s), for messages.

    Returns
    -------
    slope, center_of_pressure : (n,) arrays

    Raises
    ------
    DataError
        If a Mach number lies outside a component's table, or if the normal force vanishes.
    """
    slopes = component_slopes(construction, mach, time)
    arms = np.array([construction.forward_of_gimbal(_centroid(component)) for component in construction.normal_force])
    total = slopes.sum(axis=0)
    if (total == 0).any():
        at = int(np.argmax(total == 0))
        raise DataError(
            f"the normal force vanishes at Mach {np.atleast_1d(mach)[at]:g}, so that there is no centre of pressure; "
            "correct the slopes of its components"
        )
    return total, arms @ slopes / total


def local_normal_force(construction: Construction, mach: ArrayLike, edges: ArrayLike) -> NDArray[np.float64]:
    """Return the normal-force slope of each element between ``edges`` (1/rad).

    Parameters
    ----------
    construction : Construction
    mach : (n,) array
    edges : (m + 1,) array
        Increasing, m forward of the gimbal plane.

    Returns
    -------
    (n, m) array
        Sums to C_N_alpha where the edges cover the vehicle.
    """
    edges = np.asarray(edges, float)
    shares = np.array([np.diff(_cumulative(c)(edges + construction.gimbal_station)) for c in construction.normal_force])
    return component_slopes(construction, mach).T @ shares


def intensity(
    construction: Construction, mach: ArrayLike, x: ArrayLike, time: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Return the local normal-force slope c'_N, 1/(rad m), at points ``x`` (m forward of the gimbal plane): (n, m).

    With flight times (n,) of the Mach numbers, parts that are dropped count as long as they are there.
    """
    stations = np.asarray(x, float) + construction.gimbal_station
    shapes = []
    for component in construction.normal_force:
        inside = np.interp(stations, component.station, component.shape, left=0.0, right=0.0)
        shapes.append(inside / np.trapezoid(component.shape, component.station))
    return component_slopes(construction, mach, time).T @ np.array(shapes)


def component_slopes(construction: Construction, mach: ArrayLike, time: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the slope of every component at the Mach numbers, (components, n), 1/rad.

    With flight times, it is zero where a component was dropped.
    """
    mach = np.atleast_1d(np.asarray(mach, float))
    times = None if time is None else np.atleast_1d(np.asarray(time, float))
    if not construction.normal_force:
        raise DataError("the vehicle has no normal force; add [[normal_force]] to its construction")
    for component in construction.normal_force:
        low, high = component.mach[[0, -1]]
        outside = (mach < low) | (mach > high)
        if outside.any():
            at = int(np.argmax(outside))
            raise DataError(
                f"the flight reaches Mach {mach[at]:g}, but normal force '{component.name}' ends at Mach "
                f"{low if mach[at] < low else high:g}; extend its table",
                time=None if times is None else float(times[at]),
            )
    slopes = np.array([np.interp(mach, c.mach, c.slope) for c in construction.normal_force])
    if times is not None:
        for jettison in construction.jettisons:
            gone = [c.name in jettison.normal_force for c in construction.normal_force]
            slopes[np.ix_(np.flatnonzero(gone), np.flatnonzero(times > jettison.time))] = 0.0
    return slopes


def knots(construction: Construction) -> NDArray[np.float64]:
    """Return all points (m forward of the gimbal plane) at which the local normal force may bend or jump."""
    found = np.concatenate([component.station for component in construction.normal_force])
    return np.unique(found) - construction.gimbal_station


def _polynomial(component: NormalForceComponent) -> PPoly:
    x, y = component.station, component.shape / np.trapezoid(component.shape, component.station)
    return PPoly(np.vstack([np.diff(y) / np.diff(x), y[:-1]]), x)


def _cumulative(component: NormalForceComponent):
    """Return the share of the component aft of a station, 0 to 1."""
    integral = _polynomial(component).antiderivative()
    first, last = component.station[[0, -1]]
    return lambda station: integral(np.clip(station, first, last))


def _centroid(component: NormalForceComponent) -> float:
    """Return the station (m) at which the component's force acts."""
    cumulative = _polynomial(component).antiderivative(2)
    first, last = component.station[[0, -1]]
    return float(last - (cumulative(last) - cumulative(first)))
