"""Estimates with their errors: the probability of passing a boundary, and the boundary passed with a probability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from .crossings import Boundary
from .norms import Process
from .sampling import Draws, draw_beyond, instant_probabilities, largest_instant

CONFIDENCE = 1.96  # standard errors of a 95 % interval
ROUGH = 400  # draws that find about where a level lies
ORDER = 1.5  # of the error left by the grid: between that of a smooth path, 2, and of a rough one with bridges, 1
SOLVED = 1e-10  # relative, to which a level is solved for
SURE = 2.0  # standard errors by which the number is thought to lie farther out than paths are drawn for
LEAST_MARGIN = 0.02  # and at least so much of its size
SLOPE_STEP = 0.2  # of ln P, over which its slope is taken


def interval_of(probability: float, standard_error: float) -> tuple[float, float]:
    """Return the 95 % interval of a probability, within 0 and 1."""
    half = CONFIDENCE * standard_error
    return max(0.0, probability - half), min(1.0, probability + half)


@dataclass(frozen=True)
class Estimate:
    """A probability, with what is not known of it.

    Attributes
    ----------
    value : float
    missed : float
        Relative; what the grid of times still misses, estimated from half as many points: its size is
        ``spacing_error``.
    standard_error : float
        From the number of draws.
    spacing_error : float
        Relative; what the grid of times still misses, estimated from half as many points.
    spacing_noise : float
        Standard error of that, from the number of draws.
    largest_instant, sum_of_instants : float
        Bounds that cost nothing: the largest probability of a single point, side and output on the grid drawn, and the
        sum of all of them.
    """

    value: float
    missed: float
    standard_error: float
    spacing_error: float
    spacing_noise: float
    largest_instant: float
    sum_of_instants: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the sampling."""
        return interval_of(self.value, self.standard_error)

    @property
    def extrapolated(self) -> Estimate:
        """The same with what the grid misses added (Richardson), and half of that left open: its order is not known."""
        added = self.missed * self.value
        error = float(np.hypot((1 + self.missed) * self.standard_error, self.spacing_noise * self.value))
        return replace(
            self, value=min(self.value + added, 1.0), missed=0.0, standard_error=error,
            spacing_error=0.5 * abs(self.missed),
        )  # fmt: skip


def estimate(draws: Draws, boundary: Boundary) -> Estimate:
    """Return the probability of passing a boundary from draws beyond it, or beyond one nearer."""
    found = draws.contributions(boundary)
    missed = found - draws.coarser_contributions(boundary)
    value, root = float(found.mean()), np.sqrt(found.size)
    left = 1 / value / (2**ORDER - 1) if value > 0 else 0.0
    instants = np.exp(instant_probabilities(draws.process, boundary.at(slice(None, None, draws.process.stride))))
    return Estimate(
        min(value, 1.0),
        float(missed.mean()) * left,
        float(found.std(ddof=1) / root),
        float(abs(missed.mean()) * left),
        float(missed.std(ddof=1) / root * left),
        float(instants.max()),
        float(instants.sum()),
    )


@dataclass(frozen=True, eq=False)
class Level:
    """A number on which a boundary depends, chosen so that it is passed with a probability.

    Attributes
    ----------
    value : float
    interval : (float, float)
        95 %, of the sampling.
    boundary : Boundary
    probability : Estimate
        Of passing it.
    slope : float
        -d ln P / d value.
    draws : Draws
        Of paths beyond that boundary, or one a little nearer.
    """

    value: float
    interval: tuple[float, float]
    boundary: Boundary
    probability: Estimate
    slope: float
    draws: Draws


def find_level(
    process: Process,
    probability: float,
    boundary_of: Callable[[float], Boundary],
    size: float,
    random: np.random.Generator,
    count: int,
) -> Level:
    """Return the number whose boundary is passed with a probability.

    Parameters
    ----------
    process : Process
    probability : float
    boundary_of : callable
        Boundary on the grid seen, farther out for larger numbers.
    size : float
        Typical size of the number.
    random : Generator
    count : int
        Draws.
    """

    def instant(u: float) -> float:
        at = boundary_of(u).at(slice(None, None, process.stride))
        return largest_instant(process, at) - np.log(probability)

    low, high = -size, 2 * size
    while instant(low) < 0:
        low -= 2 * size
    while instant(high) > 0:
        high += 2 * size
    # a path passes more often than its worst instant: the number lies above the one found from that
    near = root_between(instant, low, high, SOLVED * size)
    least = LEAST_MARGIN * size
    rough = _solve(draw_beyond(process, boundary_of(near), random, ROUGH), probability, boundary_of, near, least)
    margin = max(least, SURE * rough.error / rough.slope) if rough.slope > 0 else least
    start = max(near, rough.value) - margin
    draws = draw_beyond(process, boundary_of(start), random, count)
    while (solved := _solve(draws, probability, boundary_of, start, least)).beyond:
        margin *= 2
        start -= margin
        draws = draw_beyond(process, boundary_of(start), random, count)
    value, slope = solved.value, solved.slope
    boundary = boundary_of(value)
    found = estimate(draws, boundary)
    half = CONFIDENCE * found.standard_error / probability / slope if slope > 0 else 0.0
    return Level(value, (value - half, value + half), boundary, found, slope, draws)


def root_between(function: Callable[[float], float], low: float, high: float, accuracy: float) -> float:
    """Return where a function changes its sign between two numbers."""
    found = brentq(function, low, high, xtol=accuracy, full_output=False)
    assert isinstance(found, float)
    return found


@dataclass(frozen=True)
class _Solved:
    """A number found from draws: -d ln P / d number and the relative error of P there.

    ``beyond``: it lies nearer than the boundary that was drawn for, which is returned in its place.
    """

    value: float
    slope: float
    error: float
    beyond: bool


def _solve(
    draws: Draws, probability: float, boundary_of: Callable[[float], Boundary], low: float, step: float
) -> _Solved:
    def excess(u: float) -> float:
        return float(np.log(max(draws.contributions(boundary_of(u)).mean(), 1e-300) / probability))

    first = excess(low)
    value = low
    if first > 0:
        high = low + step
        while excess(high) > 0:
            low, high = high, high + 2 * (high - low)
        value = root_between(excess, low, high, SOLVED * step)
    at_value, farther, slope = excess(value), step, 0.0
    for _ in range(2):  # over a step in which enough of the paths stop passing
        slope = (at_value - excess(value + farther)) / farther
        farther = SLOPE_STEP / slope if slope > 0 else 10 * farther
    each = draws.contributions(boundary_of(value))
    mean = float(each.mean())
    error = float(each.std(ddof=1) / np.sqrt(each.size) / mean) if mean > 0 else 1.0
    return _Solved(value, slope, error, first < -SOLVED)
