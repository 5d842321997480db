"""The engines: roads to the same statistics, by name."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...codegen.sweep.compiled import sweep_of
from ...model.errors import AscentwindWarning, IntegrationError, UnknownNameError
from ...model.system.linear_system import COMBINED
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..solvers.adjoint import AdjointSolver
from ..solvers.covariance import CovarianceOptions, covariance_equation
from ..solvers.ensemble import EnsembleOptions
from ..solvers.integration import IntegratorOptions
from ..solvers.sweep import LEAST_TOLERANCE, SweepOptions, SweepResult, available_sweep, sweep
from ..solvers.time_nodes import time_nodes
from .dataset import response_dataset, statistics_dataset
from .ensemble import ensemble_dataset
from .results import ResponseStatistics

if TYPE_CHECKING:
    from ..case.case import Case

LOOKS = 1024  # pieces of flight in which a check begins anew
Progress = Callable[[float], None]


class UncheckedStatisticsWarning(AscentwindWarning):
    """A finer discretisation, asked for as a check, could not be computed; the difference to it is infinite."""


@dataclass(frozen=True)
class Engine:
    """A way to compute response statistics.

    Attributes
    ----------
    label : str
        For tables that people read.
    options : type
        Of its options; made without arguments they are the default.
    compute : callable
        (study, increasing end times, responses, options, progress) -> xarray.Dataset of the statistics.
    finer : callable
        (options, flight in s) -> options of a finer discretisation, by which the error of the given ones is judged.
    tight : object or None
        Options with which engines are held against each other; None for an engine with a sampling error.
    """

    label: str
    options: type
    compute: Callable[[Case, list[float], list[str], Any, Progress | None], xr.Dataset]
    finer: Callable[[Any, float], Any]
    tight: object | None


def find_engine(name: str) -> Engine:
    """Return an engine by name.

    Raises
    ------
    UnknownNameError
    """
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    return ENGINES[name]


def engine_options(name: str | None, *, compiled: bool = True, **settings: object) -> tuple[str | None, object | None]:
    """Return an engine and its options from what a person named; None leaves the choice to the study.

    ``method`` alone means CVODES, and ``relative_tolerance`` alone the sweep, or CVODES where nothing is compiled.

    Raises
    ------
    UnknownNameError, IntegrationError
    """
    given = {key: value for key, value in settings.items() if value is not None}
    if name is None and given:
        name = "cvodes" if "method" in given or not compiled else "sweep"
    if name is None:
        return None, None
    takes = {field.name for field in fields(find_engine(name).options)}
    for key in given:
        if key not in takes:
            raise IntegrationError(f"engine '{name}' takes no {key.replace('_', ' ')}; it takes {', '.join(takes)}")
    return name, find_engine(name).options(**given)


def default_engine(case: Case, options: object | None) -> str:
    """Return the engine that options belong to; without any the sweep, or CVODES where that cannot be compiled."""
    if options is not None:
        return next((name for name, e in ENGINES.items() if isinstance(options, e.options)), "sweep")
    return "cvodes" if available_sweep(case.executable) is None else "sweep"


def compute_statistics(
    case: Case,
    times: list[float],
    responses: list[str],
    engine: str | None,
    options: object | None,
    check: bool,
    progress: Progress | None,
) -> ResponseStatistics:
    """Run an engine; with ``check`` a second time, finer, and keep the relative difference of the std.

    Raises
    ------
    UnknownNameError, IntegrationError

    Warns
    -----
    UncheckedStatisticsWarning
    """
    if engine is None:
        engine = default_engine(case, options)
    chosen = find_engine(engine)
    settings = chosen.options() if options is None else options
    if not isinstance(settings, chosen.options):
        raise IntegrationError(
            f"engine '{engine}' takes {chosen.options.__name__}, not {type(settings).__name__}; see ascentwind.runners"
        )
    found = chosen.compute(case, times, responses, settings, progress)
    if check:
        difference = np.full(found["std"].shape, np.inf)
        try:
            finer = chosen.compute(case, times, responses, chosen.finer(settings, times[-1] - case.system.start), None)
            difference = relative_difference(found["std"].values, finer["std"].values)
        except IntegrationError as error:
            text = f"the statistics could not be checked by a finer discretisation, and none is known to hold: {error}"
            warnings.warn(UncheckedStatisticsWarning(text), stacklevel=4)
        found["discretisation_difference"] = (
            found["std"].dims,
            difference,
            {"units": "1", "long_name": "std against a finer discretisation, relative"},
        )
    return ResponseStatistics(found)


def relative_difference(value: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return |value - reference| / |reference|, zero where both are."""
    size = np.abs(reference)
    difference = np.abs(value - reference)
    return np.where(difference == 0, 0.0, difference / np.where(size > 0, size, np.finfo(float).tiny))


def _cvodes(
    case: Case, times: list[float], responses: list[str], options: IntegratorOptions, progress: Progress | None
) -> xr.Dataset:
    solver = AdjointSolver(case.with_means, options)
    runs = []
    for time, node in zip(times, time_nodes(case.executable, times).tolist(), strict=True):
        runs.append(replace(solver.run(node), time=time))
        if progress:
            progress(time)
    return response_dataset(case, runs, responses, options)


