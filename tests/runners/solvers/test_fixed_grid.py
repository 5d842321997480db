"""The sweep on a given grid: against matrix exponentials, its order, what its rule says of members, and bad cases."""

from __future__ import annotations

import logging
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.codegen.sweep.segments import GridSteps, Segments
from ascentwind.codegen.system.executable import executable_system
from ascentwind.model.errors import IntegrationError
from ascentwind.model.system.define import define_system
from ascentwind.runners.solvers import sweep as sweep_module
from ascentwind.runners.solvers.fixed_grid import StepRule, step_rule
from ascentwind.runners.solvers.sweep import MANY, batch, forward_mean, rule_for, sweep, sweep_member
from ascentwind.runners.study import Study

ENDS = np.array([0.5, 1.0, 1.7, 3.0])


def constant(A, B, C, push=0.0):
    """x' = A x + B w + push, y = C x, one source for each noise."""
    t, n = ca.SX.sym("t"), len(A)
    x, w, u = ca.SX.sym("x", n), ca.SX.sym("w", B.shape[1]), ca.SX.sym("u")
    rate = [sum((A[i, j] * x[j] for j in range(n) if A[i, j]), ca.SX(0)) for i in range(n)]
    rate = [rate[i] + sum(B[i, k] * w[k] for k in range(B.shape[1]) if B[i, k]) + push * u for i in range(n)]
    outputs = {f"y{r}": sum((C[r, j] * x[j] for j in range(n) if C[r, j]), ca.SX(0)) for r in range(len(C))}
    return define_system(
        "constant", time=t, states={f"x{i}": (x[i], rate[i]) for i in range(n)},
        noises={f"w{k}": w[k] for k in range(B.shape[1])}, outputs=outputs, inputs={"push": (u, 1.0)}, end=4.0,
    )  # fmt: skip


def exact(A, b, C, time):
    """Covariance of C x from rest under one noise: Van Loan's exponential over a short time, doubled."""
    n, doublings = len(A), max(0, int(np.ceil(np.log2(np.abs(A).sum(axis=1).max() * time + 1e-9))) + 2)
    both = expm(np.block([[-A, np.outer(b, b)], [np.zeros((n, n)), A.T]]) * time / 2**doublings)
    Phi = both[n:, n:].T
    P = Phi @ both[:n, n:]
    for _ in range(doublings):
        P, Phi = P + Phi @ P @ Phi.T, Phi @ Phi
    return C @ P @ C.T


def exact_mean(A, push, C, time):
    n = len(A)
    both = expm(np.block([[A, np.full((n, 1), push)], [np.zeros((1, n + 1))]]) * time)
    return C @ both[:n, n]


def oscillator(w, damping, fast):
    """A lightly damped oscillator behind a fast, well damped lag."""
    return np.array([[-fast, 0.0, 0.0], [0.0, 0.0, 1.0], [w**2, -(w**2), -2 * damping * w]])


def dense(n):
    random = np.random.default_rng(4)
    return random.standard_normal((n, n)) - 4 * np.eye(n)


TWO = np.zeros((7, 7))
TWO[0, 0], TWO[1:4, 1:4], TWO[4:, 4:] = -2.0, oscillator(6.0, 0.02, 60.0), oscillator(9.0, 0.01, 40.0)
TWO[1, 0], TWO[4, 0] = 1.0, -0.5
CASES = {
    "one state": (np.array([[-1.5]]), np.array([[1.0]]), np.array([[2.0]])),
    "a state without a rate of its own": (np.array([[0.0]]), np.array([[1.0]]), np.array([[1.0]])),
    "stiff": (oscillator(7.0, 0.01, 80.0), np.eye(3)[:, :1], np.eye(3)[1:]),
    "two planes that share a noise": (TWO, np.eye(7)[:, [0, 1]], np.eye(7)[[2, 5, 6]]),
    "no structure": (dense(11), np.ones((11, 2)) * [1.0, 0.0] + np.eye(11)[:, :2], np.ones((1, 11))),
    "more columns than a register is wide": (dense(20), np.eye(20)[:, :1], np.eye(20)[[0, 19]]),
    "no noise": (oscillator(3.0, 0.1, 20.0), np.zeros((3, 0)), np.eye(3)[1:2]),
}


def run(system, count, ends=ENDS):
    executable = executable_system(system)
    segments = Segments(0.0, ends, np.zeros(ends.size), np.full(ends.size, 4.0))
    steps = GridSteps.equal(segments, np.full(ends.size, count, np.intc))
    return sweep_of(executable).on_grid(executable, segments, steps, steps=True)


