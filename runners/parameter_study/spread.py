"""The spread of a dispersion: sampled, with confidence intervals, and predicted to first order."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from ...model.errors import DataError
from .first_order import gradients, quantity_moments
from .measures import measures
from .run import ParameterStudy

PERCENT = (1.0, 5.0, 50.0, 95.0, 99.0)
CONFIDENCE = 0.95


def spread(result: ParameterStudy) -> xr.Dataset:
    """Return the spread of a dispersion's measures.

    Intervals are those of independent members; Latin hypercube and Sobol members are spread more evenly, so that the
    intervals are wider than need be.

    Returns
    -------
    xarray.Dataset
        Over (measure, response): ``nominal``; ``sample_mean`` and ``sample_std`` with ``_low`` and ``_high`` of the
        95 % interval; ``percentile`` (percent, ...) with its own, NaN where there are too few members to bound it;
        ``first_order_mean``, ``first_order_std`` and ``ratio`` (sampled by predicted std); ``share`` (measure,
        response, quantity) of the predicted variance; ``derivative``, the same dimensions.

    Raises
    ------
    DataError
        Of a study that is no dispersion, or has fewer than two members with numbers.
    """
    if result.plan.dispersion is None:
        raise DataError(f"a study of kind '{result.plan.kind}' has no spread; its members are chosen, not random")
    measured = measures(result)
    samples = measured["sample"].values
    n = samples.shape[-1]
    if n < 2:
        raise DataError(f"{n} of the members have numbers, too few for a spread; see their reasons")
    derivative = gradients(result, measured)
    centre, covariance = quantity_moments(result)
    shift = centre - np.array([q.nominal for q in result.quantities])
    share = derivative * (derivative @ covariance)
    predicted = np.sqrt(share.sum(axis=-1))
    dims = ("measure", "response")
    found = {
        "first_order_mean": measured["nominal"].values + derivative @ shift,
        "first_order_std": predicted,
        **_moments(samples),
    }
    found["ratio"] = _divided(found["sample_std"], predicted)
    value, low, high = percentiles(samples)
    return xr.Dataset(
        {
            "nominal": measured["nominal"],
            **{name: (dims, array) for name, array in found.items()},
            **{
                f"percentile{end}": (("percent", *dims), array)
                for end, array in (("", value), ("_low", low), ("_high", high))
            },
            "derivative": ((*dims, "quantity"), derivative),
            "share": ((*dims, "quantity"), _divided(share, predicted[..., None] ** 2)),
            "peak_time": measured["peak_time"],
        },
        {"percent": list(PERCENT), "quantity": result.data["quantity"].values},
        {"members": n, "confidence": CONFIDENCE},
    )


def _divided(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.divide(a, b, out=np.full(np.broadcast(a, b).shape, np.nan), where=b > 0)


def _moments(samples: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return mean and std over the last axis with intervals; that of the std by the fourth moment."""
    n = samples.shape[-1]
    z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2))
    size = np.maximum(np.abs(samples).max(axis=-1), np.finfo(float).tiny)  # squares of an unstable member overflow
    mean, std = samples.mean(axis=-1), size * (samples / size[..., None]).std(axis=-1, ddof=1)
    error = std / np.sqrt(n)
    scaled = np.divide(samples - mean[..., None], std[..., None], out=np.zeros_like(samples), where=std[..., None] > 0)
    fourth = (scaled**4).mean(axis=-1)
    std_error = 0.5 * std * np.sqrt(np.maximum(fourth - (n - 3) / (n - 1), 0.0) / n)
    return {
        "sample_mean": mean,
        "sample_mean_low": mean - z * error,
        "sample_mean_high": mean + z * error,
        "sample_std": std,
        "sample_std_low": np.maximum(std - z * std_error, 0.0),
        "sample_std_high": std + z * std_error,
    }


def percentiles(samples: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return percentiles over the last axis and both ends of their intervals, from ranks, for any distribution."""
    n = samples.shape[-1]
    ordered = np.sort(samples, axis=-1)
    low, high = [], []
    for percent in PERCENT:
        first = int(stats.binom.ppf(0.5 - CONFIDENCE / 2, n, percent / 100))  # rank, counted from 1
        last = int(stats.binom.ppf(0.5 + CONFIDENCE / 2, n, percent / 100)) + 1
        nothing = np.full(samples.shape[:-1], np.nan)
        low.append(ordered[..., first - 1] if first >= 1 else nothing)
        high.append(ordered[..., last - 1] if last <= n else nothing)
    return np.percentile(samples, PERCENT, axis=-1), np.array(low), np.array(high)
