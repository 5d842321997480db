"""A flight as a Markov chain on a grid: what each step does to the states, what noise adds, and what outputs see.

Between grid points x_{k+1} = Phi_k x_k + e_k, e_k normal with the covariance that noise adds in the step; outputs are
y_k = mean_k + C_k x_k. So the covariance of an output between two times is R(t, s) = C(t) P(t) Phi(s, t)' C(s)', t
before s. Two roads give the same chain: the generated sweep, and exact steps by matrix exponentials where nothing is
compiled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.integrator import CompiledSweep
from ...codegen.system.evaluation import MatrixEvaluator
from ...codegen.system.executable import ExecutableSystem
from ...model.system.linear_system import LinearSystem
from .discretisation import exact_steps
from .sweep import flight_segments, longest_segment, swept
from .time_nodes import intervals


@dataclass(frozen=True, eq=False)
class MarkovChain:
    """The deviation of the states from their mean, and the outputs, at m times.

    Attributes
    ----------
    times : (m,) array
        s, increasing.
    transition : (m - 1, n, n) array
        Phi of each step.
    added : (m - 1, sources, n, n) array
        Covariance that noise adds in each step.
    start : (sources, n, n) array
        Covariance of the states at the first time.
    state_matrix : (m, n, n) array
        A; on a discontinuity from the left, as the next ones.
    noise_matrix : (m, n, noises) array
        B.
    noise_source : (noises,) array of int
        Number of the source that each noise belongs to.
    output : (m, n_y, n) array
        C.
    mean : (m, n_y) array
        Of the outputs.
    """

    times: NDArray[np.float64]
    transition: NDArray[np.float64]
    added: NDArray[np.float64]
    start: NDArray[np.float64]
    state_matrix: NDArray[np.float64]
    noise_matrix: NDArray[np.float64]
    noise_source: NDArray[np.intp]
    output: NDArray[np.float64]
    mean: NDArray[np.float64]

    def covariance(self, sources: Sequence[int] | None = None) -> NDArray[np.float64]:
        """Return the covariance P of the states at every time, (m, n, n), from some sources by number or from all.

        It is not kept: of all sources and times it is as large as the chain itself.
        """
        acting = slice(None) if sources is None else list(sources)
        P = [self.start[acting].sum(axis=0)]
        for Phi, Q in zip(self.transition, self.added[:, acting].sum(axis=1), strict=True):
            P.append(Phi @ P[-1] @ Phi.T + Q)
        return np.array(P)

    def acting_noise_matrix(self, sources: Sequence[int] | None = None) -> NDArray[np.float64]:
        """Return the columns of B of some sources by number or of all, (m, n, noises of theirs)."""
        if sources is None:
            return self.noise_matrix
        return self.noise_matrix[:, :, np.isin(self.noise_source, list(sources))]

    def source_covariances(self) -> Iterator[NDArray[np.float64]]:
        """Give the covariances of the states by source, (sources, n, n), at one time after another."""
        P = self.start
        yield P
        for Phi, Q in zip(self.transition, self.added, strict=True):
            P = Phi @ P @ Phi.T + Q
            yield P

    def part(self, points: slice, start: NDArray[np.float64] | None = None) -> MarkovChain:
        """Return the chain over consecutive times; the covariances at the first are found where they are not given."""
        first, last, _ = points.indices(self.times.size)
        steps = slice(first, last - 1)
        if start is None:
            start = next(islice(self.source_covariances(), first, None))
        return MarkovChain(
            self.times[points],
            self.transition[steps],
            self.added[steps],
            start,
            self.state_matrix[points],
            self.noise_matrix[points],
            self.noise_source,
            self.output[points],
            self.mean[points],
        )


def chain_by_sweep(
    engine: CompiledSweep, executable: ExecutableSystem, times: NDArray[np.float64], relative_tolerance: float
) -> MarkovChain:
    """Return the chain at given times from one sweep.

    Parameters
    ----------
    engine : CompiledSweep
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    times : (m,) array
        s, increasing, cut where flight is cut (:func:`time_nodes`).
    relative_tolerance : float

    Raises
    ------
    IntegrationError, DataError
    """
    segments = flight_segments(
        executable, tuple(times.tolist()), longest_segment(float(times[-1] - executable.system.start))
    )
    found = swept(engine, executable, segments, relative_tolerance, steps=True)
    assert found.transition is not None and found.added is not None
    system = executable.system
    P = np.array([system.start_covariance_matrix(s, executable.parameters) for s in system.sources])
    P = P.reshape(len(system.sources), *found.transition.shape[1:])
    at = np.where(times > system.start, np.searchsorted(segments.end, times), -1)
    for k in range(at[0] + 1):
        P = found.transition[k] @ P @ found.transition[k].T + found.added[k]
    transition, added = found.transition[at[1:]], found.added[at[1:]]
    for step, (before, last) in enumerate(pairwise(at.tolist())):
        for k in range(last - 1, before, -1):  # a step in which flight is cut again, from its end to its begin
            added[step] += transition[step] @ found.added[k] @ transition[step].T
            transition[step] = transition[step] @ found.transition[k]
    A, B, output, direct = _matrices(executable, times)
    mean = np.where(at[:, None] < 0, direct, found.mean[at])
    return MarkovChain(times, transition, added, P, A, B, _noise_source(system), output, mean)


def chain_by_exact_steps(executable: ExecutableSystem, times: NDArray[np.float64], substep: float) -> MarkovChain:
    """Return the chain at given times by matrix exponentials; arguments as for :func:`chain_by_sweep`.

    ``substep`` is the largest span over which the matrices are taken as linear in time, s.

    Raises
    ------
    IntegrationError
    """
    steps, system = exact_steps(executable, times.tolist(), substep), executable.system
    size = np.outer(steps.scale, steps.scale)
    P = np.array([system.start_covariance_matrix(s, executable.parameters) for s in system.sources])
    P = P.reshape(len(system.sources), *size.shape)
    transition = steps.transition * (steps.scale[:, None] / steps.scale)
    added = steps.added * size
    P = transition[0] @ P @ transition[0].T + added[0]
    A, B, output, direct = _matrices(executable, times)
    mean, state = [], np.zeros(steps.scale.size)
    for Phi, b, C, G in zip(transition, steps.forced * steps.scale, output, direct, strict=True):
        state = Phi @ state + b
        mean.append(C @ state + G)
    return MarkovChain(times, transition[1:], added[1:], P, A, B, _noise_source(system), output, np.array(mean))


def _noise_source(system: LinearSystem) -> NDArray[np.intp]:
    return np.array([system.sources.index(noise.source) for noise in system.noises], np.intp)


def _matrices(executable: ExecutableSystem, times: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return A, B, C and G u at the times."""
    evaluate = MatrixEvaluator(executable, ("A", "B", "C", "G", "inputs"))
    pieces = intervals(executable, executable.system.start, float(times[-1]))
    found = []
    for time, which in zip(times.tolist(), np.searchsorted([p.end for p in pieces], times), strict=True):
        A, B, C, G, inputs = evaluate(time, pieces[which].low, pieces[which].high)
        found.append((A, B, C, (G @ inputs)[:, 0]))
    return [np.array(parts) for parts in zip(*found, strict=True)]
