"""Norms that cannot be: of outputs with different units, of one plane, of numbers that are no pairs; whoever asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.model.errors import AscentwindError, ParameterValueError, PlanesError, UnknownNameError
from ascentwind.runners.design.problem import LoadReliefProblem
from ascentwind.runners.flight_load.limit_table import LimitError

WINDOW = (1.0, 2.0)
NEAR = "did you mean 'resultant_angle'"
UNLIKE = "is in N m and 'yaw_load' (is )?in kN"


@pytest.fixture(scope="module")
def study() -> aw.Study:
    """Outputs of both planes with different units, with one unit, and of one plane alone."""
    x, y, n, m, a = (ca.SX.sym(name) for name in ("x", "y", "n", "m", "a"))
    system = define_system(
        "unlike",
        time=ca.SX.sym("t"),
        states={"x": (x, -x + a * n), "y": (y, -y + a * m)},
        noises={"n": n, "m": m},
        parameters={"a": (a, 1.0)},
        outputs={"pitch_load": x, "yaw_load": y, "pitch_angle": x, "yaw_angle": y, "alone": x},
        end=4.0,
    )
    units = {"pitch_load": "N m", "yaw_load": "kN", "pitch_angle": "rad", "yaw_angle": "rad"}
    outputs = tuple(replace(o, unit=units.get(o.name, "1")) for o in system.outputs)
    return aw.Study.from_system(replace(system, outputs=outputs), compile=False)


def statistics(study: aw.Study) -> aw.ResponseStatistics:
    return study.response_statistics([1.0, 2.0], engine="covariance")


def limits(name: str, unit: str) -> aw.Limits:
    return aw.Limits.over_time(WINDOW, {name: [1.0, 1.0]}, {name: unit})


def design(study: aw.Study, response: str, **limited: float) -> LoadReliefProblem:
    return LoadReliefProblem(study, {"a": (0.5, 2.0)}, (1.0, 2.0), response=response, peak_limits=limited)


ASKED: dict[str, tuple[Callable[[aw.Study], object], type[AscentwindError], str]] = {
    "norm": (lambda s: statistics(s).norm("pitch_load", "yaw_load"), ParameterValueError, UNLIKE),
    "norm of unlike quantities": (
        lambda s: statistics(s).norm("pitch_load", "pitch_angle"), ParameterValueError, "N m and 'pitch_angle' in rad",
    ),
    "resultants by name": (
        lambda s: statistics(s).resultants(names=["resultant_load"]), ParameterValueError, UNLIKE,
    ),
    "all resultants": (lambda s: statistics(s).resultants(), ParameterValueError, UNLIKE),
    "flight's load": (lambda s: s.flight_load("resultant_load", WINDOW), ParameterValueError, UNLIKE),
    "flight's limit": (
        lambda s: s.limit_passage(limits("resultant_load", "N m"), WINDOW), ParameterValueError, UNLIKE,
    ),
    "sensitivity": (lambda s: s.percentile_sensitivity("resultant_load", 1.0), ParameterValueError, UNLIKE),
    "design": (lambda s: design(s, "resultant_load"), ParameterValueError, UNLIKE),
    "limit of a design": (lambda s: design(s, "alone", resultant_load=1.0), ParameterValueError, UNLIKE),
    "limit in one plane's unit": (
        lambda s: s.limit_passage(limits("resultant_angle", "deg"), WINDOW), LimitError, "expected .rad.",
    ),
    "limit on one side": (
        lambda s: s.limit_passage(limits("resultant_angle", "rad"), WINDOW, sides="upper"), LimitError, "no upper side",
    ),
    "load on one side": (
        lambda s: s.flight_load("resultant_angle", WINDOW, sides="lower"), ParameterValueError, "no lower side",
    ),
    "load of one plane": (lambda s: s.flight_load("resultant_alone", WINDOW), PlanesError, "both planes"),
    "design of one plane": (lambda s: design(s, "resultant_alone"), PlanesError, "both planes"),
    "near miss of a load": (
        lambda s: s.flight_load("resultant_angel", WINDOW), UnknownNameError, NEAR,
    ),
    "near miss of a limit": (
        lambda s: s.limit_passage(limits("resultant_angel", "rad"), WINDOW), LimitError, NEAR,
    ),
    "near miss of a design": (lambda s: design(s, "resultant_angel"), UnknownNameError, NEAR),
    "no covariances": (
        lambda s: s.response_statistics([1.0], engine="cvodes").norm("pitch_angle", "yaw_angle"),
        ParameterValueError, "needs the covariance",
    ),
}  # fmt: skip


@pytest.mark.parametrize("asked", ASKED)
def test_what_has_no_norm_is_refused_by_name(study, asked):
    ask, kind, text = ASKED[asked]
    with pytest.raises(kind, match=text):
        ask(study)


EYE = np.eye(2)
NUMBERS: dict[str, tuple[Any, Any, str]] = {
    "three components": (np.zeros(3), np.eye(3), "shapes"),
    "a mean of other shape": (np.zeros((4, 2)), EYE, "shapes"),
    "a variance alone": (np.zeros(2), np.ones(2), "shapes"),
    "a mean that is no number": ([np.nan, 0.0], EYE, "not finite"),
    "an infinite variance": (np.zeros(2), np.diag([np.inf, 1.0]), "not finite"),
    "two covariances": (np.zeros(2), [[1.0, 0.5], [0.2, 1.0]], "not symmetric"),
    "a correlation beyond one": (np.zeros(2), [[1.0, 1.5], [1.5, 1.0]], "positive semidefinite"),
    "a negative variance": (np.zeros(2), np.diag([1.0, -0.5]), "positive semidefinite"),
}


@pytest.mark.parametrize("numbers", NUMBERS)
def test_numbers_that_are_no_pair_are_refused(numbers):
    mean, covariance, text = NUMBERS[numbers]
    with pytest.raises(ParameterValueError, match=text):
        aw.NormOfNormal(mean, covariance)


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, 1.5, np.nan, np.inf])
def test_probabilities_without_a_level(probability):
    with pytest.raises(ParameterValueError, match="probability"):
        aw.NormOfNormal(np.zeros(2), EYE).percentile(probability)


def test_what_agrees_is_not_refused(study):
    found = statistics(study).resultants(names=["resultant_angle"])
    assert found.dataset["unit"].values.tolist() == ["rad"]
    assert design(study, "resultant_angle").response == "resultant_angle"
