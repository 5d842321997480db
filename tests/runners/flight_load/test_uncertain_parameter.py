"""Levels of flights of which a parameter is uncertain: closed forms, the nominal level, bad input."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import root_scalar
from scipy.stats import norm

from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, UnknownNameError
from ascentwind.runners import Study

SCALE = 3.0


@pytest.fixture(scope="module")
def constant(cache) -> Study:
    """y = scale c, c a constant of a flight of unit variance."""
    c, n, scale, none = (ca.SX.sym(s) for s in ("c", "n", "scale", "none"))
    return Study.from_system(
        define_system(
            "constant",
            time=ca.SX.sym("t"),
            states={"c": (c, 0 * n)},
            noises={"n": n},
            outputs={"y": (scale + none) * c},
            parameters={"scale": (scale, SCALE), "none": (none, 0.0)},
            start_covariance={"n": np.eye(1)},
            end=10.0,
        )
    )


def level_of_mixture(p: float, spread: float) -> float:
    """The size of 3 (1 + spread x) c, x and c normal, that is passed with a probability."""

    def passed(u: float) -> float:
        return 2 * quad(lambda x: norm.pdf(x) * norm.sf(u / (SCALE * abs(1 + spread * x))), -9, 9, epsabs=1e-12)[0]

    return float(root_scalar(lambda u: np.log(passed(u) / p), bracket=(1.0, 60.0)).root)


@pytest.mark.parametrize("spread", [0.02, 0.08, 0.2])
def test_a_constant_of_uncertain_size(constant, spread):
    load = constant.flight_load("y", (0.0, 10.0), [0.01, 0.00135], draws=8000)
    found = load.level_with_uncertain("scale", spread)
    for k, p in enumerate(load.probabilities):
        error = found.attrs["standard_error"][k]
        assert float(found[k]) == pytest.approx(level_of_mixture(p, spread), abs=4 * error)
        assert error < 0.006 * float(found[k])


def test_a_spread_of_nearly_nothing_changes_nothing(constant):
    load = constant.flight_load("y", (0.0, 10.0), [0.01])
    found = load.level_with_uncertain("scale", 1e-6)
    assert float(found[0]) == pytest.approx(SCALE * float(norm.isf(0.005)), abs=4 * found.attrs["standard_error"][0])


@pytest.mark.slow
def test_the_winds_sigma_by_its_soundings(as504):
    """Plain quadrature over levels' probabilities of studies of other sigmas, drawn anew."""
    load = as504.flight_load("bending_moment", (70.0, 80.0), [0.00135])
    found = load.level_with_uncertain()
    spread = 1 / np.sqrt(2 * 79)
    assert found.attrs["spread"] == pytest.approx(spread)
    nodes, weights = np.polynomial.hermite_e.hermegauss(5)
    passed = [
        as504.with_parameters({"wind.sigma_scale": 1 + spread * x})
        .flight_load("bending_moment", (70.0, 80.0), [0.00135], seed=7)
        .probability(float(found[0]))
        for x in nodes
    ]
    w = weights / weights.sum()
    error = np.sqrt(sum((a * p.standard_error) ** 2 for a, p in zip(w, passed, strict=True)))
    slope = load.levels[0].slope
    error = np.hypot(error, 0.00135 * slope * found.attrs["standard_error"][0])
    assert w @ [p.value for p in passed] == pytest.approx(0.00135, abs=4 * error)
    assert error < 0.06 * 0.00135


@pytest.mark.parametrize("spread", [0.0, -0.1, float("nan"), float("inf"), "much", True, 0.3])
def test_spreads_that_are_none_are_refused(constant, spread):
    load = constant.flight_load("y", (0.0, 10.0), [0.01])
    with pytest.raises(ParameterValueError):
        load.level_with_uncertain("scale", spread)


def test_what_cannot_be_uncertain_is_refused(constant):
    load = constant.flight_load("y", (0.0, 10.0), [0.01])
    with pytest.raises(UnknownNameError, match="scale"):
        load.level_with_uncertain("scal", 0.1)
    with pytest.raises(ParameterValueError, match="is 0"):
        load.level_with_uncertain("none", 0.1)
    with pytest.raises(ParameterValueError, match="is not known; give"):
        load.level_with_uncertain("scale")
    with pytest.raises(ParameterValueError, match="not known"):
        load.level_with_uncertain()
