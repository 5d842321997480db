"""Soundings in the format of NOAA's Forecast Systems Laboratory (FSL, later GSD), made to its description."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from pathlib import Path

from .igra import Wanted
from .quality import Quality
from .raw_levels import NAN, RawLevels
from .sounding import SPEEDS, SoundingError

MISSING = ("99999", "32767")
LEVELS = ("9", "4", "5", "6", "7", "8")  # surface, mandatory, significant, wind, tropopause, strongest wind
WIND = {"kt": SPEEDS["kt"], "ms": 0.1}  # knots, tenths of m/s


def is_fsl(first_line: str) -> bool:
    """Return whether a text begins with the first identification line of a sounding."""
    return first_line.split()[:1] == ["254"]


def read_fsl(file: Path, lines: list[str], wanted: Wanted, quality: Quality) -> Iterator[RawLevels]:
    """Return the soundings of a file: lines of type 254, 1, 2, 3, then the levels.

    Raises
    ------
    SoundingError
        Lines out of place, a unit of the wind that is not known.
    """
    raw: RawLevels | None = None
    factor: float | None = None
    skip = False
    for row, line in enumerate(lines, start=1):
        words = line.split()
        if not words:
            continue
        kind = words[0]
        if kind == "254":
            if raw is not None and not skip:
                yield raw
            time = _time(words, file, row)
            quality.read += 1
            why = wanted(time)
            quality.selected.update([why] if why else [])
            raw, factor, skip = RawLevels(file, f"{time:%Y-%m-%d %H} UTC", "", time, in_order=False), None, bool(why)
        elif raw is None:
            raise SoundingError("comes before a line of type 254, with which a sounding begins", file=file, row=row)
        elif kind == "1" and factor is None:
            raw.station = words[2] if len(words) > 2 else ""
            raw.name = f"{raw.station} {raw.name}"
        elif kind == "2" and factor is None:
            continue
        elif kind == "3" and factor is None:
            unit = words[-1].lower()
            if unit not in WIND:
                raise SoundingError(
                    f"the unit of the wind is '{unit:.12}'; it is 'kt', or 'ms' for tenths of m/s", file=file, row=row,
                    sounding=raw.name,
                )  # fmt: skip
            factor = WIND[unit]
        elif kind in LEVELS and factor is not None:
            if skip:
                continue
            p, h, t, _, d, s = (_value(w, file, row) for w in [*words[1:7], *["99999"] * (7 - len(words))])
            raw.add(row, p, h, 0.1 * t, s * factor, d)
        else:
            raise SoundingError(
                f"a line of type '{kind:.6}' has no place here; they follow as 254, 1, 2, 3 and levels",
                file=file,
                row=row,
            )
    if raw is not None and not skip:
        yield raw


def _value(word: str, file: Path, row: int) -> float:
    if word in MISSING:
        return NAN
    try:
        return float(int(word))
    except ValueError:
        raise SoundingError(f"'{word:.12}' is no whole number", file=file, row=row) from None


def _time(words: list[str], file: Path, row: int) -> datetime.datetime:
    try:
        return datetime.datetime.strptime(" ".join(words[1:5]), "%H %d %b %Y")
    except ValueError:
        raise SoundingError("holds no time; write '254 12 17 MAR 2008'", file=file, row=row) from None
