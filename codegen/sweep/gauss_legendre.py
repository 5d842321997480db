"""Gauss-Legendre collocation with four stages, of order eight, for a step of length 1."""

from __future__ import annotations

import numpy as np

STAGES = 4
_legendre, _weights = np.polynomial.legendre.leggauss(STAGES)
NODES, WEIGHTS = 0.5 * (1 + _legendre), 0.5 * _weights
# a, the integrals of the Lagrange polynomials of the nodes from 0 to each node
TABLEAU = np.linalg.solve(
    np.vander(NODES, STAGES, increasing=True).T,
    (NODES[:, None] ** np.arange(1, STAGES + 1) / np.arange(1, STAGES + 1)).T,
).T
# d, with which the states at the stages give that at the end of a step, x + d (X - x); they add up to nothing
FROM_STAGES = np.linalg.solve(TABLEAU.T, WEIGHTS)
