"""Free-free bending modes of a Timoshenko beam by finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cholesky, eigh, solve_triangular

from ....model.construction import Construction
from ....model.errors import ModeError
from ..mass.line import rotary_line
from .elements import cantilever_flexibility, element_flexibilities, static_rotations

_SMALLEST_END_DISPLACEMENT = 1e-3  # of the largest in a mode


@dataclass(frozen=True, eq=False)
class BeamModes:
    """Bending modes, normalised to a displacement of 1 at the forward end.

    Attributes
    ----------
    frequency : (k,) array
        rad/s, increasing.
    generalized_mass : (k,) array
        Integral of mass times displacement squared, plus rotary inertia times rotation squared (kg).
    x : (n,) array
        Nodes, metres forward of the gimbal plane; between them displacement and rotation are linear where they are
        integrated over mass.
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
    """Flexibility of a beam and its rotary inertia; rotations follow displacements statically.

    Attributes
    ----------
    x : (n,) array
        Nodes, metres forward of the gimbal plane.
    flexibility : (n, n) array
        Displacements by forces, clamped at the aft end (m/N).
    turn : (n, n) array
        Rotations by displacements (1/m).
    rotary : (n, n) array
        Mass matrix of the sections' rotary inertia, by displacements (kg).
    gimbal_station : float
        m.
    """

    x: NDArray[np.float64]
    flexibility: NDArray[np.float64]
    turn: NDArray[np.float64]
    rotary: NDArray[np.float64]
    gimbal_station: float

    @classmethod
    def of(cls, construction: Construction, edges: ArrayLike) -> FreeBeam:
        """Assemble the beam between edges (n,), metres forward of the gimbal plane, with all that turns at release."""
        x = np.asarray(edges, dtype=float)
        elements = element_flexibilities(construction.stiffness, x + construction.gimbal_station)
        turn = static_rotations(elements, x)
        rotary = _rotary(turn, rotary_line(construction, x))
        return cls(x, cantilever_flexibility(elements, x), turn, rotary, construction.gimbal_station)

    def with_rotary(self, line: NDArray[np.float64]) -> FreeBeam:
        """Return the beam with another rotary inertia of the sections in each element (n - 1,), kg m2."""
        return replace(self, rotary=_rotary(self.turn, line))

    def product(
        self, element_masses: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the integrals of mass times displacements (j, n) and (k, n), rotations included: (j, k) in kg."""
        return first @ (line_matrix(element_masses) + self.rotary) @ second.T

    def eigenmodes(
        self, element_masses: NDArray[np.float64], count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return frequencies (k,) in rad/s and shapes (k, n) of unit generalised mass, above the rigid-body modes."""
        if count > self.x.size - 2:
            raise ModeError(
                f"{element_masses.size} beam elements have {self.x.size - 2} modes, not {count}; ask for fewer"
            )
        empty = np.flatnonzero((element_masses[:-1] <= 0) & (element_masses[1:] <= 0))
        if empty.size:
            begin, end = self.x[empty[0]] + self.gimbal_station, self.x[empty[0] + 2] + self.gimbal_station
            raise ModeError(f"no mass lies between {begin:g} and {end:g} m; spread one over these stations")
        # L^T G L with M = L L^T, rigid-body motion taken out of loads and displacements: eigenvalues 1 / omega^2
        lower = cholesky(line_matrix(element_masses) + self.rotary, lower=True)
        rigid, _ = np.linalg.qr(lower.T @ np.column_stack([np.ones(self.x.size), self.x]))
        loose = lower - (lower @ rigid) @ rigid.T
        last = self.x.size - 1
        inverse, vectors = eigh(loose.T @ self.flexibility @ loose, subset_by_index=(last + 1 - count, last))
        shapes = solve_triangular(lower.T, vectors[:, ::-1])
        return inverse[::-1] ** -0.5, shapes.T

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

    Stiffness is exact for static loads at the nodes, with bending and shear stiffness varying inside the elements.
    Mass and rotary inertia are uniform in an element and move as the straight line between its nodes: modes carry no
    momentum and no angular momentum, so that sums over elements close.

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


def _rotary(turn: NDArray[np.float64], line: NDArray[np.float64]) -> NDArray[np.float64]:
    rotary = turn.T @ line_matrix(line) @ turn
    return 0.5 * (rotary + rotary.T)


def line_matrix(masses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mass matrix of nodal values that are linear between nodes."""
    diagonal = (np.append(masses, 0.0) + np.insert(masses, 0, 0.0)) / 3
    return np.diag(diagonal) + np.diag(masses / 6, 1) + np.diag(masses / 6, -1)
