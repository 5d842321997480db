"""The C of the sweep on a given grid: what each kind of columns is eliminated by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ..nodes.elimination import elimination_plan
from .gauss_legendre import FROM_STAGES, NODES, TABLEAU, WEIGHTS
from .kinds import Kind

MOST_BLOCKS = 1000  # of a kind, 128 B each for every step side by side; a system whose states all meet has n^2
WIDEST = 4  # blocks of columns side by side: 16 sums in 32 registers
TEMPLATE = "sweep_on_grid.c.jinja"


def takes_a_grid(kinds: Sequence[Kind], A: ca.Sparsity) -> bool:
    """Return whether elimination leaves the kinds sparse enough."""
    return all(_numbers(kind, A)[1][1] <= MOST_BLOCKS for kind in kinds)


def grid_arguments(kinds: Sequence[Kind], kind_values: Sequence[Mapping], A: ca.Sparsity, lanes: int) -> dict | None:
    """Return what the template is written from beside what the sweep is; None where elimination fills in too much."""
    if not takes_a_grid(kinds, A):
        return None
    plans = [_plan(kind, values, A, lanes) for kind, values in zip(kinds, kind_values, strict=True)]
    return {
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


def _plan(kind: Kind, values: Mapping, A: ca.Sparsity, lanes: int) -> dict:
    at = {state: row for row, state in enumerate(kind.rows)}
    within, numbers = _numbers(kind, A)
    size, blocks, entries, lower, upper = numbers[:5]
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
    unused = ("entry_row", "entry_column", "left_start", "left_state", "left_block", "right_state")
    felt = {row for _, column in values["noises"] for _, row in column} | {row for _, row in values["known"]}
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
            **{name: of for name, of in arrays.items() if name not in unused},
            "entry": within,
            "target": numbers[ends[-1] :],
        },
        "chunks": chunks,
        "felt": sorted(felt),
        "noises": values["noises"],
        "known": values["known"],
    }
