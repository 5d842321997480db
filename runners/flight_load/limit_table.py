"""Limits of responses as people state them: over time, over stations of the structure, or over both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...model.errors import DataError, DataErrorCollector, TimeRangeError, UnknownNameError, suggestion
from ...model.files.csv_table import CsvTable, read_csv_table, read_rows

TIME, STATION = "time", "station"
ARGUMENTS = {TIME: "s", STATION: "m"}
NO_LIMIT = "{:g} is no limit of a size; give positive numbers"


class LimitError(DataError):
    """A limit cannot be used for what it is asked for."""


@dataclass(frozen=True, eq=False)
class Limits:
    """What the size of responses may not pass.

    Attributes
    ----------
    time : (k,) array or None
        s, increasing; None where the limits hold at all times.
    station : (n,) array or None
        Vehicle stations, m, increasing; None where they are of the responses themselves.
    values : dict of str to (k, n) array
        By response, in its SI unit, positive; k or n is one where there is no time or no station.
    units : dict of str to str
    file : Path or None
        Where they were read.
    """

    time: NDArray[np.float64] | None
    station: NDArray[np.float64] | None
    values: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    file: Path | None = None

    def __post_init__(self):
        for axis, points in ((TIME, self.time), (STATION, self.station)):
            if points is None:
                continue
            increasing = points.ndim == 1 and points.size >= 2 and np.isfinite(points).all()
            if not (increasing and (np.diff(points) > 0).all()):
                raise LimitError(f"a limit over {axis} needs two values of it or more, increasing", file=self.file)
        shape = tuple(1 if points is None else points.size for points in (self.time, self.station))
        if not self.values:
            raise LimitError("holds no limit; add a column such as 'bending_moment [N m]'", file=self.file)
        for name, values in self.values.items():
            if name not in self.units:
                raise LimitError(f"has no unit; give units={{'{name}': ...}}, its SI unit", file=self.file, column=name)
            if values.shape != shape:
                raise LimitError(f"has shape {values.shape}, expected {shape}", file=self.file, column=name)
            wrong = values[_unusable(values)]
            if wrong.size:
                raise LimitError(NO_LIMIT.format(wrong[0]), file=self.file, column=name)

    @staticmethod
    def read(file: str | Path) -> Limits:
        """Read limits from CSV.

        Parameters
        ----------
        file : str or path
            Columns ``time [s]``, ``station [m]`` or both, then one a response with its SI unit, such as
            ``bending_moment [N m]``: the limit of its size. With both, every time has the same stations. Linear
            between rows, refused outside them.

        Returns
        -------
        Limits

        Raises
        ------
        DataError
        """
        file = Path(file)
        rows = read_rows(file)
        if not rows:
            raise LimitError("is empty; begin with a header such as 'time [s],bending_moment [N m]'", file=file)
        header = [cell.partition("[")[0].strip() for cell in rows[0][1]]
        axes = [axis for axis in ARGUMENTS if axis in header]
        if not axes:
            raise LimitError(
                f"has neither a column 'time [s]' nor 'station [m]'{suggestion(header[0], ARGUMENTS)}", file=file
            )
        first = axes[0]
        table = read_csv_table(
            file, first, ARGUMENTS[first], order="increasing" if len(axes) == 1 else "not decreasing"
        )
        names = [name for name in table.columns if name not in ARGUMENTS]
        _refuse_values(table, names)
        points: dict[str, NDArray[np.float64]] = {a: np.unique(table.column(a, ARGUMENTS[a])) for a in axes}
        shape = tuple(points[axis].size if axis in points else 1 for axis in ARGUMENTS)
        if len(axes) == 2:
            _refuse_gaps(table, points)
        return Limits(
            points.get(TIME),
            points.get(STATION),
            {name: table.columns[name].reshape(shape) for name in names},
            {name: table.units[name] for name in names},
            file,
        )

    @staticmethod
    def constant(value: float, response: str, unit: str) -> Limits:
        """Return one limit of one response that holds at all times.

        Parameters
        ----------
        value : float
            In the unit given.
        response, unit : str

        Returns
        -------
        Limits

        Raises
        ------
        LimitError
        """
        return Limits(None, None, {response: _numbers(response, value).reshape(1, 1)}, {response: unit})

    @staticmethod
    def over_time(time: ArrayLike, values: Mapping[str, ArrayLike], units: Mapping[str, str]) -> Limits:
        """Return limits over time.

        Parameters
        ----------
        time : (k,) array_like
            s, increasing.
        values : mapping of str to (k,) array_like
            By response, in the units given.
        units : mapping of str to str
            SI unit by response.

        Returns
        -------
        Limits

        Raises
        ------
        LimitError
        """
        columns = {name: _numbers(name, column).reshape(-1, 1) for name, column in values.items()}
        return Limits(_numbers(TIME, time), None, columns, dict(units))

    def of(self, response: str, unit: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the limit of a response at times and, where they are over stations, at their stations.

        Parameters
        ----------
        response, unit : str
            The response and the SI unit it has.
        times : (m,) array
            s, increasing.

        Returns
        -------
        (m, n) array
            In that unit; n is one without stations.

        Raises
        ------
        UnknownNameError
            There is no limit of the response.
        LimitError
            It is in another unit.
        TimeRangeError
            It ends before the times do.
        """
        if response not in self.values:
            raise UnknownNameError("limit of response", response, self.values)
        if self.units[response] != unit:
            raise LimitError(
                f"unit is [{self.units[response]}], expected [{unit}]; convert the values and the header",
                file=self.file,
                column=response,
            )
        values = self.values[response]
        if self.time is None:
            return np.repeat(values, times.size, axis=0)
        if times[0] < self.time[0] or times[-1] > self.time[-1]:
            where = f"{self.file}: " if self.file else ""
            raise TimeRangeError(
                f"{where}the limit of '{response}' is given from {self.time[0]:g} to {self.time[-1]:g} s and asked for "
                f"from {times[0]:g} to {times[-1]:g} s; add rows or ask for a shorter window"
            )
        return np.stack([np.interp(times, self.time, column) for column in values.T], axis=1)


