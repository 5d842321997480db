"""Levels that responses pass with a probability at one instant, over the end times."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr

from ...model.errors import UnknownNameError
from ..present.netcdf import RULE
from .percentiles import Sides, checked_probabilities, checked_sides, instant_level

LEVEL = "level"


def level_over_time(statistics: xr.Dataset, probability: float, sides: Sides, source: str) -> xr.DataArray:
    """See :meth:`ResponseStatistics.percentile`."""
    (asked,), chosen = checked_probabilities(probability), checked_sides(sides)
    known = [str(name) for name in np.atleast_1d(statistics["source"].values)]
    if source not in known:
        raise UnknownNameError("noise source", str(source), known)
    at = statistics.sel(source=source) if "source" in statistics.dims else statistics
    mean = at["mean"]
    side = np.where(mean.values < 0, "lower", "upper") if chosen == "both" else np.full(mean.shape, chosen)
    attributes = {RULE: "response", "long_name": f"level passed with probability {asked:g} at one instant"}
    found = xr.DataArray(
        instant_level(mean.values, at["std"].values, asked, chosen),
        mean.coords,
        mean.dims,
        LEVEL,
        attributes | {"probability": asked, "sides": chosen},
    )
    return found.assign_coords(side=(mean.dims, side))


def with_levels(statistics: xr.Dataset, probabilities: Iterable[float]) -> xr.Dataset:
    """Return statistics with ``level``, over ``probability`` besides: what the response's size passes with each."""
    asked = checked_probabilities(probabilities)
    mean, std = statistics["mean"], statistics["std"].values
    values = np.stack([instant_level(mean.values, std, p) for p in asked], axis=-1)
    attributes = {RULE: "response", "long_name": "level that the response's size passes at one instant"}
    return statistics.assign_coords(probability=("probability", np.array(asked), {"units": "1"})).assign(
        {LEVEL: ((*mean.dims, "probability"), values, attributes)}
    )
