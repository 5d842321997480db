"""Derivatives by numbers that move a switch, against closed forms."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from switched_system import NOMINAL, pieces, switched_system

from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import SwitchError
from ascentwind.runners import Study
from ascentwind.runners.sensitivity.check import central_difference
from ascentwind.runners.sensitivity.request import StructuralParameterError

T = ca.SX.sym("t")


def noisy(gain, outputs=None, declared=(), **parameters: float) -> LinearSystem:
    """x' = -x + gain(t, parameters) n."""
    x, n = ca.SX.sym("x"), ca.SX.sym("n")
    symbols = {name: ca.SX.sym(name) for name in parameters}
    return define_system(
        "noisy",
        time=T,
        states={"x": (x, -x + gain(T, **symbols) * n)},
        noises={"n": n},
        outputs={"x": x} if outputs is None else {"x": outputs(x, T, **symbols)},
        parameters={name: (symbols[name], value) for name, value in parameters.items()},
        discontinuities=declared,
        end=6.0,
    )


def step(t, a, b, ts):
    return ca.if_else(t < ts, a, b)


STEP = {"a": 2.0, "b": 0.5, "ts": 1.0}


@pytest.mark.parametrize("declared", [(), (1.0,), (0.4, 1.0)])
def test_time_of_a_step(declared):
    """Var(2) = a^2/2 (e^(-2 (2 - ts)) - e^-4) + b^2/2 (1 - e^(-2 (2 - ts))): d/dts = (a^2 - b^2) e^-2 = 0.50751."""
    study = Study.from_system(noisy(step, declared=declared, **STEP))
    found = study.sensitivity("x", 2.0, quantity="variance")["derivative"].sel(parameter="ts").item()
    assert found == pytest.approx((2.0**2 - 0.5**2) * np.exp(-2), rel=1e-9)
    many = study.sensitivities(None, [1.5, 2.0], quantity="variance")["derivative"].sel(parameter="ts").values
    np.testing.assert_allclose(many[:, 0], 3.75 * np.exp([-1.0, -2.0]), rtol=1e-9)
    check = study.check_sensitivity("x", 2.0, quantity="variance")
    assert check["agrees"].all()
    assert check["difference"].sel(item="ts").item() == pytest.approx(found, rel=1e-6)


def test_second_derivatives_by_the_time_of_a_step():
    """d2/dts2 = 2 (a^2 - b^2) e^-2, d2/dts da = 2 a e^-2, d2/da2 = e^-2 - e^-4; of std by the chain."""
    study = Study.from_system(noisy(step, **STEP))
    a, b, fall = 2.0, 0.5, np.exp(-2)
    hessian = np.array(
        [
            [fall - np.exp(-4), 0, 2 * a * fall],
            [0, 1 - fall, -2 * b * fall],
            [2 * a * fall, -2 * b * fall, 2 * (a**2 - b**2) * fall],
        ]
    )
    found = study.second_derivatives("x", 2.0, STEP, quantity="variance")
    np.testing.assert_allclose(found["second_derivative"], hessian, rtol=1e-7, atol=1e-9)
    assert found.attrs["by_differences"] == "ts"
    variance = a**2 / 2 * (fall - np.exp(-4)) + b**2 / 2 * (1 - fall)
    slope = np.array([a * (fall - np.exp(-4)), b * (1 - fall), (a**2 - b**2) * fall])
    of_std = hessian / (2 * np.sqrt(variance)) - np.outer(slope, slope) / (4 * variance**1.5)
    found = study.second_derivatives("x", 2.0, STEP, quantity="std")
    np.testing.assert_allclose(found["second_derivative"], of_std, rtol=1e-7, atol=1e-9)


def test_switches_found_as_roots():
    """Gain 2 where sin(w t) > c, else 1: the roots move with w and c."""
    study = Study.from_system(noisy(lambda t, w, c: ca.if_else(ca.sin(w * t) > c, 2.0, 1.0), w=2.0, c=0.3))

    def variance(w: float, c: float) -> float:
        rise, fall = np.arcsin(c), np.pi - np.arcsin(c)
        edges = np.array([[rise + 2 * np.pi * k, fall + 2 * np.pi * k] for k in range(2)]) / w
        edges = np.minimum(edges, 4.0)
        grown = np.exp(-2 * (4.0 - edges))
        return 0.5 * (1 - np.exp(-8)) + 1.5 * float(np.sum(grown[:, 1] - grown[:, 0]))

    found = study.sensitivity("x", 4.0, quantity="variance")
    assert found.attrs["value"] == pytest.approx(variance(2.0, 0.3), rel=1e-9)
    expected = [
        central_difference(lambda w: variance(w, 0.3), 2.0, 0.01).derivative,
        central_difference(lambda c: variance(2.0, c), 0.3, 0.01).derivative,
    ]
    np.testing.assert_allclose(found["derivative"], expected, rtol=1e-7)


@pytest.fixture(scope="module")
def switched(cache) -> Study:
    return Study.from_system(switched_system())


APART = st.lists(st.integers(1, 12), min_size=4, max_size=4, unique=True).map(lambda ks: [0.3 * k for k in ks])


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(APART, st.sampled_from([-2.0, -0.7, 0.3]), st.sampled_from([-1.5, 0.2]), st.sampled_from(["variance", "mean"]))
@pytest.mark.filterwarnings("ignore::ascentwind.model.errors.UnstableSystemWarning")
def test_every_parameter_of_a_switched_system(switched, times, a1, a2, quantity):
    """Switches of A, B, E and the output: the derivatives of variance and mean against the closed form's."""
    t1, t2, t3, end = times
    values = NOMINAL | {"t1": t1, "t2": t2, "t3": t3, "a1": a1, "a2": a2}
    found = switched.with_parameters(values).sensitivity("y", end, quantity=quantity, elasticity=False)
    which = ("variance", "mean").index(quantity)
    for name, value in values.items():
        expected = central_difference(lambda v, name=name: pieces(values | {name: v}, end)[which], value, 0.01)
        apart = abs(found["derivative"].sel(parameter=name).item() - expected.derivative)
        assert apart <= 1e-7 * abs(expected.derivative) + 10 * expected.uncertainty + 1e-11, name


