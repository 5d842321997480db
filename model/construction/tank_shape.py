"""Area, volume, level and centre of gravity of a tank, exact for its sections."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from .structure import Tank, TankSection

_HALVINGS = 60  # of an interval of some metres: below rounding


@dataclass(frozen=True, eq=False)
class TankShape:
    """Cross-section of a tank over its station: quadratic pieces A(x) = c0 + c1 x + c2 x^2 with x from ``edges[i]``.

    Where sections that are taken away exceed the others, as a tunnel does at the tip of a dome, the area is zero.

    Attributes
    ----------
    edges : (n + 1,) array
        Stations (m).
    coefficients : (n, 3) array
        c0 (m2), c1 (m), c2 (1).
    volume_at_edges : (n + 1,) array
        m3.
    """

    edges: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    volume_at_edges: NDArray[np.float64]

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, tank: Tank) -> TankShape:
        """Return the shape of a tank.

        Raises
        ------
        DataError
            If what is taken away closes the tank off, so that liquid could not flow.
        """
        edges, coefficients = _pieces(tank.sections)
        filled = np.flatnonzero(np.abs(coefficients).sum(axis=1) > 0)
        if not filled.size or (np.diff(filled) > 1).any():
            at = f" at station {edges[filled[np.argmax(np.diff(filled) > 1)] + 1]:g} m" if filled.size else ""
            raise DataError(
                f"tank '{tank.name}' is closed off{at}: the sections taken away leave no area; correct them"
            )
        edges, coefficients = edges[filled[0] : filled[-1] + 2], coefficients[filled[0] : filled[-1] + 1]
        lengths = np.diff(edges)
        powers = lengths[:, None] ** np.arange(1, 4) / np.arange(1, 4)
        volume = np.concatenate([[0.0], np.cumsum((coefficients * powers).sum(axis=1))])
        return cls(edges, coefficients, volume)

    @property
    def capacity(self) -> float:
        """Volume of the whole tank (m3)."""
        return float(self.volume_at_edges[-1])

    @property
    def largest_radius(self) -> float:
        """Radius of the circle of the largest area (m)."""
        lengths = np.diff(self.edges)
        c1, c2 = self.coefficients[:, 1], self.coefficients[:, 2]
        tops = np.divide(-c1, 2 * c2, out=np.zeros_like(c1), where=c2 != 0)
        inside = self.edges[:-1] + np.clip(tops, 0, lengths)
        # an edge belongs to the piece forward of it, so the aft piece is asked just before the edge
        near = np.concatenate([self.edges, inside, np.nextafter(self.edges[1:], -math.inf)])
        return float(self.radius(near).max())

    def area(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the cross-section at stations (m2); zero outside the tank."""
        x = np.asarray(station, dtype=float)
        i, dx = self._locate(x)
        c = self.coefficients[i]
        inside = (x >= self.edges[0]) & (x <= self.edges[-1])
        return np.where(inside, np.maximum(c[..., 0] + dx * (c[..., 1] + dx * c[..., 2]), 0.0), 0.0)

    def radius(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the radius of the circle that has the tank's area (m)."""
        return np.sqrt(self.area(station) / math.pi)

    def volume(self, station: ArrayLike) -> NDArray[np.float64]:
        """Return the volume below stations (m3)."""
        x = np.clip(np.asarray(station, dtype=float), self.edges[0], self.edges[-1])
        i, dx = self._locate(x)
        c = self.coefficients[i]
        return self.volume_at_edges[i] + dx * (c[..., 0] + dx * (c[..., 1] / 2 + dx * c[..., 2] / 3))

    def level(self, volume: ArrayLike) -> NDArray[np.float64]:
        """Return the station of the free surface that has a volume below it (m).

        Raises
        ------
        DataError
            If the volume is negative or more than the tank holds.
        """
        v = np.asarray(volume, dtype=float)
        slack = 1e-12 * self.capacity
        if not ((v >= -slack) & (v <= self.capacity + slack)).all():
            worst = float(v.max() if v.max() > self.capacity else v.min())
            raise DataError(f"a tank of {self.capacity:.4g} m3 cannot hold {worst:.4g} m3; correct the liquid mass")
        v = np.clip(v, 0.0, self.capacity)
        i = np.clip(np.searchsorted(self.volume_at_edges, v, side="right") - 1, 0, len(self.coefficients) - 1)
        low, high = self.edges[i], self.edges[i + 1]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            short = self.volume(middle) < v
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return 0.5 * (low + high)

    def moments(self, level: ArrayLike) -> NDArray[np.float64]:
        """Return the integrals of A, A x and A x^2 from the bottom to levels (..., 3); x: station (m3, m4, m5)."""
        top = np.clip(np.asarray(level, dtype=float)[..., None], self.edges[:-1], self.edges[1:]) - self.edges[:-1]
        begin = self.edges[:-1]
        powers = top[..., None] ** np.arange(1, 6) / np.arange(1, 6)  # of y^0 .. y^4, y from the piece's begin
        of_y = [(self.coefficients * powers[..., k : k + 3]).sum(axis=-1) for k in range(3)]
        return np.stack(
            [
                of_y[0].sum(axis=-1),
                (of_y[1] + begin * of_y[0]).sum(axis=-1),
                (of_y[2] + 2 * begin * of_y[1] + begin**2 * of_y[0]).sum(axis=-1),
            ],
            axis=-1,
        )

    def _locate(self, x: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        i = np.clip(np.searchsorted(self.edges, x, side="right") - 1, 0, len(self.coefficients) - 1)
        return i, x - self.edges[i]


def _pieces(sections: Sequence[TankSection]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return edges and quadratics of the summed area, split where it changes sign, zero where it would be negative."""
    stations = np.unique([s for section in sections for s in (section.begin, section.end)])
    edges: list[float] = [float(stations[0])]
    rows: list[NDArray[np.float64]] = []
    for a, b in pairwise(stations):
        c = np.zeros(3)
        for section in sections:
            if section.begin < 0.5 * (a + b) < section.end:
                c += section.sign * section.count * _quadratic(section, a)
        scale = np.abs(c * (1.0, b - a, (b - a) ** 2)).max()
        roots = np.roots(np.trim_zeros(c[::-1], "f")) if scale > 0 else np.array([])
        margin = 1e-9 * (b - a)
        inner = sorted(float(r.real) for r in roots if abs(r.imag) < 1e-12 and margin < r.real < b - a - margin)
        for y0, y1 in pairwise([0.0, *inner, b - a]):
            shifted = np.array([c[0] + y0 * (c[1] + y0 * c[2]), c[1] + 2 * y0 * c[2], c[2]])
            middle = 0.5 * (y1 - y0)
            positive = shifted[0] + middle * (shifted[1] + middle * shifted[2]) > 1e-12 * scale
            rows.append(shifted if positive else np.zeros(3))
            edges.append(float(b if y1 == b - a else a + y1))
    return np.array(edges), np.array(rows)


def _quadratic(section: TankSection, origin: float) -> NDArray[np.float64]:
    """Return the area of a section as a quadratic in the distance from ``origin``."""
    if section.kind == "cylinder":
        return np.array([math.pi * section.radius**2, 0.0, 0.0])
    if section.kind == "cone":
        slope = (section.end_radius - section.radius) / (section.end - section.begin)
        radius = section.radius + slope * (origin - section.begin)
        return math.pi * np.array([radius**2, 2 * radius * slope, slope**2])
    y = origin - section.center
    factor = math.pi * (section.radius / section.semi_axis) ** 2
    return factor * np.array([section.semi_axis**2 - y**2, -2 * y, -1.0])
