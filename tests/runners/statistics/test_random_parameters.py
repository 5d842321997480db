"""Random sets of AS-504's parameters: sweep, CVODES and covariance equation against each other, or a warning."""

from __future__ import annotations

import os
import warnings

import numpy as np
import pytest

from ascentwind.model.errors import UnstableSystemWarning
from ascentwind.runners import CovarianceEquation, Study

SETS = int(os.environ.get("ASCENTWIND_TEST_SETS", "10"))
SPREAD = 0.5  # either way, of every number
AGREEMENT = 1e-4
EVERY = 5  # of the sets goes through the covariance equation too, which takes as long as all else


def random_set(study: Study, random: np.random.Generator) -> dict[str, float]:
    """Return all numbers of a study, each by itself within its spread."""
    factors = 1 + random.uniform(-SPREAD, SPREAD, len(study.parameters))
    return {name: p.value * f for (name, p), f in zip(study.parameters.items(), factors, strict=True)}


def furthest(study: Study, times: list[float], others: list) -> float:
    """Return the largest difference of a standard deviation or |mean| + 3 sigma, relative to the larger of both."""
    swept = study.response_statistics(times, engine="sweep")
    worst = 0.0
    for engine in others:
        other = study.response_statistics(times, engine=engine)
        sides = [abs(s.mean.values) + 3 * s.std.values for s in (swept, other)]
        for one, two in ((swept.std.values, other.std.values), sides):
            size = np.maximum(np.abs(one), np.abs(two))
            worst = max(worst, float((np.abs(one - two) / np.where(size > 0, size, 1.0)).max()))
    return worst


@pytest.mark.slow
def test_engines_agree_for_random_parameters(as504):
    """None is refused; a set that makes the vehicle unstable says so."""
    random, found, unstable = np.random.default_rng(1969), [], 0
    for number in range(SETS):
        study = as504.with_parameters(random_set(as504, random))
        times = sorted(float(t) for t in random.uniform(40.0, 140.0, 2).round(2))
        others = ["cvodes", *([CovarianceEquation()] if number % EVERY == 0 else [])]
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", UnstableSystemWarning)
            found.append(furthest(study, times, others))
        warned = any(issubclass(w.category, UnstableSystemWarning) for w in said)
        unstable += warned
        assert found[-1] < AGREEMENT or warned, (number, found[-1])
    print(f"{SETS} sets, {unstable} unstable: {max(found):.2g} at most, {np.median(found):.2g} median")
    assert unstable < SETS
