"""Engines behind a study: the choice between them, and what only the sweep gives."""

from __future__ import annotations

import numpy as np
import pytest

from ascentwind.codegen.toolchain.library import NoCompilerError
from ascentwind.model.errors import IntegrationError, ParameterValueError, UnknownNameError
from ascentwind.runners import Cvodes, Study, Sweep
from ascentwind.runners.statistics.engines import engine_from

TIMES = (30.0, 75.0, 105.6, 134.34, 140.0)


def test_sweep_is_the_default_and_agrees_with_cvodes(as504):
    """Tight against tight, all responses and sources, end times on both kinds of jumps among them."""
    found = as504.response_statistics(TIMES, engine=Sweep(relative_tolerance=1e-9))
    other = as504.response_statistics(TIMES, engine=Cvodes(relative_tolerance=1e-10))
    assert (found.attrs["engine"], other.attrs["engine"]) == ("sweep", "cvodes")
    assert as504.response_statistics([30.0]).attrs["engine"] == "sweep"
    np.testing.assert_allclose(found.std.values, other.std.values, rtol=1e-6)
    np.testing.assert_allclose(found.mean.values, other.mean.values, rtol=1e-6)


def test_covariances_between_responses_are_consistent(as504):
    """Diagonal: the variances. A response that is a multiple of another has the covariance of that multiple."""
    found = as504.response_statistics([75.0])
    diagonal = np.einsum("tsrr->trs", found["covariance"].values)
    np.testing.assert_allclose(diagonal, found.variance.values, rtol=1e-12)
    correlation = found["covariance"] / np.sqrt(found.variance * found.variance.rename(response="other_response"))
    assert float(abs(correlation).max()) <= 1 + 1e-9
    pair = {"time": 75, "source": "wind", "response": "bending_moment", "other_response": "angle_of_attack"}
    # bending moment and angle of attack rise and fall together at 75 s, where M'_alpha alpha dominates
    assert float(correlation.sel(pair)) > 0.8


def test_batch_is_one_study_after_another(as504):
    sets = [{"wind.sigma_scale": 1.1}, {"control.T1.gain": 0.9, "thrust.sigma": 0.02}, {}]
    found = as504.batch(sets, [60.0, 80.0], engine=Sweep(relative_tolerance=1e-8))
    assert found.variance.dims == ("member", "time", "response", "source")
    for member, changes in enumerate(sets):
        alone = as504.with_parameters(changes).response_statistics([60.0, 80.0], engine=Cvodes(relative_tolerance=1e-9))
        np.testing.assert_allclose(found.std.values[member], alone.std.values, rtol=1e-6)
        np.testing.assert_allclose(found.mean.values[member], alone.mean.values, rtol=1e-5)


def test_batch_refuses_bad_sets_and_threads(as504):
    with pytest.raises(ParameterValueError, match="at least one set"):
        as504.batch([], [60.0])
    with pytest.raises(UnknownNameError, match="did you mean 'thrust.sigma'"):
        as504.batch([{"thrust.sigm": 0.1}], [60.0])
    with pytest.raises(IntegrationError, match="999 threads were asked for"):
        as504.batch([{}], [60.0], threads=999)


def test_weighting_functions_of_all_end_times_are_those_of_each(as504):
    family = as504.weighting_functions([40.0, 41.0], spacing=0.5)
    alone = as504.weighting_function(40.0, spacing=0.5, engine=Cvodes(relative_tolerance=1e-9))
    for name in ("noise_weighting", "input_weighting"):
        mine = family[name].sel(time=40.0)
        both = mine.sel(t=alone["t"], method="nearest", tolerance=1e-9)
        scale = np.abs(alone[name]).max("t").values[..., None]
        assert (np.abs(both - alone[name].values) <= 1e-6 * scale).all()  # zero for the axial force's mean
        assert not mine.sel(t=slice(40.01, None)).any()


def test_engines_are_chosen_by_name_and_refuse_what_they_do_not_take(as504):
    assert engine_from(None) is None
    assert engine_from(None, method="bdf", relative_tolerance=None) == Cvodes(method="bdf")
    assert engine_from(None, relative_tolerance=1e-5) == Sweep(relative_tolerance=1e-5)
    with pytest.raises(IntegrationError, match="engine 'sweep' takes no method"):
        engine_from("sweep", method="bdf")
    with pytest.raises(UnknownNameError, match="no engine 'swep'; did you mean 'sweep'"):
        as504.response_statistics([30.0], engine="swep")
    with pytest.raises(IntegrationError, match="cannot be met"):
        Sweep(relative_tolerance=1e-14)


def test_without_a_compiler_cvodes_is_the_default(monkeypatch):
    monkeypatch.setenv("CC", "")
    study = Study.load("as504", compile=False)
    assert study.response_statistics([15.0]).attrs["engine"] == "cvodes"
    with pytest.raises(NoCompilerError, match="engine='cvodes'"):
        study.response_statistics([15.0], engine="sweep")
