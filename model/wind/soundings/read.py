"""Reading soundings of any known format: which one a file is, what is wanted of it, and its profiles at levels."""

from __future__ import annotations

import datetime
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import UnknownNameError
from ...files.text_file import read_text
from ..range_reference import MONTHS
from .collection import Soundings
from .fsl import is_fsl, read_fsl
from .grids import POINTS, Point, is_grid, read_grid
from .igra import is_igra, read_igra
from .outliers import Fault, find_faults
from .own_csv import read_own_csv
from .quality import Quality
from .raw_levels import RawLevels
from .sounding import Sounding, SoundingError
from .wyoming import CSV_START, TITLE, read_wyoming_csv, read_wyoming_list

LARGEST_GAP = 2500.0  # m between neighbouring levels, over which the wind is straight: 70 from 100 hPa is 2.2 km
SHOWN = 5  # faults named in one message
COMMON = 0.5  # of the profiles hold a level that is common to them
Incomplete = Literal["use", "drop", "refuse"]


@dataclass(frozen=True)
class Selection:
    """Which soundings are wanted.

    Parameters
    ----------
    months, hours, years : collections of int, optional
        1 to 12, 0 to 23 UTC; all without them.

    Raises
    ------
    SoundingError
        A month or hour that is none.
    """

    months: frozenset[int] | None = None
    hours: frozenset[int] | None = None
    years: frozenset[int] | None = None

    def __post_init__(self):
        for what, chosen, low, high in (("month", self.months, 1, 12), ("hour", self.hours, 0, 23)):
            for value in sorted(chosen or ()):
                if not low <= value <= high:
                    raise SoundingError(f"{value} is no {what}; give {low} to {high}")

    def why_not(self, time: datetime.datetime | None) -> str:
        """Return why a sounding of a time is passed over; empty when it is wanted."""
        for what, chosen in (("month", self.months), ("hour", self.hours), ("year", self.years)):
            if chosen is None:
                continue
            if time is None:
                return f"no date, and a {what} was asked for"
            if getattr(time, what) not in chosen:
                return f"another {what}"
        return ""


def select(months: Iterable[int | str] | None, hours: Iterable[int] | None, years: Iterable[int] | None) -> Selection:
    """Return a selection; months by number or name.

    Raises
    ------
    UnknownNameError, SoundingError
    """
    numbers = None
    if months is not None:
        numbers = []
        for month in [months] if isinstance(months, str | int) else months:
            if isinstance(month, str):
                if month not in MONTHS:
                    raise UnknownNameError("month", month, MONTHS)
                month = MONTHS.index(month) + 1
            numbers.append(int(month))
    made = [None if part is None else frozenset(int(x) for x in part) for part in (numbers, hours, years)]
    return Selection(*made)


def read_profiles(
    files: str | Path | Iterable[str | Path],
    *,
    months: Iterable[int | str] | None = None,
    hours: Iterable[int] | None = None,
    years: Iterable[int] | None = None,
    latitude: float | None = None,
    longitude: float | None = None,
    point: Point = "nearest",
) -> tuple[list[Sounding], Quality]:
    """Read soundings at their own levels.

    Parameters
    ----------
    files, months, hours, years, latitude, longitude, point
        As for :func:`read_soundings`.

    Returns
    -------
    list of Sounding
        By time, where they have one.
    Quality
        What was kept, and what not and why.

    Raises
    ------
    SoundingError, UnknownNameError, MissingLibraryError
    """
    if point not in POINTS:
        raise UnknownNameError("way to a point", point, POINTS)
    selection = select(months, hours, years)
    quality = Quality()
    paths = [Path(files)] if isinstance(files, str | Path) else [Path(file) for file in files]
    found: list[Sounding] = []
    for path in paths:
        for sounding in _profiles(path, selection, quality, latitude, longitude, point):
            if sounding.altitude.size:
                found.append(sounding)
            else:
                quality.dropped.append((sounding.name, "no level with wind and height"))
    if not found:
        told = "; ".join(quality.lines()[1:4])
        raise SoundingError(
            f"no sounding is left of {quality.read} read{f' ({told})' if told else ''}; ask for other months, hours or "
            "years, or give other files", file=paths[0] if len(paths) == 1 else None,
        )  # fmt: skip
    _refuse_mixed(found)
    found.sort(key=lambda s: (s.time is None, s.time or datetime.datetime.min))
    quality.kept, quality.levels = len(found), sum(s.altitude.size for s in found)
    return found, quality


