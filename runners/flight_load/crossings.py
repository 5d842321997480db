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

NEVER = -50.0  # exponent of a bridge that does not count


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
    begin, end : (k, r, 2) arrays
        Values at the ends of the step, upper side first, with the sign that makes larger values worse.
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
        at_begin, at_end = self._gaps(boundary)
        survives = np.ones(self.count)
        with np.errstate(divide="ignore", invalid="ignore"):
            exponent = -2.0 * at_begin * at_end / self.variance[:, :, None]
        exponent = np.where((self.variance > 0)[:, :, None] & np.isfinite(at_begin), exponent, -np.inf)
        exponent = np.where(self.turned[:, :, None], exponent[:, :, ::-1], exponent)
        bridge = np.exp(np.minimum(exponent.max(axis=1, initial=-np.inf), 0.0))
        np.multiply.at(survives, self.path, np.prod(1.0 - bridge, axis=1))
        beyond = (np.minimum(at_begin, at_end) < 0).any(axis=(1, 2))
        survives[self.path[beyond]] = 0.0
        return 1.0 - survives

    def passed_by_output(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return the same for every output by itself, (count, r)."""
        at_begin, at_end = self._gaps(boundary)
        with np.errstate(divide="ignore", invalid="ignore"):
            exponent = -2.0 * at_begin * at_end / self.variance[:, :, None]
        exponent = np.where((self.variance > 0)[:, :, None] & np.isfinite(at_begin), exponent, -np.inf)
        stays = np.prod(1.0 - np.exp(np.minimum(exponent, 0.0)), axis=2)
        stays[(np.minimum(at_begin, at_end) < 0).any(axis=2)] = 0.0
        survives = np.ones((self.count, self.begin.shape[1]))
        np.multiply.at(survives, self.path, stays)
        return 1.0 - survives

    def worst(self, boundary: Boundary) -> tuple[NDArray[np.intp], ...]:
        """Return, of the paths that were sighted, where each goes farthest beyond a boundary.

        Returns
        -------
        number, point, output, side : (k,) arrays of int
            Of the path, of the point of time, of the output; 0 on the upper side, 1 on the lower.
        """
        gaps = np.stack(self._gaps(boundary), axis=1)  # (k, ends, r, sides)
        flat = gaps.reshape(len(gaps), -1)
        place = flat.argmin(axis=1)
        order = np.lexsort((flat[np.arange(place.size), place], self.path))
        numbers, first = np.unique(self.path[order], return_index=True)
        chosen = order[first]
        later, output, side = np.unravel_index(place[chosen], gaps.shape[1:])
        return numbers, self.step[chosen] + later, output, side

    def _gaps(self, boundary: Boundary) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        bounds = np.stack([boundary.upper, -boundary.lower], axis=2)
        return bounds[self.step] - self.begin, bounds[self.step + 1] - self.end


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
    reach = np.sqrt(-0.5 * NEVER * variance)[steps.step]  # how near an end lies at least to where a bridge counts
    begin, end = mean[steps.step] + steps.begin, mean[steps.step + 1] + steps.end
    close = (begin > seen.upper[steps.step] - reach) | (begin < seen.lower[steps.step] + reach)
    close |= (end > seen.upper[steps.step + 1] - reach) | (end < seen.lower[steps.step + 1] + reach)
    kept = np.flatnonzero(close.any(axis=1))
    begin, end, step = begin[kept], end[kept], steps.step[kept]
    return Sightings(
        count,
        steps.path[kept],
        step,
        np.stack([begin, -begin], axis=2),
        np.stack([end, -end], axis=2),
        variance[step],
        (diffusion[1:] < 0)[step],
    )
