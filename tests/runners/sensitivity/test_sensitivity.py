"""Sensitivities against closed forms, and bad input."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import DirectNoiseError, ParameterValueError, TimeRangeError, UnknownNameError
from ascentwind.runners import Study
from ascentwind.runners.design.problem import LoadReliefProblem
from ascentwind.runners.parameter_study import run_parameter_study
from ascentwind.runners.sensitivity.check import central_difference
from ascentwind.runners.sensitivity.one import UndefinedElasticityWarning
from ascentwind.runners.sensitivity.peak import _from_parabola
from ascentwind.runners.sensitivity.request import StructuralParameterError, TableParameterError, ZeroQuantityError


def derivative(f, at: float) -> float:
    """By a complex step, exact to rounding."""
    return float(np.imag(f(at + 1e-30j)) / 1e-30)


def found(system: LinearSystem, time, quantity="variance", **options):
    return Study.from_system(system).sensitivity(system.output_names[0], time, quantity=quantity, **options)


def gauss_markov(tau=2.0, spread=0.7) -> LinearSystem:
    t, x, n, tau_, s = (ca.SX.sym(name) for name in ("t", "x", "n", "tau", "s"))
    return define_system(
        "gauss_markov",
        time=t,
        states={"x": (x, -x / tau_ + ca.sqrt(2 / tau_) * n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"tau": (tau_, tau), "spread": (s, spread)},
        start_covariance={"n": s**2},
    )


def test_gauss_markov_process_with_a_start_covariance_of_its_own():
    """Var = 1 - e^(-2 t / tau) + s^2 e^(-2 t / tau)."""
    d = found(gauss_markov(), 1.5)
    expected = [
        derivative(lambda tau: 1 + (0.7**2 - 1) * np.exp(-3 / tau), 2.0),
        derivative(lambda s: s**2 * np.exp(-3 / 2.0), 0.7),
    ]
    np.testing.assert_allclose(d["derivative"], expected, rtol=1e-9)
    np.testing.assert_allclose(d["elasticity"], np.array(expected) * [2.0, 0.7] / d.attrs["value"], rtol=1e-9)


@pytest.mark.parametrize("time", [0.5, 2.0, 7.5])
def test_time_varying_lag(time):
    """x' = -a x / (1 + t) + n: Var = ((1 + t) - (1 + t)^(-2 a)) / (2 a + 1)."""
    t, x, n, a = (ca.SX.sym(s) for s in ("t", "x", "n", "a"))
    lag = define_system(
        "lag",
        time=t,
        states={"x": (x, -a * x / (1 + t) + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"a": (a, 1.2)},
    )
    expected = derivative(lambda a: ((1 + time) - (1 + time) ** (-2 * a)) / (2 * a + 1), 1.2)
    assert found(lag, time)["derivative"].item() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("w", "z"), [(6.0, 0.005), (1.0, 0.4), (20.0, 0.05)])
def test_oscillator_with_a_parameter_in_its_output(w, z):
    """Caughey and Stumpf 1961, y = k x: frequency, damping, noise level and output each by the closed form."""
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    symbols = {s: ca.SX.sym(s) for s in ("w", "z", "g", "k")}
    values = {"w": w, "z": z, "g": 1.7, "k": 3.0}
    system = define_system(
        "oscillator",
        time=t,
        states={
            "x": (x, v),
            "v": (v, -2 * symbols["z"] * symbols["w"] * v - symbols["w"] ** 2 * x + symbols["g"] * n),
        },
        noises={"n": n},
        outputs={"y": symbols["k"] * x},
        parameters={s: (symbols[s], values[s]) for s in values},
        start=1.0,
    )
    s = 2.0

    def variance(w, z, g, k):
        wd = w * np.sqrt(1 - z**2)
        ripple = w**2 / wd**2 + z * w / wd * np.sin(2 * wd * s) - (z * w / wd) ** 2 * np.cos(2 * wd * s)
        return k**2 * g**2 * (1 - np.exp(-2 * z * w * s) * ripple) / (4 * z * w**3)

    d = found(system, 1.0 + s, "std")
    # the phase error of the method, at most steps * 0.8^9 / 2.5e7, is all that is left
    assert d.attrs["variance"] == pytest.approx(variance(**values), rel=2e-7)
    for name in values:
        expected = derivative(lambda p, name=name: np.sqrt(variance(**(values | {name: p}))), values[name])
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-6)


