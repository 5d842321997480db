"""Free-free bending modes of a Timoshenko beam by finite elements."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve, eigh

from ...model.construction import Construction
from ...model.construction.structure import Stiffness
from ...model.errors import ModeError

_SMALLEST_END_DISPLACEMENT = 1e-3  # of the largest in a mode


@dataclass(frozen=True, eq=False)
class BeamModes:
    """Bending modes, normalised to a displacement of 1 at the forward end.

    Attributes
    ----------
    frequency : (k,) array
        rad/s, increasing.
    generalized_mass : (k,) array
        Integral of mass times displacement squared (kg).
    x : (n,) array
        Nodes, metres forward of the gimbal plane; between them displacement is linear in the integrals over mass.
    displacement : (k, n) array
        1.
    rotation : (k, n) array
        Of the sections, positive as dY/dx (1/m).
    """

    frequency: NDArray[np.float64]
    generalized_mass: NDArray[np.float64]
    x: NDArray[np.float64]
    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FreeBeam:
    """Stiffness of a free beam for displacements; rotations follow them statically.

    Stiffness is exact for static loads at the nodes, with bending and shear stiffness varying inside the elements.

    Attributes
    ----------
    x : (n,) array
        Nodes, metres forward of the gimbal plane.
    stiffness : (n, n) array
        N/m.
    turn : (n, n) array
        Rotations by displacements (1/m).
    """

    x: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    turn: NDArray[np.float64]

    @classmethod
    def of(cls, construction: Construction, edges: ArrayLike) -> FreeBeam:
        """Assemble the beam between edges (n,), metres forward of the gimbal plane."""
        x = np.asarray(edges, dtype=float)
        full = _stiffness_matrix(construction.stiffness, x + construction.gimbal_station)
        ww, wr, rr = full[::2, ::2], full[::2, 1::2], full[1::2, 1::2]
        turn = -cho_solve(cho_factor(rr), wr.T)
        condensed = ww + wr @ turn
        return cls(x, 0.5 * (condensed + condensed.T), turn)

    def eigenmodes(
        self, element_masses: NDArray[np.float64], count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return frequencies (k,) in rad/s and shapes (k, n) of unit generalised mass, above the rigid-body modes."""
        if count > self.x.size - 2:
            raise ModeError(
                f"{element_masses.size} beam elements have {self.x.size - 2} modes, not {count}; ask for fewer"
            )
        squared, shapes = eigh(self.stiffness, _line_matrix(element_masses), subset_by_index=(2, count + 1))
        return np.sqrt(squared), shapes.T

    def scaled(
        self, frequency: NDArray[np.float64], shapes: NDArray[np.float64], time: float | None = None
    ) -> BeamModes:
        """Scale shapes (k, n) of unit generalised mass to a displacement of 1 at the forward end."""
        end = shapes[:, -1]
        nodal = np.abs(end) < _SMALLEST_END_DISPLACEMENT * np.abs(shapes).max(axis=1)
        if nodal.any():
            at = "" if time is None else f" at t = {time:g} s"
            raise ModeError(
                f"bending mode {int(np.argmax(nodal)) + 1}{at} does not move the forward end, where modes are scaled "
                "to 1; ask for fewer modes or correct mass and stiffness there"
            )
        displacement = shapes / end[:, None]
        return BeamModes(frequency, end**-2.0, self.x, displacement, displacement @ self.turn.T)


def beam_modes(
    construction: Construction, element_masses: ArrayLike, edges: ArrayLike, count: int, time: float | None = None
) -> BeamModes:
    """Return the lowest bending modes of a vehicle.

    Mass is uniform in an element and moves as the straight line between its nodes: the modes carry no momentum and no
    angular momentum, so that sums over elements close. Sections have no rotary inertia.

    Parameters
    ----------
    construction : Construction
        Its stiffness is used.
    element_masses : (n - 1,) array
        kg, as from ``mass_line``.
    edges : (n,) array
        Metres forward of the gimbal plane, as from ``beam_edges``.
    count : int
    time : float, optional
        For messages (s).

    Raises
    ------
    ModeError
        A mode does not move the forward end, or fewer modes exist than asked for.
    """
    beam = FreeBeam.of(construction, edges)
    return beam.scaled(*beam.eigenmodes(np.asarray(element_masses, dtype=float), count), time)


def mass_product(
    element_masses: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the integrals of mass times displacements (j, n) and (k, n), of shape (j, k) (kg)."""
    return first @ _line_matrix(element_masses) @ second.T


def _line_matrix(masses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mass matrix of displacements that are linear between nodes."""
    diagonal = (np.append(masses, 0.0) + np.insert(masses, 0, 0.0)) / 3
    return np.diag(diagonal) + np.diag(masses / 6, 1) + np.diag(masses / 6, -1)


def _stiffness_matrix(stiffness: Stiffness, station: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix for (displacement, rotation) at each node.

    An element clamped at its aft node has the flexibility [[int y^2/EI + int 1/kGA, int y/EI], [., int 1/EI]] at its
    forward node, y measured aft from there; equilibrium gives the rest.
    """
    matrix = np.zeros((2 * station.size, 2 * station.size))
    for i, (a, b) in enumerate(pairwise(station)):
        y0, y1, y2, shear = _flexibility(stiffness, a, b)
        relative = np.array([[-1.0, -(b - a), 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
        element = relative.T @ np.linalg.solve([[y2 + shear, y1], [y1, y0]], relative)
        matrix[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += element
    return matrix


_GAUSS_POINTS, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)


def _flexibility(stiffness: Stiffness, a: float, b: float) -> tuple[float, float, float, float]:
    """Return the integrals of 1/EI, y/EI, y^2/EI and 1/kGA over an element, piece by piece between jumps."""
    inside = stiffness.station[(stiffness.station > a) & (stiffness.station < b)]
    cuts = np.concatenate([[a], np.unique(inside), [b]])
    total = np.zeros(4)
    for begin, end in pairwise(cuts):
        s = 0.5 * (begin + end) + 0.5 * (end - begin) * _GAUSS_POINTS
        weight = 0.5 * (end - begin) * _GAUSS_WEIGHTS
        bending, shear = stiffness_at(stiffness, s)
        y = b - s
        total += [np.sum(weight * f) for f in (1 / bending, y / bending, y**2 / bending, 1 / shear)]
    return float(total[0]), float(total[1]), float(total[2]), float(total[3])


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
