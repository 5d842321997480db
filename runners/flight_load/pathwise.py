"""How the paths that just reach a level move with what they are made of.

The paths y = m + d of a Gaussian process with covariance R move with a change of m and R as dy = dm + dR R^-1 d / 2,
which turns draws of one law into draws of the other. The level that the maximum passes with a probability moves as the
paths whose maximum just reaches it move there: dL = E[+-dy(t*) | max = L] at the time t* of the maximum. At a maximum
the fast parts of a response are larger than their share of the variance: a formula by variances alone misses that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .probability import Level
from .process import OneOutput
from .sampling import draw_beyond

BAND = 0.3  # of the level, in 1 / slope: paths that reach it and not a little more
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
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    def change(self, mean: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
        """Return the change of the level with those of mean (m,) and covariance (m, m)."""
        return float(self.mean @ mean + np.vdot(self.covariance, covariance))


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
    draws = draw_beyond(process, level.boundary, random, count, keep=True)
    farther = level.boundary.drawn_in(np.full_like(level.boundary.upper, -BAND / level.slope))
    weight = draws.contributions(level.boundary) - draws.contributions(farther)
    path, point, _, side = draws.near.worst(level.boundary)
    used = weight[path] > 0
    path, point, side = path[used], point[used], side[used]
    share = weight[path] / weight[path].sum()
    assert draws.deviations is not None
    deviations, interpolated = draws.deviations[path, :, 0], process.expected[point]
    sign = np.where(side == 0, 1.0, -1.0)
    away = level.value - sign * process.seen.mean[point, 0]
    deviations *= (away / (sign * (interpolated * deviations).sum(axis=1)))[:, None]  # reach it, not more
    place = interpolated * (sign * share)[:, None]
    std = np.where(process.std[:, 0] > 0, process.std[:, 0], 1.0)
    correlation = process.covariance / np.outer(std, std)
    correlation[np.diag_indices(std.size)] += RIDGE
    solved = np.linalg.solve(correlation, (deviations / std).T) / std[:, None]
    return Movement(place.sum(axis=0), 0.5 * place.T @ solved.T)
