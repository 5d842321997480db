"""The loads of AS-504's flights against flights that the ensemble flies, on the same grid of times."""

from __future__ import annotations

import numpy as np
import pytest

from ascentwind.runners.flight_load.crossings import Boundary
from ascentwind.runners.flight_load.probability import Level, find_level
from ascentwind.runners.flight_load.process import Grid, JointOutputs
from ascentwind.runners.solvers.ensemble import run_ensemble

RESPONSES = ("bending_moment", "angle_of_attack", "engine_angle")
WINDOW, FLIGHTS, SPACING = (40.0, 100.0), 4000, 0.1


@pytest.fixture(scope="module")
def flown(as504) -> np.ndarray:
    """The largest size of each response in each flight, (flights, responses)."""
    rows, found = [as504.system.output_index(name) for name in RESPONSES], []
    for part in range(FLIGHTS // 1000):
        result = run_ensemble(
            as504.with_means,
            [WINDOW[1]],
            runs=1000,
            seed=504 + part,
            substep=0.02,
            paths=1000,
            path_spacing=SPACING,
        )
        inside = result.path_times >= WINDOW[0] - 1e-9
        assert inside.sum() == 601
        found.append(np.abs(result.paths[:, inside][:, :, rows]).max(axis=1))
    return np.concatenate(found)


def on_the_grid(process: JointOutputs, p: float) -> Level:
    """The level of the points drawn alone, as flights on that grid meet it."""
    bare = Grid(process.drawn.times, process.drawn.mean, np.zeros_like(process.drawn.diffusion))
    alone = JointOutputs(bare, process.covariance)

    def boundary(u: float) -> Boundary:
        return Boundary.around(np.full(bare.mean.shape, u), "both")

    size = float((np.abs(bare.mean) + process.std).max())
    return find_level(alone, p, boundary, size, np.random.default_rng(1), 8000)


@pytest.mark.slow
@pytest.mark.parametrize("response", RESPONSES)
def test_levels_and_probabilities_are_those_of_simulated_flights(as504, flown, response):
    """Within 4 standard errors of both, at p = 0.01 and 0.00135."""
    load = as504.flight_load(response, WINDOW, [0.01, 0.00135], draws=4000, seed=1)
    largest = np.sort(flown[:, RESPONSES.index(response)])
    for p, corrected in zip(load.probabilities, load.levels, strict=True):
        grid = on_the_grid(load.process, p)
        share = float((largest > grid.value).mean())
        error = np.hypot(np.sqrt(p * (1 - p) / FLIGHTS), grid.probability.standard_error)
        assert share == pytest.approx(p, abs=4 * error)
        level = largest[round((1 - p) * FLIGHTS) - 1]
        assert level == pytest.approx(grid.value, abs=4 * error / (p * grid.slope))
        # between points flights go farther, by a per cent of the level at most; both have their sampling error
        apart = float(np.hypot(grid.interval[1] - grid.value, corrected.interval[1] - corrected.value))
        assert -2 * apart < corrected.value - grid.value < 0.012 * grid.value + 2 * apart
