"""Typical sizes of states and responses, found from the system: what absolute tolerances are measured by.

A size that a person declares, or the 1 of a system whose author declared none, can be any number of powers of ten off;
an absolute tolerance of it then is no tolerance, or one that nothing meets. So covariances and mean are carried over
the flight by a few exact steps of frozen matrices (runners/solvers/discretisation.py), whose size alone is used.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import declared_sizes
from ...model.errors import IntegrationError
from .discretisation import exact_steps
from .time_nodes import time_nodes

FIRST = 2.0 ** -np.arange(8, 0, -1)  # of the flight: from rest, sizes change fastest at the start
PIECES = 16
MISJUDGED = 1e-6  # of a declared size
LEAST = 1e-3  # of the largest: a source or mean smaller than that is resolved as if it had this size


@dataclass(frozen=True, eq=False)
class TypicalSizes:
    """Standard deviations by source, with the size of the mean as one source more, along a flight.

    Attributes
    ----------
    times : (k,) array
        s.
    states : (k, sources + 1, n) array
    outputs : (k, sources + 1, n_y) array
    """

    times: NDArray[np.float64]
    states: NDArray[np.float64]
    outputs: NDArray[np.float64]

    @property
    def largest_states(self) -> NDArray[np.float64]:
        """Largest size of each state over the flight, (n,); 0 for one that nothing moves."""
        return np.sqrt(np.square(self.states).sum(axis=1)).max(axis=0)

    @property
    def last_outputs(self) -> NDArray[np.float64]:
        """Size of each response at the end by the weakest of its sources that counts, (n_y,); 0 where all vanish."""
        sizes = self.outputs[-1]
        counting = np.where(sizes >= LEAST * sizes.max(axis=0), sizes, np.inf)
        return np.where(sizes.any(axis=0), np.min(counting, axis=0), 0.0)

    def least(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return the least size but zero of each source and state between two times, (sources + 1, n)."""
        within = (self.times > begin) & (self.times <= end)
        within[min(int(np.searchsorted(self.times, end)), self.times.size - 1)] = True
        sizes = np.where(self.states[within] > 0, self.states[within], np.inf).min(axis=0)
        return np.where(np.isfinite(sizes), sizes, 0.0)


def typical_sizes(executable: ExecutableSystem, time: float) -> TypicalSizes | None:
    """Return the sizes on a flight to ``time``, s; None where they are beyond numbers, or the flight is none."""
    system = executable.system
    span = time - system.start
    if not span > 0:
        return None
    parts = np.unique(np.concatenate([FIRST / PIECES, np.arange(1, PIECES + 1) / PIECES]))
    times = time_nodes(executable, system.start + span * parts)
    times[-1] = time
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            steps = exact_steps(executable, times.tolist(), span, graded=False)
    except IntegrationError:
        return None
    n, scale = len(system.states), steps.scale
    P = np.array([system.start_covariance_matrix(s, executable.parameters) for s in system.sources]).reshape(-1, n, n)
    P, mean = P / np.outer(scale, scale), np.zeros(n)
    states, outputs = [], []
    with np.errstate(all="ignore"):
        for Phi, Q, b, C, direct in zip(
            steps.transition, steps.added, steps.forced, steps.output, steps.direct, strict=True
        ):
            P, mean = Phi @ P @ Phi.T + Q, Phi @ mean + b
            deviation = np.sqrt(np.maximum(np.einsum("sii->si", P), 0.0))
            states.append(scale * np.concatenate([deviation, np.abs(mean)[None]]))
            deviation = np.sqrt(np.maximum(np.einsum("ri,sij,rj->sr", C, P, C), 0.0))
            outputs.append(np.concatenate([deviation, np.abs(C @ mean + direct)[None]]))
    found = TypicalSizes(times, np.array(states), np.array(outputs))
    return found if np.isfinite(found.states).all() and np.isfinite(found.outputs).all() else None


def sizes_of_sweep(executable: ExecutableSystem, time: float, trust: bool = True) -> NDArray[np.float64]:
    """Return sizes of states and responses on a flight to ``time``, s, none zero, (n + n_y,).

    Those that a vehicle or a person declares, if they are trusted; else those nearest to them that occur on the flight.
    The sweep weighs by them until it has covariances of its own, and holds nothing below 1e-10 of them for something.
    """
    declared = declared_sizes(executable.system)
    found = None if trust and (declared != 1.0).any() else typical_sizes(executable, time)
    if found is None:
        return declared
    sizes = np.concatenate([found.states, found.outputs], axis=2)
    together = np.sqrt(np.square(sizes).sum(axis=1))
    least = np.where(together > 0, together, np.inf).min(axis=0)
    moved = np.isfinite(least)
    if not moved.any():
        return declared
    near = np.clip(declared, least, together.max(axis=0))
    return np.where(moved, near, np.exp(np.log(near[moved]).mean()))


def misjudged(sizes: NDArray[np.float64], covariance: NDArray[np.float64]) -> bool:
    """Return whether a response stays so far below its size that the sweep did not resolve it.

    Parameters
    ----------
    sizes : (n + n_y,) array
    covariance : (k, sources, n_y, n_y) array
    """
    if covariance.size == 0:
        return False
    deviation = np.sqrt(np.maximum(np.einsum("ksrr->ksr", covariance), 0.0)).max(axis=(0, 1))
    return bool((deviation < MISJUDGED * sizes[-deviation.size :])[deviation > 0].any())


def mean_misjudged(sizes: NDArray[np.float64], states: NDArray[np.float64]) -> bool:
    """Return whether the mean of a state stays so far below its size that the forward mean did not resolve it.

    Parameters
    ----------
    sizes : (n + n_y,) array
    states : (k, n) array
    """
    largest = np.abs(states).max(axis=0)
    return bool((largest < MISJUDGED * sizes[: largest.size])[largest > 0].any())
