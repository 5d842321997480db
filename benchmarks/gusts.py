"""The gust sweep of AS-504 with its weights at hand: processor time in seconds and in tables, in one run.

    python benchmarks/gusts.py

30 lengths, 60 altitudes and 3 responses at one end time, by products with the weights; making the weights stands beside
it. A table is the sweep's: standard deviations of the responses from all sources at 130 end times.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import ascentwind as aw
from ascentwind.runners.case.climb import Climb
from ascentwind.runners.gusts.response import gust_products
from ascentwind.runners.gusts.weights import wind_weights

ROUNDS = 5
TIMES = np.arange(11.0, 141.0)
RESPONSES = ["bending_moment", "angle_of_attack", "engine_angle"]
TIME, REACH = 70.0, 8.0
LENGTHS = np.linspace(60.0, 300.0, 30)
CASES: dict[str, dict[str, Any]] = {"one wind": {}, "five zones": {"options.gust_zones": 5}}


def seconds(run: Callable[[], object]) -> float:
    """Return the least processor time of a run, s, of all threads."""
    found = []
    for _ in range(ROUNDS):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return min(found)


def measured(changes: dict[str, Any]) -> tuple[float, float, float]:
    """Return the seconds of a table, of the weights, and of the sweep with the weights at hand."""
    study = aw.Study.load("as504", changes=changes)
    study.response_statistics(TIMES)
    table = seconds(lambda: study.response_statistics(TIMES))
    climb, (weights,) = Climb.of(study), wind_weights(study, [TIME], RESPONSES, REACH)
    starts = climb.altitude(TIME - np.linspace(0.0, REACH - 1.0, 60))

    def sweep() -> None:
        for length in LENGTHS:
            gust_products(weights, climb, aw.QuasiSquare(float(length)), starts)

    spans = iter(REACH + 1e-3 * np.arange(1, ROUNDS + 1))  # each is another question, of which nothing is kept
    making = seconds(lambda: wind_weights(study, [TIME], RESPONSES, float(next(spans))))
    return table, making, seconds(sweep)


def main() -> None:
    """Print a row a case."""
    print("| as504 | table, s | weights, s | sweep of 30 x 60 gusts, s | in tables |\n|---|---|---|---|---|")
    for name, changes in CASES.items():
        table, weights, sweep = measured(changes)
        print(f"| {name} | {table:.3f} | {weights:.3f} | {sweep:.3f} | {sweep / table:.2f} |")


if __name__ == "__main__":
    main()
