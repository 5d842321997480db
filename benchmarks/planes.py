"""Two planes against one: the whole table of AS-504 at 130 end times by the sweep, in turns, minima of repeats.

The planes meet in a wind that is turned by the azimuth, so that every noise of the filter reaches both, and share their
deviations; covariances between responses of both are part of the table. The same at 1e-4 on a grid that was chosen
before (runners/solvers/fixed_grid.py), against controlled steps, and a member of a dispersion, its mean included.
Run it on a quiet core: python benchmarks/planes.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

import ascentwind as aw
from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.runners.solvers.sweep import rule_for, sweep, sweep_member

TIMES = np.linspace(20.0, 149.0, 130).tolist()
TOLERANCE = 1e-6
OF_MEMBERS = 1e-4
REPEATS = 15


def table(study: aw.Study) -> Callable[[], None]:
    """Return what computes a table: all end times, sources and covariances."""
    engine, filled = sweep_of(study.executable), study.with_means
    return lambda: sweep(engine, filled, TIMES, relative_tolerance=TOLERANCE)


def of_members(study: aw.Study) -> dict[str, Callable[[], object]]:
    """Return what computes a table, and a member with its mean, by controlled steps and on a grid."""
    engine, numbers, filled, fill = sweep_of(study.executable), study.executable, study.with_means, study.mean.fill
    chosen = rule_for(engine, numbers, TIMES, relative_tolerance=OF_MEMBERS, fill=fill)
    if chosen is None:
        raise SystemExit("no grid is worth it")
    print(f"grid: {chosen.rates.min():.1f} to {chosen.rates.max():.1f} steps a second, error {chosen.error:.1e}")
    found: dict[str, Callable[[], object]] = {}
    for name, rule in (("controlled", None), ("grid", chosen)):
        settings = {"relative_tolerance": OF_MEMBERS, "rule": rule}
        found[f"table, {name}"] = lambda settings=settings: sweep(engine, filled, TIMES, **settings)
        found[f"member, {name}"] = lambda settings=settings: sweep_member(engine, numbers, TIMES, fill=fill, **settings)
    return found


def least(tasks: dict[str, Callable[[], object]], repeats: int = REPEATS) -> dict[str, float]:
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
    planes = {name: of_members(study) for name, study in (("one plane", one), ("both planes", both))}
    tasks = {f"{name}, {what}": task for name, of in planes.items() for what, task in of.items()}
    for name, seconds in least(tasks).items():
        print(f"{name:32} {1e3 * seconds:7.1f} ms")


if __name__ == "__main__":
    main()
