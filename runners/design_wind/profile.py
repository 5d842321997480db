"""The random wind over altitude at close points, and its covariance with one response.

The response is y = integral of g(t2, t) w(h(t)) dt + G w(h(t2)) with the weights of the wind. In altitude the wind is a
Markov process, w = H z, so that cov(z(h), y) = a(h) + P(h) b(h): b carries weights from above down to h, a those from
below up to it,

    b(h) = integral over s > h of Phi(s, h)' H(s)' g(s) ds,
    a(h) = integral over s < h of Phi(h, s) P(s) H(s)' g(s) ds,

by Gauss-Legendre quadrature in panels, inside which integrals end at the nodes as in Gauss collocation. cov(w, y) has
a corner at h(t2). In both planes w has two components of one filter, H two rows and g two weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...model.wind.propagation import transitions
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.two_components import TwoComponentWind
from ..case.case import Case
from ..case.climb import Climb
from ..gusts.weights import WindWeights
from ..solvers.discretisation import symmetric_root

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
STRIDE = 1 + NODES.size  # points from one edge of panels to the next
# parts of the integral over a panel up to each node, in shares of the weights (Gauss collocation)
_POWERS = np.arange(NODES.size)
_MOMENTS = (0.5 * (1 + NODES))[:, None] ** (_POWERS + 1) / (_POWERS + 1)
UP_TO = _MOMENTS @ np.linalg.inv((0.5 * (1 + NODES))[:, None] ** _POWERS) / (0.5 * WEIGHTS)
SMALLEST, LARGEST, GRADE = 0.003, 0.025, 40.0  # s, of a panel of the flight; of the time to t2 in between
POINTS = 3  # of the weights in a panel, at most
DENSE, NEAR, FAR = 25.0, 300.0, 250.0  # m: levels within 300 m of h(t2), and the coarsest elsewhere
SAME = 1e-6  # m


@dataclass(frozen=True, eq=False)
class WindAtPoints:
    """Random wind at points over altitude, and what it does to a response.

    Attributes
    ----------
    altitude : (m,) array
        m, increasing; every ``STRIDE``-th point is the edge of a panel.
    weight : (m, winds) array
        Of the wind, or of both its components, at each point in the response, quadrature included.
    output : (m, winds, n) array
        H, the factor on the wind's standard deviation included.
    transition, added : (m - 1, n, n) arrays
        From each point to the next, and the covariance that noise adds.
    covariance : (m, n, n) array
        P.
    noise : (m, n, noises) array
        The filter's noise matrix.
    quadrature : (m,) array
        m, to integrate over the part of the altitude that is flown.
    """

    altitude: NDArray[np.float64]
    weight: NDArray[np.float64]
    output: NDArray[np.float64]
    transition: NDArray[np.float64]
    added: NDArray[np.float64]
    covariance: NDArray[np.float64]
    noise: NDArray[np.float64]
    quadrature: NDArray[np.float64]

    @cached_property
    def _in_panels(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return b and cov(z, y) at each point, (m, n); what a panel's own weights do is integrated to each node."""
        n, panels = self.output.shape[2], (self.altitude.size - 1) // STRIDE
        steps = self.transition.reshape(panels, STRIDE, n, n)
        from_edge = [steps[:, 0]]
        for k in range(1, STRIDE):
            from_edge.append(steps[:, k] @ from_edge[-1])
        *to_nodes, across = from_edge
        to_node = np.array(to_nodes).swapaxes(0, 1)  # (panels, nodes, n, n)
        back = np.linalg.inv(to_node)
        inside = np.arange(panels)[:, None] * STRIDE + 1 + np.arange(NODES.size)
        rows = np.einsum("kc,kcn->kn", self.weight, self.output)
        g, P = rows[inside], self.covariance[inside]
        above = np.einsum("pkji,pkj->pki", to_node, g)  # weights as they count at the lower edge
        below = np.einsum("pkij,pkj->pki", back, np.einsum("pkij,pkj->pki", P, g))
        direct = rows[::STRIDE]
        b, a = np.zeros((panels + 1, n)), np.zeros((panels + 1, n))
        b[-1] = direct[-1]
        for k in range(panels - 1, -1, -1):
            b[k] = b[k + 1] @ across[k] + above[k].sum(axis=0) + direct[k]
        own = np.einsum("kij,kj->ki", self.covariance[::STRIDE], direct)
        for k in range(panels):
            a[k + 1] = across[k] @ (a[k] + own[k] + below[k].sum(axis=0))
        adjoint, covariance = np.zeros((self.altitude.size, n)), np.zeros((self.altitude.size, n))
        adjoint[::STRIDE] = b
        covariance[::STRIDE] = a + np.einsum("kij,kj->ki", self.covariance[::STRIDE], b)
        left = (b - direct)[:-1, None] - np.einsum("ij,pjn->pin", UP_TO, above)
        met = (a + own)[:-1, None] + np.einsum("ij,pjn->pin", UP_TO, below)
        adjoint[inside] = np.einsum("pkji,pkj->pki", back, left)
        covariance[inside] = np.einsum("pkij,pkj->pki", to_node, met) + np.einsum("pkij,pkj->pki", P, adjoint[inside])
        return adjoint, covariance

    @property
    def adjoint(self) -> NDArray[np.float64]:
        """b: what the response owes to the filter's states at each point, itself and above, (m, n)."""
        return self._in_panels[0]

    @property
    def state_covariance(self) -> NDArray[np.float64]:
        """cov(z, y) at each point, (m, n)."""
        return self._in_panels[1]

    @cached_property
    def wind_covariance(self) -> NDArray[np.float64]:
        """cov(w, y) at each point, (m, winds), m/s times the response's unit."""
        return np.einsum("kci,ki->kc", self.output, self.state_covariance)

    @cached_property
    def variance(self) -> float:
        """Of the response, by the random wind alone."""
        return self.response_to(self.wind_covariance)

    def response_to(self, wind: NDArray[np.float64]) -> float:
        """Return the response to a wind (m, winds), m/s."""
        return float((self.weight * wind).sum())

    @cached_property
    def variance_in_white_noise(self) -> float:
        """The same as the squared norm of the weights of the filter's white noise and start."""
        at_first = self.adjoint[0] @ self.covariance[0] @ self.adjoint[0]
        density = (np.einsum("kij,ki->kj", self.noise, self.adjoint) ** 2).sum(axis=1)
        return float(at_first + self.quadrature @ density)

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of the wind at each point, (m, winds), m/s."""
        return np.sqrt(np.maximum(np.einsum("kci,kij,kcj->kc", self.output, self.covariance, self.output), 0.0))

    def drawn(self, random: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return random winds at all points, (m, winds, count), m/s."""
        n = self.output.shape[2]
        roots = symmetric_root(np.concatenate([self.covariance[:1], self.added]))
        z = roots[0] @ random.standard_normal((n, count))
        found = [self.output[0] @ z]
        for Phi, root, H in zip(self.transition, roots[1:], self.output[1:], strict=True):
            z = Phi @ z + root @ random.standard_normal((n, count))
            found.append(H @ z)
        return np.array(found)


