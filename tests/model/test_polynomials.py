"""Cubics between rows, against SciPy's own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from ascentwind.model.polynomials import (
    PiecewisePolynomial,
    monotone_cubics,
    not_a_knot_spline,
    straight_lines,
)

steps = st.lists(st.floats(0.01, 100.0), min_size=3, max_size=30)


def rows(widths: list[float], seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows at uneven distances, and points among and beyond them."""
    random = np.random.default_rng(seed)
    x = np.cumsum([-3.0, *widths])[: len(widths)]
    y = np.cumsum(random.standard_normal(x.size)) * random.integers(0, 2, x.size)  # with stretches of zeros
    return x, y, np.concatenate([x, random.uniform(x[0] - 0.1, x[-1] + 0.1, 200)])


@settings(max_examples=100, deadline=None)
@given(steps, st.integers(0, 1000))
@pytest.mark.parametrize(
    ("ours", "reference"), [(not_a_knot_spline, CubicSpline), (monotone_cubics, PchipInterpolator)]
)
def test_cubics_are_those_of_scipy(ours, reference, widths, seed):
    x, y, at = rows(widths, seed)
    found, expected = ours(x, y), reference(x, y)
    inside = np.clip(at, x[0], x[-1])
    size = np.abs(expected(inside)).max() + 1e-300
    np.testing.assert_allclose(found(inside), expected(inside), rtol=1e-11, atol=1e-10 * size)
    same = PPoly(found.c, found.x)
    np.testing.assert_allclose(found(at), same(at), rtol=1e-12, atol=1e-12 * np.abs(same(at)).max())
    for order in (1, 2, 3):
        expected = same(at, order)
        np.testing.assert_allclose(found(at, order), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert not found(at, 4).any()


def test_rows_at_very_different_distances():
    """The first and last equations of the spline are not dominated by their diagonals."""
    for x in ([0, 1e-6, 1, 2, 3], [0, 1, 1 + 1e-6, 2, 3], [0, 1, 2, 3 - 1e-6, 3]):
        x = np.array(x, float)
        cubic = (x / x[-1]) ** 3 - (x / x[-1]) + 2  # which a spline is through any rows
        at = np.linspace(0, x[-1], 101)
        np.testing.assert_allclose(
            not_a_knot_spline(x, cubic)(at), (at / x[-1]) ** 3 - at / x[-1] + 2, rtol=1e-9, atol=0
        )


def test_one_number_gives_one_and_many_keep_their_shape():
    line = straight_lines(np.array([0.0, 1.0, 3.0]), np.array([1.0, 2.0, 0.0]))
    assert float(line(2.0)) == 1.0
    assert line(np.zeros((2, 3))).shape == (2, 3)
    assert np.isnan(line(np.nan))


@settings(max_examples=100, deadline=None)
@given(steps, st.integers(0, 1000), st.floats(-2, 2))
def test_a_value_is_passed_where_scipy_finds_it(widths, seed, value):
    x, y, _ = rows(widths, seed)
    value += 0.0123  # no row's
    found = not_a_knot_spline(x, y)
    expected = PPoly(found.c, x).solve(value, extrapolate=False)
    np.testing.assert_allclose(np.sort(found.passes(value)), np.sort(expected), rtol=1e-7, atol=1e-7 * np.ptp(x))


def test_lines_pass_a_value_as_cubics_with_leading_zeros_or_roundings():
    x = np.array([0.0, 1.0, 3.0])
    line = straight_lines(x, np.array([0.0, 2.0, -2.0]))
    assert line.passes(1.0).tolist() == [0.5, 1.5]
    nearly = PiecewisePolynomial(line.c + np.array([[1e-300], [1e-18], [0.0], [0.0]]), x)
    assert nearly.passes(1.0) == pytest.approx([0.5, 1.5], rel=1e-14)
    assert straight_lines(x, np.ones(3)).passes(1.0).size == 0  # everywhere: passed nowhere
