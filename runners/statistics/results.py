"""Results as labelled datasets: names, units and provenance travel with the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from ...model.system.linear_system import COMBINED
from ..case.provenance import provenance
from ..solvers.adjoint import AdjointRun
from ..solvers.integration import COUNTERS, IntegratorOptions

if TYPE_CHECKING:
    from ..case.case import Case


class ResponseStatistics(xr.Dataset):
    """Mean, variance, std and mean_plus_3sigma over (time, response, source).

    An xarray Dataset whose variables are attributes, ``mean`` and ``std`` included; to average over a dimension
    with xarray's own methods of these names, use ``xarray.Dataset(stats).mean(...)``.
    """

    __slots__ = ()

    @property
    def mean(self) -> xr.DataArray:  # type: ignore[override]
        return self["mean"]

    @property
    def std(self) -> xr.DataArray:  # type: ignore[override]
        return self["std"]


def response_dataset(
    case: Case, runs: Sequence[AdjointRun], responses: Sequence[str], options: IntegratorOptions
) -> ResponseStatistics:
    """Put adjoint runs together."""
    rows = [case.system.output_index(name) for name in responses]
    variance = np.array([run.variance[rows] for run in runs])
    mean = np.array([run.mean[rows] for run in runs])
    attributes = provenance(case) | {
        "engine": "cvodes",
        "code": case.executable.engine,
        "method": options.method,
        "iteration": options.iteration,
        "relative_tolerance": options.relative_tolerance,
    }
    dataset = statistics_dataset(case, [run.time for run in runs], responses, mean, variance, attributes)
    for name in COUNTERS:
        dataset[name] = ("time", [run.counters[name] for run in runs])
    return dataset


def statistics_dataset(
    case: Case,
    times: Sequence[float],
    responses: Sequence[str],
    mean: np.ndarray,
    variance: np.ndarray,
    attributes: dict[str, object],
) -> ResponseStatistics:
    """Return the dataset of statistics.

    Parameters
    ----------
    mean : (k, responses) or (members, k, responses) array
    variance : (k, responses, sources) or (members, k, responses, sources) array
        The combined variance is added here.
    """
    system = case.system
    variance = np.concatenate([variance, variance.sum(axis=-1, keepdims=True)], axis=-1)
    std = np.sqrt(variance)
    mean = np.broadcast_to(mean[..., None], variance.shape).copy()
    units = [system.outputs[system.output_index(name)].unit for name in responses]
    dims = ("member", "time", "response", "source")[-variance.ndim :]
    dataset = ResponseStatistics(
        {
            "mean": (dims, mean),
            "variance": (dims, variance),
            "std": (dims, std),
            "mean_plus_3sigma": (dims, mean + 3 * std),
        },
        {
            "time": ("time", np.asarray(times, float), {"units": "s", "long_name": "flight time t2"}),
            "response": list(responses),
            "source": [*system.sources, COMBINED],
            "unit": ("response", units),
        },
        attributes,
    )
    by_response = "; ".join(f"{name}: {unit}" for name, unit in zip(responses, units, strict=True))
    squared = "; ".join(f"{name}: ({unit})^2" for name, unit in zip(responses, units, strict=True))
    for name, label in (
        ("mean", "mean response to the mean wind"),
        ("variance", "variance about the mean"),
        ("std", "standard deviation"),
        ("mean_plus_3sigma", "mean plus three standard deviations"),
    ):
        dataset[name].attrs |= {"units": squared if name == "variance" else by_response, "long_name": label}
    return dataset
