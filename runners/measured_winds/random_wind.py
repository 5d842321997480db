"""The random wind at levels, as a vehicle's filter makes it: a Gaussian vector that is Markov over altitude.

Of a vehicle that flies in both planes it is both components, towards the east and towards the north, of one filter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...model.wind.propagation import SPACING, transitions
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.statistics import WindModel
from ...model.wind.two_components import TwoComponentWind
from ..case.case import Case
from ..solvers.discretisation import symmetric_root

FARTHEST = 6.0  # standard deviations of a measured wind from the mean of the vehicle's month


@dataclass(frozen=True, eq=False)
class RandomWind:
    """c components of the wind at k levels: mean + H z, z_{j+1} = Phi_j z_j + e_j.

    Vectors of the whole wind hold one component after the other, each over the levels.

    Attributes
    ----------
    levels : (k,) array
        m, increasing; below the filter's first altitude the wind is the one there.
    mean : (c k,) array
        m/s.
    output : (k, c, n) array
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
        """R between all levels and components, (c k, c k), m2/s2."""
        k, c, n = self.output.shape
        R = np.zeros((c, k, c, k))
        carried = np.zeros((k, c, n))  # H_i P_i Phi(h_j, h_i)', of all i up to j
        for j in range(k):
            if j:
                carried[:j] = carried[:j] @ self.transition[j - 1].T
            carried[j] = self.output[j] @ self.state_covariance[j]
            R[:, j, :, : j + 1] = np.einsum("cn,idn->cdi", self.output[j], carried[: j + 1])
            R[:, : j + 1, :, j] = R[:, j, :, : j + 1].transpose(1, 2, 0)
        return R.reshape(c * k, c * k)

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Of the wind, (c k,), m/s."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))

    def drawn(self, random: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return random whole winds, (count, c k), m/s."""
        n = self.output.shape[2]
        roots = symmetric_root(np.concatenate([self.start[None], self.added]))
        z = random.standard_normal((count, n)) @ roots[0].T
        found = [z @ self.output[0].T]
        for Phi, root, H in zip(self.transition, roots[1:], self.output[1:], strict=True):
            z = z @ Phi.T + random.standard_normal((count, n)) @ root.T
            found.append(z @ H.T)
        return self.mean + np.array(found).transpose(1, 2, 0).reshape(count, -1)


def random_wind(case: Case, levels: NDArray[np.float64]) -> RandomWind:
    """Return the wind of a case's vehicle at levels (m), kept with the case.

    Raises
    ------
    NoVehicleError
    """
    wind = case.vehicle_for("a random wind").wind

    def made() -> RandomWind:
        scale = case.parameters["wind.sigma_scale"].value
        mean = case.parameters["wind.mean_scale"].value * np.concatenate([
            table.polynomial(np.clip(levels, table.argument[0], table.argument[-1])) for table in wind.means
        ])  # fmt: skip
        return filter_wind(wind.shaping_filter, levels, mean, scale * component_rows(wind))

    return case.kept(("random wind", tuple(levels.tolist())), made)


def component_rows(wind: WindModel | TwoComponentWind) -> NDArray[np.float64]:
    """Return which of a filter's states make which of its winds, (c, n), ones and zeros."""
    if isinstance(wind, WindModel):
        return np.ones((1, wind.shaping_filter.order))
    return rows_of_components(wind.shaping_filter.order, wind.zonal.shaping_filter.order)


def rows_of_components(order: int, zonal: int) -> NDArray[np.float64]:
    """Return which states of a joint filter make which component, (2, order): the first ``zonal`` ones the zonal."""
    first = np.arange(order) < zonal
    return np.array([first, ~first], float)


def filter_wind(
    shaping_filter: ShapingFilter,
    levels: NDArray[np.float64],
    mean: NDArray[np.float64],
    rows: NDArray[np.float64] | float = 1.0,
) -> RandomWind:
    """Return the wind of a filter at levels, or several winds that its states make.

    Parameters
    ----------
    shaping_filter : ShapingFilter
    levels : (k,) array
        m.
    mean : (c k,) array
        m/s.
    rows : (c, n) array or float
        Factors on the filter's output by state, of each wind.
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
    H = shaping_filter.at(wanted)[2][:, None] * np.atleast_2d(rows)
    return RandomWind(levels, mean, H, np.reshape(transition, shape), np.reshape(added, shape), start)
