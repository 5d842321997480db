"""What all sensitivities of a flight share: nodes, tables and matrices at them, the solver, and the mean response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...codegen.nodes.compiled import NodeFunctions
from ...codegen.nodes.matrix import NodeMatrix
from ...codegen.sweep.gauss_legendre import STAGES
from ...codegen.system.executable import ExecutableSystem
from ...model.errors import StepBudgetError
from .collocation import Collocation, CompiledCollocation, collocation
from .collocation_grid import Grid, StepLengths, collocation_grid, step_lengths, tables_at
from .step_budget import naming_fastest_root

FROZEN = 7  # times at which the roots of A are looked at
MOST_STEPS = 100_000  # of the grid; AS-504 takes 4000


@dataclass(frozen=True, eq=False)
class FlightNodes:
    """A system on a grid of k steps with 4 k nodes.

    Attributes
    ----------
    executable : ExecutableSystem
        With its tables of the mean response filled in.
    functions : NodeFunctions
    grid : Grid
    numbers : (n_z,) array
        Of the parameters in force.
    tables : (4 k, n_v) array
        Values at the nodes.
    matrices : dict of str to NodeMatrix
        A, B, C, E, G and the known inputs at the nodes.
    solver : Collocation or CompiledCollocation
    """

    executable: ExecutableSystem
    functions: NodeFunctions
    grid: Grid
    numbers: NDArray[np.float64]
    tables: NDArray[np.float64]
    matrices: dict[str, NodeMatrix]
    solver: Collocation | CompiledCollocation

    @staticmethod
    def until(
        executable: ExecutableSystem,
        functions: NodeFunctions,
        times: Sequence[float],
        steps: StepLengths | None = None,
        keep: bool = False,
    ) -> FlightNodes:
        """Evaluate everything from the start to the last of the end times, s.

        ``steps`` are those of the grid; from the roots of A without it. ``keep`` is for many solutions
        (:class:`CompiledCollocation`).
        """
        system, numbers = executable.system, functions.numbers(executable.parameters)
        flight = max(times) - system.start
        if steps is None:
            spread = system.start + flight * (np.arange(FROZEN) + 0.5) / FROZEN
            frozen = functions.matrices(spread, tables_at(executable.groups, spread), numbers)
            steps = step_lengths(frozen["A"].dense, flight)
        if flight > MOST_STEPS * steps.longest:
            time = system.start + 0.5 * flight
            with naming_fastest_root(executable):
                raise StepBudgetError(MOST_STEPS, f"t = {time:.6g} s", time=time)
        grid = collocation_grid(executable, times, steps)
        nodes = grid.nodes.ravel()
        tables = tables_at(executable.groups, nodes)
        matrices = functions.matrices(nodes, tables, numbers)
        solver = collocation(grid, matrices["A"], functions.shared_library, keep)
        return FlightNodes(executable, functions, grid, numbers, tables, matrices, solver)

    @cached_property
    def mean(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """States of the mean response at the nodes (k, 4, n) and at the edges (k + 1, n)."""
        n = len(self.executable.system.states)
        known = self.matrices["E"].times(self.matrices["inputs"].dense[..., 0])
        return self.solver.forward(np.zeros(n), known.reshape(-1, STAGES, n))
