"""Two planes against one: the whole table of AS-504 at 130 end times by the sweep, in turns, minima of repeats.

The planes meet in a wind that is turned by the azimuth, so that every noise of the filter reaches both, and share their
deviations; covariances between responses of both are part of the table. The same at 1e-4 on a grid that was chosen
before (runners/solvers/fixed_grid.py), against controlled steps, and a member of a dispersion, its mean included. And
copies of the one plane that share all noises, two and three, whose systems grow as planes do.
Run it on a quiet core: python benchmarks/planes.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np

import ascentwind as aw
from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.codegen.system.executable import executable_system
from ascentwind.model import LinearSystem
from ascentwind.runners.solvers.sweep import rule_for, sweep, sweep_member

TIMES = np.linspace(20.0, 149.0, 130).tolist()
TOLERANCE = 1e-6
OF_MEMBERS = 1e-4
REPEATS = 15


def table(study: aw.Study) -> Callable[[], object]:
    """Return what computes a table: all end times, sources and covariances."""
    engine, filled = sweep_of(study.executable), study.with_means
    return lambda: sweep(engine, filled, TIMES, relative_tolerance=TOLERANCE)


def of_members(study: aw.Study) -> dict[str, Callable[[], object]]:
    """Return what computes a table by controlled steps, and a member with its mean, also on a grid."""
    engine, numbers, filled, fill = sweep_of(study.executable), study.executable, study.with_means, study.mean.fill
    chosen = rule_for(engine, numbers, TIMES, relative_tolerance=OF_MEMBERS, fill=fill)
    if chosen is None:
        raise SystemExit("no grid is worth it")
    print(f"grid: {chosen.rates.min():.1f} to {chosen.rates.max():.1f} steps a second, error {chosen.error:.1e}")
    found: dict[str, Callable[[], object]] = {}
    for name, rule in (("controlled", None), ("grid", chosen)):
        found[f"member, {name}"] = lambda rule=rule: sweep_member(
            engine, numbers, TIMES, relative_tolerance=OF_MEMBERS, fill=fill, rule=rule
        )
    found["table, controlled"] = lambda: sweep(engine, filled, TIMES, relative_tolerance=OF_MEMBERS)
    return found


def copies(system: LinearSystem, count: int) -> LinearSystem:
    """Return a system side by side with itself, every noise shared."""

    def number(of: tuple, k: int) -> tuple:
        return tuple(replace(each, name=f"copy_{k}_{each.name}") for each in of)

    x = [ca.SX.sym(f"x_{k}", system.x.numel()) for k in range(count)]
    start = {name: np.kron(np.ones((count, count)), P) for name, P in system.start_covariance.items()}
    return replace(
        system,
        name=f"{system.name}_{count}",
        x=ca.vertcat(*x),
        derivative=ca.vertcat(*(ca.substitute(system.derivative, system.x, own) for own in x)),
        output=ca.vertcat(*(ca.substitute(system.output, system.x, own) for own in x)),
        states=tuple(state for k in range(count) for state in number(system.states, k)),
        outputs=tuple(output for k in range(count) for output in number(system.outputs, k)),
        tables=tuple(
            replace(g, sources=tuple((kind, f"copy_0_{name}") for kind, name in g.sources)) for g in system.tables
        ),
        start_covariance=start,
        coupling_matrix=None,
    )


def of_copies(study: aw.Study) -> dict[str, Callable[[], object]]:
    """Return what computes the table of one, two and three copies."""
    found: dict[str, Callable[[], object]] = {}
    for count in (1, 2, 3):
        numbers = executable_system(copies(study.system, count)).with_numbers(groups=study.with_means.groups)
        engine = sweep_of(numbers)
        found[f"{count} of it"] = lambda engine=engine, numbers=numbers: sweep(
            engine, numbers, TIMES, relative_tolerance=TOLERANCE
        )
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
    found = least(of_copies(one))
    for name, seconds in found.items():
        print(f"{name:12} {1e3 * seconds:7.1f} ms  {seconds / found['1 of it']:.2f}")


if __name__ == "__main__":
    main()
