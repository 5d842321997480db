"""Statistics as labelled arrays: names, units and provenance travel with the numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from ...model.system.names import COMBINED
from ..case.provenance import provenance
from ..present.netcdf import RULE, unit_factors, written_unit

if TYPE_CHECKING:
    from ..case.case import Case

QUANTITIES = {
    "mean": "mean response to the mean wind",
    "variance": "variance about the mean",
    "std": "standard deviation",
    "mean_plus_3sigma": "mean plus three standard deviations",
}


def statistics_dataset(
    case: Case,
    times: Sequence[float],
    responses: Sequence[str],
    mean: np.ndarray,
    variance: np.ndarray,
    attributes: Mapping[str, object],
) -> xr.Dataset:
    """Return the dataset of statistics.

    Parameters
    ----------
    mean : (k, responses) or (members, k, responses) array
    variance : (k, responses, sources) or (members, k, responses, sources) array
        The combined variance is added here.
    attributes : mapping
        What the engine says of itself; :func:`provenance` is added.
    """
    system = case.system
    variance = np.concatenate([variance, variance.sum(axis=-1, keepdims=True)], axis=-1)
    std = np.sqrt(variance)
    mean = np.broadcast_to(mean[..., None], variance.shape).copy()
    units = [system.outputs[system.output_index(name)].unit for name in responses]
    dims = ("member", "time", "response", "source")[-variance.ndim :]
    dataset = xr.Dataset(
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
        {**provenance(case), **attributes},
    )
    for name, meaning in QUANTITIES.items():
        dataset[name].attrs |= {RULE: "response^2" if name == "variance" else "response", "long_name": meaning}
    return dataset


def with_covariance(dataset: xr.Dataset, covariance: np.ndarray, rows: list[int]) -> xr.Dataset:
    """Add the covariances between responses, of all outputs (k, sources, outputs, outputs) those in ``rows``."""
    covariance = covariance[:, :, rows][:, :, :, rows]
    covariance = np.concatenate([covariance, covariance.sum(axis=1, keepdims=True)], axis=1)
    dataset["covariance"] = (
        ("time", "source", "response", "other_response"),
        covariance,
        {RULE: "response other_response", "long_name": "covariance between responses"},
    )
    return dataset.assign_coords(other_response=dataset["response"].values)


def with_members(dataset: xr.Dataset, case: Case, parameter_sets: Sequence[Mapping[str, float]]) -> xr.Dataset:
    """Return the dataset of a batch with its parameter values as coordinates over ``member``.

    Every parameter that a set names is a coordinate of that name, with the case's own value where a set leaves it; one
    whose name the dataset has already is ``parameter_NAME``.
    """
    names = dict.fromkeys(name for changes in parameter_sets for name in changes)
    coordinates: dict[str, tuple] = {
        "member": ("member", np.arange(len(parameter_sets)), {"long_name": "set of values"})
    }
    for name in names:
        parameter = case.parameters[name]
        values = [float(changes.get(name, parameter.value)) for changes in parameter_sets]
        attributes = {"units": written_unit(unit_factors(parameter.unit)), "long_name": parameter.description or name}
        free = name if name not in dataset.variables and name not in dataset.dims else f"parameter_{name}"
        coordinates[free] = ("member", values, attributes)
    return dataset.assign_coords(coordinates)


def batch_dataset(
    case: Case,
    times: list[float],
    members: list[tuple[np.ndarray, np.ndarray]],
    engine: str,
    relative_tolerance: float,
) -> xr.Dataset:
    """Return the dataset of a batch: statistics of all responses with a dimension ``member`` in front.

    ``members`` are means (k, responses) and variances (k, responses, sources).
    """
    attributes = {"engine": engine, "relative_tolerance": relative_tolerance}
    mean, variance = (np.array(values) for values in zip(*members, strict=True))
    return statistics_dataset(case, times, list(case.system.output_names), mean, variance, attributes)
