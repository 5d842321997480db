"""Switches of a system: the times at which a table or a matrix jumps, and how near two times can tell them apart."""

from __future__ import annotations

import sys
from collections.abc import Iterable

import numpy as np

from ..errors import TimeRangeError

ROUNDINGS = 16  # of a time that expressions, tables and a person each compute in their own order


def rounding(time: float, start: float) -> float:
    """Return how far a time of a flight from ``start`` may be from itself, computed in another way, s."""
    return ROUNDINGS * sys.float_info.epsilon * max(abs(time), abs(start))


def switch_times(times: Iterable[float], start: float) -> tuple[float, ...]:
    """Return switches in order of time, each once; of those within four roundings of each other the first.

    Raises
    ------
    TimeRangeError
        One is not a finite number.
    """
    found: list[float] = []
    try:
        ordered = sorted(float(time) for time in times)
    except (TypeError, ValueError, OverflowError):
        raise TimeRangeError(
            f"{times!r:.80} are not times of discontinuities; give seconds, such as [1.0, 2.5]"
        ) from None
    if not np.isfinite(ordered).all():
        raise TimeRangeError(f"discontinuities at {ordered} s: each must be a finite time in seconds")
    for time in ordered:
        if not found or time - found[-1] > 4 * rounding(time, start):
            found.append(time)
    return tuple(found)
