"""Accelerations of the coupled bodies: the small implicit system of 4-11 with 4-12, solved symbolically.

Rigid body, modes and slosh masses share the symmetric mass matrix

    [ M    G m ] [ q''  ]   [ f   ]        q = (Y, phi_Z, eta), G_k = (1, X_Sk - X_CG, Y_i(X_Sk))
    [ m G' m   ] [ xi'' ] = [ m r ]

The slosh masses are eliminated: (M - sum_k m_k G_k G_k') q'' = f - sum_k m_k G_k r_k, a Schur complement. The
report keeps the slosh reaction off Y'' and phi_Z''; its matrix is then only the block of the modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class Accelerations:
    """Y'' (m/s2), phi_Z'' (rad/s2), eta'' (m/s2, per mode), xi'' (m/s2, per tank), and the matrix inverted."""

    lateral: ca.SX
    rotation: ca.SX
    bending: ca.SX
    slosh: ca.SX
    matrix: ca.SX


def accelerations(
    *,
    mass: ca.SX,
    inertia: ca.SX,
    modal_mass: ca.SX,
    slosh_mass: ca.SX,
    arms: ca.SX,
    displacements: ca.SX,
    force: ca.SX,
    moment: ca.SX,
    modal_force: ca.SX,
    slosh_forcing: ca.SX,
    full: bool,
) -> Accelerations:
    """Solve for all accelerations.

    Parameters
    ----------
    mass, inertia : SX
    modal_mass, modal_force : (modes,) SX
        Forces on the modes with the slosh stiffness, without the slosh inertia.
    slosh_mass, arms, slosh_forcing : (tanks,) SX
    displacements : (modes, tanks) SX
    force, moment : SX
        On translation and rotation, without slosh.
    full : bool
        Whether slosh reacts on translation and rotation.
    """
    modes, tanks = modal_mass.numel(), slosh_mass.numel()
    rigid_rows = ca.vertcat(ca.SX.ones(1, tanks), arms.T)
    if full:
        G = ca.vertcat(rigid_rows, displacements)
        M = ca.diag(ca.vertcat(mass, inertia, modal_mass))
        f = ca.vertcat(force, moment, modal_force)
        r = slosh_forcing
        rigid = ca.SX(0, 1)
    else:
        G, M, f = displacements, ca.diag(modal_mass), modal_force
        rigid = ca.vertcat(force / mass, moment / inertia)
        r = slosh_forcing - rigid_rows.T @ rigid
    Gm = G @ ca.diag(slosh_mass) if tanks else ca.SX(G.shape[0], 0)
    matrix = M - Gm @ G.T
    solved = _solve_symmetric(matrix, f - Gm @ r)
    q = ca.vertcat(rigid, solved)
    return Accelerations(q[0], q[1], q[2 : 2 + modes], r - G.T @ solved, matrix)


def _solve_symmetric(matrix: ca.SX, rhs: ca.SX) -> ca.SX:
    """Solve with a symbolic L D L' factorisation; the order of operations is that of elimination by hand."""
    n = matrix.shape[0]
    if n == 0:
        return ca.SX(0, 1)
    L, d = ca.SX.eye(n), [ca.SX(0)] * n
    for j in range(n):
        d[j] = matrix[j, j] - sum((L[j, k] ** 2 * d[k] for k in range(j)), ca.SX(0))
        for i in range(j + 1, n):
            L[i, j] = (matrix[i, j] - sum((L[i, k] * L[j, k] * d[k] for k in range(j)), ca.SX(0))) / d[j]
    y: list[ca.SX] = []
    for i in range(n):
        y.append(rhs[i] - sum((L[i, k] * y[k] for k in range(i)), ca.SX(0)))
    x: list[ca.SX] = [ca.SX(0)] * n
    for i in reversed(range(n)):
        x[i] = y[i] / d[i] - sum((L[k, i] * x[k] for k in range(i + 1, n)), ca.SX(0))
    return ca.vertcat(*x)
