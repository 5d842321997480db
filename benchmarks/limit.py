"""How far the sweep stands from what the processor can do: its multiply-adds against those that this machine makes.

    python benchmarks/limit.py

A small program measures eight multiply-adds side by side (one vector), from registers and with a load from the
first-level cache. The vectors that a step of AS-504 needs are counted from its structure: by the explicit formula
A' x at twelve stages and their combinations, on a grid elimination and solution, and Gramians in both. Lookup, A, B and
E u, and what comes once a segment, Phi P Phi' and weights, are not counted: they are the rest. Least processor time of
turns; run it on a quiet core.
"""

from __future__ import annotations

import ctypes
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import ascentwind as aw
from ascentwind.codegen.nodes.elimination import elimination_plan
from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.codegen.sweep.kinds import kinds
from ascentwind.codegen.sweep.runge_kutta import DOP853
from ascentwind.codegen.sweep.source import LANES
from ascentwind.codegen.toolchain.compiler import find_compiler, optimizing
from ascentwind.runners.solvers.sweep import rule_for, sweep, sweep_member

TIMES = np.arange(11.0, 141.0)
CHAINS, ROUNDS, TURNS = 12, 2_000_000, 7
SOURCE = """
#include <string.h>
typedef double Eight __attribute__((vector_size(64)));
static double room[512];
double registers(long rounds, double start) {
  Eight a[%(chains)d], b, c;
  long i; int k;
  for (k = 0; k < 8; ++k) { b[k] = 1.0 + 1e-9 * start; c[k] = 1e-9; }
  for (k = 0; k < %(chains)d; ++k) a[k] = b * (double)k;
  for (i = 0; i < rounds; ++i) { %(from_registers)s }
  for (k = 1; k < %(chains)d; ++k) a[0] += a[k];
  return a[0][0];
}
double loads(long rounds, double start) {
  Eight a[%(chains)d], b, x;
  long i; int k;
  for (k = 0; k < 8; ++k) b[k] = 1.0 + 1e-9 * start;
  for (k = 0; k < 512; ++k) room[k] = start;
  for (k = 0; k < %(chains)d; ++k) a[k] = b * (double)k;
  for (i = 0; i < rounds; ++i) { const double *from = room + 8 * (i & 31); %(from_cache)s }
  for (k = 1; k < %(chains)d; ++k) a[0] += a[k];
  return a[0][0];
}
"""


def multiply_adds() -> dict[str, float]:
    """Return seconds of a vector of multiply-adds, from registers and with a load each."""
    compiler = find_compiler()
    if compiler is None:
        raise SystemExit("no C compiler")
    compiler = optimizing(compiler)
    chains = range(CHAINS)
    source = SOURCE % {
        "chains": CHAINS,
        "from_registers": " ".join(f"a[{k}] = a[{k}] * b + c;" for k in chains),
        "from_cache": " ".join(f"memcpy(&x, from + {8 * k}, 64); a[{k}] += x * b;" for k in chains),
    }
    with tempfile.TemporaryDirectory() as folder:
        file, library = Path(folder, "limit.c"), Path(folder, "limit.so")
        file.write_text(source)
        compiler.compile(file, library)
        loaded = ctypes.CDLL(str(library))
    found = {}
    for name in ("registers", "loads"):
        function = getattr(loaded, name)
        function.restype, function.argtypes = ctypes.c_double, (ctypes.c_long, ctypes.c_double)
        found[name] = least(lambda function=function: function(ROUNDS, 1.0)) / (ROUNDS * CHAINS)
    return found


def least(task: Callable[[], object]) -> float:
    """Return the least processor time of a task, s."""
    found = float("inf")
    for _ in range(TURNS):
        begin = time.process_time()
        task()
        found = min(found, time.process_time() - begin)
    return found


def vectors_of_steps(study: aw.Study) -> dict[str, float]:
    """Return the vectors of multiply-adds in one step, explicit and on a grid, of a system with one kind of columns."""
    A, noises = sweep_of(study.executable).functions.stage.sparsity_out(0), len(study.system.noises)
    (kind,) = kinds(A, LANES)
    weighted = sum(b != 0.0 for b in DOP853.weights)
    combinations = sum(a != 0.0 for row in DOP853.matrix for a in row)
    combinations += sum(b != 0.0 for row in (DOP853.weights, DOP853.error_5, DOP853.error_3) for b in row)
    upper = LANES * kind.blocks * (kind.blocks + 1) / 2  # rows of the blocks of an upper triangle, in vectors
    explicit = kind.blocks * (DOP853.stages * A.nnz() + combinations * len(kind.rows)) + noises * weighted * upper
    plan = elimination_plan(A)
    size, entries, lower, higher = (int(plan[i]) for i in (0, 2, 3, 4))
    own = int((plan[5 + size : 5 + 2 * size] >= 0).sum())
    products = plan.size - 5 - 2 * size - 3 * entries - 4 * (size + 1 + lower + higher)
    solution = 16 * kind.blocks * (lower + higher + own)
    elimination = 64 * (products + higher + own) / LANES  # eight steps side by side; an inverse is about a product
    return {"explicit": explicit, "grid": solution + elimination + noises * 4 * upper}


def main() -> None:
    """Measure and print."""
    study = aw.Study.load("as504")
    compiled, numbers, filled = sweep_of(study.executable), study.executable, study.with_means
    speed, vectors = multiply_adds(), vectors_of_steps(study)
    print(
        f"eight multiply-adds: {1e9 * speed['registers']:.3f} ns from registers, {1e9 * speed['loads']:.3f} with a load"
    )
    rule = rule_for(compiled, numbers, TIMES, relative_tolerance=1e-4, fill=study.mean.fill)
    tasks = {"explicit": lambda: sweep(compiled, filled, TIMES, relative_tolerance=1e-6)}
    if rule is not None:
        tasks["grid"] = lambda: sweep_member(
            compiled, numbers, TIMES, relative_tolerance=1e-4, fill=study.mean.fill, rule=rule
        )
    for name, task in tasks.items():
        steps, seconds = task().counters["steps"], least(task)
        limits = {what: steps * vectors[name] * each for what, each in speed.items()}
        print(
            f"{name:9} {steps} steps of {vectors[name]:.0f} vectors: {1e3 * seconds:.1f} ms, "
            + ", ".join(f"{seconds / limit:.1f} times {1e3 * limit:.1f} ms by {what}" for what, limit in limits.items())
        )


if __name__ == "__main__":
    main()
