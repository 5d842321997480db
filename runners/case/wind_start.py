"""Covariance of the wind filter's states at the altitude where the flight starts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...model.errors import StepBudgetError
from ...model.wind.propagation import transitions
from ...model.wind.shaping_filter import ShapingFilter

MOST_HALVINGS = 10  # AS-504 takes 2
ACCURACY = 1e-12


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

    Raises
    ------
    StepBudgetError
        A filter that is far too fast.
    """
    samples = shaping_filter.altitude
    if altitude <= samples[0]:
        return shaping_filter.start_covariance
    P = shaping_filter.start_covariance
    for low, high in pairwise([*samples[samples < altitude], altitude]):  # between which coefficients are smooth
        P = _carried(shaping_filter, P, float(low), float(high))
    return 0.5 * (P + P.T)


def _carried(shaping_filter: ShapingFilter, start: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    """Return the covariance carried by Magnus steps, halved and continued to steps of no length (Richardson)."""
    coarser: list[NDArray] = []
    for halvings in range(MOST_HALVINGS + 1):
        P = start
        with np.errstate(all="ignore"):
            for phi, added in zip(*transitions(shaping_filter, np.linspace(low, high, 2**halvings + 1)), strict=True):
                P = phi @ P @ phi.T + added
            finer = [P]
            for k, before in enumerate(coarser):  # the errors of symmetric steps: of orders 4, 6, 8 ...
                finer.append(finer[-1] + (finer[-1] - before) / (2.0 ** (4 + 2 * k) - 1))
        for better, before in zip(finer[:0:-1], coarser[::-1], strict=True):  # steps far too long spoil the last alone
            deviation = np.sqrt(np.maximum(np.maximum(np.diag(better), np.diag(start)), 0.0))
            if (np.abs(better - before) <= ACCURACY * np.outer(deviation, deviation)).all():
                return better
        coarser = finer
    raise StepBudgetError(2**MOST_HALVINGS, f"an altitude of {low:.4g} m of the wind filter")
