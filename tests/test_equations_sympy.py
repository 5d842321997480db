"""Equations 4-1 to 4-13 derived again from a Lagrangian with SymPy, and the assembled model held against them.

The Lagrangian is that of a frozen-liquid beam with slosh masses in a frame that accelerates with A_X along x:
exact kinematics, expanded to second order about the undisturbed flight. docs/equations.md has the same in words.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from ascentwind.codegen.functions import core_functions
from ascentwind.model import LinearSystem, Vehicle, assemble, load_vehicle
from ascentwind.model.tables import table_values

VEHICLE = Path(__file__).parents[1] / "model" / "vehicles" / "as504"
MODES, TANKS = 2, 2
TIMES = (12.3, 47.0, 75.0, 110.0, 140.0)
MEAN = {"mean.angle_of_attack": 0.08, "mean.engine_angle": -0.013, "mean.attitude": 0.05}

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

coordinates = sp.Matrix([lateral, phi, *eta, *xi])
rates = sp.Matrix([sp.Symbol(f"d{q}") for q in coordinates])
accelerations = sp.Matrix([sp.Symbol(f"dd{q}") for q in coordinates])
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
    gyroscopic: sp.Matrix
    stiffness: sp.Matrix
    damping: sp.Matrix
    force: sp.Matrix

    def residual(self) -> sp.Matrix:
        return (
            self.mass_matrix * accelerations
            + (self.gyroscopic + self.damping) * rates
            + self.stiffness * coordinates
            - self.force
        )


@pytest.fixture(scope="module")
def derived() -> Equations:
    # Frozen liquid: orthogonal modes leave no cross terms, and the beam's weight does no work about its own c.g.
    kinetic = (mass * rates[0] ** 2 + inertia * rates[1] ** 2) / 2
    kinetic += sum(T_mu[i] * rates[2 + i] ** 2 for i in range(MODES)) / 2
    potential = sum(T_mu[i] * omega[i] ** 2 * eta[i] ** 2 for i in range(MODES)) / 2
    for k in range(TANKS):
        frozen = point(X_S[k], sum(Y_S[i, k] * eta[i] for i in range(MODES)))
        tilt = phi + sum(slope_S[i, k] * eta[i] for i in range(MODES))
        moving = frozen + xi[k] * across(tilt)
        v0, v1 = frozen.jacobian(coordinates) * rates, moving.jacobian(coordinates) * rates
        kinetic += m_S[k] * (v1.dot(v1) - v0.dot(v0)) / 2
        potential += m_S[k] * A_X * (moving - frozen)[0] + m_S[k] * w_S[k] ** 2 * xi[k] ** 2 / 2
    lagrangian = kinetic - potential

    def second(a, b):
        return sp.Matrix([lagrangian.diff(p) for p in a]).jacobian(b).subs(rest)

    mixed = second(rates, coordinates)
    damping = sp.diag(
        0,
        0,
        *(2 * zeta[i] * omega[i] * T_mu[i] for i in range(MODES)),
        *(2 * z_S[k] * w_S[k] * m_S[k] for k in range(TANKS)),
    )
    return Equations(
        second(rates, rates).applyfunc(sp.simplify),
        (mixed - mixed.T).applyfunc(sp.simplify),
        -second(coordinates, coordinates),
        damping,
        generalized_force(deflected_gimbal=False),
    )


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


def test_lagrangian_gives_symmetric_mass_and_stiffness_and_no_gyroscopic_terms(derived):
    assert derived.mass_matrix == derived.mass_matrix.T
    assert derived.stiffness == derived.stiffness.T
    assert derived.gyroscopic.is_zero_matrix
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
        rows = [T_mu[i] * (accelerations[2 + i] + omega[i] ** 2 * eta[i]) - slosh_force_on_mode(i, sign) for i in (0, 1)]
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


# The assembled model of AS-504 against the same equations, with the same table numbers.


@dataclass(frozen=True)
class Assembled:
    vehicle: Vehicle
    system: LinearSystem
    core: object

    def at(self, time):
        """Return table values and A, B, C by name, with a mean response put in."""
        v = {**table_values(self.system.tables, time), **MEAN}
        p = [parameter.value for parameter in self.system.parameters]
        arguments = (time, list(v.values()), p)
        B, C = (m.full() for m in self.core.other_matrices(*arguments)[:2])
        return v, self.core.state_matrix(*arguments).full(), B, C


def assembled(folder: Path, full_coupling: bool) -> Assembled:
    shutil.copytree(VEHICLE, folder)
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    assert "full_coupling = false" in text
    toml.write_text(text.replace("full_coupling = false", f"full_coupling = {str(full_coupling).lower()}"))
    vehicle = load_vehicle(folder)
    system = assemble(vehicle, np.diag([1.0, 3.0, 1.0]))
    return Assembled(vehicle, system, core_functions(system))


@pytest.fixture(scope="module")
def coupled(tmp_path_factory) -> Assembled:
    return assembled(tmp_path_factory.mktemp("coupled") / "as504", True)


@pytest.fixture(scope="module")
def as_reported(tmp_path_factory) -> Assembled:
    return assembled(tmp_path_factory.mktemp("reported") / "as504", False)


class NumericEquations:
    """Mass matrix and right-hand side of the derived equations with table numbers, for all modes and tanks."""

    def __init__(self, model: Assembled, v: dict[str, float], C: np.ndarray):
        vehicle, system = model.vehicle, model.system
        tanks, self.modes = [t.name for t in vehicle.slosh], len(vehicle.bending)
        self.v, self.area, n = v, vehicle.file.reference_area_m2, len(system.states)
        self.states, self.outputs = system.state_names, system.output_names
        self.identity = dict(zip(system.state_names, np.eye(n), strict=True))
        modal = range(1, self.modes + 1)
        self.Y = np.array([[v[f"bending.{i}.displacement_at_{t}"] for t in tanks] for i in modal])
        self.slope = np.array([[v[f"bending.{i}.slope_at_{t}"] for t in tanks] for i in modal])
        self.slosh_mass = np.array([v[f"slosh.{t}.mass"] for t in tanks])
        self.arm = np.array([v[f"slosh.{t}.attach_point"] for t in tanks]) - v["center_of_gravity"]
        self.modal_mass = np.array([v[f"bending.{i}.generalized_mass"] for i in modal])
        self.eta = np.array([self.identity[f"bending_{i}"] for i in modal])
        self.eta_rate = np.array([self.identity[f"bending_rate_{i}"] for i in modal])
        self.xi = np.array([self.identity[f"slosh_{t}"] for t in tanks])
        self.xi_rate = np.array([self.identity[f"slosh_rate_{t}"] for t in tanks])
        self.wn = np.array([v[f"bending.{i}.frequency"] for i in modal])[:, None]
        self.zeta = np.array([m.damping for m in vehicle.bending])[:, None]
        self.w_S = np.array([v[f"slosh.{t}.frequency"] for t in tanks])[:, None]
        self.z_S = np.array([t.damping for t in vehicle.slosh])[:, None]
        self.alpha, self.beta = C[self.outputs.index("angle_of_attack")], C[self.outputs.index("engine_angle")]

    def external(self, alpha, beta, attitude) -> np.ndarray:
        """4-1, 4-2, 4-9, 4-10: forces on (Y, phi_Z, eta)."""
        v = self.v
        normal = v["dynamic_pressure"] * self.area * v["normal_force_slope"]
        arm = v["center_of_pressure"] - v["center_of_gravity"]
        rows = [
            normal * alpha + v["control_thrust"] * beta + (v["thrust"] - v["axial_drag"]) * attitude,
            normal * arm * alpha - v["control_thrust"] * v["center_of_gravity"] * beta,
        ]
        for i in range(1, self.modes + 1):
            aero = v["dynamic_pressure"] * self.area * v[f"bending.{i}.normal_force_slope_times_displacement"]
            rows.append(v["control_thrust"] * v[f"bending.{i}.displacement_at_gimbal"] * beta + aero * alpha)
        return np.array(rows)

    def own_forces(self) -> tuple[np.ndarray, np.ndarray]:
        """Return what springs, dampers and A_X put on (Y, phi_Z, eta), and on xi per slosh mass."""
        weight = self.v["axial_acceleration"] * self.slosh_mass[:, None] * self.xi
        modes = self.slope @ weight - self.modal_mass[:, None] * (
            2 * self.zeta * self.wn * self.eta_rate + self.wn**2 * self.eta
        )
        tilt = self.identity["attitude"] + self.slope.T @ self.eta
        slosh = self.v["axial_acceleration"] * tilt - 2 * self.z_S * self.w_S * self.xi_rate - self.w_S**2 * self.xi
        return np.vstack([np.zeros_like(weight[0]), weight.sum(axis=0), modes]), slosh

    def mass_matrix(self) -> np.ndarray:
        G = np.vstack([np.ones_like(self.arm), self.arm, self.Y])
        M = np.diag([self.v["mass"], self.v["moment_of_inertia"], *self.modal_mass])
        return np.block([[M, G * self.slosh_mass], [(G * self.slosh_mass).T, np.diag(self.slosh_mass)]])


def test_numeric_mass_matrix_is_the_derived_one(derived, coupled):
    """The numbers below use this layout; here it is the Lagrangian's own, two modes and the first two tanks."""
    v, _, _, C = coupled.at(75.0)
    tanks = [t.name for t in coupled.vehicle.slosh][:TANKS]
    given = {mass: v["mass"], inertia: v["moment_of_inertia"], X_CG: v["center_of_gravity"]}
    for i in range(MODES):
        given[T_mu[i]] = v[f"bending.{i + 1}.generalized_mass"]
        given |= {Y_S[i, k]: v[f"bending.{i + 1}.displacement_at_{t}"] for k, t in enumerate(tanks)}
    for k, tank in enumerate(tanks):
        given |= {m_S[k]: v[f"slosh.{tank}.mass"], X_S[k]: v[f"slosh.{tank}.attach_point"]}
    size = 2 + MODES + TANKS
    numeric = NumericEquations(coupled, v, C).mass_matrix()[:size, :size]
    np.testing.assert_allclose(np.array(derived.mass_matrix.subs(given), float), numeric, rtol=1e-15)


