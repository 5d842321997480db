"""All derivatives of one (response, time) against one statistics table, and against the number of parameters.

    python benchmarks/sensitivity.py

All ratios come from one run, the variants in turn, so that a drifting machine does not favour one.
"""

from __future__ import annotations

import time

import casadi as ca
import numpy as np
from ascentwind.codegen.node_functions import node_functions
from ascentwind.model import define_system
from ascentwind.runners import Study
from ascentwind.runners.sensitivity_gradient import AdjointPair

ROUNDS, TIME = 7, 75.0
TABLE = [float(t) for t in np.arange(40.0, 140.1, 2.5)]
COUNTS = (50, 500, 5000)


def seconds(call) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def medians(calls: dict) -> dict[str, float]:
    for call in calls.values():
        call()
    rounds = [{label: seconds(call) for label, call in calls.items()} for _ in range(ROUNDS)]
    return {label: float(np.median([r[label] for r in rounds])) for label in calls}


def as504() -> None:
    study = Study.load("as504")
    functions = node_functions(study.system)

    def gradient(step: float | None = None) -> None:
        pair = AdjointPair(study.with_means, functions, 0, TIME, study.system.sources, step)
        pair.gradient(1.0, 1.0)

    found = medians(
        {
            "statistics table, 41 end times, CVODES": lambda: study.response_statistics(TABLE),
            "statistics of one end time, CVODES": lambda: study.response_statistics([TIME]),
            "all derivatives, one response and time": gradient,
            "the same with steps of 0.05 s": lambda: gradient(0.05),
            "study.sensitivity, rows of tables too": lambda: study.sensitivity("bending_moment", TIME),
        }
    )
    numbers = study.system.p.numel()
    print(f"AS-504, t2 = {TIME:g} s: {numbers} parameters, {study.system.v.numel()} tables, median of {ROUNDS}")
    base = found["statistics table, 41 end times, CVODES"]
    for label, value in found.items():
        print(f"  {label:42s} {1e3 * value:8.1f} ms  ratio {value / base:6.3f}")


def chain(count: int) -> Study:
    """An oscillator whose frequency is a mean of ``count`` parameters."""
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    p = [ca.SX.sym(f"p{i}") for i in range(count)]
    w = sum(p) / count
    system = define_system(
        f"chain_{count}",
        time=t,
        states={"x": (x, v), "v": (v, -0.1 * v - w**2 * x + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={f"p{i}": (s, 3.0) for i, s in enumerate(p)},
    )
    return Study.from_system(system)


def by_count() -> None:
    calls = {}
    for count in COUNTS:
        study = chain(count)
        functions, sources = node_functions(study.system), study.system.sources
        calls[f"{count}"] = lambda study=study, functions=functions, sources=sources: AdjointPair(
            study.executable, functions, 0, 60.0, sources
        ).gradient(1.0, 0.0)
    found = medians(calls)
    print("derivatives by number of parameters, an oscillator over 60 s")
    for label, value in found.items():
        print(f"  {label:>6s} parameters {1e3 * value:8.1f} ms  ratio {value / found['50']:6.2f}")


if __name__ == "__main__":
    as504()
    by_count()
