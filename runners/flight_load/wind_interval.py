"""How well a flight's level is known from so many soundings of the wind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...model.errors import UnknownNameError
from ...model.system.names import WIND
from ..statistics.percentiles import level_sampling_interval
from .probability import Level
from .process import OneOutput
from .response import ResponseInWindow


def wind_intervals(
    of: ResponseInWindow, process: OneOutput, levels: Sequence[Level], samples: float, confidence: float
) -> list[tuple[float, float]]:
    """Return the interval of each level by N independent soundings; see :meth:`FlightLoad.wind_interval`.

    Raises
    ------
    ParameterValueError, UnknownNameError
    """
    sources = list(of.case.system.sources)
    if WIND not in sources:
        raise UnknownNameError("noise source", WIND, sources)
    by_wind = _variance_seen(of.process([sources.index(WIND)]))
    others = [k for k, name in enumerate(sources) if name != WIND]
    by_others = _variance_seen(of.process(others)) if others else np.zeros_like(by_wind)
    mean, intervals = process.seen.mean[:, 0], []
    for level in levels:
        share = level.draws.places(level.boundary)[:, 0]  # (m, sides)
        share = share / share.sum()
        here = float((share[:, 0] - share[:, 1]) @ mean)  # on the side of the level
        wind, other = (float(np.sqrt(share.sum(axis=1) @ variance)) for variance in (by_wind, by_others))
        sigmas = (level.value - here) / np.hypot(wind, other)
        intervals.append(level_sampling_interval(here, wind, other, sigmas, samples, confidence))
    return intervals


def _variance_seen(process: OneOutput) -> np.ndarray:
    """Return the variance at the points seen."""
    return np.interp(process.seen.times, process.drawn.times, process.std[:, 0] ** 2)
