"""compile=False compiles nowhere: what may choose takes CVODES, what is named and needs a compiler refuses."""

from __future__ import annotations

import numpy as np
import pytest
from lag import GAIN, closed_form, dispersion, lag, normal

from ascentwind.codegen.ensemble.compiled import EnsembleNeedsCompilerError
from ascentwind.codegen.toolchain.compiler import Compiler
from ascentwind.codegen.toolchain.library import NoCompilerError
from ascentwind.model.wind.statistics import WindModel
from ascentwind.runners import Study
from ascentwind.runners.parameter_study import run_parameter_study
from ascentwind.runners.statistics.cvodes import Cvodes
from ascentwind.runners.statistics.engines import engine_from
from ascentwind.runners.statistics.ensemble import Ensemble
from ascentwind.runners.statistics.sweep import Sweep


@pytest.fixture
def interpreted(monkeypatch, tmp_path) -> Study:
    """A study on a machine where compiling would end the test, with an empty cache."""

    system = lag().system
    monkeypatch.setattr(Compiler, "compile", lambda *_: pytest.fail("something was compiled"))
    monkeypatch.setenv("ASCENTWIND_CACHE", str(tmp_path / "cache"))
    return Study.from_system(system, compile=False)


def test_an_engine_left_to_choose_is_cvodes(interpreted):
    found = interpreted.response_statistics([2.0, 3.0], check=True)
    assert found.attrs["engine"] == "cvodes"
    mean, std = closed_form(np.array([2.0, 3.0]))
    np.testing.assert_allclose(found.std.sel(source="combined").values[:, 0], std, rtol=1e-6)
    np.testing.assert_allclose(found.mean.sel(source="combined").values[:, 0], mean, rtol=1e-6)


def test_a_batch_is_computed_by_cvodes(interpreted):
    found = interpreted.batch([{"gain": GAIN}, {"gain": 2 * GAIN}], [2.0, 3.0])
    assert found.attrs["engine"] == "cvodes"
    mean, std = closed_form(np.array([2.0, 3.0]))
    for member, factor in enumerate((1, 2)):
        part = found.dataset.sel(source="combined").isel(member=member, response=0)
        np.testing.assert_allclose(part["std"], factor * std, rtol=1e-6)
        np.testing.assert_allclose(part["mean"], factor * mean, rtol=1e-6)


def test_weighting_functions_of_many_end_times_are_those_of_each(interpreted):
    found = interpreted.weighting_functions([2.0, 3.0], spacing=0.25)
    for time in (2.0, 3.0):
        alone = interpreted.weighting_function(time, spacing=0.25, engine=Cvodes(relative_tolerance=1e-10))
        for name in ("noise_weighting", "input_weighting"):
            family = found[name].sel(time=time)
            expected = alone[name].interp(t=family["t"][family["t"] <= time], method="cubic")
            size = float(abs(alone[name]).max())
            np.testing.assert_allclose(family.sel(t=expected["t"]), expected, atol=1e-4 * size)
            np.testing.assert_allclose(family.sel(t=0.0), alone[name].sel(t=0.0), rtol=1e-7, atol=1e-9 * size)


def test_a_parameter_study_is_computed_by_cvodes(interpreted, tmp_path):
    """Of a lag whose output is its gain times what it is for one."""
    plan = dispersion(12, normal("gain", 0.1)) | {"times": "2, 3", "relative_tolerance": 1e-8}
    found = run_parameter_study(plan, tmp_path / "study", study=interpreted)
    assert found.data.attrs["engine"] == "cvodes"
    assert found.computed.all()
    mean, std = closed_form(np.array([2.0, 3.0]))
    factor = found.data["value"].values / GAIN
    np.testing.assert_allclose(found.data["std"].sel(source="combined").values[:, :, 0], factor * std, rtol=1e-6)
    np.testing.assert_allclose(found.data["mean"].values[:, :, 0], factor * mean, rtol=1e-6)
    again = run_parameter_study(plan, tmp_path / "study", study=interpreted)
    np.testing.assert_array_equal(again.data["std"], found.data["std"])


def test_questions_without_an_engine_are_answered(interpreted):
    std = closed_form(3.0)[1]
    assert interpreted.sensitivity("x", 3.0)["derivative"].sel(parameter="gain") == pytest.approx(std / GAIN, rel=1e-7)
    assert interpreted.sensitivities(["x"], [3.0])["value"].item() == pytest.approx(std, rel=1e-7)
    assert interpreted.second_derivatives("x", 3.0, ["gain"])["second_derivative"].item() == pytest.approx(0, abs=1e-9)
    assert "noise_weighting" in interpreted.weighting_function(3.0)
    assert interpreted.with_parameters({"gain": 1.0}).response_statistics([3.0]).attrs["engine"] == "cvodes"
    assert interpreted.response_statistics([3.0], engine=Cvodes()).attrs["code"] == "interpreter"


@pytest.mark.parametrize(
    ("ask", "refusal"),
    [
        (lambda s, _: s.response_statistics([3.0], engine="sweep"), NoCompilerError),
        (lambda s, _: s.response_statistics([3.0], engine=Sweep()), NoCompilerError),
        (lambda s, _: s.response_statistics([3.0], engine="ensemble"), EnsembleNeedsCompilerError),
        (lambda s, _: s.response_statistics([3.0], engine=Ensemble()), EnsembleNeedsCompilerError),
        (lambda s, _: s.batch([{}], [3.0], engine=Sweep()), NoCompilerError),
        (lambda s, _: s.batch([{}], [3.0], threads=1), NoCompilerError),
        (lambda s, _: s.weighting_functions([3.0], engine="sweep"), NoCompilerError),
        (lambda s, _: s.weighting_functions([3.0], engine=Sweep()), NoCompilerError),
    ],
)
def test_what_needs_a_compiler_refuses(interpreted, tmp_path, ask, refusal):
    with pytest.raises(refusal, match="loaded with compile=False"):
        ask(interpreted, tmp_path)


def test_a_tolerance_alone_leaves_the_choice():
    assert engine_from(None, relative_tolerance=1e-6) == Sweep(1e-6)
    assert engine_from(None, compiled=False, relative_tolerance=1e-6) == Cvodes(relative_tolerance=1e-6)
    assert engine_from("sweep", compiled=False, relative_tolerance=1e-6) == Sweep(1e-6)


@pytest.mark.filterwarnings("ignore:wind filter")  # AS-504's ends at 30 km
def test_a_vehicle_compiles_nowhere(monkeypatch, tmp_path):
    monkeypatch.setattr(Compiler, "compile", lambda *_: pytest.fail("something was compiled"))
    monkeypatch.setenv("ASCENTWIND_CACHE", str(tmp_path / "cache"))
    study = Study.load("as504", compile=False)
    assert study.response_statistics([12.0]).attrs["engine"] == "cvodes"
    assert study.batch([{"thrust.sigma": 0.02}], [12.0]).attrs["engine"] == "cvodes"
    assert study.vehicle is not None
    assert isinstance(study.vehicle.wind, WindModel)
    assert study.with_wind(study.vehicle.wind).response_statistics([11.0]).attrs["engine"] == "cvodes"
