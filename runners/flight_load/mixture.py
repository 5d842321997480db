"""The mixture of importance sampling: which of its places draws take, and how far beyond each they go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri_exp


def drawn_places(
    log_probability: NDArray[np.float64], log_sum: float, random: np.random.Generator, count: int
) -> tuple[tuple[NDArray[np.intp], ...], NDArray[np.float64]]:
    """Return the places that draws take, an array (count,) an axis, and their standard deviates beyond them (count,).

    Parameters
    ----------
    log_probability : array
        Of being beyond the bound at each place.
    log_sum : float
        Logarithm of the sum of all; finite.
    random : Generator
    count : int
    """
    cumulative = np.cumsum(np.exp(log_probability - log_sum).ravel())
    spread = (np.arange(count) + random.random(count)) / count * cumulative[-1]
    chosen = np.minimum(np.searchsorted(cumulative, spread, side="right"), cumulative.size - 1)
    places = np.unravel_index(chosen, log_probability.shape)
    return places, -ndtri_exp(log_probability[places] + np.log1p(-random.random(count)))
