"""End times written as text: 'start:stop:step' or 'a,b,c' in seconds, or 'peak'."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import Literal

import numpy as np

from ...model.errors import TimeRangeError
from ...model.files.numbers import parse_number
from ...model.vehicle.vehicle import Vehicle

MOST = 100_000
DRAWN = 400  # times of a curve
RINGING, CLOSER = 0.1, 5  # of the flight after a stop, and how many times as close curves are drawn there
AFTER = 1e-6  # of the span: right of a jump


def parse_times(text: str) -> list[float]:
    """Return the times that a text names, the stop included; those of a grid are the decimals that a person would type.

    Raises
    ------
    TimeRangeError
        With the form expected.
    """
    form = "write START:STOP:STEP or T1,T2,... in seconds, such as 40:100:5"
    try:
        if ":" not in text:
            return [parse_number(part) for part in text.split(",")]
        parts = text.split(":")
        start, stop, step = (parse_number(part) for part in parts)
    except ValueError:
        raise TimeRangeError(f"'{text}' does not name times; {form}") from None
    if not all(np.isfinite((start, stop, step))) or step <= 0 or stop < start:
        raise TimeRangeError(
            f"'{text}' names no times: the stop comes before the start or the step is not positive; {form}"
        )
    if (stop - start) / step > MOST:
        raise TimeRangeError(f"'{text}' names more than {MOST} times; take a larger step")
    first, last, by = (Decimal(part.strip()) for part in parts)
    return [float(first + k * by) for k in range(int((last - first) / by) + 1)]


def end_times(times: Iterable[float]) -> list[float]:
    """Return end times in seconds, increasing, each once.

    Raises
    ------
    TimeRangeError
        Something among them is not a number.
    """
    if isinstance(times, str) or not isinstance(times, Iterable):
        raise TimeRangeError(f"{times!r} is not a list of times; give seconds, such as [75.0]")
    return sorted({seconds(t) for t in times})


def seconds(time: float) -> float:
    """Return a time as a float.

    Raises
    ------
    TimeRangeError
    """
    try:
        return float(time)
    except (TypeError, ValueError, OverflowError):
        raise TimeRangeError(f"{time!r} is not a time; give seconds") from None


def spread_over(times: Sequence[float], count: int) -> list[float]:
    """Return at most ``count`` of the times, evenly spread, the first and the last among them."""
    return [times[i] for i in np.unique(np.linspace(0, len(times) - 1, count).round().astype(int))]


def drawn_times(times: Sequence[float], stops: Iterable[float], count: int = DRAWN) -> list[float]:
    """Return times at which curves are drawn: the end times, others between them, and both sides of every stop.

    For a tenth of the flight after a stop, while what it shook still rings, they are five times as close.

    Parameters
    ----------
    times : sequence of float
        End times, s.
    stops : iterable of float
        Where coefficients jump or have a corner, s.
    count : int
        Of times that the curve has at least.
    """
    first, last = times[0], times[-1]
    if last <= first:
        return list(times)
    after = AFTER * (last - first)
    inside = [s for s in stops if first < s < last - after]
    own = np.array(sorted({*times, *(t for s in inside for t in (s, s + after))}))
    between, apart = np.linspace(first, last, count), (last - first) / count
    for s in inside:
        ringing = np.linspace(s, min(s + RINGING * (last - first), last), round(CLOSER * RINGING * count) + 1)
        between = np.concatenate([between[(between < s) | (between > ringing[-1])], ringing])
        apart = (last - first) / (CLOSER * count)
    between = np.unique(between)
    return np.union1d(own, between[np.abs(between[:, None] - own).min(axis=1) > 0.1 * apart]).tolist()


def time_of_greatest_dynamic_pressure(vehicle: Vehicle) -> float:
    """Return the time (s) of the row with the greatest dynamic pressure."""
    table = vehicle.tables["dynamic_pressure"]
    return float(table.argument[int(np.argmax(table.values))])


def parse_time_or_peak(text: str) -> float | Literal["peak"]:
    """Return a time in seconds, or 'peak'.

    Raises
    ------
    TimeRangeError
    """
    if text == "peak":
        return "peak"
    try:
        return parse_number(text)
    except ValueError:
        raise TimeRangeError(f"'{text}' is not a time; give seconds or 'peak'") from None
