"""First lateral slosh mode of a tank of any axisymmetric shape: potential flow by finite elements."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ...model.construction.tank_shape import TankShape

RADIAL_ELEMENTS, AXIAL_ELEMENTS = 8, 24
_GAUSS = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 9


@dataclass(frozen=True)
class SloshMode:
    """The mode as an oscillator of mass m that is held by a spring.

    Attributes
    ----------
    wave_number : float
        omega^2 divided by the axial acceleration (1/m).
    volume : float
        Slosh mass divided by the density (m3).
    depth : float
        Of the oscillator below the free surface (m).
    """

    wave_number: float
    volume: float
    depth: float


def first_slosh_mode(shape: TankShape, level: float) -> SloshMode:
    """Solve for the first mode with one nodal diameter.

    The velocity potential f(r, z) cos(theta) makes the quotient of int |grad f|^2 over the liquid and int f^2 over the
    free surface stationary; walls need no condition. Biquadratic elements lie on a grid between axis and wall.

    With I the integral of x f over the surface, V that of x df/dz over the liquid and k the wave number, the slosh mass
    is density k I^2 / int f^2, and the oscillator lies 2 V / (k I) below the surface: force and moment of the wall
    pressure (by Green's formula with the harmonic functions x and x z) are those of the oscillator, its weight
    included. For an upright cylinder both become the usual formulas.

    Parameters
    ----------
    shape : TankShape
        Taken as a body of revolution with the same area at every station.
    level : float
        Station of the free surface (m).
    """
    r, z, dofs = _grid(shape, level)
    stiffness, axial = _integrals(r, z, dofs)
    surface_mass, surface_moment, surface = _surface(r, dofs)
    size = int(dofs.max()) + 1
    inner = np.setdiff1d(np.arange(size), surface)
    condensed = stiffness[np.ix_(surface, surface)].toarray()
    lift = splu(stiffness[np.ix_(inner, inner)]).solve(stiffness[np.ix_(inner, surface)].toarray())
    condensed -= stiffness[np.ix_(surface, inner)] @ lift
    values, vectors = eigh(0.5 * (condensed + condensed.T), surface_mass, subset_by_index=(0, 0))
    wave_number, mode = float(values[0]), vectors[:, 0]
    field = np.empty(size)
    field[surface], field[inner] = mode, -lift @ mode
    moment = float(surface_moment @ mode)  # the mode has unit int f^2 r dr; int cos^2 = pi cancels once
    return SloshMode(wave_number, math.pi * wave_number * moment**2, 2 * float(axial @ field) / (wave_number * moment))


def _grid(shape: TankShape, level: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Return node radii and heights (axial, radial) and the number of each node's unknown, -1 on the axis.

    Heights crowd at both ends: the radius of a dome grows as the square root of the distance from its tip.
    """
    share = 0.5 * (1 - np.cos(np.pi * np.linspace(0, 1, 2 * AXIAL_ELEMENTS + 1)))
    bottom = float(shape.edges[0])
    z = bottom + (level - bottom) * share
    wall = shape.radius(z)
    r = wall[:, None] * np.linspace(0, 1, 2 * RADIAL_ELEMENTS + 1)
    free = r > 0  # on the axis the potential vanishes
    dofs = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    return r, np.broadcast_to(z[:, None], r.shape), dofs


def _quadratic_shapes(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return values and slopes (points, 3) of the quadratic shape functions on [-1, 1]."""
    p = points[:, None]
    return (
        np.hstack([p * (p - 1) / 2, 1 - p**2, p * (p + 1) / 2]),
        np.hstack([p - 0.5, -2 * p, p + 0.5]),
    )


def _integrals(
    r: NDArray[np.float64], z: NDArray[np.float64], dofs: NDArray[np.intp]
) -> tuple[csc_matrix, NDArray[np.float64]]:
    """Return int (f_r^2 + f_z^2 + f^2 / r^2) r dr dz as a matrix and int f_z r^2 dr dz as a vector."""
    value, slope = _quadratic_shapes(_GAUSS)
    # nine Gauss points by nine nodes, axial index first
    n = np.einsum("ai,bj->abij", value, value).reshape(9, 9)
    n_axial = np.einsum("ai,bj->abij", slope, value).reshape(9, 9)
    n_radial = np.einsum("ai,bj->abij", value, slope).reshape(9, 9)
    weight = np.outer(_WEIGHTS, _WEIGHTS).ravel()
    rows = 2 * np.arange(AXIAL_ELEMENTS)[:, None, None, None] + np.arange(3)[:, None]
    columns = 2 * np.arange(RADIAL_ELEMENTS)[None, :, None, None] + np.arange(3)
    er, ez, ed = (field[rows, columns].reshape(-1, 9) for field in (r, z, dofs))
    r_axial, r_radial, z_axial, radius = er @ n_axial.T, er @ n_radial.T, ez @ n_axial.T, er @ n.T  # z_radial = 0
    area = z_axial * r_radial
    d_r = n_radial / r_radial[..., None]
    d_z = (n_axial - r_axial[..., None] * d_r) / z_axial[..., None]
    measure = weight * area * radius
    matrix = np.einsum("eg,egi,egj->eij", measure, d_r, d_r) + np.einsum("eg,egi,egj->eij", measure, d_z, d_z)
    matrix += np.einsum("eg,gi,gj->eij", measure / radius**2, n, n)
    vector = np.einsum("eg,egi->ei", measure * radius, d_z)
    size = int(dofs.max()) + 1
    i, j = np.broadcast_to(ed[:, :, None], matrix.shape), np.broadcast_to(ed[:, None, :], matrix.shape)
    kept = (i >= 0) & (j >= 0)
    assembled = csc_matrix((matrix[kept], (i[kept], j[kept])), shape=(size, size))
    axial = np.bincount(ed[ed >= 0], weights=vector[ed >= 0], minlength=size).astype(float)
    return assembled, axial


def _surface(
    r: NDArray[np.float64], dofs: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Return int f^2 r dr as a matrix, int f r^2 dr as a vector over the free surface, and its unknowns."""
    value, slope = _quadratic_shapes(_GAUSS)
    nodes = 2 * np.arange(RADIAL_ELEMENTS)[:, None] + np.arange(3)
    er = r[-1, nodes]
    radius, measure = er @ value.T, _WEIGHTS * (er @ slope.T)
    size = r.shape[1]
    mass, moment = np.zeros((size, size)), np.zeros(size)
    np.add.at(mass, (nodes[:, :, None], nodes[:, None, :]), np.einsum("eg,gi,gj->eij", measure * radius, value, value))
    np.add.at(moment, nodes, np.einsum("eg,gi->ei", measure * radius**2, value))
    return mass[1:, 1:], moment[1:], dofs[-1, 1:]
