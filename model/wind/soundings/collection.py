"""Soundings at common levels, some of them partly observed, and their statistics."""

from __future__ import annotations

import datetime
import warnings
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..correlation_matrix import TOLERANCE, RepairWarning, nearest_correlation_matrix
from ..record import WindOrigin
from ..statistics import TwoComponentStatistics, WindStatistics
from .quality import Quality
from .sounding import SoundingError

FEWEST = 10  # profiles at a level and at a pair of levels, for statistics
SAME = 1.0 / 48.0  # days: lags this near are one
PERSISTENT = 0.99  # correlation in time, at most


@dataclass(frozen=True, eq=False, repr=False)
class Soundings:
    """Profiles at common levels.

    Attributes
    ----------
    altitude : (k,) array
        m.
    u, v : (n, k) arrays
        Towards the east and north, m/s; NaN where a profile lacks the level.
    time : (n,) array of datetime64
        UTC, NaT where the file has no dates.
    names : tuple of str
        Of the profiles.
    station, source : str
    quality : Quality
        What was kept, and what not and why.
    hours_stated : bool
        The dates have hours.
    """

    altitude: NDArray[np.float64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    time: NDArray[np.datetime64]
    names: tuple[str, ...]
    station: str
    source: str
    quality: Quality = field(default_factory=Quality)
    hours_stated: bool = False

    def __repr__(self) -> str:
        span = f"{self.altitude[0]:g} to {self.altitude[-1]:g} m"
        return f"Soundings: {len(self.u)} profiles, {self.altitude.size} levels, {span}, {self.period}"

    @cached_property
    def day(self) -> NDArray[np.float64]:
        """Days since the beginning of the calendar, with the hour where it is stated; NaN without a date."""
        known = ~np.isnat(self.time)
        found = np.full(self.time.size, np.nan)
        epoch = datetime.date(1970, 1, 1).toordinal()
        found[known] = epoch + self.time[known].astype("datetime64[m]").astype(float) / 1440.0
        return found

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Which profiles hold all levels, (n,)."""
        return np.asarray((np.isfinite(self.u) & np.isfinite(self.v)).all(axis=1))

    @property
    def period(self) -> str:
        """The first and last day, or 'days not stated'."""
        days = self.day[np.isfinite(self.day)].astype(int)
        if not days.size:
            return "days not stated"
        return " to ".join(datetime.date.fromordinal(int(d)).isoformat() for d in (days.min(), days.max()))

    def component(self, name: str) -> NDArray[np.float64]:
        """Return u for 'zonal' and v for 'meridional', (n, k)."""
        return self.u if name == "zonal" else self.v

    def statistics(self, name: str, site: str | None = None) -> TwoComponentStatistics:
        """Return mean, covariance and cross correlation, with the number of independent samples of each component.

        A profile that ends early counts where it is: every correlation is of the profiles that hold both levels. Where
        such pairs do not fit together, the nearest matrix that does is taken, with a RepairWarning.

        Parameters
        ----------
        name : str
        site : str, optional
            Where they were taken; with it the statistics know their origin.

        Raises
        ------
        SoundingError
            Too few profiles at a level or pair of levels.

        Warns
        -----
        RepairWarning
        """
        k = self.altitude.size
        both = np.hstack([self.u, self.v])
        correlation, note = self._correlation(both, name)
        parts = []
        for component, values, i in (("zonal", self.u, slice(0, k)), ("meridional", self.v, slice(k, 2 * k))):
            parts.append(
                WindStatistics(
                    f"{name} {component}",
                    self.altitude,
                    np.nanmean(values, axis=0),
                    np.nanstd(values, axis=0, ddof=1),
                    correlation[i, i],
                    independent_samples(values, self.day),
                    f"{self.source}, {len(values)} profiles{note}",
                    None if site is None else WindOrigin(site, component, self.period, self.source),
                )
            )
        cross = correlation[:k, k:]
        return TwoComponentStatistics(parts[0], parts[1], np.diag(cross).copy(), cross)

    def _correlation(self, both: NDArray[np.float64], name: str) -> tuple[NDArray[np.float64], str]:
        """Return the correlation of all levels of both components, and what was done to it."""
        seen = np.isfinite(both)
        k = self.altitude.size
        pairs = seen.T.astype(float) @ seen
        if pairs.min() < FEWEST:
            i, j = np.unravel_index(int(np.argmin(pairs)), pairs.shape)
            low, high = sorted((self.altitude[i % k], self.altitude[j % k]))
            where = f"{low:g} m" if low == high else f"both {low:g} and {high:g} m"
            raise SoundingError(
                f"{self.source}: {int(pairs[i, j])} profiles hold {where}; statistics need {FEWEST} at least: give "
                "more soundings, or ask for levels below"
            )
        still = np.nanstd(both, axis=0) == 0
        if still.any():
            i = int(np.argmax(still))
            raise SoundingError(
                f"{self.source}: the {'zonal' if i < k else 'meridional'} wind is the same in all profiles at "
                f"{self.altitude[i % k]:g} m, which no statistics are made of; see what the file holds there"
            )
        if seen.all():
            found = np.asarray(np.corrcoef(both, rowvar=False))
        else:
            x, w = np.where(seen, both - np.nanmean(both, axis=0), 0.0), seen.astype(float)
            sums = x.T @ w  # over the profiles that hold both
            product = x.T @ x - sums * sums.T / pairs
            square = (x**2).T @ w - sums**2 / pairs
            found = product / np.sqrt(square * square.T)
            found = 0.5 * (found + found.T)
        np.fill_diagonal(found, 1.0)
        note = "" if seen.all() else f", {int((~self.complete).sum())} of them partly observed, pair by pair"
        if not seen.all() and np.linalg.eigvalsh(found).min() < -TOLERANCE * len(found):
            repair = nearest_correlation_matrix(found)
            warnings.warn(RepairWarning(f"soundings '{name}', pair by pair: {repair}"), stacklevel=3)
            return repair.matrix, f"{note}; {repair}"
        return found, note


def successive_correlation(values: NDArray[np.float64], day: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the correlation of each level with itself one sounding later, (k,).

    Over all pairs of profiles that are as far apart as most neighbours are: a day, or half of one. NaN without dates or
    with fewer than three pairs.
    """
    order = np.argsort(day, kind="stable")
    d = day[order]
    first = np.flatnonzero(np.concatenate([[True], np.diff(d) > SAME]) & np.isfinite(d))
    none = np.full(values.shape[1], np.nan)
    if first.size < 2:
        return none
    x, d = values[order][first] - np.nanmean(values, axis=0), d[first]
    steps = np.diff(d)
    rounded, count = np.unique(np.round(steps / SAME), return_counts=True)
    lag = rounded[int(np.argmax(count))] * SAME
    at = np.flatnonzero(np.abs(steps - lag) <= SAME)
    found = none
    for level in range(values.shape[1]):
        a, b = x[at, level], x[at + 1, level]
        good = np.isfinite(a) & np.isfinite(b)
        size = float(np.sqrt((a[good] ** 2).sum() * (b[good] ** 2).sum()))
        if good.sum() >= 3 and size > 0:
            found[level] = float(a[good] @ b[good]) / size
    return found


def independent_samples(values: NDArray[np.float64], day: NDArray[np.float64]) -> float:
    """Return the number of independent profiles behind a variance.

    A variance of n values of a first-order process of correlation r from one to the next is as uncertain as one of
    n (1 - r^2) / (1 + r^2) independent values (Bartlett 1935; Bayley and Hammersley, J. Roy. Statist. Soc. Suppl. 8
    (1946) 184-197). The most persistent level and the level that fewest profiles hold decide. Without dates all
    profiles count as independent.
    """
    count = float(np.isfinite(values).sum(axis=0).min())
    r = successive_correlation(values, day)
    if not np.isfinite(r).any():
        return count
    largest = float(np.clip(np.nanmax(r), 0.0, PERSISTENT))
    return count * (1 - largest**2) / (1 + largest**2)


def soundings_text(soundings: Soundings) -> str:
    """Return profiles as the project's own CSV: what :func:`read_soundings` reads back."""
    lines = [f"# {soundings.source}, station {soundings.station or 'not stated'}; written by 'ascentwind wind read'"]
    lines.append("profile,station,date,altitude [m],u [m/s],v [m/s]")
    for i, time in enumerate(soundings.time):
        date = "" if np.isnat(time) else str(time)[: 16 if soundings.hours_stated else 10]
        station = soundings.station.replace(",", " ")
        for h, u, v in zip(soundings.altitude, soundings.u[i], soundings.v[i], strict=True):
            if np.isfinite(u) and np.isfinite(v):
                lines.append(f"{i + 1},{station},{date},{h:.10g},{u:.6g},{v:.6g}")
    return "\n".join(lines) + "\n"
