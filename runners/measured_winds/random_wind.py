"""The random wind at levels, as a vehicle's filter makes it: a Gaussian vector that is Markov over altitude."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...model.vehicle.planes import one_wind
from ...model.wind.propagation import SPACING, transitions
from ...model.wind.shaping_filter import ShapingFilter
from ..case.case import Case
from ..design_wind.design_wind import mean_wind
from ..solvers.discretisation import symmetric_root


@dataclass(frozen=True, eq=False)
class RandomWind:
    """The wind at k levels: mean + H z, z_{j+1} = Phi_j z_j + e_j.

    Attributes
    ----------
    levels : (k,) array
        m, increasing; below the filter's first altitude the wind is the one there.
    mean : (k,) array
        m/s.
    output : (k, n) array
        H.
    transition, added : (k - 1, n, n) arrays
        Phi, and the covariance of e.
    start : (n, n) array
        Covariance of z at the first level.
    """

    levels: NDArray[np.float64]
    mean: NDArray[np.float64]
    output: NDArray[np.float64]
    transition: NDArray[np.float64]
    added: NDArray[np.float64]
    start: NDArray[np.float64]

    @cached_property
    def state_covariance(self) -> NDArray[np.float64]:
        """P at every level, (k, n, n)."""
        P = [self.start]
        for Phi, Q in zip(self.transition, self.added, strict=True):
            P.append(Phi @ P[-1] @ Phi.T + Q)
        return np.array(P)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """R between all levels, (k, k), m2/s2."""
        k, n = self.output.shape
        R = np.zeros((k, k))
        carried = np.zeros((k, n))  # Phi(h_j, h_i) P_i H_i, of all i up to j
        for j in range(k):
            if j:
                carried[:j] = carried[:j] @ self.transition[j - 1].T
            carried[j] = self.state_covariance[j] @ self.output[j]
            R[j, : j + 1] = carried[: j + 1] @ self.output[j]
            R[: j + 1, j] = R[j, : j + 1]
        return R

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Of the wind at each level, (k,), m/s."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))

    def drawn(self, random: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return random whole winds, (count, k), m/s."""
        n = self.output.shape[1]
        roots = symmetric_root(np.concatenate([self.start[None], self.added]))
        z = random.standard_normal((count, n)) @ roots[0].T
        found = [z @ self.output[0]]
        for Phi, root, H in zip(self.transition, roots[1:], self.output[1:], strict=True):
            z = z @ Phi.T + random.standard_normal((count, n)) @ root.T
            found.append(z @ H)
        return self.mean + np.array(found).T


def random_wind(case: Case, levels: NDArray[np.float64]) -> RandomWind:
    """Return the wind of a case's vehicle at levels (m), kept with the case.

    Raises
    ------
    NoVehicleError
    """
    shaping_filter = one_wind(case.vehicle_for("a random wind"), "a random wind").shaping_filter

    def made() -> RandomWind:
        scale = case.parameters["wind.sigma_scale"].value
        return filter_wind(shaping_filter, levels, mean_wind(case, levels), scale)

    return case.kept(("random wind", tuple(levels.tolist())), made)


def filter_wind(
    shaping_filter: ShapingFilter, levels: NDArray[np.float64], mean: NDArray[np.float64], scale: float = 1.0
) -> RandomWind:
    """Return the wind of a filter at levels.

    Parameters
    ----------
    shaping_filter : ShapingFilter
    levels : (k,) array
        m.
    mean : (k,) array
        m/s.
    scale : float
        Factor on its standard deviation.
    """
    bottom, n = float(shaping_filter.altitude[0]), shaping_filter.order
    wanted = np.maximum(levels, bottom)
    samples = shaping_filter.altitude
    top = float(wanted[-1])
    edges = [np.array([bottom])]
    for a, b in pairwise(np.unique([bottom, *samples[samples < top], *wanted])):
        edges.append(np.linspace(a, b, max(1, int(np.ceil((b - a) / SPACING - 1e-9))) + 1)[1:])
    grid = np.concatenate(edges)
    transition, added, start = [], [], shaping_filter.start_covariance
    at = np.searchsorted(grid, wanted - 1e-9)
    phi, q = transitions(shaping_filter, grid) if grid.size > 1 else (np.zeros((0, n, n)),) * 2
    for step in range(int(at[0])):
        start = phi[step] @ start @ phi[step].T + q[step]
    for first, last in pairwise(at):
        Phi, Q = np.eye(n), np.zeros((n, n))
        for step in range(int(first), int(last)):
            Phi, Q = phi[step] @ Phi, phi[step] @ Q @ phi[step].T + q[step]
        transition.append(Phi)
        added.append(Q)
    shape = (wanted.size - 1, n, n)
    H = scale * shaping_filter.at(wanted)[2]
    return RandomWind(levels, mean, H, np.reshape(transition, shape), np.reshape(added, shape), start)
