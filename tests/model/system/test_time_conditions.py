"""Conditions on time in a system's expressions: jumps that nobody declared, against closed forms in every engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from switched_system import NOMINAL, pieces, switched_system

from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import IntegrationError, NonlinearSystemError, SwitchError
from ascentwind.model.polynomials import PiecewisePolynomial
from ascentwind.model.system.interval_arithmetic import bounds
from ascentwind.model.tables import TableGroup
from ascentwind.runners import CovarianceEquation, Cvodes, Study, Sweep
from ascentwind.runners.solvers.discretisation import discretise
from ascentwind.runners.statistics.engines import UncheckedStatisticsWarning

T = ca.SX.sym("t")


def driven_by(gain: ca.SX | Callable[[ca.SX], ca.SX], end: float = float("inf"), **more) -> LinearSystem:
    """x' = -x + g(t) n."""
    x, n = ca.SX.sym("x"), ca.SX.sym("n")
    g = gain(T) if callable(gain) else gain
    return define_system(
        "driven", time=T, states={"x": (x, -x + g * n)}, noises={"n": n}, outputs={"x": x}, end=end, **more
    )


def by_every_engine(study: Study, times, response: int = 0) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Variance and mean of a response at end times, by name of the engine."""
    found = {}
    for name, options in (
        ("sweep", Sweep(1e-10)),
        ("cvodes", Cvodes(relative_tolerance=1e-10)),
        ("covariance", CovarianceEquation(1e-11)),
    ):
        statistics = study.response_statistics(times, engine=options)
        found[name] = statistics.variance.values[:, response, -1], statistics.mean.values[:, response, -1]
    exact = discretise(study.with_means, list(times), 0.01)
    found["ensemble, infinitely many runs"] = exact.variance()[:, response].sum(axis=1), exact.mean[:, response]
    ask = [study.sensitivity(study.system.output_names[response], t, quantity="variance", parameters=[]) for t in times]
    found["collocation"] = tuple(np.array([d.attrs[name] for d in ask]) for name in ("variance", "mean"))
    return found


@pytest.mark.parametrize("width", [0.5, 0.005, 5e-5, 1e-7])
def test_a_pulse_nobody_declared(width):
    """g = 10 in [5, 5 + w]: variance at 6 s 50 (exp(-2 (1 - w)) - exp(-2))."""
    pulse = ca.if_else(ca.logic_and(T >= 5, 5 + width > T), 10.0, 0.0)
    expected = 50 * (np.exp(-2 * (1 - width)) - np.exp(-2))
    study = Study.from_system(driven_by(pulse))
    for engine, (variance, _) in by_every_engine(study, [6.0]).items():
        assert variance[0] == pytest.approx(expected, rel=1e-7), engine
    checked = study.response_statistics([6.0], check=True)
    assert checked["discretisation_difference"].max() < 1e-7


SPOT = np.arccos(1 - 1e-5) / 2
# a way to write a condition, its breaks up to 4 s, and what it is in NumPy
WAYS = {
    "less": (lambda t: ca.if_else(t < 1.3, 2.0, 0.5), [1.3], lambda t: np.where(t < 1.3, 2.0, 0.5)),
    "at most": (lambda t: ca.if_else(t <= 1.3, 2.0, 0.5), [1.3], lambda t: np.where(t < 1.3, 2.0, 0.5)),
    "from the start on": (lambda t: ca.if_else(t <= 0, 7.0, 1.0), [], lambda t: 1.0),
    "not equal": (lambda t: ca.if_else(ca.floor(t) != 2, 1.0, 3.0), [2, 3], lambda t: np.where(t // 1 == 2, 3.0, 1.0)),
    "floor": (lambda t: ca.floor(t / 0.7), np.arange(0.7, 4, 0.7), lambda t: np.floor(t / 0.7)),
    "ceil": (lambda t: ca.ceil(1 - t * t), np.sqrt(np.arange(1, 16)), lambda t: np.ceil(1 - t * t)),
    "fmod": (lambda t: ca.fmod(t, 0.9), np.arange(0.9, 4, 0.9), lambda t: np.fmod(t, 0.9)),
    "sign": (lambda t: ca.sign(ca.sin(3 * t)), np.arange(1, 4) * np.pi / 3, lambda t: np.sign(np.sin(3 * t))),
    "fabs": (
        lambda t: ca.fabs(ca.cos(2 * t)) - 0.3,
        np.pi * np.array([0.25, 0.75, 1.25]),
        lambda t: abs(np.cos(2 * t)) - 0.3,
    ),
    "fmax, fmin": (lambda t: ca.fmin(ca.fmax(t - 1, 0), 1.5), [1, 2.5], lambda t: np.clip(t - 1, 0, 1.5)),
    "copysign": (lambda t: ca.copysign(1.5, t - 1.1) + 2, [1.1], lambda t: np.where(t < 1.1, 0.5, 3.5)),
    "atan2": (lambda t: ca.atan2(t - 2, -1), [2.0], lambda t: np.arctan2(t - 2, -1)),
    "pw_const": (
        lambda t: ca.pw_const(t, ca.DM([1, 2.2]), ca.DM([1, 4, 2])),
        [1, 2.2],
        lambda t: 1 + 3 * (t > 1) - 2 * (t > 2.2),
    ),
    "pw_lin": (
        lambda t: ca.pw_lin(t, ca.DM([0, 1, 4]), ca.DM([1, 3, 0])),
        [1],
        lambda t: np.interp(t, [0, 1, 4], [1, 3, 0]),
    ),
    "rectangle": (lambda t: 1 + ca.rectangle(t - 2), [1.5, 2.5], lambda t: 1 + 1.0 * (abs(t - 2) < 0.5)),
    "one inside another": (
        lambda t: ca.if_else(ca.fmod(t, 1.0) < 0.25 + 0.1 * ca.floor(t), 2.0, 0.1),
        [0.25, 1, 1.35, 2, 2.45, 3, 3.55],
        lambda t: np.where(np.fmod(t, 1.0) < 0.25 + 0.1 * np.floor(t), 2.0, 0.1),
    ),
    "a narrow pair": (
        lambda t: ca.if_else(ca.cos(2 * (t - 2.7)) > 1 - 1e-5, 50.0, 1.0),
        [2.7 - SPOT, 2.7 + SPOT],
        lambda t: np.where(np.cos(2 * (t - 2.7)) > 1 - 1e-5, 50.0, 1.0),
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_write_a_condition(way):
    """Variance = integral of exp(-2 (T - t)) g^2, piece by piece between the breaks known by hand."""
    written, breaks, g = WAYS[way]
    edges = np.array([0.0, *breaks, 4.0])
    expected = sum(quad(lambda t: np.exp(-2 * (4 - t)) * g(t) ** 2, a, b, epsabs=1e-14)[0] for a, b in pairwise(edges))
    study = Study.from_system(driven_by(written, end=4.0), compile=False)
    stops = study.executable.stops(4.0)
    for time in breaks:
        assert np.abs(stops.times - time).min() < 1e-12
    for engine, options in (
        ("cvodes", Cvodes(relative_tolerance=1e-10)),
        ("covariance", CovarianceEquation(1e-11)),
    ):
        found = study.response_statistics([4.0], engine=options).variance.values[0, 0, 0]
        assert found == pytest.approx(expected, rel=1e-7), engine


@pytest.fixture(scope="module")
def switched(cache) -> Study:
    return Study.from_system(switched_system())


TIMES = st.floats(0.05, 4.0).map(lambda t: round(t, 2))
RATES = st.sampled_from([-3.0, -1.0, -0.2, 0.4])


@pytest.mark.slow
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(TIMES, TIMES, TIMES, RATES, RATES, TIMES)
@pytest.mark.filterwarnings("ignore::ascentwind.model.errors.UnstableSystemWarning")
def test_switches_move_with_the_numbers_of_a_case(switched, t1, t2, t3, a1, a2, end):
    values = NOMINAL | {"t1": t1, "t2": t2, "t3": t3, "a1": a1, "a2": a2}
    times = sorted({end, t1, 3.9})  # among them a switch, seen from the left
    expected = np.array([pieces(values, t) for t in times]).T
    for engine, found in by_every_engine(switched.with_parameters(values), times).items():
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9, err_msg=f"{engine}: {values}")


def test_a_batch_and_weighting_functions_stop_at_each_members_switches(switched):
    sets = [{"t1": t1, "t2": t1 + 0.003} for t1 in (0.4, 0.9, 1.7)]
    found = switched.batch(sets, [3.0], engine=Sweep(1e-9))
    expected = [pieces(NOMINAL | values, 3.0) for values in sets]
    np.testing.assert_allclose(found.variance.values[:, 0, 0, 0], [v for v, _ in expected], rtol=1e-8)
    np.testing.assert_allclose(found.mean.values[:, 0, 0, 0], [m for _, m in expected], rtol=1e-8)
    for ask in (switched.weighting_function(3.0, spacing=0.1), switched.weighting_functions([3.0], spacing=0.1)):
        assert {1.0, 2.0} <= set(np.round(ask["t"].values, 12))


def test_check_sees_a_smooth_pulse_that_the_first_pass_stepped_over():
    """g = exp(-((t - 5) / w)^2 / 2) has no condition: the first pass of an engine may miss it, the check may not."""
    width = 0.003
    study = Study.from_system(driven_by(lambda t: 10 * ca.exp(-0.5 * ((t - 5) / width) ** 2)))
    expected = 100 * np.exp(-2) * np.sqrt(np.pi) * width  # of the variance, to (w/1 s)^2
    for engine in ("sweep", "cvodes", "covariance"):
        found = study.response_statistics([6.0], engine=engine, check=True)
        error = abs(found.std.values[0, 0, 0] / np.sqrt(expected) - 1)
        difference = found["discretisation_difference"].values[0, 0, 0]
        assert error < 1e-4 or difference > 0.5 * error, (engine, error, difference)


# what cannot be located or is not linear is refused, with the condition and the reason


def test_what_touches_for_a_stretch_is_refused():
    """sin^2 + cos^2 - 1 in disguise is zero to rounding everywhere."""
    gain = ca.if_else(ca.exp(ca.log(1 + T) + ca.log(1 + T)) > (1 + T) ** 2, 1.0, 2.0)
    study = Study.from_system(driven_by(gain, end=3.0), compile=False)
    with pytest.raises(
        SwitchError, match=r"the condition '.*log.*' cannot be located: near .* neither holds nor fails"
    ):
        study.response_statistics([2.0], engine="cvodes")


def test_too_many_switches_are_refused():
    study = Study.from_system(driven_by(lambda t: ca.fmod(1e6 * t, 2.0), end=3.0), compile=False)
    with pytest.raises(SwitchError, match=r"'fmod\(.*' switches 1500000 times between 0 s and 3 s, more than 100000"):
        study.response_statistics([2.0], engine="cvodes")


@pytest.mark.parametrize(
    "rate", [lambda x, n: ca.floor(x) + n, lambda x, n: -x + ca.sign(n), lambda x, n: ca.if_else(x > 1, 0, n)]
)
def test_a_condition_on_a_state_or_noise_is_not_linear(rate):
    """floor and sign have no derivative but are not linear all the same."""
    x, n = ca.SX.sym("x"), ca.SX.sym("n")
    with pytest.raises(NonlinearSystemError, match="linear"):
        define_system("s", time=T, states={"x": (x, rate(x, n))}, noises={"n": n}, outputs={"x": x})


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 10**9))
@example(6543756)
@example(1277)
def test_bounds_hold_what_they_bound(seed):
    """Random expressions over random boxes: every value inside a box lies between the bounds."""
    random = np.random.default_rng(seed)
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    names = "sin cos exp fabs floor ceil sign sqrt log tan tanh atan cosh sinh acos asin logic_not"
    unary = [getattr(ca, name) for name in names.split()] + [lambda x: x**2, lambda x: x**3, lambda x: 1 / x]
    names = "plus minus times rdivide fmin fmax fmod power atan2 copysign hypot lt le logic_and logic_or ne eq"
    binary = [getattr(ca, name) for name in names.split()] + [lambda c, x: ca.if_else(c, x, 0)]
    expression = [a, b, ca.SX(2), ca.SX(-0.7)]
    for _ in range(6):
        if random.random() < 0.5:
            expression.append(unary[random.integers(len(unary))](expression[random.integers(len(expression))]))
        else:
            i, j = random.integers(len(expression), size=2)
            expression.append(binary[random.integers(len(binary))](expression[i], expression[j]))
    function = ca.Function("f", [a, b], [expression[-1]])
    low, size = random.uniform(-3, 3, (2, 5)), random.uniform(0, 1.5, (2, 5))
    ((found,),) = bounds(function, [[(low[i], low[i] + size[i])] for i in range(2)])
    for share in random.uniform(0, 1, (20, 2, 5)):
        value = function(*((low + share * size)[:, None, :])).full()[0]
        defined = np.isfinite(value)
        slack = np.where(defined, 1e-9 * (1 + np.abs(value)), 0.0)
        assert (~defined | ((found[0] - slack <= value) & (value <= found[1] + slack))).all(), expression[-1]


@pytest.mark.parametrize(
    "make",
    [
        lambda z: ca.logic_not(ca.fmod(2, z)),
        lambda z: ca.fmod(2, z) < 3,
        lambda z: ca.sin(1 / z) < 2,
        lambda z: ca.fabs(z / z) >= 0,
        lambda z: ca.copysign(2, ca.exp(z / z)) > 0,
        lambda z: ca.copysign(2, -ca.exp(z / z)) > 0,
    ],
)
def test_bounds_hold_what_is_made_of_no_number(make):
    """Comparisons and signs of 0/0 and the like are numbers: z = 0 exactly, or somewhere in the box."""
    z = ca.SX.sym("z")
    function = ca.Function("f", [z], [make(z)])
    ((found,),) = bounds(function, [[(np.array([0.0, -1.0]), np.array([0.0, 1.0]))]])
    value = float(function(0))
    assert ((found[0] <= value) & (value <= found[1])).all()


def test_a_check_that_fails_does_not_cost_the_result(monkeypatch):
    """The difference is infinite, with a warning that says why."""
    study = Study.from_system(driven_by(lambda t: ca.SX(1.0)))
    expected = study.response_statistics([2.0]).std

    def fail(options, flight):
        raise IntegrationError("a tolerance cannot be met")

    monkeypatch.setattr(Sweep, "finer", fail)
    with pytest.warns(UncheckedStatisticsWarning, match="could not be checked.*: a tolerance cannot be met"):
        found = study.response_statistics([2.0], check=True)
    np.testing.assert_array_equal(found.std, expected)
    assert np.isinf(found["discretisation_difference"]).all()


def test_a_hundred_switches_a_second():
    """g = 100 fmod(t, 0.01): the verification of compiled code, too, steps over none."""
    study = Study.from_system(driven_by(lambda t: 100 * ca.fmod(t, 0.01), end=3.0))
    ends = 0.01 * np.arange(301)
    inside = [quad(lambda t, a=a: np.exp(-2 * (3 - t)) * (t - a) ** 2, a, b)[0] for a, b in pairwise(ends)]
    for engine in ("sweep", "cvodes"):
        found = study.response_statistics([3.0], engine=engine).variance.values[0, 0, 0]
        assert found == pytest.approx(1e4 * sum(inside), rel=1e-5), engine


def test_a_condition_on_a_table_stands_in_outputs_alone():
    """y = h(t) x, h = 2 where a table exceeds 2, else 1: nothing is integrated over it."""
    x, n, v = ca.SX.sym("x"), ca.SX.sym("n"), ca.SX.sym("v")
    rising = PiecewisePolynomial(np.array([[1.0], [0.0]]), np.array([0.0, 9.0]))
    table = TableGroup.from_polynomials("height", "time", (("height", "m", rising),), 0.0, 9.0)
    above = define_system("above", time=T, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"x": x}, end=9.0)
    system = replace(above, v=v, tables=(table,), output=(1 + (v > 2.0)) * x)
    assert not system.conditions
    for engine, (variance, _) in by_every_engine(Study.from_system(system), [1.5, 3.0]).items():
        assert variance == pytest.approx([(1 - np.exp(-3)) / 2, 2 * (1 - np.exp(-6))], rel=1e-7), engine
    with pytest.raises(SwitchError, match="depends on a table"):
        replace(system, derivative=-x + (v > 2.0) * n)