def acceleration_rows(model: Assembled, A: np.ndarray) -> np.ndarray:
    names = model.system.state_names
    wanted = ["lateral_velocity", "attitude_rate", *(f"bending_rate_{i + 1}" for i in range(len(model.vehicle.bending)))]
    wanted += [f"slosh_rate_{t.name}" for t in model.vehicle.slosh]
    return A[[names.index(n) for n in wanted]]


def assert_rows_equal(found, expected, tolerance=1e-12):
    """Entries against the largest of their column's unit: each entry relative, entries that vanish exactly zero."""
    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max(axis=0, keepdims=True))
    assert np.all(found[:, np.all(expected == 0, axis=0)] == 0)
    assert np.all(np.abs(found - expected) <= tolerance * scale)


@pytest.mark.parametrize("time", TIMES)
def test_fully_coupled_model_equals_the_derived_equations(coupled, time):
    v, A, _, C = coupled.at(time)
    e = NumericEquations(coupled, v, C)
    own, slosh = e.own_forces()
    no_noise = [n for n in e.identity if not n.startswith("deviation")]
    columns = [coupled.system.state_names.index(n) for n in no_noise]
    force = np.vstack([e.external(e.alpha, e.beta, e.identity["attitude"]) + own, e.slosh_mass[:, None] * slosh])
    d = 1 / np.sqrt(np.diag(e.mass_matrix()))
    expected = d[:, None] * np.linalg.solve(d[:, None] * e.mass_matrix() * d, d[:, None] * force)
    assert_rows_equal(acceleration_rows(coupled, A)[:, columns], expected[:, columns])


