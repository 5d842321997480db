"""All derivatives of one (response, time) against the statistics table of the same system by the sweep engine.

    python benchmarks/sensitivity.py

All ratios come from one run, the variants in turn, so that a drifting machine does not favour one. Processor time, so
that other work on the machine does not count.
"""

from __future__ import annotations

import resource
import time

import casadi as ca
import numpy as np

from ascentwind.model import define_system
from ascentwind.runners import Study

ROUNDS = 7
COUNTS = (50, 500, 5000)


def seconds(call) -> float:
    start = time.process_time()
    call()
    return time.process_time() - start


def medians(calls: dict) -> dict[str, float]:
    for call in calls.values():
        call()
    rounds = [{label: seconds(call) for label, call in calls.items()} for _ in range(ROUNDS)]
    return {label: float(np.median([r[label] for r in rounds])) for label in calls}


def memory() -> float:
    """Return the largest size of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def as504() -> None:
    study = Study.load("as504")
    ends = [float(t) for t in range(11, 141)]
    few = [float(t) for t in range(60, 90, 3)]
    study.response_statistics(ends)
    before = memory()
    study.sensitivity("bending_moment", 140.0)
    after = memory()
    found = medians(
        {
            "statistics table, 130 end times": lambda: study.response_statistics(ends),
            "study.sensitivity at 75 s": lambda: study.sensitivity("bending_moment", 75.0),
            "study.sensitivity at 140 s": lambda: study.sensitivity("bending_moment", 140.0),
            "study.sensitivity at the peak": lambda: study.sensitivity("bending_moment", "peak"),
            "study.sensitivities, 10 end times": lambda: study.sensitivities(["bending_moment"], few),
        }
    )
    print(f"AS-504: {study.system.p.numel()} parameters, {study.system.v.numel()} tables, median of {ROUNDS}")
    base = found["statistics table, 130 end times"]
    for label, value in found.items():
        print(f"  {label:36s} {1e3 * value:8.1f} ms  ratio {value / base:6.2f}")
    print(f"  memory: {before:.0f} MB before, {after:.0f} MB after the sensitivity at 140 s")


def chain(count: int, beside_time: bool) -> Study:
    """An oscillator whose frequency is a mean of ``count`` parameters, constant or each with its own course in time."""
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    p = [ca.SX.sym(f"p{i}") for i in range(count)]
    w = sum((s * (1 + 0.1 * t * i / count / 60) if beside_time else s) for i, s in enumerate(p)) / count
    system = define_system(
        f"chain_{count}_{beside_time}",
        time=t,
        states={"x": (x, v), "v": (v, -0.1 * v - w**2 * x + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={f"p{i}": (s, 3.0) for i, s in enumerate(p)},
    )
    return Study.from_system(system)


def by_count(beside_time: bool, counts: tuple[int, ...]) -> None:
    ends = [float(t) for t in range(1, 61)]
    calls = {}
    for count in counts:
        study = chain(count, beside_time)
        calls[f"{count} table"] = lambda study=study: study.response_statistics(ends)
        calls[f"{count}"] = lambda study=study: study.sensitivity("x", 60.0)
    found = medians(calls)
    print(f"by number of parameters, an oscillator over 60 s{', parameters beside time' if beside_time else ''}")
    for count in counts:
        table, value = found[f"{count} table"], found[f"{count}"]
        print(
            f"  {count:6d}: derivatives {1e3 * value:8.1f} ms, table of 60 end times {1e3 * table:8.1f} ms, "
            f"ratio {value / table:6.2f}"
        )


if __name__ == "__main__":
    as504()
    by_count(beside_time=False, counts=COUNTS)
    by_count(beside_time=True, counts=COUNTS[:2])  # 5000 expressions in time take a C compiler ten minutes
