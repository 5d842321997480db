"""Engines as objects: by name, by object and by their old names the same numbers; what is no engine is refused."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest
from lag import GAIN, closed_form, lag

import ascentwind as aw
from ascentwind import runners
from ascentwind.codegen.toolchain.library import NoCompilerError
from ascentwind.model.deprecation import warn_deprecated
from ascentwind.model.errors import DeprecatedNameWarning, IntegrationError, UnknownNameError
from ascentwind.runners.statistics.engine import Engine
from ascentwind.runners.statistics.engines import ENGINES, engine_of_options, find_engine

FIELDS = ("mean", "std", "variance")
OLD = {
    "SweepOptions": aw.Sweep,
    "IntegratorOptions": aw.Cvodes,
    "CovarianceOptions": aw.CovarianceEquation,
    "EnsembleOptions": aw.Ensemble,
}


@pytest.fixture(scope="module")
def study() -> aw.Study:
    return lag()


@pytest.mark.parametrize("name", ENGINES)
def test_a_name_stands_for_the_engine_with_its_defaults(study, name):
    engine = ENGINES[name]()
    assert isinstance(engine, Engine)
    by_name, by_object = (study.response_statistics([1.0, 3.0], engine=e) for e in (name, engine))
    assert by_name.attrs["engine"] == by_object.attrs["engine"] == name
    for field in FIELDS:
        np.testing.assert_array_equal(by_name[field].values, by_object[field].values)


@pytest.mark.parametrize("engine", [aw.Sweep(1e-9), aw.Cvodes(method="bdf", relative_tolerance=1e-9)])
def test_an_engine_uses_its_own_options(study, engine):
    found = study.response_statistics([3.0], engine=engine)
    assert found.attrs["relative_tolerance"] == 1e-9
    assert found.attrs.get("method", "bdf") == "bdf"
    mean, std = closed_form(3.0)
    np.testing.assert_allclose(found.std.values[0, 0, -1], std, rtol=1e-7)
    np.testing.assert_allclose(found.mean.values[0, 0, -1], mean, rtol=1e-7)


def test_an_engine_of_ones_own_is_an_engine(study):
    class Doubled(aw.Sweep):
        name = "doubled"

        def compute(self, case, times, responses, progress=None):
            found = super().compute(case, times, responses, progress)
            return found.assign(std=2 * found["std"])

    found, plain = (study.response_statistics([3.0], engine=e()) for e in (Doubled, aw.Sweep))
    np.testing.assert_array_equal(found.std.values, 2 * plain.std.values)


@pytest.mark.parametrize("wrong", [aw.Sweep, 3, object(), [aw.Sweep()], {"relative_tolerance": 1e-6}])
def test_what_is_no_engine_is_refused(study, wrong):
    with pytest.raises(IntegrationError, match=r"is no engine; give a name \(sweep, cvodes, covariance, ensemble\)"):
        study.response_statistics([3.0], engine=wrong)


def test_questions_of_one_engine_refuse_another(study):
    with pytest.raises(IntegrationError, match="by Sweep alone, not by Cvodes"):
        study.weighting_functions([3.0], engine=aw.Cvodes())
    with pytest.raises(IntegrationError, match="by Cvodes alone, not by Sweep"):
        study.weighting_function(3.0, engine="sweep")
    with pytest.raises(IntegrationError, match="computed by Sweep or Cvodes, not by CovarianceEquation"):
        study.batch([{}], [3.0], engine="covariance")
    with pytest.raises(IntegrationError, match="leave 'threads' out"):
        study.batch([{}], [3.0], engine="cvodes", threads=1)
    with pytest.raises(UnknownNameError, match="did you mean 'sweep'"):
        study.batch([{}], [3.0], engine="swep")


def test_a_batch_by_each_of_its_engines(study):
    std = closed_form(3.0)[1]
    for engine in ("sweep", "cvodes", aw.Sweep(1e-8), aw.Cvodes(relative_tolerance=1e-8)):
        found = study.batch([{}, {"gain": 2 * GAIN}], [3.0], engine=engine)
        assert found.attrs["engine"] == find_engine(engine).name
        np.testing.assert_allclose(found.std.values[:, 0, 0, -1], [std, 2 * std], rtol=1e-4)


@pytest.mark.parametrize("engine", ["sweep", aw.Sweep(1e-5)])
def test_the_sweep_without_compiled_code_refuses(engine):
    interpreted = aw.Study.from_system(lag().system, compile=False)
    with pytest.raises(NoCompilerError, match="loaded with compile=False.*engine='cvodes'"):
        interpreted.response_statistics([3.0], engine=engine)


@pytest.mark.parametrize("old", OLD)
def test_an_old_name_is_its_successor_and_warns_once(old):
    warn_deprecated.cache_clear()
    with pytest.warns(
        DeprecatedNameWarning, match=f"ascentwind.runners.{old} goes .* use ascentwind.{OLD[old].__name__}$"
    ):
        found = getattr(runners, old)
    assert found is OLD[old]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert getattr(runners, old) is found


def test_the_old_argument_is_the_engine_and_warns(study):
    warn_deprecated.cache_clear()
    tight = aw.Cvodes(relative_tolerance=1e-9)
    with pytest.warns(DeprecatedNameWarning, match="'options' goes with the next release; use engine="):
        found = study.response_statistics([3.0], options=tight)
    expected = study.response_statistics([3.0], engine=tight)
    np.testing.assert_array_equal(found.std.values, expected.std.values)
    named = study.response_statistics([3.0], engine="cvodes", options=tight)
    np.testing.assert_array_equal(named.std.values, expected.std.values)
    with pytest.raises(IntegrationError, match="engine 'sweep' takes no Cvodes"):
        engine_of_options("sweep", tight)
    for question in (
        study.weighting_function(3.0, options=tight),
        study.weighting_functions([3.0], options=aw.Sweep()),
    ):
        assert "noise_weighting" in question
    assert study.batch([{}], [3.0], options=aw.Sweep(1e-6)).attrs["relative_tolerance"] == 1e-6


def test_an_import_of_an_old_name_warns_on_the_users_line():
    program = "from ascentwind.runners import SweepOptions\nprint(SweepOptions(1e-9))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Sweep(relative_tolerance=1e-09")
    assert done.stderr.count("DeprecatedNameWarning") == 1
