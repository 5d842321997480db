"""The norm of two normal responses: closed forms, simulation, bounds, derivatives, direction, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ive
from scipy.stats import ncx2, norm

from ascentwind.model.errors import ParameterValueError
from ascentwind.runners.statistics.norm import LIKE_3_SIGMA, NormOfNormal

PROBABILITIES = [0.9, 0.5, 0.1, LIKE_3_SIGMA, 1e-6, 1e-12]


def made(mean, s1, s2, turn=0.0) -> NormOfNormal:
    """Return a norm whose principal axes with the deviations s1, s2 are turned by an angle, the mean with them."""
    Q = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return NormOfNormal(Q @ np.asarray(mean, float), Q @ np.diag([s1**2, s2**2]) @ Q.T)


def polar_exceedance(mean, s1, s2, level) -> float:
    """P(|M| > level) by the radius first, in closed form, then the direction by equal steps: another integral."""
    angle = np.arange(20_000) * 2 * np.pi / 20_000
    c, s = np.cos(angle), np.sin(angle)
    a = c**2 / s1**2 + s**2 / s2**2
    b = c * mean[0] / s1**2 + s * mean[1] / s2**2
    rest = (mean[0] / s1) ** 2 + (mean[1] / s2) ** 2 - b**2 / a
    at = level - b / a
    inner = np.exp(-0.5 * a * at**2) / a + b / a * np.sqrt(2 * np.pi / a) * norm.sf(at * np.sqrt(a))
    return float((np.exp(-0.5 * rest) * inner).mean() / (s1 * s2))


@pytest.mark.parametrize("p", PROBABILITIES)
def test_equal_deviations_without_mean_are_rayleigh(p):
    assert made([0, 0], 3.0, 3.0).percentile(p) == pytest.approx(3.0 * np.sqrt(-2 * np.log(p)), rel=1e-10)


@pytest.mark.parametrize("p", PROBABILITIES)
@pytest.mark.parametrize("size", [0.1, 1.0, 5.0, 50.0, 1e4])
def test_equal_deviations_with_mean_are_rice(p, size):
    found = made([0.6 * size, 0.8 * size], 1.0, 1.0, turn=1.0).percentile(p)
    assert ncx2.sf(found**2, 2, size**2) == pytest.approx(p, rel=1e-10)


@pytest.mark.parametrize("p", PROBABILITIES)
@pytest.mark.parametrize("mean", [0.0, 0.7, -4.0])
@pytest.mark.parametrize("s2", [0.0, 1e-13, 1e-9])
def test_one_response_that_does_not_vary_is_the_folded_normal(p, mean, s2):
    found = float(made([mean, 0.0], 1.5, s2, turn=0.3).percentile(p))
    beyond = norm.sf((found - mean) / 1.5) + norm.cdf((-found - mean) / 1.5)
    assert beyond == pytest.approx(p, rel=1e-10)


@pytest.mark.parametrize("p", PROBABILITIES)
@pytest.mark.parametrize("s2", [0.02, 0.3, 0.9])
def test_hoyt(p, s2):
    found = float(made([0, 0], 1.0, s2, turn=2.0).percentile(p))
    assert polar_exceedance([0, 0], 1.0, s2, found) == pytest.approx(p, rel=1e-10)


@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(0.05, 1.0), st.floats(0, 3.1), st.sampled_from(PROBABILITIES))
def test_any_mean_and_covariance(a1, a2, s2, turn, p):
    found = float(made([a1, a2], 1.0, s2, turn).percentile(p))
    assert polar_exceedance([a1, a2], 1.0, s2, found) == pytest.approx(p, rel=1e-10)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.0, 1.0), st.floats(0.0, 3.1), st.floats(1e-9, 1e9))
def test_turned_and_scaled(a1, a2, s2, turn, unit):
    one = float(made([a1, a2], 1.0, s2).percentile())
    assert made([unit * a1, unit * a2], unit, unit * s2, turn).percentile() == pytest.approx(unit * one, rel=1e-11)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.0, 1.0))
def test_bounds(a1, a2, s2):
    """Between the farthest half-plane of the same probability and the union of the two responses' sides."""
    n = made([a1, a2], 1.0, s2)
    angle = np.linspace(0, 2 * np.pi, 721)
    e = np.stack([np.cos(angle), np.sin(angle)])
    support = e.T @ n.mean + 3 * np.sqrt(np.einsum("it,ij,jt->t", e, n.covariance, e))
    crude = np.hypot(abs(a1) + 3.3, abs(a2) + 3.3 * s2)  # |x| and |y| each beyond with less than half the chance
    assert support.max() * (1 - 1e-12) <= n.percentile() <= crude


def test_second_moment_is_the_integral_of_the_exceedance():
    n = made([0.4, -1.1], 1.3, 0.2, 0.7)
    level = np.linspace(0, 12, 4801)
    beyond = NormOfNormal(*(np.array([x] * 4801) for x in (n.mean, n.covariance))).exceedance(level)
    assert np.trapezoid(2 * level * beyond, level) == pytest.approx(float(n.rms()) ** 2, rel=1e-6)


def test_density_is_the_slope_of_the_exceedance():
    n = made([1.0, 2.0], 1.3, 0.02, 0.7)
    slope = (n.exceedance(2.5 + 1e-5) - n.exceedance(2.5 - 1e-5)) / 2e-5
    assert n.density(2.5) == pytest.approx(-float(slope), rel=1e-6)


