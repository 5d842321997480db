"""The report's own optimisation algorithm (Appendix C), kept to compare its cost with least squares."""

from __future__ import annotations

import time

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...solvers.least_squares import Fit, FitError, FitOptions

FIRST_STEP = 0.1  # of the size of the unknowns, as the report's 10 %
LEAST_STEP = 1e-6
HELD = 0.1  # share of the correction at which it is held after the first success


def search_appendix_c(
    cost_and_gradient: ca.Function,
    start: NDArray[np.float64],
    groups: NDArray[np.int_],
    options: FitOptions,
    data: NDArray[np.float64],
) -> Fit:
    """Descend along a correction vector, one set of coefficients after the other dropping out.

    The correction is tried and halved with its sign reversed until it lowers the sum of squares, then held at a tenth
    of itself as long as it does. Then the set of coefficients with the largest partial derivatives is left out and the
    rest tried, until one set is left; then new derivatives are taken. They are CasADi's here, where the report changed
    each coefficient by 10 %.

    Parameters
    ----------
    cost_and_gradient : Function
        (unknowns, data) -> half the sum of squared errors, gradient.
    groups : (n,) array
        Set of each unknown: A, B, psi, alpha_1, alpha_2, omega.
    """
    begin, evaluations = time.monotonic(), 0

    def cost(at: NDArray) -> float:
        nonlocal evaluations
        evaluations += 1
        found = float(cost_and_gradient(at, data)[0])
        if options.progress is not None:
            options.progress(evaluations, found)
        return found if np.isfinite(found) else np.inf

    x = np.asarray(start, float)
    best = first = cost(x)
    if not np.isfinite(first):
        raise FitError("the residuals are not finite at the start; check the statistics")
    message = f"stopped after the time limit of {options.time_limit:g} s"
    converged = False
    while time.monotonic() - begin < options.time_limit:
        before = best
        partial = np.array(cost_and_gradient(x, data)[1]).ravel()
        remaining = list(np.unique(groups))
        while remaining:
            inside = np.isin(groups, remaining)
            largest = np.abs(partial[inside]).max()
            if largest == 0:
                break
            step = -FIRST_STEP * np.where(inside, partial, 0.0) / largest * np.maximum(1.0, np.abs(x))
            scale = 1.0
            while abs(scale) > LEAST_STEP and cost(x + scale * step) >= best:
                scale *= -0.5
            if abs(scale) > LEAST_STEP:
                x = x + scale * step
                best = cost(x)
                while (lower := cost(x + HELD * scale * step)) < best:
                    x, best = x + HELD * scale * step, lower
            sizes = {g: np.abs(partial[groups == g]).max() for g in remaining}
            remaining.remove(max(sizes, key=lambda g: sizes[g]))
        if before - best <= options.tolerance * before:
            converged, message = True, "no set of coefficients lowers the cost any further"
            break
    return Fit(x, best, first, converged, message, evaluations, time.monotonic() - begin)