def read_soundings(
    files: str | Path | Iterable[str | Path],
    levels: ArrayLike | None = None,
    *,
    months: Iterable[int | str] | None = None,
    hours: Iterable[int] | None = None,
    years: Iterable[int] | None = None,
    latitude: float | None = None,
    longitude: float | None = None,
    point: Point = "nearest",
    largest_gap: float = LARGEST_GAP,
    incomplete: Incomplete = "use",
    outliers: Literal["refuse", "drop"] = "refuse",
) -> Soundings:
    """Read soundings at common levels.

    Parameters
    ----------
    files : path or paths
        IGRA version 2 (text or zip), Wyoming (CSV or text list), FSL text, netCDF or GRIB on pressure levels, or CSV
        with units in its header; which one, a file says by its beginning. All of one station.
    levels : (k,) array_like, optional
        m, increasing. The files' own without it, where most profiles share them.
    months, hours, years : iterables, optional
        Those wanted: months by number or name, hours in UTC.
    latitude, longitude : float, optional
        deg, of the place in a field.
    point : {'nearest', 'bilinear'}
        How a field is read there.
    largest_gap : float
        m; between neighbouring levels farther apart the wind is missing, not a straight line.
    incomplete : {'use', 'drop', 'refuse'}
        Profiles that lack a level, by a gap, an early burst or a missing-value code: used where they are there, left
        out, or refused.
    outliers : {'refuse', 'drop'}
        Values that no wind of their level has.

    Returns
    -------
    Soundings
        With a ``quality`` report.

    Raises
    ------
    SoundingError, UnknownNameError, MissingLibraryError
        With file, sounding and level.
    """
    for what, chosen, known in (
        ("way with incomplete profiles", incomplete, ("use", "drop", "refuse")),
        ("way with outliers", outliers, ("refuse", "drop")),
    ):
        if chosen not in known:
            raise UnknownNameError(what, chosen, known)
    profiles, quality = read_profiles(
        files, months=months, hours=hours, years=years, latitude=latitude, longitude=longitude, point=point
    )
    wanted = _own_levels(profiles) if levels is None else checked_levels(levels)
    return at_levels(profiles, quality, wanted, largest_gap, incomplete, outliers)


def at_levels(
    profiles: Sequence[Sounding],
    quality: Quality,
    levels: NDArray[np.float64],
    largest_gap: float,
    incomplete: Incomplete,
    outliers: Literal["refuse", "drop"],
) -> Soundings:
    """Return profiles at common levels; arguments as for :func:`read_soundings`."""
    if not largest_gap > 0:
        raise SoundingError(f"a gap of {largest_gap:g} m is not positive")
    u, v = (np.array(part) for part in zip(*(p.at(levels, largest_gap) for p in profiles), strict=True))
    codes, bad = find_faults((u, v))
    if bad and outliers == "refuse":
        raise SoundingError(
            f"values that are no wind: {_listed(bad, profiles, levels)}; are these knots under another unit? "
            "Correct them, remove their profiles, or leave them out with outliers='drop'",
            file=profiles[bad[0].profile].file or None,
        )  # fmt: skip
    if codes and incomplete == "refuse":
        raise SoundingError(
            f"missing-value codes stand for wind: {_listed(codes, profiles, levels)}; interpolate them, or take "
            "incomplete='use' or 'drop'", file=profiles[codes[0].profile].file or None,
        )  # fmt: skip
    for what, faults in (("missing-value codes", codes), ("values that no wind of their level has", bad)):
        if faults:
            quality.notes.append(f"{len(faults)} {what}: {_listed(faults, profiles, levels)}")
    for fault in [*codes, *bad]:
        u[fault.profile, fault.level] = v[fault.profile, fault.level] = np.nan
    whole = np.asarray(np.isfinite(u).all(axis=1))
    if incomplete == "refuse" and not whole.all():
        i = int(np.argmin(whole))
        h = levels[int(np.argmin(np.isfinite(u[i])))]
        raise SoundingError(
            f"lacks the level ({int((~whole).sum())} of {whole.size} profiles are incomplete); interpolate it, or take "
            "incomplete='use' or 'drop'", file=profiles[i].file or None, sounding=profiles[i].name, altitude=float(h),
        )  # fmt: skip
    keep: NDArray[np.bool_] = whole if incomplete == "drop" else np.asarray(np.isfinite(u).any(axis=1))
    for i in np.flatnonzero(~keep).tolist():
        missing = levels[~np.isfinite(u[i])]
        quality.dropped.append(
            (
                profiles[i].name,
                f"{missing.size} of {levels.size} levels missing, from {missing[0]:g} to {missing[-1]:g} m",
            )
        )
    quality.kept = int(keep.sum())
    quality.levels = int(np.isfinite(u[keep]).sum())
    kept = [p for p, use in zip(profiles, keep, strict=True) if use]
    if not kept:
        raise SoundingError(
            f"no profile holds {'all' if incomplete == 'drop' else 'any'} of the {levels.size} levels from "
            f"{levels[0]:g} to {levels[-1]:g} m; ask for others, or allow a larger gap", file=profiles[0].file or None,
        )  # fmt: skip
    times = np.array(
        [np.datetime64("NaT", "m") if p.time is None else np.datetime64(p.time) for p in kept], "datetime64[m]"
    )
    stated = np.array([p.hours_stated for p in kept])
    files = list(dict.fromkeys(Path(p.file).name for p in kept))
    source = f"soundings of {', '.join(files[:3])}{', ...' if len(files) > 3 else ''}"
    names = tuple(p.name for p in kept)
    return Soundings(levels, u[keep], v[keep], times, names, kept[0].station, source, quality, bool(stated.all()))


