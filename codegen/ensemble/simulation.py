"""Simulated flights as compiled code: exact steps of many runs, called without Python's lock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..toolchain.library import Library


@dataclass(frozen=True, eq=False)
class Steps:
    """Exact steps of a noise-driven linear system from one grid point to the next, outputs at their ends.

    Attributes
    ----------
    start : (sources, n, n) array
        A square root of each source's start covariance.
    transition : (k, n, n) array
    noise : (k, sources, n, n) array
        A square root of the covariance that each source adds.
    output : (k, n_y, n) array
    """

    start: NDArray[np.float64]
    transition: NDArray[np.float64]
    noise: NDArray[np.float64]
    output: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CompiledEnsemble:
    """The ensemble of one size of system; calls from several threads do not disturb each other."""

    shared_library: Library

    def run(
        self, steps: Steps, seed: int, first: int, runs: int, keep_paths: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """Simulate runs ``first`` to ``first + runs - 1``.

        Returns
        -------
        moments : (k, n_y, sources + 1, 2) array
            Sums of y and y^2 over the runs, by source, then of all sources together.
        paths : (runs, k, n_y) array or None
            All sources together.
        """
        k, outputs, _ = steps.output.shape
        moments = np.zeros((k, outputs, steps.start.shape[0] + 1, 2))
        paths = np.empty((runs, k, outputs)) if keep_paths else None
        arrays = [np.ascontiguousarray(a) for a in (steps.start, steps.transition, steps.noise, steps.output)]
        numbers = (np.uint64(seed), np.uint32(first), runs, k)
        self.shared_library.call("ensemble", *numbers, *arrays, moments, paths)
        return moments, paths

    def standard_normals(self, seed: int, run: int, step: int, source: int, pairs: int) -> NDArray[np.float64]:
        """Return the standard normal numbers of one run, step (0 is the start) and source."""
        z = np.empty(2 * pairs)
        counters = map(np.uint32, (run, step, source))
        self.shared_library.call_to_the_end("standard_normals", np.uint64(seed), *counters, pairs, z)
        return z
