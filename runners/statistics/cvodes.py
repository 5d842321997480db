"""CVODES: one backward adjoint run an end time, and the dataset of the runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import xarray as xr

from ..case.case import Case
from ..present.progress import each
from ..solvers.adjoint import AdjointRun, AdjointSolver
from ..solvers.integration import COUNTERS, CvodesSettings
from ..solvers.time_nodes import time_nodes
from .dataset import statistics_dataset
from .engine import Engine, Progress, begun_anew


@dataclass(frozen=True)
class Cvodes(CvodesSettings, Engine):
    """One backward adjoint run of CVODES an end time, the report's method.

    Its statistics hold the work of the solver by end time.

    Parameters
    ----------
    method : {'adams', 'bdf'}
        Multistep formulas. Adams with Newton iteration is the default by measurement (docs/performance.md): the
        spectrum holds lightly damped bending, which BDF damps, beside filter poles near 100 rad/s, which cost
        functional iteration its step.
    iteration : {'newton', 'functional'}
    relative_tolerance : float
        Relative, on every adjoint and quadrature, between 1e-13 and 1e-2.
    absolute_part : float
        The absolute tolerance as a part of the relative one, of quantities scaled to be of the order of one
        (runners/solvers/typical_sizes.py).
    max_steps : int
        Of one run from end to start; AS-504 takes 20,000 at a tolerance of 1e-9.
    longest_interval : float
        Intervals between discontinuities are divided so that none is longer, s; the solver begins anew in each.

    Raises
    ------
    IntegrationError
    """

    name: ClassVar[str] = "cvodes"
    label: ClassVar[str] = "adjoint (CVODES)"

    def compute(
        self, case: Case, times: list[float], responses: list[str], progress: Progress | None = None
    ) -> xr.Dataset:
        solver = AdjointSolver(case.with_means, self)
        runs = []
        nodes = time_nodes(case.executable, times).tolist()
        for time, node in each(list(zip(times, nodes, strict=True)), "end times by CVODES"):
            runs.append(replace(solver.run(node), time=time))
            if progress:
                progress(time)
        return response_dataset(case, runs, responses, self)

    def finer(self, flight: float) -> Cvodes:
        settings = begun_anew(self.relative_tolerance, self.absolute_part, self.longest_interval, flight)
        return replace(self, **settings)

    @classmethod
    def tight(cls) -> Cvodes:
        """Return CVODES as it is held against other engines."""
        return cls(relative_tolerance=1e-9)


def response_dataset(
    case: Case, runs: Sequence[AdjointRun], responses: Sequence[str], options: CvodesSettings
) -> xr.Dataset:
    """Put adjoint runs together."""
    rows = [case.system.output_index(name) for name in responses]
    variance = np.array([run.variance[rows] for run in runs])
    mean = np.array([run.mean[rows] for run in runs])
    attributes = {
        "engine": "cvodes",
        "code": case.executable.code,
        "method": options.method,
        "iteration": options.iteration,
        "relative_tolerance": options.relative_tolerance,
    }
    dataset = statistics_dataset(case, [run.time for run in runs], responses, mean, variance, attributes)
    for name in COUNTERS:
        dataset[name] = ("time", [run.counters[name] for run in runs])
    return dataset
