"""Limits passed jointly: closed forms, the road by one output, plain paths, bounds."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.stats import norm

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.runners import Study
from ascentwind.runners.flight_load import limits as limits_module
from ascentwind.runners.flight_load import load as load_module
from ascentwind.runners.flight_load import sampling
from ascentwind.runners.flight_load.crossings import Boundary
from ascentwind.runners.flight_load.process import ManyOutputs, joint_outputs
from ascentwind.runners.flight_load.sampling import draw_beyond
from ascentwind.runners.flight_load.window import window_chain
from ascentwind.runners.statistics.percentiles import Sides

WINDOW, DESIGN = (1.0, 5.0), 0.00135
UNITS = {"x": "m", "y": "m", "sum": "m", "minus": "m", "double": "m", "still": "m", "idle": "m"}


@pytest.fixture(scope="module", autouse=True)
def few_steps():
    """The same 160 steps of 0.025 s on both roads."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limits_module, "STEPS", 160)
        patch.setattr(load_module, "STEPS", 160)
        yield


@pytest.fixture(scope="module")
def pair(cache) -> Study:
    """Two independent lags x and y with other rates, what follows from them, and two constants of a flight."""
    t, x, y, c, d, v, n, m, k = (ca.SX.sym(s) for s in ("t", "x", "y", "c", "d", "v", "n", "m", "k"))
    return Study.from_system(
        define_system(
            "pair",
            time=t,
            states={
                "x": (x, -0.7 * x + n),
                "y": (y, -0.4 * y + m),
                "c": (c, 0 * c),
                "d": (d, -1e-9 * d + 1e-9 * k),
                "v": (v, x - v),
            },
            noises={"n": n, "m": m, "k": k},
            outputs={
                "x": x,
                "y": y,
                "sum": x + 0.5 * y + v,
                "minus": -x,
                "double": 2 * x,
                "still": c,
                "idle": d,
            },
            units=UNITS,
            start_covariance={"n": np.diag([0.5, 0, 4.0, 0, 0.1]), "k": np.diag([0, 0, 0, 1.0, 0])},
            end=10.0,
        )
    )


def over(**values: float) -> aw.Limits:
    columns = {name: [value, value] for name, value in values.items()}
    return aw.Limits.over_time([0.0, 10.0], columns, UNITS)


def passage(study: Study, values: dict[str, float], draws: int = 2000, seed: int = 1, sides: Sides = "both"):
    return study.limit_passage(over(**values), WINDOW, DESIGN, sides=sides, draws=draws, seed=seed)


def same(one, other, expected: float | None = None) -> None:
    """Hold two estimates, or one and a number, against each other: 4 standard errors."""
    error = one.standard_error if expected is not None else np.hypot(one.standard_error, other.standard_error)
    assert abs(one.value - (other.value if expected is None else expected)) < 4 * error
    assert error < 0.06 * one.value  # the comparison says something


@pytest.mark.parametrize("sides", ["both", "upper", "lower"])
@pytest.mark.parametrize("limit", [2.5, 4.5])
def test_many_outputs_are_as_one(pair, sides, limit):
    one = pair.flight_load("sum", WINDOW, limit=over(sum=limit), sides=sides, draws=2000).passage
    other = passage(pair, {"sum": limit}, sides=sides)
    same(one.probability, other.probability)
    assert other.margin_of_safety == pytest.approx(one.margin_of_safety, abs=0.02)
    np.testing.assert_allclose(other.level.sel(time=3.0), one.level.sel(time=3.0), rtol=1e-6)


@pytest.fixture(scope="module")
def small(pair) -> tuple[ManyOutputs, np.ndarray]:
    """All outputs at 25 times, and the dense covariance of everything with everything, (m, r, m, r)."""
    chain = window_chain(pair, WINDOW, 24)
    P, C = chain.covariance(), chain.output
    R = np.empty((*C.shape[:2], *C.shape[:2]))
    for i in range(len(P)):
        moved = P[i]
        for j in range(i, len(P)):
            if j > i:
                moved = chain.transition[j - 1] @ moved
            R[j, :, i, :] = C[j] @ moved @ C[i].T
            R[i, :, j, :] = R[j, :, i, :].T
    return ManyOutputs(chain, C, chain.mean), R


