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

    @property
    def begin(self) -> NDArray[np.float64]:
        """Where each begins, (k,), s."""
        return np.concatenate([[self.start], self.end[:-1]])

    def cut(self, pieces: NDArray[np.integer]) -> Segments:
        """Return every segment in as many equal pieces as asked."""
        ends = equal_parts(self, pieces)
        return Segments(self.start, ends, np.repeat(self.low, pieces), np.repeat(self.high, pieces))


@dataclass(frozen=True, eq=False)
class GridSteps:
    """Steps of consecutive segments.

    Attributes
    ----------
    counts : (k,) array of int
        In each segment, one or more.
    edges : (sum of counts + 1,) array
        s, from the start of the first segment to the end of the last.
    """

    counts: NDArray[np.intc]
    edges: NDArray[np.float64]

    @staticmethod
    def equal(segments: Segments, counts: NDArray[np.intc]) -> GridSteps:
        """Divide every segment into equal steps."""
        edges = np.concatenate([[segments.start], equal_parts(segments, counts)])
        return GridSteps(np.asarray(counts, np.intc), edges)


def equal_parts(segments: Segments, counts: NDArray[np.integer]) -> NDArray[np.float64]:
    """Return the ends of equal parts of segments, (sum of counts,), s."""
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    length = np.repeat((segments.end - segments.begin) / counts, counts)
    ends = np.repeat(segments.begin, counts) + number * length
    ends[np.cumsum(counts) - 1] = segments.end
    return ends


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
