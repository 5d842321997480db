"""End times a rounding away from switches, from each other and from the ends of flight, in every engine."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.codegen.system.executable import executable_system
from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import TimeRangeError, UnstableSystemWarning
from ascentwind.runners import CovarianceEquation, Cvodes, Ensemble, Study, Sweep
from ascentwind.runners.case.times import parse_times
from ascentwind.runners.solvers import time_nodes as time_nodes_module
from ascentwind.runners.solvers.discretisation import discretise
from ascentwind.runners.solvers.time_nodes import interval_after, intervals, time_nodes

RATES = (-1.0, 0.5, -2.0)  # before, between and after the switches
SWITCHES = (1.0, 3 * 0.7)  # 2.0999999999999996
END = 3.0
TIGHT = (Sweep(1e-10), Cvodes(relative_tolerance=1e-10), CovarianceEquation(1e-10))
NEXT, BEFORE = (lambda t: float(np.nextafter(t, np.inf))), (lambda t: float(np.nextafter(t, -np.inf)))


def switching(discontinuities=SWITCHES, end=END, **more) -> LinearSystem:
    """x' = a(t) x + n, y = c(t) x, both piecewise constant, c = 1, 3 and 2."""
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))

    def pieces(first, second, third):
        return ca.if_else(t < SWITCHES[0], first, ca.if_else(t < SWITCHES[1], second, third))

    return define_system(
        "switching",
        time=t,
        states={"x": (x, pieces(*RATES) * x + n)},
        noises={"n": n},
        outputs={"y": pieces(1, 3, 2) * x},
        discontinuities=discontinuities,
        end=end,
        **more,
    )


def variance(time: float) -> float:
    """Var(x) grows as exp(2 a s) P + (exp(2 a s) - 1) / (2 a) in each piece; at a switch y is that before it."""
    P, begin = 0.0, 0.0
    for rate, scale, end in zip(RATES, (1, 3, 2), (*SWITCHES, np.inf), strict=True):
        grown = np.exp(2 * rate * (min(time, end) - begin))
        P, begin = grown * P + (grown - 1) / (2 * rate), end
        if time <= end:
            return scale**2 * P
    raise AssertionError


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return Study.from_system(switching())


ODD = {
    "decimals": [0.3, 1.0, 2.1, 2.7],
    "arange": np.arange(0.1, 3.05, 0.1),
    "linspace": np.linspace(0.0, 3.0, 31),
    "beside a switch": [BEFORE(1.0), 1.0, NEXT(1.0), 1 + 1e-12, 1 + 1e-9, 1 + 1e-7],
    "beside each other": [1.5, NEXT(1.5), 1.5 + 1e-13, 1.5 + 1e-9, 1.5 + 1e-8],
    "the end": [2.5, BEFORE(3.0), 3.0, NEXT(3.0)],
    "alone behind a switch": [NEXT(SWITCHES[1])],
    "alone before a switch": [2.1],
}


def meant(times) -> list[float]:
    """Return where the closed form is wanted: at the switch, or 1.5 s, for times beside them."""
    return [next((s for s in (*SWITCHES, 1.5) if abs(t - s) < 1.4e-9), t) for t in times]


@pytest.mark.filterwarnings("ignore::ascentwind.model.errors.UnstableSystemWarning")
@pytest.mark.parametrize("options", TIGHT, ids=["sweep", "cvodes", "covariance"])
@pytest.mark.parametrize("times", ODD.values(), ids=list(ODD))
def test_every_engine_gives_the_closed_form_at_the_time_as_asked(study, times, options):
    found = study.response_statistics(times, engine=options)
    np.testing.assert_array_equal(found["time"].values, times)
    expected = [variance(t) for t in meant(times)]
    np.testing.assert_allclose(found.variance.values[:, 0, 0], expected, rtol=2e-8)


