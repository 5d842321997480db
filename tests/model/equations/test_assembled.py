"""The assembled model of AS-504 against the equations of test_equations_sympy.py, with the same table numbers."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from lagrangian import MODES, TANKS, X_CG, X_S, Y_S, T_mu, derive, inertia, m_S, mass

from ascentwind.codegen.system.functions import CoreFunctions, core_functions
from ascentwind.model import LinearSystem, Vehicle, load_vehicle
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.tables import table_values
from ascentwind.model.vehicle.shipped import built_in_vehicles

VEHICLE = built_in_vehicles()["as504"]
TIMES = (12.3, 47.0, 75.0, 110.0, 140.0)
# switch times (s, range time) and gains a0, a1 (s) of the first stage, found in the flight programmes (docs/data.md)
GAINS = ((0.0, (0.90, 0.69)), (105.6, (0.45, 0.44)), (130.6, (0.32, 0.30)))
MEAN = {"mean.angle_of_attack": 0.08, "mean.engine_angle": -0.013, "mean.attitude": 0.05}


@dataclass(frozen=True)
class Assembled:
    vehicle: Vehicle
    system: LinearSystem
    core: CoreFunctions

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
    vehicle = load_vehicle(folder, {"options.noise_loads": "as_reported"})  # the others: test_noise_loads.py
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


def test_numeric_mass_matrix_is_the_derived_one(coupled):
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
    np.testing.assert_allclose(np.array(derive().mass_matrix.subs(given), float), numeric, rtol=1e-15)


def acceleration_rows(model: Assembled, A: np.ndarray) -> np.ndarray:
    names = model.system.state_names
    wanted = [
        "lateral_velocity",
        "attitude_rate",
        *(f"bending_rate_{i + 1}" for i in range(len(model.vehicle.bending))),
    ]
    wanted += [f"slosh_rate_{t.name}" for t in model.vehicle.slosh]
    return A[[names.index(n) for n in wanted]]


def assert_rows_equal(found, expected, weight):
    """Compare entries to 1e-12, where they cancel to 1e-14 of their column in mass-weighted (energy) units."""
    largest = np.abs(weight[:, None] * expected).max(axis=0) / weight[:, None]
    assert np.all(np.abs(found - expected) <= 1e-12 * np.abs(expected) + 1e-14 * largest)


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
    assert_rows_equal(acceleration_rows(coupled, A)[:, columns], expected[:, columns], 1 / d)


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
    a0, a1 = next(gains for switch, gains in reversed(GAINS) if time >= switch)
    K1, K2 = a0 / GAINS[0][1][0], a1 / GAINS[0][1][1]

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
        np.testing.assert_allclose(found, list(expected.values()), rtol=1e-10)  # the schedule has 10 digits


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


def largest_real_part(model: Assembled, time: float, actuator_gain: float) -> float:
    p = [actuator_gain if q.name == "control.T3.gain" else q.value for q in model.system.parameters]
    v = table_values(model.system.tables, time)
    A = model.core.state_matrix(time, list(v.values()), p).full()
    return np.linalg.eigvals(A).real.max()


@pytest.mark.parametrize("time", np.arange(10.0, 151.0, 10.0))
def test_only_the_control_sign_read_closes_the_loop(as_reported, time):
    assert largest_real_part(as_reported, time, +1.0) < 0
    assert largest_real_part(as_reported, time, -1.0) > 0.5
