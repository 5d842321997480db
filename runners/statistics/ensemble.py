"""Simulated flights as a labelled dataset with confidence intervals."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..case.case import Case
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..solvers.ensemble import EnsembleOptions, mean_interval, run_ensemble, std_interval
from .dataset import statistics_dataset


def ensemble_dataset(case: Case, times: list[float], responses: list[str], options: EnsembleOptions) -> xr.Dataset:
    """Return the statistics of an ensemble as a dataset.

    Besides the variables of every engine: ``mean_low``, ``mean_high``, ``std_low``, ``std_high``, the confidence
    intervals; with paths kept, ``sample_path`` over (path, t, response).
    """
    rows = [case.system.output_index(name) for name in responses]
    found = run_ensemble(case.with_means, times, options)
    variance = found.variance[:, rows]
    attributes = provenance(case) | {
        "engine": "ensemble", "runs": options.runs, "seed": options.seed, "confidence": options.confidence,
        "substep_s": options.substep,
    }  # fmt: skip
    dataset = statistics_dataset(case, times, responses, found.known_mean[:, rows], variance[..., :-1], attributes)
    # sampled all together, the sources are not exactly uncorrelated, nor is the mean exactly the known one
    mean, std = found.mean[:, rows], np.sqrt(variance)
    dims = ("time", "response", "source")
    for name, values in (("mean", mean), ("variance", variance), ("std", std), ("mean_plus_3sigma", mean + 3 * std)):
        dataset[name] = (dims, values, dataset[name].attrs)
    for name, (low, high) in (
        ("mean", mean_interval(mean, std, options.runs, options.confidence)),
        ("std", std_interval(std, options.runs, options.confidence)),
    ):
        for side, values in (("low", low), ("high", high)):
            label = f"{side} end of the {options.confidence:.0%} confidence interval of {name}"
            dataset[f"{name}_{side}"] = (dims, values, dataset[name].attrs | {"long_name": label})
    if options.paths:
        label = {"long_name": "sample paths, all sources together", RULE: "response"}
        dataset["sample_path"] = (("path", "t", "response"), found.paths[:, :, rows], label)
        dataset = dataset.assign_coords(t=("t", found.path_times, {"units": "s", "long_name": "flight time"}))
    return dataset
