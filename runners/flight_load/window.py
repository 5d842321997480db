"""The window of flight that a load is the largest of, and the chain of states over it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...model.errors import TimeRangeError
from ..case.case import Case
from ..case.chain import TOLERANCE, chain_at
from ..case.times import parse_times, seconds
from ..solvers.markov_chain import MarkovChain
from ..solvers.time_nodes import time_nodes

T = TypeVar("T")

MOST_KEPT = 4  # chains of a case: of both planes one is some 400 MB
MOST_STEPS = 9600  # of a part of a window, and of several in one chain
SPREAD = 2  # parts in one chain, at most, as many times those that were asked for
PARTS = 24  # of a window: what is drawn begins and ends with one, so that responses share the states there


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
    _keep(kept, question, found)
    return found


def _keep(kept: dict[tuple, T], question: tuple, found: T) -> None:
    """Keep a chain as the one asked for last, and no more than a few."""
    kept[question] = found
    while len(kept) > MOST_KEPT:
        kept.pop(next(iter(kept)), None)  # asked for longest ago


@dataclass(frozen=True)
class PartOfWindow:
    """Some of the equal parts of a window, one after another, each cut into as many steps.

    Attributes
    ----------
    window : (float, float)
        s.
    first, last : int
        The first of the :data:`PARTS`, and the one after the last.
    steps : int
        Of each.
    """

    window: tuple[float, float]
    first: int
    last: int
    steps: int

    @property
    def span(self) -> tuple[float, float]:
        """Where it begins and ends, s."""
        begin, end = np.linspace(*self.window, PARTS + 1)[[self.first, self.last]].tolist()
        return begin, end

    def chain(self, case: Case) -> MarkovChain:
        """Return the states of a case as a chain over it, cut out of one over all that were asked for so far.

        The sweep is what a chain costs, and one serves all responses and levels.

        Raises
        ------
        IntegrationError, DataError
        """
        kept: dict[tuple, _Longest] = case.kept("chains over parts of windows", dict)
        alike = [key for key in kept if key[:2] == (self.window, self.steps)]
        key = next((key for key in alike if kept[key].holds(self)), None)
        longest = self._longest(case, kept, alike) if key is None else kept.pop(key)
        _keep(kept, (self.window, self.steps, longest.first, longest.last), longest)
        return longest.cut(self)

    def _longest(self, case: Case, kept: dict[tuple, _Longest], alike: list[tuple]) -> _Longest:
        first, last = self.first, self.last
        for key in reversed(alike):
            known = kept[key]
            begin, end = min(first, known.first), max(last, known.last)
            most = min(SPREAD * (last - first + known.last - known.first), MOST_STEPS // self.steps)
            if end - begin <= most:  # else they lie too far apart for what is between
                kept.pop(key)
                first, last = begin, end
        times = np.linspace(*self.window, PARTS * self.steps + 1)[first * self.steps : last * self.steps + 1]
        chain = _chain(case, times, TOLERANCE)
        return _Longest(first, last, chain, tuple(islice(chain.source_covariances(), 0, None, self.steps)))


@dataclass(frozen=True, eq=False)
class _Longest:
    """A chain over some of the parts of a window, and the covariances of the states at their edges."""

    first: int
    last: int
    chain: MarkovChain
    starts: tuple[NDArray[np.float64], ...]

    def holds(self, part: PartOfWindow) -> bool:
        return self.first <= part.first and part.last <= self.last

    def cut(self, part: PartOfWindow) -> MarkovChain:
        points = slice((part.first - self.first) * part.steps, (part.last - self.first) * part.steps + 1)
        return self.chain.part(points, self.starts[part.first - self.first])


def _chain(case: Case, times: NDArray[np.float64], relative_tolerance: float) -> MarkovChain:
    nodes = np.unique(time_nodes(case.with_means, times))
    if nodes.size < times.size:
        raise TimeRangeError(
            f"a window of {times[-1] - times[0]:g} s at {times[0]:g} s is too short for {times.size - 1} steps; "
            "ask for a longer one"
        )
    return chain_at(case, nodes, relative_tolerance)
