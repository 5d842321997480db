"""Ensembles of simulated flights in NumPy, and the discretisation error of each by its exact covariance recursion.

A flight is x <- Phi x + noise with a transition and a noise per step that depend on the formula and the step alone. Its
covariance therefore follows P <- Phi P Phi' + Q without any sampling: what differs from the covariance equation is
the error of the discretisation, and what an ensemble of N adds to it is the error of sampling.

    python benchmarks/numpy_ensembles.py

prints the first for several steps (some 5 min).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.runners import Study
from ascentwind.runners.solvers.covariance import covariance_equation
from ascentwind.runners.solvers.time_nodes import intervals

Formula = Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Scheme:
    """A formula at a step.

    Attributes
    ----------
    formula : callable
        (A, B, h) of a step to its transition (n, n) and the effect (n, noises) of unit normal numbers.
    step : float
        Largest, s.
    at : float
        Where in the step A and B are taken, 0 to 1.
    """

    formula: Formula
    step: float
    at: float


def euler_maruyama(step: float) -> Scheme:
    """x <- (I + h A) x + B sqrt(h) n, with A and B at the begin of the step."""
    return Scheme(lambda A, B, h: (np.eye(len(A)) + h * A, np.sqrt(h) * B), step, 0.0)


def fourth_order(step: float) -> Scheme:
    """A fourth-order Taylor step with A and B of its middle; the noise acts there."""

    def formula(A: np.ndarray, B: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        unit, hA = np.eye(len(A)), h * A
        Phi = unit + hA @ (unit + hA @ (unit + hA @ (unit + hA / 4) / 3) / 2)
        return Phi, np.sqrt(h) * (unit + 0.5 * hA) @ B

    return Scheme(formula, step, 0.5)


def ensemble(study: Study, scheme: Scheme, runs: int, times: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return responses (times, responses, sources, runs) of simulated flights, all sources and runs side by side."""
    system = study.system
    columns = [system.noise_columns(source) for source in system.sources]
    n = len(system.states)
    x = np.zeros((n, len(columns), runs))
    for s, P in enumerate(_start(study)):
        values, vectors = np.linalg.eigh(P)
        x[:, s] = vectors @ (np.sqrt(np.maximum(values, 0))[:, None] * random.standard_normal((n, runs)))
    found = []
    for _, C, steps in _flight(study, scheme, times):
        for Phi, effect in steps:
            x = (Phi @ x.reshape(n, -1)).reshape(x.shape)
            for s, own in enumerate(columns):
                x[:, s] += effect[:, own] @ random.standard_normal((len(own), runs))
        found.append(np.einsum("ri,isk->rsk", C, x))
    return np.array(found)


def discretised_std(study: Study, scheme: Scheme, times: np.ndarray) -> np.ndarray:
    """Return standard deviations (times, responses, sources) of a scheme with infinitely many flights."""
    system = study.system
    members = np.array([[n.source == s for n in system.noises] for s in system.sources], float)
    P = np.array(_start(study))
    found = []
    for _, C, steps in _flight(study, scheme, times):
        for Phi, effect in steps:
            P = Phi @ P @ Phi.T + (effect * members[:, None, :]) @ effect.T
        found.append(np.sqrt(np.einsum("ri,sij,rj->rs", C, P, C)))
    return np.array(found)


def _start(study: Study) -> list[np.ndarray]:
    system, parameters = study.system, study.executable.parameters
    return [system.start_covariance_matrix(source, parameters) for source in system.sources]


def _flight(
    study: Study, scheme: Scheme, times: np.ndarray
) -> Iterator[tuple[float, np.ndarray, Iterator[tuple[np.ndarray, np.ndarray]]]]:
    """Yield each output time with C there and the steps (transition, effect of noise) that lead to it."""
    executable, system, begin = study.with_means, study.system, study.system.start
    matrices, outputs = MatrixEvaluator(executable, ("A", "B")), MatrixEvaluator(executable, ("C",))

    def steps(begin: float, end: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for piece in intervals(executable, begin, end):
            count = max(1, int(np.ceil((piece.end - piece.begin) / scheme.step - 1e-9)))
            h = (piece.end - piece.begin) / count
            for k in range(count):
                A, B = matrices(piece.begin + (k + scheme.at) * h, piece.low, piece.high)
                yield scheme.formula(A, B, h)

    for time in times.tolist():
        last = intervals(executable, system.start, time)[-1]
        (C,) = outputs(time, last.low, last.high)
        yield time, C, steps(begin, time)
        begin = time


def main() -> None:
    """Print the largest relative discretisation error of each scheme over the flight, by source."""
    study, times = Study.load("as504"), np.arange(11.0, 141.0)
    reference = np.sqrt(covariance_equation(study.with_means, times.tolist(), 1e-12).variance)
    for name, make, steps in (
        ("order 4", fourth_order, (2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4)),
        ("Euler-Maruyama", euler_maruyama, (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)),
    ):
        for step in steps:
            error = np.abs(discretised_std(study, make(step), times) / reference - 1).max(axis=(0, 1))
            shown = ", ".join(f"{source} {e:.1e}" for source, e in zip(study.system.sources, error, strict=True))
            print(f"{name}, {1e3 * step:g} ms: {shown}", flush=True)


if __name__ == "__main__":
    main()
