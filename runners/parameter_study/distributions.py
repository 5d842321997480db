"""Distributions of dispersed quantities, their correlation and their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray
from scipy import stats

from ...model.errors import DataError
from .plan import DispersedQuantity, Dispersion
from .quantities import Quantity

NODES = 80  # of the Gauss-Hermite rule, for each of two scores


def marginal(planned: DispersedQuantity, quantity: Quantity) -> Any:
    """Return the distribution of a quantity, a frozen one of scipy.stats.

    Raises
    ------
    DataError
        Limits that leave nothing of a normal distribution.
    """
    low, high = planned.low, planned.high
    if planned.plus_minus is not None:
        centre = quantity.nominal if planned.mean is None else planned.mean
        low, high = centre - planned.plus_minus, centre + planned.plus_minus
    if planned.distribution == "uniform":
        assert low is not None and high is not None  # checked by the plan
        return stats.uniform(low, high - low)
    mean = quantity.nominal if planned.mean is None else planned.mean
    assert planned.sigma is not None  # checked by the plan
    if planned.distribution == "normal":
        return stats.norm(mean, planned.sigma)
    assert low is not None and high is not None
    a, b = (low - mean) / planned.sigma, (high - mean) / planned.sigma
    if stats.norm.cdf(b) - stats.norm.cdf(a) < 1e-6:
        raise DataError(
            f"quantity '{planned.name}' is cut off between {low:g} and {high:g}, where a normal distribution of mean "
            f"{mean:g} and sigma {planned.sigma:g} has almost nothing; correct the limits",
            column="dispersion",
        )
    return stats.truncnorm(a, b, mean, planned.sigma)


def score_correlation(dispersion: Dispersion, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the correlation matrix (d, d) of the normal scores.

    Raises
    ------
    DataError
        Unknown or repeated pairs, or a matrix that is not positive definite.
    """
    names = list(names)
    matrix, given = np.eye(len(names)), set()
    for i, entry in enumerate(dispersion.correlation):
        where = f"dispersion.correlation.{i}"
        for name in entry.between:
            if name not in names:
                raise DataError(f"there is no quantity '{name}'; known: {', '.join(names)}", column=where)
        a, b = sorted(names.index(name) for name in entry.between)
        if a == b or (a, b) in given:
            why = "correlates a quantity with itself" if a == b else "gives a pair of quantities a second time"
            raise DataError(f"{why}; remove it", column=where)
        given.add((a, b))
        matrix[a, b] = matrix[b, a] = entry.coefficient
    values, vectors = np.linalg.eigh(matrix)
    if values[0] < 1e-10:
        worst = [names[k] for k in np.argsort(-np.abs(vectors[:, 0])) if abs(vectors[k, 0]) > 0.2]
        raise DataError(
            f"the correlation matrix is not positive definite (smallest eigenvalue {values[0]:.3g}): the coefficients "
            f"between {', '.join(sorted(worst))} contradict each other; make them smaller",
            column="dispersion.correlation",
        )
    return matrix


def covariance(marginals: Sequence[Any], scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance matrix (d, d) of quantities whose normal scores have the correlation given.

    Of two normal quantities it is the correlation times their sigmas; of others it is integrated over both scores.
    """
    sigma = np.array([m.std() for m in marginals])
    result = np.diag(sigma**2)
    nodes, weights = hermegauss(NODES)
    weights = weights / weights.sum()
    for a in range(len(marginals)):
        for b in range(a):
            r = scores[a, b]
            if r == 0:
                continue
            if all(m.dist.name == "norm" for m in (marginals[a], marginals[b])):
                result[a, b] = result[b, a] = r * sigma[a] * sigma[b]
                continue
            first = quantile(marginals[a], nodes)
            second = quantile(marginals[b], r * nodes[:, None] + np.sqrt(1 - r**2) * nodes)
            first, second = first - weights @ first, second - weights @ second @ weights
            result[a, b] = result[b, a] = weights @ (first[:, None] * second) @ weights
    return result


def quantile(distribution: Any, scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values of a distribution at normal scores (standard normal quantiles), exact in both tails."""
    upper = scores > 0
    tail = stats.norm.sf(np.abs(scores))
    return np.where(upper, distribution.isf(tail), distribution.ppf(tail))
