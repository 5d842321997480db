"""From the levels of a file to a sounding: heights filled in, impossible values refused, the rest sorted."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..statistics import LARGEST_ALTITUDE, LOWEST_ALTITUDE
from .quality import Quality
from .sounding import LARGEST_SPEED, Sounding, SoundingError, hypsometric_heights, wind_components

NAN = float("nan")


@dataclass
class RawLevels:
    """A sounding as its file has it: speed (m/s) and direction (deg), NaN where missing.

    ``removed``: levels whose wind the file's own quality control took out.
    """

    file: Path
    name: str
    station: str
    time: datetime.datetime | None
    hours_stated: bool = True
    in_order: bool = True  # the file lists levels upward: one that goes down is a fault
    removed: int = 0
    line: list[int] = field(default_factory=list)
    pressure: list[float] = field(default_factory=list)
    height: list[float] = field(default_factory=list)
    temperature: list[float] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)
    direction: list[float] = field(default_factory=list)

    def add(
        self, line: int, pressure: float, height: float, temperature: float, speed: float, direction: float
    ) -> None:
        """Add a level: any unit of pressure, m, deg C, m/s, deg."""
        self.line.append(line)
        for values, value in (
            (self.pressure, pressure), (self.height, height),
            (self.temperature, temperature), (self.speed, speed), (self.direction, direction),
        ):  # fmt: skip
            values.append(value)

    def sounding(self, quality: Quality) -> Sounding:
        """Return the levels with wind and height, from the lowest to the highest.

        Raises
        ------
        SoundingError
            A direction over 360 deg, a speed that no wind has, an altitude that is none, levels out of order.
        """
        line = np.array(self.line, np.intp)
        speed, direction = np.array(self.speed, float), np.array(self.direction, float)
        height = np.array(self.height, float)
        self._refuse_impossible(line, speed, direction, height)
        height, made = hypsometric_heights(np.array(self.pressure, float), np.array(self.temperature, float), height)
        wind = np.isfinite(speed) & np.isfinite(direction)
        keep = wind & np.isfinite(height)
        computed = int((made & keep).sum())
        if computed:
            quality.notes.append(f"{self.name}: {computed} heights by the hypsometric equation")
        quality.left_out["no wind"] += int((~wind).sum()) - self.removed
        quality.left_out["wind removed by the archive's quality control"] += self.removed
        quality.left_out["no height, and no pressure and temperature to compute it"] += int((wind & ~keep).sum())
        line, height, speed, direction = line[keep], height[keep], speed[keep], direction[keep]
        if self.in_order and (np.diff(height) < 0).any():
            i = int(np.argmax(np.diff(height) < 0))
            raise SoundingError(
                f"comes after {height[i]:g} m: levels out of order; sort them, or remove the wrong one",
                file=self.file, row=int(line[i + 1]) or None, sounding=self.name, altitude=float(height[i + 1]),
            )  # fmt: skip
        order = np.argsort(height, kind="stable")
        line, height, speed, direction = line[order], height[order], speed[order], direction[order]
        first = np.concatenate([[True], np.diff(height) > 0])[: height.size]
        quality.left_out["a second level at the same height"] += int((~first).sum())
        u, v = wind_components(speed[first], direction[first])
        quality.left_out = +quality.left_out  # without zeros
        return Sounding(
            self.name, self.station, self.time, height[first], u, v, line[first], str(self.file), self.hours_stated
        )

    def _refuse_impossible(
        self, line: np.ndarray, speed: np.ndarray, direction: np.ndarray, height: np.ndarray
    ) -> None:
        for bad, values, says in (
            ((direction < 0) | (direction > 360), direction, "{:g} deg is no direction: it goes from 0 to 360"),
            (speed < 0, speed, "a speed of {:g} m/s is negative"),
            (speed > LARGEST_SPEED, speed, "{:g} m/s is more than any wind has; are these knots or feet a second?"),
            (
                (height < LOWEST_ALTITUDE) | (height > 2 * LARGEST_ALTITUDE),
                height,
                "{:g} m is no altitude of a sounding; are these feet, or does it stand for a missing value?",
            ),
        ):
            if bad.any():
                i = int(np.argmax(bad))
                h = float(height[i]) if np.isfinite(height[i]) else None
                raise SoundingError(
                    f"{says.format(values[i])}; correct the file or remove the level",
                    file=self.file, row=int(line[i]) or None, sounding=self.name, altitude=h,
                )  # fmt: skip
