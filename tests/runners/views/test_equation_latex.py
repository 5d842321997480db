"""Equations as LaTeX: SymPy's expression against CasADi's at random points, and what a person reads."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from ascentwind.model import define_system
from ascentwind.model.equations.report_equations import report_equations
from ascentwind.model.errors import UnknownNameError
from ascentwind.runners import Study
from ascentwind.runners.views.equation_latex import equation_latex, to_sympy
from ascentwind.runners.views.equation_page import equations_page

PAGE = Path(__file__).parents[3] / "docs" / "derivatives.md"


def both(expression: ca.SX, symbols: dict[str, ca.SX], point: np.ndarray) -> tuple[float, float]:
    """Value by CasADi and by SymPy."""
    casadi = ca.Function("f", [ca.vertcat(*symbols.values())], [expression])(point)
    names = [sp.Symbol(name, real=True) for name in symbols]
    return float(casadi), float(sp.lambdify(names, to_sympy(expression, symbols))(*point))


def test_every_equation_and_derivative_has_the_same_value(as504):
    random, compared = np.random.default_rng(504), 0
    for equation in report_equations(as504.vehicle).values():
        used = {name: equation.symbols[name] for name in equation.depends_on()}
        point = random.uniform(0.5, 1.5, len(used))
        for expression in (equation.right, *(ca.jacobian(equation.right, x) for x in used.values())):
            casadi, sympy = both(expression, used, point)
            assert sympy == pytest.approx(casadi, rel=1e-12), equation.number
            compared += 1
    assert compared > 120


def test_the_assembled_system_has_the_same_value(as504):
    system, random = as504.system, np.random.default_rng(504)
    symbols = {f"x{i}": system.x[i] for i in range(system.x.numel())}
    symbols |= {f"u{i}": system.u[i] for i in range(system.u.numel())}
    symbols |= {f"v{i}": system.v[i] for i in range(system.v.numel())}
    symbols |= {f"p{i}": system.p[i] for i in range(system.p.numel())}
    casadi, sympy = both(system.output[0], symbols, random.uniform(0.5, 1.5, len(symbols)))
    assert sympy == pytest.approx(casadi, rel=1e-10)


@pytest.mark.parametrize(
    ("function", "point"),
    [
        (lambda x: ca.sqrt(x) + ca.exp(-x) + ca.log(x), 0.7),
        (lambda x: ca.sin(x) * ca.cos(x) / ca.tanh(x) + ca.fabs(-x), 0.3),
        (lambda x: x**2.5 + 2 * x + 1 / x + ca.fmin(x, 2) - ca.atan2(x, 3), 1.7),
    ],
)
def test_functions(function, point):
    x = ca.SX.sym("x")
    casadi, sympy = both(function(x), {"x": x}, np.array([point]))
    assert sympy == pytest.approx(casadi, rel=1e-13)


def test_what_a_person_reads(as504):
    assert equation_latex(as504, "4-3") == r"\alpha = \varphi_Z + \frac{- \dot Y + W}{V_{RS}}"
    slope = r"\frac{\partial \ddot\varphi_Z}{\partial X_{CP}} = \frac{\alpha q C'_N A}{I_{ZZ}}"
    assert equation_latex(as504, "4-2", "center_of_pressure") == slope
    by_velocity = equation_latex(as504, "angle_of_attack", "relative_velocity")
    assert by_velocity.startswith(r"\frac{\partial \alpha}{\partial V_{RS}} = - \frac{")
    assert by_velocity.endswith("{V_{RS}^{2}}")
    assert r"\bar W" in by_velocity
    assert equation_latex(as504, "angle_of_attack", "center_of_pressure").endswith("= 0")


def test_a_long_one_names_its_parts(as504):
    text = equation_latex(as504, "bending_moment", "center_of_pressure")
    assert text.startswith("\\begin{aligned}\n" + r"\frac{\partial M_B}{\partial X_{CP}} &= ")
    assert "\nc_{0} &= " in text
    assert len(text) < 6000


def test_a_system_of_your_own():
    t, x, n, tau = (ca.SX.sym(s) for s in ("t", "x", "n", "tau"))
    system = define_system(
        "lag",
        time=t,
        states={"x": (x, -x / tau + n)},
        noises={"gust": n},
        outputs={"y": x},
        parameters={"tau": (tau, 2.0)},
    )
    study = Study.from_system(system)
    assert equation_latex(study, "x", "tau") == r"\frac{\partial \frac{d}{dt} x}{\partial \mathrm{tau}} = " + (
        r"\frac{x}{\mathrm{tau}^{2}}"
    )


def test_unknown_names_offer_the_nearest(as504):
    with pytest.raises(UnknownNameError, match="no equation 'angle_of_atack'.*'angle_of_attack'"):
        equation_latex(as504, "angle_of_atack")
    with pytest.raises(UnknownNameError, match="no symbol 'center_of_presure'.*'center_of_pressure'"):
        equation_latex(as504, "4-2", "center_of_presure")


@pytest.mark.slow
def test_the_page_is_up_to_date(as504):
    assert PAGE.read_text() == equations_page(as504), "run 'ascentwind equations as504 --page docs/derivatives.md'"
