"""Pieces of flight that the compiled sweep integrates one after another, and what it returns of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Segments:
    """Consecutive pieces of flight.

    Attributes
    ----------
    start : float
        s.
    end, low, high : (k,) arrays
        Ends, increasing, and the limits of table lookup in each piece, s.
    """

    start: float
    end: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SegmentResults:
    """What the compiled sweep returns at the end of every segment.

    Attributes
    ----------
    covariance : (k, sources, responses, responses) array
    mean : (k, responses) array
    error : (k, sources, responses) array
        Estimated relative error of the standard deviation.
    transition : (k, n, n) array or None
        Transition matrix of each segment.
    added : (k, sources, n, n) array or None
        Covariance of the states at the end of each segment from the noise within it.
    counters : dict
    """

    covariance: NDArray[np.float64]
    mean: NDArray[np.float64]
    error: NDArray[np.float64]
    transition: NDArray[np.float64] | None
    added: NDArray[np.float64] | None
    counters: dict[str, int]
