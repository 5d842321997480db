"""Outputs over a window of flight as a Gaussian process on a grid, from which paths are drawn.

Two forms of the same: few outputs by their covariance between all times, of which one factor gives any number of paths;
many outputs, such as the loads of all stations, by the states, which are few, and never by a matrix of stations and
times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..solvers.discretisation import symmetric_root
from ..solvers.markov_chain import MarkovChain

NEIGHBOURS = 8  # old points that a new one between them is drawn from
SEVERAL = 5.0  # standard deviations that a path may go between two points
BLOCK = 64  # times that a covariance between all times is made of at once
JITTER = (1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9)  # of a variance; what a factor of a smooth process needs


@dataclass(frozen=True, eq=False)
class Grid:
    """Points of time, and what is known of r outputs there.

    Attributes
    ----------
    times : (m,) array
        s.
    mean : (m, r) array
    diffusion : (m, r) array
        What white noise does to an output directly, output unit s^-1/2; its sign tells which outputs it moves the same
        way. Zero where an output is differentiable.
    """

    times: NDArray[np.float64]
    mean: NDArray[np.float64]
    diffusion: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Steps:
    """Some steps of many paths.

    Attributes
    ----------
    path, step : (k,) arrays of int
    begin, end : (k, r) arrays
        Deviations from the mean at their ends.
    """

    path: NDArray[np.intp]
    step: NDArray[np.intp]
    begin: NDArray[np.float64]
    end: NDArray[np.float64]

    @staticmethod
    def of(paths: NDArray[np.float64], near: NDArray[np.bool_]) -> Steps:
        """Return the steps of paths (count, m, r) beside points ``near`` (count, m)."""
        path, step = np.nonzero(near[:, 1:] | near[:, :-1])
        return Steps(path, step, paths[path, step], paths[path, step + 1])

    @staticmethod
    def of_every_second(paths: NDArray[np.float64], near: NDArray[np.bool_]) -> Steps:
        """Return the same of every second point."""
        seen = near[:, ::2].copy()
        between = near[:, 1::2]
        seen[:, : between.shape[1]] |= between
        return Steps.of(paths[:, ::2], seen)


@dataclass(frozen=True, eq=False)
class Halving:
    """New points in the middle between old ones, each given its nearest old ones.

    Attributes
    ----------
    neighbours : (k, 8) array of int
        Old points.
    weight : (k, 8, r, r) array
        Of the deviations there.
    spread : (k, r, r) array
        A root of the covariance that remains.
    freedom : (k,) array
        By how much of a variance the covariance of a new point with the next is off, each being drawn by itself from
        its own neighbours: of a fast oscillation on too coarse a grid, crests lose what joins them.
    """

    neighbours: NDArray[np.intp]
    weight: NDArray[np.float64]
    spread: NDArray[np.float64]
    freedom: NDArray[np.float64]

    def between(
        self,
        old: NDArray[np.float64],
        path: NDArray[np.intp],
        point: NDArray[np.intp],
        random: np.random.Generator,
    ) -> NDArray[np.float64]:
        """Return drawn deviations of some paths at some new points (k, r), from those at old ones (count, k + 1, r)."""
        value = _times(self.spread[point], random.standard_normal((path.size, old.shape[2])))
        for neighbour, weight in zip(self.neighbours.T, self.weight.swapaxes(0, 1), strict=True):
            value += _times(weight[point], old[path, neighbour[point]])
        return value

    def applied(
        self, old: NDArray[np.float64], near: NDArray[np.bool_], random: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return deviations on the finer grid (count, 2 k + 1, r) from those at old points (count, k + 1, r).

        New ones are drawn where ``near`` (count, k); elsewhere they lie straight between their neighbours.
        """
        finer = np.empty((len(old), old.shape[1] + near.shape[1], old.shape[2]))
        finer[:, ::2] = old
        finer[:, 1::2] = 0.5 * (old[:, 1:] + old[:, :-1])
        path, point = np.nonzero(near)
        finer[path, 2 * point + 1] = self.between(old, path, point, random)
        return finer

    def expected(self, old: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what deviations at old points (count, k + 1, r) let expect on the finer grid (count, 2 k + 1, r)."""
        finer = np.empty((len(old), old.shape[1] + len(self.spread), old.shape[2]))
        finer[:, ::2] = old
        finer[:, 1::2] = np.einsum("ckjb,kjab->cka", old[:, self.neighbours], self.weight)
        return finer


def _times(matrix: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return products of matrices (k, r, r) and vectors (k, r) of few components."""
    product = matrix[:, :, 0] * vector[:, :1]
    for b in range(1, vector.shape[1]):
        product += matrix[:, :, b] * vector[:, b, None]
    return product


@dataclass(frozen=True, eq=False)
class JointOutputs:
    """Few outputs by their covariance between all points drawn; between them, where asked, by a few neighbours.

    The covariance may be one that no chain makes, such as after something was measured.

    Attributes
    ----------
    drawn : Grid
    covariance : (m, r, m, r) array
    halvings : tuple of Halving
        From the grid drawn to the grid seen.
    finer : Grid or None
        The grid seen; that drawn without it.
    """

    drawn: Grid
    covariance: NDArray[np.float64]
    halvings: tuple[Halving, ...] = ()
    finer: Grid | None = None

    @property
    def seen(self) -> Grid:
        return self.finer or self.drawn

    @property
    def stride(self) -> int:
        """Steps of the grid seen in one of the grid drawn."""
        return 2 ** len(self.halvings)

    @cached_property
    def freedom(self) -> NDArray[np.float64]:
        """The largest part of a variance by which halvings are off near each point seen, (m',)."""
        found = np.zeros(self.seen.times.size)
        for halving in self.halvings:
            share = (found.size - 1) // halving.freedom.size
            found[:-1] = np.maximum(found[:-1], np.repeat(halving.freedom, share))
        return found

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation at the points drawn, (m, r)."""
        return np.sqrt(np.maximum(np.einsum("mrmr->mr", self.covariance), 0.0))

    def instant_covariance(self) -> NDArray[np.float64]:
        """Return the covariance of outputs at each point drawn, (m, r, r)."""
        m = self.drawn.times.size
        return self.covariance[np.arange(m), :, np.arange(m)]

    @cached_property
    def between(self) -> NDArray[np.float64]:
        """How far a path goes between two points drawn without being seen at either, (m, r)."""
        own = np.einsum("mrnr->rmn", self.covariance)
        lags = (np.diagonal(own, lag, axis1=1, axis2=2).T for lag in (0, 1, 2))
        return _unseen(*lags)

    def restricted(self, points: slice, outputs: NDArray[np.intp]) -> JointOutputs | None:
        """Return the process at some consecutive points drawn and of some outputs; None where that saves nothing."""
        if self.halvings:
            return None
        grid = self.drawn
        part = Grid(grid.times[points], grid.mean[points][:, outputs], grid.diffusion[points][:, outputs])
        return JointOutputs(part, self.covariance[points][:, outputs][:, :, points][..., outputs])

    @cached_property
    def expected(self) -> NDArray[np.float64]:
        """What deviations at the points drawn let expect at those seen, (m seen, r, m, r)."""
        m, r = self.drawn.mean.shape
        found = np.eye(m * r).reshape(m * r, m, r)
        for halving in self.halvings:
            found = halving.expected(found)
        return np.moveaxis(found.reshape(m, r, *found.shape[1:]), (2, 3), (0, 1))

    @cached_property
    def _factor(self) -> NDArray[np.float64]:
        return _root(self.covariance.reshape(self.std.size, self.std.size))

    def deviations(self, random: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return drawn deviations from the mean, (count, m, r)."""
        return (random.standard_normal((count, self.std.size)) @ self._factor.T).reshape(count, *self.std.shape)

    def covariances(self, points: NDArray[np.intp], outputs: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return covariances of everything with chosen outputs at chosen points, (len(points), m, r)."""
        return self.covariance[points, outputs]

    def steps_near(
        self, deviations: NDArray[np.float64], near: NDArray[np.bool_], random: np.random.Generator
    ) -> tuple[Steps, Steps]:
        """Return the steps of drawn deviations, conditioned or not, beside points ``near`` (count, m).

        On the grid seen, where what lies between the points drawn is drawn as well, and on every second point of it.
        """
        if not self.halvings:
            return Steps.of(deviations, near), Steps.of_every_second(deviations, near)
        found = deviations
        for halving in self.halvings[:-1]:
            steps = near[:, 1:] | near[:, :-1]
            wider = steps.copy()
            for _ in range(NEIGHBOURS // 2):  # what the next halving looks at
                wider[:, 1:] |= wider[:, :-1].copy()
                wider[:, :-1] |= wider[:, 1:].copy()
            found = halving.applied(found, wider, random)
            finer = np.zeros(found.shape[:2], bool)
            finer[:, ::2], finer[:, 1::2] = near, steps
            near = finer
        coarser = Steps.of(found, near)
        path, step = coarser.path, coarser.step
        middle = self.halvings[-1].between(found, path, step, random)
        both = np.stack([coarser.begin, middle], axis=1), np.stack([middle, coarser.end], axis=1)
        begin, end = (part.reshape(-1, found.shape[2]) for part in both)
        halves = np.stack([2 * step, 2 * step + 1], axis=1).ravel()
        return Steps(np.repeat(path, 2), halves, begin, end), coarser


def joint_outputs(
    chain: MarkovChain,
    row: NDArray[np.float64],
    mean: NDArray[np.float64],
    halvings: int = 0,
    sources: Sequence[int] | None = None,
) -> JointOutputs:
    """Return the process of a few outputs of a chain.

    Parameters
    ----------
    chain : MarkovChain
        At (m - 1) 2^halvings + 1 times.
    row : (m', r, n) array
        Of the outputs over the states, at the times of the chain.
    mean : (m', r) array
    halvings : int
        How often the grid drawn is halved to the grid of the chain.
    sources : sequence of int, optional
        Numbers of those that act; all without it.
    """
    P = chain.covariance(sources)
    seen = Grid(chain.times, mean, signed_diffusion(row @ chain.acting_noise_matrix(sources)))
    stride = 2**halvings
    at = slice(None, None, stride)
    drawn = Grid(seen.times[at], seen.mean[at], seen.diffusion[at])
    covariance = _joint_covariance(chain, row, P, stride)
    if not halvings:
        return JointOutputs(drawn, covariance)
    band = _band(chain, row, P, (2 * NEIGHBOURS - 1) * stride)
    found = tuple(_halving(band, stride // 2**k) for k in range(halvings))
    return JointOutputs(drawn, covariance, found, seen)


def joint_covariance(
    chain: MarkovChain, row: NDArray[np.float64], sources: Sequence[int] | None = None, stride: int = 1
) -> NDArray[np.float64]:
    """Return the covariance of outputs between every so many times of a chain, (m, r, m, r).

    Parameters
    ----------
    chain : MarkovChain
    row : (m, r, n) array
        Of the outputs over the states.
    sources : sequence of int, optional
        Numbers of those that act; all without it.
    stride : int
    """
    return _joint_covariance(chain, row, chain.covariance(sources), stride)


def _joint_covariance(
    chain: MarkovChain, row: NDArray[np.float64], P: NDArray[np.float64], stride: int
) -> NDArray[np.float64]:
    """Return the covariance of outputs between every so many times of a chain, (m, r, m, r)."""
    rows, P = row[::stride], P[::stride]
    m, r, n = rows.shape
    found = np.zeros((m * r, m * r))
    columns = np.zeros((n, m * r))  # Phi(t_first, t_j) P(t_j) C(t_j)' for all j before a block's first time
    for first in range(0, m, BLOCK):
        count = min(BLOCK, m - first)
        steps = [_transition(chain, first + k, stride) for k in range(count) if first + k < m - 1]
        own = np.zeros((n, count * r))  # the same of the block's own j, up to t_k
        onward = np.eye(n)  # Phi(t_k, t_first)
        seen = np.empty((count * r, n))
        for k in range(count):
            if k:
                own[:, : k * r] = steps[k - 1] @ own[:, : k * r]
                onward = steps[k - 1] @ onward
            now = slice(k * r, (k + 1) * r)
            own[:, now] = P[first + k] @ rows[first + k].T
            seen[now] = rows[first + k] @ onward
            at = slice((first + k) * r, (first + k + 1) * r)
            inside = slice(first * r, at.stop)
            found[at, inside] = rows[first + k] @ own[:, : (k + 1) * r]
            found[inside, at] = found[at, inside].T
        block, before = slice(first * r, (first + count) * r), slice(0, first * r)
        found[block, before] = seen @ columns[:, before]
        found[before, block] = found[block, before].T
        if len(steps) == count:
            columns[:, before] = steps[-1] @ onward @ columns[:, before]
            columns[:, block] = steps[-1] @ own
    return found.reshape(m, r, m, r)


def _transition(chain: MarkovChain, step: int, stride: int) -> NDArray[np.float64]:
    """Return Phi over so many steps of a chain at once."""
    Phi = chain.transition[step * stride]
    for further in chain.transition[step * stride + 1 : (step + 1) * stride]:
        Phi = further @ Phi
    return Phi


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a factor L of a covariance L L' (k, k), lower where it can be, zero where nothing varies."""
    spread = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    varies = np.flatnonzero(spread > 0)
    std = spread[varies]
    correlation = covariance[np.ix_(varies, varies)] / np.outer(std, std)
    factor = np.zeros_like(covariance)
    for jitter in JITTER:
        try:
            root = np.linalg.cholesky(correlation + jitter * np.eye(varies.size))
        except np.linalg.LinAlgError:
            continue
        factor[np.ix_(varies, varies)] = std[:, None] * root
        return factor
    values, vectors = np.linalg.eigh(correlation)
    factor[np.ix_(varies, varies)] = std[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return factor


def _unseen(
    variance: NDArray[np.float64], next_one: NDArray[np.float64], next_but_one: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far a path goes between two points without being seen at either, (m, r).

    From the covariances (m, r), (m - 1, r) and (m - 2, r) of each point with itself, the next and the one after: what a
    point is off the middle of its neighbours; half its variance in the middle of a step, or less.
    """
    between = np.zeros_like(variance)
    if len(variance) > 2:
        off = variance[1:-1] + 0.25 * (variance[:-2] + variance[2:]) + 0.5 * next_but_one - next_one[1:] - next_one[:-1]
        between[1:-1] = SEVERAL * np.sqrt(np.maximum(off, 0.0) / 2)
        between[0], between[-1] = between[1], between[-2]
    return between


def _band(chain: MarkovChain, row: NDArray[np.float64], P: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return R(t_i, t_{i - l}) for l = 0 ... width - 1, (m, width, r, r); zero before the first time."""
    m, r, n = row.shape
    band = np.zeros((m, r, width * r))
    columns = np.zeros((n, width * r))
    for i in range(m):
        if i:
            columns[:, r:] = chain.transition[i - 1] @ columns[:, :-r]
        columns[:, :r] = P[i] @ row[i].T
        band[i] = row[i] @ columns
    return band.reshape(m, r, width, r).swapaxes(1, 2)


def _halving(band: NDArray[np.float64], stride: int) -> Halving:
    """Return how points in the middle of a grid, each ``stride`` points of the band apart, follow from that grid."""
    last = (len(band) - 1) // stride  # number of the last old point
    count, r = min(NEIGHBOURS, last + 1), band.shape[2]
    first = np.clip(np.arange(last) + 1 - count // 2, 0, last + 1 - count)
    neighbours = first[:, None] + np.arange(count)
    middle = stride * np.arange(last) + stride // 2

    def covariance(i: NDArray, j: NDArray) -> NDArray[np.float64]:
        found = band[np.maximum(i, j), np.abs(i - j)]
        return np.where((i < j)[..., None, None], found.swapaxes(-1, -2), found)

    old = stride * neighbours
    K = covariance(old[:, :, None], old[:, None, :]).swapaxes(2, 3).reshape(last, count * r, count * r)
    k = covariance(*np.broadcast_arrays(middle[:, None], old)).swapaxes(1, 2).reshape(last, r, count * r)
    own = band[middle, 0]
    size = np.sqrt(np.maximum(np.einsum("mii->mi", K), 0.0))
    unit = np.where(size > 0, size, 1.0)
    correlation = K / (unit[:, :, None] * unit[:, None, :])
    correlation[:, np.arange(count * r), np.arange(count * r)] = 1.0 + JITTER[-2]
    weight = np.linalg.solve(correlation, (k / unit[:, None]).swapaxes(1, 2)).swapaxes(1, 2) / unit[:, None]
    remains = own - weight @ k.swapaxes(1, 2)
    spread = symmetric_root(remains) if r > 1 else np.sqrt(np.maximum(remains, 0.0))
    between = covariance(old[1:, :, None], old[:-1, None, :]).swapaxes(2, 3).reshape(last - 1, count * r, count * r)
    drawn = weight[1:] @ between @ weight[:-1].swapaxes(1, 2)
    freedom = _freedom(covariance(middle[1:], middle[:-1]), drawn, own)
    return Halving(neighbours, weight.reshape(last, r, count, r).swapaxes(1, 2), spread, freedom)


def _freedom(true: NDArray[np.float64], drawn: NDArray[np.float64], own: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much of a variance (k, r, r) covariances (k - 1, r, r) with the next are off, at most, (k,)."""
    std = np.sqrt(np.maximum(np.einsum("mrr->mr", own), 0.0))
    size = std[1:, :, None] * std[:-1, None, :]
    found = np.divide(np.abs(true - drawn), size, out=np.zeros_like(size), where=size > 0).max(axis=(1, 2), initial=0.0)
    return np.append(found, found[-1:] if found.size else 0.0)


def signed_diffusion(direct: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sizes of C B (m, r, noises) with the sign of their largest entry, (m, r)."""
    size = np.sqrt((direct**2).sum(axis=2))
    if not direct.shape[2]:
        return size
    largest = np.take_along_axis(direct, np.abs(direct).argmax(axis=2)[..., None], axis=2)[..., 0]
    return np.where(largest < 0, -size, size)


@dataclass(frozen=True, eq=False)
class ManyOutputs:
    """Many outputs of one chain, by its states.

    Attributes
    ----------
    chain : MarkovChain
    row : (m, r, n) array
    mean : (m, r) array
    """

    chain: MarkovChain
    row: NDArray[np.float64]
    mean: NDArray[np.float64]

    @cached_property
    def drawn(self) -> Grid:
        return Grid(self.chain.times, self.mean, signed_diffusion(self.row @ self.chain.noise_matrix))

    @property
    def seen(self) -> Grid:
        return self.drawn

    @property
    def stride(self) -> int:
        return 1

    @cached_property
    def between(self) -> NDArray[np.float64]:
        """How far a path goes between two points without being seen at either, (m, r)."""
        seen = self._P[:-1] @ self.row[:-1].swapaxes(1, 2)  # P(t_k) C(t_k)', (m - 1, n, r)
        once = self.chain.transition @ seen
        twice = self.chain.transition[1:] @ once[:-1]
        next_one = np.einsum("mrn,mnr->mr", self.row[1:], once)
        next_but_one = np.einsum("mrn,mnr->mr", self.row[2:], twice)
        return _unseen(self.std**2, next_one, next_but_one)

    def restricted(self, points: slice, outputs: NDArray[np.intp]) -> ManyOutputs | None:
        """Return the process at some consecutive points drawn and of some outputs; None where that saves nothing."""
        return ManyOutputs(self.chain.part(points), self.row[points][:, outputs], self.mean[points][:, outputs])

    @cached_property
    def _scale(self) -> NDArray[np.float64]:
        """The largest standard deviation of every state; states are drawn relative to it."""
        size = np.sqrt(np.maximum(np.einsum("mii->mi", self._P), 0.0)).max(axis=0)
        return np.where(size > 0, size, 1.0)

    @cached_property
    def _P(self) -> NDArray[np.float64]:
        return self.chain.covariance()

    @cached_property
    def std(self) -> NDArray[np.float64]:
        return np.sqrt(np.maximum(np.einsum("mri,mij,mrj->mr", self.row, self._P, self.row, optimize=True), 0.0))

    def instant_covariance(self) -> NDArray[np.float64]:
        """Return the covariance of outputs at each point, (m, r, r)."""
        return self.row @ self._P @ self.row.swapaxes(1, 2)

    @property
    def freedom(self) -> NDArray[np.float64]:
        """Zero at each point, (m,): every point that is seen is drawn."""
        return np.zeros(self.chain.times.size)

    @cached_property
    def _roots(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Roots of the covariance at the start and of what noise adds in each step."""
        return symmetric_root(self._P[0]), symmetric_root(self.chain.added.sum(axis=1))

    @cached_property
    def _rows_on_scale(self) -> NDArray[np.float64]:
        return np.ascontiguousarray((self.row * self._scale).swapaxes(1, 2))

    def deviations(self, random: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return drawn deviations from the mean, (count, m, r)."""
        first, roots = self._roots
        m, _, n = self.row.shape
        states = np.empty((m, count, n))
        states[0] = random.standard_normal((count, n)) @ first.T
        for k, Phi in enumerate(self.chain.transition):
            states[k + 1] = states[k] @ Phi.T + random.standard_normal((count, n)) @ roots[k].T
        return self._seen(states)

    def covariances(self, points: NDArray[np.intp], outputs: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return covariances of everything with chosen outputs at chosen points, (len(points), m, r)."""
        m, _, n = self.row.shape
        count = points.size
        states = np.zeros((m, count, n))
        order = np.argsort(points, kind="stable")
        at = points[order]
        rows = self.row[at, outputs[order]]  # C(t_j), the rows that each draw is about
        begun = np.searchsorted(at, np.arange(m + 1))  # draws whose point is before each time
        forward = np.zeros((count, n))
        for k in range(m):
            if k:
                forward[: begun[k]] = forward[: begun[k]] @ self.chain.transition[k - 1].T
            new = slice(begun[k], begun[k + 1])
            forward[new] = rows[new] @ self._P[k]
            states[k, : begun[k + 1]] = forward[: begun[k + 1]]
        backward = np.zeros((count, n))  # Phi(t_j, t_k)' C(t_j)'
        for k in range(m - 1, -1, -1):
            if k < m - 1:
                backward[begun[k + 1] :] = backward[begun[k + 1] :] @ self.chain.transition[k]
                states[k, begun[k + 1] :] = backward[begun[k + 1] :] @ self._P[k]
            new = slice(begun[k], begun[k + 1])
            backward[new] = rows[new]
        found = np.empty((count, m, self.row.shape[1]))
        found[order] = self._seen(states)
        return found

    def steps_near(
        self, deviations: NDArray[np.float64], near: NDArray[np.bool_], random: np.random.Generator
    ) -> tuple[Steps, Steps]:
        """Return the steps of drawn deviations, conditioned or not, beside points ``near`` (count, m).

        On the grid seen, where what lies between the points drawn is drawn as well, and on every second point of it.
        """
        return Steps.of(deviations, near), Steps.of_every_second(deviations, near)

    def _seen(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return outputs (count, m, r) of states (m, count, n)."""
        return np.ascontiguousarray((states / self._scale @ self._rows_on_scale).swapaxes(0, 1))
