"""Rice's rate of upcrossings, of responses that are differentiable: a bound of the flight's probability, and a check.

The rate v = dy/dt = (C A + dC/dt) x + C B n has a variance only where C B = 0. With the mean m, the standard deviation
s of y and, given y = u, the mean a and the standard deviation b of v, the level u is crossed upward at the rate

    nu(u, t) = phi((u - m) / s) / s  [a Phi(a / b) + b phi(a / b)],

of a process that is not stationary too (Cramer and Leadbetter, Stationary and Related Stochastic Processes, 1967,
section 13.2; Rice 1945 for a stationary one of mean zero). A flight that passes u begins beyond it or crosses it at
least once: P <= P(y(t0) > u) + integral of nu dt.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtr

from ...model.errors import AscentwindError, ParameterValueError
from ..statistics.percentiles import Sides
from .response import ResponseInWindow


class NotDifferentiableError(AscentwindError):
    """White noise reaches the rate of a response: its variance is infinite, and so is the rate of upcrossings."""


def upcrossing_rate(of: ResponseInWindow, level: float, sides: Sides) -> xr.DataArray:
    """Return the rate at which a response passes a level outward, s^-1, (time,).

    A jump of the outputs' equations is taken as a ramp over two steps of the grid.

    Parameters
    ----------
    of : ResponseInWindow
    level : float
        In the unit of the response.
    sides : {'both', 'upper', 'lower'}

    Returns
    -------
    xarray.DataArray
        Attributes: ``start_probability`` of being beyond it at the begin of the window, and ``probability_bound``, that
        and the integral of the rate: the flight passes the level no more often.

    Raises
    ------
    NotDifferentiableError
    """
    if of.is_resultant:
        raise ParameterValueError(
            f"'{of.response}' is a resultant, whose upcrossings have no formula here; ask for the probability itself"
        )
    chain, (row,) = of.chain, of.rows
    C, times, mean = chain.output[:, row], chain.times, chain.mean[:, row]
    rough = np.flatnonzero(np.any(np.einsum("mi,min->mn", C, chain.noise_matrix), axis=1))
    if rough.size:
        raise NotDifferentiableError(
            f"white noise reaches the rate of '{of.response}' directly at t = {times[rough[0]]:.6g} s (C B != 0): the "
            "variance of its rate is infinite, and so is that of crossing a level; ask for the probability itself, "
            "which holds for rough responses too"
        )
    P = chain.covariance()
    K = np.einsum("mi,mij->mj", C, chain.state_matrix) + np.gradient(C, times, axis=0)
    seen = np.einsum("mij,mj->mi", P, C)
    variance, common = np.einsum("mi,mi->m", C, seen), np.einsum("mi,mi->m", K, seen)
    of_rate = np.einsum("mi,mij,mj->m", K, P, K)
    mean_rate = np.gradient(mean, times)
    moments = (variance, common, of_rate)
    rate, start = np.zeros(times.size), 0.0
    for side, sign in (("upper", 1.0), ("lower", -1.0)):
        if sides in (side, "both"):
            rate += _upward(level, sign * mean, sign * mean_rate, *moments)
            std = float(np.sqrt(max(variance[0], 0.0)))
            away = sign * float(mean[0]) - level
            start += float(ndtr(away / std)) if std > 0 else float(away > 0)
    return xr.DataArray(
        rate,
        {"time": ("time", times, {"units": "s", "long_name": "flight time"})},
        ("time",),
        "upcrossing_rate",
        {
            "units": "s^-1",
            "long_name": "rate of passing the level outward",
            "level": level,
            "start_probability": start,
            "probability_bound": start + float(np.trapezoid(rate, times)),
        },
    )


def _upward(
    level: float,
    mean: NDArray[np.float64],
    mean_rate: NDArray[np.float64],
    variance: NDArray[np.float64],
    common: NDArray[np.float64],
    of_rate: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the rate of upcrossings from the moments of a response and its rate, (m,); zero where it does not vary."""
    varies = variance > 0
    s2 = np.where(varies, variance, 1.0)
    away = (level - mean) / np.sqrt(s2)
    a = mean_rate + common / s2 * (level - mean)
    b = np.sqrt(np.maximum(of_rate - common**2 / s2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(b > 0, a / b, np.copysign(np.inf, a))
    outward = a * ndtr(ratio) + b * _normal_density(ratio)
    return np.where(varies, _normal_density(away) / np.sqrt(s2) * outward, 0.0)


def _normal_density(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi)
