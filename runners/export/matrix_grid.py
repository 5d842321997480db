"""A system's matrices over a grid of times, with the names and units of their rows and columns."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.export.source import ExportError
from ...codegen.system.functions import MATRICES
from ...model.system.time_conditions import Stops
from ..case.case import Case
from ..case.provenance import provenance
from ..case.times import end_times
from ..present.netcdf import RULE
from ..present.progress import steps
from ..solvers.time_nodes import time_nodes

STEP = 0.05  # s
SHAPES = {  # rows and columns
    "A": ("state_rate", "state"),
    "B": ("state_rate", "noise"),
    "C": ("response", "state"),
    "D": ("response", "noise"),
    "E": ("state_rate", "input"),
    "G": ("response", "input"),
}
LONG_NAMES = {
    "A": "state matrix: x' = A x + B w + E u",
    "B": "noise matrix, of white noise w of unit intensity",
    "C": "output matrix: y = C x + D w + G u",
    "D": "noise feedthrough",
    "E": "matrix of the known inputs u in x'",
    "G": "matrix of the known inputs u in y",
}
MOST_TIMES = 100_000


def default_grid(case: Case, step: float = STEP) -> NDArray[np.float64]:
    """Return times (s) at most ``step`` apart over the whole flight.

    Raises
    ------
    ExportError
        A system without an end.
    """
    start, end = case.system.start, case.system.end
    if not np.isfinite(end):
        raise ExportError(f"system '{case.system.name}' has no end; give times")
    return np.linspace(start, end, 1 + max(1, int(np.ceil((end - start) / step - 1e-9))))


@steps("matrices")
def matrix_grid(case: Case, times: Iterable[float]) -> xr.Dataset:
    """Return A, B, C, D, E, G and the known inputs over time.

    A jump between the first and the last time is there twice: the last time before it and the first after it, a few
    roundings apart, so that nobody interpolates across it; ``jump`` holds where they are.

    Parameters
    ----------
    case : Case
    times : iterable of float
        s; one at a jump stands for both of its sides.

    Returns
    -------
    xarray.Dataset
        A (time, state_rate, state), B (time, state_rate, noise), C (time, response, state), D (time, response, noise),
        E (time, state_rate, input), G (time, response, input), u (time, input), and ``start_covariance`` (source,
        state_rate, state). An entry's unit is that of its row over that of its column; rows of A, B, E are per second.

    Raises
    ------
    TimeRangeError, ExportError
    """
    system, executable = case.system, case.with_means
    asked = case.checked_times(end_times(times))
    nodes = np.unique(time_nodes(executable, asked))
    if nodes.size > MOST_TIMES:
        raise ExportError(f"{nodes.size} times were asked for, of {MOST_TIMES} at most; take a larger step")
    kept, jumps = _with_both_sides(nodes, executable.stops(float(nodes[-1])))
    found: dict[str, list[NDArray]] = {name: [] for name in MATRICES}
    for time in kept.tolist():
        for name, matrix in executable.matrices(time, time, time).items():
            found[name].append(matrix)
    variables = {
        name: (("time", *dims), np.array(found[name]), _attributes(name, dims)) for name, dims in SHAPES.items()
    }
    covariance = [system.start_covariance_matrix(source, executable.parameters) for source in system.sources]
    n = len(system.states)
    grid = xr.Dataset(
        {
            **variables,
            "u": (
                ("time", "input"),
                np.array(found["inputs"])[:, :, 0],
                {"long_name": "known inputs, which make the mean"},
            ),
            "start_covariance": (
                ("source", "state_rate", "state"),
                np.array(covariance).reshape(len(system.sources), n, n),
                {"long_name": "covariance of the states at the start that a source brings"},
            ),
            "jump": ("jump_time", jumps, {"units": "s", "long_name": "times at which matrices jump"}),
        },
        {
            "time": ("time", kept, {"units": "s", "long_name": "flight time"}),
            "state_rate": list(system.state_names),
            "state": list(system.state_names),
            "state_unit": ("state", [s.unit for s in system.states]),
            "state_scale": ("state", [s.scale for s in system.states]),
            "noise": list(system.noise_names),
            "noise_source": ("noise", [n.source for n in system.noises]),
            "response": list(system.output_names),
            "response_unit": ("response", [o.unit for o in system.outputs]),
            "response_scale": ("response", [o.scale for o in system.outputs]),
            "input": list(system.input_names),
            "source": list(system.sources),
        },
        provenance(case) | {"start_s": system.start, "end_s": system.end},
    )
    bad = [name for name in (*SHAPES, "u") if not np.isfinite(grid[name].values).all()]
    if bad:
        where = int(np.argwhere(~np.isfinite(grid[bad[0]].values))[0][0])
        raise ExportError(f"{bad[0]} is not finite; check the tables behind it", time=float(kept[where]))
    return grid


def _with_both_sides(nodes: NDArray[np.float64], stops: Stops) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times at which matrices are evaluated, and the jumps between the first and the last of them."""
    first, last = float(nodes[0]), float(nodes[-1])
    at = (stops.times >= first) & (stops.times <= last)
    jumps, before, after = stops.times[at], stops.before[at], stops.after[at]
    kept = nodes[~((nodes[:, None] >= before) & (nodes[:, None] <= after)).any(axis=1)]
    sides = np.concatenate([before[jumps > first], after[(jumps < last) | (first == last)]])  # within the span alone
    return np.unique(np.concatenate([kept, sides])), jumps[(jumps > first) & (jumps < last)]


def _attributes(name: str, dims: tuple[str, str]) -> dict[str, str]:
    row = "state s^-1" if dims[0] == "state_rate" else "response"
    column = {"state": "state^-1", "noise": "s^0.5", "input": "input^-1"}[dims[1]]
    return {RULE: f"{row} {column}", "long_name": LONG_NAMES[name]}