def driven(end=float("inf")) -> LinearSystem:
    """x' = -a x + u + g n, y = x + c u, u = b sin t."""
    t, x, n, u, a, b, c, g = (ca.SX.sym(s) for s in ("t", "x", "n", "u", "a", "b", "c", "g"))
    return define_system(
        "driven",
        time=t,
        states={"x": (x, -a * x + u + g * n)},
        noises={"n": n},
        inputs={"u": (u, b * ca.sin(t))},
        outputs={"y": x + c * u, "x": x},
        parameters={"a": (a, 0.8), "b": (b, 2.0), "c": (c, 0.3), "g": (g, 0.5)},
        end=end,
    )


DRIVEN = {"a": 0.8, "b": 2.0, "c": 0.3, "g": 0.5}


def driven_mean(t, a, b, c, g):
    return b * ((a * np.sin(t) - np.cos(t) + np.exp(-a * t)) / (a**2 + 1) + c * np.sin(t))


def driven_std(t, a, b, c, g):
    return g * np.sqrt((1 - np.exp(-2 * a * t)) / (2 * a))


@pytest.mark.parametrize(
    ("quantity", "closed"),
    [
        ("mean", driven_mean),
        ("std", driven_std),
        ("mean_plus_3sigma", lambda t, **p: driven_mean(t, **p) + 3 * driven_std(t, **p)),
    ],
)
def test_mean_and_mean_plus_3sigma_of_a_driven_lag(quantity, closed):
    d = found(driven(), 2.3, quantity)
    for name, value in DRIVEN.items():
        expected = derivative(lambda p, name=name: closed(2.3, **(DRIVEN | {name: p})), value)
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_at_the_peak_the_derivative_is_that_of_the_maximum():
    """Against differences of the maximum over time of the closed form, its time found by another optimiser."""

    def largest(**p):
        best: Any = minimize_scalar(
            lambda t: -driven_mean(t, **p) - 3 * driven_std(t, **p), bounds=(0.5, 4), options={"xatol": 1e-10}
        )
        return -best.fun, best.x

    d = found(driven(end=6.0), "peak", "mean_plus_3sigma")
    value, time = largest(**DRIVEN)
    assert d.attrs["t2_s"] == pytest.approx(time, abs=1e-5)
    assert d.attrs["value"] == pytest.approx(value, rel=1e-9)
    assert not d.attrs["peak_at_end_of_range"]
    for name, at in DRIVEN.items():
        expected = central_difference(lambda p, name=name: largest(**(DRIVEN | {name: p}))[0], at, 0.02).derivative
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-6)


def test_a_peak_at_the_end_says_so():
    d = found(driven(end=1.0), "peak", "mean_plus_3sigma")
    assert d.attrs["t2_s"] == 1.0
    assert d.attrs["peak_at_end_of_range"]


