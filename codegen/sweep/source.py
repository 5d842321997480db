"""The C source of the sweep: a complete integrator for one linear system, all end times in one pass."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...model.system.linear_system import LinearSystem
from ..toolchain.c_printer import c_function, c_statements, enumerators
from ..toolchain.fingerprint import fingerprint
from ..toolchain.templates import render
from .runge_kutta import DOP853, RungeKutta

LANES = 8  # columns side by side: one 512-bit register, two of 256 bits
MOST_STEPS = 200_000  # of one sweep; AS-504 takes 5000 at the tolerance of 1e-7, 18,000 at 1e-12


@dataclass(frozen=True, eq=False)
class SweepFunctions:
    """The arithmetic of the sweep, without table lookup.

    Attributes
    ----------
    stage : Function
        (t, v, p) -> A, B and E u, sparse: all that a stage needs, common subexpressions shared between them.
    output : Function
        (t, v, p) -> C, sparse, and G u, dense.
    """

    stage: ca.Function
    output: ca.Function


def sweep_functions(system: LinearSystem) -> SweepFunctions:
    """Derive the functions of a system that its sweep needs."""
    at = [system.time, system.v, system.p]
    inputs = system.input_values
    known = ca.sparsify(system.E @ inputs) if system.u.numel() else ca.SX(len(system.states), 1)
    direct = ca.densify(system.G @ inputs) if system.u.numel() else ca.SX.zeros(len(system.outputs))
    return SweepFunctions(
        stage=ca.Function("stage", at, ca.cse([system.A, system.B, known])),
        output=ca.Function("output", at, ca.cse([system.C, direct])),
    )


def sweep_fingerprint(system: LinearSystem, functions: SweepFunctions) -> str:
    """Return a hash of all that ``sweep_source`` writes from."""
    files = ("sweep/source.py", "sweep/runge_kutta.py", "templates/sweep.c.jinja")
    return fingerprint(system, (functions.stage, functions.output), files)


def sweep_source(system: LinearSystem, functions: SweepFunctions, formula: RungeKutta = DOP853) -> str:
    """Return the C source of the sweep of a system: structure only, numbers are read at run time."""
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    stage, n = functions.stage, len(system.states)
    A, B, known = (stage.sparsity_out(i) for i in range(3))
    C = functions.output.sparsity_out(0)
    noises = [(i, k) for k, source in enumerate(system.sources) for i in system.noise_columns(source)]
    weighted = [i for i, b in enumerate(formula.weights) if b != 0.0]
    return render(
        "sweep.c.jinja",
        title=f"{system.name}: all end times in one pass",
        structure=system.structure,
        system=system,
        groups=_groups(system),
        table_values=system.v.numel(),
        enumerators=[e for e in (names["v"], names["p"]) if e],
        lanes=LANES,
        most_steps=MOST_STEPS,
        blocks=-(-n // LANES),
        nonzeros={"A": A.nnz(), "B": B.nnz(), "known": known.nnz(), "C": C.nnz()},
        stage_statements=c_statements(
            stage, ("t", "v", "p"), ("A", "B", "known"), names, dict.fromkeys(("t", "v", "A", "B", "known"), "j")
        ),
        output_function=c_function("output", functions.output, ("t", "v", "p"), ("C", "direct"), names),
        rows=_entries(A, by_row=True),
        columns=_entries(A, by_row=False),
        noise_columns=[_entries(B, by_row=False)[i] for i, _ in noises],
        noise_sources=[k for _, k in noises],
        known_rows=known.row(),
        output_rows=_entries(C, by_row=True),
        formula=formula,
        weighted=weighted,
    )


def _groups(system: LinearSystem) -> list[dict[str, object]]:
    position = {name: i for i, name in enumerate(name for g in system.tables for name in g.names)}
    groups, first, offset = [], 0, 0
    for group in system.tables:
        groups.append(
            {
                "name": group.name,
                "argument": "t" if group.argument == "time" else f"v[{position[group.argument]}][j]",
                "knots": group.knots.size,
                "tables": len(group.names),
                "first": first,
                "offset": offset,
            }
        )
        first += len(group.names)
        offset += group.size
    return groups


def _entries(sparsity: ca.Sparsity, by_row: bool) -> list[list[tuple[int, int]]]:
    """Return for every row (or column) its nonzeros as (number of the nonzero, column (or row))."""
    found: list[list[tuple[int, int]]] = [[] for _ in range(sparsity.size1() if by_row else sparsity.size2())]
    for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True)):
        found[i if by_row else j].append((k, j if by_row else i))
    return found
