"""The larger side of a response: |mean| + 3 sigma, what every peak, study and design is about.

A response has two sides, mean + 3 sigma and mean - 3 sigma; the one whose magnitude is larger is the load. A mean wind
mirrored in the plane changes the name of that side and nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

LARGER_SIDE = "abs_mean_plus_3sigma"
LABEL = "|mean| + 3σ"
SIGMAS = 3.0

Numbers = TypeVar("Numbers", float, "NDArray[np.float64]", "xr.DataArray")


def larger_side(mean: Numbers, std: Numbers) -> Numbers:
    """Return |mean| + 3 std, element by element."""
    return abs(mean) + SIGMAS * std


def sign(mean: float) -> float:
    """Return 1 where mean + 3 sigma is the larger side, -1 where mean - 3 sigma is; 1 for a mean of zero."""
    return -1.0 if mean < 0 else 1.0


def side(mean: float) -> str:
    """Return the name of the larger side."""
    return "mean - 3σ" if mean < 0 else "mean + 3σ"
