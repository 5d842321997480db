"""Error and run time against tolerance, and the variable that paces the integrator (report section 5.4)."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.functions import state_scales
from ..present.progress import each
from ..solvers.adjoint import AdjointSolver
from ..solvers.stability import matrices_at
from .covariance import CovarianceEquation
from .cvodes import Cvodes
from .engine import relative_difference
from .engines import response_statistics
from .sweep import Sweep

if TYPE_CHECKING:
    from ..case.case import Case

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
REFERENCE_TOLERANCE = 1e-11  # a standard deviation is 8e-15 from that at 1e-12 for AS-504, 4e-13 for Falcon 1
PRECISE = 1e-10  # of the adjoint that is taken apart into modes
TYPICAL_ORDER = 5  # of the formulas, where the local error of each root is weighed


@dataclass(frozen=True)
class Measurement:
    """One engine at one tolerance: largest relative error of a standard deviation, and seconds."""

    engine: str
    tolerance: float
    error: float
    seconds: float


@dataclass(frozen=True)
class Pace:
    """What limits the step in a window of flight.

    Attributes
    ----------
    begin, end : float
        s.
    fastest_root : complex
        Of A frozen in the middle, rad/s; it limits functional iteration.
    fastest_states : tuple of str
        That take part in it most.
    functional_limit : float
        Step beyond which functional iteration with Adams' formulas cannot converge, about 2 / |root|, s.
    functional_step, newton_step : float
        Mean steps of CVODES, Adams, with the two iterations, s.
    accuracy_root : complex
        The root with the largest local error against its weight; it limits the step of Newton iteration.
    pacing_state : str
        The state in whose adjoint that error is largest.
    """

    begin: float
    end: float
    fastest_root: complex
    fastest_states: tuple[str, ...]
    functional_limit: float
    functional_step: float
    newton_step: float
    accuracy_root: complex
    pacing_state: str


def variants() -> dict[str, Cvodes | Sweep]:
    """Return the engines with a tolerance, the reference excepted, by label."""
    found: dict[str, Cvodes | Sweep] = {}
    for method in ("adams", "bdf"):
        for iteration in ("newton", "functional"):
            label = f"CVODES {'Adams' if method == 'adams' else 'BDF'}, {iteration}"
            found[label] = Cvodes(method=method, iteration=iteration)
    return found | {Sweep.label: Sweep()}


def measure(case: Case, times: list[float], tolerances: tuple[float, ...] = TOLERANCES) -> list[Measurement]:
    """Compute the statistics by every engine at every tolerance, against the covariance equation.

    Parameters
    ----------
    case : Case
    times : list of float
        End times, s.
    tolerances : tuple of float

    Raises
    ------
    TimeRangeError, IntegrationError
    """
    reference = response_statistics(case, times, engine=CovarianceEquation(REFERENCE_TOLERANCE)).std.values
    found = []
    for tolerance in each(tolerances, "tolerances"):
        for label, engine in variants().items():
            finer = replace(engine, relative_tolerance=tolerance)
            start = clock.perf_counter()
            statistics = finer.compute(case, times, list(case.system.output_names))
            seconds = clock.perf_counter() - start
            error = float(relative_difference(statistics["std"].values, reference).max())
            found.append(Measurement(label, tolerance, error, seconds))
    return found


def pacing(case: Case, time: float, windows: int = 8, tolerance: float = 1e-7) -> list[Pace]:
    """Name what limits the step of CVODES over the flight before t2 = ``time``.

    Each window is integrated from the adjoint at its end, so that steps can be counted; the restart costs a few.

    Parameters
    ----------
    case : Case
    time : float
        t2, s.
    windows : int
    tolerance : float

    Raises
    ------
    TimeRangeError, IntegrationError
    """
    case.matrices(time)
    system, executable = case.system, case.with_means
    edges = np.linspace(system.start, time, windows + 1)
    history = AdjointSolver(executable, Cvodes(relative_tolerance=PRECISE)).history(time, 0.05)
    solvers = {
        iteration: AdjointSolver(executable, Cvodes(iteration=iteration, relative_tolerance=tolerance))
        for iteration in ("functional", "newton")
    }
    paces = []
    for k in range(windows):
        middle = 0.5 * (edges[k] + edges[k + 1])
        A = matrices_at(executable, middle)["A"]
        roots, right = np.linalg.eig(A)
        fastest = int(np.argmax(np.abs(roots)))
        share = np.abs(np.linalg.inv(right)[fastest] * right[:, fastest])
        taking_part = [system.state_names[i] for i in np.argsort(-share)[:2] if share[i] > 0.15 * share.max()]
        at_end = history.adjoint[int(np.argmin(np.abs(history.times - edges[k + 1])))]
        count = {name: solver.steps(at_end, edges[k + 1], edges[k]) for name, solver in solvers.items()}
        step = {name: float((edges[k + 1] - edges[k]) / steps) for name, steps in count.items()}
        within = (history.times >= edges[k]) & (history.times <= edges[k + 1])
        root, state = _largest_local_error(case, A, history.adjoint[within][::5])
        size = abs(roots[fastest])
        paces.append(
            Pace(
                float(edges[k]), float(edges[k + 1]), _upper(roots[fastest]), tuple(taking_part), 2.0 / float(size),
                step["functional"], step["newton"], _upper(root), system.state_names[state],
            )
        )  # fmt: skip
    return paces


def _largest_local_error(case: Case, A: NDArray, adjoints: NDArray) -> tuple[complex, int]:
    """Return the root, and the state, with the largest share of the local error against the integrator's weight.

    The adjoint is a sum of modes c_j v_j of A'; a formula of order q makes a local error proportional to
    |s_j|^(q+1) |c_j v_j|, which CVODES divides by its weight, relative tolerance times size plus absolute. Squares
    are averaged over the adjoints given, (k, responses, n).
    """
    S = state_scales(case.system)
    scaled = np.moveaxis(adjoints, 2, 1) * S[:, None] / np.array([o.scale for o in case.system.outputs])
    roots, modes = np.linalg.eig(S[:, None] * A.T / S)
    amounts = np.linalg.solve(modes, scaled.astype(complex))
    parts = np.abs(modes[None, :, :, None] * amounts[:, None])  # time, state, root, response
    parts[parts < 1e3 * PRECISE * np.abs(scaled).max()] = 0.0  # the integrator's own error, not a mode
    error = np.abs(roots[:, None]) ** (TYPICAL_ORDER + 1) * parts / (np.abs(scaled) + 1e-3)[:, :, None]
    state, root = np.unravel_index(np.argmax((error**2).mean(axis=0).sum(axis=2)), error.shape[1:3])
    return complex(roots[root]), int(state)


def _upper(root: complex) -> complex:
    return complex(root.real, abs(root.imag))
