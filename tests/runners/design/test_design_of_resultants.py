"""Designs of resultants: Rayleigh's level under a limit, in closed form, exact derivatives, CVODES, and bad input."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, PlanesError, UnknownNameError
from ascentwind.runners import Study
from ascentwind.runners.design.design import design, recompute_peaks
from ascentwind.runners.design.peaks import gradients, three_sigma
from ascentwind.runners.design.problem import LoadReliefProblem
from ascentwind.runners.statistics.norm import LIKE_3_SIGMA

LATE = (30.0, 40.0)  # s: a process of rate 1 is stationary by then
RAYLEIGH = np.sqrt(-2 * np.log(LIKE_3_SIGMA))


@pytest.fixture(scope="module")
def regulators(cache) -> Study:
    """x' = -k x + n and its twin: loads of variance 1 / (2 k), efforts k x of k / 2; one input in both planes."""
    x, y, n, m, k, u, push = (ca.SX.sym(name) for name in ("x", "y", "n", "m", "k", "u", "push"))
    system = define_system(
        "regulators",
        time=ca.SX.sym("t"),
        states={"x": (x, -k * x + n + u), "y": (y, -k * y + m + 2 * u)},
        noises={"n": n, "m": m},
        inputs={"u": (u, push)},
        parameters={"k": (k, 1.0), "push": (push, 0.0)},
        outputs={
            "pitch_load": x, "yaw_load": y, "pitch_effort": k * x, "yaw_effort": k * y, "pitch_angle": x,
            "yaw_angle": y,
        },
        end=60.0,
    )  # fmt: skip
    units = {"pitch_angle": "rad", "yaw_angle": "deg"}
    outputs = tuple(replace(o, unit=units.get(o.name, "N m")) for o in system.outputs)
    return Study.from_system(replace(system, outputs=outputs))


def test_optimum_on_a_limit_of_a_resultant_is_the_closed_form_one(regulators):
    """Both planes alike and without a mean: Rayleigh's levels sqrt(-2 ln p) sigma."""
    limit = 1.2 * RAYLEIGH * np.sqrt(0.5)  # of the effort, at k = 1.44
    problem = LoadReliefProblem(
        regulators, {"k": (0.5, 3.0)}, LATE, response="resultant_load", peak_limits={"resultant_effort": limit}
    )
    found = design(problem)
    assert found.values["k"] == pytest.approx(1.44, rel=1e-6)
    assert found.peak == pytest.approx(RAYLEIGH / np.sqrt(2 * 1.44), rel=1e-6)
    assert found.converged
    assert found.quantities[0].side == ""
    again = recompute_peaks(found)
    assert {peak.response for peak in again} == {"resultant_load", "resultant_effort"}
    assert all(peak.agrees for peak in again)


def test_a_resultant_beside_a_response(regulators):
    """The limit is one plane's alone, whose |mean| + 3 sigma is 3 sqrt(k / 2)."""
    problem = LoadReliefProblem(
        regulators, {"k": (0.5, 3.0)}, LATE, response="resultant_load", peak_limits={"pitch_effort": 2.4}
    )
    assert design(problem).values["k"] == pytest.approx(2 * 0.8**2, rel=1e-6)


def test_derivatives_of_levels_with_a_mean_are_those_of_differences(regulators):
    pushed = regulators.with_parameters({"push": 0.7})
    row = ("resultant_effort", 1.0, 3.0)
    found = gradients(pushed, [row], ("k", "push"))[row]
    for name, value in zip(("k", "push"), found, strict=True):
        at = pushed.parameters[name].value
        ends = [
            three_sigma(pushed.with_parameters({name: at + step}), ["resultant_effort"], (3.0,))
            for step in (1e-4, -1e-4)
        ]
        assert ends[0] is not None and ends[1] is not None
        assert value == pytest.approx((ends[0][0, 0, 0] - ends[1][0, 0, 0]) / 2e-4, rel=1e-6)


def test_refused(regulators):
    def ask(response: str, study: Study = regulators) -> None:
        LoadReliefProblem(study, {"k": (0.5, 3.0)}, LATE, response=response)

    with pytest.raises(UnknownNameError, match="did you mean 'resultant_load'"):
        ask("resultant_lod")
    with pytest.raises(ParameterValueError, match="no norm"):
        ask("resultant_angle")
    with pytest.raises(PlanesError, match="both planes"):
        ask("resultant_pitch_load")
