"""The window of flight that a load is the largest of, and the chain of states over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...model.errors import TimeRangeError
from ..case.case import Case
from ..case.chain import TOLERANCE, chain_at
from ..case.times import parse_times, seconds
from ..solvers.markov_chain import MarkovChain
from ..solvers.time_nodes import time_nodes

MOST_KEPT = 4  # chains of a case: of both planes one is some 400 MB


def checked_window(case: Case, window: tuple[float, float] | None) -> tuple[float, float]:
    """Return a window of flight, s: the vehicle's default times without one, the whole flight of other systems.

    Raises
    ------
    TimeRangeError
        It does not lie on the flight, ends before it begins, or a system without an end needs one.
    """
    if window is None:
        if case.vehicle is not None:
            times = parse_times(case.vehicle.file.default_times)
            window = times[0], times[-1]
        else:
            window = case.system.start, case.system.end
    if isinstance(window, str) or np.ndim(window) != 1 or len(window) != 2:
        raise TimeRangeError(f"a window is two times in seconds, such as (40.0, 100.0), and {window!r} is not")
    begin, end = (seconds(time) for time in window)
    if not np.isfinite(end) and case.vehicle is None:
        raise TimeRangeError("the system has no end: give a window, such as window=(0.0, 100.0)")
    case.checked_times([begin, end])
    if not end > begin:
        raise TimeRangeError(f"the window ends at {end:g} s, not after its begin at {begin:g} s")
    return begin, end


def window_chain(
    case: Case, window: tuple[float, float], steps: int, relative_tolerance: float = TOLERANCE
) -> MarkovChain:
    """Return the states of a case as a chain over a window cut into equal steps; the last few are kept with the case.

    Raises
    ------
    IntegrationError, DataError
    """
    times = np.linspace(*window, steps + 1)
    kept: dict[tuple, MarkovChain] = case.kept("chains over windows", dict)
    question = window, steps, relative_tolerance
    found = kept.pop(question, None) or _chain(case, times, relative_tolerance)
    kept[question] = found
    while len(kept) > MOST_KEPT:
        kept.pop(next(iter(kept)), None)  # asked for longest ago
    return found


def _chain(case: Case, times: NDArray[np.float64], relative_tolerance: float) -> MarkovChain:
    nodes = np.unique(time_nodes(case.with_means, times))
    if nodes.size < times.size:
        raise TimeRangeError(
            f"a window of {times[-1] - times[0]:g} s at {times[0]:g} s is too short for {times.size - 1} steps; "
            "ask for a longer one"
        )
    return chain_at(case, nodes, relative_tolerance)
