"""The largest resultant over a window: the plane's Brownian motion in closed form, its own instants, bad input."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from lag import lag
from scipy.special import j1, jn_zeros
from scipy.stats import norm

import ascentwind as aw
from ascentwind import Limits
from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, PlanesError, UnknownNameError
from ascentwind.runners.flight_load.norms import Norms
from ascentwind.runners.flight_load.passage import LimitedLoad, Passage
from ascentwind.runners.flight_load.window import MOST_KEPT, window_chain

END = 2.0
NAME, WINDOW = "resultant_load", (0.01, END)


def brownian(common: float = 0.0) -> aw.Study:
    """Two Brownian motions from rest, with a part of their noise in common."""
    x, y, n, m, a, b = (ca.SX.sym(name) for name in ("x", "y", "n", "m", "a", "b"))
    system = define_system(
        "brownian",
        time=ca.SX.sym("t"),
        states={"x": (x, a * n), "y": (y, b * (common * n + np.sqrt(1 - common**2) * m))},
        parameters={"a": (a, 1.0), "b": (b, 1.0)},
        noises={"n": n, "m": m},
        outputs={"pitch_load": x, "yaw_load": y, "pitch_other": x, "yaw_other": y},
        end=END,
    )
    units = {"pitch_other": "N", "yaw_other": "m"}
    outputs = tuple(replace(o, unit=units.get(o.name, "N m")) for o in system.outputs)
    return aw.Study.from_system(replace(system, outputs=outputs), compile=False)


def leaves_circle(radius: float, time: float) -> float:
    """P(plane Brownian motion from the centre leaves a circle by a time): 1 - sum 2 exp(-j^2 t / 2 R^2) / (j J1(j))."""
    j = jn_zeros(0, 400)
    return float(1.0 - np.sum(2.0 / (j * j1(j)) * np.exp(-(j**2) * time / (2.0 * radius**2))))


@pytest.fixture(scope="module")
def load():
    return brownian().flight_load("resultant_load", (0.01, END), [0.05, 1e-3], draws=4000)


@pytest.mark.parametrize("level", [3.0, 4.5, 5.5])
def test_plane_brownian_motion_leaves_a_circle(load, level):
    found = load.probability(level)
    expected = leaves_circle(level, END)
    assert abs(found.value - expected) < 3.5 * found.standard_error + 0.03 * expected
    assert found.standard_error < 0.06 * expected
    assert found.largest_instant == pytest.approx(np.exp(-(level**2) / (2 * END)), rel=1e-3)
    assert found.largest_instant < found.value


def test_levels_are_passed_with_their_probabilities(load):
    for p, level, (low, high) in zip((0.05, 1e-3), load.level.values, load.interval.values, strict=True):
        slope = (np.log(leaves_circle(level, END)) - np.log(leaves_circle(level * 1.001, END))) / (0.001 * level)
        true = level + (np.log(leaves_circle(level, END)) - np.log(p)) / slope
        assert low - 0.01 * level < true < high + 0.01 * level
    assert (load.level.values > load.instant_level.values).all()
    assert load.level.attrs["units"] == "N m"
    assert "passed with 0.001" in repr(load)


@pytest.mark.slow
def test_a_limit_over_time(load):
    level = float(load.level[1])
    rising = Limits.over_time([0.0, END], {NAME: [level, 2 * level]}, {NAME: "N m"})
    found = [brownian().flight_load(NAME, WINDOW, 1e-3, limit=limit).passage for limit in (level, rising)]
    expected = leaves_circle(level, END)
    assert abs(found[0].probability.value - expected) < 3.5 * found[0].probability.standard_error + 0.03 * expected
    assert found[1].probability.value < 0.1 * expected
    assert found[0].factor.value == pytest.approx(1.0, abs=0.02)
    assert found[0].loads[0].resultant
    left = found[0].margin.values[-1, 0]
    assert left == pytest.approx(level - np.sqrt(-2 * END * np.log(1e-3)), rel=1e-6)  # Rayleigh's law at the end


@pytest.mark.slow
def test_a_resultant_and_a_response_are_limited_jointly():
    """A response beside resultants is one with nothing: as by itself, and both are not passed together less often."""
    study = brownian()
    limits = Limits.over_time(
        [0.0, END], {NAME: [5.2, 5.2], "pitch_load": [4.6, 4.6]}, {NAME: "N m", "pitch_load": "N m"}
    )
    found = study.limit_passage(limits, WINDOW, 1e-3, draws=4000)
    alone = study.flight_load("pitch_load", WINDOW, 1e-3, draws=4000).probability(4.6)
    norm_alone, both = leaves_circle(5.2, END), found.probability
    one = float(found.by_load[1])
    assert abs(one - alone.value) < 4 * np.hypot(2 * both.standard_error, alone.standard_error) + 0.03 * one
    assert max(one, norm_alone) < both.value + 3 * both.standard_error
    assert both.value < one + norm_alone
    assert [load.resultant for load in found.loads] == [True, False]


@pytest.mark.slow
def test_a_turned_frame_has_the_same_resultant():
    """Fully correlated planes are one motion along the diagonal, sqrt(2) as large: the reflection principle."""
    level = 5.5
    found = brownian(common=1.0).flight_load("resultant_load", (0.01, END), [1e-3], draws=4000).probability(level)
    u = level / np.sqrt(2 * END)
    expected = 4 * norm.sf(u) - 4 * norm.sf(3 * u)
    assert abs(found.value - expected) < 3.5 * found.standard_error + 0.03 * expected


@pytest.mark.slow
def test_derivatives_of_a_level(load):
    """The level is homogeneous in both scales and symmetric in them: half a per cent per cent of each."""
    found = load.sensitivity(1e-3)
    elasticity = found["elasticity"].sel(parameter=["a", "b"]).values
    np.testing.assert_allclose(elasticity, 0.5, atol=0.05)
    assert elasticity.sum() == pytest.approx(1.0, abs=0.01)
    assert found["envelope_elasticity"].sum() == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_sources_share_the_level(load):
    """Each source is one plane's: half of the deviation, and without it the other plane alone, by reflection."""
    found = load.shares
    np.testing.assert_allclose(found["share"].values, 0.5, atol=0.05)
    for p, level in zip(load.probabilities, found["level_without"].values[:, 0], strict=True):
        assert level == pytest.approx(-np.sqrt(END) * norm.ppf(p / 4), rel=0.03)


