"""The sweep: all end times in one pass of a generated integrator, and its dataset."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import xarray as xr

from ...codegen.sweep.compiled import sweep_of
from ...model.system.names import COMBINED
from ..case.case import Case
from ..present.progress import steps
from ..solvers.sweep import LEAST_TOLERANCE, SweepResult, sweep
from ..solvers.tolerances import check_relative_tolerance
from .dataset import statistics_dataset, with_covariance
from .engine import Engine, Progress, piece_of


@dataclass(frozen=True)
class Sweep(Engine):
    """All end times in one pass of a generated integrator; needs a compiler.

    Its statistics hold covariances between responses and the error estimate of the formulas. A check takes a tenth of
    the tolerance, in pieces so short that no step passes over what the first pass missed.

    Parameters
    ----------
    relative_tolerance : float
        Relative, of every standard deviation, between 1e-12 and 1e-2.
    longest_interval : float
        Flight is looked at in pieces no longer than this, and than 1 s or a 5000th of it, s.

    Raises
    ------
    IntegrationError
    """

    relative_tolerance: float = 1e-7
    longest_interval: float = float("inf")

    name: ClassVar[str] = "sweep"
    label: ClassVar[str] = "sweep"

    def __post_init__(self):
        check_relative_tolerance(self.relative_tolerance, LEAST_TOLERANCE)

    def compute(
        self, case: Case, times: list[float], responses: list[str], progress: Progress | None = None
    ) -> xr.Dataset:
        with steps("code of the sweep") as line:
            compiled = sweep_of(case.executable)
            line.done("mean response")
            filled = case.with_means
            line.done("all end times in one sweep")
            found = sweep(
                compiled,
                filled,
                times,
                relative_tolerance=self.relative_tolerance,
                longest_interval=self.longest_interval,
                responses=responses,
            )
        if progress:
            for time in times:
                progress(time)
        return sweep_dataset(case, found, responses, self.relative_tolerance)

    def finer(self, flight: float) -> Sweep:
        tolerance = max(LEAST_TOLERANCE, 0.1 * self.relative_tolerance)
        return replace(self, relative_tolerance=tolerance, longest_interval=piece_of(flight, self.longest_interval))

    @classmethod
    def tight(cls) -> Sweep:
        """Return the sweep as it is held against other engines."""
        return cls(relative_tolerance=1e-9)


def sweep_dataset(case: Case, found: SweepResult, responses: list[str], relative_tolerance: float) -> xr.Dataset:
    """Return the dataset of a sweep: statistics, covariances between responses, and the error estimate."""
    rows = [case.system.output_index(name) for name in responses]
    attributes = {
        "engine": "sweep",
        "relative_tolerance": relative_tolerance,
        **{f"sweep_{name}": value for name, value in found.counters.items()},
    }
    variance = found.variance[:, rows]
    dataset = statistics_dataset(case, found.times.tolist(), responses, found.mean[:, rows], variance, attributes)
    dataset = with_covariance(dataset, found.covariance, rows)
    error = np.moveaxis(found.error_estimate[:, :, rows], 1, 2)
    total = dataset["variance"].sel(source=COMBINED).values
    shared = (variance * error).sum(axis=2) / np.where(total > 0, total, 1.0)
    dataset["error_estimate"] = (
        ("time", "response", "source"),
        np.concatenate([error, shared[:, :, None]], axis=2),
        {"units": "1", "long_name": "estimated relative error of the std"},
    )
    return dataset
