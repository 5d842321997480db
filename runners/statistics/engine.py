"""What an engine is: a road to the statistics, as an object that is its own options."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
import xarray as xr

from ..case.case import Case

LOOKS = 1024  # pieces of flight in which a check begins anew
LEAST_WHEN_BEGUN = 1e-12  # tolerance of a check
Progress = Callable[[float], None]


@runtime_checkable
class Engine(Protocol):
    """A way to compute response statistics; made without arguments it has its defaults.

    Attributes
    ----------
    name : str
        By which it may be asked for.
    label : str
        For tables that people read.
    """

    name: ClassVar[str]
    label: ClassVar[str]

    def compute(
        self, case: Case, times: list[float], responses: list[str], progress: Progress | None = None
    ) -> xr.Dataset:
        """Return the statistics of responses at end times.

        Parameters
        ----------
        case : Case
        times : list of float
            End times, increasing, s.
        responses : list of str
        progress : callable, optional
            Called with each end time (s) when it is done.

        Returns
        -------
        xarray.Dataset
            As :attr:`ascentwind.ResponseStatistics.dataset`.

        Raises
        ------
        IntegrationError, DirectNoiseError
        NoCompilerError, CompilerError
            By engines that exist as compiled code only.
        """
        ...

    def finer(self, flight: float) -> Engine:
        """Return the engine with a finer discretisation of a flight, by which the error of this one is judged.

        Parameters
        ----------
        flight : float
            Its length, s.

        Returns
        -------
        Engine
        """
        ...

    @classmethod
    def tight(cls) -> Engine | None:
        """Return the engine as it is held against others; None where it has a sampling error."""
        ...


def piece_of(flight: float, longest: float) -> float:
    """Return the length (s) of the pieces in which a check looks at a flight, no longer than ``longest``."""
    return min(longest, flight / LOOKS) if flight > 0 else longest


def begun_anew(
    relative_tolerance: float, absolute_part: float, longest_interval: float, flight: float
) -> dict[str, float]:
    """Return the three for a check in short pieces; beginning anew in each has an error of its own, kept below theirs.

    Absolutely the tolerance is far less, or both passes would miss the same where sizes are misjudged.
    """
    return {
        "relative_tolerance": max(LEAST_WHEN_BEGUN, 1e-3 * relative_tolerance),
        "absolute_part": 1e-6 * absolute_part,
        "longest_interval": piece_of(flight, longest_interval),
    }


def relative_difference(value: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return |value - reference| / |reference|, zero where both are."""
    size = np.abs(reference)
    difference = np.abs(value - reference)
    return np.where(difference == 0, 0.0, difference / np.where(size > 0, size, np.finfo(float).tiny))
