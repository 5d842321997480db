"""How the paths that just reach a level move with what they are made of.

The paths y = m + d of a Gaussian process with covariance R move with a change of m and R as dy = dm + dR R^-1 d / 2,
which turns draws of one law into draws of the other. The level that the maximum passes with a probability moves as the
paths whose maximum just reaches it move there: dL = E[e . dy(t*) | max = L] at the time t* of the maximum, e the side
of one response or the direction of two. At a maximum the fast parts of a response are larger than their share of the
variance: a formula by variances alone misses that.
What a path of a rough response is beyond the points drawn goes as its diffusion there, and moves with that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .norms import Norms
from .probability import Level
from .process import JointOutputs
from .sampling import draw_beyond

BAND = 0.3  # of the level, in 1 / slope: paths whose largest value lies so near to it, on both sides alike
RIDGE = 1e-7  # of the variance, added to R where it is inverted: less than any response is known to

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reaching:
    """Paths that just reach a level.

    Attributes
    ----------
    outputs : JointOutputs
        One response, or both of a resultant.
    level : float
    share : (k,) array
        Of each path, adding up to one.
    point : (k,) array of int
        Where it is farthest out, on the grid seen.
    direction : (k, r) array
        1 or -1 for the side of one response, a unit vector for a resultant.
    deviations : (k, m r) array
        From the mean at the points drawn.
    interpolated : (k, m r) array
        Weights of these deviations in what is expected along the direction at its point.
    """

    outputs: JointOutputs
    level: float
    share: Array
    point: NDArray[np.intp]
    direction: Array
    deviations: Array
    interpolated: Array

    @property
    def mean(self) -> Array:
        """Mean along the direction at the point of each path, (k,)."""
        return np.einsum("kr,kr->k", self.direction, self.outputs.seen.mean[self.point])

    @property
    def nearest(self) -> NDArray[np.intp]:
        """The point drawn next to that of each path, (k,)."""
        stride = self.outputs.stride
        return np.minimum((self.point + stride // 2) // stride, self.outputs.drawn.times.size - 1)


def reaching(process: JointOutputs | Norms, level: Level, random: np.random.Generator, count: int) -> Reaching:
    """Return paths that just reach a level, from so many draws."""
    outputs = process.of if isinstance(process, Norms) else process
    assert isinstance(outputs, JointOutputs)
    half = np.full_like(level.boundary.upper, 0.5 * BAND / level.slope)
    nearer, farther = level.boundary.drawn_in(half), level.boundary.drawn_in(-half)
    draws = draw_beyond(process, nearer, random, count, keep=True)
    weight = draws.contributions(nearer) - draws.contributions(farther)
    path, point, _, side = draws.near.worst(level.boundary)
    used = weight[path] > 0
    path, point, side = path[used], point[used], side[used]
    assert draws.deviations is not None
    deviations = draws.deviations[path].reshape(path.size, -1)
    expected = outputs.expected[point].reshape(path.size, -1, deviations.shape[1])
    if isinstance(process, Norms):
        there = outputs.seen.mean[point] + np.einsum("krm,km->kr", expected, deviations)
        direction = there / np.linalg.norm(there, axis=1, keepdims=True)
    else:
        direction = np.where(side == 0, 1.0, -1.0)[:, None]
    along = np.einsum("kr,krm->km", direction, expected)
    return Reaching(outputs, level.value, weight[path] / weight[path].sum(), point, direction, deviations, along)


@dataclass(frozen=True, eq=False)
class Movement:
    """What weighs changes of mean and covariance of r outputs in a change of the level.

    Attributes
    ----------
    mean : (m r,) array
        Weight of the change of the mean at every point drawn.
    covariance : (m r, m r) array
        Weight of the change of R between points drawn.
    variance_rate : (m, r, r) array
        Weight of the change of the square of the diffusion at every point drawn.
    """

    mean: Array
    covariance: Array
    variance_rate: Array

    def change(self, mean: Array, covariance: Array, variance_rate: Array) -> float:
        """Return the change of the level with those of mean (m, r), covariance (m, r, m, r) and diffusion (m, r, r)."""
        return float(
            np.vdot(self.mean, mean) + np.vdot(self.covariance, covariance) + np.vdot(self.variance_rate, variance_rate)
        )


def movement(paths: Reaching, diffusion: Array) -> Movement:
    """Return how a level moves with mean and covariance of its outputs.

    Parameters
    ----------
    paths : Reaching
    diffusion : (m, r, r) array
        Squared, at the points drawn.
    """
    outputs, nearest, e, share = paths.outputs, paths.nearest, paths.direction, paths.share
    deviations = paths.deviations.copy()
    away = paths.level - paths.mean
    seen = (paths.interpolated * deviations).sum(axis=1)
    squared = np.einsum("kr,krs,ks->k", e, diffusion[nearest], e)
    rough = squared > 0
    deviations *= np.where(rough, 1.0, away / np.where(rough, 1.0, seen))[:, None]  # smooth: it reaches it, not more
    beyond = np.divide(share * (away - seen), 2 * squared, out=np.zeros(share.size), where=rough)
    variance_rate = np.zeros(diffusion.shape)
    np.add.at(variance_rate, nearest, beyond[:, None, None] * e[:, :, None] * e[:, None, :])
    place = paths.interpolated * share[:, None]
    std = np.where(outputs.std > 0, outputs.std, 1.0).ravel()
    correlation = outputs.covariance.reshape(std.size, std.size) / np.outer(std, std)
    correlation[np.diag_indices(std.size)] += RIDGE
    solved = np.linalg.solve(correlation, (deviations / std).T) / std[:, None]
    return Movement(place.sum(axis=0), 0.5 * place.T @ solved.T, variance_rate)
