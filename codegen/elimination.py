"""In which order the collocation equations of a sparse system are eliminated, and what fills in.

Every state is a pivot once; the next is the one whose elimination touches the fewest blocks (Markowitz 1957).
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray


@lru_cache(maxsize=16)
def _plan(size: int, rows: tuple[int, ...], columns: tuple[int, ...]) -> NDArray[np.intc]:
    filled = np.eye(size, dtype=bool)
    filled[list(rows), list(columns)] = True
    left, order = list(range(size)), []
    lowers: list[list[int]] = []
    uppers: list[list[int]] = []
    while left:
        block = filled[np.ix_(left, left)]
        cost = (block.sum(axis=0) - 1) * (block.sum(axis=1) - 1)
        pivot = left.pop(int(np.argmin(cost)))
        below = [i for i in left if filled[i, pivot]]
        right = [j for j in left if filled[pivot, j]]
        filled[np.ix_(below, right)] = True
        order.append(pivot)
        lowers.append(below)
        uppers.append(right)
    number = np.full((size, size), -1)
    number[filled] = np.arange(filled.sum())
    lower = [(i, number[i, p]) for p, below in zip(order, lowers, strict=True) for i in below]
    upper = [(j, number[p, j]) for p, right in zip(order, uppers, strict=True) for j in right]
    parts = [
        [size, int(filled.sum()), len(rows), len(lower), len(upper)],
        order,
        [number[p, p] for p in order],
        rows,
        columns,
        number[list(rows), list(columns)],
        np.cumsum([0, *map(len, lowers)]),
        [i for i, _ in lower],
        [b for _, b in lower],
        np.cumsum([0, *map(len, uppers)]),
        [j for j, _ in upper],
        [b for _, b in upper],
        [number[i, j] for below, right in zip(lowers, uppers, strict=True) for i in below for j in right],
    ]
    return np.concatenate([np.asarray(part, np.intc) for part in parts])


def elimination_plan(pattern: ca.Sparsity) -> NDArray[np.intc]:
    """Return the plan for a state matrix of a pattern, as templates/collocation.c reads it."""
    return _plan(pattern.size1(), tuple(pattern.row()), tuple(pattern.get_col()))
