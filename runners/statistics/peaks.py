"""Peaks of |mean| + 3 sigma over the end times, and what drives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...model.system.names import COMBINED
from .larger_side import larger_side, side


@dataclass(frozen=True)
class Peak:
    """The largest |mean| + 3 sigma of a response.

    Attributes
    ----------
    value : float
        |mean| + 3 sigma at ``time``, SI.
    mean, std : float
        There, SI; the mean with its sign.
    shares : dict of source to float
        Part of the variance; they add up to one.
    at_end : bool
        Whether the peak lies on the first or last end time, so that the true one may lie beyond.
    """

    response: str
    unit: str
    time: float
    value: float
    mean: float
    std: float
    shares: dict[str, float]
    at_end: bool

    @property
    def side(self) -> str:
        """Name of the side on which the peak lies."""
        return side(self.mean)


def peaks(statistics: xr.Dataset) -> list[Peak]:
    """Return the peak of every response."""
    found = []
    times, sources = statistics["time"].values, [str(s) for s in statistics["source"].values]
    for r, response in enumerate(statistics["response"].values):
        total = larger_side(*(statistics[name].sel(source=COMBINED).values[:, r] for name in ("mean", "std")))
        k = int(np.argmax(total))
        at = statistics.isel(time=k, response=r)
        variance = dict(zip(sources, at["variance"].values.tolist(), strict=True))
        combined = variance.pop(COMBINED)
        found.append(
            Peak(
                str(response),
                str(statistics["unit"].values[r]),
                float(times[k]),
                float(total[k]),
                float(at["mean"].sel(source=COMBINED)),
                float(np.sqrt(combined)),
                {s: v / combined if combined > 0 else 0.0 for s, v in variance.items()},
                len(times) > 1 and k in (0, len(times) - 1),
            )
        )
    return found
