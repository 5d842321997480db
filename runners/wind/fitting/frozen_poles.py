"""Frozen poles of a filter over altitude: eigenvalues of F(h), one altitude at a time."""

from __future__ import annotations

import numpy as np

from ....model.wind.shaping_filter import ShapingFilter

DIVISIONS = 8  # of each interval between samples: the entries of F are cubic there


def largest_pole(shaping_filter: ShapingFilter, divisions: int = DIVISIONS) -> float:
    """Return the largest real part of the frozen poles, 1/m, on a grid finer than the samples; negative when stable."""
    h = shaping_filter.altitude
    steps = np.arange(divisions) / divisions
    grid = np.append((h[:-1, None] + np.diff(h)[:, None] * steps).ravel(), h[-1])
    F = np.zeros((grid.size, shaping_filter.order, shaping_filter.order))
    for table, (label, i, j) in zip(shaping_filter.tables(), shaping_filter.entries, strict=True):
        if label == "F":
            F[:, i, j] = table.polynomial(grid)
    return float(np.linalg.eigvals(F).real.max())
