"""The engines: roads to the same statistics, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.errors import IntegrationError, UnknownNameError
from .adjoint import AdjointSolver
from .covariance import CovarianceOptions, covariance_equation
from .ensemble import EnsembleOptions, ensemble_dataset
from .integration import IntegratorOptions
from .statistics import ResponseStatistics, provenance, response_dataset, statistics_dataset

if TYPE_CHECKING:
    from .study import Study

Progress = Callable[[float], None]


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
        (study, increasing end times, responses, options, progress) -> ResponseStatistics.
    finer : callable
        Options of a finer discretisation, by which the error of the given ones is judged.
    tight : object or None
        Options with which engines are held against each other; None for an engine with a sampling error.
    """

    label: str
    options: type
    compute: Callable[[Study, list[float], list[str], Any, Progress | None], ResponseStatistics]
    finer: Callable[[Any], Any]
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


def compute_statistics(
    study: Study,
    times: list[float],
    responses: list[str],
    engine: str,
    options: object | None,
    check: bool,
    progress: Progress | None,
) -> ResponseStatistics:
    """Run an engine; with ``check`` a second time, finer, and keep the relative difference of the std.

    Raises
    ------
    UnknownNameError, IntegrationError
    """
    chosen = find_engine(engine)
    settings = chosen.options() if options is None else options
    if not isinstance(settings, chosen.options):
        raise IntegrationError(
            f"engine '{engine}' takes {chosen.options.__name__}, not {type(settings).__name__}; see ascentwind.runners"
        )
    found = chosen.compute(study, times, responses, settings, progress)
    if check:
        finer = chosen.compute(study, times, responses, chosen.finer(settings), None)
        found["discretisation_difference"] = (
            found.std.dims,
            relative_difference(found.std.values, finer.std.values),
            {"units": "1", "long_name": "std against a finer discretisation, relative"},
        )
    return found


def relative_difference(value: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return |value - reference| / |reference|, zero where both are."""
    size = np.abs(reference)
    difference = np.abs(value - reference)
    return np.where(difference == 0, 0.0, difference / np.where(size > 0, size, np.finfo(float).tiny))


def _cvodes(
    study: Study, times: list[float], responses: list[str], options: IntegratorOptions, progress: Progress | None
) -> ResponseStatistics:
    solver = AdjointSolver(study.with_means, options)
    runs = []
    for time in times:
        runs.append(solver.run(time))
        if progress:
            progress(time)
    return response_dataset(study, runs, responses, options)


def _covariance(
    study: Study, times: list[float], responses: list[str], options: CovarianceOptions, progress: Progress | None
) -> ResponseStatistics:
    rows = [study.system.output_index(name) for name in responses]
    found = covariance_equation(study.with_means, times, options.relative_tolerance, progress)
    attributes = provenance(study) | {"engine": "covariance", "relative_tolerance": options.relative_tolerance}
    return statistics_dataset(study, times, responses, found.mean[:, rows], found.variance[:, rows], attributes)


def _ensemble(
    study: Study, times: list[float], responses: list[str], options: EnsembleOptions, progress: Progress | None
) -> ResponseStatistics:
    found = ensemble_dataset(study, times, responses, options)
    if progress:
        progress(times[-1])
    return found


def _tenth(options: Any) -> Any:
    return replace(options, relative_tolerance=max(1e-13, 0.1 * options.relative_tolerance))


ENGINES = {
    "cvodes": Engine(
        "adjoint (CVODES)", IntegratorOptions, _cvodes, _tenth, IntegratorOptions(relative_tolerance=1e-9)
    ),
    "covariance": Engine(
        "covariance equation (SciPy)",
        CovarianceOptions,
        _covariance,
        _tenth,
        CovarianceOptions(relative_tolerance=1e-9),
    ),
    "ensemble": Engine("ensemble", EnsembleOptions, _ensemble, lambda o: replace(o, substep=0.5 * o.substep), None),
}
