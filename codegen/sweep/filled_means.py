"""Which tables of the mean response a sweep can fill while it goes, and what of the equations waits for them.

A segment's mean goes forward through the factors of its steps before the adjoint goes back through the same. That is
possible where the mean itself does not depend on its tables: they stand in the noise matrix, or multiply states that
no known input reaches, such as those of a noise filter, which nothing else drives either.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...model.system.linear_system import LinearSystem
from ..system.functions import direct_response, known_rate
from .kinds import reaching


@dataclass(frozen=True, eq=False)
class FilledMeans:
    """How a sweep fills the tables of the mean.

    Attributes
    ----------
    from_outputs, from_states : tuples of pairs
        The number of a table's value, and that of the output or state that it holds.
    late : tuple of int
        Nonzeros of A that depend on the tables.
    outputs : Function
        (t, v, p) -> rows of C for ``from_outputs``, in their order, sparse, and G u of the same, dense.
    waiting : Function
        (t, v, p) -> the late nonzeros of A, dense, and B, sparse as in the sweep.
    """

    from_outputs: tuple[tuple[int, int], ...]
    from_states: tuple[tuple[int, int], ...]
    late: tuple[int, ...]
    outputs: ca.Function
    waiting: ca.Function


def filled_means(system: LinearSystem) -> FilledMeans | None:
    """Return how a sweep of a system can fill its tables of the mean; None where it has none, or cannot."""
    sources = system.mean_sources
    if not sources:
        return None
    of_mean, at = system.v[list(sources)], [system.time, system.v, system.p]
    from_outputs = tuple((value, i) for value, (kind, i) in sources.items() if kind == "output")
    from_states = tuple((value, i) for value, (kind, i) in sources.items() if kind == "state")
    A, B, known = ca.SX(system.A), ca.SX(system.B), known_rate(system)
    rows = [output for _, output in from_outputs]
    C, direct = ca.SX(system.C)[rows, :], direct_response(system)[rows]
    late = _depending(A, of_mean)
    held = {A.sparsity().get_col()[k] for k in late} | {C.sparsity().get_col()[k] for k in _depending(C, of_mean)}
    reached, driven = reaching(A.sparsity()), set(ca.sparsify(known).row())
    if any(reached[state] & driven for state in held) or _depending(ca.vertcat(known, direct), of_mean):
        return None
    waiting = ca.cse([ca.vertcat(*(A.nz[k] for k in late)) if late else ca.SX.zeros(0), B])
    return FilledMeans(
        from_outputs,
        from_states,
        tuple(late),
        ca.Function("filled", at, ca.cse([C, direct])),
        ca.Function("waiting", at, waiting),
    )


def _depending(matrix: ca.SX, on: ca.SX) -> list[int]:
    """Return the nonzeros of a matrix that depend on symbols."""
    values = ca.vertcat(*(matrix.nz[k] for k in range(matrix.nnz()))) if matrix.nnz() else ca.SX.zeros(0)
    return sorted(set(ca.jacobian(values, on).sparsity().row()))
