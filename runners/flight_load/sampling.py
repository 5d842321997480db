"""Probabilities that a Gaussian process passes a boundary, by importance sampling.

A mixture over times, outputs and sides: draw one of them with probability p_j / S, p_j its own probability of being
beyond the boundary and S their sum; draw its value from its law beyond the boundary, the rest of the path given that
value; the estimate is S over the number of places where the path is beyond (Adler, Blanchet and Liu, Efficient Monte
Carlo for high excursions of Gaussian random fields, Annals of Applied Probability 22, 2012). It is unbiased, has
nothing to tune, and costs the same for p = 1e-6 as for 1e-3. Because a path may pass between two points and be beyond
at none, paths are drawn beyond a boundary drawn in by a few standard deviations of what lies between points, and each
counts with the probability that it passes the true one (:mod:`crossings`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from ...codegen.toolchain.interruption import Workers
from ..solvers.cores import available_cores
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import Sides, instant_level
from .crossings import Boundary, Sightings, sightings
from .mixture import drawn_places
from .norms import Norms, Process
from .process import Steps

LEFT_OUT = 2e-3  # of the probability, at most, that is passed only where no path is drawn
TOGETHER = 512  # paths that a thread draws at a time, from a stream of their own: as many threads, the same numbers
MEMORY = 2e7  # numbers in an array of paths at a time
EVERY = slice(None)


@dataclass(frozen=True, eq=False)
class Draws:
    """Paths drawn beyond a boundary: where they come near it, and their weights.

    Attributes
    ----------
    process : Process
    weight : (count,) array
        S over the number of places beyond the drawn-in boundary.
    near, coarser : Sightings
        On the grid seen, and on every second point of it.
    deviations : (count, m, r) array or None
        Of the paths from the mean on the grid drawn, where they are kept.
    first, last : int
        Points between which paths were drawn,
    outputs : (k,) array of int or None
        and of which outputs: all else is passed so rarely that it is left out.
    """

    process: Process
    weight: NDArray[np.float64]
    near: Sightings
    coarser: Sightings
    deviations: NDArray[np.float64] | None = None
    first: int = 0
    last: int | None = None
    outputs: NDArray[np.intp] | None = None

    def _seen(self, boundary: Boundary) -> Boundary:
        return boundary if self.outputs is None else boundary.of(slice(self.first, self.last), self.outputs)

    def contributions(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return what each draw adds to the probability of passing a boundary, whose mean is the estimate, (count,).

        The boundary lies nowhere inside the one drawn for.
        """
        return self.weight * self.near.passed(self._seen(boundary))

    def coarser_contributions(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return the same by looking at every second point only."""
        return self.weight * self.coarser.passed(self._seen(boundary).at(slice(None, None, 2)))

    def places(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return how the probability of passing falls on points, outputs and sides, each path where it is worst.

        Returns
        -------
        (m, r, 2) array
        """
        found = np.zeros((*boundary.upper.shape, 2))
        path, point, output, side = self.near.worst(self._seen(boundary))
        if self.outputs is not None:
            point, output = point + self.first, self.outputs[output]
        np.add.at(found, (point, output, side), self.contributions(boundary)[path])
        return found / self.weight.size

    def by_output(self, boundary: Boundary) -> NDArray[np.float64]:
        """Return the probability that each output passes a boundary, (r,); zero where paths were left out."""
        each = (self.weight[:, None] * self.near.passed_by_output(self._seen(boundary))).mean(axis=0)
        if self.outputs is None:
            return each
        found = np.zeros(boundary.upper.shape[1])
        found[self.outputs] = each
        return found


def instant_probabilities(process: Process, boundary: Boundary) -> NDArray[np.float64]:
    """Return the logarithm of the probability of being beyond a boundary on the grid drawn, (2 sides, m, r)."""
    if isinstance(process, Norms):
        return process.instant_probabilities(boundary)
    std, mean = process.std, process.drawn.mean
    beyond = np.stack([mean - boundary.upper, boundary.lower - mean])
    with np.errstate(divide="ignore", invalid="ignore"):
        deviate = beyond / std
    # without spread an output is beyond or not
    return np.where(std > 0, log_ndtr(np.where(std > 0, deviate, 0.0)), np.where(beyond > 0, 0.0, -np.inf))


def largest_instant(process: Process, boundary: Boundary) -> float:
    """Return the logarithm of the probability of being beyond a boundary at the worst point, output and side drawn."""
    if isinstance(process, Norms):
        return process.largest_instant(boundary)
    return float(instant_probabilities(process, boundary).max())


def instant_levels(process: Process, probability: float, sides: Sides, points: slice = EVERY) -> NDArray[np.float64]:
    """Return the level that each output passes with a probability at each of some points drawn, (k, r)."""
    if isinstance(process, Norms):
        return NormOfNormal(process.law.mean[points], process.law.covariance[points]).percentile(probability)
    return instant_level(process.drawn.mean[points], process.std[points], probability, sides)


def sighted_steps(process: Process, count: int, steps: Steps, boundary: Boundary, every: int = 1) -> Sightings:
    """Return those of some steps of drawn deviations that come near a boundary; as :func:`sightings`."""
    if isinstance(process, Norms):
        return process.sightings(count, steps, boundary, every)
    return sightings(count, steps, boundary, process.seen, every)


def steps_near(
    process: Process, deviations: NDArray[np.float64], near: NDArray[np.bool_], random: np.random.Generator
) -> tuple[Steps, Steps]:
    """Return the steps of deviations beside points ``near`` (count, m) on the grid seen and on every second point."""
    return (process.of if isinstance(process, Norms) else process).steps_near(deviations, near, random)


def draw_beyond(
    process: Process, boundary: Boundary, random: np.random.Generator, count: int, keep: bool = False
) -> Draws:
    """Draw paths beyond a boundary, in parts that fit into memory.

    Parameters
    ----------
    process : Process
    boundary : Boundary
        On the grid seen.
    random : Generator
    count : int
    keep : bool
        Whether the deviations are kept, for few outputs.
    """
    points, outputs = _worth_drawing(process, boundary)
    smaller = None if outputs is None else process.restricted(points, outputs)
    if smaller is not None and outputs is not None:
        drawn = _drawn(smaller, boundary.of(points, outputs), random, count, keep)
        return replace(drawn, process=process, first=points.start, last=points.stop, outputs=outputs)
    return _drawn(process, boundary, random, count, keep)


def _drawn(process: Process, boundary: Boundary, random: np.random.Generator, count: int, keep: bool) -> Draws:
    largest = min(TOGETHER, max(16, int(MEMORY / process.drawn.mean.size)))
    sizes = [min(largest, count - first) for first in range(0, count, largest)]

    def part(size: int, own: np.random.Generator) -> tuple[Sightings, Sightings, NDArray, NDArray]:
        deviations, close, weight = _paths_beyond(process, boundary, own, size)
        steps, every_second = steps_near(process, deviations, close, own)
        near = sighted_steps(process, size, steps, boundary)
        coarser = sighted_steps(process, size, every_second, boundary, every=2)
        return near, coarser, weight, deviations if keep else weight

    with Workers(min(len(sizes), available_cores())) as pool:
        near, coarser, weights, kept = zip(*pool.map(part, sizes, random.spawn(len(sizes))), strict=True)
    sighted = Sightings.joined(near), Sightings.joined(coarser)
    return Draws(process, np.concatenate(weights), *sighted, np.concatenate(kept) if keep else None)


def _worth_drawing(process: Process, boundary: Boundary) -> tuple[slice, NDArray[np.intp] | None]:
    """Return points and outputs outside which passing is so rare that its sum does not matter; None for all of them."""
    if process.drawn.mean.shape[1] == 1:
        return slice(None), None
    inner = boundary.at(slice(None, None, process.stride)).drawn_in(process.between)
    chance = np.exp(instant_probabilities(process, inner)).sum(axis=0)
    spare = 0.5 * LEFT_OUT * float(np.exp(instant_probabilities(process, boundary)).max())
    by_point, by_output = chance.sum(axis=1), chance.sum(axis=0)
    first = int(np.searchsorted(np.cumsum(by_point), 0.5 * spare))
    last = by_point.size - int(np.searchsorted(np.cumsum(by_point[::-1]), 0.5 * spare))
    order = np.argsort(by_output)
    outputs = np.sort(order[int(np.searchsorted(np.cumsum(by_output[order]), spare)) :])
    if last - first < 3 or not outputs.size or (last - first, outputs.size) == chance.shape:
        return slice(None), None
    return slice(first, last), outputs


def _paths_beyond(
    process: Process, boundary: Boundary, random: np.random.Generator, count: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64]]:
    """Return deviations (count, m, r) on the grid drawn, where paths are near the boundary (count, m), and weights."""
    outer, reach = boundary.at(slice(None, None, process.stride)), 2 * process.between
    if isinstance(process, Norms):
        deviations, sizes, weight = process.paths_beyond(outer, random, count)
        return deviations, _may_be_first(sizes, outer.upper, reach), weight
    inner = outer.drawn_in(process.between)
    log_p = instant_probabilities(process, inner)
    log_sum = float(np.logaddexp.reduce(log_p, axis=None))
    deviations = process.deviations(random, count)
    if not np.isfinite(log_sum):  # nothing ever comes near
        return deviations, np.zeros(deviations.shape[:2], bool), np.zeros(count)
    (sides, points, outputs), deviate = drawn_places(log_p, log_sum, random, count)
    std = process.std[points, outputs]
    wanted = np.where(sides == 0, 1.0, -1.0) * deviate * std
    own = deviations[np.arange(count), points, outputs]
    gain = np.divide(wanted - own, std**2, out=np.zeros(count), where=std > 0)
    deviations += gain[:, None, None] * process.covariances(points, outputs)
    drawn = process.drawn.mean + deviations
    number = (drawn > inner.upper).sum(axis=(1, 2)) + (drawn < inner.lower).sum(axis=(1, 2))
    near = _may_be_first(drawn, outer.upper, reach) | _may_be_first(-drawn, -outer.lower, reach)
    return deviations, near, np.exp(log_sum - np.log(np.maximum(number, 1)))


def _may_be_first(
    drawn: NDArray[np.float64], bound: NDArray[np.float64], reach: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return where paths (count, m, r) may pass a bound (m, r) before they do elsewhere, as it moves out (count, m).

    Moved by the same everywhere, or multiplied: a path that stays beyond it for long, such as one of a large bias,
    needs to be looked at only where it goes farthest, and within reach of that.
    """
    close = drawn > bound - reach
    if not close.any():
        return close[:, :, 0]
    beyond = drawn - bound
    found = beyond >= beyond.max(axis=1, keepdims=True) - reach
    if (bound > 0).all():
        share = drawn / bound
        found |= share >= share.max(axis=1, keepdims=True) - reach / bound
    return np.any(close & found, axis=2)
