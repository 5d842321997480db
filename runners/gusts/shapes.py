"""Shapes of discrete gusts over altitude.

Each is the wind W(s) at s metres above the gust's start, smooth between its corners. Lengths are along altitude, not
along the path, which is longer by 1 / sin(flight path angle). ``shortest`` is the least length that a shape can have,
m; ``holds``: the wind stays what it is at the last corner, where it is zero beyond in the others.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError

AMPLITUDE = 9.0  # m/s: quasi-square gusts of Apollo and Shuttle (Leahy, NTRS 20080014847)
LENGTHS = (60.0, 300.0)  # m, of the same
EDGE = 30.0  # m, of the same


class GustError(AscentwindError):
    """A gust has no such size, or does not lie on the flight."""


@dataclass(frozen=True)
class OneMinusCosine:
    """A full wave A/2 (1 - cos(2 pi s / L)), 0 <= s <= L.

    Parameters
    ----------
    length : float
        L, m.
    amplitude : float
        A, m/s.

    Raises
    ------
    GustError
    """

    length: float = 150.0
    amplitude: float = AMPLITUDE

    name = "one-minus-cosine"
    shortest = 0.0
    holds = False

    def __post_init__(self) -> None:
        _check(self)

    @property
    def corners(self) -> tuple[float, ...]:
        """Distances from the start, m, between which the wind is smooth."""
        return 0.0, self.length

    def at(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the wind at distances from the start.

        Parameters
        ----------
        distance : array
            m.

        Returns
        -------
        array
            m/s, of the same shape.
        """
        inside = (distance >= 0) & (distance <= self.length)
        return np.where(inside, 0.5 * self.amplitude * (1 - np.cos(2 * np.pi * distance / self.length)), 0.0)


@dataclass(frozen=True)
class QuasiSquare:
    """NASA's quasi-square gust: edges A/2 (1 - cos(pi s / e)), between them a plateau.

    Parameters
    ----------
    length : float
        From the foot of the first edge to that of the second, m; at least two edges.
    amplitude : float
        A, m/s.
    edge : float
        e, m. Zero makes it a box.

    Raises
    ------
    GustError
    """

    length: float = 150.0
    amplitude: float = AMPLITUDE
    edge: float = EDGE

    name = "quasi-square"
    holds = False

    def __post_init__(self) -> None:
        _check(self)
        if not (_is_number(self.edge) and self.edge >= 0):
            raise GustError(f"the edges of a gust cannot be {self.edge!r:.60} m long; give zero or more, such as 30")
        if self.length < 2 * self.edge:
            raise GustError(
                f"a quasi-square gust of {self.length:g} m has no room for two edges of {self.edge:g} m; make it at "
                f"least {2 * self.edge:g} m long, or the edges shorter"
            )

    @property
    def shortest(self) -> float:
        """The least length with these edges, m."""
        return 2 * self.edge

    @property
    def corners(self) -> tuple[float, ...]:
        """Distances from the start, m, between which the wind is smooth."""
        return tuple(sorted({0.0, self.edge, self.length - self.edge, self.length}))

    def at(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the wind at distances from the start.

        Parameters
        ----------
        distance : array
            m.

        Returns
        -------
        array
            m/s, of the same shape.
        """
        from_end = np.minimum(distance, self.length - distance)
        if not self.edge:
            return np.where(from_end >= 0, self.amplitude, 0.0)
        return self.amplitude * _rise(from_end, self.edge)


@dataclass(frozen=True)
class RampAndHold:
    """The discrete gust of MIL-F-8785C: A/2 (1 - cos(pi s / d)) to s = d, and A from there on.

    Parameters
    ----------
    length : float
        d, m.
    amplitude : float
        A, m/s.

    Raises
    ------
    GustError
    """

    length: float = 150.0
    amplitude: float = AMPLITUDE

    name = "ramp-and-hold"
    shortest = 0.0
    holds = True

    def __post_init__(self) -> None:
        _check(self)

    @property
    def corners(self) -> tuple[float, ...]:
        """Distances from the start, m, between which the wind is smooth."""
        return 0.0, self.length

    def at(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the wind at distances from the start.

        Parameters
        ----------
        distance : array
            m.

        Returns
        -------
        array
            m/s, of the same shape.
        """
        return self.amplitude * _rise(distance, self.length)


Gust = OneMinusCosine | QuasiSquare | RampAndHold
SHAPES: dict[str, type[Gust]] = {shape.name: shape for shape in (OneMinusCosine, QuasiSquare, RampAndHold)}


def checked_gust(gust: object) -> Gust:
    """Return a gust, if it is one.

    Raises
    ------
    GustError
    """
    if not isinstance(gust, Gust):
        raise GustError(f"{gust!r:.60} is no gust; give a shape: OneMinusCosine(), QuasiSquare() or RampAndHold()")
    return gust


def _rise(distance: NDArray[np.float64], over: float) -> NDArray[np.float64]:
    return 0.5 * (1 - np.cos(np.pi * np.clip(distance / over, 0.0, 1.0)))


def _is_number(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= sys.float_info.max


def _check(gust: Gust) -> None:
    """Raise if a length or an amplitude is none."""
    for what, value in (("length", gust.length), ("amplitude", gust.amplitude)):
        if not _is_number(value):
            raise GustError(f"the {what} of a gust cannot be {value!r:.60}; give a number")
    if not gust.length > 0:
        raise GustError(f"a gust of {gust.length:g} m has no extent; give a positive length, such as 150 m")
    if not gust.amplitude:
        raise GustError("a gust of 0 m/s blows nothing; give an amplitude, such as 9 m/s")
