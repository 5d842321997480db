"""Systems far too fast for their flight: every engine ends early and names the fastest root."""

from __future__ import annotations

import json
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ascentwind.model import define_system
from ascentwind.model.errors import DataError, IntegrationError, StepBudgetError
from ascentwind.runners import Ensemble, Study
from ascentwind.runners.case.wind_start import covariance_at
from ascentwind.runners.solvers.step_budget import at_most

FAST = 3e6  # rad/s


def fast_oscillator(frequency: float = FAST) -> Study:
    """A slow lag beside a lightly damped oscillator, both driven."""
    t, n, x, y, v = (ca.SX.sym(s) for s in "tnxyv")
    system = define_system(
        "fast",
        time=t,
        states={"slow": (x, -x + n), "place": (y, v), "speed": (v, -(frequency**2) * y - 0.01 * frequency * v + n)},
        noises={"gust": n},
        outputs={"slow": x, "speed": v},
    )
    return Study.from_system(system)


@pytest.mark.parametrize("engine", ["sweep", "cvodes", "covariance"])
def test_engines_name_the_fastest_root(engine):
    with pytest.raises(StepBudgetError, match=r"-1\.5e\+04 \+- 3e\+06j rad/s, in (place|speed)") as caught:
        fast_oscillator().response_statistics([20.0], engine=engine)
    assert caught.value.time is not None and 0 <= caught.value.time <= 20


def test_weighting_functions_and_sensitivities_name_it_too():
    study = fast_oscillator()
    for ask in (
        lambda: study.sensitivity("speed", 20.0),
        lambda: study.weighting_function(20.0),
        lambda: study.weighting_functions([20.0]),
        lambda: study.batch([{}], [20.0]),
    ):
        with pytest.raises(IntegrationError, match=r"3e\+06j rad/s"):
            ask()


def test_stiff_but_damped_is_no_case_for_a_budget():
    """A damped root of 2000 rad/s over 20 s, against x' = -k x + n, var = (1 - exp(-2 k t)) / 2k."""
    t, n, x, y = (ca.SX.sym(s) for s in "tnxy")
    system = define_system(
        "stiff", time=t, states={"x": (x, -x + n), "y": (y, -2000.0 * y + n)}, noises={"gust": n},
        outputs={"x": x, "y": 40.0 * y},
    )  # fmt: skip
    for engine in ("sweep", "cvodes"):
        variance = Study.from_system(system).response_statistics([20.0], engine=engine).variance.values[0, :, 0]
        np.testing.assert_allclose(variance, [0.5 * (1 - np.exp(-40.0)), 1600.0 / 4000.0], rtol=1e-5)


def test_substeps_of_an_ensemble_are_bounded():
    with pytest.raises(IntegrationError, match=r"substeps of 1e-09 s make 2e\+10"):
        fast_oscillator(1.0).response_statistics([20.0], engine=Ensemble(substep=1e-9))


@pytest.mark.parametrize("engine", ["sweep", "cvodes", "covariance"])
def test_spoiled_vehicle_names_the_block(as504, engine):
    """What a file may no longer say, a parameter still can."""
    name = next(n for n in as504.parameters if n.startswith("slosh") and n.endswith("damping"))
    tank = name.split(".")[1]
    spoiled = as504.with_parameters({name: 1e5})
    with pytest.raises(StepBudgetError, match=rf"fastest root there is -\d.* rad/s, in slosh_rate_{tank}"):
        spoiled.response_statistics([75.0], engine=engine)


def test_spoiled_wind_filter_is_named(vehicle_folder):
    """By the reader already, before any engine steps through it."""
    path = next(vehicle_folder.glob("wind*filter.json"))
    contents = json.loads(path.read_text())
    contents["F_per_m"] = (1e10 * np.array(contents["F_per_m"])).tolist()
    path.write_text(json.dumps(contents))
    with pytest.raises(DataError, match=r"wind of filter 'state_space_fit' has no finite variance at \d.* m; its F"):
        Study.load(vehicle_folder)


def test_start_of_a_wind_filter_far_too_fast_is_ended(as504):
    """What the reader refuses in a file, a filter made in memory still can be."""
    made = as504.vehicle.wind.shaping_filter
    fast = replace(made, F=1e10 * made.F)
    with pytest.raises(StepBudgetError, match="altitude of .* m of the wind filter"):
        covariance_at(fast, 163.0)


def test_scipy_is_ended_after_its_steps():
    with pytest.raises(StepBudgetError, match=r"100 steps and was ended at x = "):
        solve_ivp(at_most(lambda _, y: -1e6 * y, 100, "x = {:g}"), (0, 1), np.ones(1), method="DOP853")
