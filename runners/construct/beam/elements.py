"""Elements of a Timoshenko beam, exact for static loads at the nodes though stiffness varies inside them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

from ....model.construction.structure import Stiffness

_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)


def element_flexibilities(stiffness: Stiffness, station: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return displacement and rotation at the forward node by force and moment there, aft node clamped: (n - 1, 2, 2).

    [[int y^2/EI + int 1/kGA, int y/EI], [., int 1/EI]] with y measured aft from the forward node, integrated piece by
    piece between the given stations.
    """
    flexibilities = np.zeros((station.size - 1, 2, 2))
    for element, (a, b) in zip(flexibilities, pairwise(station), strict=True):
        inside = stiffness.station[(stiffness.station > a) & (stiffness.station < b)]
        for begin, end in pairwise([a, *np.unique(inside), b]):
            s = 0.5 * (begin + end) + 0.5 * (end - begin) * _GAUSS_POINTS
            weight = 0.5 * (end - begin) * _GAUSS_WEIGHTS
            bending, shear = stiffness_at(stiffness, s)
            y = b - s
            y0, y1, y2 = (float(np.sum(weight * y**k / bending)) for k in range(3))
            element += [[y2 + float(np.sum(weight / shear)), y1], [y1, y0]]
    return flexibilities


def cantilever_flexibility(flexibilities: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return displacements by forces at the nodes (n, n) of the beam clamped at its aft end (m/N).

    A sum of what each element adds, all of one sign: small entries are as exact as large ones, which the inverse of a
    stiffness matrix is not.
    """
    arm = np.clip(x[:, None] - x[1:], 0.0, None)  # of node i about the forward node of element e
    beyond = (x[:, None] > x[:-1]).astype(float)
    internal = np.stack([beyond, arm], axis=-1)  # force and moment in the element by a unit force
    return np.einsum("iea,eab,jeb->ij", internal, flexibilities, internal, optimize=True)


def static_rotations(flexibilities: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations of nodes without moments on them by the displacements of the nodes (n, n) (1/m)."""
    count = x.size
    rr, rw = np.zeros((count, count)), np.zeros((count, count))
    for i, (element, length) in enumerate(zip(flexibilities, np.diff(x), strict=True)):
        relative = np.array([[-1.0, 1.0, -length, 0.0], [0.0, 0.0, -1.0, 1.0]])  # by both displacements and rotations
        stiffness = relative.T @ np.linalg.solve(element, relative)
        rr[i : i + 2, i : i + 2] += stiffness[2:, 2:]
        rw[i : i + 2, i : i + 2] += stiffness[2:, :2]
    return -cho_solve(cho_factor(rr), rw)


def stiffness_at(stiffness: Stiffness, station: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bending (N m2) and shear stiffness (N) at stations (m), logarithmic between the given ones."""
    s = np.asarray(station, dtype=float)
    i = np.clip(np.searchsorted(stiffness.station, s, side="right") - 1, 0, stiffness.station.size - 2)
    i = np.where(stiffness.station[i + 1] > stiffness.station[i], i, i - 1)  # at a jump that ends the beam
    share = (s - stiffness.station[i]) / (stiffness.station[i + 1] - stiffness.station[i])
    values = [
        np.exp((1 - share) * np.log(column[i]) + share * np.log(column[i + 1]))
        for column in (stiffness.bending, stiffness.shear)
    ]
    return values[0], values[1]
