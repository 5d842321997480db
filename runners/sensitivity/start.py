"""What a variance owes to the covariance at the start, P0: to parameters, and to the wind filter below the start.

The covariance of the filter's states where the flight starts obeys dP/dh = F P + P F' + G G' from the filter's first
altitude on, so that a' P0 a is a variance of its own, over altitude instead of time, and has the same adjoint pair:
a' = -F' a downward from the start, y' = F y + G G' a upward, and the density 2 a'(dF) y + a' d(G G') a."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...codegen.nodes.matrix import NodeMatrix
from ...codegen.sweep.gauss_legendre import STAGES
from ...model.system.names import WIND
from ...model.vehicle.vehicle import Vehicle
from ...model.wind.shaping_filter import ShapingFilter, entry_name
from ..solvers.collocation import Collocation
from ..solvers.collocation_grid import Grid
from .pair import AdjointPair

RATE = 0.3  # longest step times the filter's rates


@dataclass(frozen=True, eq=False)
class StartShare:
    """Derivatives of a' P0 a by the wind filter's tables below the start, and by the start's altitude.

    Attributes
    ----------
    altitudes : (k,) array
        Nodes from the filter's first altitude to the start, m.
    by_table : dict of str to (k,) array
        Derivative by the value at a node, with the node's weight.
    by_altitude : float
        1/m.
    """

    altitudes: NDArray[np.float64]
    by_table: dict[str, NDArray[np.float64]]
    by_altitude: float


def start_share(vehicle: Vehicle | None, pair: AdjointPair, factor: float) -> StartShare | None:
    """Return what ``factor`` times a variance owes to the wind filter below the start; None without wind."""
    if vehicle is None or WIND not in pair.sources:
        return None
    shaping_filter = vehicle.wind.shaping_filter
    bottom, top = float(shaping_filter.altitude[0]), vehicle.start_altitude
    if top <= bottom:
        return None
    a_top = pair.adjoint_at_start[pair.executable.system.block(WIND)]
    fastest = np.abs(shaping_filter.F[shaping_filter.altitude <= top]).sum(axis=2).max()  # 1/m, or more
    grid = _grid(shaping_filter, bottom, top, RATE / max(fastest, RATE / (top - bottom)))
    nodes = grid.nodes.ravel()
    F, G, _ = shaping_filter.at(nodes)
    order = shaping_filter.order
    solver = Collocation(grid, NodeMatrix(ca.Sparsity.dense(order, order), F.swapaxes(1, 2).reshape(nodes.size, -1)))
    stages, edges = solver.backward(a_top, np.zeros((grid.steps.size, STAGES, order)))
    a, a_bottom = stages.reshape(-1, order), edges[0]
    white = np.einsum("kim,ki->km", G, a)
    driven = np.einsum("kim,km->ki", G, white)
    stages, edges = solver.forward(shaping_filter.start_covariance @ a_bottom, driven.reshape(-1, STAGES, order))
    y, weights = stages.reshape(-1, order), grid.weights.ravel()
    by_table = {
        entry_name(label, i, j): 2 * factor * weights * a[:, i] * (y if label == "F" else white)[:, j]
        for label, i, j in shaping_filter.entries
        if label in "FG"
    }
    return StartShare(nodes, by_table, factor * _rise(shaping_filter, top, a_top, edges[-1]))


def _grid(shaping_filter: ShapingFilter, bottom: float, top: float, step: float) -> Grid:
    """Return a grid over altitude with the filter's samples among its edges."""
    h = shaping_filter.altitude
    samples = np.concatenate([[bottom], h[(h > bottom) & (h < top)], [top]])
    parts = (np.linspace(low, high, 1 + int(np.ceil((high - low) / step)))[1:] for low, high in pairwise(samples))
    return Grid(np.concatenate([[bottom], *parts]))


def _rise(shaping_filter: ShapingFilter, altitude: float, a: NDArray, y: NDArray) -> float:
    """Return a' (dP/dh) a."""
    F, G, _ = shaping_filter.at(altitude)
    return float(2 * a @ F @ y + np.sum((G.T @ a) ** 2))
