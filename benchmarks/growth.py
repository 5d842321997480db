"""How run time grows: with the number of states, of end times, and of parameter sets."""

from __future__ import annotations

import time
from collections.abc import Callable

import casadi as ca
import numpy as np

from ascentwind.codegen.ensemble.compiled import ensemble_of
from ascentwind.codegen.sweep.compiled import sweep_of
from ascentwind.model import LinearSystem, define_system
from ascentwind.runners import CovarianceEquation, Cvodes, Ensemble, Study
from ascentwind.runners.solvers.sweep import batch, sweep
from ascentwind.runners.statistics.engine import Engine

BUDGET = 8.0  # s; what is foreseen to take longer is left out
SIZES = (10, 20, 40, 80)
Rows = list[tuple[str, list[tuple[int, float | None]]]]


def chain(states: int) -> LinearSystem:
    """A row of coupled oscillators between 1 and 20 rad/s, shaken at the first, whose stiffness drifts with time."""
    t, noise = ca.SX.sym("t"), ca.SX.sym("n")
    count = states // 2
    x, v = ca.SX.sym("x", count), ca.SX.sym("v", count)
    equations = {}
    for i, w in enumerate(np.geomspace(1.0, 20.0, count)):
        pull = sum(0.1 * (x[k] - x[i]) for k in (i - 1, i + 1) if 0 <= k < count)
        force = -(w**2) * (1 + 0.01 * t) * x[i] - 0.04 * w * v[i] + pull + (noise if i == 0 else 0)
        equations |= {f"x{i}": (x[i], v[i]), f"v{i}": (v[i], force)}
    return define_system(
        f"chain_{states}", time=t, states=equations, noises={"n": noise},
        outputs={"first": x[0], "second": x[1]}, end=100.0,
    )  # fmt: skip


def growth(study: Study) -> dict[str, Rows]:
    """Return seconds by engine for growing problems."""
    names = list(study.system.output_names)

    def on_as504(engine: Engine) -> Callable[[int], None]:
        def run(count: int) -> None:
            times = np.linspace(study.system.start, 140.0, count + 1)[1:].tolist()
            engine.compute(study, times, names)

        return run

    flight = np.arange(11.0, 141.0)
    member = sweep_of(study.executable)
    nominal = study.executable.parameters

    def batches(count: int) -> None:
        sets = nominal * (1 + 0.01 * np.random.default_rng(1).uniform(-1, 1, (count, nominal.size)))
        batch(member, study.executable, sets, flight, relative_tolerance=1e-4)

    def one_by_one(count: int) -> None:
        for k in range(count):
            changed = study.with_parameters({"wind.sigma_scale": 1 + 0.001 * k})
            Cvodes(relative_tolerance=1e-5).compute(changed, [75.0], names)

    # compiled beforehand: growth is of the run
    chains = {states: Study.from_system(chain(states)) for states in SIZES}
    sweeps = {states: sweep_of(found.executable) for states, found in chains.items()}
    for found in chains.values():
        ensemble_of(found.executable)

    def on_chain(engine: Engine) -> Callable[[int], None]:
        def run(states: int) -> None:
            engine.compute(chains[states], [5.0, 10.0, 15.0, 20.0], ["first", "second"])

        return run

    def sweep_chain(states: int) -> None:
        sweep(sweeps[states], chains[states].executable, [5.0, 10.0, 15.0, 20.0])

    tight = Cvodes(relative_tolerance=1e-7)
    rows: dict[str, Rows] = {
        "states (chain of oscillators, 4 end times)": [
            (label, _measure(run, SIZES))
            for label, run in (
                ("sweep", sweep_chain),
                ("CVODES Adams, an end time", on_chain(tight)),
                ("covariance equation, SciPy", on_chain(CovarianceEquation(1e-8))),
                ("ensemble of 500, compiled", on_chain(Ensemble())),
            )
        ],
        "end times (AS-504, 10 to 140 s)": [
            (label, _measure(run, (1, 10, 100, 1000), budget))
            for label, run, budget in (
                (
                    "sweep",
                    lambda count: sweep(member, study.with_means, np.linspace(10.0, 140.0, count + 1)[1:]),
                    BUDGET,
                ),
                ("CVODES Adams, an end time", on_as504(tight), BUDGET),
                # one pass over the flight: ten times as many end times take far less than ten times as long
                ("covariance equation, SciPy", on_as504(CovarianceEquation(1e-8)), 10 * BUDGET),
                ("ensemble of 500, compiled", on_as504(Ensemble()), 10 * BUDGET),
            )
        ],
        "parameter sets (AS-504)": [
            ("sweep, 130 end times, 1e-4, all cores", _measure(batches, (1, 10, 100, 1000), 8 * BUDGET)),
            ("CVODES Adams, one end time, 1e-5", _measure(one_by_one, (1, 10, 100, 1000))),
        ],
    }
    return rows


def _measure(
    run: Callable[[int], object], counts: tuple[int, ...], budget: float = BUDGET
) -> list[tuple[int, float | None]]:
    found: list[tuple[int, float | None]] = []
    last = 0.0
    run(counts[0])  # compilation and loading
    for count, before in zip(counts, (0, *counts), strict=False):
        if before and last * count / before > budget:
            found.append((count, None))
            continue
        start = time.perf_counter()
        run(count)
        last = time.perf_counter() - start
        found.append((count, last))
    return found
