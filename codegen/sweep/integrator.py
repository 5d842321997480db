"""The sweep integrator of a system as compiled code, called without Python's lock."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataError, IntegrationError, StepBudgetError
from ...model.system.linear_system import LinearSystem
from ..system.executable import ExecutableSystem
from ..system.functions import declared_sizes
from ..system.nominal import NominalNumbers
from ..toolchain.library import Library
from .kinds import kinds
from .on_grid import fills_means, takes_a_grid
from .segments import GridSteps, SegmentResults, Segments
from .source import LANES, MOST_STEPS, SweepFunctions

NOT_FINITE, TOO_SMALL_A_STEP, OUT_OF_RANGE, TOO_MANY_STEPS, NEARLY_SINGULAR = 1, 2, 3, 4, 5  # as in the templates
COUNTERS = ("steps", "rejected", "evaluations")


@dataclass(frozen=True, eq=False)
class CompiledSweep:
    """The sweep integrator of one system; calls from several threads do not disturb each other."""

    system: LinearSystem
    functions: SweepFunctions
    shared_library: Library

    def run(
        self,
        executable: ExecutableSystem,
        segments: Segments,
        tolerance: float,
        sizes: NDArray[np.float64] | None = None,
        steps: bool = False,
    ) -> SegmentResults:
        """Sweep over the segments.

        Parameters
        ----------
        executable : ExecutableSystem
            Parameters and tables.
        segments : Segments
        tolerance : float
            Of one step, relative to the size of the states.
        sizes : (n + responses,) array
            Typical sizes of states and responses; those that the system declares without it.
        steps : bool
            Keep the transition matrix of every segment and what noise adds in it.

        Raises
        ------
        IntegrationError, DataError
        """
        return self.integrate(executable, segments, tolerance, self._start(executable.parameters), sizes, steps)

    def _start(self, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        system, n = self.system, len(self.system.states)
        covariances = [system.start_covariance_matrix(name, parameters) for name in system.sources]
        return np.ascontiguousarray(np.array(covariances, float).reshape(len(system.sources), n, n))

    @cached_property
    def takes_a_grid(self) -> bool:
        """Whether the library holds the sweep on a given grid."""
        A = self.functions.stage.sparsity_out(0)
        return takes_a_grid(kinds(A, LANES), A)

    @cached_property
    def fills_means(self) -> bool:
        """Whether it fills the tables of the mean response itself."""
        A = self.functions.stage.sparsity_out(0)
        return self.takes_a_grid and fills_means(kinds(A, LANES), A, self.functions.means)

    def on_grid(
        self,
        executable: ExecutableSystem | NominalNumbers,
        segments: Segments,
        grid: GridSteps,
        state: NDArray[np.float64] | None = None,
        steps: bool = False,
        fill: bool = False,
    ) -> SegmentResults:
        """Sweep over segments with given steps, of Gauss collocation of order 8.

        Parameters
        ----------
        executable : ExecutableSystem
            Parameters and tables.
        segments : Segments
        grid : GridSteps
            Of the same segments.
        state : (sources, n, n) array
            Covariances of the states at the start, which become those at the end; the system's own without it.
        steps : bool
            Keep the transition matrix of every segment and what noise adds in it.
        fill : bool
            Take the mean that the tables of the mean response hold from the steps themselves, where
            :attr:`fills_means`; what the tables hold is not looked at then.

        Returns
        -------
        SegmentResults
            With errors of zero: no formula is embedded, who calls compares two grids.

        Raises
        ------
        IntegrationError, DataError
        """
        system = self.system
        k, n, s, r = segments.end.size, len(system.states), len(system.sources), len(system.outputs)
        state = self._start(executable.parameters) if state is None else state
        covariance, mean = np.empty((k, s, r, r)), np.empty((k, r))
        transition = np.empty((k, n, n)) if steps else None
        added = np.empty((k, s, n, n)) if steps else None
        counters, failure = np.zeros(3), np.zeros(2)
        arrays = (segments.end, segments.low, segments.high)
        given = [k, *(np.ascontiguousarray(array, float) for array in arrays)]
        given += [np.ascontiguousarray(grid.counts, np.intc), np.ascontiguousarray(grid.edges, float), int(fill)]
        given += [np.ascontiguousarray(array, float) for array in (executable.parameters, executable.tables)]
        results = (state, np.zeros(n), covariance, mean, transition, added, counters, failure)
        code = self.shared_library.call("sweep_on_grid", *given, *results)
        self._check(code, failure, executable, 0.0)
        return SegmentResults(covariance, mean, np.zeros((k, s, r)), transition, added, _named(counters))

    def integrate(
        self,
        executable: ExecutableSystem | NominalNumbers,
        segments: Segments,
        tolerance: float,
        state: NDArray[np.float64],
        sizes: NDArray[np.float64] | None = None,
        steps: bool = False,
    ) -> SegmentResults:
        """Sweep from covariances (sources, n, n) of the states, which become those at the end; else as ``run``."""
        system = self.system
        k, n, s, r = segments.end.size, len(system.states), len(system.sources), len(system.outputs)
        covariance, mean, error = np.empty((k, s, r, r)), np.empty((k, r)), np.empty((k, s, r))
        transition = np.empty((k, n, n)) if steps else None
        added = np.empty((k, s, n, n)) if steps else None
        counters, failure = np.zeros(3), np.zeros(2)
        given = self._arguments(executable, segments, tolerance, sizes)
        results = (state, np.zeros(n), covariance, mean, error, transition, added, counters, failure)
        code = self.shared_library.call("sweep", *given, *results)
        self._check(code, failure, executable, tolerance)
        return SegmentResults(covariance, mean, error, transition, added, _named(counters))

    def mean_history(
        self,
        executable: ExecutableSystem | NominalNumbers,
        segments: Segments,
        tolerance: float,
        sizes: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], dict[str, int]]:
        """Return states (k + 1, n) and outputs (k + 1, responses) of the mean at the start and all segment ends.

        The third is the counters.

        Raises
        ------
        IntegrationError, DataError
        """
        points = segments.end.size + 1
        states, outputs = np.empty((points, len(self.system.states))), np.empty((points, len(self.system.outputs)))
        counters, failure = np.zeros(3), np.zeros(2)
        given = self._arguments(executable, segments, tolerance, sizes)
        code = self.shared_library.call("mean_history", *given, states, outputs, counters, failure)
        self._check(code, failure, executable, tolerance)
        return states, outputs, _named(counters)

    def _arguments(
        self,
        executable: ExecutableSystem | NominalNumbers,
        segments: Segments,
        tolerance: float,
        sizes: NDArray[np.float64] | None = None,
    ) -> list[object]:
        arrays = (segments.end, segments.low, segments.high, executable.parameters, executable.tables)
        sizes = declared_sizes(self.system) if sizes is None else sizes
        by_address = [np.ascontiguousarray(array, float) for array in (*arrays, sizes)]
        return [segments.end.size, segments.start, *by_address[:-1], tolerance, by_address[-1]]

    def _check(
        self,
        code: int,
        failure: NDArray[np.float64],
        executable: ExecutableSystem | NominalNumbers,
        tolerance: float,
    ) -> None:
        time, entry = float(failure[0]), int(failure[1])
        if code == NOT_FINITE:
            for group in executable.groups:
                bad = ~np.isfinite(group.coefficients).all(axis=1)
                if bad.any():
                    interval, table = np.argwhere(bad)[0]
                    raise DataError(
                        f"table '{group.names[table]}' holds a value that is not finite near {group.argument} "
                        f"{group.knots[interval]:g}; correct the table",
                        time=time,
                    )
            for parameter, value in zip(self.system.parameters, executable.parameters, strict=True):
                if not np.isfinite(value):
                    raise DataError(f"parameter '{parameter.name}' is {value:g}; give it a finite value", time=time)
            raise IntegrationError(
                f"{self._entry(entry)} is not finite at t = {time:g} s; see what divides by zero there"
            )
        if code == TOO_SMALL_A_STEP:
            raise IntegrationError(
                f"a tolerance of {tolerance:g} a step cannot be met at t = {time:g} s; loosen it, or look for a jump "
                "that no event declares"
            )
        if code == TOO_MANY_STEPS:
            raise StepBudgetError(MOST_STEPS, f"t = {time:.6g} s", time=time)
        if code == NEARLY_SINGULAR:
            raise IntegrationError(
                f"the equations of a step near t = {time:g} s are nearly singular; take smaller steps"
            )
        if code == OUT_OF_RANGE:
            raise IntegrationError(
                f"the responses leave the range of numbers near t = {time:g} s; the system grows without bound there "
                "(see its roots)"
            )

    def _entry(self, entry: int) -> str:
        """Name a nonzero of A, B or E u by its number in the generated code."""
        names, stage = self.system.state_names, self.functions.stage
        A, B, known = (stage.sparsity_out(i) for i in range(3))
        if entry < A.nnz():
            return f"A: the effect of '{names[A.get_col()[entry]]}' on the rate of '{names[A.row()[entry]]}'"
        entry -= max(A.nnz(), 1)
        if entry < B.nnz():
            noise = self.system.noise_names[B.get_col()[entry]]
            return f"B: the effect of noise '{noise}' on the rate of '{names[B.row()[entry]]}'"
        row = known.row()[entry - max(B.nnz(), 1)]
        return f"the effect of the known inputs on the rate of '{names[row]}'"


def _named(counters: NDArray[np.float64]) -> dict[str, int]:
    return {name: int(value) for name, value in zip(COUNTERS, counters, strict=True)}