@pytest.mark.filterwarnings("ignore::ascentwind.model.errors.UnstableSystemWarning")
@pytest.mark.parametrize("times", ODD.values(), ids=list(ODD))
def test_exact_steps_and_simulated_flights_take_the_same_times(study, times):
    steps = discretise(study.executable, list(times), 0.05)
    np.testing.assert_allclose(steps.variance()[:, 0, 0], [variance(t) for t in meant(times)], rtol=1e-9)
    found = study.response_statistics(times, engine=Ensemble(runs=40))
    np.testing.assert_array_equal(found["time"].values, times)
    assert (np.diff(found.variance.values[:, 0, 0])[np.diff(meant(times)) == 0] == 0).all()


@pytest.mark.parametrize(
    "order", [(1.0, 3 * 0.7), (3 * 0.7, 1.0), (3 * 0.7, 1.0, 1.0, 3 * 0.7), (NEXT(1.0), 3 * 0.7, 1.0), (2.1, 1.0)]
)
@pytest.mark.parametrize("options", TIGHT, ids=["sweep", "cvodes", "covariance"])
def test_discontinuities_in_any_order_and_to_a_rounding(order, options):
    with pytest.warns(UnstableSystemWarning):
        found = Study.from_system(switching(order)).response_statistics([1.7, 2.8], engine=options)
    np.testing.assert_allclose(found.variance.values[:, 0, 0], [variance(1.7), variance(2.8)], rtol=2e-8)


@pytest.mark.parametrize("bad", [[np.nan], [1.0, np.inf], ["one"], [None], [[1.0, 2.0]]])
def test_discontinuities_that_are_no_times_are_refused(bad):
    with pytest.raises(TimeRangeError, match="discontinuities"):
        switching(bad)


def test_weighting_functions_of_neighbours_are_the_same(study):
    found = study.weighting_functions([1.0, NEXT(1.0), 1.5, 1.5 + 1e-12, 2.0], spacing=0.1)
    np.testing.assert_array_equal(found["time"].values, [1.0, NEXT(1.0), 1.5, 1.5 + 1e-12, 2.0])
    weight = found["noise_weighting"].values[:, 0, 0]
    np.testing.assert_array_equal(weight[0], weight[1])
    np.testing.assert_array_equal(weight[2], weight[3])
    # from 1.5 s back to the switch c exp(0.5 (t2 - t)), and exp(-1 (1 - t)) of that before it
    t = found["t"].values
    exact = 3 * np.where(t > 1, np.exp(0.5 * (1.5 - t)), np.exp(0.25 - (1 - t))) * (t <= 1.5)
    np.testing.assert_allclose(weight[2], exact, rtol=1e-6)
    single = study.weighting_function(NEXT(1.0), spacing=0.1)
    np.testing.assert_allclose(single["noise_weighting"].values[0, 0, -1], 1.0)  # c before the switch, not after


def test_sensitivities_take_neighbours_as_one():
    """d var / d g of x' = a x + g n at g = 1 is twice the variance."""
    t, x, n, g = (ca.SX.sym(s) for s in ("t", "x", "n", "g"))
    rate = ca.if_else(t < 1, -1.0, -2.0)
    made = Study.from_system(
        define_system(
            "gain", time=t, states={"x": (x, rate * x + g * n)}, noises={"n": n}, outputs={"x": x},
            parameters={"g": (g, 1.0)}, discontinuities=[1.0], end=3.0,
        )
    )  # fmt: skip
    times = [BEFORE(1.0), 1.0, NEXT(1.0), 2.0, 2 + 1e-12, NEXT(3.0)]
    found = made.sensitivities(["x"], times, quantity="variance")
    before = 0.5 * (1 - np.exp(-2.0))
    exact = [before if t < 1.1 else before * np.exp(-4 * (t - 1)) + 0.25 * (1 - np.exp(-4 * (t - 1))) for t in times]
    np.testing.assert_allclose(found["value"].values[:, 0], exact, rtol=1e-9)
    np.testing.assert_allclose(found["derivative"].values[:, 0, 0], 2 * np.array(exact), rtol=1e-9)
    np.testing.assert_array_equal(found["time"].values, times)
    single = made.sensitivity("x", NEXT(1.0), quantity="variance")
    np.testing.assert_allclose(single.attrs["value"], before, rtol=1e-9)


