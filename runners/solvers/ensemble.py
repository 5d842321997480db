"""The ensemble: many flights through random wind, the report's conventional method, with confidence intervals.

By linearity each source drives a vehicle of its own and the sum flies through all of them, so that one set of runs
gives the spread by source and combined. Runs are stepped exactly between end times
(runners/solvers/discretisation.py); what remains is the sampling error, which the intervals show.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, t

from ...codegen.ensemble.compiled import ensemble_of
from ...codegen.system.executable import ExecutableSystem
from ...codegen.toolchain.interruption import Workers
from ...model.errors import AscentwindError
from .cores import available_cores
from .discretisation import discretise

if TYPE_CHECKING:
    pass

FEWEST_RUNS = 10
CHUNK = 512  # runs a thread takes at a time; sums are added in the order of chunks, whatever the number of threads


class EnsembleOptionsError(AscentwindError):
    """An ensemble cannot be run as asked."""


@dataclass(frozen=True)
class EnsembleOptions:
    """How an ensemble is run.

    Parameters
    ----------
    runs : int
        At least 10, below which an interval says nothing.
    seed : int
        Of the noise, 0 to 2^64 - 1. The same seed gives the same numbers with any number of threads.
    confidence : float
        Of the intervals, between 0 and 1.
    paths : int
        Runs kept as sample paths, all sources together.
    path_spacing : float
        Largest distance between points of a path, s.
    threads : int, optional
        All cores without it.
    substep : float
        Over which the matrices are taken as linear in time, s.
    """

    runs: int = 500
    seed: int = 504
    confidence: float = 0.9
    paths: int = 0
    path_spacing: float = 0.1
    threads: int | None = None
    substep: float = 0.05

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


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Statistics of a set of runs.

    Attributes
    ----------
    times : (k,) array
        s.
    runs : int
    known_mean : (k, responses) array
        Response to the known inputs.
    moments : (k, responses, sources + 1, 2) array
        Sums of deviation and squared deviation over the runs; the last source is all together.
    path_times : (m,) array
    paths : (paths, m, responses) array
        Known mean and deviation, all sources together.
    """

    times: NDArray[np.float64]
    runs: int
    known_mean: NDArray[np.float64]
    moments: NDArray[np.float64]
    path_times: NDArray[np.float64]
    paths: NDArray[np.float64]

    @property
    def mean(self) -> NDArray[np.float64]:
        """Sample mean by source, (k, responses, sources + 1)."""
        return self.known_mean[:, :, None] + self.moments[..., 0] / self.runs

    @property
    def variance(self) -> NDArray[np.float64]:
        """Sample variance by source, unbiased, (k, responses, sources + 1)."""
        total, squares = self.moments[..., 0], self.moments[..., 1]
        return (squares - total**2 / self.runs) / (self.runs - 1)


def run_ensemble(executable: ExecutableSystem, times: list[float], options: EnsembleOptions) -> Ensemble:
    """Fly all runs.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : list of float
        End times, increasing, s.
    options : EnsembleOptions

    Raises
    ------
    EnsembleNeedsCompilerError, CompilerError, IntegrationError
    """
    system = executable.system
    engine = ensemble_of(executable)
    grid = np.asarray(times, float)
    if options.paths:
        count = max(1, int(np.ceil((times[-1] - system.start) / options.path_spacing - 1e-9)))
        grid = np.union1d(grid, np.linspace(system.start, times[-1], count + 1)[:-1])
    found = discretise(executable, grid.tolist(), options.substep)
    firsts = range(0, options.runs, CHUNK)

    def chunk(first: int) -> tuple[NDArray, NDArray | None]:
        size = min(CHUNK, options.runs - first)
        return engine.run(found.steps, options.seed, first, size, keep_paths=first < options.paths)

    with Workers(options.threads or available_cores()) as pool:
        results = list(pool.map(chunk, firsts))
    at = np.searchsorted(grid, times)
    deviations = [paths for _, paths in results if paths is not None]
    paths = np.concatenate(deviations)[: options.paths] if deviations else np.empty((0, grid.size, len(system.outputs)))
    moments = np.sum([sums for sums, _ in results], axis=0)
    return Ensemble(
        grid[at], options.runs, found.mean[at], moments[at], grid if options.paths else grid[:0],
        paths + found.mean if options.paths else paths[:, :0],
    )  # fmt: skip


def mean_interval(
    mean: NDArray, std: NDArray, runs: int, confidence: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the confidence interval of a mean by Student's t.

    m -+ t_{n-1; (1+c)/2} s / sqrt(n); Bendat and Piersol, Random Data, 4th edition, 2010, section 4.4.
    """
    half = t.ppf(0.5 * (1 + confidence), runs - 1) * std / np.sqrt(runs)
    return mean - half, mean + half


def std_interval(std: NDArray, runs: int, confidence: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the confidence interval of a standard deviation by chi-square.

    s sqrt((n-1) / chi2_{n-1; (1+c)/2}) to s sqrt((n-1) / chi2_{n-1; (1-c)/2}); Bendat and Piersol, Random Data,
    4th edition, 2010, section 4.4. Exact for normal runs, which a linear system under normal noise has.
    """
    low, high = chi2.ppf([0.5 * (1 + confidence), 0.5 * (1 - confidence)], runs - 1)
    return std * np.sqrt((runs - 1) / low), std * np.sqrt((runs - 1) / high)
