"""Columns of the sweep by the states that reach them: which stand together, and what leaving out zeros changes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ascentwind.codegen.sweep.kinds import kinds, reaching, spans
from ascentwind.model import define_system
from ascentwind.runners import Study


def sparsity(matrix: np.ndarray) -> ca.Sparsity:
    return ca.DM(ca.sparsify(ca.DM(matrix.astype(float)))).sparsity()


@given(st.integers(1, 12), st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_reaching_is_the_closure_of_a(n, seed, share):
    A = np.random.default_rng(seed).random((n, n)) < share
    closure = np.linalg.matrix_power(np.eye(n, dtype=int) + A, n) > 0
    assert [sorted(x) for x in reaching(sparsity(A))] == [np.flatnonzero(row).tolist() for row in closure]


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(0, 2**32 - 1), st.floats(0.0, 0.2))
def test_kinds_hold_every_state_once_and_all_that_reaches_it(n, seed, share):
    A = sparsity(np.random.default_rng(seed).random((n, n)) < share)
    found = kinds(A, 8)
    assert sorted(state for kind in found for state in kind.states) == list(range(n))
    for kind in found:
        assert set().union(*(reaching(A)[state] for state in kind.states)) <= set(kind.rows)
    assert [kind.first for kind in found] == np.cumsum([0, *(kind.blocks for kind in found)])[:-1].tolist()
    assert sum(kind.blocks * len(kind.rows) for kind in found) <= -(-n // 8) * n


def test_two_planes_are_two_kinds_and_one_is_one():
    block = np.ones((20, 20))
    both = np.block([[block, np.zeros((20, 20))], [np.zeros((20, 20)), block]])
    assert [(kind.states, kind.rows) for kind in kinds(sparsity(both), 8)] == [
        (tuple(range(20)),) * 2,
        (tuple(range(20, 40)),) * 2,
    ]
    assert len(kinds(sparsity(block), 8)) == 1


def test_spans_join_neighbours():
    both = np.kron(np.eye(3), np.ones((10, 10)))
    found = kinds(sparsity(both), 8)
    assert spans(found, [0, 10], 8) == [(0, 32)]
    assert spans(found, [0, 20], 8) == [(0, 16), (32, 48)]
    assert spans(found, [], 8) == []


def chains(groups: int, each: int, shared: bool, seed: int) -> Study:
    """Chains of lags that see no other, driven by one noise for all or one each, and a lag that drives all of them."""
    random = np.random.default_rng(seed)
    x = [[ca.SX.sym(f"x_{g}_{i}") for i in range(each)] for g in range(groups)]
    z, m, u = ca.SX.sym("z"), ca.SX.sym("m"), ca.SX.sym("u")
    noises = {"n": ca.SX.sym("n")} if shared else {f"n_{g}": ca.SX.sym(f"n_{g}") for g in range(groups)}
    order = list(noises.values())
    states = {"z": (z, -0.7 * z + m)}
    for i in range(each):  # states of all chains by turns: columns of a kind are not neighbours in the system
        for g in range(groups):
            before = x[g][i - 1] if i else z + order[0 if shared else g] + u
            rate = -random.uniform(0.5, 3.0) * x[g][i] + random.uniform(0.5, 2.0) * before
            states[f"x_{g}_{i}"] = (x[g][i], rate + (random.uniform(-0.5, 0.5) * x[g][-1] if i == 0 else 0))
    return Study.from_system(
        define_system(
            "chains",
            time=ca.SX.sym("t"),
            states=states,
            noises={**noises, "m": m},
            outputs={f"y_{g}": ca.sum1(ca.vertcat(*x[g])) for g in range(groups)}
            | {"sum": ca.sum1(ca.vertcat(*(state for part in x for state in part)))},
            inputs={"u": (u, ca.SX(0.3))},
            start_covariance={"m": np.diag([0.5, *[0.0] * (groups * each)])},
            end=6.0,
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("groups", "each", "shared"), [(2, 9, True), (2, 9, False), (3, 5, True), (4, 3, False), (1, 6, True)]
)
def test_the_sweep_of_blocks_that_never_see_each_other_is_the_covariance_equation(groups, each, shared):
    study = chains(groups, each, shared, seed=groups)
    times = [0.5, 2.0, 6.0]
    sweep = study.response_statistics(times, engine="sweep").dataset
    equation = study.response_statistics(times, engine="covariance").dataset
    for name in ("mean", "covariance"):
        scale = np.abs(equation[name].values).max()
        np.testing.assert_allclose(sweep[name].values, equation[name].values, rtol=1e-5, atol=1e-7 * scale)
