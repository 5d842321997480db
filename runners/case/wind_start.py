"""Covariance of the wind filter's states at the altitude where the flight starts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ...model.wind.shaping_filter import ShapingFilter
from ..solvers.step_budget import at_most

MOST_STEPS = 2000  # AS-504 takes 10


def covariance_at(shaping_filter: ShapingFilter, altitude: float) -> NDArray[np.float64]:
    """Propagate dP/dh = F P + P F' + G G' from the filter's first altitude; below it the start covariance holds.

    Parameters
    ----------
    shaping_filter : ShapingFilter
    altitude : float
        m.

    Returns
    -------
    (n, n) array
    """
    n, bottom = shaping_filter.order, float(shaping_filter.altitude[0])
    start = shaping_filter.start_covariance
    if altitude <= bottom:
        return start

    def rate(h: float, p: NDArray) -> NDArray:
        F, G, _ = shaping_filter.at(h)
        P = p.reshape(n, n)
        return (F @ P + P @ F.T + G @ G.T).ravel()

    edges = [bottom, *(k for k in shaping_filter.kinks if bottom < k < altitude), altitude]
    P, budgeted = start.ravel(), at_most(rate, MOST_STEPS, "an altitude of {:.4g} m of the wind filter")
    for low, high in pairwise(edges):
        P = solve_ivp(budgeted, (low, high), P, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    P = P.reshape(n, n)
    return 0.5 * (P + P.T)
