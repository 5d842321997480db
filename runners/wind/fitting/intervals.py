"""Confidence intervals of variances and covariances estimated from independent samples of a normal vector."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincinv

from ....model.errors import DataError


def covariance_interval(
    covariance: ArrayLike, samples: float, confidence: float = 0.90
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper confidence limits of every entry of a sample covariance matrix.

    On the diagonal this is the chi-square interval of a variance, as the report takes it (3.4.7):
    (N - 1) s^2 / chi2. For x and y scaled to unit variance, cov(x, y) = (var(x + y) - var(x - y)) / 4, and x + y and
    x - y are independent, each variance with its chi-square interval. Zou and Donner (Statistics in Medicine 27
    (2008) 1693-1702) combine the two into an interval of the difference, which on the diagonal is the former again.

    Parameters
    ----------
    covariance : (k, k) array
    samples : float
        Independent samples N.
    confidence : float
        Two-sided, such as 0.90.

    Returns
    -------
    low, high : (k, k) arrays
    """
    matrix = np.asarray(covariance, float)
    if not samples > 2 or not 0 < confidence < 1:
        raise DataError(
            f"an interval needs more than two samples and a confidence below 1, not {samples:g}, {confidence:g}"
        )
    freedom = samples - 1
    sigma = np.sqrt(np.diag(matrix))
    scale = np.outer(sigma, sigma)
    r = np.clip(matrix / scale, -1.0, 1.0)
    factor_low = freedom / (2 * gammaincinv(0.5 * freedom, 0.5 + confidence / 2))
    factor_high = freedom / (2 * gammaincinv(0.5 * freedom, 0.5 - confidence / 2))
    plus, minus = (1 + r) / 2, (1 - r) / 2
    down, up = 1 - factor_low, factor_high - 1
    low = r - np.sqrt((down * plus) ** 2 + (up * minus) ** 2)
    high = r + np.sqrt((up * plus) ** 2 + (down * minus) ** 2)
    return low * scale, high * scale


def share_inside(
    covariance: ArrayLike, sample_covariance: ArrayLike, samples: float, confidence: float = 0.90
) -> float:
    """Return the share of the distinct entries of ``covariance`` that lie inside the interval of the samples."""
    low, high = covariance_interval(sample_covariance, samples, confidence)
    matrix = np.asarray(covariance, float)
    upper = np.triu_indices(len(matrix))
    inside = (matrix >= low) & (matrix <= high)
    return float(inside[upper].mean())
