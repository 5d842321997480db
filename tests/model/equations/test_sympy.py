"""Equations 4-1 to 4-12 of the report, as read and as printed, against the Lagrangian's."""

from __future__ import annotations

import pytest
import sympy as sp
from lagrangian import (
    A_X,
    F_AX,
    F_TCX,
    F_TX,
    MODES,
    TANKS,
    X_CG,
    X_S,
    Y_E,
    Y_S,
    T_mu,
    Y_segment,
    accelerations,
    alpha,
    beta,
    coordinates,
    derive,
    eta,
    generalized_force,
    inertia,
    m_S,
    mass,
    omega,
    phi,
    qA,
    rates,
    segment_slope,
    segment_x,
    slope_S,
    w_S,
    xi,
    z_S,
    zeta,
)


@pytest.fixture(scope="module")
def derived():
    return derive()


def test_lagrangian_gives_symmetric_mass_and_stiffness(derived):
    assert derived.mass_matrix == derived.mass_matrix.T
    assert derived.stiffness == derived.stiffness.T
    assert derived.mass_matrix[0, 4] == m_S[0]
    assert sp.expand(derived.stiffness[1, 4] + A_X * m_S[0]) == 0


def test_rigid_body_equations_are_4_1_and_4_2(derived):
    C_N = sum(segment_slope)
    X_CP = sum(c * x for c, x in zip(segment_slope, segment_x, strict=True)) / C_N
    slosh_gone = {s: 0 for s in m_S}
    row = derived.residual().subs(slosh_gone)
    force = qA * C_N * alpha + F_TCX * beta + (F_TX - F_AX) * phi
    moment = qA * C_N * (X_CP - X_CG) * alpha - F_TCX * X_CG * beta
    assert sp.simplify(row[0] - (mass * accelerations[0] - force)) == 0
    assert sp.simplify(row[1] - (inertia * accelerations[1] - moment)) == 0


def slosh_force_on_mode(i, sign):
    """Equation 4-11 with the sign of its first term."""
    return sum(
        sign * m_S[k] * accelerations[2 + MODES + k] * Y_S[i, k] + A_X * m_S[k] * slope_S[i, k] * xi[k]
        for k in range(TANKS)
    )


def test_bending_equations_are_4_8_to_4_11_with_the_sign_read_and_not_with_the_printed_one(derived):
    rows = derived.residual()
    rigid = {accelerations[0]: 0, accelerations[1]: 0}
    for i in range(MODES):
        aero = qA * sum(segment_slope[j] * Y_segment[i, j] for j in (0, 1)) * alpha
        own = T_mu[i] * (accelerations[2 + i] + 2 * zeta[i] * omega[i] * rates[2 + i] + omega[i] ** 2 * eta[i])
        others = own - F_TCX * Y_E[i] * beta - aero
        assert sp.expand(rows[2 + i].subs(rigid) - (others - slosh_force_on_mode(i, -1))) == 0
        printed = sp.expand(rows[2 + i].subs(rigid) - (others - slosh_force_on_mode(i, +1)))
        assert printed == sp.expand(2 * sum(m_S[k] * Y_S[i, k] * accelerations[2 + MODES + k] for k in range(TANKS)))


def slosh_equation_as_read(k):
    """Equation 4-12 of docs/equations.md."""
    tilt = phi + sum(slope_S[i, k] * eta[i] for i in range(MODES))
    return (
        accelerations[0]
        + (X_S[k] - X_CG) * accelerations[1]
        + sum(Y_S[i, k] * accelerations[2 + i] for i in range(MODES))
        + accelerations[2 + MODES + k]
        - A_X * tilt
        + 2 * z_S[k] * w_S[k] * rates[2 + MODES + k]
        + w_S[k] ** 2 * xi[k]
    )


def slosh_equation_as_printed(k):
    """Equation 4-12 of the report: arm reversed, attitude acceleration and modal rates where the angles belong."""
    return (
        accelerations[0]
        + (X_CG - X_S[k]) * accelerations[1]
        + sum(Y_S[i, k] * accelerations[2 + i] for i in range(MODES))
        + accelerations[2 + MODES + k]
        - A_X * accelerations[1]
        - A_X * sum(slope_S[i, k] * rates[2 + i] for i in range(MODES))
        + 2 * z_S[k] * w_S[k] * rates[2 + MODES + k]
        + w_S[k] ** 2 * xi[k]
    )


def test_slosh_equations_are_4_12_as_read_and_not_as_printed(derived):
    rows = derived.residual()
    for k in range(TANKS):
        row = sp.expand(rows[2 + MODES + k] / m_S[k])
        assert sp.expand(row - slosh_equation_as_read(k)) == 0
        assert sp.expand(row - slosh_equation_as_printed(k)) != 0


def test_printed_signs_leave_mass_and_stiffness_unsymmetric():
    def matrices(slosh_equation, sign):
        rows = [
            T_mu[i] * (accelerations[2 + i] + omega[i] ** 2 * eta[i]) - slosh_force_on_mode(i, sign) for i in (0, 1)
        ]
        rows += [sp.expand(m_S[k] * slosh_equation(k)) for k in range(TANKS)]
        return (sp.Matrix(rows).jacobian(sp.Matrix(s[2:])) for s in (accelerations, coordinates))

    for matrix in matrices(slosh_equation_as_read, -1):
        assert sp.expand(matrix - matrix.T).is_zero_matrix
    for matrix in matrices(slosh_equation_as_printed, +1):
        assert not sp.expand(matrix - matrix.T).is_zero_matrix


def test_the_report_leaves_out_the_moment_of_the_thrust_at_the_displaced_gimbal():
    difference = generalized_force(deflected_gimbal=True) - generalized_force(deflected_gimbal=False)
    left_out = -F_TX * sum(Y_E[i] * eta[i] for i in range(MODES))
    assert sp.expand(difference - sp.Matrix([0, left_out, *[0] * (MODES + TANKS)])).is_zero_matrix
