"""Simulated flights, an ensemble of them, and its dataset with confidence intervals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import xarray as xr

from ...model.errors import AscentwindError
from ..case.case import Case
from ..present.netcdf import RULE
from ..solvers.cores import available_cores
from ..solvers.ensemble import mean_interval, run_ensemble, std_interval
from .dataset import statistics_dataset
from .engine import Engine, Progress, piece_of

FEWEST_RUNS = 10


class EnsembleOptionsError(AscentwindError):
    """An ensemble cannot be run as asked."""


@dataclass(frozen=True)
class Ensemble(Engine):
    """Flights through random wind, the report's conventional method; needs a compiler.

    Its statistics hold confidence intervals and the sample paths that are kept. A check takes half the substep, or less
    where that is longer than the pieces of the flight that it looks at.

    Parameters
    ----------
    runs : int
        At least 10, below which an interval says nothing.
    seed : int
        Of the noise, 0 to 2^64 - 1. The same seed gives the same numbers with any number of threads.
    confidence : float
        Probability of the intervals, between 0 and 1.
    paths : int
        Runs kept as sample paths, all sources together.
    path_spacing : float
        Largest distance between points of a path, s.
    threads : int, optional
        All cores without it.
    substep : float
        Over which the matrices are taken as linear in time, s.

    Raises
    ------
    EnsembleOptionsError
    """

    runs: int = 500
    seed: int = 504
    confidence: float = 0.9
    paths: int = 0
    path_spacing: float = 0.1
    threads: int | None = None
    substep: float = 0.05

    name: ClassVar[str] = "ensemble"
    label: ClassVar[str] = "ensemble"

    def __post_init__(self):
        cores = available_cores()
        if self.runs < FEWEST_RUNS:
            raise EnsembleOptionsError(
                f"{self.runs} runs are too few for a confidence interval; take {FEWEST_RUNS} or more (the report: 500)"
            )
        if not 0 <= self.seed < 2**64:
            raise EnsembleOptionsError(f"the seed {self.seed} does not fit; choose 0 to 2^64 - 1")
        if not 0 < self.confidence < 1:
            raise EnsembleOptionsError(f"a confidence of {self.confidence:g} means nothing; choose 0.9 or the like")
        if not 0 <= self.paths <= self.runs:
            raise EnsembleOptionsError(f"{self.paths} paths cannot be kept of {self.runs} runs")
        if not (self.path_spacing > 0 and self.substep > 0):
            raise EnsembleOptionsError("path_spacing and substep must be positive times in seconds")
        if self.threads is not None and not 1 <= self.threads <= cores:
            raise EnsembleOptionsError(f"{self.threads} threads were asked for and there are {cores} cores")

    def compute(
        self, case: Case, times: list[float], responses: list[str], progress: Progress | None = None
    ) -> xr.Dataset:
        found = ensemble_dataset(case, times, responses, self)
        if progress:
            progress(times[-1])
        return found

    def finer(self, flight: float) -> Ensemble:
        return replace(self, substep=piece_of(flight, 0.5 * self.substep) if flight > 0 else self.substep)

    @classmethod
    def tight(cls) -> None:
        """Return nothing: an ensemble has a sampling error."""
        return


def ensemble_dataset(case: Case, times: list[float], responses: list[str], flown: Ensemble) -> xr.Dataset:
    """Return the statistics of an ensemble as a dataset.

    Besides the variables of every engine: ``mean_low``, ``mean_high``, ``std_low``, ``std_high``, the confidence
    intervals; with paths kept, ``sample_path`` over (path, t, response).
    """
    rows = [case.system.output_index(name) for name in responses]
    found = run_ensemble(
        case.with_means, times, runs=flown.runs, seed=flown.seed, substep=flown.substep, paths=flown.paths,
        path_spacing=flown.path_spacing, threads=flown.threads,
    )  # fmt: skip
    variance = found.variance[:, rows]
    attributes = {
        "engine": "ensemble", "runs": flown.runs, "seed": flown.seed, "confidence": flown.confidence,
        "substep_s": flown.substep,
    }  # fmt: skip
    dataset = statistics_dataset(case, times, responses, found.known_mean[:, rows], variance[..., :-1], attributes)
    # sampled all together, the sources are not exactly uncorrelated, nor is the mean exactly the known one
    mean, std = found.mean[:, rows], np.sqrt(variance)
    dims = ("time", "response", "source")
    for name, values in (("mean", mean), ("variance", variance), ("std", std), ("mean_plus_3sigma", mean + 3 * std)):
        dataset[name] = (dims, values, dataset[name].attrs)
    for name, (low, high) in (
        ("mean", mean_interval(mean, std, flown.runs, flown.confidence)),
        ("std", std_interval(std, flown.runs, flown.confidence)),
    ):
        for side, values in (("low", low), ("high", high)):
            label = f"{side} end of the {flown.confidence:.0%} confidence interval of {name}"
            dataset[f"{name}_{side}"] = (dims, values, dataset[name].attrs | {"long_name": label})
    if flown.paths:
        label = {"long_name": "sample paths, all sources together", RULE: "response"}
        dataset["sample_path"] = (("path", "t", "response"), found.paths[:, :, rows], label)
        dataset = dataset.assign_coords(t=("t", found.path_times, {"units": "s", "long_name": "flight time"}))
    return dataset
