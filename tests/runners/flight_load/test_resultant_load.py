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
from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, PlanesError, UnknownNameError

END = 2.0


def brownian(common: float = 0.0) -> aw.Study:
    """Two Brownian motions from rest, with a part of their noise in common."""
    x, y, n, m = (ca.SX.sym(name) for name in ("x", "y", "n", "m"))
    system = define_system(
        "brownian",
        time=ca.SX.sym("t"),
        states={"x": (x, n), "y": (y, common * n + np.sqrt(1 - common**2) * m)},
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
    return brownian().resultant_load("resultant_load", (0.01, END), [0.05, 1e-3], draws=4000)


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
    assert load.to_dataset()["flight_level"].attrs["units"] == "N m"
    assert "passed with 0.001" in repr(load)


def test_a_limit_over_time_that_is_constant_is_a_level(load):
    level = float(load.level[1])
    assert load.passing([0.0, END], [level, level]).value == pytest.approx(load.probability(level).value, rel=1e-9)
    assert load.passing([0.0, END], [2 * level, level]).value < load.probability(level).value


def test_a_turned_frame_has_the_same_resultant():
    """Fully correlated planes are one motion along the diagonal, sqrt(2) as large: the reflection principle."""
    level = 5.5
    found = brownian(common=1.0).resultant_load("resultant_load", (0.01, END), [1e-3], draws=4000).probability(level)
    u = level / np.sqrt(2 * END)
    expected = 4 * norm.sf(u) - 4 * norm.sf(3 * u)
    assert abs(found.value - expected) < 3.5 * found.standard_error + 0.03 * expected


def test_refused(load):
    study = brownian()
    with pytest.raises(UnknownNameError, match="did you mean 'resultant_load'"):
        study.resultant_load("resultant_lod", (0.5, 1.0))
    with pytest.raises(ParameterValueError, match="no norm"):
        study.resultant_load("resultant_other", (0.5, 1.0))
    with pytest.raises(ParameterValueError, match="probability"):
        study.resultant_load("resultant_load", (0.5, 1.0), [2.0])
    with pytest.raises(ParameterValueError, match="draws"):
        study.resultant_load("resultant_load", (0.5, 1.0), draws=3)
    with pytest.raises(PlanesError, match="both planes"):
        lag().resultant_load("resultant_load", (0.5, 1.0))
    for level in (np.nan, np.inf, "a"):
        with pytest.raises(ParameterValueError, match="finite"):
            load.probability(level)
    for times, limit in (([0.0, 1.0], [1.0]), ([1.0, 0.0], [1.0, 1.0]), ([0.0, 1.0], [1.0, -1.0]), ([0.0], [np.nan])):
        with pytest.raises(ParameterValueError, match="limit"):
            load.passing(times, limit)
