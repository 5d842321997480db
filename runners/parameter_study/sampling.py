"""The members of a parameter study: which values every quantity takes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ...model.errors import AscentwindWarning, DataError
from .distributions import marginal, quantile, score_correlation
from .plan import Dispersion, ParameterStudyPlan
from .quantities import Quantity


class UnbalancedSampleWarning(AscentwindWarning):
    """A Sobol sample whose size is not a power of two loses its balance."""


def member_values(plan: ParameterStudyPlan, quantities: Sequence[Quantity]) -> NDArray[np.float64]:
    """Return the values of all members, (members, quantities).

    Raises
    ------
    DataError
        Also for numbers of the plan whose spread leaves no finite value.

    Warns
    -----
    UnbalancedSampleWarning
    """
    with np.errstate(over="ignore", invalid="ignore"):
        values = _values(plan, quantities)
    if (bad := ~np.isfinite(values)).any():
        k = int(np.argmax(bad.any(axis=0)))
        raise DataError(
            f"'{quantities[k].name}' takes values that are not finite; give smaller numbers",
            column=f"{plan.kind}.quantity.{k}",
        )
    return values


def _values(plan: ParameterStudyPlan, quantities: Sequence[Quantity]) -> NDArray[np.float64]:
    if plan.grid is not None:
        return np.array(list(product(*(q.axis() for q in plan.grid.quantity))))
    if plan.one_at_a_time is not None:
        nominal = np.array([q.nominal for q in quantities])
        rows = np.tile(nominal, (2 * nominal.size, 1))
        for k, planned in enumerate(plan.one_at_a_time.quantity):
            ends = (planned.low, planned.high)
            if planned.plus_minus is not None:
                ends = (nominal[k] - planned.plus_minus, nominal[k] + planned.plus_minus)
            rows[2 * k : 2 * k + 2, k] = ends
        return rows
    assert plan.dispersion is not None  # a plan has one of the three
    marginals = [marginal(planned, q) for planned, q in zip(plan.dispersion.quantity, quantities, strict=True)]
    return dispersed(plan.dispersion, marginals, score_correlation(plan.dispersion, [q.name for q in quantities]))


def dispersed(
    dispersion: Dispersion, marginals: Sequence[Any], correlation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return random members, (members, quantities): normal scores, correlated, then put on the distributions."""
    uniform = _uniform(dispersion, len(marginals))
    scores = np.asarray(stats.norm.ppf(uniform) @ np.linalg.cholesky(correlation).T, float)
    return np.stack([quantile(m, scores[:, k]) for k, m in enumerate(marginals)], axis=1)


def _uniform(dispersion: Dispersion, dimensions: int) -> NDArray[np.float64]:
    """Return points inside the unit cube, (members, dimensions)."""
    count, random = dispersion.members, np.random.default_rng(dispersion.seed)
    if dispersion.sampling == "random":
        points = random.random((count, dimensions))
    elif dispersion.sampling == "latin_hypercube":
        points = stats.qmc.LatinHypercube(dimensions, rng=random).random(count)
    else:
        if count & (count - 1):
            power = 2 ** (count.bit_length() - 1)
            warnings.warn(
                UnbalancedSampleWarning(
                    f"a Sobol sample of {count} members is not balanced; take {power} or {2 * power}"
                ),
                stacklevel=2,
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # SciPy's words for the same
            points = stats.qmc.Sobol(dimensions, rng=random).random(count)
    tiny = np.finfo(float).tiny
    return np.clip(points, tiny, 1 - np.finfo(float).epsneg)
