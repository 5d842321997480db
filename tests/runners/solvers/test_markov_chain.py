"""A flight as a Markov chain: its two roads, covariances in closed form, discontinuities, the start."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from switched_system import NOMINAL, pieces, switched_system

from ascentwind.model import define_system
from ascentwind.runners import Study, Sweep
from ascentwind.runners.solvers.markov_chain import MarkovChain, chain_by_exact_steps, chain_by_sweep
from ascentwind.runners.solvers.sweep import available_sweep

RATE = 0.7


def decaying() -> Study:
    """x' = -RATE x + n from rest, v' = x: Ornstein-Uhlenbeck; w' = n, z' = w: integrated white noise; a known input."""
    t, x, w, z, n, m, u = (ca.SX.sym(s) for s in ("t", "x", "w", "z", "n", "m", "u"))
    return Study.from_system(
        define_system(
            "decaying",
            time=t,
            states={"x": (x, -RATE * x + n + u), "w": (w, m + 0 * w), "z": (z, w)},
            noises={"n": n, "m": m},
            outputs={"x": x, "z": z, "both": x + z},
            inputs={"u": (u, 1.0)},
            start=1.0,
            end=20.0,
        )
    )


def by_sweep(study: Study, times, tolerance: float = 1e-9) -> MarkovChain:
    engine = available_sweep(study.executable)
    assert engine is not None
    return chain_by_sweep(engine, study.with_means, np.asarray(times, float), tolerance)


def by_exact_steps(study: Study, times, substep: float = 0.01) -> MarkovChain:
    return chain_by_exact_steps(study.with_means, np.asarray(times, float), substep)


ROADS = {"sweep": by_sweep, "exact steps": by_exact_steps}


def between_times(chain: MarkovChain, output: int) -> np.ndarray:
    """R(t, s) of an output, all sources, one element after another."""
    P, C, m = chain.covariance(), chain.output[:, output], chain.times.size
    R = np.empty((m, m))
    for i in range(m):
        moved = P[i] @ C[i]
        for j in range(i, m):
            if j > i:
                moved = chain.transition[j - 1] @ moved
            R[i, j] = R[j, i] = C[j] @ moved
    return R


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("times", [[1.0, 1.5, 3.0, 9.0], [4.0, 4.1, 4.2, 12.0], np.linspace(1.0, 20.0, 39)])
def test_covariance_between_times_has_its_closed_form(road, times):
    """From rest at t0: exp(-a (s - t)) (1 - exp(-2 a (t - t0))) / 2a; (t - t0)^2 (3 (s - t0) - (t - t0)) / 6."""
    study = decaying()
    chain = ROADS[road](study, times)
    early, late = np.minimum.outer(*2 * [chain.times]) - 1.0, np.maximum.outer(*2 * [chain.times]) - 1.0
    lag = np.exp(-RATE * (late - early)) * (1 - np.exp(-2 * RATE * early)) / (2 * RATE)
    integrated = early**2 * (3 * late - early) / 6
    for output, expected in enumerate((lag, integrated, lag + integrated)):
        np.testing.assert_allclose(between_times(chain, output), expected, rtol=1e-7, atol=1e-12 * expected.max())
    np.testing.assert_allclose(chain.mean[:, 0], (1 - np.exp(-RATE * (chain.times - 1.0))) / RATE, rtol=1e-7)
    # sources stay apart: the lag knows nothing of the other noise
    assert not chain.added[:, 1, 0].any()
    assert not chain.added[:, 0, 1:].any()


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize(
    "times",
    [
        [0.0, 0.5, 3.0],  # one step holds all three switches
        [0.8, 2.2, 2.5],
        [1.0, 1.5, 2.0],  # grid points on the switches, taken from the left
        [0.9, 0.95, 1.05, 1.7],
        [2.5, 2.6, 4.0],  # after all of them
    ],
)
def test_discontinuities_are_kept_wherever_the_grid_lies(road, times):
    study = Study.from_system(switched_system())
    chain = ROADS[road](study, times)
    variance = np.einsum("mi,mij,mj->m", chain.output[:, 0], chain.covariance(), chain.output[:, 0])
    expected = np.array([pieces(NOMINAL, time) for time in times])
    np.testing.assert_allclose(variance, expected[:, 0], rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(chain.mean[:, 0], expected[:, 1], rtol=1e-8, atol=1e-12)
    late = np.array(times) > NOMINAL["t3"]
    np.testing.assert_array_equal(chain.output[:, 0, 0], np.where(late, 2.0, 1.0))
    np.testing.assert_array_equal(chain.state_matrix[:, 0, 0], np.where(np.array(times) > NOMINAL["t1"], -0.3, -1.0))


def test_a_start_covariance_is_where_the_chain_begins():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system(
        "lag",
        time=t,
        states={"x": (x, -RATE * x + n)},
        noises={"n": n},
        outputs={"x": x},
        start_covariance={"n": np.array([[2.0]])},
    )
    for road in ROADS.values():
        chain = road(Study.from_system(system), [0.0, 1.0])
        np.testing.assert_allclose(chain.covariance()[0, 0, 0], 2.0, rtol=1e-12)
        stationary = 1 / (2 * RATE)
        expected = stationary + (2.0 - stationary) * np.exp(-2 * RATE)
        np.testing.assert_allclose(chain.covariance()[1, 0, 0], expected, rtol=1e-8)


def test_a_part_of_a_chain_is_the_chain_over_its_times():
    whole = by_sweep(decaying(), np.linspace(2.0, 10.0, 17))
    part, points = whole.part(slice(5, 12)), slice(5, 12)
    np.testing.assert_array_equal(part.times, whole.times[points])
    for acting in (None, [0], [1]):
        np.testing.assert_allclose(part.covariance(acting), whole.covariance(acting)[points], rtol=1e-13)
    np.testing.assert_allclose(between_times(part, 2), between_times(whole, 2)[points, points], rtol=1e-13)
    assert len(part.transition) == part.times.size - 1


@pytest.mark.slow
def test_as504_by_both_roads(as504):
    """Covariances of all responses between all times, relative to their standard deviations."""
    times = np.linspace(60.0, 64.0, 41)
    chain = by_sweep(as504, times)
    names = as504.system.output_names
    found = as504.response_statistics(times[::10], responses=names, engine=Sweep(relative_tolerance=1e-9))
    by_source = [chain.covariance([k]) for k in range(len(as504.system.sources))]
    variance = np.einsum("mri,smij,mrj->mrs", chain.output, by_source, chain.output)[::10]
    np.testing.assert_allclose(variance, found.variance.values[..., :-1], rtol=2e-9)
    errors = []
    for substep in (0.02, 0.01):
        other = by_exact_steps(as504, times, substep)
        a, b = (np.array([between_times(c, r) for r in range(len(names))]) for c in (chain, other))
        size = np.sqrt(np.einsum("rii->ri", a))
        errors.append(np.abs((a - b) / (size[:, :, None] * size[:, None, :])).max())
    assert errors[0] < 1e-6
    assert errors[1] < 0.3 * errors[0]  # of second order in the substep: the sweep is where the exact steps go
