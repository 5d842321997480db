"""One sounding: the wind over altitude at one place and time, at its own levels."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import DataError

LARGEST_SPEED = 150.0  # m/s; the strongest jets measured stay below
GRAVITY = 9.80665  # m/s2, of the geopotential metre
GAS = 287.05  # J/(kg K), dry air
KELVIN = 273.15

ALTITUDES = {"m": 1.0, "km": 1000.0, "ft": 0.3048}  # unit: metres
SPEEDS = {"m/s": 1.0, "kt": 1852.0 / 3600.0, "ft/s": 0.3048, "km/h": 1.0 / 3.6}  # unit: m/s


class SoundingError(DataError):
    """A sounding cannot be used, or soundings do not go together.

    Parameters
    ----------
    why : str
    file, row
        As for :class:`~ascentwind.errors.DataError`.
    sounding : str, optional
        Which one: its station and date.
    altitude : float, optional
        Of the level, m.
    """

    def __init__(
        self,
        why: str,
        *,
        file: object = None,
        row: int | None = None,
        sounding: str | None = None,
        altitude: float | None = None,
    ):
        self.sounding, self.altitude = sounding, altitude
        where = [f"sounding {sounding}" if sounding else "", f"{altitude:g} m" if altitude is not None else ""]
        told = ", ".join(part for part in where if part)
        super().__init__(f"{told}: {why}" if told else why, file=None if file is None else str(file), row=row)


@dataclass(frozen=True, eq=False, repr=False)
class Sounding:
    """The wind as one balloon, profiler or grid point gives it.

    Attributes
    ----------
    name : str
        Of the profile in its file, or station and date.
    station : str
        Empty where the file does not say.
    time : datetime or None
        UTC.
    altitude : (k,) array
        m, increasing. Geopotential heights are taken as altitudes: 40 m less at 16 km.
    u, v : (k,) arrays
        Towards the east and north, m/s; none is missing.
    line : (k,) array of int
        In the file; 0 where there are no lines.
    file : str
    hours_stated : bool
        The date has an hour.
    """

    name: str
    station: str
    time: datetime.datetime | None
    altitude: NDArray[np.float64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    line: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    file: str = ""
    hours_stated: bool = True

    def __post_init__(self):
        for label in ("altitude", "u", "v"):
            values = np.asarray(getattr(self, label), float)
            object.__setattr__(self, label, values)
            if values.ndim != 1 or values.shape != self.altitude.shape:
                raise SoundingError(f"{label} has shape {values.shape}; give one value a level", sounding=self.name)
            if not np.isfinite(values).all():
                raise SoundingError(
                    f"{label} holds a value that is not finite; leave such levels out", sounding=self.name
                )
        if not self.line.size:
            object.__setattr__(self, "line", np.zeros(self.altitude.size, np.intp))
        if not (np.diff(self.altitude) > 0).all():
            i = int(np.argmin(np.diff(self.altitude) > 0))
            raise SoundingError(
                f"comes after {self.altitude[i]:g} m; sort the levels and keep each once",
                file=self.file or None, sounding=self.name, altitude=float(self.altitude[i + 1]),
            )  # fmt: skip

    def __repr__(self) -> str:
        span = f"{self.altitude[0]:g} to {self.altitude[-1]:g} m" if self.altitude.size else "no level"
        return f"Sounding '{self.name}': {self.altitude.size} levels, {span}"

    def at(self, levels: NDArray[np.float64], largest_gap: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return u and v at levels (m), linear between neighbours at most ``largest_gap`` (m) apart, else NaN."""
        found = np.full((2, levels.size), np.nan)
        h = self.altitude
        if not h.size:
            return found[0], found[1]
        after = np.clip(np.searchsorted(h, levels, side="left"), 0, h.size - 1)
        exact = h[after] == levels
        inside = (levels > h[0]) & (levels < h[-1]) & ~exact
        near = inside & (h[after] - h[np.maximum(after - 1, 0)] <= largest_gap)
        for row, values in zip(found, (self.u, self.v), strict=True):
            row[near] = np.interp(levels[near], h, values)
            row[exact] = values[after[exact]]
        return found[0], found[1]


def wind_components(speed: ArrayLike, direction: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return u (east) and v (north) of a wind of a speed that comes from a direction in deg, clockwise from north.

    u = -s sin d, v = -s cos d; the four quarters are exact.
    """
    s, d = np.asarray(speed, float), np.asarray(direction, float) % 360.0
    quarter, rest = np.divmod(d + 45.0, 90.0)
    angle = np.radians(rest - 45.0)  # within an eighth of a turn: sine and cosine of the quarters are 0 and 1
    sine, cosine = np.sin(angle), np.cos(angle)
    q = quarter.astype(int) % 4
    sin = np.choose(q, (sine, cosine, -sine, -cosine))
    cos = np.choose(q, (cosine, -sine, -cosine, sine))
    return -s * sin + 0.0, -s * cos + 0.0


def hypsometric_heights(
    pressure: NDArray[np.float64], temperature: NDArray[np.float64], height: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return heights with those missing filled by the hypsometric equation, and which were.

    Parameters
    ----------
    pressure : (k,) array
        Any unit, NaN where missing.
    temperature : (k,) array
        deg C, NaN where missing.
    height : (k,) array
        m, NaN where missing.

    Notes
    -----
    H2 - H1 = R T / g ln(p1 / p2) with the mean temperature of dry air between two levels, from the nearest level in
    pressure that has a height and a temperature. Moisture is left out: at most some 0.5 % of the thickness.
    """
    filled = np.array(height, float)
    known = np.flatnonzero(np.isfinite(height) & np.isfinite(temperature) & np.isfinite(pressure) & (pressure > 0))
    wanted = np.flatnonzero(~np.isfinite(height) & np.isfinite(temperature) & np.isfinite(pressure) & (pressure > 0))
    made = np.zeros(filled.size, bool)
    if known.size:
        for i in wanted:
            k = known[int(np.argmin(np.abs(np.log(pressure[known] / pressure[i]))))]
            mean = 0.5 * (temperature[k] + temperature[i]) + KELVIN
            filled[i] = height[k] + GAS * mean / GRAVITY * np.log(pressure[k] / pressure[i])
            made[i] = True
    return filled, made
