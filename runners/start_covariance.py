"""What a variance owes to the covariance at the start, P0: to parameters, and to the wind filter below the start.

The covariance of the filter's states where the flight starts obeys dP/dh = F P + P F' + G G' from the filter's first
altitude on, so that a' P0 a is a variance of its own, over altitude instead of time, and has the same adjoint pair:
a' = -F' a downward from the start, y' = F y + G G' a upward, and the density 2 a'(dF) y + a' d(G G') a."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ..model.system import LinearSystem
from ..model.vehicle import Vehicle
from ..model.wind_filter import ShapingFilter, entry_name

if TYPE_CHECKING:
    from .sensitivity_gradient import AdjointPair

GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)


@lru_cache(maxsize=32)
def start_functions(system: LinearSystem, sources: tuple[str, ...]) -> tuple[ca.Function, ca.Function]:
    """Return P0 a and the gradient of a' P0 a with respect to the parameters, both functions of (p, a)."""
    n = len(system.states)
    a, P = ca.SX.sym("a", n), ca.SX(n, n)
    for source in sources:
        given = system.start_covariance.get(source)
        if given is not None:
            P += ca.reshape(ca.SX(given), n, n)
    product, form = P @ a, ca.bilin(ca.densify(P), a, a)
    return (
        ca.Function("start_product", [system.p, a], [ca.densify(product)]),
        ca.Function("start_gradient", [system.p, a], [ca.densify(ca.gradient(form, system.p))]),
    )


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
    if vehicle is None or "wind" not in pair.sources:
        return None
    shaping_filter = vehicle.wind.shaping_filter
    bottom, top = float(shaping_filter.altitude[0]), float(vehicle.tables["altitude"].polynomial(vehicle.start))
    if top <= bottom:
        return None
    first = pair.executable.system.state_names.index("wind_1")
    a_top = pair.adjoint_at_start[first : first + shaping_filter.order]
    inner = shaping_filter.altitude[(shaping_filter.altitude > bottom) & (shaping_filter.altitude < top)]
    edges = np.concatenate([[bottom], inner, [top]])
    nodes = np.concatenate([0.5 * (low + high) + 0.5 * (high - low) * GAUSS for low, high in pairwise(edges)])
    weights = np.concatenate([0.5 * (high - low) * GAUSS_WEIGHTS for low, high in pairwise(edges)])
    scale = float(np.abs(a_top).max()) or 1.0

    def down(h: float, a: NDArray) -> NDArray:
        return -shaping_filter.at(h)[0].T @ a

    adjoint = _solve(down, (top, bottom), a_top, scale)

    def up(h: float, y: NDArray) -> NDArray:
        F, G, _ = shaping_filter.at(h)
        return F @ y + G @ (G.T @ adjoint(h))

    product = _solve(up, (bottom, top), shaping_filter.start_covariance @ adjoint(bottom), scale)
    a, y = adjoint(nodes), product(nodes)
    G_nodes = np.array([shaping_filter.at(h)[1] for h in nodes])
    white = np.einsum("kim,ik->mk", G_nodes, a)
    by_table = {
        entry_name(label, i, j): 2 * factor * weights * a[i] * (y if label == "F" else white)[j]
        for label, i, j in shaping_filter.entries
        if label in "FG"
    }
    return StartShare(nodes, by_table, factor * _rise(shaping_filter, top, a_top, product(top)))


def _solve(rate, span: tuple[float, float], start: NDArray, scale: float):
    return solve_ivp(rate, span, start, "DOP853", rtol=1e-11, atol=1e-13 * scale, dense_output=True).sol


def _rise(shaping_filter: ShapingFilter, altitude: float, a: NDArray, y: NDArray) -> float:
    """Return a' (dP/dh) a."""
    F, G, _ = shaping_filter.at(altitude)
    return float(2 * a @ F @ y + np.sum((G.T @ a) ** 2))