@pytest.mark.parametrize("case", CASES)
def test_is_what_matrix_exponentials_say(case):
    A, B, C = CASES[case]
    found = run(constant(A, B, C, push=0.3), 61)  # more than are eliminated side by side, and not a multiple
    assert found.transition is not None
    for k, time in enumerate(ENDS):
        for s in range(B.shape[1]):
            expected = exact(A, B[:, s], C, time)
            np.testing.assert_allclose(found.covariance[k, s], expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(found.mean[k], exact_mean(A, 0.3, C, time), rtol=1e-8, atol=1e-11)
        length = time - (ENDS[k - 1] if k else 0.0)
        np.testing.assert_allclose(found.transition[k], expm(A * length), atol=1e-8)


def test_is_of_order_eight():
    A, B, C = CASES["stiff"][0].copy(), CASES["stiff"][1], CASES["stiff"][2]
    A[0, 0] = -5.0
    expected = exact(A, B[:, 0], C, 3.0)
    errors = [np.abs(run(constant(A, B, C), n, np.array([3.0])).covariance[0, 0] - expected).max() for n in (12, 24)]
    assert 7.5 < np.log2(errors[0] / errors[1]) < 8.8


@pytest.mark.parametrize("count", [1, 7, 400])
def test_the_mean_between_steps_is_what_matrix_exponentials_say(count):
    A, B, C = CASES["stiff"]
    executable = executable_system(constant(A, B, C, push=0.3))
    times = np.linspace(0.0, 4.0, count + 1)
    found = forward_mean(sweep_of(executable), 1e-11)(executable, times)
    expected = np.array([exact_mean(A, 0.3, np.eye(3), time) for time in times])
    np.testing.assert_allclose(found.states, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(found.outputs, expected @ C.T, atol=1e-9 * np.abs(expected).max())


VEHICLES = [
    ("as504", {}, 24.0, np.array([11.0, 12.0, 40.0, 75.0, 106.0, 107.0, 117.0, 140.0]), 2e-6),
    ("as504", {"planes": "both"}, 24.0, np.array([11.0, 75.0, 107.0]), 2e-6),
    ("falcon1", {}, 240.0, np.array([11.0, 12.0, 30.0, 70.0, 107.0]), 3e-5),  # bending at 135 rad/s lasts
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "changes", "rate", "ends", "within"), VEHICLES)
def test_tables_of_the_mean_hold_what_a_sweep_on_a_grid_fills_itself(name, changes, rate, ends, within):
    """The mean at the stages themselves, against tables of it that everything else reads: by controlled steps here."""
    study = Study.load(name, changes=changes)
    numbers, compiled = study.executable, sweep_of(study.executable)
    assert compiled.fills_means
    rule = StepRule(np.array([0.0, 200.0]), np.full(2, rate), np.full(2, 1e3), 1e-9, 1e-6, fills=True)
    found = sweep_member(compiled, numbers, ends, relative_tolerance=1e-6, rule=rule)
    assert found.counters["rejected"] == 0 and "refined" in found.counters
    filled = study.mean.fill(numbers, forward_mean(compiled, 1e-9))
    expected = sweep(compiled, filled, ends, relative_tolerance=1e-8)
    reached = expected.variance > 0
    assert np.abs(np.sqrt(found.variance[reached] / expected.variance[reached]) - 1).max() < within
    assert (np.abs(found.mean - expected.mean) <= 1e-6 * np.abs(expected.mean).max(axis=0)).all()


def test_only_the_linear_mean_is_filled_within_the_sweep():
    study = Study.load("as504")
    compiled, ends = sweep_of(study.executable), np.array([40.0, 75.0])

    def fill(executable, respond):
        return study.mean.fill(executable, respond)

    kept = rule_for(compiled, study.executable, ends, relative_tolerance=1e-4, fill=fill)
    own = rule_for(compiled, study.executable, ends, relative_tolerance=1e-4, fill=study.mean.fill)
    assert kept is not None and own is not None
    assert (kept.fills, own.fills) == (False, True)


def test_controlled_steps_follow_where_a_grid_fails(monkeypatch):
    executable = executable_system(constant(*CASES["stiff"]))
    compiled = sweep_of(executable)
    rule = rule_for(compiled, executable, ENDS, relative_tolerance=1e-4)
    controlled = sweep(compiled, executable, ENDS, relative_tolerance=1e-4)
    assert rule is not None
    found = sweep_member(compiled, executable, ENDS, relative_tolerance=1e-4, rule=rule)
    assert 0 < np.abs(found.variance / controlled.variance - 1).max() < 2e-4

    def fails(*_):
        raise IntegrationError("nearly singular")

    monkeypatch.setattr(type(rule), "run", fails)
    again = sweep_member(compiled, executable, ENDS, relative_tolerance=1e-4, rule=rule)
    np.testing.assert_array_equal(again.variance, controlled.variance)


def test_a_system_whose_elimination_fills_in_has_no_grid():
    executable = executable_system(constant(dense(33), np.eye(33)[:, :1], np.eye(33)[:1]))
    compiled = sweep_of(executable)
    assert not compiled.takes_a_grid
    assert rule_for(compiled, executable, ENDS, relative_tolerance=1e-4) is None
    assert np.isfinite(sweep(compiled, executable, ENDS).variance).all()


def tuned(w=7.0):
    """The stiff system, its frequency a parameter."""
    t, x, n, p = ca.SX.sym("t"), ca.SX.sym("x", 3), ca.SX.sym("n"), ca.SX.sym("p")
    rates = (-80.0 * x[0] + n, x[2], p**2 * (x[0] - x[1]) - 0.02 * p * x[2])
    return define_system(
        "tuned", time=t, states={f"x{i}": (x[i], rates[i]) for i in range(3)}, noises={"n": n},
        outputs={"y": x[1]}, parameters={"frequency": (p, w)}, end=30.0,
    )  # fmt: skip


def test_a_member_for_whom_the_grid_is_too_coarse_takes_a_finer_one_and_says_so(caplog):
    ends, executable = np.arange(1.0, 31.0), executable_system(tuned())
    compiled = sweep_of(executable)
    rule = rule_for(compiled, executable, ends, relative_tolerance=1e-5)
    assert rule is not None and rule.error <= 1e-5
    for w, finer in ((7.0, False), (6.0, False), (14.0, True), (30.0, True)):
        member = executable.with_numbers(parameters=np.array([w]))
        caplog.clear()
        with caplog.at_level(logging.INFO, logger=sweep_module.__name__.replace("sweep", "fixed_grid")):
            found = sweep_member(compiled, member, ends, relative_tolerance=1e-5, rule=rule)
        assert bool(found.counters["refined"]) == finer == ("too coarse" in caplog.text)
        A = oscillator(w, 0.01, 80.0)
        expected = np.array([exact(A, np.eye(3)[0], np.eye(3)[1:2], time)[0, 0] for time in ends[:3]])
        error = np.abs(np.sqrt(found.variance[:3, 0, 0] / expected) - 1)
        assert (error <= found.error_estimate[:3, 0, 0] + 1e-9).all() and found.error_estimate.max() <= 1e-5


def test_the_rule_looks_at_the_fastest_root_wherever_it_is():
    executable = executable_system(tuned())
    compiled = sweep_of(executable)
    rule = rule_for(compiled, executable, np.arange(1.0, 31.0), relative_tolerance=1e-4)
    assert rule is not None
    np.testing.assert_allclose(rule.roots, 7.0, rtol=1e-3)
    segments = Segments(0.0, np.array([30.0]), np.zeros(1), np.full(1, 30.0))
    assert step_rule(compiled, executable, segments, 1e-4, explicit_steps=1) is None
    assert step_rule(compiled, executable, segments, 1e-7, explicit_steps=10**6) is None
    steps = replace(rule, rates=np.linspace(1.0, 3.0, rule.times.size)).steps(segments)
    assert steps.counts.tolist() == [90] and steps.edges[-1] == 30.0


def test_members_of_a_batch_keep_the_error_that_is_stated():
    study = Study.load("as504")
    random, nominal = np.random.default_rng(3), study.executable.parameters
    sets = nominal * (1 + 0.02 * random.uniform(-1, 1, (MANY, nominal.size)))
    ends, compiled = np.array([12.0, 40.0, 75.0, 107.0, 140.0]), sweep_of(study.executable)
    members = batch(compiled, study.executable, sets, ends, relative_tolerance=1e-4, fill=study.mean.fill)
    assert all("refined" in member.counters for member in members)
    for k in (0, MANY - 1):
        (alone,) = batch(compiled, study.executable, sets[k : k + 1], ends, relative_tolerance=1e-7)
        assert "refined" not in alone.counters
        reached = alone.variance > 0
        ratio = np.sqrt(members[k].variance[reached] / alone.variance[reached])
        assert np.abs(ratio - 1).max() < members[k].error_estimate.max() + 1e-5 < 1e-4
        size = np.sqrt(alone.variance.sum(axis=2))
        assert (np.abs(members[k].mean - alone.mean) < 1e-4 * size).all()
