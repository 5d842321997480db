"""The equations of motion from a Lagrangian, with SymPy; what 4-1 to 4-12 are held against.

A frozen-liquid beam with slosh masses in a frame that accelerates with A_X along x: exact kinematics, expanded to
second order about the undisturbed flight. docs/equations.md has the same in words.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

MODES, TANKS = 2, 2

mass, inertia, X_CG, A_X = sp.symbols("m I_ZZ X_CG A_X")
F_TX, F_TCX, F_AX, qA = sp.symbols("F_TX F_TCX F_AX qA")
alpha, beta, lateral, phi = sp.symbols("alpha beta Y phi")
T_mu, omega, zeta = (sp.symbols(f"{s}1:{MODES + 1}") for s in ("T", "omega", "zeta"))
m_S, X_S, w_S, z_S = (sp.symbols(f"{s}1:{TANKS + 1}") for s in ("m_S", "X_S", "w_S", "z_S"))
eta, xi = sp.symbols(f"eta1:{MODES + 1}"), sp.symbols(f"xi1:{TANKS + 1}")
Y_S = sp.Matrix(MODES, TANKS, lambda i, k: sp.Symbol(f"Y{i + 1}_S{k + 1}"))
slope_S = sp.Matrix(MODES, TANKS, lambda i, k: sp.Symbol(f"Y'{i + 1}_S{k + 1}"))
Y_E = sp.symbols(f"Y1:{MODES + 1}_E")
segment_slope, segment_x = sp.symbols("c_a c_b"), sp.symbols("x_a x_b")
Y_segment = sp.Matrix(MODES, 2, lambda i, j: sp.Symbol(f"Y{i + 1}_{'ab'[j]}"))

# typed loosely: SymPy does not say that an element of a vector is an expression
coordinates: Any = sp.Matrix([lateral, phi, *eta, *xi])
rates: Any = sp.Matrix([sp.Symbol(f"d{q}") for q in coordinates])
accelerations: Any = sp.Matrix([sp.Symbol(f"dd{q}") for q in coordinates])
rest = {s: 0 for s in (*coordinates, *rates, alpha, beta)}


def along(angle):
    return sp.Matrix([sp.cos(angle), sp.sin(angle)])


def across(angle):
    return sp.Matrix([-sp.sin(angle), sp.cos(angle)])


def point(x, displacement=0):
    """Position of a point of the beam in the accelerated frame: body axis through the c.g., deflection across it."""
    return sp.Matrix([0, lateral]) + (x - X_CG) * along(phi) + displacement * across(phi)


@dataclass(frozen=True)
class Equations:
    """mass_matrix q'' + damping_matrix q' + stiffness_matrix q = force, q = (Y, phi_Z, eta, xi)."""

    mass_matrix: sp.Matrix
    stiffness: sp.Matrix
    damping: sp.Matrix
    force: sp.Matrix

    def residual(self) -> sp.Matrix:
        return self.mass_matrix * accelerations + self.damping * rates + self.stiffness * coordinates - self.force


@cache
def derive() -> Equations:
    """Return the linear equations about undisturbed flight.

    The kinetic energy is a quadratic form of the rates alone, so its value at rest is the mass matrix and there are
    no gyroscopic terms.
    """
    # Frozen liquid: orthogonal modes leave no cross terms, and the beam's weight does no work about its own c.g.
    mass_matrix = sp.diag(mass, inertia, *T_mu, *[0] * TANKS)
    potential = sum(T_mu[i] * omega[i] ** 2 * eta[i] ** 2 for i in range(MODES)) / 2
    for k in range(TANKS):
        frozen = point(X_S[k], sum(Y_S[i, k] * eta[i] for i in range(MODES)))
        tilt = phi + sum(slope_S[i, k] * eta[i] for i in range(MODES))
        moving = frozen + xi[k] * across(tilt)
        J0, J1 = (r.jacobian(coordinates).subs(rest) for r in (frozen, moving))
        mass_matrix += m_S[k] * (J1.T * J1 - J0.T * J0)
        potential += m_S[k] * A_X * (moving - frozen)[0] + m_S[k] * w_S[k] ** 2 * xi[k] ** 2 / 2
    damping = sp.diag(
        0,
        0,
        *(2 * zeta[i] * omega[i] * T_mu[i] for i in range(MODES)),
        *(2 * z_S[k] * w_S[k] * m_S[k] for k in range(TANKS)),
    )
    stiffness = sp.hessian(potential, coordinates).subs(rest)
    return Equations(mass_matrix.expand(), stiffness.expand(), damping, generalized_force(deflected_gimbal=False))


def generalized_force(deflected_gimbal: bool) -> sp.Matrix:
    """Return the virtual work of aerodynamic, engine and axial forces by coordinate, linear terms.

    The report lets axial forces act along the undeformed axis (section 4.1.2, assumption 2); with
    ``deflected_gimbal`` the thrust acts at the displaced gimbal instead.
    """
    work = sp.zeros(len(coordinates), 1)
    for j in (0, 1):
        where = point(segment_x[j], sum(Y_segment[i, j] * eta[i] for i in range(MODES)))
        work += where.jacobian(coordinates).T * (qA * segment_slope[j] * alpha * across(phi))
    gimbal = point(0, sum(Y_E[i] * eta[i] for i in range(MODES)))
    work += gimbal.jacobian(coordinates).T * (F_TCX * sp.sin(beta) * across(phi))
    axial = gimbal if deflected_gimbal else point(0)
    work += axial.jacobian(coordinates).T * ((F_TX - F_TCX + F_TCX * sp.cos(beta)) * along(phi))
    work += point(0).jacobian(coordinates).T * (-F_AX * along(phi))
    signals = sp.Matrix([*coordinates, alpha, beta])
    return (work.jacobian(signals).subs(rest) * signals).applyfunc(sp.expand)
