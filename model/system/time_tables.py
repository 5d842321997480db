"""Coefficients that are numbers over time: tables of a system, their jumps, and the kinks where integrators stop.

A jump is a time that stands twice, or two rows a few roundings apart, or a declared discontinuity between two rows, to
which the rows on either side are carried on by their own polynomial. A kink is a row of straight lines whose slope
changes, or of steps whose value does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, SystemDefinitionError, UnknownNameError
from ..tables import INTERPOLATIONS, Table, TableGroup
from .switches import ROUNDINGS

EPSILON = float(np.finfo(float).eps)
TOGETHER = 4 * ROUNDINGS * EPSILON  # of the largest time: rows as close as that are the two sides of a jump
APART = 2 * EPSILON  # how far from a jump its rows are kept, so that integrators stop further away than that
CLOSEST = 2e-9  # of the largest time, and of a second: rows that a table tells apart
BENT = 1e-12  # change of slope that is a kink, of the largest slope


@dataclass(frozen=True, eq=False)
class TimeGrid:
    """Times of rows, with what is a jump among them.

    Attributes
    ----------
    rows : (k,) array
        Strictly increasing, s: where a time stood twice, a rounding before and after it.
    jumps : tuple of float
        Times at which coefficients may jump, s.
    """

    rows: NDArray[np.float64]
    jumps: tuple[float, ...]


def real_numbers(what: str, value: Any) -> NDArray[np.float64]:
    """Return an array of finite real numbers.

    Raises
    ------
    SystemDefinitionError
        With the index of the first that is none.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind == "O":
            given = np.array(given.tolist(), dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise SystemDefinitionError(f"{what} is no array of numbers: rows differ in length, or hold text") from None
    if given.dtype.kind == "c":
        raise SystemDefinitionError(f"{what} is complex; give real matrices, of each pair of roots a real block")
    if given.dtype.kind not in "fiu":
        raise SystemDefinitionError(f"{what} holds {given.dtype.name}, not numbers")
    if np.ma.is_masked(value):
        raise SystemDefinitionError(f"{what} has masked entries; give every number")
    found = np.array(given, float)
    if not np.isfinite(found).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(found))[0])
        raise SystemDefinitionError(f"{what}{list(index)} is {found[index]:g}; give finite numbers")
    return found


def time_grid(what: str, times: Any, discontinuities: Sequence[float] = ()) -> TimeGrid:
    """Return the times of rows, and their jumps.

    Raises
    ------
    SystemDefinitionError
        Fewer than two, times that decrease or that are closer than a table tells apart, a discontinuity off them.
    """
    given = real_numbers(what, times)
    if given.ndim != 1 or given.size < 2:
        raise SystemDefinitionError(f"{what} has the shape {given.shape}; give two times or more, in one row")
    largest = float(np.abs(given).max())
    steps = np.diff(given)
    if (steps < 0).any():
        i = int(np.argmax(steps < 0))
        raise SystemDefinitionError(f"{what} decrease from {given[i]:g} to {given[i + 1]:g} at index {i + 1}")
    together = steps <= TOGETHER * largest
    if (together[1:] & together[:-1]).any():
        i = int(np.argmax(together[1:] & together[:-1]))
        raise SystemDefinitionError(f"{what} hold {given[i]:g} three times at index {i}; a jump has two sides")
    near = ~together & (steps < CLOSEST * max(1.0, largest))
    if near.any():
        i = int(np.argmax(near))
        raise SystemDefinitionError(
            f"{what} at index {i} and {i + 1} are {steps[i]:.2g} s apart, closer than a table of {largest:g} s "
            "tells apart"
        )
    if together[0] or together[-1]:
        raise SystemDefinitionError(f"{what} begin or end with a time that stands twice; a jump lies between rows")
    try:
        declared = [float(t) for t in discontinuities]
    except (TypeError, ValueError):
        raise SystemDefinitionError(f"the discontinuities {discontinuities!r:.60} are no times") from None
    for time in declared:
        if not given[0] < time < given[-1]:
            raise SystemDefinitionError(
                f"the discontinuity at {time:g} s is not between the first and the last of {what}, {given[0]:g} and "
                f"{given[-1]:g} s"
            )
    rows, jumps = given.copy(), list(declared)
    for i in np.flatnonzero(together):
        inside = [t for t in declared if given[i] <= t <= given[i + 1]]
        jump = inside[0] if inside else float(0.5 * (given[i] + given[i + 1]))
        jumps += [] if inside else [jump]
        apart = APART * max(abs(jump), abs(float(given[0])))
        rows[i], rows[i + 1] = jump - apart, jump + apart
    return TimeGrid(rows, tuple(sorted(set(jumps))))


def time_table(name: str, unit: str, grid: TimeGrid, values: NDArray[np.float64], interpolation: str) -> Table:
    """Return a table over time.

    Raises
    ------
    SystemDefinitionError, UnknownNameError
    """
    if interpolation not in INTERPOLATIONS:
        raise UnknownNameError("interpolation", str(interpolation), INTERPOLATIONS)
    breaks = () if interpolation == "step" else grid.jumps
    table = Table(name, unit, grid.rows, values, interpolation, breaks)
    try:
        _ = table.polynomial
    except DataError as error:
        raise SystemDefinitionError(str(error)) from None
    return table


def kinks(table: Table, jumps: Sequence[float]) -> set[float]:
    """Return the times (s) within a table at which its value or slope jumps, its declared jumps aside."""
    x, y = table.argument, table.values
    if table.interpolation == "step":
        found = x[1:][np.diff(y) != 0]
    elif table.interpolation == "linear":
        slope = np.diff(y) / np.diff(x)
        inside = np.ones(slope.size, bool)
        for jump in jumps:
            inside &= ~((x[:-1] < jump) & (jump < x[1:]))  # no slope leads across a jump
        largest = float(np.abs(slope[inside]).max(initial=0.0))
        bent = np.abs(np.diff(slope)) > BENT * largest
        found = x[1:-1][bent & inside[1:] & inside[:-1]]
    else:
        return set()
    largest = float(np.abs(x).max())
    return {float(t) for t in found if all(abs(t - jump) > TOGETHER * largest for jump in jumps) and t < x[-1]}


def group_over_time(name: str, tables: Sequence[Table], start: float, end: float) -> tuple[TableGroup, ...]:
    """Return tables over time as a group; none without tables."""
    if not tables:
        return ()
    polynomials = [(t.name, t.unit, t.polynomial) for t in tables]
    return (TableGroup.from_polynomials(name, "time", polynomials, start, end),)
