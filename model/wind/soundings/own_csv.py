"""The project's own CSV of profiles: one row a level, units in the header, components or speed and direction."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import suggestion
from ...files.csv_table import read_rows
from ...files.numbers import parse_number
from ..statistics import LARGEST_ALTITUDE, LOWEST_ALTITUDE
from .igra import Wanted
from .quality import Quality
from .sounding import ALTITUDES, SPEEDS, Sounding, SoundingError, wind_components

_HEADER = re.compile(r"^(?P<name>[^\[\]]+?)\s*(\[(?P<unit>[^\[\]]*)\])?$")
UNITS = {
    "altitude": ALTITUDES,
    "u": SPEEDS,
    "v": SPEEDS,
    "speed": SPEEDS,
    "direction": {"deg": 1.0},
}
WORDS = ("profile", "date", "station")
DATES = "2008-03-17, or 2008-03-17T12:00 in UTC"


def read_own_csv(file: Path, wanted: Wanted, quality: Quality) -> Iterator[Sounding]:
    """Return the profiles of a CSV file.

    Columns ``altitude [m]`` (or km, ft), and ``u [m/s]``, ``v [m/s]`` or ``speed [m/s]``, ``direction [deg]`` (or kt,
    ft/s, km/h); ``profile`` where there are several, and ``date`` and ``station``, may be left out.

    Raises
    ------
    SoundingError
        A column or unit that is not known, a value that is no number, a level repeated, rows of a profile apart.
    """
    rows = read_rows(file)
    if not rows:
        raise SoundingError("holds no rows", file=file)
    index, factor = _header(rows[0][1], file, rows[0][0])
    by_components = "u" in index
    done: set[str] = set()
    profile: _Profile | None = None
    for line, cells in rows[1:]:
        if len(cells) != len(rows[0][1]):
            raise SoundingError(f"has {len(cells)} cells where the header has {len(rows[0][1])}", file=file, row=line)
        name = cells[index["profile"]].strip() if "profile" in index else file.stem
        if profile is None or name != profile.name:
            if profile is not None:
                yield from profile.sounding(wanted, quality)
            if name in done:
                raise SoundingError(
                    f"profile '{name}' goes on after another one; keep its rows together", file=file, row=line
                )
            done.add(name)
            profile = _Profile(file, name)
        h = _number(cells[index["altitude"]], "altitude", file, line) * factor["altitude"]
        profile.refuse(h, line)
        profile.start(
            cells[index["date"]] if "date" in index else "", cells[index["station"]] if "station" in index else "", line
        )
        if by_components:
            u, v = (_number(cells[index[c]], c, file, line) * factor[c] for c in ("u", "v"))
        else:
            s, d = (_number(cells[index[c]], c, file, line) * factor[c] for c in ("speed", "direction"))
            if not 0 <= d <= 360:
                raise SoundingError(
                    f"{d:g} deg is no direction: it goes from 0 to 360", file=file, row=line, sounding=name, altitude=h
                )
            if s < 0:
                raise SoundingError(f"a speed of {s:g} m/s is negative", file=file, row=line, sounding=name, altitude=h)
            u, v = (float(x) for x in wind_components(s, d))
        profile.add(h, u, v, line)
    if profile is not None:
        yield from profile.sounding(wanted, quality)


class _Profile:
    """The rows of one profile."""

    def __init__(self, file: Path, name: str):
        self.file, self.name, self.date, self.station = file, name, "", ""
        self.levels: dict[float, tuple[float, float, int]] = {}

    def start(self, date: str, station: str, line: int) -> None:
        """Take date and station of a row; they are those of the rows before."""
        for label, value in (("date", date.strip()), ("station", station.strip())):
            before = getattr(self, label)
            if self.levels and value != before:
                raise SoundingError(
                    f"the {label} of profile '{self.name}' changes from '{before}' to '{value}'",
                    file=self.file,
                    row=line,
                )
            setattr(self, label, value)
        if not self.levels:
            self.time, self.stated = _time(date, self.file, line) if date else (None, False)

    def refuse(self, h: float, line: int) -> None:
        """Raise for an altitude that is none, that the profile has already, or that comes out of order."""
        if not LOWEST_ALTITUDE <= h <= LARGEST_ALTITUDE:
            raise SoundingError(
                f"{h:g} m is no altitude of a sounding; correct it, or remove the row if it stands for a missing value",
                file=self.file, row=line, sounding=self.name,
            )  # fmt: skip
        if h in self.levels:
            raise SoundingError(f"profile '{self.name}' has the level {h:g} m twice", file=self.file, row=line)
        before = list(self.levels)[-2:]
        if len(before) == 2 and (h > before[1]) != (before[1] > before[0]):
            raise SoundingError(
                f"comes after {before[0]:g} and {before[1]:g} m: levels out of order; sort the rows of the profile",
                file=self.file, row=line, sounding=self.name, altitude=h,
            )  # fmt: skip

    def add(self, h: float, u: float, v: float, line: int) -> None:
        """Add a level."""
        self.levels[h] = u, v, line

    def sounding(self, wanted: Wanted, quality: Quality) -> Iterator[Sounding]:
        """Return the sounding, if it is wanted."""
        quality.read += 1
        if why := wanted(self.time):
            quality.selected[why] += 1
            return
        h = np.array(sorted(self.levels))
        data = np.array([self.levels[x] for x in h])
        label = self.name if not self.date else f"{self.name} of {self.date}"
        yield Sounding(
            label, self.station, self.time, h, data[:, 0], data[:, 1], data[:, 2].astype(np.intp), str(self.file),
            self.stated,
        )  # fmt: skip


def _header(cells: list[str], file: Path, row: int) -> tuple[dict[str, int], dict[str, float]]:
    """Return the place of each column that is known, and the factor of its unit."""
    index: dict[str, int] = {}
    factor: dict[str, float] = {}
    for k, cell in enumerate(cells):
        match = _HEADER.match(cell.strip())
        name, unit = (match["name"].strip(), match["unit"]) if match else (cell.strip(), None)
        if name not in UNITS and name not in WORDS:
            continue
        if name in index:
            raise SoundingError(f"column '{name}' stands twice in the header", file=file, row=row)
        if name in UNITS and unit not in UNITS[name]:
            known = ", ".join(f"'{name} [{u}]'" for u in UNITS[name])
            told = "has no unit" if unit is None else f"has the unit [{unit}]"
            raise SoundingError(f"column '{name}' {told}, and units that are known make it {known}", file=file, row=row)
        index[name] = k
        factor[name] = UNITS[name][unit] if name in UNITS and unit is not None else 1.0
    components = {"u", "v"} & set(index) or not {"speed", "direction"} & set(index)
    needed = ("altitude", *(("u", "v") if components else ("speed", "direction")))
    if components and {"speed", "direction"} & set(index):
        raise SoundingError("has both components and speed or direction; keep one of the two", file=file, row=row)
    for name in needed:
        if name not in index:
            shown = name if name in WORDS else f"{name} [{next(iter(UNITS[name]))}]"
            raise SoundingError(
                f"column '{shown}' is missing{suggestion(shown, [c.strip() for c in cells])}", file=file, row=row
            )
    return index, factor


def _number(cell: str, column: str, file: Path, line: int) -> float:
    try:
        return parse_number(cell)
    except ValueError:
        raise SoundingError(
            f"'{cell.strip():.30}' under '{column}' is not a finite number; fill it or remove the row", file=file,
            row=line,
        ) from None  # fmt: skip


def _time(cell: str, file: Path, line: int) -> tuple[datetime.datetime, bool]:
    try:
        text = cell.strip()
        time = datetime.datetime.fromisoformat(text)
        if time.tzinfo is not None:
            time = time.astimezone(datetime.UTC).replace(tzinfo=None)
        return time, len(text) > len("2008-03-17")
    except ValueError:
        raise SoundingError(f"'{cell.strip():.30}' is not a date; write {DATES}", file=file, row=line) from None