def wind_at_points(case: Case, climb: Climb, weights: WindWeights, top: float) -> WindAtPoints:
    """Return the random wind of a case from the filter's first altitude to ``top`` (m), with a response's weights.

    Parameters
    ----------
    case : Case
    climb : Climb
    weights : WindWeights
        Of one response, from the start of the flight on.
    top : float
    """
    vehicle = case.vehicle_for("a design wind")
    shaping_filter, start = vehicle.wind.shaping_filter, float(climb.altitudes[0])
    last = float(climb.altitude(weights.time))
    flown = climb.altitude(_graded(weights))
    bottom, top = min(float(shaping_filter.altitude[0]), start), max(top, last + NEAR)
    between = [*shaping_filter.kinks, *(h for mean in vehicle.wind.means for h in mean.argument)]
    marks = [h for h in between if bottom < h < top]
    edges = [bottom, *_spread(bottom, start, FAR), *flown, last]
    edges += [last + DENSE * k for k in range(1, round(NEAR / DENSE) + 1)]
    edges += _spread(last + NEAR, top, FAR)
    found = _distinct([bottom, start, last, top, *climb.altitude(weights.edges)], [*marks, *edges], bottom, top)
    return _at(case, climb, weights, shaping_filter, found)


def _at(
    case: Case, climb: Climb, weights: WindWeights, shaping_filter: ShapingFilter, edges: NDArray[np.float64]
) -> WindAtPoints:
    start, last = float(climb.altitudes[0]), float(climb.altitude(weights.time))
    spans = np.diff(edges)
    inside = edges[:-1, None] + spans[:, None] * 0.5 * (1 + NODES)
    altitude = np.append(np.concatenate([edges[:-1, None], inside], axis=1).ravel(), edges[-1])
    middle = edges[:-1] + 0.5 * spans
    flown = (middle > start) & (middle < last)
    winds = _components(shaping_filter, case)
    quadrature, weight = np.zeros(altitude.size), np.zeros((altitude.size, len(winds)))
    part = np.zeros((spans.size, STRIDE))
    part[:, 1:] = 0.5 * spans[:, None] * WEIGHTS
    quadrature[:-1] = part.ravel()
    times = climb.time_at(inside[flown].ravel())
    rate = climb.polynomial(times, 1)
    of_winds = np.zeros((*part.shape, len(winds)))
    shares = (weights.at(times) / rate[:, None]).reshape(-1, NODES.size, len(winds))
    of_winds[flown, 1:] = (0.5 * spans[flown, None] * WEIGHTS)[..., None] * shares
    weight[:-1] = of_winds.reshape(-1, len(winds))
    weight[STRIDE * int(np.abs(edges - last).argmin())] += weights.direct
    transition, added = transitions(shaping_filter, altitude)
    P = [shaping_filter.start_covariance]
    for Phi, Q in zip(transition, added, strict=True):
        P.append(Phi @ P[-1] @ Phi.T + Q)
    _, G, H = shaping_filter.at(altitude)
    scale = case.parameters["wind.sigma_scale"].value
    rows = scale * H[:, None, :] * winds
    return WindAtPoints(altitude, weight, rows, transition, added, np.array(P), G, quadrature)