def test_check_agrees_where_switches_are_close(switched):
    """Differences stop short of the next switch."""
    study = switched.with_parameters({"t1": 1.0, "t2": 1.002})
    for quantity in ("variance", "mean"):
        assert study.check_sensitivity("y", 3.0, quantity=quantity)["agrees"].all(), quantity


def test_a_peak_on_a_switch_moves_along():
    """Noise until ts: the variance is largest there, (1 - e^(-2 ts))/2, d/dts = e^(-2 ts)."""
    study = Study.from_system(noisy(lambda t, ts: ca.if_else(t < ts, 1.0, 0.0), ts=2.0))
    found = study.sensitivity("x", "peak", quantity="variance")
    assert found.attrs["t2_s"] == pytest.approx(2.0, abs=1e-9)
    assert found.attrs["value"] == pytest.approx(0.5 * (1 - np.exp(-4)), rel=1e-9)
    assert found["derivative"].item() == pytest.approx(np.exp(-4), rel=1e-6)


@pytest.mark.parametrize("fall", [0.0, 50.0])
@pytest.mark.parametrize("ts", [1.5, 2.03, 2.1])
def test_a_peak_after_a_jump_upward_moves_along(ts, fall):
    """Noise until ts, where the output jumps to three times: the largest variance is just after, 9 (1 - e^(-2 ts))/2.

    The output then falls within 0.02 s or not; the scan for the peak has points 0.15 s apart.
    """
    study = Study.from_system(
        noisy(
            lambda t, ts: ca.if_else(t < ts, 1.0, 0.0),
            lambda x, t, ts: x * ca.if_else(t < ts, 1.0, 3.0 * ca.exp(-fall * (t - ts))),
            ts=ts,
        )
    )
    found = study.sensitivity("x", "peak", quantity="variance")
    assert found.attrs["t2_s"] == pytest.approx(ts, abs=1e-7)
    assert found.attrs["value"] == pytest.approx(4.5 * (1 - np.exp(-2 * ts)), rel=1e-6)
    assert found["derivative"].item() == pytest.approx(9 * np.exp(-2 * ts), rel=1e-4)
    assert not found.attrs["peak_at_end_of_range"]


# where there is no derivative


def test_a_switch_on_the_end_time_is_refused_and_others_are_not():
    study = Study.from_system(noisy(step, **STEP))
    with pytest.raises(SwitchError, match="'ts': the switch that it moves lies on the end time, 1 s; name the param"):
        study.sensitivity("x", 1.0)
    with pytest.raises(SwitchError, match="'ts'"):
        study.sensitivities(None, [0.5, 1.0])
    with pytest.raises(SwitchError, match="'ts'"):
        study.second_derivatives("x", 1.0, ["a", "ts"])
    with pytest.raises(SwitchError, match="'ts'"):
        study.check_sensitivity("x", 1.0)
    found = study.sensitivity("x", 1.0, quantity="variance", parameters=["a", "b"])
    np.testing.assert_allclose(found["derivative"], [2 * (1 - np.exp(-2)), 0.0], rtol=1e-9)


def test_a_corner_on_the_end_time_has_a_first_derivative_only():
    """The gain is 1 up to ts and rises from there: at t2 = ts nothing jumps."""
    study = Study.from_system(noisy(lambda t, ts: 1 + ca.fmax(t - ts, 0), ts=1.0))
    assert study.sensitivity("x", 1.0, quantity="variance")["derivative"].item() == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(SwitchError, match="no second derivative with respect to 'ts'"):
        study.second_derivatives("x", 1.0, ["ts"])


def test_an_output_that_switches_on_the_end_time_is_refused():
    system = noisy(lambda t, ts: 1.0, lambda x, t, ts: ca.if_else(t < ts, 1, 2) * x, ts=1.0)
    with pytest.raises(SwitchError, match="lies on the end time"):
        Study.from_system(system).sensitivity("x", 1.0)


def test_a_switch_at_the_start_is_refused():
    with pytest.raises(SwitchError, match="lies at the start, 0 s"):
        Study.from_system(noisy(step, a=2.0, b=0.5, ts=0.0)).sensitivity("x", 1.0)


def test_switches_that_coincide_move_together_or_are_refused(switched):
    study = switched.with_parameters({"t1": 1.2, "t2": 1.2})
    with pytest.raises(SwitchError, match="'t1': two switches that it moves apart lie together at 1.2 s"):
        study.sensitivity("y", 3.0)
    assert np.isfinite(study.sensitivity("y", 3.0, parameters=["a1", "b2", "t3"])["derivative"]).all()


def test_a_switch_that_is_about_to_appear_is_refused():
    """sin(t) >= c touches at c = 1: below it there is a pair, above none."""
    system = noisy(lambda t, c: ca.if_else(ca.sin(t) >= c, 2.0, 1.0), c=1.0)
    with pytest.raises(SwitchError, match=r"'c': at 1.5708 s it makes or unmakes a switch"):
        Study.from_system(system, compile=False).sensitivity("x", 3.0)


def test_event_times_of_a_vehicle_are_structure(as504):
    event = next(iter(as504.vehicle.file.events))
    with pytest.raises(StructuralParameterError, match=rf"'events\.{event}' is structure, not a number"):
        as504.sensitivity("bending_moment", 75.0, parameters=[f"events.{event}"])