@pytest.mark.parametrize("time", TIMES)
def test_reported_model_keeps_slosh_and_bending_off_the_rigid_body(as_reported, time):
    v, A, _, C = as_reported.at(time)
    e = NumericEquations(as_reported, v, C)
    rows = acceleration_rows(as_reported, A)
    external = e.external(e.alpha, e.beta, e.identity["attitude"])
    rigid = external[:2] / np.array([[v["mass"]], [v["moment_of_inertia"]]])
    columns = [i for i, n in enumerate(e.states) if not n.startswith("deviation")]
    np.testing.assert_allclose(rows[:2, columns], rigid[:, columns], rtol=1e-13, atol=0)
    slosh_states = [i for i, n in enumerate(e.states) if n.startswith("slosh")]
    assert not rows[:2, slosh_states].any()


@pytest.mark.parametrize("time", TIMES)
def test_reported_model_satisfies_4_8_to_4_12(as_reported, time):
    v, A, _, C = as_reported.at(time)
    e = NumericEquations(as_reported, v, C)
    rows = acceleration_rows(as_reported, A)
    Y_dd, phi_dd, eta_dd, xi_dd = rows[0], rows[1], rows[2 : 2 + e.modes], rows[2 + e.modes :]
    own, slosh = e.own_forces()
    terms_412 = [np.tile(Y_dd, (len(e.arm), 1)), np.outer(e.arm, phi_dd), e.Y.T @ eta_dd, xi_dd, -slosh]
    external = e.external(e.alpha, e.beta, e.identity["attitude"])[2:]
    terms_411 = [e.modal_mass[:, None] * eta_dd, (e.Y * e.slosh_mass) @ xi_dd, -own[2:], -external]
    columns = [i for i, n in enumerate(e.states) if not n.startswith("deviation")]
    for terms in (terms_411, terms_412):
        size = np.max(np.abs(terms), axis=0)
        assert np.all(np.abs(np.sum(terms, axis=0))[:, columns] <= 1e-12 * size[:, columns])