def _components(shaping_filter: ShapingFilter, case: Case) -> NDArray[np.float64]:
    """Return by ones which of the filter's states each wind is made of, (winds, n): all of them in one plane."""
    wind, n = case.vehicle_for("a design wind").wind, shaping_filter.order
    if not isinstance(wind, TwoComponentWind):
        return np.ones((1, n))
    zonal = np.arange(n) < wind.filters.zonal.order
    return np.array([zonal, ~zonal], float)


def chosen_levels(points: WindAtPoints, wind: NDArray[np.float64], last: float, missed: float) -> NDArray[np.intp]:
    """Return which edges of panels a profile needs so that straight lines between them nearly make the same load.

    Parameters
    ----------
    points : WindAtPoints
    wind : (m, winds) array
        The profile at all points, m/s.
    last : float
        h(t2), m.
    missed : float
        By how much the load may be off, summed over all intervals without regard of sign.

    Returns
    -------
    (levels,) array
        Numbers of points, increasing; all edges where that is not enough.
    """
    edges, h = np.arange(0, points.altitude.size, STRIDE), points.altitude

    def off(a: int, b: int) -> float:
        i, j = edges[a], edges[b]
        line = wind[i] + np.outer((h[i + 1 : j] - h[i]) / (h[j] - h[i]), wind[j] - wind[i])
        return float((points.weight[i + 1 : j] * (wind[i + 1 : j] - line)).sum())

    at = h[edges]
    kept, spacing = [0], np.where(np.abs(at - last) <= NEAR + SAME, DENSE, FAR)
    here = int(np.abs(at - last).argmin())
    for k in range(1, edges.size):  # no coarser than asked for, and a node at h(t2)
        finest = min(spacing[k], spacing[kept[-1]])
        if k in (here, edges.size - 1) or (k + 1 < edges.size and at[k + 1] - at[kept[-1]] > finest + SAME):
            kept.append(k)
    errors = {pair: off(*pair) for pair in pairwise(kept)}
    while sum(map(abs, errors.values())) > missed:
        limit = max(missed / len(errors), 0.25 * max(map(abs, errors.values())))
        worst = [(a, b) for (a, b), e in errors.items() if abs(e) >= limit and b - a > 1]
        if not worst:
            limit = missed / len(errors)
            worst = [(a, b) for (a, b), e in errors.items() if abs(e) >= limit and b - a > 1]
        if not worst:
            break
        for a, b in worst:
            middle = (a + b) // 2
            del errors[a, b]
            errors |= {(a, middle): off(a, middle), (middle, b): off(middle, b)}
    return edges[sorted({k for pair in errors for k in pair})]


def _graded(weights: WindWeights) -> NDArray[np.float64]:
    """Return times (s) that divide the flight up to t2 into panels, small near t2."""
    largest = min(LARGEST, *(POINTS * float(np.diff(piece.t).max()) for piece in weights.pieces))
    found = [weights.time]
    while found[-1] > weights.begin:
        size = float(np.clip((weights.time - found[-1]) / GRADE, SMALLEST, largest))
        found.append(max(weights.begin, found[-1] - size))
    return np.array(found[::-1])


def _spread(low: float, high: float, spacing: float) -> list[float]:
    return np.linspace(low, high, max(1, int(np.ceil((high - low) / spacing))) + 1).tolist() if high > low else []


def _distinct(kept: Sequence[float], more: Sequence[float], low: float, high: float) -> NDArray[np.float64]:
    """Return altitudes in order, without those too close to one that is kept or to each other to be told apart."""
    found = np.unique(np.clip(kept, low, high))
    found = found[np.concatenate([[True], np.diff(found) > SAME])]
    rest = np.unique(np.clip(more, low, high))
    rest = rest[np.concatenate([[True], np.diff(rest) > SAME])]
    near = np.abs(rest[:, None] - found).min(axis=1)
    return np.sort(np.concatenate([found, rest[near > SAME]]))