@pytest.mark.parametrize("time", [1.0, 2.0])
def test_a_jump_of_the_state_matrix_is_seen_from_its_sides(time):
    """x' = -a x + n before 1 s, b x + n after it."""
    t, x, n, a, b = (ca.SX.sym(s) for s in ("t", "x", "n", "a", "b"))
    system = define_system(
        "jump",
        time=t,
        states={"x": (x, ca.if_else(t < 1, -a, -b) * x + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"a": (a, 1.0), "b": (b, 3.0)},
        discontinuities=[1.0],
    )

    def variance(a, b):
        before = (1 - np.exp(-2 * a)) / (2 * a)
        s = time - 1
        return before * np.exp(-2 * b * s) + (1 - np.exp(-2 * b * s)) / (2 * b)

    d = found(system, time)
    expected = [derivative(lambda a: variance(a, 3.0), 1.0), derivative(lambda b: variance(1.0, b), 3.0)]
    np.testing.assert_allclose(d["derivative"], expected, rtol=1e-9, atol=1e-15)


def test_one_source_alone():
    t, x, m, n, f, g = (ca.SX.sym(s) for s in ("t", "x", "m", "n", "f", "g"))
    system = define_system(
        "two",
        time=t,
        states={"x": (x, -x + f * m + g * n)},
        noises={"m": m, "n": n},
        outputs={"x": x},
        parameters={"f": (f, 1.0), "g": (g, 2.0)},
    )
    unit = 0.5 * (1 - np.exp(-4.0))
    np.testing.assert_allclose(found(system, 2.0)["derivative"], [2 * unit, 4 * unit], rtol=1e-9)
    np.testing.assert_allclose(found(system, 2.0, source="n")["derivative"], [0, 4 * unit], rtol=1e-9)


# bad input


def test_names_are_checked_and_the_nearest_offered(as504):
    with pytest.raises(UnknownNameError, match="no response 'bending'.*'bending_moment'"):
        as504.sensitivity("bending", 75.0)
    with pytest.raises(UnknownNameError, match="no noise source 'winds'.*'wind'"):
        as504.sensitivity("bending_moment", 75.0, source="winds")
    with pytest.raises(UnknownNameError, match="no quantity 'sdt'.*'std'"):
        as504.sensitivity("bending_moment", 75.0, quantity="sdt")
    with pytest.raises(UnknownNameError, match=r"no parameter 'control.T1.gian'.*'control.T1.gain'"):
        as504.sensitivity("bending_moment", 75.0, parameters=["control.T1.gian"])


@pytest.mark.parametrize(
    "name",
    ["slosh.count", "bending modes", "control.T1.denominator", "wind.synthesis", "loads.0.output", "noise.thrust"],
)
def test_structure_has_no_derivative(as504, name):
    with pytest.raises(StructuralParameterError, match=f"'{name}' is structure, not a number"):
        as504.sensitivity("bending_moment", 75.0, parameters=["control.T1.gain", name])


def test_a_table_is_not_a_parameter(as504):
    with pytest.raises(TableParameterError, match="'mass' is a table, not a parameter: .*table_elasticity"):
        as504.sensitivity("bending_moment", 75.0, parameters=["mass"])


def test_times_are_checked(as504):
    for time, message in ((200.0, "beyond"), (5.0, "before the start"), (10.0, "no history"), ("top", "'peak'")):
        with pytest.raises(TimeRangeError, match=message):
            as504.sensitivity("bending_moment", time)
    with pytest.raises(TimeRangeError, match="no end to search"):
        found(driven(), "peak", "mean")


def test_a_quantity_of_zero_has_no_elasticity_and_its_root_no_derivative():
    study = Study.from_system(driven()).with_parameters({"g": 0.0})
    with pytest.raises(ZeroQuantityError, match="its root has no derivative"):
        study.sensitivity("y", 2.0, quantity="mean_plus_3sigma")
    with pytest.raises(ZeroQuantityError, match="not defined; pass elasticity=False"):
        study.sensitivity("y", 2.0, quantity="variance")
    d = study.sensitivity("y", 2.0, quantity="variance", elasticity=False)
    assert "elasticity" not in d
    np.testing.assert_array_equal(d["derivative"], 0.0)


def test_a_parameter_of_zero_is_named_and_marked():
    study = Study.from_system(driven()).with_parameters({"c": 0.0})
    with pytest.warns(UndefinedElasticityWarning, match="^c: zero"):
        d = study.sensitivity("y", 2.0, quantity="mean")
    assert d["elasticity_defined"].values.tolist() == [1, 1, 0, 1]
    assert d["derivative"].sel(parameter="c").item() == pytest.approx(2.0 * np.sin(2.0), rel=1e-9)


def test_direct_noise_is_refused():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system("d", time=t, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"y": x + n})
    with pytest.raises(DirectNoiseError):
        found(system, 1.0)


