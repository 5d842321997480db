"""The grid of the collocation: steps that end on discontinuities and table knots, short beside jumps and ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.tables import TableGroup
from .time_nodes import intervals, time_nodes

STEP = 0.04  # s, the longest
PHASE = 0.8  # rad, the longest step of the fastest lightly damped root: its error is then 5e-9 rad
LIGHT = 0.3  # damping ratio below which a root rings on through the flight
FIRST_STEP = 2e-3  # s, beside the ends and discontinuities, where filter poles near 100 rad/s leave fast transients
GROWTH = 0.3  # of the step with distance from there, s/s

FINE = 1.3  # spacing of knots, in steps, below which a table is taken as smooth
STAGES = 4  # of a step, order 8
_legendre, _weights = np.polynomial.legendre.leggauss(STAGES)
NODES, WEIGHTS = 0.5 * (1 + _legendre), 0.5 * _weights


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


def collocation_grid(executable: ExecutableSystem, times: Sequence[float], step: float = STEP) -> Grid:
    """Return a grid to the last of the end times, all of which are edges of it.

    Steps end on discontinuities and table knots and are short beside the former and the end times. Tables are cubic
    between knots and less smooth across them; a step that held a knot would lose its order.
    """
    nodes = time_nodes(executable, np.sort(times))
    begin, end = executable.system.start, float(nodes[-1])
    ends = sorted({begin, *(i.end for i in intervals(executable, begin, end)), *nodes.tolist()})
    edges = [np.array([begin])]
    knots = _knot_times(executable.groups, begin, end, step)
    for low, high in pairwise(ends):
        breaks = np.concatenate([[low], knots[(knots > low + FIRST_STEP) & (knots < high - FIRST_STEP)], [high]])
        marks = _steps_from_edge(breaks, low, high, step)
        edges.append(_time_at(_whole_steps(marks), low, high, step))
        edges[-1][-1] = high
    return Grid(np.concatenate(edges))


def longest_step(matrices: NDArray[np.float64]) -> float:
    """Return the longest step (s) that follows the lightly damped roots of state matrices (k, n, n)."""
    roots = np.linalg.eigvals(matrices).ravel()
    ringing = np.abs(roots[-roots.real < LIGHT * np.abs(roots)])
    return float(min(STEP, PHASE / max(ringing.max(initial=0.0), PHASE / STEP)))


def _whole_steps(marks: NDArray) -> NDArray[np.float64]:
    """Divide the distances between marks into equal parts no longer than one, and return where they end."""
    distance = np.diff(marks)
    count = np.maximum(1, np.ceil(distance - 1e-9)).astype(int)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + 1
    return np.repeat(marks[:-1], count) + within * np.repeat(distance / count, count)


def _steps_from_edge(times: NDArray, low: float, high: float, step: float) -> NDArray:
    """Return how many steps lie between ``low`` and each time, a smooth and increasing function."""
    middle = 0.5 * (low + high)
    from_edge = _count(np.minimum(times - low, high - times), step)
    return np.where(times <= middle, from_edge, 2 * _count(np.array(middle - low), step) - from_edge)


def _count(distance: NDArray, step: float) -> NDArray:
    reach = (step - FIRST_STEP) / GROWTH
    near = np.log1p(GROWTH * np.minimum(distance, reach) / FIRST_STEP) / GROWTH
    return near + np.maximum(distance - reach, 0.0) / step


def _time_at(count: NDArray, low: float, high: float, step: float) -> NDArray:
    total = 2 * float(_count(np.array(0.5 * (high - low)), step))
    from_edge = np.minimum(count, total - count)
    reach = (step - FIRST_STEP) / GROWTH
    most = float(_count(np.array(reach), step))
    near = np.expm1(GROWTH * np.minimum(from_edge, most)) * FIRST_STEP / GROWTH
    distance = near + np.maximum(from_edge - most, 0.0) * step
    return np.where(count <= 0.5 * total, low + distance, high - distance)


def _knot_times(groups: Sequence[TableGroup], begin: float, end: float, step: float) -> NDArray:
    """Return the times at which a table passes a knot; a group sampled as finely as the steps is smooth for them."""
    found = [np.zeros(0)]
    fine = np.linspace(begin, end, 2 + int((end - begin) / (0.25 * step)))
    for group in groups:
        if np.median(np.diff(group.knots)) <= FINE * step and group.argument == "time":
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
    return times[np.concatenate([[True], np.diff(times) > FIRST_STEP])] if times.size else times


def _single(groups: Sequence[TableGroup], name: str) -> TableGroup:
    """Return one table over time as a group of its own."""
    group = next(g for g in groups if name in g.names)
    at = group.names.index(name)
    return replace(group, names=(name,), units=(group.units[at],), coefficients=group.coefficients[:, :, [at]])


def tables_at(groups: Sequence[TableGroup], times: NDArray) -> NDArray[np.float64]:
    """Return all table values at many times, (k, n_v)."""
    found, names = [np.zeros((times.size, 0))], []
    for group in groups:
        known = np.concatenate(found, axis=1)
        argument = times if group.argument == "time" else known[:, names.index(group.argument)]
        found.append(group.evaluate(argument))
        names += group.names
    return np.concatenate(found, axis=1)
