"""The vehicle cut into beam elements, and the mass in each of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....model.construction import Construction
from ....model.construction.tank_shape import TankShape
from .properties import require_known_stores

LONGEST_ELEMENT_SHARE = 1 / 160


def beam_edges(construction: Construction, longest: float | None = None) -> NDArray[np.float64]:
    """Return the ends of beam elements (n + 1,), metres forward of the gimbal plane.

    Gimbal plane, sensors and load stations are ends of elements, except where one is closer than a quarter of an
    element to another: very short elements would spoil the stiffness matrix.

    Parameters
    ----------
    construction : Construction
    longest : float, optional
        Longest element (m); without, 1/160 of the vehicle.
    """
    aft, forward = construction.aft_end, construction.forward_end
    longest = (forward - aft) * LONGEST_ELEMENT_SHARE if longest is None else longest
    knots = [aft, forward]
    for station in (construction.gimbal_station, construction.sensor_station, *construction.load_stations):
        if aft < station < forward and min(abs(station - k) for k in knots) >= longest / 4:
            knots.append(station)
    knots.sort()
    parts = [np.linspace(a, b, math.ceil((b - a) / longest - 1e-9) + 1)[:-1] for a, b in pairwise(knots)]
    return np.concatenate([*parts, [forward]]) - construction.gimbal_station


def mass_line(construction: Construction, edges: ArrayLike, liquid: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """Return the mass in each element (..., n) in kg; the elements together hold the whole vehicle.

    Parameters
    ----------
    construction : Construction
    edges : (n + 1,) array
        Metres forward of the gimbal plane, from the aft to the forward end of the vehicle.
    liquid : mapping
        Tank, grain or dropped item to what is there of it (kg), each a number or of shape (...); what is left out is
        there as at release.

    Raises
    ------
    UnknownNameError
        A tank that the vehicle does not have.
    DataError
        More liquid than the tank holds.
    """
    require_known_stores(construction, liquid)
    station = _stations(construction, edges)
    below = np.zeros(station.size)
    for item in construction.masses:
        below = below + _amount(liquid, item.name, item.mass) * _share_below(item.begin, item.end, station)
    for grain in construction.grains:
        below = below + _amount(liquid, grain.name, grain.propellant) * _share_below(grain.begin, grain.end, station)
    for tank in construction.tanks:
        shape = TankShape.of(tank)
        level = shape.level(np.asarray(liquid.get(tank.name, tank.liquid), dtype=float) / tank.density)
        below = below + tank.density * shape.volume(np.minimum(station, level[..., None]))
    return np.diff(below)


def rotary_line(
    construction: Construction, edges: ArrayLike, liquid: Mapping[str, ArrayLike] | None = None
) -> NDArray[np.float64]:
    """Return the rotary inertia of the sections in each element (..., n), kg m2, about a lateral axis through each.

    A mass of radius of gyration r has mass r^2 / 2; liquid has none (``mass_properties``).

    Parameters
    ----------
    construction : Construction
    edges : (n + 1,) array
        Metres forward of the gimbal plane.
    liquid : mapping, optional
        As of ``mass_line``.
    """
    station, amounts = _stations(construction, edges), liquid or {}
    below = np.zeros(station.size)
    for item in construction.masses:
        mass = _amount(amounts, item.name, item.mass)
        below = below + 0.5 * mass * item.radius**2 * _share_below(item.begin, item.end, station)
    for grain in construction.grains:
        inertia = grain.rotary_inertia(_amount(amounts, grain.name, grain.propellant))
        below = below + inertia * _share_below(grain.begin, grain.end, station)
    return np.diff(below)


def _amount(liquid: Mapping[str, ArrayLike], name: str, at_release: float) -> NDArray[np.float64]:
    return np.asarray(liquid.get(name, at_release), dtype=float)[..., None]


def _stations(construction: Construction, edges: ArrayLike) -> NDArray[np.float64]:
    station = np.asarray(edges, dtype=float) + construction.gimbal_station
    # an edge may differ from the vehicle's end by rounding
    station[0], station[-1] = min(station[0], construction.aft_end), max(station[-1], construction.forward_end)
    return station


def _share_below(begin: float, end: float, station: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of a mass aft of stations; a point mass on an edge belongs to the element forward of it."""
    if end > begin:
        return np.clip((station - begin) / (end - begin), 0.0, 1.0)
    element = min(int(np.searchsorted(station, begin, side="right")) - 1, station.size - 2)
    return (np.arange(station.size) > element).astype(float)
