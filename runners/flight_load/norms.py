"""The norms of pairs of outputs, such as bending moments in two planes, as what paths are drawn of and seen by.

A path of norms is one of both outputs. Beyond a circle it is drawn by importance sampling with half-planes whose lines
enclose the circle as the places of the mixture (:mod:`sampling`): a time, a pair and a direction are drawn by their
probability of being beyond the line, the component along that direction from its law beyond it, the rest of the paths
given that component; a draw weighs the sum of all probabilities over the number of lines that it is beyond. That is
unbiased for any number of directions. Between points a norm moves as a Brownian bridge of the diffusion that white
noise has along the radius.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from ..solvers.markov_chain import MarkovChain
from ..statistics.norm import NormOfNormal
from .crossings import Boundary, Sightings, sighted
from .mixture import drawn_places
from .process import Grid, JointOutputs, ManyOutputs, Steps, joint_outputs

Array = NDArray[np.float64]

DIRECTIONS = 24
ANGLES = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
LINES = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
ENCLOSING = np.cos(np.pi / DIRECTIONS)  # distance of lines that enclose a circle of radius one
TOGETHER = 512  # norms whose law is computed at a time, each by some 1600 points of its circle
MATTERS = 1e-6  # of the largest probability of an instant: smaller ones are taken from half-planes


@dataclass(frozen=True, eq=False)
class Norms:
    """The norms of r pairs of outputs.

    Attributes
    ----------
    of : JointOutputs or ManyOutputs
        2 r outputs, those of a pair one after the other.
    diffusion : (m, r, 2, 2) array
        Of both outputs of a pair by white noise directly, C B B' C', unit^2 / s, on the grid seen.
    """

    of: JointOutputs | ManyOutputs
    diffusion: Array

    @staticmethod
    def joint(
        chain: MarkovChain, row: Array, mean: Array, halvings: int, sources: Sequence[int] | None = None
    ) -> Norms:
        """Return the norm of one pair (row (m', 2, n), mean (m', 2)); parameters as for :func:`joint_outputs`."""
        direct = row @ chain.acting_noise_matrix(sources)
        return Norms(joint_outputs(chain, row, mean, halvings, sources), (direct @ direct.swapaxes(1, 2))[:, None])

    @staticmethod
    def many(chain: MarkovChain, row: Array, mean: Array) -> Norms:
        """Return the norms of pairs (row (m, 2 r, n), mean (m, 2 r)) by the states of a chain."""
        direct = row @ chain.noise_matrix
        direct = direct.reshape(len(direct), -1, 2, direct.shape[2])
        return Norms(ManyOutputs(chain, row, mean), direct @ direct.swapaxes(2, 3))

    @cached_property
    def drawn(self) -> Grid:
        """Points drawn, with the norms of the means and the largest diffusion in any direction."""
        return self._grid(self.of.drawn, self.diffusion[:: self.stride])

    @cached_property
    def seen(self) -> Grid:
        return self._grid(self.of.seen, self.diffusion)

    @property
    def stride(self) -> int:
        return self.of.stride

    @staticmethod
    def _grid(grid: Grid, diffusion: Array) -> Grid:
        largest = np.sqrt(np.maximum(np.linalg.eigvalsh(diffusion)[..., 1], 0.0))
        return Grid(grid.times, np.linalg.norm(_pairs(grid.mean), axis=2), largest)

    @cached_property
    def law(self) -> NormOfNormal:
        """The law of every norm at the points drawn, (m, r)."""
        whole = self.of.instant_covariance()
        at = 2 * np.arange(whole.shape[1] // 2)[:, None] + np.arange(2)
        return NormOfNormal(_pairs(self.of.drawn.mean), whole[:, at[:, :, None], at[:, None, :]])

    @cached_property
    def std(self) -> Array:
        """The largest standard deviation in any direction at the points drawn, (m, r)."""
        return self.law.ellipse()[0]

    @cached_property
    def between(self) -> Array:
        """How far a path goes between two points drawn without being seen at either, (m, r)."""
        return np.linalg.norm(_pairs(self.of.between), axis=2)

    @property
    def freedom(self) -> Array:
        """The largest part of a variance by which halvings are off near each point seen, (m',)."""
        return self.of.freedom

    def restricted(self, points: slice, outputs: NDArray[np.intp]) -> Norms | None:
        """Return the process at some consecutive points drawn and of some norms; None where that saves nothing."""
        both = (2 * outputs[:, None] + np.arange(2)).ravel()
        smaller = self.of.restricted(points, both)
        return None if smaller is None else Norms(smaller, self.diffusion[points][:, outputs])

    def instant_probabilities(self, boundary: Boundary) -> Array:
        """Return the logarithm of the probability of being beyond on the grid drawn, (2 sides, m, r); never below.

        By the law of the norm where it matters, elsewhere by the half-plane passed most often, which is less.
        """
        found = self._by_lines(boundary.upper, LINES).max(axis=0)
        matter = found >= found.max() + np.log(MATTERS)
        mean, covariance, level = self.law.mean[matter], self.law.covariance[matter], boundary.upper[matter]
        exact = np.empty(level.size)
        for first in range(0, level.size, TOGETHER):
            part = slice(first, first + TOGETHER)
            exact[part] = NormOfNormal(mean[part], covariance[part]).exceedance(level[part])
        with np.errstate(divide="ignore"):
            found[matter] = np.log(exact)
        return np.stack([found, np.full(found.shape, -np.inf)])

    def largest_instant(self, boundary: Boundary) -> float:
        """Return the logarithm of the probability of being beyond at the worst point drawn."""
        lines = self._by_lines(boundary.upper, LINES).max(axis=0)
        worst = np.unravel_index(int(lines.argmax()), lines.shape)
        law = NormOfNormal(self.law.mean[worst], self.law.covariance[worst])
        with np.errstate(divide="ignore"):
            return max(float(np.log(law.exceedance(boundary.upper[worst]))), float(lines[worst]))

    def _by_lines(self, distance: Array, lines: Array) -> Array:
        """Return the logarithm of the probability of being beyond lines at a distance (m, r), (directions, m, r)."""
        beyond = np.einsum("mri,ki->kmr", self.law.mean, lines) - distance
        std = np.sqrt(np.maximum(np.einsum("ki,mrij,kj->kmr", lines, self.law.covariance, lines, optimize=True), 0.0))
        varies = std > 0
        return np.where(varies, log_ndtr(beyond / np.where(varies, std, 1.0)), np.where(beyond > 0, 0.0, -np.inf))

    def paths_beyond(self, boundary: Boundary, random: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
        """Return deviations (count, m, 2 r), the norms there (count, m, r) and weights (count,) of drawn paths.

        Beyond the boundary, on the grid drawn, drawn in by what lies between points.
        """
        distance = ENCLOSING * np.maximum(boundary.upper - self.between, 0.0)
        log_p = self._by_lines(distance, LINES)
        log_sum = float(np.logaddexp.reduce(log_p, axis=None))
        deviations = self.of.deviations(random, count)
        if not np.isfinite(log_sum):  # nothing ever comes near
            return deviations, np.zeros((count, *distance.shape)), np.zeros(count)
        (line, point, norm), deviate = drawn_places(log_p, log_sum, random, count)
        e = LINES[line]
        variance = np.einsum("ci,cij,cj->c", e, self.law.covariance[point, norm], e)
        own = np.einsum("ci,ci->c", _pairs(deviations)[np.arange(count), point, norm], e)
        gain = np.divide(deviate * np.sqrt(variance) - own, variance, out=np.zeros(count), where=variance > 0)
        for k in range(2):
            deviations += (gain * e[:, k])[:, None, None] * self.of.covariances(point, 2 * norm + k)
        paths = _pairs(self.of.drawn.mean + deviations)
        sizes = np.linalg.norm(paths, axis=3)
        number = _lines_passed(paths, sizes, distance)
        return deviations, sizes, np.exp(log_sum - np.log(np.maximum(number, 1)))

    def sizes(self, deviations: Array) -> Array:
        """Return the norms (count, m, r) of deviations (count, m, 2 r) on the grid drawn."""
        return np.linalg.norm(_pairs(self.of.drawn.mean + deviations), axis=3)

    def sightings(self, count: int, steps: Steps, boundary: Boundary, every: int = 1) -> Sightings:
        """Return those of some steps of both outputs whose norms come near a boundary; as :func:`sightings`."""
        at = slice(None, None, every)
        mean, D = self.of.seen.mean[at], self.diffusion[at]
        begin, end = _pairs(mean[steps.step] + steps.begin), _pairs(mean[steps.step + 1] + steps.end)
        middle = begin + end
        e = middle / np.maximum(np.linalg.norm(middle, axis=2, keepdims=True), 1e-300)
        rate = np.einsum("kri,krij,krj->kr", e, (0.5 * (D[1:] + D[:-1]))[steps.step], e, optimize=True)
        variance = rate * np.diff(self.of.seen.times[at])[steps.step, None]
        moved = Steps(steps.path, steps.step, np.linalg.norm(begin, axis=2), np.linalg.norm(end, axis=2))
        return sighted(count, moved, boundary.at(at), variance, np.zeros(variance.shape, bool))


Process = JointOutputs | ManyOutputs | Norms


def _pairs(values: Array) -> Array:
    """Return (..., 2 r) as (..., r, 2)."""
    return values.reshape(*values.shape[:-1], values.shape[-1] // 2, 2)


def _lines_passed(paths: Array, sizes: Array, distance: Array) -> NDArray[np.intp]:
    """Return how many lines at a distance (m, r) each of some paths (count, m, r, 2) is beyond, all points together."""
    path, point, norm = np.nonzero(sizes > distance)
    y, size, off = paths[path, point, norm], sizes[path, point, norm], distance[point, norm]
    step = 2.0 * np.pi / DIRECTIONS
    middle, half = np.arctan2(y[:, 1], y[:, 0]), np.arccos(np.minimum(off / size, 1.0))
    lines = np.floor((middle + half) / step) - np.ceil((middle - half) / step) + 1.0
    return np.bincount(path, np.minimum(lines, DIRECTIONS), len(paths)).astype(np.intp)