@pytest.mark.parametrize("full", [False, True])
def test_bending_moment_is_4_13(coupled, as_reported, full):
    model = coupled if full else as_reported
    v, A, _, C = model.at(75.0)
    e = NumericEquations(model, v, C)
    rows = acceleration_rows(model, A)[2:]
    names = [f"bending_{i + 1}" for i in range(e.modes)] + [f"slosh_{t.name}" for t in model.vehicle.slosh]
    load = "loads.bending_moment."
    expected = v[load + "angle_of_attack"] * e.alpha + v[load + "engine_angle"] * e.beta
    expected = expected + sum(v[load + n] * row for n, row in zip(names, rows, strict=True))
    np.testing.assert_allclose(C[e.outputs.index("bending_moment")], expected, rtol=1e-11, atol=1e-6)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("time", TIMES)
def test_noise_coefficients_are_differences_of_the_equations_at_the_mean(coupled, as_reported, full, time):
    """A change of 1 % in thrust, 5 % in X_CP: the equations are linear in both, so a difference is exact."""
    model = coupled if full else as_reported
    v, A, _, C = model.at(time)
    mean = (v["mean.angle_of_attack"], v["mean.engine_angle"], v["mean.attitude"])
    for source, tables, sigma in (
        ("thrust", ("thrust", "control_thrust"), 0.01),
        ("center_of_pressure", ("center_of_pressure",), 0.05),
    ):
        e = NumericEquations(model, v, C)
        before = e.external(*mean)
        e.v = {**v, **{t: v[t] * (1 + sigma) for t in tables}}
        force = e.external(*mean) - before
        force = np.append(force, np.zeros(len(e.arm)))
        if full:
            d = 1 / np.sqrt(np.diag(e.mass_matrix()))
            expected = d * np.linalg.solve(d[:, None] * e.mass_matrix() * d, d * force)
        else:
            M, rigid = e.mass_matrix(), force[:2] / np.array([v["mass"], v["moment_of_inertia"]])
            flexible = np.linalg.solve(M[2:, 2:], force[2:] - M[2:, :2] @ rigid)
            expected = np.append(rigid, flexible)
        found = acceleration_rows(model, A)[:, e.states.index(f"deviation_{source}")]
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("time", [75.0, 110.0, 140.0])
def test_engine_angle_follows_4_4_with_the_control_sign_and_the_gain_schedule(as_reported, time):
    """Frequency response from attitude, rate and modes to beta, the control states alone closing nothing."""
    v, A, _, C = as_reported.at(time)
    names, control = as_reported.system.state_names, as_reported.vehicle.transfer_functions
    inner = [i for i, n in enumerate(names) if n[:3] in ("T1_", "T2_", "T3_")]
    beta_row = C[as_reported.system.output_names.index("engine_angle")]
    first = {"control.attitude_gain": 0.9, "control.rate_gain": 0.69}
    K1, K2 = (v[n] / value for n, value in first.items())

    def rational(name, s):
        return np.polyval(control[name].numerator, s) / np.polyval(control[name].denominator, s)

    for w in (0.05, 0.9, 6.5, 13.0, 80.0):
        s = 1j * w
        resolvent = np.linalg.inv(s * np.eye(len(inner)) - A[np.ix_(inner, inner)])
        through = beta_row[inner] @ resolvent @ A[inner] + beta_row
        attitude, rate = rational("T3", s) * K1 * rational("T1", s), rational("T3", s) * K2 * rational("T2", s)
        expected = {"attitude": attitude, "attitude_rate": rate}
        for i in (1, 2):
            sensor, gimbal = v[f"bending.{i}.slope_at_sensor"], v[f"bending.{i}.slope_at_gimbal"]
            expected |= {f"bending_{i}": sensor * attitude + gimbal, f"bending_rate_{i}": sensor * rate}
        found = [through[names.index(n)] for n in expected]
        np.testing.assert_allclose(found, list(expected.values()), rtol=1e-11)


