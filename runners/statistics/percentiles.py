"""Levels of a normal response at an instant for any probability, on one side or both, and how well they are known."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, chdtri, log_ndtr, ndtri_exp

from ...model.errors import ParameterValueError, UnknownNameError

Sides = Literal["both", "upper", "lower"]
HALVINGS = 60
MOST_RUNS = 10**9
MOST_SAMPLES = 1e6  # for which the noncentral t is computed; beyond, the delta method is as good and does not fail


def checked_probabilities(probabilities: float | Iterable[float]) -> tuple[float, ...]:
    """Return probabilities as they are given.

    Raises
    ------
    ParameterValueError
        None is given, or one is not between 0 and 1.
    """
    given = [probabilities] if isinstance(probabilities, int | float) else probabilities
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterValueError(f"{given!r} is no list of probabilities; give numbers, such as [0.00135]")
    found = []
    for p in given:
        try:
            value = float(p)
        except (TypeError, ValueError):
            raise ParameterValueError(f"{p!r} is not a probability; give a number between 0 and 1") from None
        if not 0.0 < value < 1.0:
            raise ParameterValueError(
                f"a probability of {value:g} has no level; give one between 0 and 1, such as 0.00135"
            )
        found.append(value)
    if not found:
        raise ParameterValueError("no probability was given; 0.00135 is that of mean + 3 sigma at an instant")
    return tuple(dict.fromkeys(found))


def checked_sides(sides: str) -> Sides:
    """Return the sides asked for.

    Raises
    ------
    UnknownNameError
    """
    known: tuple[Sides, ...] = get_args(Sides)
    if sides not in known:
        raise UnknownNameError("choice of sides", str(sides), known)
    return known[known.index(sides)]


def instant_level(mean: ArrayLike, std: ArrayLike, probability: float, sides: Sides = "both") -> NDArray[np.float64]:
    """Return the level that a normal response passes with a probability at one instant.

    Parameters
    ----------
    mean, std : array_like
    probability : float
        Between 0 and 1.
    sides : {'both', 'upper', 'lower'}
        P(\\|y\\| > L), P(y > L) or P(-y > L) is the probability. With 'both' and a large mean it is nearly that of
        the larger side alone, with a mean of zero half of it falls on each.

    Returns
    -------
    array
        The mean's size where the response does not vary.

    Raises
    ------
    ParameterValueError
        The probability is not between 0 and 1.
    """
    if not 0.0 < probability < 1.0:
        raise ParameterValueError(f"a probability of {probability:g} has no level; give one between 0 and 1")
    m, s = np.broadcast_arrays(np.asarray(mean, float), np.asarray(std, float))
    target = np.log(probability)
    z = -float(ndtri_exp(target))
    if sides != "both":
        return (m if sides == "upper" else -m) + z * s
    size = np.abs(m)
    varies = s > 0
    unit = np.where(varies, s, 1.0)
    # bisection in multiples of sigma: the level of the larger side alone is too low, that of half the chance too high
    low = np.maximum(size / unit + z, 0.0)
    high = size / unit - float(ndtri_exp(target - np.log(2.0)))
    high = np.maximum(high, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        passed = np.logaddexp(log_ndtr(size / unit - middle), log_ndtr(-size / unit - middle))
        low, high = np.where(passed > target, middle, low), np.where(passed > target, high, middle)
    return np.where(varies, 0.5 * (low + high) * s, size)


def std_sampling_interval(std: float, samples: float, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of a standard deviation that a number of independent profiles leaves open.

    The variance from a wind of which N independent normal profiles are known is chi-square with N - 1 degrees, for any
    fixed weighting and any number of levels.

    Parameters
    ----------
    std : float
        Computed with the sample covariance.
    samples : float
        N.
    confidence : float

    Returns
    -------
    low, high : float

    Raises
    ------
    ParameterValueError
        Fewer than two samples, or a confidence that is none.
    """
    degrees = _degrees(samples, confidence)
    low, high = chdtri(degrees, [0.5 * (1 - confidence), 0.5 * (1 + confidence)])
    return float(std * np.sqrt(degrees / low)), float(std * np.sqrt(degrees / high))


