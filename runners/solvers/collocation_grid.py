"""The grid of the collocation: steps that end on discontinuities and table knots, short beside jumps and ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.gauss_legendre import NODES, WEIGHTS
from ...codegen.system.executable import ExecutableSystem
from ...model.tables import TableGroup
from .time_nodes import intervals, time_nodes

FAST = 3.4  # rad, the longest step of the fastest root, of whatever damping: 0.04 s of AS-504
LEAST_STEPS, MOST_STEPS = 1000, 3500  # of a flight, for the sake of the fastest root
PHASE = 0.8  # rad, the longest step of the fastest lightly damped root: its error is then 5e-9 rad
LIGHT = 0.3  # damping ratio below which a root rings on through the flight
FIRST = 0.05  # of the longest step, beside the ends and discontinuities, where fast roots leave transients
FIRST_FAST = 0.17  # rad, of the fastest root, the same
LEAST = 8  # steps between two ends or discontinuities
GROWTH = 0.3  # of the step with distance from there, s/s

FINE = 1.3  # spacing of knots, in steps, below which a table is taken as smooth


@dataclass(frozen=True, eq=False)
class Grid:
    """Steps from the start of a system to t2.

    Attributes
    ----------
    edges : (k + 1,) array
        s.
    """

    edges: NDArray[np.float64]

    @property
    def steps(self) -> NDArray[np.float64]:
        return np.diff(self.edges)

    @property
    def nodes(self) -> NDArray[np.float64]:
        """Collocation times, (k, 4)."""
        return self.edges[:-1, None] + self.steps[:, None] * NODES

    @property
    def weights(self) -> NDArray[np.float64]:
        """Quadrature weights of the nodes, s, (k, 4)."""
        return self.steps[:, None] * WEIGHTS


@dataclass(frozen=True)
class StepLengths:
    """The longest step, and that beside ends and discontinuities, s."""

    longest: float
    first: float


def collocation_grid(executable: ExecutableSystem, times: Sequence[float], steps: StepLengths) -> Grid:
    """Return a grid to the last of the end times, all of which are edges of it.

    Steps end on discontinuities and table knots and are short beside the former and the end times. Tables are cubic
    between knots and less smooth across them; a step that held a knot would lose its order.
    """
    nodes, first = time_nodes(executable, np.sort(times)), steps.first
    begin, end = executable.system.start, float(nodes[-1])
    ends = sorted({begin, *(i.end for i in intervals(executable, begin, end)), *nodes.tolist()})
    edges = [np.array([begin])]
    knots = _knot_times(executable.groups, begin, end, steps)
    for low, high in pairwise(ends):
        breaks = np.concatenate([[low], knots[(knots > low + first) & (knots < high - first)], [high]])
        if high - low < 2 * LEAST * first:
            breaks = np.linspace(low, high, LEAST + 1)
        marks = _steps_from_edge(breaks, low, high, steps)
        edges.append(_time_at(_whole_steps(marks), low, high, steps))
        edges[-1][-1] = high
    return Grid(np.concatenate(edges))


def step_lengths(matrices: NDArray[np.float64], flight: float) -> StepLengths:
    """Return the steps for a flight (s) that follow the roots of state matrices (k, n, n).

    They follow the lightly damped roots all along; fast others decay within the short steps beside ends and jumps.
    """
    roots = np.linalg.eigvals(matrices).ravel()
    ringing = np.abs(roots[-roots.real < LIGHT * np.abs(roots)]).max(initial=PHASE / flight)
    fastest = np.abs(roots).max(initial=FAST / flight)
    longest = min(np.clip(FAST / fastest, flight / MOST_STEPS, flight / LEAST_STEPS), PHASE / ringing)
    return StepLengths(float(longest), float(min(FIRST * longest, FIRST_FAST / fastest)))


def _whole_steps(marks: NDArray) -> NDArray[np.float64]:
    """Divide the distances between marks into equal parts no longer than one, and return where they end."""
    distance = np.diff(marks)
    count = np.maximum(1, np.ceil(distance - 1e-9)).astype(int)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + 1
    return np.repeat(marks[:-1], count) + within * np.repeat(distance / count, count)


def _steps_from_edge(times: NDArray, low: float, high: float, steps: StepLengths) -> NDArray:
    """Return how many steps lie between ``low`` and each time, a smooth and increasing function."""
    middle = 0.5 * (low + high)
    from_edge = _count(np.minimum(times - low, high - times), steps)
    return np.where(times <= middle, from_edge, 2 * _count(np.array(middle - low), steps) - from_edge)


def _count(distance: NDArray, steps: StepLengths) -> NDArray:
    reach = (steps.longest - steps.first) / GROWTH
    near = np.log1p(GROWTH * np.minimum(distance, reach) / steps.first) / GROWTH
    return near + np.maximum(distance - reach, 0.0) / steps.longest


def _time_at(count: NDArray, low: float, high: float, steps: StepLengths) -> NDArray:
    total = 2 * float(_count(np.array(0.5 * (high - low)), steps))
    from_edge = np.minimum(count, total - count)
    reach = (steps.longest - steps.first) / GROWTH
    most = float(_count(np.array(reach), steps))
    near = np.expm1(GROWTH * np.minimum(from_edge, most)) * steps.first / GROWTH
    distance = near + np.maximum(from_edge - most, 0.0) * steps.longest
    return np.where(count <= 0.5 * total, low + distance, high - distance)


def _knot_times(groups: Sequence[TableGroup], begin: float, end: float, steps: StepLengths) -> NDArray:
    """Return the times at which a table passes a knot; a group sampled as finely as the steps is smooth for them."""
    found = [np.zeros(0)]
    fine = np.linspace(begin, end, 2 + int((end - begin) / (0.25 * steps.longest)))
    for group in groups:
        if np.median(np.diff(group.knots)) <= FINE * steps.longest and group.argument == "time":
            continue
        if group.argument == "time":
            found.append(group.knots)
            continue
        table = _single(groups, group.argument)
        argument = table.evaluate(fine)[:, 0]
        near = np.flatnonzero(np.diff(np.searchsorted(group.knots, argument, side="right")))
        which, knot_of = np.nonzero((argument[near, None] < group.knots) != (argument[near + 1, None] < group.knots))
        step_of = near[which]
        low, high, knot = fine[step_of], fine[step_of + 1], group.knots[knot_of]
        f_low, f_high = argument[step_of] - knot, argument[step_of + 1] - knot
        for _ in range(3):  # secants: the table is nearly straight over a quarter of a step
            rise = np.where(f_high == f_low, np.inf, f_high - f_low)
            low, high, f_low = high, high - f_high * (high - low) / rise, f_high
            f_high = table.evaluate(high)[:, 0] - knot
        found.append(high)
    times = np.unique(np.concatenate(found))
    times = times[(times > begin) & (times < end)]
    return times[np.concatenate([[True], np.diff(times) > steps.first])] if times.size else times


def _single(groups: Sequence[TableGroup], name: str) -> TableGroup:
    """Return one table over time as a group of its own."""
    group = next(g for g in groups if name in g.names)
    at = group.names.index(name)
    here = slice(at, at + 1)
    return replace(
        group,
        names=group.names[here],
        units=group.units[here],
        coefficients=group.coefficients[:, :, here],
        sources=group.sources[here],
    )


def tables_at(groups: Sequence[TableGroup], times: NDArray) -> NDArray[np.float64]:
    """Return all table values at many times, (k, n_v)."""
    found, names = [np.zeros((times.size, 0))], []
    for group in groups:
        known = np.concatenate(found, axis=1)
        argument = times if group.argument == "time" else known[:, names.index(group.argument)]
        found.append(group.evaluate(argument))
        names += group.names
    return np.concatenate(found, axis=1)
