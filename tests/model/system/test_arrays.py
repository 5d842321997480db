"""Systems from numbers over time: what is made of them, jumps and kinks, and 20 and more wrong arrays."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import xarray as xr

from ascentwind.errors import SystemDefinitionError, UnknownNameError
from ascentwind.model import LinearSystem, define_system

TIMES = np.array([0.0, 1.0, 2.0, 4.0])
A = np.array([[[0.0, 1.0], [-4.0 - t, -0.2]] for t in TIMES])
B = np.array([[0.0], [1.0]])
C = np.eye(2)


def made(**changes) -> LinearSystem:
    return LinearSystem.from_arrays(**({"times": TIMES, "A": A, "B": B, "C": C} | changes))


def test_entries_are_parameters_tables_or_nothing():
    system = made()
    assert {p.name: p.value for p in system.parameters} == {
        "A(1,2)": 1, "A(2,2)": -0.2, "B(2,1)": 1, "C(1,1)": 1, "C(2,2)": 1,
    }  # fmt: skip
    assert [t.name for t in system.rows] == ["A(2,1)"]
    assert system.A.nnz() == 3 and system.D.nnz() == 0
    assert (system.start, system.end) == (0, 4)
    assert system.state_names == ("x1", "x2") and system.noise_names == ("w1",) and system.output_names == ("y1", "y2")


def test_units_of_entries_follow_from_rows_and_columns():
    names = {"states": ["angle", "rate"], "outputs": ["angle out", "rate out"]}
    units = {"angle": "rad", "rate": "rad/s", "rate out": "deg/s"}
    system = made(names=names, units=units)
    found = {p.name: p.unit for p in system.parameters} | {t.name: t.unit for t in system.rows}
    assert found["A(1,2)"] == "rad s^-1 / (rad/s)" and found["A(2,1)"] == "rad/s s^-1 / (rad)"
    assert found["B(2,1)"] == "rad/s s^-0.5" and found["C(2,2)"] == "deg/s / (rad/s)"


def test_labels_of_xarray_are_names():
    labelled = xr.DataArray(A, dims=("time", "row", "state"), coords={"state": ["angle", "rate"]})
    assert made(A=labelled).state_names == ("x1", "x2")  # rows have no labels
    labelled = xr.DataArray(A, dims=("time", "row", "state"), coords={"row": ["angle", "rate"]})
    outputs = xr.DataArray(C, dims=("out", "state"), coords={"out": ["p", "q"]})
    system = made(A=labelled, C=outputs)
    assert system.state_names == ("angle", "rate") and system.output_names == ("p", "q")


def coefficient(system: LinearSystem, time: float) -> float:
    at = [float(group.evaluate(time)[0]) for group in system.tables]
    return at[0]


@pytest.mark.parametrize("interpolation", ["linear", "cubic", "pchip"])
def test_a_time_that_stands_twice_is_a_jump(interpolation):
    times = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 5.0])
    values = np.array([1.0, 2.0, 3.0, -1.0, -1.5, -2.5])[:, None, None]
    system = LinearSystem.from_arrays(times, -values, [[1.0]], [[1.0]], interpolation=interpolation)
    assert 2.0 in system.discontinuities
    stops = system.stops(np.array([p.value for p in system.parameters]), 5.0)
    at = list(stops.times).index(2.0)
    assert coefficient(system, float(stops.before[at])) == pytest.approx(-3, abs=1e-12)
    assert coefficient(system, float(stops.after[at])) == pytest.approx(1, abs=1e-12)
    assert coefficient(system, 4.0) == pytest.approx(2, abs=1e-12)  # the right side is a straight line


def test_rows_are_carried_on_to_a_declared_jump():
    times, values = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 12.0, 13.0])[:, None, None]
    system = LinearSystem.from_arrays(times, values, [[1.0]], [[1.0]], discontinuities=[1.5])
    assert system.discontinuities == (1.5,)
    assert coefficient(system, 1.5 - 1e-9) == pytest.approx(1.5) and coefficient(system, 1.5 + 1e-9) == pytest.approx(
        11.5
    )


def test_kinks_of_straight_lines_and_steps_are_nodes():
    times, values = np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 1.0, 2.0, 5.0, 5.0])[:, None, None]
    bent = LinearSystem.from_arrays(times, values, [[1.0]], [[1.0]])
    assert bent.discontinuities == (2.0, 3.0)
    stepped = LinearSystem.from_arrays(times, values, [[1.0]], [[1.0]], interpolation="step")
    assert stepped.discontinuities == (1.0, 2.0, 3.0)
    assert coefficient(stepped, 1.999) == 1 and coefficient(stepped, 2.001) == 2
    smooth = LinearSystem.from_arrays(times, values, [[1.0]], [[1.0]], interpolation="cubic")
    assert smooth.discontinuities == ()


def bad(**arrays):
    return arrays


WRONG = [  # what is changed, and what the error says
    (bad(A=A[:3]), "A has the shape (3, 2, 2) for 4 times"),
    (bad(A=A[:, :, :1]), "A has 1 columns for the 2 states"),
    (bad(A=A[:, :1]), "A has 2 columns for the 1 states"),
    (bad(A=A[0, 0]), "A has the shape (2,)"),
    (bad(A=A[None]), "A has the shape (1, 4, 2, 2)"),
    (bad(A=np.moveaxis(A, 0, -1)), "times are the first dimension"),
    (bad(A=None), "A is missing"),
    (bad(B=np.ones((3, 1))), "B has 3 rows for the 2 states that the rows of A are"),
    (bad(B=np.ones(2)), "B has the shape (2,)"),
    (bad(B=1.0), "B has the shape ()"),
    (bad(C=np.ones((1, 3))), "C has 3 columns for the 2 states"),
    (bad(D=np.ones((3, 1))), "D has 3 rows for the 2 outputs"),
    (bad(D=np.ones((2, 2))), "D has 2 columns for the 1 noises"),
    (bad(E=np.ones((1, 1))), "E has 1 rows for the 2 states"),
    (bad(G=np.ones((3, 1))), "G has 3 rows for the 2 outputs"),
    (bad(E=np.ones((2, 2)), G=np.ones((2, 1))), "G has 1 columns for the 2 inputs that the columns of E are"),
    (bad(E=np.ones((2, 1)), u=np.ones(2)), "u has the shape (2,)"),
    (bad(u=np.ones((4, 1))), "u has the shape (4, 1); E and G have 0 columns"),
    (bad(E=np.ones((2, 1)), u=[np.nan]), "u[0] is nan"),
    (bad(A=A + 0j), "A is complex"),
    (bad(A=np.where(A == 0, np.nan, A)), "A[0, 0, 0] is nan"),
    (bad(C=[[np.inf, 0.0]]), "C[0, 0] is inf"),
    (bad(A=[[1.0, 2.0], [3.0]]), "A is no array of numbers"),
    (bad(A=A.astype(str)), "A holds str"),
    (bad(B=B.astype(bool)), "B holds bool, not numbers"),
    (bad(B=np.ma.masked_equal(B, 0.0)), "B has masked entries"),
    (bad(times=[0.0, 2.0, 1.0, 4.0]), "times decrease from 2 to 1 at index 2"),
    (bad(times=[0.0, 1.0, 1.0, 1.0]), "three times"),
    (bad(times=[0.0, 0.0, 1.0, 2.0]), "begin or end with a time that stands twice"),
    (bad(times=[0.0, 1.0, 1.0 + 1e-10, 2.0]), "closer than a table of 2 s tells apart"),
    (bad(times=[0.0, np.nan, 1.0, 2.0]), "times[1] is nan"),
    (bad(times=TIMES[:, None]), "times has the shape (4, 1)"),
    (bad(times=[1.0]), "give two times or more"),
    (bad(times=["0", "1", "2", "3"]), "times holds str"),
    (bad(discontinuities=[4.0]), "the discontinuity at 4 s is not between"),
    (bad(discontinuities=["a"]), "are no times"),
    (bad(names={"states": ["a"]}), "1 names were given for 2 states"),
    (bad(names={"states": ["a", "a"]}), "more than one state 'a'"),
    (bad(names={"states": "ab"}), "no list of names"),
    (bad(names={"states": ["a", 2]}), "2 is no name"),
    (bad(names={"outputs": ["a", ""]}), "name of a output"),
    (bad(start_covariance={"w1": np.eye(3)}), "shape"),
]


@pytest.mark.parametrize(("changes", "says"), WRONG, ids=lambda x: x if isinstance(x, str) else "")
def test_wrong_arrays_are_told_by_name_and_index(changes, says):
    with pytest.raises(SystemDefinitionError) as error:
        made(**changes)
    assert says in str(error.value)


def test_all_arrays_at_fault_are_told_at_once():
    with pytest.raises(SystemDefinitionError) as error:
        made(B=np.ones((3, 1)), C=np.ones((1, 3)), D=[[1j]])
    assert all(says in str(error.value) for says in ("B has 3 rows", "C has 3 columns", "D is complex"))


@pytest.mark.parametrize(
    ("changes", "nearest"),
    [
        ({"interpolation": "liner"}, "linear"),
        ({"names": {"state": ["a", "b"]}}, "states"),
        ({"sources": {"w": "wind"}}, "w1"),
        ({"units": {"x3": "m"}}, "x2"),
        ({"scales": {"y3": 2.0}}, "y2"),
    ],
)
def test_unknown_names(changes, nearest):
    with pytest.raises(UnknownNameError, match=nearest):
        made(**changes)


def lag(table, **more) -> LinearSystem:
    t, x, n, a = (ca.SX.sym(s) for s in "txna")
    return define_system(
        "lag", time=t, states={"x": (x, -a * x + n)}, noises={"n": n}, outputs={"x": x},
        tables={"a": (a, *table)}, **more,
    )  # fmt: skip


def test_tables_of_a_defined_system():
    system = lag(([0.0, 1.0, 3.0], [1.0, 2.0, 2.5]), units={"a": "s^-1"})
    assert system.discontinuities == (1.0,) and system.end == 3.0
    assert system.rows[0].unit == "s^-1" and coefficient(system, 2.0) == pytest.approx(2.25)
    assert lag(([0.0, 1.0, 3.0], [1.0, 2.0, 2.5], "cubic"), end=2.0).discontinuities == ()


@pytest.mark.parametrize(
    ("table", "more", "says"),
    [
        (([0.0, 1.0],), {}, "give (symbol, times, values)"),
        (([0.0, 1.0], [1.0, 2.0, 3.0]), {}, "values of shape (3,) at 2 times"),
        (([1.0, 0.0], [1.0, 2.0]), {}, "the times of table 'a' decrease"),
        (([0.0, 1.0], [1.0, np.nan]), {}, "table 'a'[1] is nan"),
        (([0.0, 1.0], [1.0, 2.0]), {"end": 2.0}, "extend the table"),
        (([0.5, 1.0], [1.0, 2.0]), {}, "extend the table"),
        (([0.0, 1.0], [1.0, 1j]), {}, "table 'a' is complex"),
    ],
)
def test_wrong_tables(table, more, says):
    with pytest.raises(SystemDefinitionError) as error:
        lag(table, **more)
    assert says in str(error.value)


def test_an_interpolant_is_pointed_to_tables():
    t, x, n = (ca.SX.sym(s) for s in "txn")
    function = ca.interpolant("a", "linear", [[0.0, 1.0, 2.0]], [1.0, 2.0, 3.0])
    with pytest.raises(SystemDefinitionError, match=r"tables=\{"):
        define_system("s", time=t, states={"x": (x, -function(t) * x + n)}, noises={"n": n}, outputs={"x": x})
