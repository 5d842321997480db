"""Members of parameter studies: distributions, correlation and covariance against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from lag import GAIN, TAU, dispersion, lag, normal, plan
from scipy import stats

from ascentwind.model.errors import DataError
from ascentwind.runners.parameter_study.distributions import covariance, marginal, score_correlation
from ascentwind.runners.parameter_study.plan import read_plan
from ascentwind.runners.parameter_study.quantities import resolve_quantities
from ascentwind.runners.parameter_study.sampling import UnbalancedSampleWarning, member_values

TRUNCATED = {"name": "gain", "distribution": "truncated_normal", "sigma": 1.0, "low": 2.5, "high": 5.0}
UNIFORM = {"name": "level", "distribution": "uniform", "low": 1.0, "high": 3.0}


@pytest.fixture(scope="module")
def study(cache):
    return lag()


def values(study, given: dict) -> np.ndarray:
    read = read_plan(given)
    return member_values(read, resolve_quantities(study, read))


@pytest.mark.parametrize("sampling", ["random", "latin_hypercube", "sobol"])
def test_margins_are_the_distributions_asked_for(study, sampling):
    found = values(study, dispersion(2048, normal("tau", 0.2), TRUNCATED, UNIFORM, sampling=sampling))
    a, b = (2.5 - GAIN) / 1.0, (5.0 - GAIN) / 1.0
    exact = (stats.norm(TAU, 0.2), stats.truncnorm(a, b, GAIN, 1.0), stats.uniform(1.0, 2.0))
    for k, distribution in enumerate(exact):
        assert stats.kstest(found[:, k], distribution.cdf).pvalue > 0.01
        allowed = 4 * distribution.std() / np.sqrt(2048) * (1.0 if sampling == "random" else 0.1)
        assert abs(found[:, k].mean() - distribution.mean()) < allowed
    assert found[:, 1].min() >= 2.5
    assert found[:, 1].max() <= 5.0


def test_seed_decides(study):
    first, same, other = (values(study, dispersion(64, normal("tau", 0.2), seed=s)) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert (first != other).all()


def test_sobol_of_another_size_warns(study):
    with pytest.warns(UnbalancedSampleWarning, match="100 members is not balanced; take 64 or 128"):
        values(study, dispersion(100, normal("tau", 0.2), sampling="sobol"))


def test_correlation_of_samples_and_covariance_against_closed_forms(study):
    """Two uniform quantities of score correlation r have the correlation 6/pi asin(r/2)."""
    r = 0.7
    uniform = [{"name": n, "distribution": "uniform", "low": 0.0, "high": 1.0} for n in ("tau", "gain")]
    pair = [{"between": ["tau", "gain"], "coefficient": r}]
    given = dispersion(4096, *uniform, normal("level", 2.0), correlation=pair, sampling="sobol")
    read = read_plan(given)
    quantities = resolve_quantities(study, read)
    assert read.dispersion is not None
    marginals = [marginal(p, q) for p, q in zip(read.dispersion.quantity, quantities, strict=True)]
    matrix = covariance(marginals, score_correlation(read.dispersion, [q.name for q in quantities]))
    exact = 6 / np.pi * np.arcsin(r / 2)
    assert matrix[0, 1] * 12 == pytest.approx(exact, rel=2e-4)  # the rule's error at the kinks of the distribution
    assert matrix[2, 2] == pytest.approx(4.0)
    assert matrix[0, 2] == 0.0
    sampled = np.corrcoef(values(study, given).T)
    assert sampled[0, 1] == pytest.approx(exact, abs=0.01)
    assert abs(sampled[0, 2]) < 0.01


def test_normal_covariance_is_correlation_times_sigmas(study):
    pair = [{"between": ["gain", "tau"], "coefficient": -0.4}]
    given = dispersion(4096, normal("tau", 0.2), normal("gain", 0.5), correlation=pair, sampling="sobol")
    assert np.cov(values(study, given).T)[0, 1] == pytest.approx(-0.4 * 0.2 * 0.5, rel=0.03)


def test_grid_and_one_at_a_time(study):
    grid = plan(grid={"quantity": [{"name": "tau", "values": [1.0, 4.0]}, {"name": "gain", "linspace": [0, 1, 3]}]})
    expected = [[1, 0], [1, 0.5], [1, 1], [4, 0], [4, 0.5], [4, 1]]
    np.testing.assert_array_equal(values(study, grid), expected)
    quantities = [{"name": "tau", "plus_minus": 0.5}, {"name": "g", "parameters": ["gain"], "low": 2.0, "high": 5.0}]
    found = values(study, plan(one_at_a_time={"quantity": quantities}))
    np.testing.assert_array_equal(found, [[1.5, GAIN], [2.5, GAIN], [TAU, 2.0], [TAU, 5.0]])


def test_numbers_that_leave_no_finite_value_are_refused(study):
    with pytest.raises(DataError, match=r"dispersion.quantity.0.*'tau' takes values that are not finite"):
        values(study, dispersion(1000, normal("tau", 1e308)))


def test_limits_that_leave_nothing_are_refused(study):
    far = TRUNCATED | {"low": 50.0, "high": 60.0}
    with pytest.raises(DataError, match=r"'gain' is cut off between 50 and 60.*almost nothing"):
        values(study, dispersion(10, far))
