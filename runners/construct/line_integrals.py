"""Integrals along the vehicle, exact for the piecewise-linear distributions of which it is described."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

GAUSS = 0.5 / np.sqrt(3.0)  # two points an element: exact to the third degree


@dataclass(frozen=True, eq=False)
class Line:
    """The vehicle's axis cut at every point where a distribution may bend or jump.

    Attributes
    ----------
    edges : (m + 1,) array
        Increasing, m forward of the gimbal plane.
    """

    edges: NDArray[np.float64]

    @staticmethod
    def cut_at(*points: ArrayLike) -> Line:
        """Return the line through all these points; those closer than a micrometre count once."""
        found = np.unique(np.concatenate([np.atleast_1d(np.asarray(p, float)) for p in points]))
        return Line(found[np.concatenate([[True], np.diff(found) > 1e-6])])

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Points of the quadrature, (2 m,)."""
        middle, length = 0.5 * (self.edges[:-1] + self.edges[1:]), np.diff(self.edges)
        return (middle[:, None] + length[:, None] * np.array([-GAUSS, GAUSS])).ravel()

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Lengths that belong to the points, (2 m,)."""
        return np.repeat(0.5 * np.diff(self.edges), 2)

    def spread(self, edges: NDArray[np.float64], amounts: ArrayLike) -> NDArray[np.float64]:
        """Return the density at the points, (..., 2 m), of amounts (..., k) spread evenly over elements of other edges.

        The line must be cut at those edges.
        """
        element = np.clip(np.searchsorted(edges, self.points) - 1, 0, edges.size - 2)
        inside = (self.points > edges[0]) & (self.points < edges[-1])
        return np.asarray(amounts, float)[..., element] / np.diff(edges)[element] * inside

    def linear(self, x: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values (..., n) at ``x``, linear between, at the points: (..., 2 m)."""
        left = np.clip(np.searchsorted(x, self.points) - 1, 0, x.size - 2)
        share = (self.points - x[left]) / (x[left + 1] - x[left])
        return values[..., left] * (1 - share) + values[..., left + 1] * share

    def at(self, values: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return at any points, (..., k), what ``linear`` gave as values (..., 2 m)."""
        element = np.clip(np.searchsorted(self.edges, points, side="right") - 1, 0, self.edges.size - 2)
        low, high = self.points[2 * element], self.points[2 * element + 1]
        share = (points - low) / (high - low)
        return values[..., 2 * element] * (1 - share) + values[..., 2 * element + 1] * share

    def slope(self, x: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slope at the points, (..., 2 m), of what ``linear`` gives."""
        left = np.clip(np.searchsorted(x, self.points) - 1, 0, x.size - 2)
        return (np.diff(values) / np.diff(x))[..., left]

    def total(self, density: NDArray[np.float64]) -> NDArray[np.float64]:
        """Integrate (..., 2 m) over the whole line."""
        return density @ self.weights

    def forward(self, density: NDArray[np.float64], stations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Integrate (..., 2 m) over the part forward of each station, (..., stations); the line must be cut there."""
        first = 2 * np.searchsorted(self.edges, stations - 1e-6)
        pieces = (density * self.weights)[..., ::-1]
        sums = np.concatenate([np.zeros((*pieces.shape[:-1], 1)), np.cumsum(pieces, axis=-1)], axis=-1)
        return sums[..., pieces.shape[-1] - np.minimum(first, pieces.shape[-1])]
