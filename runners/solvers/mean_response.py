"""The mean response to the known inputs, forward, and the tables of it that the noise coefficients need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import state_scales
from ...model.tables import TableGroup
from .integration import CvodesSettings, Integrator
from .step_budget import naming_fastest_root
from .time_nodes import Interval, intervals

TOLERANCE = 1e-9
IN_STEP = 1e-6  # of the distance between times


@dataclass(frozen=True, eq=False)
class MeanResponse:
    """States and outputs of the mean, forward from rest at the start.

    Attributes
    ----------
    times : (k,) array
        s.
    states : (k, n) array
    outputs : (k, n_y) array
    """

    times: NDArray[np.float64]
    states: NDArray[np.float64]
    outputs: NDArray[np.float64]


def mean_response(
    executable: ExecutableSystem, times: NDArray[np.float64], relative_tolerance: float = TOLERANCE
) -> MeanResponse:
    """Integrate the mean forward.

    Parameters
    ----------
    executable : ExecutableSystem
    times : (k,) array
        Increasing, the first at the start of the system; runs of equidistant ones are integrated in one go.
    relative_tolerance : float

    Raises
    ------
    IntegrationError
    """
    system = executable.system
    scale = state_scales(system)
    integrator = Integrator(executable.functions.mean, CvodesSettings(relative_tolerance=relative_tolerance))
    states = [np.zeros(len(scale))]
    last = states[0]
    outputs: list[NDArray] = []
    response = executable.functions.response
    for interval in intervals(executable, float(times[0]), float(times[-1]), pulses=False):
        inside = times[(times > interval.begin) & (times <= interval.end)]
        pieces = []
        for begin, end, points in equidistant(interval, inside):
            parameters = executable.integrator_parameters(begin, end - begin, interval.low, interval.high)
            where = f"of the mean response from {begin:g} s to {end:g} s"
            with naming_fastest_root(executable):
                scaled, _, _ = integrator.run(last / scale, parameters, where, points)
            pieces.append(scaled * scale[:, None])
            last = pieces[-1][:, -1]
        found = np.concatenate(pieces, axis=1)[:, : inside.size]
        at = inside if outputs else np.concatenate([[times[0]], inside])
        columns = found if outputs else np.concatenate([states[0][:, None], found], axis=1)
        mapped = response.map(at.size)
        y = mapped(
            at, np.full(at.size, interval.low), np.full(at.size, interval.high),
            ca.repmat(ca.DM(executable.parameters), 1, at.size), np.full(at.size, executable.address), columns,
        )  # fmt: skip
        outputs.append(y.full().T)
        states.extend(found.T)
    return MeanResponse(times, np.array(states), np.concatenate(outputs))


def equidistant(interval: Interval, inside: NDArray[np.float64]) -> list[tuple[float, float, int]]:
    """Return begin, end and number of points of what covers an interval, each equidistant, the times among them.

    A stop need not be one of the times.
    """
    marks = np.concatenate([[interval.begin], inside])
    if not inside.size or inside[-1] < interval.end:
        marks = np.append(marks, interval.end)
    apart = np.diff(marks)
    changes = np.flatnonzero(np.abs(np.diff(apart)) > IN_STEP * apart[1:]) + 1
    edges = [0, *changes.tolist(), apart.size]
    return [(float(marks[a]), float(marks[b]), b - a) for a, b in pairwise(edges)]


Respond = Callable[[ExecutableSystem, NDArray[np.float64]], MeanResponse]
FillMeans = Callable[[ExecutableSystem, Respond], ExecutableSystem]


def with_mean_tables(
    executable: ExecutableSystem,
    respond: Respond = mean_response,
) -> ExecutableSystem:
    """Return the system with its tables of the mean response filled in, if it has any.

    ``respond`` computes the mean at given times: CVODES, or the sweep's own.
    """
    system = executable.system
    at = next((i for i, g in enumerate(executable.groups) if g.kind == "mean"), None)
    if at is None:
        return executable
    group = executable.groups[at]
    mean = respond(executable, group.knots)
    sources = system.mean_sources.values()
    columns = [(mean.outputs if kind == "output" else mean.states)[:, of] for kind, of in sources]
    filled = mean_splines(group, np.stack(columns, axis=1), system.discontinuities)
    return executable.with_numbers(groups=(*executable.groups[:at], filled, *executable.groups[at + 1 :]))


def mean_splines(group: TableGroup, values: NDArray[np.float64], discontinuities: tuple[float, ...]) -> TableGroup:
    """Return the group with values at its knots, interpolated between discontinuities, where the mean has corners."""
    knots = group.knots
    edges = [0, *(int(np.argmin(np.abs(knots - d))) for d in discontinuities), knots.size - 1]
    pieces = [
        np.moveaxis(scipy.interpolate.CubicSpline(knots[a : b + 1], values[a : b + 1]).c[::-1], 0, 1)
        for a, b in pairwise(edges)
    ]
    return replace(group, coefficients=np.concatenate(pieces))
