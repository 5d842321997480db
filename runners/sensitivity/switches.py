"""What a variance or mean owes to the times of the system's own switches, where parameters move them.

A switch at s(t, p) = 0 moves by dt/dp = -(ds/dp) / (ds/dt). Between the old and the new time the equations of one side
act in the place of the other's, so that the quantity changes by the difference of its integrand on both sides:

    dVar/dt = 2 a'(A- - A+) y + a'(B- B-' - B+ B+') a        dmean/dt = a'[(A- - A+) x + E- u- - E+ u+]

with a the adjoint, y its product with the covariance and x the mean, all three continuous there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.system.time_conditions import Stops
from ..solvers.time_nodes import just_after
from .pair import AdjointPair

NOTHING = 1e-9  # of the two sides of a switch, a difference between them that is rounding
TOGETHER = 1e-9  # relative difference of two velocities with which switches move as one


@dataclass(frozen=True, eq=False)
class SwitchGradient:
    """Derivatives by parameters through the times of switches.

    Attributes
    ----------
    parameters : (n_p,) array
    undefined : dict of int to str
        Parameters by which there is no derivative, and why.
    reach : dict of int to float
        Parameters that move a switch, and by how much they may change before it meets another, the start or the end.
    """

    parameters: NDArray[np.float64]
    undefined: dict[int, str]
    reach: dict[int, float]


def switch_velocities(pair: AdjointPair, stops: Stops) -> list[NDArray[np.float64]]:
    """Return by stop dt/dp of its switches, (switches, n_p), NaN where a parameter makes or unmakes it."""
    system, p = pair.executable.system, pair.executable.parameters
    found = []
    for members, touched in zip(stops.members, stops.touched, strict=True):
        rows = np.zeros((len(members), p.size))
        for row, (number, time) in zip(rows, members, strict=True):
            condition = system.conditions[number]
            rate = condition.at(np.array([time]), p)[1, 0]
            by_parameters = np.array(condition.by_parameters(time, p), float).ravel()
            depends = np.array(condition.parameters, bool)
            if touched or rate == 0:
                row[depends] = np.nan
            else:
                row[depends] = -by_parameters[depends] / rate
        found.append(rows)
    return found


def through_switches(
    pair: AdjointPair, variance_factor: float, mean_factor: float, at_peak: bool = False
) -> SwitchGradient:
    """Return what ``variance_factor`` variance + ``mean_factor`` mean owes to the times of switches.

    A largest value that lies on a switch (``at_peak``) goes with it: by its slope on its own side.
    """
    executable, node = pair.executable, pair.node
    system, undefined, reach = executable.system, dict[int, str](), dict[int, float]()
    found = np.zeros(executable.parameters.size)
    if not any(any(condition.parameters) for condition in system.conditions):
        return SwitchGradient(found, undefined, reach)
    stops = executable.stops(node)
    slope = float(np.dot([variance_factor, mean_factor], pair.slopes)) if at_peak else 0.0
    for k, velocities in enumerate(switch_velocities(pair, stops)):
        moved = np.flatnonzero((velocities != 0).any(axis=0)).tolist()
        if stops.after[k] < system.start or stops.before[k] > node or not moved:
            continue
        sides, at = _Sides(pair, stops, k, variance_factor, mean_factor), f"{stops.times[k]:g} s"
        after = at_peak and just_after(system, node, float(stops.times[k]))
        if stops.before[k] <= system.start:
            if sides.jump:
                undefined |= dict.fromkeys(moved, f"the switch that it moves lies at the start, {at}")
            reach |= dict.fromkeys(moved, 0.0)
            continue
        if stops.after[k] >= node:
            if at_peak:
                found[moved] += slope * velocities[0, moved]
            elif sides.jump or not sides.same_outputs:
                undefined |= dict.fromkeys(moved, f"the switch that it moves lies on the end time, {at}")
            reach |= dict.fromkeys(moved, 0.0)
            continue
        around = [system.start, node, *stops.times[max(k - 1, 0) : k], *stops.times[k + 1 : k + 2]]
        gap = min(abs(stops.times[k] - time) for time in around)
        one, spread = velocities[0], np.abs(velocities - velocities[0]).max(axis=0)
        for i in moved:
            if not np.isfinite(velocities[:, i]).all():
                undefined[i] = f"at {at} it makes or unmakes a switch instead of moving it"
            elif spread[i] > TOGETHER * np.abs(one[i]):
                undefined[i] = f"two switches that it moves apart lie together at {at}"
            else:
                found[i] += (sides.jump + (slope if after else 0.0)) * one[i]
                reach[i] = min(reach.get(i, np.inf), float(gap / abs(one[i])))
    return SwitchGradient(found, undefined, reach)


class _Sides:
    """The integrand of a quantity on both sides of a stop.

    Attributes
    ----------
    jump : float
        The difference, before minus after; zero where it is rounding.
    same_outputs : bool
        The output's row and its direct part are the same on both sides.
    """

    def __init__(self, pair: AdjointPair, stops: Stops, number: int, variance_factor: float, mean_factor: float):
        edges = pair.flight.grid.edges[: pair.steps + 1]
        at = int(np.argmin(np.abs(edges - stops.times[number])))
        a, y, x = pair.adjoint_at_edges[at], pair.dual_at_edges[at], pair.flight.mean[1][at]
        values, outputs, size = [], [], 0.0
        for time in (float(stops.before[number]), float(stops.after[number])):
            m = pair.executable.matrices(time, time, time)
            u, white = m["inputs"][:, 0], pair.mask * (m["B"].T @ a)
            parts = (
                2 * variance_factor * a @ m["A"] @ y,
                variance_factor * white @ white,
                mean_factor * a @ (m["A"] @ x + m["E"] @ u),
            )
            values.append(float(sum(parts)))
            size += float(sum(abs(part) for part in parts))
            outputs.append(np.append(pair.form @ m["C"], pair.form @ m["G"] @ u))
        difference = values[0] - values[1]
        self.jump = 0.0 if abs(difference) <= NOTHING * size else difference
        self.same_outputs = bool(np.abs(outputs[0] - outputs[1]).max() <= NOTHING * np.abs(outputs).max())
