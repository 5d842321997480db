"""CVODES on AS-504: compiled against interpreted, Adams against BDF, and the times of the main job's parts.

    python benchmarks/adjoint.py

All ratios come from one run, the variants in turn, so that a drifting machine does not favour one.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ascentwind.codegen.system.executable import executable_system
from ascentwind.codegen.system.functions import core_functions
from ascentwind.codegen.system.source import c_source
from ascentwind.runners import Cvodes, Study
from ascentwind.runners.solvers.adjoint import AdjointSolver

END_TIME, ROUNDS = 75.0, 7


def seconds(call) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def engines() -> None:
    compiled, interpreted = Study.load("as504"), Study.load("as504", compile=False)
    tight = AdjointSolver(compiled.with_means, Cvodes(relative_tolerance=1e-11)).run(END_TIME).variance
    solvers = {}
    for label, study, method, iteration, tolerance in (
        ("compiled, Adams, Newton, 1e-6", compiled, "adams", "newton", 1e-6),
        ("compiled, Adams, Newton, 1e-7 (default)", compiled, "adams", "newton", 1e-7),
        ("compiled, Adams, functional, 1e-6", compiled, "adams", "functional", 1e-6),
        ("compiled, BDF, Newton, 1e-6", compiled, "bdf", "newton", 1e-6),
        ("compiled, BDF, functional, 1e-6", compiled, "bdf", "functional", 1e-6),
        ("interpreted, Adams, functional, 1e-6", interpreted, "adams", "functional", 1e-6),
        ("interpreted, BDF, Newton, 1e-6", interpreted, "bdf", "newton", 1e-6),
        ("interpreted, Adams, Newton, 1e-6", interpreted, "adams", "newton", 1e-6),
    ):
        options = Cvodes(method=method, iteration=iteration, relative_tolerance=tolerance)
        solvers[label] = AdjointSolver(study.with_means, options)
        solvers[label].run(END_TIME)
    times = {label: [] for label in solvers}
    for _ in range(ROUNDS):
        for label, solver in solvers.items():
            times[label].append(seconds(lambda solver=solver: solver.run(END_TIME)))
    base = np.median(times["compiled, Adams, Newton, 1e-6"])
    print(f"one end time, {END_TIME:g} s: {tight.shape[0]} responses, {tight.shape[1]} sources, median of {ROUNDS}")
    for label, solver in solvers.items():
        run = solver.run(END_TIME)
        error = np.abs(np.sqrt(run.variance / tight) - 1).max()
        median = np.median(times[label])
        print(
            f"  {label:42s} {1e3 * median:8.1f} ms  ratio {median / base:5.2f}  "
            f"error of sigma {error:.1e}  steps {run.counters['nsteps']}"
        )


def parts() -> None:
    system = Study.load("as504").system
    core = core_functions(system)
    print("parts of the main job")
    print(f"  deriving the core functions       {1e3 * seconds(lambda: core_functions(system)):8.1f} ms")
    print(f"  writing C                         {1e3 * seconds(lambda: c_source(system, core)):8.1f} ms")
    with tempfile.TemporaryDirectory() as cache:
        os.environ["ASCENTWIND_CACHE"] = cache
        print(f"  generating, compiling, loading    {1e3 * seconds(lambda: executable_system(system)):8.1f} ms")
        cached = min(seconds(lambda: executable_system(system)) for _ in range(5))
        print(f"  loading a cached model, verified  {1e3 * cached:8.1f} ms")
        command = [str(Path(sys.executable).with_name("ascentwind")), "run", "as504", "--out", f"{cache}/out"]
        for label in ("first 'ascentwind run', warm cache", "second"):
            run = seconds(lambda: subprocess.run(command, check=True, capture_output=True, cwd=cache))
            print(f"  {label:34s}{run:8.1f} s")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"  peak memory of a run              {peak:8.0f} MB")


if __name__ == "__main__":
    engines()
    parts()
