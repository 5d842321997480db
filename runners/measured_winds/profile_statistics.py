"""What a number of flown profiles says by itself: percentiles with intervals, and the worst of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri

from ...model.errors import UnknownNameError
from ...model.wind.soundings.collection import independent_samples
from ..present.netcdf import RULE
from .profiles import CompleteProfiles

CONFIDENCE = 0.95


def independent_profiles(values: NDArray[np.float64], day: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the number of independent profiles behind histories (n, time, response) of days (n,), (time, response)."""
    n, m, r = values.shape
    flat = values.reshape(n, m * r)
    return np.array([independent_samples(flat[:, [j]], day) for j in range(m * r)]).reshape(m, r)


def profile_percentiles(
    histories: NDArray[np.float64], independent: NDArray[np.float64], probabilities: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return percentiles of histories and their 95 % intervals by order statistics.

    Parameters
    ----------
    histories : (n, time, response) array
    independent : (time, response) array
        Of as many independent profiles the intervals are.
    probabilities : (p,) array

    Returns
    -------
    percentiles : (p, time, response) array
    interval : (2, p, time, response) array
    """
    p = probabilities[:, None, None]
    measured = np.quantile(histories, probabilities, axis=0)
    half = ndtri(0.5 + CONFIDENCE / 2) * np.sqrt(p * (1 - p)) / np.sqrt(independent)
    ordered = np.sort(histories, axis=0)
    n = len(ordered)
    ends = []
    for side in (-1, 1):
        rank = np.clip((p + side * half) * n - 0.5, 0, n - 1)
        low = np.floor(rank).astype(int)
        a, b = (np.take_along_axis(ordered, np.minimum(low + k, n - 1), axis=0) for k in (0, 1))
        ends.append(a + (rank - low) * (b - a))
    return measured, np.array(ends)


def percentile_dataset(
    histories: NDArray[np.float64],
    independent: NDArray[np.float64],
    predicted: NDArray[np.float64],
    probabilities: NDArray[np.float64],
    coordinates: Mapping[str, object],
) -> xr.Dataset:
    """Return percentiles of histories beside predicted ones.

    Parameters
    ----------
    histories, independent, probabilities
        As for :func:`profile_percentiles`.
    predicted : (p, time, response) array
    coordinates : mapping
        Of time and response.

    Returns
    -------
    xarray.Dataset
        Over (probability, time, response): ``measured``, ``interval`` (bound) and ``predicted``.
    """
    measured, interval = profile_percentiles(histories, independent, probabilities)
    dims = ("probability", "time", "response")
    parts = {
        "measured": (dims, measured, "percentile of the measured profiles"),
        "interval": (("bound", *dims), interval, "95 % interval of it"),
        "predicted": (dims, predicted, "percentile in a Gaussian wind"),
    }
    return xr.Dataset(
        {name: (over, values, {RULE: "response", "long_name": text}) for name, (over, values, text) in parts.items()},
        {"probability": probabilities, "bound": ["lower", "upper"]} | dict(coordinates),
    )


def number_of(response: str, known: Sequence[str]) -> int:
    """Return which of those flown a response is.

    Raises
    ------
    UnknownNameError
    """
    if response not in known:
        raise UnknownNameError("response", response, known)
    return known.index(response)


def worst_profiles(
    values: NDArray[np.float64], profiles: CompleteProfiles, times: NDArray[np.float64], count: int
) -> list[tuple[str, str, float, float]]:
    """Return the profiles with the largest size of a response (n, time): name, date, value, time (s)."""
    size, found = np.abs(values), []
    for i in np.argsort(-size.max(axis=1))[:count]:
        k, date = int(size[i].argmax()), profiles.time[i]
        told = "" if np.isnat(date) else str(date)
        found.append((profiles.names[i], told, float(values[i, k]), float(times[k])))
    return found