@pytest.mark.parametrize("time", TIMES)
def test_wind_filter_goes_from_altitude_to_time_with_rate_and_square_root_of_rate(as_reported, time):
    v, A, B, C = as_reported.at(time)
    names, noises = as_reported.system.state_names, as_reported.system.noise_names
    wind, white = ([i for i, n in enumerate(group) if n.startswith("wind_")] for group in (names, noises))
    F, G, H = as_reported.vehicle.wind.shaping_filter.at(v["altitude"])
    climb = as_reported.vehicle.tables["altitude"].polynomial.derivative()(time)
    np.testing.assert_allclose(A[np.ix_(wind, wind)], climb * F, rtol=1e-12)
    np.testing.assert_allclose(B[np.ix_(wind, white)], np.sqrt(climb) * G, rtol=1e-12)
    alpha_row = C[as_reported.system.output_names.index("angle_of_attack"), wind]
    np.testing.assert_allclose(alpha_row, H / v["relative_velocity"], rtol=1e-12)


def test_adjoint_is_minus_the_transposed_state_matrix(as_reported):
    system = as_reported.system
    time, (v, A, _, _) = 75.0, as_reported.at(75.0)
    column = ca.SX.sym("adjoint", len(system.states))
    derivative = ca.Function("d", [system.time, system.v, system.p, column], [system.adjoint_derivative(column)])
    given = np.random.default_rng(504).standard_normal(len(system.states))
    p = [parameter.value for parameter in system.parameters]
    found = derivative(time, list(v.values()), p, given).full()[:, 0]
    np.testing.assert_allclose(found, -A.T @ given, rtol=1e-12, atol=1e-12 * np.abs(A).max())