@pytest.mark.parametrize("time", [None, [75.0], "75"])
def test_what_is_no_time_is_refused(as504, time):
    with pytest.raises(TimeRangeError, match="is not a time; give seconds"):
        as504.sensitivity("bending_moment", time)
    with pytest.raises(TimeRangeError, match=r"is not a (list of times|time); give seconds"):
        as504.sensitivities(["bending_moment"], [75.0, "peak"] if time == "75" else time and [time])


def test_a_name_alone_is_a_list_of_one(as504):
    found = as504.sensitivities("engine_angle", [12.0], parameters="control.T1.gain")
    assert (found["response"].values.tolist(), found["parameter"].values.tolist()) == (
        ["engine_angle"],
        ["control.T1.gain"],
    )


def test_options_have_no_derivative_and_rows_are_counted(as504):
    with pytest.raises(StructuralParameterError, match="'options.full_coupling' is structure"):
        as504.sensitivity("bending_moment", 75.0, parameters=["options.full_coupling"])
    with pytest.raises(ParameterValueError, match="-1 rows cannot be checked"):
        as504.check_sensitivity("bending_moment", 75.0, rows=-1)


@pytest.mark.parametrize("value", [None, "much", 10**400, float("nan")])
def test_a_value_that_is_no_number_is_refused(as504, value):
    with pytest.raises(ParameterValueError, match="'control.T1.gain' cannot be "):
        as504.with_parameters({"control.T1.gain": value})


@pytest.mark.slow
def test_nothing_follows_the_linear_mean_in_secret(cache, tmp_path):
    """A vehicle that asks for the nonlinear mean is refused where only the linear one is known."""
    study = Study.load("as504", changes={"options.mean_response": "nonlinear"})
    gain = "control.T1.gain"
    plan = {"format": 1, "title": "t", "times": "30", "grid": {"quantity": [{"name": gain, "values": [1.0]}]}}
    for ask in (
        lambda: study.sensitivities(["bending_moment"], [30.0]),
        lambda: study.second_derivatives("bending_moment", 30.0, [gain]),
        lambda: LoadReliefProblem(study, {gain: (0.5, 2.0)}, times=(30.0,)),
    ):
        with pytest.raises(ParameterValueError, match="follows the linear mean response"):
            ask()
    member = run_parameter_study(plan, tmp_path, study=study).data["std"].squeeze("member")
    alone = study.response_statistics([30.0]).std
    across = {"response": ["bending_moment", "engine_angle"], "source": ["thrust", "center_of_pressure"]}
    np.testing.assert_allclose(member.sel(across).values, alone.sel(across).values, rtol=1e-4)


def test_the_peak_is_found_from_three_values_about_it_in_few_steps():
    """Of sin(t) + 0.1 t; a minimum is none, nor what lies below the value in the middle."""
    asked = []

    def quantity(time):
        asked.append(time)
        return np.sin(time) + 0.1 * time, np.cos(time) + 0.1

    times = [1.0, 1.5, 2.5]
    expected = np.arccos(-0.1)
    found = _from_parabola(quantity, times, [quantity(t)[0] for t in times])
    assert found == pytest.approx(expected, abs=1e-9)
    assert len(asked) - len(times) <= 5
    assert _from_parabola(quantity, [4.0, 4.6, 5.0], [quantity(t)[0] for t in (4.0, 4.6, 5.0)]) is None
    assert _from_parabola(quantity, times, [1.0, 1.3, 0.9]) is None
