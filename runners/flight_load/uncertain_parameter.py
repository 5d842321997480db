"""The level of flights in each of which a parameter is another constant, such as the wind's sigma.

A response is no longer Gaussian then, but it is one flight by flight: P(L) is the mean of P(L | parameter) over the
parameter's normal law, by Gauss-Hermite quadrature.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from scipy.optimize import root_scalar

from ...model.errors import ParameterValueError, UnknownNameError
from ..statistics.percentiles import Sides
from .crossings import Boundary
from .norms import Process
from .probability import SOLVED, Level
from .response import ResponseInWindow
from .sampling import Draws, draw_beyond

NODES = 9  # of the quadrature: the level of a scale with 20 % of spread is found to 1e-5
NEARER = 0.05  # of the level, within which the level of the mixture is looked for at first
MOST_NEARER = 12  # times


def processes_of(of: ResponseInWindow, parameter: str, spread: float) -> list[Process]:
    """Return the response with the parameter at each node of the quadrature.

    Raises
    ------
    UnknownNameError, ParameterValueError
    """
    known = of.case.parameters
    if parameter not in known:
        raise UnknownNameError("parameter", str(parameter), list(known))
    value = known[parameter].value
    if not value:
        raise ParameterValueError(f"'{parameter}' is 0, of which a relative spread is none")
    nodes, _ = hermegauss(NODES)
    return [of.with_parameters({parameter: value * (1 + spread * x)}).process() for x in nodes]


def uncertain_level(
    processes: Sequence[Process],
    level: Level,
    probability: float,
    sides: Sides,
    random: np.random.Generator,
    count: int,
) -> tuple[float, float]:
    """Return a level and its standard error; see :meth:`FlightLoad.level_with_uncertain`."""
    _, weights = hermegauss(NODES)
    weights = weights / weights.sum()

    def boundary(u: float) -> Boundary:
        return Boundary.constant(u, processes[0].seen, sides)

    def drawn(start: float) -> list[Draws]:
        return [draw_beyond(process, boundary(start), random, count) for process in processes]

    def chance(draws: list[Draws], u: float) -> float:
        at = boundary(u)
        return float(weights @ [each.contributions(at).mean() for each in draws])

    step = NEARER * abs(level.value)
    start = level.value - step
    draws = drawn(start)
    for _ in range(MOST_NEARER):
        if chance(draws, start) >= probability:
            break
        start -= step
        draws = drawn(start)
    high = level.value
    while chance(draws, high) > probability:
        high += step

    def excess(u: float) -> float:
        return math.log(max(chance(draws, u), 1e-300) / probability)

    found = float(root_scalar(excess, bracket=(start, high), method="brentq", xtol=SOLVED * step).root)
    at = boundary(found)
    each = [draw.contributions(at) for draw in draws]
    error = math.sqrt(sum(w**2 * values.var(ddof=1) / values.size for w, values in zip(weights, each, strict=True)))
    slope = (excess(found) - excess(found + 0.2 * step)) / (0.2 * step)
    return found, error / probability / slope if slope > 0 else 0.0


def checked_spread(spread: float) -> float:
    """Return a relative standard deviation with which a parameter keeps its sign.

    Raises
    ------
    ParameterValueError
    """
    if isinstance(spread, bool) or not isinstance(spread, int | float) or not math.isfinite(spread) or spread <= 0:
        raise ParameterValueError(f"a spread of {spread!r:.40} is none; give a relative one, such as 0.08")
    largest = 1 / float(hermegauss(NODES)[0][-1])
    if spread >= largest:
        raise ParameterValueError(f"a spread of {spread:g} would change the sign; give less than {largest:.2g}")
    return float(spread)
