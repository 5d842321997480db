"""All methods on AS-504 in one run, in turn; writes docs/benchmarks.md and its figures.

    pip install -e '.[bench]'
    python benchmarks/run.py

The job: standard deviations of 3 responses from 3 sources at 130 end times, 11 to 140 s. A method that works an end
time after another is run at some of them, and its time scaled by the flight seconds integrated. The error is the
largest relative one against the covariance equation at a tight tolerance.
"""

from __future__ import annotations

import gc
import os
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from contenders import Contender, contenders
from growth import Rows, growth
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, ScalarFormatter

from ascentwind.runners import Study
from ascentwind.runners.present.style import STYLE
from ascentwind.runners.solvers.covariance import covariance_equation

FULL = np.arange(11.0, 141.0)
SOME = np.array([20.0, 60.0, 100.0, 140.0])
ROUNDS = 3
SLOW = 2.0  # s; what takes longer is run once
DOCS = Path(__file__).parent.parent / "docs"


def measure(study: Study, methods: list[Contender]) -> list[tuple[Contender, float, float, float]]:
    """Return (method, seconds for the job, error, MB above what stood before), all methods in turn."""
    reference = np.sqrt(covariance_equation(study.with_means, FULL.tolist(), 1e-12).variance)
    flight = FULL[-1] - study.system.start
    share = (FULL - study.system.start).sum() / (SOME - study.system.start).sum()
    seconds: dict[int, list[float]] = {k: [] for k in range(len(methods))}
    errors, memory = {}, {}
    for turn in range(ROUNDS):
        for k, method in enumerate(methods):
            if turn and min(seconds[k]) > SLOW:
                continue
            times = SOME if method.each else FULL
            scale = share if method.each else method.scale
            if method.part is not None:
                times, scale = study.system.start + np.array([method.part]), flight / method.part
            gc.collect()
            before = _peak_memory(reset=True)
            start = time.perf_counter()
            std = method.run(times)
            seconds[k].append((time.perf_counter() - start) * scale)
            if not turn:
                memory[k] = _peak_memory() - before
                expected = reference[np.searchsorted(FULL, times)]
                errors[k] = float(np.abs(std / expected - 1).max())
        print(f"turn {turn + 1} of {ROUNDS} done", flush=True)
    return [(method, float(np.median(seconds[k])), errors[k], memory[k]) for k, method in enumerate(methods)]


