"""The time of the peak, between output times: where the derivative of the quantity with respect to t2 vanishes.

At the peak the derivative of the maximum is the derivative at that time held fixed (envelope theorem).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import root_scalar

from ...model.errors import TimeRangeError
from ..case.times import parse_times, seconds
from ..solvers.time_nodes import beyond
from ..statistics.engines import response_statistics
from ..statistics.larger_side import sign

if TYPE_CHECKING:
    from ..case.case import Case
    from .request import Request

SCAN_POINTS = 40
TIME_TOLERANCE = 1e-6  # of the time between two points of the scan
SECANTS = 8  # four where a quantity is smooth


def peak_time(case: Case, request: Request) -> tuple[float, bool]:
    """Return the time of the largest value of a quantity, of the mean its size, and whether it is an end of the range.

    The range is a vehicle's ``default_times``, or start to end of a system of your own.

    Raises
    ------
    TimeRangeError
        If the system has no end.
    """
    times = searched_times(case)
    scan = response_statistics(case, times, responses=[request.response])
    mean, variance = (scan[name].sel(source=request.source).values[:, 0] for name in ("mean", "variance"))
    values = [request.sought(float(v), float(m)) for v, m in zip(variance, mean, strict=True)]
    best = int(np.argmax(values))
    low, high = times[max(best - 1, 0)], times[min(best + 1, len(times) - 1)]

    @lru_cache
    def quantity(time: float) -> tuple[float, float]:
        pair = request.pair(case, time)
        on_variance, on_mean = request.factors(pair)
        if request.quantity == "mean":
            on_mean *= sign(pair.mean)
        variance, mean = pair.slopes
        return request.sought(pair.variance, pair.mean), on_variance * variance + on_mean * mean

    switches = case.executable.stops(high).times.tolist()
    if low < times[best] < high and not any(low <= d <= high for d in switches):
        found = _from_parabola(quantity, times[best - 1 : best + 2], values[best - 1 : best + 2])
        if found is not None:
            return found, False
    candidates = [times[best]]
    edges = [low, *(d for d in switches if low < d < high), high]
    for a, b in pairwise(edges):
        if a in switches:  # the value may jump up there
            a = beyond(case.system, a)
            candidates.append(a)
        if b in switches:
            candidates.append(b)
        if quantity(a)[1] > 0 > quantity(b)[1]:
            candidates.append(
                float(root_scalar(lambda t: quantity(t)[1], bracket=(a, b), xtol=TIME_TOLERANCE * (b - a)).root)
            )
    found = max(candidates, key=lambda t: quantity(t)[0])
    return found, found in (times[0], times[-1])


def _from_parabola(
    quantity: Callable[[float], tuple[float, float]], times: Sequence[float], values: Sequence[float]
) -> float | None:
    """Return where the slope of a quantity vanishes, by secants from the parabola through three values about its peak.

    None where that is no maximum, leaves the interval, or is below the value in the middle.
    """
    (a, middle, b), (first, second, third) = times, values
    before, after = (second - first) / (middle - a), (third - second) / (b - middle)
    curvature = 2 * (after - before) / (b - a)
    time = 0.5 * (a + middle - 2 * before / curvature) if curvature < 0 else middle
    value, slope = quantity(time)
    for _ in range(SECANTS):
        if not curvature < 0:
            return None
        new = time - slope / curvature
        if not a < new < b:
            return None
        if abs(new - time) <= TIME_TOLERANCE * (b - a):
            return new if value >= second else None
        value, its = quantity(new)
        curvature = (its - slope) / (new - time)
        time, slope = new, its
    return None


def searched_times(case: Case) -> list[float]:
    """Return the end times among which a peak is looked for: default times, or the flight, both sides of each switch.

    Raises
    ------
    TimeRangeError
    """
    return _with_sides(case, _range(case))


def _with_sides(case: Case, times: list[float]) -> list[float]:
    """Return times and, between them, the right side of each switch: what jumps up there may fall before the next."""
    switches = case.executable.stops(times[-1]).times
    sides = [
        beyond(case.system, float(d), times[-1]) for d in switches[(switches >= times[0]) & (switches < times[-1])]
    ]
    return sorted({*times, *sides})


def _range(case: Case) -> list[float]:
    start, end = case.system.start, case.system.end
    if case.vehicle is not None:
        return [t for t in parse_times(case.vehicle.file.default_times) if start < t <= end]
    if not np.isfinite(end):
        raise TimeRangeError(f"system '{case.system.name}' has no end to search for a peak; give a time in seconds")
    return np.linspace(start, end, SCAN_POINTS + 1)[1:].tolist()


def end_time(case: Case, request: Request, time: float | str) -> tuple[float, bool]:
    """Return an end time, s, that of the peak for 'peak', and whether that is an end of the range searched.

    Raises
    ------
    TimeRangeError
    """
    if isinstance(time, str):
        if time != "peak":
            raise TimeRangeError(f"'{time}' is not a time; give seconds or 'peak'")
        time, at_limit = peak_time(case, request)
    else:
        time, at_limit = seconds(time), False
    case.checked_times([time])
    check_end_time(case, time)
    return time, at_limit


def check_end_time(case: Case, time: float) -> None:
    """Refuse the start of a system.

    Raises
    ------
    TimeRangeError
    """
    if time <= case.system.start:
        raise TimeRangeError(f"at its start, {time:g} s, a system has no history to differentiate; choose a later time")
