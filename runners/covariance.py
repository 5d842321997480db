"""The covariance equation, forward by SciPy: another road to the same variances.

P' = A P + P A' + B_s B_s', P(t0) = P0_s for each source s, and x' = A x + E u for the mean;
Var_s[y] = C P C'. Nothing here uses the adjoint or CVODES.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ..codegen.compiled import ExecutableSystem
from ..codegen.functions import state_scales
from ..model.errors import IntegrationError
from .integration import intervals


@dataclass(frozen=True, eq=False)
class CovarianceResult:
    """Variances (k, responses, sources) and means (k, responses) at ``times``."""

    times: NDArray[np.float64]
    variance: NDArray[np.float64]
    mean: NDArray[np.float64]


def covariance_equation(
    executable: ExecutableSystem, times: Sequence[float], relative_tolerance: float = 1e-9
) -> CovarianceResult:
    """Integrate covariances of all sources and the mean with SciPy's DOP853.

    Parameters
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : sequence of float
        Increasing, s.
    relative_tolerance : float
        The absolute one is a ten-millionth of it, of scaled states: a source that hardly moves the vehicle has
        covariances many orders smaller than the wind's.

    Raises
    ------
    IntegrationError
    """
    system = executable.system
    n, scale = len(system.states), state_scales(executable.system)
    sources = [system.noise_columns(source) for source in system.sources]
    start = [
        system.start_covariance_matrix(source, executable.parameters) / np.outer(scale, scale)
        for source in system.sources
    ]
    y = np.concatenate([np.array(start).ravel(), np.zeros(n)])
    variances, means = [], []
    begin = system.start
    for time in times:
        for interval in intervals(system, begin, float(time)) if time > begin else []:

            def rate(t: float, y: NDArray, low: float = interval.low, high: float = interval.high) -> NDArray:
                m = executable.matrices(t, low, high)
                A = m["A"] * scale / scale[:, None]
                B = m["B"] / scale[:, None]
                P = y[:-n].reshape(len(sources), n, n)
                half = A @ P
                derivative = half + half.transpose(0, 2, 1)
                for k, columns in enumerate(sources):
                    derivative[k] += B[:, columns] @ B[:, columns].T
                mean = A @ y[-n:] + (m["E"] @ m["inputs"][:, 0]) / scale
                return np.concatenate([derivative.ravel(), mean])

            solution = solve_ivp(
                rate, (interval.begin, interval.end), y, method="DOP853",
                rtol=relative_tolerance, atol=1e-7 * relative_tolerance,
            )  # fmt: skip
            if not solution.success or not np.isfinite(solution.y[:, -1]).all():
                raise IntegrationError(
                    f"the covariance equation stopped between {interval.begin:g} s and {interval.end:g} s: "
                    f"{solution.message}"
                )
            y = solution.y[:, -1]
        begin = float(time)
        last = intervals(system, system.start, begin)[-1]
        m = executable.matrices(begin, last.low, last.high)
        C = m["C"] * scale
        P = y[:-n].reshape(len(sources), n, n)
        variances.append(np.einsum("ri,sij,rj->rs", C, P, C))
        means.append(C @ y[-n:] + m["G"] @ m["inputs"][:, 0])
    return CovarianceResult(np.asarray(times, float), np.array(variances), np.array(means))
