"""Whether a path passes a boundary, between the points of its grid too.

Where white noise reaches an output directly (C B != 0) it moves between two points as a Brownian bridge of that
diffusion, which passes a boundary at distances a and b from its ends with the probability exp(-2 a b / (s^2 dt)).
Without it the maximum of a grid is low by about 0.5826 s sqrt(dt). Outputs that one noise moves the same way pass
together: of their probabilities the largest counts; opposite ways are independent. A differentiable output is taken at
the points of the grid alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .process import Grid, Steps

NEVER = -30.0  # exponent of a bridge that does not count


@dataclass(frozen=True, eq=False)
class Boundary:
    """What r outputs may not pass, upward or downward, at m times; infinite where there is no bound.

    Attributes
    ----------
    upper, lower : (m, r) arrays
    """

    upper: NDArray[np.float64]
    lower: NDArray[np.float64]

    @staticmethod
    def around(limit: NDArray[np.float64], sides: str) -> Boundary:
        """Return a boundary at a limit (m, r) on one side or, with 'both', at its negative as well."""
        nowhere = np.full(limit.shape, np.inf)
        return Boundary(nowhere if sides == "lower" else limit, -nowhere if sides == "upper" else -limit)

    @staticmethod
    def constant(level: float, grid: Grid, sides: str) -> Boundary:
        """Return the same level at all points and of all outputs of a grid."""
        return Boundary.around(np.full(grid.mean.shape, level), sides)

    def at(self, points: slice) -> Boundary:
        """Return the boundary at some of its points."""
        return Boundary(self.upper[points], self.lower[points])

    def of(self, points: slice, outputs: NDArray[np.intp]) -> Boundary:
        """Return the boundary of some outputs at some points."""
        return Boundary(self.upper[points][:, outputs], self.lower[points][:, outputs])

    def drawn_in(self, by: NDArray[np.float64]) -> Boundary:
        """Return the boundary moved inward by (m, r)."""
        return Boundary(self.upper - by, self.lower + by)


@dataclass(frozen=True, eq=False)
class Sightings:
    """Those steps of many paths that come near a boundary, of which most paths have few.

    Attributes
    ----------
    count : int
        Paths.
    path, step : (k,) arrays of int
        Sorted by path, then by step.
    begin, end : (k, r) arrays
        Values at the ends of the step.
    variance : (k, r) array
        Of the bridge.
    turned : (k, r) array of bool
        Whether white noise moves the output the other way.
    """

    count: int
    path: NDArray[np.intp]
    step: NDArray[np.intp]
    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    variance: NDArray[np.float64]
    turned: NDArray[np.bool_]

    @staticmethod
    def joined(parts: Sequence[Sightings]) -> Sightings:
        """Return the sightings of several sets of paths as those of one."""
        before = np.cumsum([0, *(part.count for part in parts)])
        path = np.concatenate([part.path + first for part, first in zip(parts, before, strict=False)])
        names = ("step", "begin", "end", "variance", "turned")
        rest = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
        return Sightings(int(before[-1]), path, *rest)

    def passed(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return the probability that each path passes a boundary, no nearer than the one looked at, (count,)."""
        survives = np.ones(self.count)
        (up, above), (down, below) = (self._bridges(boundary, side) for side in (0, 1))
        if self.turned.any():
            up, down = np.where(self.turned, down, up), np.where(self.turned, up, down)
        for exponent in (up, down):
            np.multiply.at(survives, self.path, 1.0 - np.exp(_largest(exponent)))
        survives[self.path[_any(above | below)]] = 0.0
        return 1.0 - survives

    def passed_by_output(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return the same for every output by itself, (count, r)."""
        survives = np.ones((self.count, self.begin.shape[1]))
        for side in (0, 1):
            exponent, beyond = self._bridges(boundary, side)
            stays = 1.0 - np.exp(exponent)
            stays = np.where(beyond, 0.0, stays)
            np.multiply.at(survives, self.path, stays)
        return 1.0 - survives

    def worst(self, boundary: Boundary) -> tuple[NDArray[np.intp], ...]:
        """Return, of the paths that were sighted, where each goes farthest beyond a boundary.

        Returns
        -------
        number, point, output, side : (k,) arrays of int
            Of the path, of the point of time, of the output; 0 on the upper side, 1 on the lower.
        """
        sides = [np.stack(self._gaps(boundary, side), axis=1) for side in (0, 1)]
        gaps = np.stack(sides, axis=3)  # (k, ends, r, sides)
        flat = gaps.reshape(len(gaps), int(np.prod(gaps.shape[1:])))
        place = flat.argmin(axis=1)
        order = np.lexsort((flat[np.arange(place.size), place], self.path))
        numbers, first = np.unique(self.path[order], return_index=True)
        chosen = order[first]
        later, output, side = np.unravel_index(place[chosen], gaps.shape[1:])
        return numbers, self.step[chosen] + later, output, side

    def _gaps(self, boundary: Boundary, side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances to a boundary at both ends, (k, r), negative beyond it."""
        if side == 0:
            return boundary.upper[self.step] - self.begin, boundary.upper[self.step + 1] - self.end
        return self.begin - boundary.lower[self.step], self.end - boundary.lower[self.step + 1]

    def _bridges(self, boundary: Boundary, side: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return ln of the probability that bridges pass on one side, and whether an end lies beyond, (k, r)."""
        bound = boundary.upper if side == 0 else boundary.lower
        if np.isinf(bound).all() and (bound > 0).all() == (side == 0):
            return np.full(self.begin.shape, -np.inf), np.zeros(self.begin.shape, bool)
        at_begin, at_end = self._gaps(boundary, side)
        beyond = (at_begin < 0) | (at_end < 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            exponent = at_begin * at_end / (-0.5 * self.variance)
        bridged = (self.variance > 0) & np.isfinite(at_begin)
        return np.minimum(np.where(bridged, exponent, -np.inf), 0.0), beyond


def _largest(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest value of every row; most often there is one."""
    return values[:, 0] if values.shape[1] == 1 else values.max(axis=1, initial=-np.inf)


def _any(values: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return values[:, 0] if values.shape[1] == 1 else np.any(values, axis=1, keepdims=True)[:, 0]


def sightings(count: int, steps: Steps, boundary: Boundary, grid: Grid, every: int = 1) -> Sightings:
    """Return those of some steps of paths that come near a boundary.

    Parameters
    ----------
    count : int
        Paths.
    steps : Steps
    boundary : Boundary
    grid : Grid
    every : int
        The steps are those of every second, third, ... point of the grid; so is the boundary looked at.
    """
    at = slice(None, None, every)
    seen, times, mean, diffusion = boundary.at(at), grid.times[at], grid.mean[at], grid.diffusion[at]
    variance = 0.5 * (diffusion[1:] ** 2 + diffusion[:-1] ** 2) * np.diff(times)[:, None]
    moved = Steps(steps.path, steps.step, mean[steps.step] + steps.begin, mean[steps.step + 1] + steps.end)
    return sighted(count, moved, seen, variance[steps.step], (diffusion[1:] < 0)[steps.step])


def sighted(
    count: int, steps: Steps, seen: Boundary, variance: NDArray[np.float64], turned: NDArray[np.bool_]
) -> Sightings:
    """Return those of some steps that come near a boundary.

    Parameters
    ----------
    count : int
        Paths.
    steps : Steps
        With values, not deviations, at their ends.
    seen : Boundary
        At the points that steps are between.
    variance : (k, r) array
        Of the bridge of each step.
    turned : (k, r) array of bool
        Whether white noise moves the output the other way.
    """
    reach = np.sqrt(-0.5 * NEVER * variance)  # how near an end lies at least to where a bridge counts
    begin, end = steps.begin, steps.end
    near = _near(steps, begin, end, seen.upper, reach) | _near(steps, -begin, -end, -seen.lower, reach)
    kept = np.flatnonzero(_any(near))
    return Sightings(count, steps.path[kept], steps.step[kept], begin[kept], end[kept], variance[kept], turned[kept])


def _near(
    steps: Steps,
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    bound: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return which steps come within reach of a bound (m, r) and of where their path is farthest beyond it, (k, r).

    At any other step the path does not pass the bound moved out, or passes it elsewhere too; moved out by the same
    everywhere, or multiplied.
    """
    here, there = bound[steps.step], bound[steps.step + 1]
    close = (begin > here - reach) | (end > there - reach)
    if not np.isfinite(bound).all() or not close.any():
        return close
    first = np.flatnonzero(np.diff(steps.path, prepend=-1))
    count = np.diff(first, append=steps.path.size)

    def foremost(values: NDArray[np.float64], reach: NDArray[np.float64]) -> NDArray[np.bool_]:
        return values >= np.repeat(np.maximum.reduceat(values, first, axis=0), count, axis=0) - reach

    found = foremost(np.maximum(begin - here, end - there), reach)
    if (bound > 0).all():
        found |= foremost(np.maximum(begin / here, end / there), reach / np.minimum(here, there))
    return close & found
