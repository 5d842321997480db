"""Random grids of end times, as people and programs make them: the sweep against CVODES, none refused."""

from __future__ import annotations

import os

import numpy as np
import pytest
from test_time_nodes import SWITCHES, switching

from ascentwind.runners import Cvodes, Study

GRIDS = int(os.environ.get("ASCENTWIND_TEST_GRIDS", "12"))
AGREEMENT = 1e-5


def random_grid(random: np.random.Generator, start: float, end: float, switches: list[float]) -> list[float]:
    """Return decimals, np.arange, np.linspace, switches and their neighbours, and near-duplicates of all of them."""
    span = end - start
    begin = start + span * random.uniform(0.02, 0.6)
    step = float(random.choice([0.1, 0.2, 0.25, 0.3, 0.7, 1.1])) * span / 40
    times = list(np.arange(round(begin, 2), end, step)[: random.integers(1, 8)])
    times += [round(t, int(random.integers(1, 4))) for t in random.uniform(begin, end, 2)]
    times += list(np.linspace(begin, end, random.integers(2, 5)))
    for switch in switches:
        if switch > begin:
            times += [switch, float(np.nextafter(switch, np.inf)), float(np.nextafter(switch, -np.inf))]
            times.append(switch + span * float(random.choice([-1, 1])) * 10.0 ** random.uniform(-16, -6))
    times += [t + span * 10.0 ** random.uniform(-16, -6) for t in random.choice(times, 2)]
    return sorted({float(t) for t in times if start < t <= end})


def furthest(study: Study, times: list[float]) -> float:
    """Return the largest relative difference of a standard deviation between the sweep and CVODES; 0 is 0 by both."""
    swept = study.response_statistics(times, engine="sweep")
    np.testing.assert_array_equal(swept["time"].values, times)
    expected = study.response_statistics(times, engine=Cvodes(relative_tolerance=1e-8))
    found, std = swept.std.values, expected.std.values
    np.testing.assert_array_equal(found[std == 0], 0.0)
    return float(np.abs(found[std > 0] / std[std > 0] - 1).max())


@pytest.mark.filterwarnings("ignore::ascentwind.model.errors.UnstableSystemWarning")
@pytest.mark.slow
def test_random_grids_on_a_switching_system(cache):
    study, random = Study.from_system(switching()), np.random.default_rng(504)
    grids = [random_grid(random, 0.0, 3.0, list(SWITCHES)) for _ in range(GRIDS)]
    assert max(furthest(study, grid) for grid in grids) < AGREEMENT


@pytest.mark.slow
def test_random_grids_on_a_vehicle(as504):
    """Only end times beside switches, of which CVODES takes a run each."""
    random = np.random.default_rng(505)
    switches = list(as504.system.discontinuities)
    for _ in range(max(1, GRIDS // 50)):
        grid = random_grid(random, 100.0, 140.0, switches)
        assert furthest(as504, [grid[i] for i in sorted(random.choice(len(grid), 5, replace=False))]) < AGREEMENT
