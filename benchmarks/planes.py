"""Two planes against one: the whole table of AS-504 at 130 end times by the sweep, in turns, minima of repeats.

The planes meet in a wind that is turned by the azimuth, so that every noise of the filter reaches both, and share their
deviations; covariances between responses of both are part of the table. Also what all derivatives of one percentile of
the resultant moment take, in such tables. Run it on a quiet core: python benchmarks/planes.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import ascentwind as aw
from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.runners.solvers.sweep import sweep

TIMES = np.linspace(20.0, 149.0, 130).tolist()
TOLERANCE = 1e-6
REPEATS = 15


def table(study: aw.Study) -> Callable[[], None]:
    """Return what computes a table: all end times, sources and covariances."""
    engine, filled = sweep_of(study.executable), study.with_means
    return lambda: sweep(engine, filled, TIMES, relative_tolerance=TOLERANCE)


def least(tasks: dict[str, Callable[[], None]], repeats: int = REPEATS) -> dict[str, float]:
    """Return the least processor time of each task (s), the tasks in turn."""
    found = dict.fromkeys(tasks, float("inf"))
    for task in tasks.values():
        task()
    for _ in range(repeats):
        for name, task in tasks.items():
            begin = time.process_time()
            task()
            found[name] = min(found[name], time.process_time() - begin)
    return found


def main() -> None:
    """Print times and their ratio."""
    one = aw.Study.load("as504")
    both = aw.Study.load("as504", changes={"planes": "both"})
    found = least({"one plane": table(one), "both planes": table(both)})
    for (name, seconds), study in zip(found.items(), (one, both), strict=True):
        print(f"{name:12} {len(study.system.states)} states  {1e3 * seconds:7.1f} ms")
    print(f"ratio        {found['both planes'] / found['one plane']:.2f}")


if __name__ == "__main__":
    main()
