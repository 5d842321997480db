"""Results as labelled datasets: names, units and provenance travel with the numbers."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import xarray as xr

from .adjoint import AdjointHistory, AdjointRun
from .integration import COUNTERS, IntegratorOptions

if TYPE_CHECKING:
    from .study import Study
    from .sweep_engine import SweepResult

COMBINED = "combined"


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
    study: Study, runs: Sequence[AdjointRun], responses: Sequence[str], options: IntegratorOptions
) -> ResponseStatistics:
    """Put adjoint runs together."""
    rows = [study.system.output_index(name) for name in responses]
    variance = np.array([run.variance[rows] for run in runs])
    mean = np.array([run.mean[rows] for run in runs])
    attributes = provenance(study) | {
        "engine": "cvodes",
        "code": study.executable.engine,
        "method": options.method,
        "iteration": options.iteration,
        "relative_tolerance": options.relative_tolerance,
    }
    dataset = statistics_dataset(study, [run.time for run in runs], responses, mean, variance, attributes)
    for name in COUNTERS:
        dataset[name] = ("time", [run.counters[name] for run in runs])
    return dataset


def statistics_dataset(
    study: Study,
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
    system = study.system
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


def weighting_dataset(study: Study, time: float, history: AdjointHistory) -> xr.Dataset:
    """Return weighting functions g(t2, t) as a dataset."""
    system = study.system
    units = "; ".join(f"{o.name}: {o.unit}" for o in system.outputs)
    return xr.Dataset(
        {
            "noise_weighting": (
                ("response", "noise", "t"),
                np.moveaxis(history.noise, 0, -1),
                {"units": f"response unit / sqrt(s) ({units})", "long_name": "weighting function of white noise"},
            ),
            "input_weighting": (
                ("response", "input", "t"),
                np.moveaxis(history.inputs, 0, -1),
                {"units": f"response unit / (input unit s) ({units})", "long_name": "weighting function of the input"},
            ),
            "direct": (
                ("response", "input"),
                history.direct,
                {"units": "response unit / input unit", "long_name": "weight of the delta at t = t2"},
            ),
        },
        {
            "t": ("t", history.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "noise": [n.name for n in system.noises],
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(study) | {"t2_s": time},
    )


def weighting_family(study: Study, found: SweepResult) -> xr.Dataset:
    """Return the weighting functions of all end times of a sweep as a dataset."""
    system, weighting = study.system, found.weighting
    assert weighting is not None
    dims = {
        "noise_weighting": ("time", "response", "noise", "t"),
        "input_weighting": ("time", "response", "input", "t"),
    }
    values = {"noise_weighting": weighting.noise, "input_weighting": weighting.inputs}
    return xr.Dataset(
        {name: (dims[name], np.moveaxis(values[name], 1, -1)) for name in dims},
        {
            "time": ("time", found.times, {"units": "s", "long_name": "flight time t2"}),
            "t": ("t", weighting.times, {"units": "s", "long_name": "time of the impulse"}),
            "response": list(system.output_names),
            "noise": list(system.noise_names),
            "source": ("noise", [n.source for n in system.noises]),
            "input": list(system.input_names),
        },
        provenance(study),
    )


def provenance(study: Study) -> dict[str, object]:
    """Return what a result was computed from: system, data hash, options, changed parameters and versions."""
    system, executable = study.system, study.executable
    nominal = np.array([p.value for p in system.parameters])
    changed = [
        f"{name} = {value:g}"
        for name, value, was in zip(system.parameter_names, executable.parameters, nominal, strict=True)
        if value != was
    ]
    attributes: dict[str, object] = {
        "system": system.name,
        "start_time_s": system.start,
        "structure": "; ".join(f"{k}: {v}" for k, v in system.structure.items()),
        "data_sha256": data_hash(study),
        "code_key": executable.shared_library.key if executable.shared_library else "interpreter",
        "changed_parameters": "; ".join(changed) or "none",
        "ascentwind": version("ascentwind"),
        "casadi": ca.CasadiMeta.version(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }
    if study.vehicle:
        attributes["title"] = study.vehicle.title
        attributes["tables"] = "; ".join(f"{s.file.name}: {s.status}" for s in study.vehicle.sources)
    return attributes


def data_hash(study: Study) -> str:
    """Return a hash of parameters and tables, the mean response excepted, which follows from the others."""
    digest = hashlib.sha256()
    for group in study.executable.groups:
        if group.name != "mean":
            digest.update(group.run_time_vector().tobytes())
    digest.update(study.executable.parameters.tobytes())
    return digest.hexdigest()[:32]
