"""Where flight is cut: at end times and switches, of which those too close to be told apart are one.

A time that a person computes, such as 0.1 * 1056, need not be the number of the switch at 105.6 that it means; a piece
of flight between the two is no flight, and which side of the switch it lies on is chance. So an end time next to a
switch is the switch, seen from the left, and one next to another end time is that one. Only here is that decided.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..model.switches import rounding
from ..model.system import LinearSystem

SAME = 1e-9  # of the flight to the last end time: times closer than that are the same


@dataclass(frozen=True)
class Interval:
    """Flight times between two discontinuities, and the table limits that keep each side to itself."""

    begin: float
    end: float
    low: float
    high: float


def intervals(system: LinearSystem, begin: float, end: float) -> list[Interval]:
    """Split [begin, end] at the system's discontinuities, in order of time.

    On either side of a discontinuity matrices are looked up a few roundings away from it, so that a switch which the
    equations compute in their own way is seen from the right side; an end that falls on a discontinuity is taken from
    the left, a begin from the right.
    """
    edges = [begin, *(d for d in system.discontinuities if begin < d < end), end]
    if len(edges) > 2 and _switch_at(system, begin) == edges[1]:
        del edges[1]
    if len(edges) > 2 and _switch_at(system, end) == edges[-2]:
        del edges[-2]
    found = []
    for a, b in pairwise(edges):
        after, before = _switch_at(system, a), _switch_at(system, b)
        low = a if after is None else after + rounding(after, system.start)
        high = b if before is None else before - rounding(before, system.start)
        found.append(Interval(a, b, min(low, b), max(high, a)))
    return found


def interval_before(system: LinearSystem, time: float) -> Interval:
    """Return the interval between two discontinuities that ends at ``time``."""
    return intervals(system, system.start, time)[-1]


def interval_after(system: LinearSystem, time: float) -> Interval:
    """Return the interval between two discontinuities that holds ``time`` or begins there."""
    (node,) = time_nodes(system, [time])
    at = bisect_right(system.discontinuities, node)
    begin = max(system.start, *system.discontinuities[max(at - 1, 0) : at], -np.inf)
    end = min(system.end, *system.discontinuities[at : at + 1], np.inf)
    return intervals(system, begin, end)[0]


def time_nodes(system: LinearSystem, times: ArrayLike) -> NDArray[np.float64]:
    """Return the times at which flight is cut for end times, one for each of them, in increasing order as they are.

    Within 1e-9 of the flight to the last of them an end time is the switch nearest to it, or else the end time before
    it; one beyond either end of the flight by so little is that end. Two end times can have the same node.

    Parameters
    ----------
    system : LinearSystem
    times : (k,) array
        s, increasing.
    """
    ends = np.clip(np.asarray(times, float), system.start, system.end)
    reach = same_time(system, ends)
    switches = np.array(system.discontinuities)
    nodes: list[float] = []
    for time in ends:
        node = float(time)
        near = switches[np.abs(switches - time) <= reach] if switches.size else switches
        if time - system.start <= rounding(time, system.start):
            node = system.start
        elif near.size:
            node = float(near[np.argmin(np.abs(near - time))])
        elif nodes and nodes[-1] > system.start and time - nodes[-1] <= reach:
            node = nodes[-1]
        nodes.append(max(node, nodes[-1]) if nodes else node)
    return np.array(nodes)


def on_flight(system: LinearSystem, times: ArrayLike) -> NDArray[np.bool_]:
    """Return which end times lie between the start and the end of a system, a rounding beyond either included."""
    ends = np.asarray(times, float)
    if not np.isfinite(ends).all():
        return np.isfinite(ends)
    reach = same_time(system, ends)
    return (ends >= system.start - reach) & (ends <= system.end + reach)


def same_time(system: LinearSystem, times: ArrayLike) -> float:
    """Return the distance within which end times are the same, s: 1e-9 of the flight to the last of them."""
    last = float(np.max(times))
    return max(SAME * (last - system.start), 4 * rounding(last, system.start))


def beyond(system: LinearSystem, time: float) -> float:
    """Return the nearest end time after a switch that is not the switch itself, s."""
    return min(time + 2 * same_time(system, [time]), system.end)


def _switch_at(system: LinearSystem, time: float) -> float | None:
    """Return the switch that a time is, to rounding."""
    switches = system.discontinuities
    at = bisect_left(switches, time)
    near = [d for d in switches[max(at - 1, 0) : at + 1] if abs(d - time) <= 4 * rounding(d, system.start)]
    return min(near, key=lambda d: abs(d - time), default=None)