def _peak_memory(reset: bool = False) -> float:
    """Return the peak resident memory since the last reset, MB; NaN where the system does not tell."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    except (OSError, StopIteration):
        return float("nan")


def error_figure(results: list[tuple[Contender, float, float, float]]) -> Figure:
    with rc_context(STYLE):
        figure = Figure(figsize=(8.5, 5.5), layout="constrained")
        axes = figure.subplots()
        for k, name in enumerate(dict.fromkeys(m.method for m, *_ in results)):
            rows = [(s, e) for m, s, e, _ in results if m.method == name]
            axes.loglog(*zip(*rows, strict=True), marker="osD^vP*X"[k % 8], ms=6, color=f"C{k % 10}", label=name)
        axes.set(
            xlabel="run time for 130 end times, 3 responses, 3 sources (s)", ylabel="largest relative error of a σ",
            title="AS-504: error against run time, one run",
        )  # fmt: skip
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.legend(fontsize=8.5, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def growth_figure(found: dict[str, Rows]) -> Figure:
    with rc_context(STYLE):
        figure = Figure(figsize=(13.0, 4.4), layout="constrained")
        for axes, (title, rows) in zip(figure.subplots(1, len(found)), found.items(), strict=True):
            for k, (name, values) in enumerate(rows):
                points = [(count, seconds) for count, seconds in values if seconds is not None]
                axes.loglog(*zip(*points, strict=True), marker="osD^"[k % 4], label=name)
            axes.set(xlabel=title, ylabel="run time (s)", xticks=[count for count, _ in rows[0][1]])
            axes.xaxis.set_major_formatter(ScalarFormatter())
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.legend(fontsize=8.5)
        figure.suptitle("Run time against size")
    return figure


def report(results: list, found: dict[str, Rows], missing: list[str], took: float) -> str:
    """Return docs/benchmarks.md."""
    sweeps = [r for r in results if r[0].method == "sweep"]
    ours = next((r for r in sweeps if r[2] <= 1e-6), sweeps[-1]) if sweeps else results[0]
    lines = [
        "# Benchmarks", "",
        f"`python benchmarks/run.py`, one run of {took / 60:.1f} min, methods in turn, median of {ROUNDS}. "
        "The job is the full table of AS-504: standard deviations of 3 responses from 3 sources at 130 end times, 11 "
        "to 140 s. Methods marked * work an end time after another; they were run at "
        f"{', '.join(f'{t:g}' for t in SOME)} s and their time scaled by the flight seconds integrated. All take A(t) "
        "and the adjoint from the same compiled code (diffrax: cubic pieces of the same A(t)), and the same tables of "
        "the mean response. Errors are the largest relative ones of a standard deviation, against SciPy's DOP853 on "
        "the covariance equation at 1e-12; for an ensemble they are sampling errors. Flight by flight, "
        "4 flights were run and their time scaled to 500; of Euler-Maruyama the first second of flight. Ratios are to "
        f"{ours[0].method} at {ours[0].setting}.", "",
        f"Machine: {_processor()}, {os.cpu_count()} cores. {_versions()}.", "",
        "| method | tolerance or step | time | ratio | error | memory above before |", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for method, seconds, error, memory in results:
        mark = "*" if method.each else ""
        lines.append(
            f"| {method.method}{mark} | {method.setting} | {_time(seconds)} | {seconds / ours[1]:.3g} | {error:.0e} | "
            f"{memory:.0f} MB |"
        )
    lines += ["", "![Error against run time](figures/benchmark_error.png)", ""]
    lines += [f"- {line}" for line in missing]
    lines += [
        "- CasADi 3.8 generates no C for its integrators: `generate()` on an `rk`, `cvodes` or `idas` integrator "
        "writes `#error`. Its fixed-step `rk` therefore runs in CasADi and calls our compiled right-hand side.",
        "- scikit-sundae and SciPy reach the same compiled right-hand side through a Python function.",
        "- diffrax is timed after its compilation.",
        "- NumPy ensembles that take at least 500 times as long as the sweep: "
        f"{_ensembles(results, ours[1], lambda ratio: ratio >= 500)}; those that take less: "
        f"{_ensembles(results, ours[1], lambda ratio: ratio < 500)}. Their discretisation errors, without sampling, "
        "and what the error of the sweep would cost them: docs/performance.md.",
        "", "## Growth", "",
    ]  # fmt: skip
    for title, rows in found.items():
        counts = [count for count, _ in rows[0][1]]
        lines += [f"| {title} | {' | '.join(map(str, counts))} |", "|---" * (len(counts) + 1) + "|"]
        for name, values in rows:
            lines.append(f"| {name} | {' | '.join('-' if s is None else _time(s) for _, s in values)} |")
        lines.append("")
    return "\n".join([*lines, "A dash: foreseen to take too long for this run.", "",
                      "![Growth of run time](figures/benchmark_growth.png)", ""])  # fmt: skip


def _ensembles(results: list, ours: float, wanted: Callable[[float], bool]) -> str:
    ratios = {m.method: seconds / ours for m, seconds, *_ in results if m.method.startswith("NumPy")}
    return ", ".join(f"{name} ({ratio:.3g})" for name, ratio in ratios.items() if wanted(ratio)) or "none"


def _time(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _versions() -> str:
    found = [f"Python {platform.python_version()}"]
    for name in ("ascentwind", "casadi", "numpy", "scipy", "scikit-sundae", "diffrax", "jax"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)


def main() -> None:
    start = time.perf_counter()
    study = Study.load("as504")
    methods, missing = contenders(study)
    results = measure(study, methods)
    found = growth(study)
    (DOCS / "figures").mkdir(exist_ok=True)
    error_figure(results).savefig(DOCS / "figures" / "benchmark_error.png", dpi=130)
    growth_figure(found).savefig(DOCS / "figures" / "benchmark_growth.png", dpi=130)
    text = report(results, found, missing, time.perf_counter() - start)
    (DOCS / "benchmarks.md").write_text(text)
    print(text)


if __name__ == "__main__":
    sys.exit(main())
