"""The load of a whole flight of AS-504: processor time in seconds and in tables, and against plain paths, in one run.

    python benchmarks/flight_load.py

Times are after load, the least of some rounds. A table is the sweep's: standard deviations of the responses from all
sources at 130 end times. Plain paths are those of the grid drawn, each a row of normal numbers by the factor of
the covariance; (1 - p) / (p e^2) of them give the probability p with the relative error e.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

import numpy as np

from ascentwind.runners import Study
from ascentwind.runners.flight_load.load import FlightLoad
from ascentwind.runners.statistics.percentiles import instant_level

ROUNDS = 5
TIMES = np.arange(11.0, 141.0)
WINDOW = (40.0, 100.0)
RESPONSE = "bending_moment"
CASES = ((1e-3, 0.05, 1.0), (1e-6, 0.10, 5.0))  # probability, relative standard error and seconds asked for
DRAWS = (500, 1000, 2000, 4000, 8000)
PLAIN = 2000  # paths of which the cost is measured


def seconds(run: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Return the least processor time of a run, s, of all threads."""
    found = []
    for _ in range(rounds):
        gc.collect()
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return min(found)


def fresh() -> Study:
    """Return AS-504 loaded and compiled, nothing kept of earlier answers."""
    study = Study.load("as504")
    study.response_statistics(TIMES[:1])
    return study


def of_fresh(run: Callable[[Study], object]) -> float:
    """Return the least processor time of a run on a study of its own, s."""
    studies = [fresh() for _ in range(ROUNDS)]
    return min(seconds(lambda study=study: run(study), rounds=1) for study in studies)


def asked(study: Study, p: float, draws: int) -> FlightLoad:
    load = study.flight_load(RESPONSE, WINDOW, p, draws=draws)
    _ = load.level
    return load


def main() -> None:
    """Measure and print."""
    study = fresh()
    table = seconds(lambda: study.response_statistics(TIMES))
    print(f"{'table of 130 end times':58}{table:9.3f} s")
    weights = of_fresh(lambda study: study.weighting_functions(TIMES, spacing=0.25))
    print(f"{'weighting functions of 130 end times, every 0.25 s':58}{weights:9.3f} s = {weights / table:.3g} tables")
    process = asked(study, 1e-3, 500).process
    boundary = instant_level(process.drawn.mean, process.std, 1e-3).max()
    random = np.random.default_rng(1)

    def plain() -> object:
        paths = process.drawn.mean + process.deviations(random, PLAIN)
        return (np.abs(paths).max(axis=(1, 2)) > boundary).mean()

    path = seconds(plain) / PLAIN
    print(f"{'one plain path':58}{1e6 * path:9.3g} us")
    for p, error, limit in CASES:
        for draws in DRAWS:
            load = asked(study, p, draws)
            reached = load.levels[0].probability.standard_error / p
            if reached <= error:
                break
        used = of_fresh(lambda study, p=p, draws=draws: asked(study, p, draws))
        name = f"p = {p:g} by {draws} draws: {100 * reached:.1f} %"
        print(f"{name:58}{used:9.3f} s = {used / table:.3g} tables (asked {100 * error:g} %, {limit:g} s)")
        brute = (1 - p) / (p * reached**2) * path
        print(f"{'  plain paths at that error':58}{brute:9.3g} s = {brute / used:.3g} times as long")


if __name__ == "__main__":
    main()
