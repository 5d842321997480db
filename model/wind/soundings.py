"""Wind statistics from soundings: a CSV file with one row a level and the rows of a profile together."""

from __future__ import annotations

import datetime
import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, suggestion
from ..files.csv_table import read_rows
from ..files.numbers import parse_number
from .record import WindOrigin
from .statistics import LARGEST_ALTITUDE, LOWEST_ALTITUDE, TwoComponentStatistics, WindStatistics

CODES = (88.8, 88.88, 99.0, 99.9, 99.99, 777.7, 888.8, 999.0, 999.9, 999.99, 9999.0, 9999.9, 32767.0, 99999.0)
CODE_DISTANCE = 4.0  # robust standard deviations from the level's median: nearer, 99 m/s is a jet
CODE_SHARE = 0.1  # of the profiles that hold one and the same code at a level: then the median is one too
OUTLIER_DISTANCE = 10.0  # robust standard deviations
SMALLEST_SPREAD = 0.5  # m/s, of a level that is often calm
LARGEST_SPEED = 150.0  # m/s; the strongest jets measured stay below
SHOWN = 5  # faults named in one message
COLUMNS = ("profile", "date", "altitude [m]", "u [m/s]", "v [m/s]")
FEWEST = 10  # profiles


@dataclass(frozen=True, eq=False)
class Soundings:
    """Complete profiles at common levels.

    Attributes
    ----------
    altitude : (k,) array
        m.
    u, v : (n, k) arrays
        Towards the east and north, m/s.
    day : (n,) array
        Days since some day, NaN where the file has no dates.
    dropped : int
        Profiles left out because they lack a level, or hold a missing-value code in its place.
    source : str
    """

    altitude: NDArray[np.float64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    day: NDArray[np.float64]
    dropped: int
    source: str

    @property
    def period(self) -> str:
        """The first and last day, or 'days not stated'."""
        days = self.day[np.isfinite(self.day)].astype(int)
        if not days.size:
            return "days not stated"
        return " to ".join(datetime.date.fromordinal(int(d)).isoformat() for d in (days.min(), days.max()))

    def statistics(self, name: str, site: str | None = None) -> TwoComponentStatistics:
        """Return mean, covariance and cross correlation, with the number of independent samples of each component.

        Parameters
        ----------
        name : str
        site : str, optional
            Where they were taken; with it the statistics know their origin.
        """
        k = self.altitude.size
        both = np.hstack([self.u, self.v])
        correlation = np.asarray(np.corrcoef(both, rowvar=False))
        np.fill_diagonal(correlation, 1.0)
        parts = []
        for component, values, i in (("zonal", self.u, slice(0, k)), ("meridional", self.v, slice(k, 2 * k))):
            parts.append(
                WindStatistics(
                    f"{name} {component}",
                    self.altitude,
                    values.mean(axis=0),
                    values.std(axis=0, ddof=1),
                    correlation[i, i],
                    independent_samples(values, self.day),
                    f"{self.source}, {len(values)} profiles",
                    None if site is None else WindOrigin(site, component, self.period, self.source),
                )
            )
        cross = correlation[:k, k:]
        return TwoComponentStatistics(parts[0], parts[1], np.diag(cross).copy(), cross)


def day_to_day_correlation(values: NDArray[np.float64], day: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the correlation of each level with itself a day later, over all pairs of profiles a day apart, (k,).

    NaN without dates or with fewer than three pairs.
    """
    order = np.argsort(day, kind="stable")
    x, d = values[order] - values.mean(axis=0), np.floor(day[order])
    first = [int(np.flatnonzero(d == value)[0]) for value in np.unique(d[np.isfinite(d)])]
    pairs = [(a, b) for a, b in itertools.pairwise(first) if d[b] - d[a] == 1]
    if len(pairs) < 3:
        return np.full(values.shape[1], np.nan)
    a, b = (x[[p[i] for p in pairs]] for i in (0, 1))
    return np.sum(a * b, axis=0) / np.sqrt(np.sum(a**2, axis=0) * np.sum(b**2, axis=0))


def independent_samples(values: NDArray[np.float64], day: NDArray[np.float64]) -> float:
    """Return the number of independent profiles behind a variance.

    A variance of n values of a first-order process of correlation r from one to the next is as uncertain as one of
    n (1 - r^2) / (1 + r^2) independent values (Bartlett 1935; Bayley and Hammersley, J. Roy. Statist. Soc. Suppl. 8
    (1946) 184-197). The most persistent level decides. Without dates all profiles count as independent.
    """
    r = day_to_day_correlation(values, day)
    if not np.isfinite(r).any():
        return float(len(values))
    largest = float(np.clip(np.nanmax(r), 0.0, 0.99))
    return len(values) * (1 - largest**2) / (1 + largest**2)


def read_soundings(file: Path, drop_incomplete: bool = False) -> Soundings:
    """Read profiles with the columns profile, date (may be left out), altitude [m], u [m/s] and v [m/s].

    Parameters
    ----------
    drop_incomplete : bool
        Leave out profiles that lack a level that others have, instead of refusing them.

    Raises
    ------
    DataError
        Missing file or column, a unit other than SI, a value that is no number, a missing or repeated level, a
        missing-value code such as -9999 or 99.9 (left out with ``drop_incomplete``), an outlier.
    """
    rows = read_rows(file)
    if not rows:
        raise DataError("holds no rows", file=file)
    header = [c.strip() for c in rows[0][1]]
    for column in COLUMNS:
        if column not in header and column != "date":
            raise DataError(f"column '{column}' is missing{suggestion(column, header)}; convert to SI units", file=file)
    index = {column: header.index(column) for column in COLUMNS if column in header}
    profiles: dict[str, dict[float, tuple[float, float]]] = {}
    lines: dict[tuple[str, float], int] = {}
    dates: dict[str, float] = {}
    last = None
    for line, cells in rows[1:]:
        if len(cells) != len(header):
            raise DataError(f"has {len(cells)} cells where the header has {len(header)}", file=file, row=line)
        name = cells[index["profile"]].strip()
        if name != last and name in profiles:
            raise DataError(f"profile '{name}' goes on after another one; keep its rows together", file=file, row=line)
        last = name
        h, u, v = (_number(cells[index[c]], c, file, line) for c in COLUMNS[2:])
        levels = profiles.setdefault(name, {})
        if h in levels:
            raise DataError(f"profile '{name}' has the level {h:g} m twice", file=file, row=line)
        if not LOWEST_ALTITUDE <= h <= LARGEST_ALTITUDE:
            raise DataError(
                f"{h:g} m is no altitude of a sounding; correct it, or remove the row if it stands for a missing value",
                file=file,
                column="altitude",
                row=line,
            )
        levels[h] = (u, v)
        lines[name, h] = line
        dates[name] = _day(cells[index["date"]], file, line) if "date" in index else np.nan
    altitude = np.array(sorted({h for levels in profiles.values() for h in levels}))
    codes = _refuse_outliers(profiles, altitude, lines, file)
    if codes and not drop_incomplete:
        raise DataError(
            f"missing-value codes stand for wind: {_listed(codes, lines)}; interpolate them, or leave such profiles "
            "out with drop_incomplete=True",
            file=file,
        )
    for name, h, _ in codes:
        profiles[name].pop(h, None)
    kept = {n: levels for n, levels in profiles.items() if len(levels) == altitude.size}
    if len(kept) < len(profiles) and not drop_incomplete:
        name = next(n for n in profiles if n not in kept)
        missing = next(h for h in altitude if h not in profiles[name])
        raise DataError(
            f"profile '{name}' lacks the level {missing:g} m ({len(profiles) - len(kept)} of {len(profiles)} profiles "
            "are incomplete); interpolate it, or leave such profiles out with drop_incomplete=True",
            file=file,
        )
    if len(kept) < FEWEST:
        raise DataError(f"holds {len(kept)} complete profiles; statistics need {FEWEST} at least", file=file)
    data = np.array([[levels[h] for h in altitude] for levels in kept.values()])
    day = np.array([dates[n] for n in kept])
    return Soundings(
        altitude, data[:, :, 0], data[:, :, 1], day, len(profiles) - len(kept), f"soundings of {file.name}"
    )


Fault = tuple[str, float, float]  # profile, altitude (m), value (m/s)


def _refuse_outliers(
    profiles: dict[str, dict[float, tuple[float, float]]],
    altitude: NDArray[np.float64],
    lines: dict[tuple[str, float], int],
    file: Path,
) -> list[Fault]:
    """Return the values that stand for missing ones; refuse others that no wind of their level has."""
    codes: list[Fault] = []
    outliers: list[Fault] = []
    for h in altitude:
        names = [name for name, levels in profiles.items() if h in levels]
        for values in np.array([profiles[name][h] for name in names]).T:
            middle = float(np.median(values))
            spread = max(1.4826 * float(np.median(np.abs(values - middle))), SMALLEST_SPREAD)
            distance = np.abs(values - middle) / spread
            for i in np.flatnonzero((distance > CODE_DISTANCE) | (np.abs(values) > CODES[0] - 1)):
                fault = (names[i], float(h), float(values[i]))
                frequent = np.mean(values == values[i]) > CODE_SHARE
                if np.isclose(abs(values[i]), CODES, rtol=0, atol=1e-6).any() and (
                    frequent or distance[i] > CODE_DISTANCE
                ):
                    codes.append(fault)
                elif distance[i] > OUTLIER_DISTANCE or abs(values[i]) > LARGEST_SPEED:
                    outliers.append(fault)
    if outliers:
        raise DataError(
            f"values that are no wind: {_listed(outliers, lines)}; correct them or remove their profiles", file=file
        )
    return codes


def _listed(faults: list[Fault], lines: dict[tuple[str, float], int]) -> str:
    named = [f"{value:g} m/s at {h:g} m (line {lines[name, h]})" for name, h, value in faults[:SHOWN]]
    more = f" and {len(faults) - SHOWN} more" if len(faults) > SHOWN else ""
    return ", ".join(named) + more


def _number(cell: str, column: str, file: Path, line: int) -> float:
    try:
        return parse_number(cell)
    except ValueError:
        raise DataError(
            f"'{cell.strip()}' is not a finite number; fill it or remove the profile",
            file=file,
            column=column,
            row=line,
        ) from None


def _day(cell: str, file: Path, line: int) -> float:
    try:
        return float(datetime.date.fromisoformat(cell.strip()[:10]).toordinal())
    except ValueError:
        raise DataError(
            f"'{cell.strip()}' is not a date; write 2008-03-17", file=file, column="date", row=line
        ) from None
