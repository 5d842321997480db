"""Smooth pulses in the coefficients, which a step passes over, by their closed forms in every engine."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.special import erf

from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.model import define_system
from ascentwind.runners import CovarianceEquation, Cvodes, Study, Sweep
from ascentwind.runners.solvers.sweep import forward_mean

END = 8.0
WIDTHS = [0.3, 0.03, 0.003, 3e-4, 1e-5]


def system_of(pulse, size=1.0, **more):
    """x' = -x + n / 1000 + g(t) m + g(t) u with noises n and m, all times ``size``."""
    t, x, n, m, u = (ca.SX.sym(name) for name in "txnmu")
    g = size * pulse(t)
    return define_system(
        "pulse",
        time=t,
        states={"x": (x, -x + 1e-3 * size * n + g * m + u)},
        noises={"n": n, "m": m},
        inputs={"u": (u, g)},
        outputs={"x": x},
        end=END,
        **more,
    )


def bell(width, centre):
    return lambda t: 10 * ca.exp(-0.5 * ((t - centre) / width) ** 2)


def mean_of_bell(width, centre, end=END):
    """Integral of e^-(end - t) 10 exp(-((t - c) / w)^2 / 2)."""
    within = erf((end - centre - width**2) / width / np.sqrt(2)) + erf((centre + width**2) / width / np.sqrt(2))
    return 10 * np.exp(centre - end + 0.5 * width**2) * width * np.sqrt(np.pi / 2) * within


def variance_of_bell(width, centre, end=END):
    """Integral of e^-2(end - t) 100 exp(-((t - c) / w)^2)."""
    within = erf((end - centre - width**2) / width) + erf((centre + width**2) / width)
    return 100 * np.exp(2 * (centre - end) + width**2) * width * np.sqrt(np.pi) / 2 * within


@pytest.mark.parametrize("centre", [5.0, 5.37, 7.9])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_smooth_pulse_in_every_engine(width, centre):
    study = Study.from_system(system_of(bell(width, centre)))
    expected = mean_of_bell(width, centre), variance_of_bell(width, centre)
    found = {}
    for engine in (Sweep(1e-9), Cvodes(relative_tolerance=1e-9), CovarianceEquation(1e-9)):
        statistics = study.response_statistics([END], engine=engine)
        found[engine.name] = statistics.mean.sel(source="m").item(), statistics.variance.sel(source="m").item()
    pair = study.sensitivity("x", END, source="m", quantity="variance", parameters=[])
    found["collocation"] = pair.attrs["mean"], pair.attrs["variance"]
    for engine, values in found.items():
        np.testing.assert_allclose(values, expected, rtol=1e-6, err_msg=engine)


@pytest.mark.parametrize("size", [1.0, 1e9, 1e-9])
@pytest.mark.parametrize("width", WIDTHS)
def test_forward_mean_of_the_sweep(width, size):
    """Of a pulse in a known input of any size, at few and at many times."""
    study = Study.from_system(system_of(bell(width, 5.37), size))
    for times in (np.array([0.0, END]), np.linspace(0, END, 81)):
        found = forward_mean(sweep_of(study.executable), 1e-9)(study.executable, times)
        assert found.outputs[-1, 0] == pytest.approx(size * mean_of_bell(width, 5.37), rel=1e-7)
        np.testing.assert_array_equal(found.times, times)


@pytest.mark.parametrize("declared", [1e-12, 1.0, 1e12])
def test_forward_mean_with_a_size_misjudged(declared):
    system = system_of(bell(0.03, 5.37), scales={"x": declared})
    times = np.linspace(0, END, 81)
    study = Study.from_system(system)
    found = forward_mean(sweep_of(study.executable), 1e-9)(study.executable, times)
    assert found.outputs[-1, 0] == pytest.approx(mean_of_bell(0.03, 5.37), rel=1e-6)


def test_what_is_smooth_or_switches_or_oscillates_has_no_marks():
    for gain in (
        lambda t: 3 + 0 * t,
        lambda t: t * t - 10 * t + 25,
        lambda t: t * ca.exp(-t / 2),
        lambda t: ca.sin(50 * t),
        lambda t: 1 + ca.tanh(t - 4),
        lambda t: ca.if_else(t < 3, 1.0, 2.0),
    ):
        study = Study.from_system(system_of(gain))
        assert study.executable.pulses(END).size == 0


def test_pulses_among_others():
    """A dip in a damping, a train of pulses, a pulse on top of a slope, and one moved by a parameter."""
    shapes = (
        (lambda t: 1 - ca.exp(-(((t - 3.3) / 1e-4) ** 2)), [3.3]),
        (lambda t: ca.exp(-((ca.sin(np.pi * (t - 0.3)) / 1e-3) ** 2)), np.arange(8) + 0.3),
        (lambda t: t + 5 / (1 + ((t - 6.1) / 1e-4) ** 2), [6.1]),
        (lambda t: 100 * ca.exp(-t) + ca.exp(-(((t - 7.7) / 1e-4) ** 2)), [7.7]),
    )
    for gain, centres in shapes:
        marks = Study.from_system(system_of(gain)).executable.pulses(END)
        for centre in centres:
            assert np.abs(marks - centre).min() < 1e-3, centre
        assert marks.size < 60 * len(centres)
