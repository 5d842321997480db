"""How the paths that just reach a level move with what they are made of.

The paths y = m + d of a Gaussian process with covariance R move with a change of m and R as dy = dm + dR R^-1 d / 2,
which turns draws of one law into draws of the other. The level that the maximum passes with a probability moves as the
paths whose maximum just reaches it move there: dL = E[+-dy(t*) | max = L] at the time t* of the maximum. At a maximum
the fast parts of a response are larger than their share of the variance: a formula by variances alone misses that.
What a path of a rough response is beyond the points drawn goes as its diffusion there, and moves with that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .probability import Level
from .process import OneOutput
from .sampling import draw_beyond

BAND = 0.3  # of the level, in 1 / slope: paths whose largest value lies so near to it, on both sides alike
RIDGE = 1e-7  # of the variance, added to R where it is inverted: less than any response is known to


@dataclass(frozen=True, eq=False)
class Movement:
    """What weighs changes of mean and covariance in a change of the level.

    Attributes
    ----------
    mean : (m,) array
        Weight of the change of the mean at every point drawn.
    covariance : (m, m) array
        Weight of the change of R between points drawn.
    variance_rate : (m,) array
        Weight of the change of the square of the diffusion at every point drawn.
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    variance_rate: NDArray[np.float64]

    def change(
        self, mean: NDArray[np.float64], covariance: NDArray[np.float64], variance_rate: NDArray[np.float64]
    ) -> float:
        """Return the change of the level with those of mean (m,), covariance (m, m) and squared diffusion (m,)."""
        return float(self.mean @ mean + np.vdot(self.covariance, covariance) + self.variance_rate @ variance_rate)


def movement(process: OneOutput, level: Level, random: np.random.Generator, count: int) -> Movement:
    """Return how a level moves with mean and covariance of its process.

    Parameters
    ----------
    process : OneOutput
    level : Level
    random : Generator
    count : int
        Draws.
    """
    half = np.full_like(level.boundary.upper, 0.5 * BAND / level.slope)
    nearer, farther = level.boundary.drawn_in(half), level.boundary.drawn_in(-half)
    draws = draw_beyond(process, nearer, random, count, keep=True)
    weight = draws.contributions(nearer) - draws.contributions(farther)
    path, point, _, side = draws.near.worst(level.boundary)
    used = weight[path] > 0
    path, point, side = path[used], point[used], side[used]
    share = weight[path] / weight[path].sum()
    assert draws.deviations is not None
    deviations, interpolated = draws.deviations[path, :, 0], process.expected[point]
    sign = np.where(side == 0, 1.0, -1.0)
    away = level.value - sign * process.seen.mean[point, 0]
    seen = sign * (interpolated * deviations).sum(axis=1)
    nearest = np.minimum((point + process.stride // 2) // process.stride, process.drawn.times.size - 1)
    squared = process.drawn.diffusion[nearest, 0] ** 2
    rough = squared > 0
    deviations *= np.where(rough, 1.0, away / np.where(rough, 1.0, seen))[:, None]  # smooth: it reaches it, not more
    beyond = np.divide(share * (away - seen), 2 * squared, out=np.zeros(share.size), where=rough)
    variance_rate = np.zeros(process.drawn.times.size)
    np.add.at(variance_rate, nearest, beyond)
    place = interpolated * (sign * share)[:, None]
    std = np.where(process.std[:, 0] > 0, process.std[:, 0], 1.0)
    correlation = process.covariance / np.outer(std, std)
    correlation[np.diag_indices(std.size)] += RIDGE
    solved = np.linalg.solve(correlation, (deviations / std).T) / std[:, None]
    return Movement(place.sum(axis=0), 0.5 * place.T @ solved.T, variance_rate)
