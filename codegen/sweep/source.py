"""The C source of the sweep: a complete integrator for one linear system, all end times in one pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import casadi as ca

from ...model.system.linear_system import LinearSystem
from ..system.functions import direct_response, known_rate
from ..system.table_layout import table_layout
from ..toolchain.c_printer import c_function, c_statements, enumerators
from ..toolchain.fingerprint import fingerprint
from ..toolchain.templates import render
from .filled_means import FilledMeans, filled_means
from .kinds import Kind, Span, entries, kinds, spans
from .on_grid import TEMPLATE, grid_arguments
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
    means : FilledMeans or None
        How a sweep on a grid fills the tables of the mean response.
    """

    stage: ca.Function
    output: ca.Function
    means: FilledMeans | None


def sweep_functions(system: LinearSystem) -> SweepFunctions:
    """Derive the functions of a system that its sweep needs."""
    at = [system.time, system.v, system.p]
    return SweepFunctions(
        stage=ca.Function("stage", at, ca.cse([system.A, system.B, ca.sparsify(known_rate(system))])),
        output=ca.Function("output", at, ca.cse([system.C, direct_response(system)])),
        means=filled_means(system),
    )


def sweep_fingerprint(system: LinearSystem, functions: SweepFunctions) -> str:
    """Return a hash of all that ``sweep_source`` writes from."""
    files = (
        *("sweep/source.py", "sweep/kinds.py", "sweep/runge_kutta.py", "templates/sweep.c.jinja"),
        *("sweep/on_grid.py", "sweep/filled_means.py", "sweep/gauss_legendre.py", "nodes/elimination.py"),
        f"templates/{TEMPLATE}",
    )
    return fingerprint(system, (functions.stage, functions.output), files)


def sweep_source(
    system: LinearSystem, functions: SweepFunctions, formula: RungeKutta = DOP853, with_grid: bool = False
) -> str:
    """Return the C source of the sweep of a system: structure only, numbers are read at run time.

    ``with_grid`` adds the sweep on a given grid, where the system's structure is sparse enough for it.
    """
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    stage, n = functions.stage, len(system.states)
    A, B, known = (stage.sparsity_out(i) for i in range(3))
    C = functions.output.sparsity_out(0)
    noises = [(i, k) for k, source in enumerate(system.sources) for i in system.noise_columns(source)]
    weighted = [i for i, b in enumerate(formula.weights) if b != 0.0]
    of = kinds(A, LANES)
    place, own_row = _places(of, n)
    by_noise = entries(B, by_row=False)
    columns = [by_noise[i] for i, _ in noises]
    reached = [spans(of, (row for _, row in column), LANES) for column in columns]
    kind_values = [_kind(kind, A, columns, known.row()) for kind in of]
    values = dict(
        title=f"{system.name}: all end times in one pass",
        structure=system.structure,
        system=system,
        groups=table_layout(system, "v[{}][j]"),
        table_values=system.v.numel(),
        enumerators=[e for e in (names["v"], names["p"]) if e],
        lanes=LANES,
        most_steps=MOST_STEPS,
        blocks=sum(kind.blocks for kind in of),
        kinds=kind_values,
        first_of_kind=[kind.first * LANES for kind in of for _ in range(kind.blocks)],
        most_rows=max(len(kind.rows) for kind in of),
        place=place,
        own_row=own_row,
        reaches=[(i, *span) for i, found in enumerate(reached) for span in found],
        products=[
            (first, count, *rows, *over)
            for first, count in _alike([k for _, k in noises], reached)
            for k, rows in enumerate(reached[first])
            for over in reached[first][k:]
        ],
        nonzeros={"A": A.nnz(), "B": B.nnz(), "known": known.nnz(), "C": C.nnz()},
        stage_statements=c_statements(
            stage, ("t", "v", "p"), ("A", "B", "known"), names, dict.fromkeys(("t", "v", "A", "B", "known"), "j")
        ),
        output_function=c_function("output", functions.output, ("t", "v", "p"), ("C", "direct"), names),
        rows=entries(A, by_row=True),
        noise_columns=columns,
        noise_sources=[k for _, k in noises],
        known_rows=known.row(),
        output_rows=entries(C, by_row=True),
        formula=formula,
        weighted=weighted,
    )
    source = render("sweep.c.jinja", **values)
    more = grid_arguments(of, kind_values, A, LANES, names, functions.means) if with_grid else None
    return source if more is None else source + render(TEMPLATE, **values, **more)


def _alike(sources: list[int], reached: list[list[Span]]) -> list[tuple[int, int]]:
    """Return first and number of consecutive noises of one source that reach the same columns."""
    found: list[tuple[int, int]] = []
    for _, noises in groupby(range(len(sources)), key=lambda i: (sources[i], reached[i])):
        of = list(noises)
        found.append((of[0], len(of)))
    return found


def _places(of: Sequence[Kind], states: int) -> tuple[list[int], list[int]]:
    """Return the column of each state's adjoint, and the row of the state in its own block."""
    place, own_row = [0] * states, [0] * states
    for kind in of:
        for k, state in enumerate(kind.states):
            place[state] = kind.first * LANES + k
            own_row[state] = kind.rows.index(state)
    return place, own_row


def _kind(kind: Kind, A: ca.Sparsity, noises: list[list[tuple[int, int]]], known: list[int]) -> dict[str, object]:
    """Return what a kind of blocks is written from: entries of A, B and E u by the rows that they have in it."""
    at = {state: row for row, state in enumerate(kind.rows)}
    by_state = entries(A, by_row=False)
    within = [[(k, at[i]) for k, i in column if i in at] for column in noises]
    return {
        "index": kind.index,
        "states": kind.states,
        "rows": kind.rows,
        "first": kind.first,
        "blocks": kind.blocks,
        "columns": [[(k, at[i]) for k, i in by_state[state] if i in at] for state in kind.rows],
        "noises": [(n, column) for n, column in enumerate(within) if column],
        "known": [(n, at[i]) for n, i in enumerate(known) if i in at],
    }