def level_sampling_interval(
    mean: float, wind_std: float, other_std: float, sigmas: float, samples: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the interval of mean + k sigma that a number of independent profiles leaves open.

    Of the wind alone the two limits are those of the noncentral t distribution; with other sources, whose spread is
    taken as known, by the delta method: var(L) = sigma_w^2 / N + (k sigma_w / sigma)^2 sigma_w^2 / (2 (N - 1)).

    Parameters
    ----------
    mean : float
        On the side of the level, so that the level is mean + k sigma.
    wind_std, other_std : float
    sigmas : float
        k.
    samples : float
        N.
    confidence : float

    Returns
    -------
    low, high : float

    Raises
    ------
    ParameterValueError
    """
    degrees = _degrees(samples, confidence)
    if other_std == 0 and samples <= MOST_SAMPLES:
        from scipy.stats import nct  # takes a third of a second to import, and nobody else here needs it

        noncentral = sigmas * np.sqrt(samples)
        at = nct.ppf([0.5 * (1 - confidence), 0.5 * (1 + confidence)], degrees, noncentral)
        low, high = mean + wind_std * at / np.sqrt(samples)
        return float(low), float(high)
    total = np.hypot(wind_std, other_std)
    if wind_std == 0:
        return float(mean + sigmas * total), float(mean + sigmas * total)
    spread = wind_std * np.sqrt(1 / samples + (sigmas * wind_std / total) ** 2 / (2 * degrees))
    half = -float(ndtri_exp(np.log(0.5 * (1 - confidence)))) * spread
    level = mean + sigmas * total
    return float(level - half), float(level + half)


def _degrees(samples: float, confidence: float) -> float:
    if not (samples > 1 and np.isfinite(samples)):
        raise ParameterValueError(f"{samples:g} independent profiles tell nothing of a spread; give more than one")
    if not 0.0 < confidence < 1.0:
        raise ParameterValueError(f"a confidence of {confidence:g} is none; give one between 0 and 1, such as 0.95")
    return samples - 1.0


def monte_carlo_runs(probability: float, risk: float = 0.10, failures: int = 0) -> int:
    """Return the number of simulated flights that would show as much.

    The smallest n such that with at most ``failures`` of n flights beyond a level, the chance of that level being
    passed more often than ``probability`` is accepted wrongly with a consumer's risk of ``risk``: by order statistics,
    sum over j <= failures of binom(n, j) p^j (1 - p)^(n - j) <= risk. 0.00135 at 10 % is 1705 without a failure.

    Parameters
    ----------
    probability : float
    risk : float
    failures : int

    Returns
    -------
    int

    Raises
    ------
    ParameterValueError
        A probability or risk not between 0 and 1, or a negative number of failures.
    """
    if not (0.0 < probability < 1.0 and 0.0 < risk < 1.0):
        raise ParameterValueError("a probability and a risk lie between 0 and 1")
    if not (np.isfinite(failures) and failures >= 0 and failures == int(failures)):
        raise ParameterValueError(f"{failures} failures cannot be counted; give a whole number of 0 or more")
    if failures == 0:
        runs = float(np.log(risk)) / float(np.log1p(-probability))  # (1 - p)^n <= risk
        if not np.isfinite(runs):
            raise ParameterValueError(f"a probability of {probability:g} asks for more runs than can be counted")
        return int(np.ceil(runs))
    low, high = int(failures), int(failures) + 1
    while bdtr(failures, high, probability) > risk:
        low, high = high, 2 * high
        if high > MOST_RUNS:
            raise ParameterValueError(f"a probability of {probability:g} asks for more than a billion runs")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if bdtr(failures, middle, probability) > risk else (low, middle)
    return high