def limit_table(limits: str | Path | Limits) -> Limits:
    """Return limits from a file or as they are.

    Raises
    ------
    DataError, LimitError
    """
    if isinstance(limits, Limits):
        return limits
    if not isinstance(limits, str | Path):
        raise LimitError(f"{limits!r:.60} is no table of limits; give a file or aw.Limits")
    return Limits.read(limits)


def limits_over_time(
    limit: str | Path | Limits | float, response: str, unit: str, window: tuple[float, float]
) -> Limits:
    """Return the limits of one response from what a person gives: a file, a table, or one number in its SI unit.

    Raises
    ------
    DataError, UnknownNameError, LimitError, TimeRangeError
        They are over stations, or do not hold over the window.
    """
    if isinstance(limit, bool) or not isinstance(limit, str | Path | Limits | Real):
        raise LimitError(f"{limit!r:.60} is no limit; give a file, a table of limits or a number in [{unit}]")
    if isinstance(limit, Real):
        limit = Limits.constant(float(limit), response, unit)
    limit = limit_table(limit)
    if limit.station is not None:
        raise LimitError(
            "is over stations of the structure; ask with Study.limit_passage, which takes them jointly", file=limit.file
        )
    limit.of(response, unit, np.array(window))
    return limit


def _unusable(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    return ~((values > 0) & np.isfinite(values))


def _numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise LimitError(f"{values!r:.60} are no numbers", column=name) from None


def _refuse_values(table: CsvTable, names: list[str]) -> None:
    collector = DataErrorCollector()
    for name in names:
        for k in np.flatnonzero(_unusable(table.columns[name])):
            why = NO_LIMIT.format(table.columns[name][k])
            collector.errors.append(LimitError(why, file=table.file, column=name, row=table.lines[k]))
    collector.raise_all()


def _refuse_gaps(table: CsvTable, points: dict[str, NDArray[np.float64]]) -> None:
    """Raise unless every time has every station, in order."""
    times, stations = points[TIME], points[STATION]
    found = list(zip(table.columns[TIME].tolist(), table.columns[STATION].tolist(), strict=True))
    wanted = [(float(t), float(s)) for t in times for s in stations]
    if found == wanted:
        return
    collector = DataErrorCollector()
    for time, station in sorted(set(wanted) - set(found))[:20]:
        why = f"has no limit for station {station:g} m; every time needs the same stations"
        collector.errors.append(LimitError(why, file=table.file, column=STATION, time=time))
    seen: set[tuple[float, float]] = set()
    for number, pair in enumerate(found):
        if pair in seen:
            why = f"station {pair[1]:g} m stands twice at one time; keep one row"
            collector.errors.append(LimitError(why, file=table.file, row=table.lines[number], time=pair[0]))
        seen.add(pair)
    collector.raise_all()
    raise LimitError("stations are not in increasing order at every time; sort the rows", file=table.file)
