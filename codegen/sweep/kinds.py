"""Columns of the adjoint in kinds: those that live on the same states stand together, without all other states.

The adjoint that starts as the unit vector of a state is zero but in the states that reach this one, which the sparsity
of A tells. Two planes of a vehicle that meet in the wind alone are two kinds; a system all of whose states reach each
other is one, and then nothing is left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca

Span = tuple[int, int]  # first column, and the one after the last


@dataclass(frozen=True)
class Kind:
    """Columns of one kind.

    Attributes
    ----------
    index : int
    states : tuple of int
        Whose unit vectors the columns start from.
    rows : tuple of int
        States that reach them, increasing.
    first, blocks : int
        Its first block of columns, and how many.
    """

    index: int
    states: tuple[int, ...]
    rows: tuple[int, ...]
    first: int
    blocks: int


def entries(sparsity: ca.Sparsity, by_row: bool) -> list[list[tuple[int, int]]]:
    """Return for every row (or column) its nonzeros as (number of the nonzero, column (or row))."""
    found: list[list[tuple[int, int]]] = [[] for _ in range(sparsity.size1() if by_row else sparsity.size2())]
    for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True)):
        found[i if by_row else j].append((k, j if by_row else i))
    return found


def reaching(A: ca.Sparsity) -> list[frozenset[int]]:
    """Return for every state those that reach it by A, itself among them."""
    found = [{i} for i in range(A.size1())]
    sources: list[list[int]] = [[] for _ in found]
    for i, j in zip(A.row(), A.get_col(), strict=True):
        sources[i].append(j)
    for i, reached in enumerate(found):
        waiting = [i]
        while waiting:
            for j in sources[waiting.pop()]:
                if j not in reached:
                    reached.add(j)
                    waiting.append(j)
    return [frozenset(reached) for reached in found]


def kinds(A: ca.Sparsity, lanes: int) -> tuple[Kind, ...]:
    """Return the kinds that take the least work, blocks of ``lanes`` columns times rows, by joining what is alike."""
    groups: dict[frozenset[int], list[int]] = {}
    for state, rows in enumerate(reaching(A)):
        groups.setdefault(rows, []).append(state)
    parts = [(set(states), set(rows)) for rows, states in groups.items()]
    while len(parts) > 1:
        saved, i, j = max(
            (_work(a, lanes) + _work(b, lanes) - _work(_joined(a, b), lanes), -i, -j)
            for i, a in enumerate(parts)
            for j, b in enumerate(parts)
            if i < j
        )
        if saved < 0:
            break
        joined = _joined(parts[-i], parts[-j])
        parts = [part for k, part in enumerate(parts) if k not in (-i, -j)] + [joined]
    found, first = [], 0
    for states, rows in sorted(parts, key=lambda part: min(part[0])):
        blocks = -(-len(states) // lanes)
        found.append(Kind(len(found), tuple(sorted(states)), tuple(sorted(rows)), first, blocks))
        first += blocks
    return tuple(found)


Part = tuple[set[int], set[int]]


def _joined(a: Part, b: Part) -> Part:
    return a[0] | b[0], a[1] | b[1]


def _work(part: Part, lanes: int) -> int:
    return -(-len(part[0]) // lanes) * len(part[1])


def spans(of: Sequence[Kind], rows: Iterable[int], lanes: int) -> list[Span]:
    """Return the columns of the kinds that live on any of the rows, as spans apart from each other."""
    wanted = set(rows)
    found: list[Span] = []
    for kind in of:
        if wanted & set(kind.rows):
            first, last = kind.first * lanes, (kind.first + kind.blocks) * lanes
            if found and found[-1][1] == first:
                first = found.pop()[0]
            found.append((first, last))
    return found