def test_covariances_are_those_of_the_dense_formula(pair, small):
    process, R = small
    points, outputs = np.array([7, 0, 24, 7, 3, 11]), np.array([2, 0, 1, 4, 5, 2])
    found = process.covariances(points, outputs)
    np.testing.assert_allclose(found, R[points, outputs], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(process.std**2, np.einsum("mrmr->mr", R), rtol=1e-11)
    for r in range(process.row.shape[1]):
        alone = joint_outputs(process.chain, process.row[:, [r]], process.mean[:, [r]])
        np.testing.assert_allclose(alone.covariance[:, 0, :, 0], R[:, r, :, r], rtol=1e-11, atol=1e-14)
        np.testing.assert_allclose(process.between[:, [r]], alone.between, rtol=1e-5, atol=1e-5)


def test_deviations_have_those_covariances(small):
    process, R = small
    count = 20_000
    drawn = process.deviations(np.random.default_rng(5), count)
    m, r = process.mean.shape
    R = R.reshape(m * r, m * r)
    flat = drawn.reshape(count, -1)
    error = np.sqrt((np.outer(np.diagonal(R), np.diagonal(R)) + R**2) / count)
    # of 15,000 pairs, most of them dependent, the largest of so many independent ones would be 4.2
    assert np.abs(flat.T @ flat / count - R).max() <= 5 * error.max()
    assert (np.abs(flat.T @ flat / count - R) <= 5 * error + 1e-12).all()
    assert (np.abs(flat.mean(axis=0)) <= 5 * np.sqrt(np.diagonal(R) / count)).all()


@pytest.mark.slow
def test_constants_have_their_closed_form(pair):
    """A constant of a flight passes with 2 (1 - Phi(u / sigma)); two of them with 1 - (1 - P1) (1 - P2)."""
    first, second = (2 * float(norm.sf(sigmas)) for sigmas in (1.0, 0.8))
    found = passage(pair, {"still": 2.0, "idle": 0.8}, draws=1000)
    same(found.probability, None, 1 - (1 - first) * (1 - second))
    np.testing.assert_allclose(found.by_load, [first, second], rtol=0.08)
    assert found.probability.value < 0.9 * (first + second)
    # at the design probability: 1 - (1 - p1) (1 - p2) = 0.00135 with both limits times the factor
    f = found.factor
    both = 1 - (1 - 2 * norm.sf(f.value)) * (1 - 2 * norm.sf(0.8 * f.value))
    assert both == pytest.approx(DESIGN, rel=4 * f.probability.standard_error / DESIGN)


def test_independent_outputs_multiply_what_they_keep(pair):
    one, other = (passage(pair, {name: limit}).probability for name, limit in (("x", 1.6), ("y", 1.5)))
    both = passage(pair, {"x": 1.6, "y": 1.5}).probability
    expected = 1 - (1 - one.value) * (1 - other.value)
    error = np.hypot(both.standard_error, np.hypot(one.standard_error, other.standard_error))
    assert abs(both.value - expected) < 4 * error
    assert one.value + other.value - expected > 8 * error  # adding would be seen


def test_an_output_and_its_double_pass_together(pair):
    one, both = passage(pair, {"x": 2.0}), passage(pair, {"x": 2.0, "double": 4.0, "minus": 2.0})
    same(one.probability, both.probability)
    np.testing.assert_allclose(both.by_load, both.probability.value, rtol=1e-9)
    assert both.factor.value == pytest.approx(one.factor.value, rel=0.01)


def test_upward_of_an_output_and_its_negative_is_both_sides(pair):
    same(passage(pair, {"x": 2.0, "minus": 2.0}, sides="upper").probability, passage(pair, {"x": 2.0}).probability)
    lower, upper = (
        passage(pair, {"x": 2.0}, sides="lower").probability,
        passage(pair, {"minus": 2.0}, sides="upper").probability,
    )
    same(lower, upper)


def test_bounds_and_single_outputs(pair):
    values = {"x": 2.2, "y": 2.4, "sum": 3.4}
    found = passage(pair, values)
    p, each = found.probability, found.by_load.values
    assert p.largest_instant < each.max() < p.value < each.sum() < p.sum_of_instants
    for name, chance in zip(values, each, strict=True):
        alone = passage(pair, {name: values[name]}).probability
        assert chance == pytest.approx(alone.value, abs=5 * np.hypot(alone.standard_error, p.standard_error))
    assert float(found.by_time.sum()) * np.diff(WINDOW)[0] / 60 == pytest.approx(p.value, rel=1e-9)


@pytest.mark.parametrize("c", [0.5, 3.0])
def test_the_factor_scales_with_the_limits(pair, c):
    found = passage(pair, {"x": 2.0, "y": 2.5})
    scaled = passage(pair, {"x": 2.0 * c, "y": 2.5 * c})
    assert scaled.factor.value == pytest.approx(found.factor.value / c, rel=1e-6)
    assert 1 + scaled.margin_of_safety == pytest.approx(c * (1 + found.margin_of_safety), rel=1e-6)


def test_limits_times_the_factor_are_passed_with_the_design_probability(pair):
    f = passage(pair, {"x": 2.0, "y": 2.5}).factor
    again = passage(pair, {"x": 2.0 * f.value, "y": 2.5 * f.value}, seed=99)
    error = np.hypot(again.probability.standard_error, f.probability.standard_error)
    assert abs(again.probability.value - DESIGN) < 4 * error < 0.3 * DESIGN


def test_limits_that_nothing_comes_near(pair):
    found = passage(pair, {"x": 1e3, "y": 1e3})
    assert found.probability.value < 1e-300
    assert not found.by_time.any()
    assert found.margin_of_safety > 100
    found.to_dataset()


def test_a_limit_below_the_mean_is_said(pair):
    study = with_mean()
    with pytest.warns(aw.errors.CertainPassageWarning, match="limit of x lies below its mean at"):
        found = study.limit_passage(aw.Limits.constant(1.0, "x", "m"), WINDOW)
    assert found.probability.value == pytest.approx(1.0, abs=1e-3)
    assert (found.margin < 0).any()


def with_mean() -> Study:
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    parts = {"states": {"x": (x, -x + 0.1 * n + u)}, "noises": {"n": n}, "inputs": {"u": (u, 2.0)}}
    return Study.from_system(define_system("driven", time=t, outputs={"x": x}, units={"x": "m"}, end=10.0, **parts))


# ---- Stations of a vehicle: plain paths on the same grid, and what is left out.


@pytest.fixture(scope="module")
def stations(as504, tmp_path_factory):
    """AS-504's bending moment and shear force at all stations against limits passed by some 5 %, at 240 times."""
    file = tmp_path_factory.mktemp("limits") / "limit.csv"
    file.write_text("station [m],bending_moment [N m],shear_force [N]\n0,21e6,1.4e6\n30,21e6,1.4e6\n111,6e6,0.7e6\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limits_module, "STEPS", 240)
        return as504.limit_passage(file, (70.0, 82.0), draws=4000)


@pytest.mark.slow
def test_stations_by_plain_paths(stations):
    """No importance sampling: a path keeps a step with 1 - exp(-2 a b / (s^2 dt)), of all loads the least."""
    process, limit = stations.process, stations.limit
    grid, random, kept = process.drawn, np.random.default_rng(11), []
    variance = 0.5 * (grid.diffusion[1:] ** 2 + grid.diffusion[:-1] ** 2) * np.diff(grid.times)[:, None]
    for _ in range(80):
        path = grid.mean + process.deviations(random, 100)
        ways = []
        for sign in (1.0, -1.0):
            gap = limit - sign * path
            with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
                passes = np.exp(-2 * gap[:, 1:] * gap[:, :-1] / variance)
            passes = np.where(variance > 0, passes, 0.0)
            passes[(gap[:, 1:] < 0) | (gap[:, :-1] < 0)] = 1.0
            ways.append(np.minimum(passes, 1.0))
        turned = grid.diffusion[1:] < 0
        same_way = np.where(turned, ways[1], ways[0]).max(axis=2), np.where(turned, ways[0], ways[1]).max(axis=2)
        kept.append(np.prod((1 - same_way[0]) * (1 - same_way[1]), axis=1))
    kept = 1 - np.concatenate(kept)
    plain, error = kept.mean(), kept.std() / np.sqrt(kept.size)
    found = stations.probability
    assert 0.01 < plain < 0.2
    assert abs(found.value - plain) < 4 * np.hypot(error, found.standard_error)
    assert found.largest_instant < found.value < found.sum_of_instants
    assert stations.by_load.max() <= found.value < stations.by_load.sum()


@pytest.mark.slow
def test_what_is_left_out_of_the_draws_is_as_little_as_said(stations):
    process, limit = stations.process, stations.limit
    boundary = Boundary.around(limit, "both")
    points, outputs = sampling._worth_drawing(process, boundary)
    assert outputs is not None
    assert outputs.size < limit.shape[1]
    left = limit.copy()
    left[points][:, outputs] = np.inf
    left[np.ix_(np.arange(limit.shape[0])[points], outputs)] = np.inf
    draws = draw_beyond(process, Boundary.around(left, "both"), np.random.default_rng(3), 2000)
    chance = draws.contributions(Boundary.around(left, "both"))
    assert 0 <= chance.mean() <= sampling.LEFT_OUT * stations.probability.value