def _sweep(
    case: Case, times: list[float], responses: list[str], options: SweepOptions, progress: Progress | None
) -> xr.Dataset:
    engine = sweep_of(case.executable)
    found = sweep(
        engine,
        case.with_means,
        times,
        relative_tolerance=options.relative_tolerance,
        longest_interval=options.longest_interval,
        responses=responses,
    )
    if progress:
        for time in times:
            progress(time)
    return sweep_dataset(case, found, responses, options)


def sweep_dataset(case: Case, found: SweepResult, responses: list[str], options: SweepOptions) -> xr.Dataset:
    """Return the dataset of a sweep: statistics, covariances between responses, and the error estimate."""
    rows = [case.system.output_index(name) for name in responses]
    attributes = provenance(case) | {
        "engine": "sweep",
        "relative_tolerance": options.relative_tolerance,
        **{f"sweep_{name}": value for name, value in found.counters.items()},
    }
    variance = found.variance[:, rows]
    dataset = statistics_dataset(case, found.times.tolist(), responses, found.mean[:, rows], variance, attributes)
    dataset = _with_covariance(dataset, found.covariance, rows)
    error = np.moveaxis(found.error_estimate[:, :, rows], 1, 2)
    total = dataset["variance"].sel(source=COMBINED).values
    shared = (variance * error).sum(axis=2) / np.where(total > 0, total, 1.0)
    dataset["error_estimate"] = (
        ("time", "response", "source"),
        np.concatenate([error, shared[:, :, None]], axis=2),
        {"units": "1", "long_name": "estimated relative error of the std"},
    )
    return dataset


def _with_covariance(dataset: xr.Dataset, covariance: np.ndarray, rows: list[int]) -> xr.Dataset:
    """Add the covariances between responses, of all outputs (k, sources, outputs, outputs) those in ``rows``."""
    covariance = covariance[:, :, rows][:, :, :, rows]
    covariance = np.concatenate([covariance, covariance.sum(axis=1, keepdims=True)], axis=1)
    dataset["covariance"] = (
        ("time", "source", "response", "other_response"),
        covariance,
        {RULE: "response other_response", "long_name": "covariance between responses"},
    )
    return dataset.assign_coords(other_response=dataset["response"].values)


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
    attributes = provenance(case) | {"engine": engine, "relative_tolerance": relative_tolerance}
    mean, variance = (np.array(values) for values in zip(*members, strict=True))
    return statistics_dataset(case, times, list(case.system.output_names), mean, variance, attributes)


def _covariance(
    case: Case, times: list[float], responses: list[str], options: CovarianceOptions, progress: Progress | None
) -> xr.Dataset:
    rows = [case.system.output_index(name) for name in responses]
    found = covariance_equation(
        case.with_means, times, options.relative_tolerance, progress, options.longest_interval, options.absolute_part
    )
    attributes = provenance(case) | {"engine": "covariance", "relative_tolerance": options.relative_tolerance}
    dataset = statistics_dataset(case, times, responses, found.mean[:, rows], found.variance[:, rows], attributes)
    return _with_covariance(dataset, found.covariance, rows)


def _ensemble(
    case: Case, times: list[float], responses: list[str], options: EnsembleOptions, progress: Progress | None
) -> xr.Dataset:
    found = ensemble_dataset(case, times, responses, options)
    if progress:
        progress(times[-1])
    return found


def _finer_sweep(options: SweepOptions, flight: float) -> SweepOptions:
    """Return a tenth of the tolerance, in pieces so short that no step passes over what the first pass missed."""
    return _in_pieces(options, flight, 0.1)


def _begun_anew(options: Any, flight: float) -> Any:
    """Return options for the same pieces; beginning anew in each has an error of its own, kept below the first's.

    Absolutely the tolerance is far less, or both passes would miss the same where sizes are misjudged.
    """
    return _in_pieces(options, flight, 1e-3)


def _in_pieces(options: Any, flight: float, share: float) -> Any:
    tolerance = max(LEAST_TOLERANCE, share * options.relative_tolerance)
    longest = min(options.longest_interval, flight / LOOKS) if flight > 0 else options.longest_interval
    finer = replace(options, relative_tolerance=tolerance, longest_interval=longest)
    return replace(finer, absolute_part=1e-6 * options.absolute_part) if hasattr(options, "absolute_part") else finer


def _finer_ensemble(options: EnsembleOptions, flight: float) -> EnsembleOptions:
    return replace(options, substep=min(0.5 * options.substep, flight / LOOKS) if flight > 0 else options.substep)


ENGINES = {
    "sweep": Engine("sweep", SweepOptions, _sweep, _finer_sweep, SweepOptions(relative_tolerance=1e-9)),
    "cvodes": Engine(
        "adjoint (CVODES)", IntegratorOptions, _cvodes, _begun_anew, IntegratorOptions(relative_tolerance=1e-9)
    ),
    "covariance": Engine(
        "covariance equation (SciPy)",
        CovarianceOptions,
        _covariance,
        _begun_anew,
        CovarianceOptions(relative_tolerance=1e-9),
    ),
    "ensemble": Engine("ensemble", EnsembleOptions, _ensemble, _finer_ensemble, None),
}
