"""The compiled ensemble of a system: C written for its sizes, compiled, cached, and called without Python's lock."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError
from ...model.system.linear_system import LinearSystem
from ..toolchain.cache import CompiledLibrary, compiled_library, wrong_numbers
from ..toolchain.compiler import find_compiler
from ..toolchain.interruption import call
from .check import AGREEMENT, difference_from_numpy
from .source import ensemble_fingerprint, ensemble_sizes, ensemble_source


class EnsembleNeedsCompilerError(AscentwindError):
    """The ensemble exists as compiled code only."""


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

    shared_library: CompiledLibrary

    @cached_property
    def _handle(self) -> ctypes.CDLL:
        return ctypes.CDLL(str(self.shared_library.path))

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
        call(
            self._handle.ensemble, ctypes.c_uint64(seed), ctypes.c_uint32(first), ctypes.c_int(runs), ctypes.c_int(k),
            *(a.ctypes.data_as(ctypes.c_void_p) for a in (*arrays, moments)),
            ctypes.c_void_p(None) if paths is None else paths.ctypes.data_as(ctypes.c_void_p),
        )  # fmt: skip
        return moments, paths

    def standard_normals(self, seed: int, run: int, step: int, source: int, pairs: int) -> NDArray[np.float64]:
        """Return the standard normal numbers of one run, step (0 is the start) and source."""
        z = np.empty(2 * pairs)
        self._handle.standard_normals(
            ctypes.c_uint64(seed), *map(ctypes.c_uint32, (run, step, source)), ctypes.c_int(pairs),
            z.ctypes.data_as(ctypes.c_void_p),
        )  # fmt: skip
        return z


def compiled_ensemble(system: LinearSystem) -> CompiledEnsemble:
    """Compile the ensemble of a system, or take it from the cache; hold its numbers against NumPy's.

    Raises
    ------
    EnsembleNeedsCompilerError, CompilerError, CacheError
    """
    compiler = find_compiler()
    if compiler is None:
        raise EnsembleNeedsCompilerError(
            "the ensemble is compiled for each system, and no C compiler was found (CC, cc, gcc, clang); install one, "
            "or use another engine"
        )
    sizes = ensemble_sizes(system)
    library = compiled_library(
        f"{system.name}-ensemble",
        ensemble_fingerprint(system),
        lambda: ensemble_source(system),
        compiler,
        {name: str(size) for name, size in sizes.items()},
    )
    engine = CompiledEnsemble(library)
    difference = difference_from_numpy(engine, **sizes)
    if not difference <= AGREEMENT:
        raise wrong_numbers(library, difference)
    return engine
