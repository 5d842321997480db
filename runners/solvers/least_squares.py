"""Nonlinear least squares (Levenberg-Marquardt) with CasADi Jacobians, a time limit and the best point so far."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ...model.errors import AscentwindError, AscentwindWarning

LARGEST = 1e10  # a residual above it is nonsense

Progress = Callable[[int, float], None]


class FitError(AscentwindError):
    """A fit cannot be started or its residuals are not numbers."""


class StalledFitWarning(AscentwindWarning):
    """A fit stopped before it converged; its result is the best point found, and says so."""


class _Timeout(Exception):
    pass


@dataclass(frozen=True)
class FitOptions:
    """How long and how finely to fit.

    Parameters
    ----------
    time_limit : float
        Seconds; the best point so far is returned, flagged as not converged.
    max_evaluations : int
    tolerance : float
        Relative change of cost or unknowns below which the fit has converged.
    seed : int
        Of the further starting points that a method may draw.
    progress : callable, optional
        Called as progress(evaluations, cost) at each evaluation.
    """

    time_limit: float = 60.0
    max_evaluations: int = 1000
    tolerance: float = 1e-4
    seed: int = 504
    progress: Progress | None = None

    def __post_init__(self):
        if not (self.time_limit > 0 and self.max_evaluations > 0 and 0 < self.tolerance < 1):
            raise FitError("time limit, evaluations and tolerance of a fit must be positive, the last below one")


@dataclass(frozen=True, eq=False)
class Fit:
    """The best point found.

    Attributes
    ----------
    unknowns : (n,) array
    cost : float
        Half the sum of the squared residuals.
    start_cost : float
    converged : bool
    message : str
        Why the fit stopped.
    evaluations : int
    seconds : float
    """

    unknowns: NDArray[np.float64]
    cost: float
    start_cost: float
    converged: bool
    message: str
    evaluations: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals and their Jacobian as functions of (unknowns, data).

    Attributes
    ----------
    count, unknowns : int
        Number of residuals m, and of unknowns n.
    value : callable
        Returns (m,).
    jacobian : callable
        Returns (m, n).
    """

    count: int
    unknowns: int
    value: Callable[[NDArray, NDArray], NDArray]
    jacobian: Callable[[NDArray, NDArray], NDArray]


def residual_functions(residuals: ca.SX, unknowns: ca.SX, data: ca.SX | None = None) -> Residuals:
    """Return the functions of an expression; ``data`` are numbers that change from one fit to the next."""
    residuals = ca.densify(residuals)
    arguments = [unknowns, ca.SX(0, 1) if data is None else data]
    value = ca.Function("residuals", arguments, [residuals])
    jacobian = ca.Function("jacobian", arguments, [ca.jacobian(residuals, unknowns)])
    return Residuals(
        residuals.numel(),
        unknowns.numel(),
        lambda x, given: np.array(value(x, given)).ravel(),
        lambda x, given: np.array(jacobian(x, given)),
    )


def fit_least_squares(
    functions: Residuals, start: NDArray[np.float64], options: FitOptions, data: NDArray[np.float64] | None = None
) -> Fit:
    """Minimise the sum of squares.

    Parameters
    ----------
    functions : Residuals
    start : (n,) array
    data : array, optional
        For functions that take data.

    Raises
    ------
    FitError
        Fewer residuals than unknowns, or residuals at the start that are not finite.
    """
    if functions.count < functions.unknowns:
        raise FitError(f"{functions.unknowns} unknowns cannot follow from {functions.count} values; give more levels")
    given = np.zeros(0) if data is None else data
    begin = time.monotonic()
    best: tuple[float, NDArray] = (np.inf, start)
    evaluations = 0

    def evaluate(x: NDArray) -> NDArray:
        nonlocal best, evaluations
        r = functions.value(x, given)
        evaluations += 1
        usable = np.isfinite(r).all() and np.abs(r).max() < LARGEST
        cost = 0.5 * float(r @ r) if usable else np.inf
        if cost < best[0]:
            best = (cost, x.copy())
        if options.progress is not None:
            options.progress(evaluations, best[0])
        if evaluations > 1 and time.monotonic() - begin > options.time_limit:
            raise _Timeout
        # a step into nonsense must look bad to the optimiser, not stop it
        return r if usable else np.full(r.size, LARGEST)

    first = evaluate(np.asarray(start, float))
    start_cost = best[0]
    if not np.isfinite(start_cost):
        raise FitError(f"the residuals are not finite at the start ({first.size} of them); check the statistics")
    try:
        found = least_squares(
            evaluate,
            start,
            jac=lambda x: functions.jacobian(x, given),  # pyright: ignore[reportArgumentType]
            method="lm",
            x_scale="jac",
            ftol=options.tolerance,
            xtol=options.tolerance,
            gtol=1e-12,
            max_nfev=options.max_evaluations,
        )
        converged, message = found.status > 0, found.message
    except _Timeout:
        converged, message = False, f"stopped after the time limit of {options.time_limit:g} s"
    except np.linalg.LinAlgError as error:
        converged, message = False, f"stalled: {error}"
    return Fit(best[1], best[0], start_cost, converged, message, evaluations, time.monotonic() - begin)
