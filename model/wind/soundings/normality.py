"""How normal measured values are, by level and in their tails, as far as their number can tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, bdtrc, betaincinv, chdtrc, ndtr, ndtri

from .sounding import SoundingError

FEWEST = (
    20  # independent values: below, the transforms to normal scores are no good (D'Agostino, Belanger and D'Agostino)
)
TAIL = 2.0  # standard deviations, where the tails begin
FAR = 3.0


@dataclass(frozen=True, eq=False)
class Normality:
    """Tests of normality of k columns.

    Attributes
    ----------
    skewness, kurtosis : (k,) arrays
        The second in excess of a normal one, 0.
    skewness_score, kurtosis_score : (k,) arrays
        Standard normal if the values are.
    probability : (k,) array
        Of scores at least as far off, by both together (K^2, chi-square of two degrees).
    beyond, far_beyond : (k,) arrays
        Shares of values more than 2 and 3 standard deviations from the mean; 0.0455 and 0.0027 of normal ones.
    tail_probability : (k,) array
        Of a number beyond 2 standard deviations at least as far off, among as many independent values.
    independent : float
    """

    skewness: NDArray[np.float64]
    kurtosis: NDArray[np.float64]
    skewness_score: NDArray[np.float64]
    kurtosis_score: NDArray[np.float64]
    probability: NDArray[np.float64]
    beyond: NDArray[np.float64]
    far_beyond: NDArray[np.float64]
    tail_probability: NDArray[np.float64]
    independent: float


def normality(values: ArrayLike, independent: float | None = None) -> Normality:
    """Test columns of values for normality.

    Skewness and kurtosis are brought to normal scores (D'Agostino 1970; Anscombe and Glynn, Biometrika 70 (1983)
    227-234) as of ``independent`` values and put together (D'Agostino, Belanger and D'Agostino, American Statistician
    44 (1990) 316-321). For values of a process of correlation r from one to the next the number that its variance has,
    n (1 - r^2) / (1 + r^2), is smaller than that of skewness and kurtosis: the tests then say too seldom that values
    are not normal.

    Parameters
    ----------
    values : (n, k) array_like
        NaN where missing.
    independent : float, optional
        Number of independent values; n without it.

    Returns
    -------
    Normality

    Raises
    ------
    SoundingError
        Fewer than 20 independent values.
    """
    x = np.asarray(values, float)
    x = x[:, None] if x.ndim == 1 else x
    count = np.isfinite(x).sum(axis=0)
    least = float(count.min()) if count.size else 0.0
    n = least if independent is None else float(independent)
    if not min(n, least) >= FEWEST:
        raise SoundingError(
            f"{min(n, least):.4g} independent values say nothing of their distribution; give {FEWEST} at least"
        )
    d = x - np.nanmean(x, axis=0)
    m2, m3, m4 = (np.nanmean(d**p, axis=0) for p in (2, 3, 4))
    skewness, kurtosis = m3 / m2**1.5, m4 / m2**2
    by_skewness, by_kurtosis = _skewness_score(skewness, n), _kurtosis_score(kurtosis, n)
    size = np.abs(d) / np.sqrt(m2 * count / (count - 1))
    beyond = np.where(np.isfinite(x), size > TAIL, False).sum(axis=0) / count
    far = np.where(np.isfinite(x), size > FAR, False).sum(axis=0) / count
    trials, p = round(n), 2 * ndtr(-TAIL)
    hits = np.round(beyond * trials)
    one_side = np.minimum(bdtr(hits, trials, p), bdtrc(hits - 1, trials, p))
    return Normality(
        skewness, kurtosis - 3, by_skewness, by_kurtosis, chdtrc(2, by_skewness**2 + by_kurtosis**2), beyond, far,
        np.minimum(2 * one_side, 1.0), n,
    )  # fmt: skip


def _skewness_score(skewness: NDArray[np.float64], n: float) -> NDArray[np.float64]:
    y = skewness * np.sqrt((n + 1) * (n + 3) / (6 * (n - 2)))
    b2 = 3 * (n**2 + 27 * n - 70) * (n + 1) * (n + 3) / ((n - 2) * (n + 5) * (n + 7) * (n + 9))
    w2 = np.sqrt(2 * (b2 - 1)) - 1
    return np.arcsinh(y / np.sqrt(2 / (w2 - 1))) / np.sqrt(0.5 * np.log(w2))


def _kurtosis_score(kurtosis: NDArray[np.float64], n: float) -> NDArray[np.float64]:
    mean = 3 * (n - 1) / (n + 1)
    variance = 24 * n * (n - 2) * (n - 3) / ((n + 1) ** 2 * (n + 3) * (n + 5))
    x = (kurtosis - mean) / np.sqrt(variance)
    b1 = 6 * (n**2 - 5 * n + 2) / ((n + 7) * (n + 9)) * np.sqrt(6 * (n + 3) * (n + 5) / (n * (n - 2) * (n - 3)))
    a = 6 + 8 / b1 * (2 / b1 + np.sqrt(1 + 4 / b1**2))
    root = 1 + x * np.sqrt(2 / (a - 4))
    cube = np.cbrt((1 - 2 / a) / root)
    return (1 - 2 / (9 * a) - cube) / np.sqrt(2 / (9 * a))


def quantile_band(count: int, independent: float, confidence: float = 0.9) -> tuple[NDArray, NDArray, NDArray]:
    """Return the normal quantiles of ordered standard values, and the band that each lies in with a confidence.

    Parameters
    ----------
    count : int
    independent : float
        Number of independent values among them: the band is that of as many.
    confidence : float
        Probability, of each value by itself.

    Returns
    -------
    three (count,) arrays
    """
    p = (np.arange(count) + 0.5) / count
    a, b = p * independent + 0.5, (1 - p) * independent + 0.5
    ends = (betaincinv(a, b, q) for q in (0.5 * (1 - confidence), 0.5 * (1 + confidence)))
    low, high = (ndtri(np.clip(end, 1e-12, 1 - 1e-12)) for end in ends)
    return ndtri(p), low, high


def skewed_level(mean: ArrayLike, std: ArrayLike, skewness: ArrayLike, kurtosis: ArrayLike, k: float) -> NDArray:
    """Return the level that a nearly normal quantity passes as seldom as a normal one passes mean + k std.

    By the expansion of Cornish and Fisher (1938) to second order; ``kurtosis`` is the excess. Good for small skewness
    and kurtosis only.
    """
    g, e = np.asarray(skewness, float), np.asarray(kurtosis, float)
    shift = (k**2 - 1) * g / 6 + (k**3 - 3 * k) * e / 24 - (2 * k**3 - 5 * k) * g**2 / 36
    return np.asarray(mean, float) + np.asarray(std, float) * (k + shift)
