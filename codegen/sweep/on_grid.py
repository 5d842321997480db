"""The C of the sweep on a given grid: what each kind of columns is eliminated by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ..nodes.elimination import elimination_plan
from ..toolchain.c_printer import c_statements
from .filled_means import FilledMeans
from .gauss_legendre import FROM_STAGES, NODES, TABLEAU, WEIGHTS
from .kinds import Kind, entries

MOST_BLOCKS = 1000  # of a kind, 128 B each for every step side by side; a system whose states all meet has n^2
WIDEST = 4  # blocks of columns side by side: 16 sums in 32 registers
TEMPLATE = "sweep_on_grid.c.jinja"


def takes_a_grid(kinds: Sequence[Kind], A: ca.Sparsity) -> bool:
    """Return whether elimination leaves the kinds sparse enough."""
    return all(_numbers(kind, A)[1][1] <= MOST_BLOCKS for kind in kinds)


def fills_means(kinds: Sequence[Kind], A: ca.Sparsity, means: FilledMeans | None) -> bool:
    """Return whether a sweep on a grid fills the tables of the mean: what waits for them has no part in elimination."""
    return means is not None and all(_late_blocks(kind, A, means.late) is not None for kind in kinds)


def grid_arguments(
    kinds: Sequence[Kind],
    kind_values: Sequence[Mapping],
    A: ca.Sparsity,
    lanes: int,
    names: Mapping[str, Sequence[str]],
    means: FilledMeans | None,
) -> dict | None:
    """Return what the template is written from beside what the sweep is; None where elimination fills in too much.

    ``names`` are those of table values and parameters in C.
    """
    if not takes_a_grid(kinds, A):
        return None
    filled = means if means is not None and fills_means(kinds, A, means) else None
    late = filled.late if filled else ()
    plans = [_plan(kind, values, A, lanes, late) for kind, values in zip(kinds, kind_values, strict=True)]
    return {
        "filled": _filled_values(filled, kinds, names) if filled else None,
        "plans": plans,
        "sizes": sorted({groups for plan in plans for _, groups in plan["chunks"]}),
        "gauss": {
            "nodes": NODES.tolist(),
            "weights": WEIGHTS.tolist(),
            "end": FROM_STAGES.tolist(),
            "matrix": TABLEAU.T.ravel().tolist(),
        },
    }


def _numbers(kind: Kind, A: ca.Sparsity) -> tuple[list[int], list[int]]:
    """Return the entries of A within the rows of a kind, and the plan to eliminate them."""
    at = {state: row for row, state in enumerate(kind.rows)}
    pairs = zip(A.row(), A.get_col(), strict=True)
    within = [(k, at[i], at[j]) for k, (i, j) in enumerate(pairs) if i in at and j in at]
    n = len(kind.rows)
    pattern = ca.Sparsity.triplet(n, n, [i for _, i, _ in within], [j for _, _, j in within])
    return [k for k, _, _ in within], elimination_plan(pattern).tolist()


def _arrays(numbers: list[int]) -> dict[str, list[int]]:
    """Return the lists of a plan by name, those of products last."""
    size, _, entries, lower, upper = numbers[:5]
    lengths = {
        "pivot": size,
        "diagonal": size,
        "entry_block": entries,
        "entry_row": entries,
        "entry_column": entries,
        "left_start": size + 1,
        "left_state": lower,
        "left_block": lower,
        "right_start": size + 1,
        "right_state": upper,
        "right_block": upper,
        "above_start": size + 1,
        "above_state": upper,
        "above_block": upper,
        "below_start": size + 1,
        "below_state": lower,
        "below_block": lower,
    }
    ends = np.cumsum([5, *lengths.values()]).tolist()
    arrays = {name: numbers[a:b] for name, a, b in zip(lengths, ends[:-1], ends[1:], strict=True)}
    return arrays | {"target": numbers[ends[-1] :]}


def _late_blocks(kind: Kind, A: ca.Sparsity, late: Sequence[int]) -> list[tuple[int, int]] | None:
    """Return the number in ``late`` and the block of each entry within a kind; None where elimination changes one.

    A block below its pivot stays as it is where nothing stands right of the pivot and no product is added to it.
    """
    within, numbers = _numbers(kind, A)
    lists, found = _arrays(numbers), []
    position = {row: i for i, row in enumerate(lists["pivot"])}
    for place, k in enumerate(late):
        if k not in within:
            continue
        e = within.index(k)
        block, i, j = lists["entry_block"][e], lists["entry_row"][e], lists["entry_column"][e]
        first, last = lists["right_start"][position[j] : position[j] + 2]
        if first != last or block in lists["target"] or position[i] <= position[j]:
            return None
        found.append((place, block))
    return found


def _filled_values(filled: FilledMeans, kinds: Sequence[Kind], names: Mapping[str, Sequence[str]]) -> dict:
    """Return how the C fills the tables of the mean; states by kind and row."""
    own = {state: (kind.index, kind.rows.index(state)) for kind in kinds for state in kind.states}
    C = filled.outputs.sparsity_out(0)
    rows = [[(k, own[state]) for k, state in row] for row in entries(C, by_row=True)]
    side: dict[str, str] = dict.fromkeys(("t", "v", "C", "direct", "late", "B"), "j")
    return {
        "outputs": [(value, output, row) for (value, output), row in zip(filled.from_outputs, rows, strict=True)],
        "states": [(value, state, own[state]) for value, state in filled.from_states],
        "late": filled.late,
        "entries": C.nnz(),
        "output_statements": c_statements(filled.outputs, ("t", "v", "p"), ("C", "direct"), names, side),
        "waiting_statements": c_statements(filled.waiting, ("t", "v", "p"), ("late", "B"), names, side),
    }


def _plan(kind: Kind, values: Mapping, A: ca.Sparsity, lanes: int, late: Sequence[int]) -> dict:
    at = {state: row for row, state in enumerate(kind.rows)}
    within, numbers = _numbers(kind, A)
    size, blocks, entries = numbers[:3]
    felt = {row for _, column in values["noises"] for _, row in column}
    chunks, begin = [], 0
    count = -(-kind.blocks // WIDEST)
    for part in range(count):
        groups = (kind.blocks - begin) // (count - part)
        chunks.append((begin, groups))
        begin += groups
    return {
        "index": kind.index,
        "states": size,
        "blocks": blocks,
        "entries": entries,
        "first": kind.first,
        "columns": kind.blocks * lanes,
        "own": [at[state] for state in kind.states],
        "arrays": {
            **{name: of for name, of in _arrays(numbers).items() if name not in ("entry_row", "entry_column")},
            "entry": within,
        },
        "late": _late_blocks(kind, A, late) or [],
        "chunks": chunks,
        "felt": sorted(felt),
        "noises": values["noises"],
        "known": values["known"],
    }
