"""The covariance equation, forward by SciPy: another road to the same variances.

P' = A P + P A' + B_s B_s', P(t0) = P0_s for each source s, and x' = A x + E u for the mean;
Var_s[y] = C P C'. Nothing here uses the adjoint or CVODES.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ...codegen.system.covariance import packed, unpacked
from ...codegen.system.evaluation import MatrixEvaluator, covariance_rate
from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import state_scales
from ...model.errors import IntegrationError
from .step_budget import at_most, check_explicit_steps
from .time_nodes import interval_before, intervals, time_nodes
from .typical_sizes import typical_sizes

LARGEST = 1e280  # of scaled covariances and means
MOST_STEPS = 100_000  # AS-504 takes 14,000 steps of DOP853 at a tolerance of 1e-12


@dataclass(frozen=True, eq=False)
class CovarianceResult:
    """Covariances (k, sources, responses, responses) and means (k, responses) at ``times``."""

    times: NDArray[np.float64]
    covariance: NDArray[np.float64]
    mean: NDArray[np.float64]

    @property
    def variance(self) -> NDArray[np.float64]:
        """Variance by time, response and source, (k, responses, sources)."""
        return np.einsum("ksrr->krs", self.covariance)


def covariance_equation(
    executable: ExecutableSystem,
    times: Sequence[float],
    relative_tolerance: float = 1e-9,
    progress: Callable[[float], None] | None = None,
    longest_interval: float = float("inf"),
    absolute_part: float = 1e-4,
) -> CovarianceResult:
    """Integrate covariances of all sources and the mean with SciPy's DOP853.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : sequence of float
        Increasing, s.
    relative_tolerance : float
        Of every covariance.
    absolute_part : float
        The absolute tolerance as a part of the relative one, of the sizes that each source gives the states.
    progress : callable, optional
        Called with each time when it is reached.
    longest_interval : float
        Intervals between discontinuities are divided so that none is longer, s.

    Raises
    ------
    IntegrationError
    """
    system = executable.system
    n, scale, sources = len(system.states), state_scales(executable.system), len(system.sources)
    start = [
        system.start_covariance_matrix(source, executable.parameters) / np.outer(scale, scale)
        for source in system.sources
    ]
    sizes = typical_sizes(executable, float(np.max(times)))
    equation = covariance_rate(executable)
    outputs = MatrixEvaluator(executable, ("C", "G", "inputs"))
    y = np.concatenate([packed(np.array(start).reshape(sources, n, n)).ravel(), np.zeros(n)])
    covariances, means = [], []
    begin = system.start
    check_explicit_steps(executable, intervals(executable, begin, float(max(times))), MOST_STEPS)
    for time, node in zip(times, time_nodes(executable, times).tolist(), strict=True):
        for interval in intervals(executable, begin, node, longest_interval) if node > begin else []:

            def rate(t: float, y: NDArray, low: float = interval.low, high: float = interval.high) -> NDArray:
                return equation(t, low, high, y)

            size = sizes and sizes.least(interval.begin, interval.end) / scale
            budgeted = at_most(rate, MOST_STEPS, "t = {:.6g} s")
            absolute = absolute_part * relative_tolerance * _absolute(size, sources, n)
            with np.errstate(over="ignore", invalid="ignore"):  # growth beyond numbers is told below, with its time
                solution = solve_ivp(
                    budgeted, (interval.begin, interval.end), y, method="DOP853", rtol=relative_tolerance, atol=absolute
                )
            if np.abs(solution.y[:, -1]).max(initial=0.0) > LARGEST:
                raise IntegrationError(
                    f"covariances or the mean leave the range of numbers near {solution.t[-1]:g} s; the system grows "
                    "without bound (see its roots)"
                )
            if not solution.success or not np.isfinite(solution.y[:, -1]).all():
                raise IntegrationError(
                    f"the covariance equation stopped between {interval.begin:g} s and {interval.end:g} s: "
                    f"{solution.message}"
                )
            y = solution.y[:, -1]
        begin, last = node, interval_before(executable, node)
        C, G, inputs = outputs(begin, last.low, last.high)
        C = C * scale
        covariances.append(C @ unpacked(y[:-n], n) @ C.T)
        means.append(C @ y[-n:] + G @ inputs[:, 0])
        if progress:
            progress(float(time))
    return CovarianceResult(np.asarray(times, float), np.array(covariances), np.array(means))


def _absolute(size: NDArray | None, sources: int, n: int) -> NDArray[np.float64]:
    """Return what absolute tolerances are parts of, for covariances of all sources and the mean, from sizes of states.

    A state that a source does not move stays exactly zero, whatever is allowed.
    """
    if size is None:
        return np.full(sources * n * (n + 1) // 2 + n, 1e-3)
    covariance = packed(np.einsum("si,sj->sij", size[:-1], size[:-1])).ravel()
    return np.maximum(np.concatenate([covariance, size[-1]]), 1e-250)
