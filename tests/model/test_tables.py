"""Tables: interpolation, breaks, merging onto common knots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator

from ascentwind.model.errors import DataError
from ascentwind.model.tables import Table, TableGroup

GRID = np.linspace(0.0, 9.99, 300)


def group(*tables: Table) -> TableGroup:
    return TableGroup.from_polynomials("g", "time", [(t.name, t.unit, t.polynomial) for t in tables], 0.0, 10.0)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=6, max_size=12), st.integers(5, 9))
def test_merged_tables_keep_their_own_interpolation(values, other):
    """Two tables on different knots, evaluated in one lookup, against SciPy's interpolants alone."""
    y = np.array(values)
    x = np.linspace(0, 10, y.size)
    x2 = np.linspace(0, 10, other)
    y2 = np.cos(x2)
    merged = group(Table("a", "1", x, y), Table("b", "1", x2, y2, "pchip"), Table("c", "1", x2, y2, "linear"))
    found = merged.evaluate(GRID)
    np.testing.assert_allclose(found[:, 0], CubicSpline(x, y)(GRID), atol=1e-10)
    np.testing.assert_allclose(found[:, 1], PchipInterpolator(x2, y2)(GRID), atol=1e-12)
    np.testing.assert_allclose(found[:, 2], np.interp(GRID, x2, y2), atol=1e-12)


def test_break_splits_a_table_and_each_side_is_carried_to_it():
    x = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10.0])
    y = np.where(x < 4.5, x**2, 100 - x**3)
    merged = group(Table("a", "1", x, y, "cubic", (4.5,)))
    assert merged.evaluate(np.nextafter(4.5, 0))[0] == pytest.approx(4.5**2, rel=1e-12)
    assert merged.evaluate(4.5)[0] == pytest.approx(100 - 4.5**3, rel=1e-12)


def test_row_on_a_break_belongs_to_both_sides():
    x = np.arange(11.0)
    merged = group(Table("a", "1", x, np.abs(x - 4), "cubic", (4.0,)))
    np.testing.assert_allclose(merged.evaluate(GRID)[:, 0], np.abs(GRID - 4), atol=1e-12)


def test_step_holds_the_row_above():
    merged = group(Table("a", "1", np.array([0.0, 3.0, 7.0]), np.array([1.0, 5.0, 2.0]), "step"))
    assert merged.evaluate([0, 2.999, 3, 6.9, 7, 10])[:, 0].tolist() == [1, 1, 5, 5, 2, 2]


def test_values_are_held_beyond_the_ends():
    merged = group(Table("a", "1", np.array([0.0, 5.0, 10.0]), np.array([1.0, 5.0, 2.0])))
    assert merged.evaluate([-3, 12])[:, 0].tolist() == pytest.approx([1, 2])


@pytest.mark.parametrize(
    ("x", "y", "interpolation", "message"),
    [
        ([0, 1, 1], [1, 2, 3], "cubic", "not increasing after argument 1"),
        ([0, 1], [1, float("inf")], "cubic", "not finite"),
        ([0], [1], "cubic", "at least two rows"),
        ([0, 1], [1, 2], "spline", "not one of cubic"),
    ],
)
def test_impossible_tables_are_refused(x, y, interpolation, message):
    with pytest.raises(DataError, match=message):
        Table("a", "1", np.array(x, float), np.array(y, float), interpolation)


def test_break_with_too_few_rows_is_refused():
    with pytest.raises(DataError, match="too few rows between 0 and 0.5"):
        Table("a", "1", np.arange(5.0), np.arange(5.0), "cubic", (0.5,)).polynomial  # noqa: B018
