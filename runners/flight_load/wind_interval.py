"""How well a flight's level is known from so many soundings of the wind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.errors import UnknownNameError
from ...model.system.names import WIND
from ..statistics.percentiles import level_sampling_interval
from .norms import Process
from .pathwise import Reaching
from .probability import Level
from .response import ResponseInWindow


def wind_interval_of(
    of: ResponseInWindow, level: Level, paths: Callable[[], Reaching], samples: float, confidence: float
) -> tuple[float, float]:
    """Return the interval of a level by N independent soundings; see :meth:`FlightLoad.wind_interval`.

    Parameters
    ----------
    of : ResponseInWindow
        Where the level is passed.
    level : Level
    paths : callable
        Of paths that just reach it, whose directions are asked for of a resultant.
    samples, confidence : float

    Raises
    ------
    ParameterValueError, UnknownNameError
    """
    sources = list(of.case.system.sources)
    if WIND not in sources:
        raise UnknownNameError("noise source", WIND, sources)
    wind, rest = [sources.index(WIND)], [k for k, name in enumerate(sources) if name != WIND]
    if of.is_resultant:
        found = paths()
        here = float(found.share @ found.mean)
        e, at = found.direction, found.nearest

        def variance(numbers: list[int]) -> float:
            covariance = _instants(of, numbers)
            return float(found.share @ np.einsum("kr,krs,ks->k", e, covariance[at], e))
    else:
        process = level.draws.process
        share = level.draws.places(level.boundary)[:, 0]  # (m, sides)
        share = share / share.sum()
        here = float((share[:, 0] - share[:, 1]) @ process.seen.mean[:, 0])  # on the side of the level

        def variance(numbers: list[int]) -> float:
            return float(share.sum(axis=1) @ _variance_seen(of.process(numbers)))

    by_wind, by_rest = variance(wind), variance(rest) if rest else 0.0
    sigmas = (level.value - here) / np.sqrt(by_wind + by_rest)
    return level_sampling_interval(here, np.sqrt(by_wind), np.sqrt(by_rest), sigmas, samples, confidence)


def _instants(of: ResponseInWindow, sources: list[int]) -> NDArray[np.float64]:
    """Return the covariance of both planes at each point drawn, (m, 2, 2)."""
    covariance, _ = of.share_of(sources)
    m = np.arange(len(covariance))
    return covariance[m, :, m]


def _variance_seen(process: Process) -> NDArray[np.float64]:
    """Return the variance at the points seen."""
    return np.interp(process.seen.times, process.drawn.times, process.std[:, 0] ** 2)
