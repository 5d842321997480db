"""Measured profiles as the wind across a vehicle's flight, completed where nothing was measured."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindWarning, DataError
from ...model.wind.soundings.collection import FEWEST, Soundings
from ...model.wind.soundings.quality import Quality
from ...model.wind.soundings.read import LARGEST_GAP, at_levels, read_soundings
from ...model.wind.soundings.sounding import Sounding, SoundingError
from ..case.case import Case
from ..case.climb import Climb
from .conditioning import Measured
from .met_winds import MetWinds
from .random_wind import FARTHEST, RandomWind, random_wind

FILL = 250.0  # m, between levels where nothing was measured
SPREAD = 1.6  # times the filter's deviations, as the root mean square of many profiles: knots are 1.94


class UnlikelyWindWarning(AscentwindWarning):
    """Measured winds are farther off the vehicle's wind than winds of its season and place are."""


@dataclass(frozen=True, eq=False)
class CompleteProfiles:
    """Winds at levels from below the flight to above it.

    Attributes
    ----------
    levels : (k,) array
        m.
    wind : (n, c k) array
        As the vehicle meets it, one component after the other, m/s: as measured, and elsewhere what the filter lets
        expect given that.
    observed : (n, c k) array of bool
    pattern : (n,) array of int
        Number of the profile's set of observed levels.
    residual : tuple of (c k, c k) arrays
        Covariance of the wind given what was observed, by pattern; None where all levels were.
    names : tuple of str
    time : (n,) array of datetime64
    source : str
    """

    levels: NDArray[np.float64]
    wind: NDArray[np.float64]
    observed: NDArray[np.bool_]
    pattern: NDArray[np.intp]
    residual: tuple[NDArray[np.float64] | None, ...]
    names: tuple[str, ...]
    time: NDArray[np.datetime64]
    source: str


def soundings_of(profiles: str | Path | Soundings | Sounding) -> Soundings:
    """Return soundings from what a person gives: a file at common levels, soundings, or one of them.

    Raises
    ------
    SoundingError, DataError
    """
    if isinstance(profiles, Soundings):
        return profiles
    if isinstance(profiles, Sounding):
        return at_levels([profiles], Quality(1), profiles.altitude, LARGEST_GAP, "use", "refuse")
    if isinstance(profiles, str | Path):
        return read_soundings(profiles)
    raise DataError(f"{profiles!r:.60} are no soundings; give a file, or what read_soundings returns")


def complete_profiles(case: Case, soundings: Soundings, last: float, met: MetWinds) -> CompleteProfiles:
    """Return profiles up to the altitude ``last`` (m) of the flight.

    Between levels the wind is straight. Where a profile holds nothing, below its first level, above its last one and in
    gaps, it is the filter's conditional mean given the profile, on levels at most 250 m apart, and its covariance is
    kept. Winds are of the season of the vehicle's mean: a deviation from it decays towards it.

    Raises
    ------
    NoVehicleError
    SoundingError
        A profile that holds no level of the flight.

    Warns
    -----
    UnlikelyWindWarning
        Winds far off those of the vehicle's filter.
    """
    measured = met.of(soundings)
    first = float(Climb.of(case).altitudes[0])
    own = soundings.altitude
    within = (own >= first) & (own <= last)
    empty = ~np.isfinite(soundings.u[:, within]).any(axis=1)
    if empty.any():
        number = int(np.argmax(empty))
        held = own[np.isfinite(soundings.u[number])]
        others = f" ({int(empty.sum())} of {empty.size} profiles hold none of it)" if empty.size > 1 else ""
        raise SoundingError(
            f"holds {held[0]:g} to {held[-1]:g} m, and the flight goes from {first:.0f} to {last:.0f} m{others}; give "
            "one that is there, or leave it out", file=soundings.source, sounding=soundings.names[number],
        )  # fmt: skip
    below = np.arange(own[0] - FILL, first - FILL, -FILL)[::-1] if own[0] > first else np.zeros(0)
    above = np.arange(own[-1] + FILL, last + FILL, FILL) if own[-1] < last else np.zeros(0)
    levels = np.concatenate([np.maximum(below, min(first, own[0] - 1.0)), own, above])
    levels = np.unique(levels)
    wind = np.full((len(measured[0]), len(measured), levels.size), np.nan)
    wind[:, :, np.searchsorted(levels, own)] = np.stack(measured, axis=1)
    wind = wind.reshape(len(wind), -1)
    observed = np.isfinite(wind)
    patterns, pattern = np.unique(observed, axis=0, return_inverse=True)
    random = random_wind(case, levels)
    _tell_unlikely(wind, random, soundings)
    R, residual = random.covariance, []
    for number, seen in enumerate(patterns):
        if seen.all():
            residual.append(None)
            continue
        which_rows = np.flatnonzero(pattern == number)
        hidden = ~seen
        K = Measured(R[np.ix_(seen, seen)])
        gain = K.whitened(R[np.ix_(seen, hidden)])
        deviation = K.whitened((wind[np.ix_(which_rows, seen)] - random.mean[seen]).T)
        wind[np.ix_(which_rows, hidden)] = random.mean[hidden] + deviation.T @ gain
        left = np.zeros_like(R)
        left[np.ix_(hidden, hidden)] = R[np.ix_(hidden, hidden)] - gain.T @ gain
        residual.append(left)
    return CompleteProfiles(
        levels, wind, observed, pattern.ravel(), tuple(residual), soundings.names, soundings.time, soundings.source
    )


def _tell_unlikely(wind: NDArray[np.float64], random: RandomWind, soundings: Soundings) -> None:
    """Warn of one wind that is too far from the filter's mean, and of all winds together (n, c k)."""
    std = random.std
    off = np.abs(np.divide(wind - random.mean, std, out=np.full(wind.shape, np.nan), where=std > 0))
    if not np.isfinite(off).any():
        return
    profile, place = np.unravel_index(int(np.nanargmax(off)), off.shape)
    together = float(np.sqrt(np.nanmean(off**2)))
    ask = "are they in knots, or of another season or place?"
    where = (
        f"{soundings.source}, sounding {soundings.names[int(profile)]}, {random.levels[place % random.levels.size]:g} m"
    )
    if len(wind) >= FEWEST and together > SPREAD:
        told = (
            f"{soundings.source}: the winds are {together:.2f} standard deviations of the vehicle's wind off its mean "
            f"(root mean square of {len(wind)} profiles; about 1 is expected): {ask}"
        )
    elif off[profile, place] > FARTHEST:
        told = (
            f"{where}: {wind[profile, place]:.3g} m/s is {off[profile, place]:.1f} standard deviations from the mean "
            f"of the vehicle's wind, {random.mean[place]:.3g} m/s: {ask}"
        )
    else:
        return
    warnings.warn(UnlikelyWindWarning(told), stacklevel=5)
