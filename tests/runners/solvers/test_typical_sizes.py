"""Sizes are relative: noise, inputs, outputs, gains and time in any unit, by every engine, against closed forms."""

from __future__ import annotations

import warnings
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ascentwind.model import define_system
from ascentwind.model.errors import IntegrationError, UnstableSystemWarning
from ascentwind.runners import CovarianceEquation, Cvodes, Study
from ascentwind.runners.solvers import adjoint
from ascentwind.runners.solvers.typical_sizes import typical_sizes

ENGINES = ("sweep", "cvodes", "covariance")
TOLERANCE = {"sweep": 1e-7, "cvodes": 1e-6, "covariance": 1e-8}  # of a standard deviation, engines as they are


@pytest.fixture(scope="module")
def lag(cache) -> Study:
    """x' = a x + g n + u, z' = k x + a z, y = c x, chain = z: everything that has a size is a parameter."""
    t, x, z, n, w = (ca.SX.sym(s) for s in ("t", "x", "z", "n", "w"))
    a, g, c, k, u = (ca.SX.sym(s) for s in ("a", "g", "c", "k", "u"))
    return Study.from_system(
        define_system(
            "sizes",
            time=t,
            states={"x": (x, a * x + g * n + w), "z": (z, k * x + a * z)},
            noises={"n": n},
            inputs={"w": (w, u)},
            outputs={"y": c * x, "chain": z},
            parameters={"a": (a, -1.0), "g": (g, 1.0), "c": (c, 1.0), "k": (k, 1.0), "u": (u, 0.0)},
        )
    )


def closed_form(times: np.ndarray, a=-1.0, g=1.0, c=1.0, k=1.0, u=0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return standard deviations of both responses and the mean of the first, with s = |a| t.

    The chain's weighting function is k g s' exp(-|a| s'), whose square integrates to (1 - e^-2s (1 + 2 s + 2 s^2)) / 4
    over |a|^3.
    """
    s, rate = -a * times, -a
    first = abs(c * g) * np.sqrt(-np.expm1(-2 * s) / (2 * rate))
    chain = abs(k * g) * np.sqrt((1 - np.exp(-2 * s) * (1 + 2 * s + 2 * s**2)) / 4 / rate**3)
    return first, chain, -c * u * np.expm1(-s) / rate


SIZES = {
    "noise 1e8": {"g": 1e8},
    "noise 1e-8": {"g": 1e-8},
    "noise 1e-30": {"g": 1e-30},
    "output 1e-14": {"c": 1e-14},
    "output 1e14": {"c": 1e14},
    "input 1e15": {"u": 1e15},
    "input 1e-8 beside noise 1e-8": {"u": 1e-8, "g": 1e-8},
    "gain 1e12": {"k": 1e12},
    "gain 1e-12": {"k": 1e-12},
    "microseconds": {"a": -1e6},
    "days": {"a": -1e-4},
    "all at once": {"g": 1e-9, "k": 1e9, "c": 1e-9, "u": 1e-3},
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("numbers", SIZES.values(), ids=list(SIZES))
def test_any_size_has_its_closed_form_and_the_check_agrees(lag, numbers, engine):
    times = np.array([0.5, 3.0]) / abs(numbers.get("a", -1.0))
    found = lag.with_parameters(numbers).response_statistics(times, engine=engine, check=True)
    first, chain, mean = closed_form(times, **numbers)
    np.testing.assert_allclose(found.std.values[:, :, -1], np.stack([first, chain], axis=1), rtol=TOLERANCE[engine])
    np.testing.assert_allclose(found.mean.values[:, 0, 0], mean, rtol=1e-6)
    assert found["discretisation_difference"].values.max() < TOLERANCE[engine]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scale", [1e14, 1e-9], ids=["far too large", "far too small"])
def test_a_size_declared_wrongly_costs_no_accuracy(lag, engine, scale):
    system = replace(lag.system, outputs=tuple(replace(o, scale=scale) for o in lag.system.outputs))
    found = Study.from_system(system).response_statistics([0.5, 3.0], engine=engine)
    first, chain, _ = closed_form(np.array([0.5, 3.0]))
    np.testing.assert_allclose(found.std.values[:, :, -1], np.stack([first, chain], axis=1), rtol=TOLERANCE[engine])


def test_the_check_sees_a_misjudged_size(lag, monkeypatch):
    def misjudging(executable, time):
        found = typical_sizes(executable, time)
        return found and replace(found, outputs=1e12 * found.outputs)

    monkeypatch.setattr(adjoint, "typical_sizes", misjudging)
    found = lag.response_statistics([3.0], engine="cvodes", check=True)
    first, chain, _ = closed_form(np.array([3.0]))
    off = np.abs(found.std.values[0, :, -1] / [first[0], chain[0]] - 1)
    assert off.max() > 1e-3  # a tolerance of 1e-10 of a trillion times the response
    seen = found["discretisation_difference"].values[0, :, -1]
    assert (seen[off > 1e-5] > 0.5 * off[off > 1e-5]).all()


def test_sizes_are_those_of_the_closed_form(lag):
    """The matrices of a lag are constant, so that steps are exact but for the quadrature of the noise."""
    found = typical_sizes(lag.with_parameters({"g": 1e-8, "k": 1e12}).executable, 3.0)
    assert found is not None
    first, chain, _ = closed_form(found.times, g=1e-8, k=1e12)
    np.testing.assert_allclose(found.outputs[:, 0], np.stack([first, chain], axis=1), rtol=1e-6)


def test_a_first_end_time_of_no_length_does_not_spoil_the_others(lag):
    times = np.array([1e-12, 1e-9, 1e-3, 2.0, 2.0 + 1e-6, 4.0])
    found = lag.response_statistics(times)
    first, chain, _ = closed_form(times)
    np.testing.assert_allclose(found.std.values[:, 0, -1], first, rtol=1e-7)
    # below a millisecond the closed form of the chain is lost in rounding; there it is t^3 / 3
    chain[:3] = np.sqrt(times[:3] ** 3 / 3 * np.exp(-1.5 * times[:3]))
    np.testing.assert_allclose(found.std.values[:, 1, -1], chain, rtol=1e-6)


def test_a_mean_without_noise_is_integrated_to_its_tolerance(lag):
    """With the noise turned down to nothing, errors have only the mean to be measured by."""
    found = lag.with_parameters({"g": 0.0, "u": 2.0}).response_statistics([0.5, 3.0, 9.0])
    _, _, mean = closed_form(np.array([0.5, 3.0, 9.0]), u=2.0)
    np.testing.assert_allclose(found.mean.values[:, 0, 0], mean, rtol=1e-7)
    assert (found.std.values == 0).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_growth_beyond_numbers_ends_early_and_quietly(lag, engine, capfd):
    """x' = 2 x: the variance passes 1e308 at 177 s."""
    growing = lag.with_parameters({"a": 2.0})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnstableSystemWarning)
        fine = growing.response_statistics([10.0], engine=engine).std.values[0, 0, -1]
        with pytest.raises(IntegrationError, match="range of numbers"):
            growing.response_statistics([200.0], engine=engine)
    assert fine == pytest.approx(np.sqrt(np.expm1(40.0) / 4), rel=1e-6)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("options", [Cvodes, CovarianceEquation])
@pytest.mark.parametrize("part", [0.0, -1.0, 2.0, float("nan")])
def test_absolute_parts_that_make_no_sense_are_refused(options, part):
    with pytest.raises(IntegrationError, match="absolute part"):
        options(absolute_part=part)
