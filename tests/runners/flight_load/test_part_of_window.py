"""Only the part of a window in which a level is passed is drawn: what it is, and that nothing is lost by it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from maxima import ornstein_uhlenbeck, passing_of_ornstein_uhlenbeck
from scipy.stats import norm

from ascentwind.model import define_system
from ascentwind.runners import Study
from ascentwind.runners.flight_load import window
from ascentwind.runners.flight_load.process import joint_covariance
from ascentwind.runners.flight_load.response import LEFT_OUT, ResponseInWindow
from ascentwind.runners.flight_load.window import PARTS, PartOfWindow, window_chain


def humps(*spans: tuple[float, float, float], rest: float = 0.01) -> Study:
    """y = sum f_i(t) x_i, x_i stationary of unit variance, f_i a size within a span of time, else less."""
    t = ca.SX.sym("t")
    states, noises, y, start = {}, {}, ca.SX(0), {}
    for k, (begin, end, size) in enumerate(spans):
        x, n = ca.SX.sym(f"x{k}"), ca.SX.sym(f"n{k}")
        states[f"x{k}"], noises[f"n{k}"] = (x, -x + np.sqrt(2) * n), n
        y += ca.if_else(ca.logic_and(t >= begin, t < end), size, rest) * x
        start[f"n{k}"] = np.diag(np.eye(len(spans))[k])
    return Study.from_system(
        define_system(
            "humps", time=t, states=states, noises=noises, outputs={"y": y}, start_covariance=start, end=100.0
        )
    )


def test_the_level_of_a_span_is_that_of_a_flight_of_its_length():
    """Four seconds of a hundred matter: the chance is that of a stationary process to pass within four seconds."""
    load = humps((70.0, 74.0, 1.0)).flight_load("y", (0.0, 100.0), (0.01, 1e-5), draws=8000)
    for k, p in enumerate(load.probabilities):
        begin, end = load.parts[k].window
        assert 60.0 < begin <= 70.0 and 74.0 <= end < 80.0
        low, high = (passing_of_ornstein_uhlenbeck(-u, u, 4.0) for u in load.interval.values[k])
        assert high * 0.98 < p < low * 1.02  # and what the grid of times may miss


def test_what_is_left_out_is_rare():
    """A standard deviation of 1 within a span and of 0.8 elsewhere: all instants left out, by the normal law."""
    load = humps((30.0, 60.0, 1.0), rest=0.8).flight_load("y", (0.0, 100.0), 1e-3, draws=400)
    assert load.parts[0].window == (0.0, 100.0)
    study = humps((30.0, 60.0, 1.0), rest=0.5)
    load = study.flight_load("y", (0.0, 100.0), 1e-3, draws=400)
    begin, end = load.parts[0].window
    assert 20.0 < begin <= 30.0 and 60.0 <= end < 70.0
    seen = np.linspace(0.0, 100.0, 2401)
    level = norm.isf(0.5e-3)
    beyond = norm.sf(level / np.where((seen >= 30.0) & (seen < 60.0), 1.0, 0.5))
    outside = (seen < begin) | (seen > end)
    assert beyond[outside].sum() <= 4 * LEFT_OUT * beyond.max()  # four times as many instants as are scouted


def test_parts_are_cut_out_of_one_chain_and_are_as_chains_of_their_own(monkeypatch):
    study, made, whole = humps((10.0, 40.0, 1.0), (30.0, 60.0, 2.0)), [], (0.0, 100.0)

    def counted(case, times, relative_tolerance):
        made.append((times[0], times[-1]))
        return made_of(case, times, relative_tolerance)

    made_of = window._chain
    monkeypatch.setattr(window, "_chain", counted)
    parts = [PartOfWindow(whole, first, last, 12) for first, last in ((4, 6), (2, 5), (3, 6), (9, 11), (7, 8))]
    chains = [part.chain(study) for part in parts]
    edges = np.linspace(*whole, PARTS + 1)
    np.testing.assert_allclose(made, [(edges[first], edges[last]) for first, last in ((4, 6), (2, 6), (2, 11))])
    for first, last in ((1, 2), (20, 21), (2, 4), (20, 21)):
        PartOfWindow(whole, first, last, 16).chain(study)
    apart = [(edges[first], edges[last]) for first, last in ((1, 2), (20, 21), (1, 4))]  # without what lies between
    np.testing.assert_allclose(made[3:], apart)
    assert PartOfWindow(whole, 0, 24, 500).chain(study).times.size == 12001
    PartOfWindow(whole, 3, 4, 500).chain(study)
    assert len(made) == 7
    for part, chain in zip(parts, chains, strict=True):
        own = window_chain(study, part.span, 12 * (part.last - part.first))
        np.testing.assert_allclose(chain.times, own.times, rtol=1e-13)
        np.testing.assert_allclose(chain.covariance([1]), own.covariance([1]), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(chain.output, own.output, rtol=1e-9)


@pytest.mark.slow
def test_both_humps_are_seen_and_each_source_alone_where_it_acts():
    """The second hump, a little lower, adds its own chance; without the first source it alone makes the level."""
    load = humps((20.0, 24.0, 1.0), (80.0, 84.0, 0.45)).flight_load("y", (0.0, 100.0), 1e-3, draws=16000)
    begin, end = load.parts[0].window
    assert begin > 10.0 and end < 30.0  # 0.45 sigma is never as large as 3.3
    without = load.shares["level_without"].sel(source="n0").item()
    assert passing_of_ornstein_uhlenbeck(-without / 0.45, without / 0.45, 4.0) == pytest.approx(1e-3, rel=0.1)
    equal = humps((20.0, 24.0, 1.0), (80.0, 84.0, 0.999)).flight_load("y", (0.0, 100.0), 1e-3, draws=400)
    begin, end = equal.parts[0].window
    assert begin <= 20.0 and end >= 84.0


def test_a_side_is_looked_at_where_its_mean_is():
    """A mean that falls from 3 to -3: flights pass the upper level early and the lower level late."""
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    study = Study.from_system(
        define_system(
            "falling",
            time=t,
            states={"x": (x, -x + np.sqrt(2) * n)},
            noises={"n": n},
            inputs={"u": (u, 3 - 0.06 * t)},
            outputs={"y": x + u},
            start_covariance={"n": np.eye(1)},
            end=100.0,
        )
    )
    parts = [
        study.flight_load("y", (0.0, 100.0), 1e-3, sides=sides, draws=400).parts[0].window
        for sides in ("upper", "lower", "both")
    ]
    assert parts[0][0] == 0.0 and parts[0][1] < 75.0
    assert parts[1][0] > 25.0 and parts[1][1] == 100.0
    assert parts[2] == (0.0, 100.0)


@pytest.mark.parametrize("rows", [[0], [0, 0]])
@pytest.mark.parametrize("stride", [1, 4])
def test_the_covariance_between_all_times_is_exponential(rows, stride):
    """R(t, s) = exp(-|t - s|) of a stationary process, in every block of times."""
    study = ornstein_uhlenbeck(end=10.0)
    of = ResponseInWindow(study, "y", (0.0, 10.0), 600)
    chain = window_chain(of.case, of.window, 600, 1e-10)
    found = joint_covariance(chain, chain.output[:, rows], stride=stride)
    times = chain.times[::stride]
    expected = np.exp(-np.abs(times[:, None] - times))
    for a in range(len(rows)):
        for b in range(len(rows)):
            np.testing.assert_allclose(found[:, a, :, b], expected, rtol=0, atol=1e-8)