@pytest.mark.slow
def test_the_curve_of_exceedance_and_the_time_of_the_maximum(load):
    curve = load.exceedance
    for level, p, error in zip(curve["level"].values, curve.values, curve["standard_error"].values, strict=True):
        expected = leaves_circle(float(level), END)
        assert abs(p - expected) < 4 * error + 0.05 * expected
    when = load.time_of_maximum
    width = float(when["time"][1] - when["time"][0])
    np.testing.assert_allclose(when.sum("time") * width, 1.0, atol=1e-6)
    assert float(when.sel(given="0.001") @ when["time"]) * width > 0.9 * END  # such a level is reached late


def test_refused(load):
    study = brownian()
    with pytest.raises(UnknownNameError, match="did you mean 'resultant_load'"):
        study.flight_load("resultant_lod", (0.5, 1.0))
    with pytest.raises(ParameterValueError, match="no norm"):
        study.flight_load("resultant_other", (0.5, 1.0))
    with pytest.raises(ParameterValueError, match="probability"):
        study.flight_load("resultant_load", (0.5, 1.0), [2.0])
    with pytest.raises(ParameterValueError, match="draws"):
        study.flight_load("resultant_load", (0.5, 1.0), draws=3)
    with pytest.raises(PlanesError, match="both planes"):
        lag().flight_load("resultant_x", (0.5, 1.0))
    with pytest.raises(ParameterValueError, match="no upper side"):
        study.flight_load("resultant_load", (0.5, 1.0), sides="upper")
    with pytest.raises(ParameterValueError, match="no formula"):
        load.upcrossing_rate(1.0)
    for level in (np.nan, np.inf, "a"):
        with pytest.raises(ParameterValueError, match="finite"):
            load.probability(level)


def test_chains_are_kept_but_not_without_end():
    """The same question is answered once; of many questions the last few are kept."""
    study = brownian()
    first = window_chain(study, WINDOW, 8)
    assert window_chain(study, WINDOW, 8) is first
    others = [window_chain(study, WINDOW, steps) for steps in range(9, 9 + MOST_KEPT - 1)]
    assert window_chain(study, WINDOW, 8) is first
    assert window_chain(study, WINDOW, 40) is not None
    assert window_chain(study, WINDOW, 8) is first
    assert window_chain(study, WINDOW, 9) is not others[0]


@pytest.mark.slow
def test_many_resultants_that_are_one_pass_together():
    """A pair, itself turned, and half of itself under one limit: passed as often as the first alone."""
    study, level = brownian(), 5.0
    chain = window_chain(study, WINDOW, 400)
    C, mean = chain.output[:, [0, 1, 1, 0, 0, 1]], chain.mean[:, [0, 1, 1, 0, 0, 1]]
    C[:, 4:] *= 0.5
    process = Norms.many(chain, C, mean)
    loads = tuple(LimitedLoad(name, "N m", resultant=True) for name in ("own", "turned", "half"))
    limit = np.full((chain.times.size, 3), level)
    found = Passage(study, loads, process, limit, "both", 1e-3, 3000, 1)
    expected = leaves_circle(level, END)
    p = found.probability
    assert abs(p.value - expected) < 3.5 * p.standard_error + 0.03 * expected
    np.testing.assert_allclose(found.by_load.values[:2], p.value, rtol=1e-9)
    assert found.by_load.values[2] < 1e-3 * expected  # twice the limit: some 1e-11
    assert found.factor.value == pytest.approx(5.49 / level, rel=0.02)  # the level of 1e-3
    assert found.level.shape == (chain.times.size, 3)
