"""The ensemble: many flights through random wind, the report's conventional method, with confidence intervals.

By linearity each source drives a vehicle of its own and the sum flies through all of them, so that one set of runs
gives the spread by source and combined. Runs are stepped exactly between end times
(runners/solvers/discretisation.py); what remains is the sampling error, which the intervals show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, stdtrit

from ...codegen.ensemble.compiled import ensemble_of
from ...codegen.system.executable import ExecutableSystem
from ...codegen.toolchain.interruption import Workers
from ..present.progress import each
from .cores import available_cores
from .discretisation import discretise

CHUNK = 512  # runs a thread takes at a time; sums are added in the order of chunks, whatever the number of threads


@dataclass(frozen=True, eq=False)
class EnsembleResult:
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


def run_ensemble(
    executable: ExecutableSystem,
    times: list[float],
    *,
    runs: int,
    seed: int,
    substep: float,
    paths: int = 0,
    path_spacing: float = 0.1,
    threads: int | None = None,
) -> EnsembleResult:
    """Fly all runs.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : list of float
        End times, increasing, s.
    runs : int
    seed : int
        The same seed gives the same numbers with any number of threads.
    substep : float
        Over which the matrices are taken as linear in time, s.
    paths : int
        Runs kept as sample paths, all sources together.
    path_spacing : float
        Largest distance between points of a path, s.
    threads : int, optional
        All cores without it.

    Raises
    ------
    EnsembleNeedsCompilerError, CompilerError, IntegrationError
    """
    system = executable.system
    compiled = ensemble_of(executable)
    grid = np.asarray(times, float)
    if paths:
        count = max(1, int(np.ceil((times[-1] - system.start) / path_spacing - 1e-9)))
        grid = np.union1d(grid, np.linspace(system.start, times[-1], count + 1)[:-1])
    found = discretise(executable, grid.tolist(), substep)
    firsts = range(0, runs, CHUNK)

    def chunk(first: int) -> tuple[NDArray, NDArray | None]:
        size = min(CHUNK, runs - first)
        return compiled.run(found.steps, seed, first, size, keep_paths=first < paths)

    with Workers(threads or available_cores()) as pool:
        results = list(each(pool.map(chunk, firsts), f"{runs} flights in lots of {CHUNK}", len(firsts)))
    at = np.searchsorted(grid, times)
    deviations = [flown for _, flown in results if flown is not None]
    kept = np.concatenate(deviations)[:paths] if deviations else np.empty((0, grid.size, len(system.outputs)))
    moments = np.sum([sums for sums, _ in results], axis=0)
    return EnsembleResult(
        grid[at], runs, found.mean[at], moments[at], grid if paths else grid[:0],
        kept + found.mean if paths else kept[:, :0],
    )  # fmt: skip


def mean_interval(
    mean: NDArray, std: NDArray, runs: int, confidence: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the confidence interval of a mean by Student's t.

    m -+ t_{n-1; (1+c)/2} s / sqrt(n); Bendat and Piersol, Random Data, 4th edition, 2010, section 4.4.
    """
    half = stdtrit(runs - 1, 0.5 * (1 + confidence)) * std / np.sqrt(runs)
    return mean - half, mean + half


def std_interval(std: NDArray, runs: int, confidence: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the confidence interval of a standard deviation by chi-square.

    s sqrt((n-1) / chi2_{n-1; (1+c)/2}) to s sqrt((n-1) / chi2_{n-1; (1-c)/2}); Bendat and Piersol, Random Data,
    4th edition, 2010, section 4.4. Exact for normal runs, which a linear system under normal noise has.
    """
    low, high = chdtri(runs - 1, [0.5 * (1 - confidence), 0.5 * (1 + confidence)])
    return std * np.sqrt((runs - 1) / low), std * np.sqrt((runs - 1) / high)
