"""Where flight is cut: at end times and switches, of which those too close to be told apart are one.

A time that a person computes, such as 0.1 * 1056, need not be the number of the switch at 105.6 that it means; a piece
of flight between the two is no flight, and which side of the switch it lies on is chance. So an end time next to a
switch is the switch, seen from the left, and one next to another end time is that one. Only here is that decided.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.system.linear_system import LinearSystem
from ...model.system.switches import rounding

FORWARD = 1.0  # s, looked ahead where a system has no end
SAME = 1e-9  # of the flight to the last end time: times closer than that are the same
NEAR_START = 1e-6  # of the flight so far, where that is less


@dataclass(frozen=True)
class Interval:
    """Flight times between two discontinuities, and the table limits that keep each side to itself."""

    begin: float
    end: float
    low: float
    high: float


def intervals(
    executable: ExecutableSystem, begin: float, end: float, longest: float = float("inf"), pulses: bool = True
) -> list[Interval]:
    """Split [begin, end] where the system jumps, in order of time: as declared, and as its expressions say.

    On either side of a jump matrices are looked up a few roundings away from it, so that a switch which compiled code
    computes in its own way is seen from the right side; an end that falls on a jump is taken from the left, a begin
    from the right. Intervals longer than ``longest``, s, are divided, and with ``pulses``
    those that hold a smooth pulse.
    """
    stops = executable.stops(end)
    inside, low, high = stops.between(begin, end)
    edges = [begin, *stops.times[inside].tolist(), end]
    lows, highs = [low, *stops.after[inside].tolist()], [*stops.before[inside].tolist(), high]
    sides = zip(pairwise(edges), lows, highs, strict=True)
    narrow = executable.pulses(end) if pulses else np.zeros(0)
    apart = same_time(executable.system, end)
    found = []
    for (a, b), low, high in sides:
        marks = np.linspace(a, b, 1 + max(1, int(np.ceil((b - a) / longest - 1e-9))))
        marks = _with_marks(marks, narrow[(narrow > a) & (narrow < b)], apart).tolist()
        found += [Interval(*part, min(low, b), max(high, a)) for part in pairwise(marks)]
    return found


def _with_marks(edges: NDArray[np.float64], more: NDArray[np.float64], apart: float) -> NDArray[np.float64]:
    """Return edges and those of more times that are further than ``apart`` from each of them, in order."""
    if not more.size:
        return edges
    near = np.abs(more[:, None] - edges[np.clip(np.searchsorted(edges, more)[:, None] - [1, 0], 0, edges.size - 1)])
    return np.sort(np.concatenate([edges, more[near.min(axis=1) > apart]]))


def interval_before(executable: ExecutableSystem, time: float) -> Interval:
    """Return the interval between two jumps that ends at ``time``."""
    return intervals(executable, executable.system.start, time)[-1]


def interval_after(executable: ExecutableSystem, time: float) -> Interval:
    """Return the interval between two jumps that holds ``time`` or begins there."""
    (node,) = time_nodes(executable, [time])
    system, times = executable.system, executable.stops(node + FORWARD).times
    at = int(np.searchsorted(times, node, side="right"))
    begin = max(system.start, float(times[at - 1]) if at else -np.inf)
    end = min(system.end, float(times[at]) if at < times.size else max(node + FORWARD, begin + FORWARD))
    return intervals(executable, begin, end)[0]


def time_nodes(executable: ExecutableSystem, times: ArrayLike) -> NDArray[np.float64]:
    """Return the times at which flight is cut for end times, one for each of them, in increasing order as they are.

    Within 1e-9 of the flight to the last of them an end time is the switch nearest to it; one beyond either end of the
    flight by so little is that end. Within 1e-9 of the flight to itself it is the end time before it: just after the
    start, where everything still grows from rest, times as close as that are not the same. Two can have one node.

    Parameters
    ----------
    executable : ExecutableSystem
    times : (k,) array
        s, increasing.
    """
    system = executable.system
    ends = np.clip(np.asarray(times, float), system.start, system.end)
    reach = same_time(system, ends)
    switches = executable.stops(float(ends.max()) + reach).times
    if _apart(ends, switches, reach, system.start):
        return ends
    nodes: list[float] = []
    for time in ends:
        node = float(time)
        flown = time - system.start
        near = switches[np.abs(switches - time) <= min(reach, NEAR_START * flown)] if switches.size else switches
        if flown <= rounding(time, system.start):
            node = system.start
        elif near.size:
            node = float(near[np.argmin(np.abs(near - time))])
        elif nodes and time - nodes[-1] <= max(SAME * flown, rounding(time, system.start)):
            node = nodes[-1]
        nodes.append(max(node, nodes[-1]) if nodes else node)
    return np.array(nodes)


def _apart(ends: NDArray[np.float64], switches: NDArray[np.float64], reach: float, start: float) -> bool:
    """Return whether end times lie so far from the start, from switches and from each other that none is another."""
    flown = ends - start
    least = np.maximum(SAME * flown, rounding(float(np.abs(ends).max()), start))
    if flown.min() <= least.max() or (np.diff(ends) <= least[1:]).any():
        return False
    return not switches.size or bool(np.abs(switches[:, None] - ends).min() > reach)


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


def beyond(system: LinearSystem, time: float, last: float | None = None) -> float:
    """Return the nearest end time after a switch that is not the switch itself, asked for with others to ``last``."""
    return min(time + 2 * same_time(system, [time if last is None else last]), system.end)


def just_after(system: LinearSystem, time: float, switch: float) -> bool:
    """Return whether an end time is the nearest one after a switch."""
    return 0 < time - switch <= 3 * same_time(system, [time])