def checked_levels(levels: ArrayLike) -> NDArray[np.float64]:
    """Return levels, m.

    Raises
    ------
    SoundingError
        They are none, or do not increase.
    """
    try:
        found = np.asarray(levels, float)
    except (TypeError, ValueError):
        raise SoundingError(f"{levels!r:.60} are no levels; give altitudes in m, such as [0, 1000, 2000]") from None
    if found.ndim != 1 or not found.size or not np.isfinite(found).all() or not (np.diff(found) > 0).all():
        raise SoundingError("levels are altitudes in m, increasing; these are not")
    return found


def _own_levels(profiles: Sequence[Sounding]) -> NDArray[np.float64]:
    levels, count = np.unique(np.concatenate([p.altitude for p in profiles]), return_counts=True)
    rare = count < COMMON * len(profiles)
    if rare.any():
        raise SoundingError(
            f"the soundings have no levels in common ({levels.size} altitudes, of which {int(rare.sum())} are in fewer "
            "than half of them); say which are wanted, such as levels=range(0, 16001, 500), or put them on levels with "
            "'ascentwind wind read --levels 0:16000:500 --out FILE'", file=profiles[0].file or None,
        )  # fmt: skip
    return levels


def _profiles(
    path: Path,
    selection: Selection,
    quality: Quality,
    latitude: float | None,
    longitude: float | None,
    point: Point,
) -> Iterator[Sounding]:
    try:
        with path.open("rb") as stream:
            start = stream.read(4)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise SoundingError(f"cannot be read ({reason}); check its name", file=path) from None
    wanted = selection.why_not
    if is_grid(start):
        yield from read_grid(path, latitude, longitude, point, wanted, quality)
        return
    if latitude is not None or longitude is not None:
        raise SoundingError(
            "is of one place: leave latitude and longitude out, which choose a point of a field", file=path
        )
    raws: Iterator[RawLevels]
    lines = _zipped_lines(path) if start.startswith(b"PK") else read_text(path).split("\n")
    first = next((line for line in lines if line.strip()), "")
    if is_igra(first):
        raws = read_igra(path, lines, wanted, quality)
    elif first.startswith(CSV_START):
        raws = read_wyoming_csv(path, lines, wanted, quality)
    elif is_fsl(first):
        raws = read_fsl(path, lines, wanted, quality)
    elif any(TITLE.match(line.partition(">")[2].split("<")[0] or line) or TITLE.match(line) for line in lines[:40]):
        raws = read_wyoming_list(path, lines, wanted, quality)
    else:
        yield from read_own_csv(path, wanted, quality)
        return
    for raw in raws:
        yield raw.sounding(quality)


def _zipped_lines(path: Path) -> list[str]:
    try:
        with zipfile.ZipFile(path) as archive:
            names = [n for n in archive.namelist() if not n.endswith("/")]
            if len(names) != 1:
                raise SoundingError(f"holds {len(names)} files, and one text is expected; unpack it", file=path)
            return archive.read(names[0]).decode("utf-8").splitlines()
    except (zipfile.BadZipFile, OSError, EOFError, UnicodeDecodeError, RuntimeError) as error:
        raise SoundingError(f"cannot be unpacked as text ({error!s:.80})", file=path) from None


def _refuse_mixed(profiles: Sequence[Sounding]) -> None:
    stations = list(dict.fromkeys(p.station for p in profiles))
    if len(stations) > 1:
        other = next(p for p in profiles if p.station != stations[0])
        raise SoundingError(
            f"is of station '{other.station}', and others are of '{stations[0]}'; read the stations one by one",
            file=other.file, sounding=other.name,
        )  # fmt: skip
    seen: dict[datetime.datetime, list[Sounding]] = {}
    for profile in profiles:
        if profile.time is None:
            continue
        others = seen.setdefault(profile.time, [])
        # of a day without hours there may be several, but not the same one again
        before = next((other for other in others if profile.hours_stated or _same_winds(profile, other)), None)
        if before is not None:
            date = f"{profile.time:%Y-%m-%d %H:%M}" if profile.hours_stated else f"{profile.time:%Y-%m-%d}"
            raise SoundingError(
                f"has the date {'' if profile.hours_stated else 'and the winds '}of sounding {before.name} "
                f"({Path(before.file).name}): {date} stands twice; keep one of the two", file=profile.file,
                sounding=profile.name, row=int(profile.line[0]) or None,
            )  # fmt: skip
        others.append(profile)


def _same_winds(one: Sounding, other: Sounding) -> bool:
    return all(np.array_equal(getattr(one, part), getattr(other, part)) for part in ("altitude", "u", "v"))


def _listed(faults: Sequence[Fault], profiles: Sequence[Sounding], levels: NDArray[np.float64]) -> str:
    told = []
    for fault in faults[:SHOWN]:
        profile, h = profiles[fault.profile], levels[fault.level]
        at = int(np.argmin(np.abs(profile.altitude - h)))
        line = f", line {profile.line[at]}" if profile.line[at] else ""
        told.append(f"{fault.value:g} m/s at {h:g} m ({profile.name}{line})")
    return ", ".join(told) + (f" and {len(faults) - SHOWN} more" if len(faults) > SHOWN else "")
