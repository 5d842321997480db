"""In which order the collocation equations of a sparse system are eliminated, and what fills in.

Every state is a pivot once; the next is the one whose elimination touches the fewest blocks (Markowitz 1957).
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

UNIT = -1  # as in the template


@lru_cache(maxsize=16)
def _plan(size: int, rows: tuple[int, ...], columns: tuple[int, ...]) -> NDArray[np.intc]:
    filled = np.eye(size, dtype=bool)
    filled[list(rows), list(columns)] = True
    rest, order = list(range(size)), []
    lowers: list[list[int]] = []
    uppers: list[list[int]] = []
    while rest:
        block = filled[np.ix_(rest, rest)]
        others = block.sum(axis=1) - 1
        cost = (block.sum(axis=0) - 1) * others * size + others  # of equals first what nothing drives: no products
        pivot = rest.pop(int(np.argmin(cost)))
        below = [i for i in rest if filled[i, pivot]]
        right = [j for j in rest if filled[pivot, j]]
        filled[np.ix_(below, right)] = True
        order.append(pivot)
        lowers.append(below)
        uppers.append(right)
    position = np.argsort(order)
    left, above = [[] for _ in order], [[] for _ in order]
    for pivot, below, right in zip(order, lowers, uppers, strict=True):
        for i in below:
            left[position[i]].append(pivot)
        for j in right:
            above[position[j]].append(pivot)
    unit = np.ones(size, bool)  # pivots in which nothing was written, I
    unit[[i for i, j in zip(rows, columns, strict=True) if i == j]] = False
    for below, right in zip(lowers, uppers, strict=True):
        unit[list(set(below) & set(right))] = False
    # numbered as the solution forward reads them
    reads: list[tuple[int, int]] = []
    for i, row in zip(order, left, strict=True):
        reads += [(i, j) for j in row] + ([] if unit[i] else [(i, i)])
    reads += [(i, j) for i, row in zip(reversed(order), reversed(uppers), strict=True) for j in row]
    number = np.full((size, size), UNIT)
    number[tuple(np.array(reads, int).reshape(-1, 2).T)] = np.arange(len(reads))

    def lists(others: list[list[int]], in_row: bool) -> list:
        blocks = [number[(k, o) if in_row else (o, k)] for k, of in zip(order, others, strict=True) for o in of]
        return [np.cumsum([0, *map(len, others)]), [o for of in others for o in of], blocks]

    parts = [
        [size, len(reads), len(rows), sum(map(len, lowers)), sum(map(len, uppers))],
        order,
        [number[p, p] for p in order],
        number[list(rows), list(columns)],
        rows,
        columns,
        *lists(left, True),
        *lists(uppers, True),
        *lists(above, False),
        *lists(lowers, False),
        [number[i, j] for below, right in zip(lowers, uppers, strict=True) for i in below for j in right],
    ]
    return np.concatenate([np.asarray(part, np.intc) for part in parts])


def elimination_plan(pattern: ca.Sparsity) -> NDArray[np.intc]:
    """Return the plan for a state matrix of a pattern, as templates/collocation.c reads it."""
    return _plan(pattern.size1(), tuple(pattern.row()), tuple(pattern.get_col()))
