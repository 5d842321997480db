"""Radiosondes of the Integrated Global Radiosonde Archive, version 2 (NCEI), as text or as the zip that it comes in."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator
from itertools import takewhile
from pathlib import Path

from .quality import Quality
from .raw_levels import NAN, RawLevels
from .sounding import SoundingError

MISSING, REMOVED = -9999, -8888
NO_HOUR = 99

Wanted = Callable[[datetime.datetime | None], str]  # why a sounding is passed over; empty: it is wanted


def is_igra(first_line: str) -> bool:
    """Return whether a text begins with the header record of a sounding."""
    return first_line.startswith("#") and len(first_line) >= 36 and first_line[13:17].strip().isdigit()


def read_igra(file: Path, lines: list[str], wanted: Wanted, quality: Quality) -> Iterator[RawLevels]:
    """Return the soundings of a file, by columns as igra2-data-format.txt of NCEI has them.

    A value that the archive removed (-8888) is as missing as one never there (-9999), and counted by itself. The flags
    A and B say how a value was checked, not that it is wrong.

    Raises
    ------
    SoundingError
        A record that is none. A sounding with fewer levels than its header announces is left out, and said.
    """
    at = 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        head, row = lines[at], at + 1
        if not is_igra(head):
            raise SoundingError("is no header record, where one is expected: '#', station, date", file=file, row=row)
        count = _whole(head, 33, 36, file, row, "number of levels")
        time, stated = _time(head, file, row)
        station = head[1:12].strip()
        name = f"{station} {time:%Y-%m-%d}{f' {time:%H} UTC' if stated else ''}"
        body = list(takewhile(lambda line: line.strip() and not line.startswith("#"), lines[at + 1 : at + 1 + count]))
        at += 1 + len(body)
        quality.read += 1
        if why := wanted(time):
            quality.selected[why] += 1
            continue
        if len(body) < count:
            why = f"its header announces {count} levels and {len(body)} follow; the file is cut off or was edited"
            quality.dropped.append((name, why))
            continue
        raw = RawLevels(file, name, station, time, stated, in_order=False)
        for k, line in enumerate(body, start=row + 1):
            values = [
                _whole(line, first, last, file, k, what)
                for first, last, what in (
                    (10, 15, "pressure"), (17, 21, "height"), (23, 27, "temperature"),
                    (41, 45, "wind direction"), (47, 51, "wind speed"),
                )
            ]  # fmt: skip
            pressure, height, temperature, direction, speed = (
                NAN if value in (MISSING, REMOVED) else float(value) for value in values
            )
            raw.removed += REMOVED in values[3:]
            raw.add(k, pressure, height, 0.1 * temperature, 0.1 * speed, direction)
        yield raw


def _whole(line: str, first: int, last: int, file: Path, row: int, what: str) -> int:
    cell = line[first - 1 : last]
    try:
        return int(cell)
    except ValueError:
        raise SoundingError(
            f"'{cell.strip():.12}' in columns {first} to {last} is no {what}; the record is not of IGRA version 2",
            file=file, row=row,
        ) from None  # fmt: skip


def _time(head: str, file: Path, row: int) -> tuple[datetime.datetime, bool]:
    year, month, day, hour = (
        _whole(head, first, last, file, row, what)
        for first, last, what in ((14, 17, "year"), (19, 20, "month"), (22, 23, "day"), (25, 26, "hour"))
    )
    try:
        return datetime.datetime(year, month, day, 0 if hour == NO_HOUR else hour), hour != NO_HOUR
    except ValueError as error:
        raise SoundingError(f"its date is none ({error})", file=file, row=row) from None