def test_simulation():
    n = made([0.5, 1.0], 2.0, 0.5, 0.4)
    drawn = np.random.default_rng(504).multivariate_normal(n.mean, n.covariance, size=400_000)
    beyond = (np.linalg.norm(drawn, axis=1) > n.percentile(0.05)).mean()
    assert abs(beyond - 0.05) < 3 * np.sqrt(0.05 * 0.95 / 400_000)


@pytest.mark.parametrize(("mean", "s2"), [([1.0, 0.3], 0.4), ([0.0, 0.0], 1.0), ([3.0, 5.0], 0.9), ([0.2, 0.1], 0.02)])
def test_derivatives_against_differences(mean, s2):
    n = made(mean, 1.2, s2, 0.6)
    by_mean, by_covariance = n.derivatives()
    for k, h in ((0, 1e-4), (1, 1e-4)):
        ends = [NormOfNormal(n.mean + side * h * np.eye(2)[k], n.covariance).percentile() for side in (1, -1)]
        assert by_mean[k] == pytest.approx(float(ends[0] - ends[1]) / (2 * h), abs=1e-7)
    for i, j in ((0, 0), (0, 1), (1, 1)):
        E = np.zeros((2, 2))
        E[i, j] = E[j, i] = 1.0
        h = 1e-6
        ends = [NormOfNormal(n.mean, n.covariance + side * h * E).percentile() for side in (1, -1)]
        expected = float(ends[0] - ends[1]) / (2 * h)
        assert (by_covariance * E).sum() == pytest.approx(expected, abs=1e-7)


def test_derivatives_of_rayleigh_and_of_one_response_that_does_not_vary():
    by_mean, by = made([0, 0], 2.0, 2.0).derivatives()
    np.testing.assert_allclose(by_mean, 0.0, atol=1e-12)
    level = float(made([0, 0], 2.0, 2.0).percentile())
    np.testing.assert_allclose(by, level / 4.0 / 4.0 * np.eye(2), atol=1e-12)  # dR/ds^2 = R / (2 s^2), half an axis
    by_mean, by = made([2.0, 0.0], 1.0, 0.0).derivatives()
    assert by_mean == pytest.approx([1.0, 0.0], abs=1e-6)
    level = float(made([2.0, 0.0], 1.0, 0.0).percentile())
    assert by[0, 0] == pytest.approx((level - 2.0) / 2.0, rel=1e-6)
    # a little variance across makes the norm x + y^2 / (2 x), on the circle x = R
    assert by[1, 1] == pytest.approx(1.0 / (2.0 * level), rel=1e-6)


def test_direction_of_equal_deviations_is_that_of_the_mean():
    n = made([1.0, 1.0], 1.0, 1.0)
    level = n.percentile()
    found = n.direction(level)
    assert found.most_likely == pytest.approx(np.pi / 4, abs=1e-12)
    assert found.circular_mean == pytest.approx(np.pi / 4, abs=1e-12)
    kappa = float(level) * np.sqrt(2.0)  # von Mises with concentration R |m| / s^2
    assert found.circular_std == pytest.approx(np.sqrt(-2 * np.log(ive(1, kappa) / ive(0, kappa))), rel=1e-10)


def test_direction_without_mean_is_the_larger_axis():
    n = made([0, 0], 2.0, 0.5, turn=2.5)  # 2.5 rad points to negative x: its opposite is told
    found = n.direction(n.percentile())
    assert found.most_likely == pytest.approx(2.5 - np.pi, abs=1e-9)


def test_many_at_once_are_each_alone():
    random = np.random.default_rng(3)
    mean = random.normal(size=(4, 3, 2))
    roots = random.normal(size=(4, 3, 2, 2))
    covariance = np.einsum("...ij,...kj->...ik", roots, roots)
    found = NormOfNormal(mean, covariance)
    level, by_mean, direction = found.percentile(), found.derivatives()[0], found.direction(found.percentile())
    assert level.shape == direction.most_likely.shape == (4, 3)
    one = NormOfNormal(mean[2, 1], covariance[2, 1])
    assert one.percentile() == pytest.approx(level[2, 1], rel=1e-12)
    assert one.derivatives()[0] == pytest.approx(by_mean[2, 1], rel=1e-10)


def test_what_does_not_vary_keeps_its_size():
    assert NormOfNormal(np.array([3.0, 4.0]), np.zeros((2, 2))).percentile() == 5.0
    assert NormOfNormal(np.zeros(2), np.zeros((2, 2))).percentile() == 0.0


@pytest.mark.parametrize(
    ("mean", "covariance", "why"),
    [
        ([1.0, 2.0, 3.0], np.eye(3), "shapes"),
        ([1.0, 2.0], np.eye(3), "shapes"),
        ([1.0, np.nan], np.eye(2), "finite"),
        ([1.0, 2.0], [[1.0, np.inf], [np.inf, 1.0]], "finite"),
        ([1.0, 2.0], [[1.0, 0.5], [0.2, 1.0]], "symmetric"),
        ([1.0, 2.0], [[1.0, 1.1], [1.1, 1.0]], "correlation"),
        ([1.0, 2.0], [[-1.0, 0.0], [0.0, 1.0]], "semidefinite"),
    ],
)
def test_refused(mean, covariance, why):
    with pytest.raises(ParameterValueError, match=why):
        NormOfNormal(mean, np.array(covariance))


@pytest.mark.parametrize("p", [0.0, 1.0, -1.0, np.nan, 2.0])
def test_probabilities_refused(p):
    with pytest.raises(ParameterValueError, match="probability"):
        made([0, 0], 1.0, 1.0).percentile(p)
