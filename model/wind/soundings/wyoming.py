"""Soundings of the University of Wyoming: its CSV, and the older list of text with a header of names and units."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterator
from pathlib import Path

from ...files.numbers import parse_number
from .igra import Wanted
from .quality import Quality
from .raw_levels import NAN, RawLevels
from .sounding import SPEEDS, SoundingError

CSV_START = "time,longitude,latitude,pressure_hPa,"
SAME_SOUNDING = datetime.timedelta(hours=4)  # an ascent takes two
SPEED, DIRECTION, HEIGHT = "wind speed", "wind direction_degree", "geopotential height_m"
TITLE = re.compile(r"^(?P<station>.*\S)\s+Observations at (?P<hour>\d\d)Z (?P<date>\d\d \w{3} \d{4})\s*$")
WIDTH = 7  # characters of a column of the list
LIST_SPEEDS = {("SKNT", "knot"): "kt", ("SPED", "m/s"): "m/s", ("SMPS", "m/s"): "m/s"}


def read_wyoming_csv(file: Path, lines: list[str], wanted: Wanted, quality: Quality) -> Iterator[RawLevels]:
    """Return the soundings of a CSV file: one, or several after each other.

    Raises
    ------
    SoundingError
    """
    header = [cell.strip() for cell in lines[0].split(",")]
    speed = next((name for name in header if name.startswith(f"{SPEED}_")), None)
    unit = "" if speed is None else speed.removeprefix(f"{SPEED}_")
    for name in ("time", "pressure_hPa", HEIGHT, "temperature_C", DIRECTION):
        if name not in header:
            raise SoundingError(f"column '{name}' is missing", file=file, row=1)
    if speed is None or unit not in SPEEDS:
        raise SoundingError(
            f"column '{SPEED}' is missing, or its unit is none of {', '.join(SPEEDS)}", file=file, row=1
        )
    names = ("pressure_hPa", HEIGHT, "temperature_C", speed, DIRECTION)
    raw, begun = None, None
    for row, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        cells = [cell.strip() for cell in line.split(",")]
        if len(cells) != len(header):
            raise SoundingError(f"has {len(cells)} cells where the header has {len(header)}", file=file, row=row)
        values = dict(zip(header, cells, strict=True))
        try:
            time = datetime.datetime.fromisoformat(values["time"])
        except ValueError:
            raise SoundingError(
                f"'{values['time']:.30}' is no time; write 2010-12-09 11:06:00", file=file, row=row
            ) from None
        if raw is None or begun is None or abs(time - begun) > SAME_SOUNDING:
            if raw is not None:
                yield from _wanted(raw, wanted, quality)
            begun = time
            station = f"{values.get('latitude', '?')} {values.get('longitude', '?')}"
            raw = RawLevels(file, f"{file.stem} {time:%Y-%m-%d %H:%M}", station, time)
        p, h, t, s, d = (_number(values[name], name, file, row) for name in names)
        raw.add(row, p, h, t, s * SPEEDS[unit], d)
    if raw is not None:
        yield from _wanted(raw, wanted, quality)


def read_wyoming_list(file: Path, lines: list[str], wanted: Wanted, quality: Quality) -> Iterator[RawLevels]:
    """Return the soundings of a text list, made to its description: columns of seven characters, blanks are missing.

    Raises
    ------
    SoundingError
    """
    raw, columns, unit, row = None, [], "", 0
    while row < len(lines):
        line = re.sub(r"<[^>]*>", "", lines[row])
        row += 1
        if title := TITLE.match(line):
            if raw is not None:
                yield from _wanted(raw, wanted, quality)
            try:
                time = datetime.datetime.strptime(f"{title['hour']} {title['date']}", "%H %d %b %Y")
            except ValueError:
                raise SoundingError(f"'{line.strip():.60}' holds no date", file=file, row=row) from None
            station = title["station"].split()[0]
            raw, columns = RawLevels(file, f"{station} {time:%Y-%m-%d %H} UTC", station, time), []
        elif "PRES" in line and "HGHT" in line:
            columns = line.split()
            units = re.sub(r"<[^>]*>", "", lines[row]).split() if row < len(lines) else []
            row += 1
            unit = next((u for pair, u in LIST_SPEEDS.items() if pair in zip(columns, units, strict=False)), "")
            if not unit or "DRCT" not in columns:
                raise SoundingError(
                    f"has no wind in units that are known: 'DRCT deg' and {' or '.join(map(' '.join, LIST_SPEEDS))}",
                    file=file, row=row - 1,
                )  # fmt: skip
        elif columns and not line.strip().strip("-"):
            if not line.strip() or (raw is not None and raw.line):
                columns = columns if raw is None or not raw.line else []
        elif columns:
            if raw is None:
                raise SoundingError(
                    "has levels before a title with 'Observations at 12Z 09 Dec 2010'", file=file, row=row
                )
            cells = dict(zip(columns, (line[WIDTH * k : WIDTH * (k + 1)] for k in range(len(columns))), strict=True))
            speed = next(name for name, _ in LIST_SPEEDS if name in cells)
            p, h, t, d, s = (_number(cells.get(n, ""), n, file, row) for n in ("PRES", "HGHT", "TEMP", "DRCT", speed))
            raw.add(row, p, h, t, s * SPEEDS[unit], d)
    if raw is not None:
        yield from _wanted(raw, wanted, quality)


def _wanted(raw: RawLevels, wanted: Wanted, quality: Quality) -> Iterator[RawLevels]:
    quality.read += 1
    if why := wanted(raw.time):
        quality.selected[why] += 1
    else:
        yield raw


def _number(cell: str, name: str, file: Path, row: int) -> float:
    if not cell.strip():
        return NAN
    try:
        return parse_number(cell)
    except ValueError:
        raise SoundingError(f"'{cell.strip():.20}' under '{name}' is no number", file=file, row=row) from None
