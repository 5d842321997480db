"""Second derivatives against closed forms and against differences of the first."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, UnknownNameError
from ascentwind.runners import Study

AT = {"a": 0.8, "b": 2.0, "c": 0.3, "g": 0.5, "s": 0.6}
TIME = 1.7


@pytest.fixture(scope="module")
def driven(cache) -> Study:
    """x' = -a x + u + g n, y = (1 + c^2) x, u = b^2, Var x = s^2 at the start."""
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    p = {name: ca.SX.sym(name) for name in AT}
    system = define_system(
        "second",
        time=t,
        states={"x": (x, -p["a"] * x + u + p["g"] * n)},
        noises={"n": n},
        inputs={"u": (u, p["b"] ** 2)},
        outputs={"y": (1 + p["c"] ** 2) * x},
        parameters={name: (p[name], AT[name]) for name in AT},
        start_covariance={"n": p["s"] ** 2},
    )
    return Study.from_system(system)


def closed(quantity: str) -> ca.Function:
    """Value, gradient and Hessian of the closed form by CasADi."""
    p = ca.SX.sym("p", len(AT))
    a, b, c, g, s = ca.vertsplit(p)
    decay = ca.exp(-2 * a * TIME)
    variance = (1 + c**2) ** 2 * (g**2 * (1 - decay) / (2 * a) + s**2 * decay)
    mean = (1 + c**2) * b**2 * (1 - ca.exp(-a * TIME)) / a
    value = {
        "variance": variance,
        "mean": mean,
        "std": ca.sqrt(variance),
        "mean_plus_3sigma": mean + 3 * ca.sqrt(variance),
    }[quantity]
    hessian, gradient = ca.hessian(value, p)
    return ca.Function("closed", [p], [value, gradient, hessian])


@pytest.mark.parametrize("quantity", ["variance", "mean", "std", "mean_plus_3sigma"])
def test_closed_form(driven, quantity):
    d = driven.second_derivatives("y", TIME, list(AT), quantity=quantity)
    value, gradient, hessian = (np.array(x) for x in closed(quantity)(list(AT.values())))
    assert d.attrs["value"] == pytest.approx(value.item(), rel=1e-13)
    np.testing.assert_allclose(d["derivative"], gradient.ravel(), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(d["second_derivative"], hessian, rtol=1e-12, atol=1e-13)
    assert d.attrs["asymmetry"] < 1e-13


@pytest.mark.slow
def test_as504_against_differences_of_the_first(as504):
    """Through the networks, the noise columns and the mean."""
    names = ["control.T1.gain", "center_of_pressure.sigma", "wind.mean_scale"]
    d = as504.second_derivatives("bending_moment", 30.0, names, quantity="mean_plus_3sigma")
    for j, name in enumerate(names):
        value = as504.parameters[name].value

        def first(change: float, name=name, value=value) -> np.ndarray:
            study = as504.with_parameters({name: value * (1 + change)})
            found = study.sensitivities(["bending_moment"], [30.0], quantity="mean_plus_3sigma", parameters=names)
            return found["derivative"].values[0, 0]

        fine, coarse = ((first(h) - first(-h)) / (2 * h * value) for h in (1e-3, 2e-3))
        expected = fine + (fine - coarse) / 3
        np.testing.assert_allclose(d["second_derivative"][:, j], expected, rtol=1e-6, err_msg=name)
    assert d.attrs["asymmetry"] < 1e-9


def test_bad_input(driven):
    with pytest.raises(ParameterValueError, match="0 parameters were asked for"):
        driven.second_derivatives("y", TIME, [])
    with pytest.raises(UnknownNameError, match="no parameter 'aa'.*'a'"):
        driven.second_derivatives("y", TIME, ["aa"])