def test_batches_take_neighbours_as_one(study):
    found = study.batch([{}, {}], [1.0, NEXT(1.0), 2.0], engine=Sweep(1e-9))
    expected = [variance(1.0), variance(1.0), variance(2.0)]
    np.testing.assert_allclose(found.variance.values[:, :, 0, 0], [expected, expected], rtol=1e-7)


def test_nodes_are_switches_then_neighbours_then_the_times_themselves():
    system = Study.from_system(switching(), compile=False).executable
    times = [0.5, 0.5 + 1e-10, 1 - 2e-9, 1.0, 1 + 2.9e-9, 1 + 3.1e-9, 2.0, 3.0, 3 + 2e-9]
    nodes = [0.5, 0.5, 1.0, 1.0, 1.0, 1 + 3.1e-9, 2.0, 3.0, 3.0]
    np.testing.assert_array_equal(time_nodes(system, times), nodes)
    # a flight without end: the last time asked for gives the measure
    endless = Study.from_system(switching(end=float("inf")), compile=False).executable
    np.testing.assert_array_equal(time_nodes(endless, [1 + 0.9e-9]), [1.0])
    np.testing.assert_array_equal(time_nodes(endless, [1 + 1.1e-9]), [1 + 1.1e-9])
    # the start is a switch of its own: what is just after it has flown, however little
    np.testing.assert_array_equal(time_nodes(system, [1e-12, 1.0]), [1e-12, 1.0])


def test_intervals_keep_each_side_to_itself():
    system = Study.from_system(switching((1.0, 2.0)), compile=False).executable
    first, second, third, fourth = intervals(system, 0.0, 3.0)  # the jump at 2.1 nobody declared
    assert (first.begin, first.end, second.end, third.end, fourth.end) == (0.0, 1.0, 2.0, SWITCHES[1], 3.0)
    assert first.low == 0.0 < 1 - 1e-14 < first.high < 1.0 < second.low < 1 + 1e-14
    assert third.high < SWITCHES[1] < fourth.low
    assert fourth.high == 3.0
    # edges that are a switch to a rounding make no interval of that size
    (only,) = intervals(system, NEXT(1.0), BEFORE(2.0))
    assert 1.0 < only.low < only.high < 2.0
    after = interval_after(system, BEFORE(1.0))
    assert (after.begin, after.end) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("105.4:106:0.2", [105.4, 105.6, 105.8, 106.0]),
        ("0:1:0.1", [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]),
        (" 10.6 : 1.12e1: .2", [10.6, 10.8, 11.0, 11.2]),
        ("1:2:0.3", [1.0, 1.3, 1.6, 1.9]),
        ("75,75.5", [75.0, 75.5]),
    ],
)
def test_times_of_a_grid_are_the_decimals_that_a_person_types(text, times):
    assert parse_times(text) == times


@pytest.mark.parametrize("text", ["1:2", "2:1:0.1", "1:2:0", "1:inf:1", "nan:1:1", "a:b:c", "0:1e300:1e-300", "1,,2"])
def test_grids_that_name_no_times_are_refused(text):
    with pytest.raises(TimeRangeError):
        parse_times(text)


def test_times_far_from_all_else_are_themselves_and_cost_no_search(monkeypatch):
    """The short way and the search say the same, of times on a grid and of those beside a switch or each other."""
    executable = executable_system(switching(), compile=False)
    cases = (
        [0.5, 2.0, 2.9],
        [0.5, 2.1],
        [1.0, 1.0 + 1e-12],
        [0.0, 2.0],
        [2.5, 2.5 + 1e-10],
        [1e-13, 0.5],
        [2.1 + 1e-9, END],
    )
    for times in cases:
        quick = time_nodes(executable, times)
        monkeypatch.setattr(time_nodes_module, "_apart", lambda *_: False)
        np.testing.assert_array_equal(quick, time_nodes(executable, times))
        monkeypatch.undo()
