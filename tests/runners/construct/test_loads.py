"""Load coefficients: against particles under Newton's laws, from the other side, each other, closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_construction import small_construction

from ascentwind.model.errors import DataError
from ascentwind.runners.construct.aerodynamics import intensity, knots
from ascentwind.runners.construct.line_integrals import Line
from ascentwind.runners.construct.loads import (
    LoadedVehicle,
    axial_coefficients,
    load_coefficients,
    shear_coefficients,
)
from ascentwind.runners.construct.vehicle_numbers import JUST_FORWARD

STATIONS = np.array([-2.0, -1.0, 4.0, 10.0, 17.5, 28.0])
THRUST, SPEED, PRESSURE = 3e5, 400.0, 2e4


@pytest.fixture(scope="module")
def vehicle() -> LoadedVehicle:
    """Uneven masses and two polynomials, made orthogonal to rigid motion, as modes."""
    construction = small_construction()
    edges = np.linspace(-2, 28, 61)
    line = Line.cut_at(edges, knots(construction), STATIONS)
    rng = np.random.default_rng(2)
    mass = line.spread(edges, rng.uniform(50, 900, 60))
    rotary = line.spread(edges, rng.uniform(0, 50, 60))
    shapes, rotations, slopes = [], [], []
    for values in rng.uniform(-1, 1, (2, edges.size)):
        slope = np.gradient(values, edges)
        shapes.append(line.linear(edges, values))
        rotations.append(0.8 * line.linear(edges, slope))  # the rest is shear strain
        slopes.append(line.slope(edges, values))
    shapes, rotations, slopes = np.array(shapes), np.array(rotations), np.array(slopes)
    x = line.points
    rigid = np.array([np.ones_like(x), x])
    turned = np.array([np.zeros_like(x), np.ones_like(x)])
    gram = np.array([[line.total(mass * a * b + rotary * p * q) for b, q in zip(rigid, turned, strict=True)]
                     for a, p in zip(rigid, turned, strict=True)])  # fmt: skip
    for k in range(2):
        pairs = zip(rigid, turned, strict=True)
        c = np.linalg.solve(gram, [line.total(mass * a * shapes[k] + rotary * p * rotations[k]) for a, p in pairs])
        shapes[k] -= c @ rigid
        rotations[k] -= c @ turned
        slopes[k] -= c @ turned
    force = PRESSURE * construction.reference_area
    air, at_stations = (force * intensity(construction, [1.4], at)[0] for at in (x, STATIONS + JUST_FORWARD))
    tank = np.array([4000.0]), np.array([9.0])
    return LoadedVehicle(line, mass, rotary, air, at_stations, THRUST, SPEED, shapes, rotations, slopes, *tank)


NAMES = ("angle_of_attack", "engine_angle", "bending", "attitude_rate", "bending_displacement", "bending_rate")


def particle_shears(vehicle: LoadedVehicle, force, couple, masses, rotary, side: int):
    """Shear force at STATIONS from Newton's laws for rigid particles, by the part forward (1) or aft (-1)."""
    x = vehicle.line.points
    mass, center = masses.sum(), (x * masses).sum() / masses.sum()
    inertia = (masses * (x - center) ** 2).sum() + rotary.sum()
    net = force - masses * (force.sum() / mass + (x - center) * ((x - center) * force + couple).sum() / inertia)
    return np.array([side * net[(x - s) * side > 0].sum() for s in STATIONS])


@pytest.mark.parametrize("side", [1, -1])
def test_shears_are_those_of_particles_from_either_side(vehicle, side):
    """Air, engine, modes, the moved line and slosh with the vehicle's answer: the aft part gives the same."""
    weights, x = vehicle.line.weights, vehicle.line.points
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    zero, air = np.zeros_like(masses), vehicle.normal_force * weights
    found = shear_coefficients(vehicle, STATIONS)
    cases = [(found.angle_of_attack, air, zero)]
    at = {0.0: THRUST, float(vehicle.slosh_point[0]): -float(vehicle.slosh_mass[0])}
    of_point = []
    for point, size in at.items():
        nearest = int(np.argmin(np.abs(x - point)))
        force, couple = zero.copy(), zero.copy()
        force[nearest], couple[nearest] = size, size * (point - x[nearest])
        of_point.append((force, couple))
    mass, center = masses.sum(), (x * masses).sum() / masses.sum()
    inertia = (masses * (x - center) ** 2).sum() + rotary.sum()
    arm = vehicle.slosh_point[0] - center
    answer = vehicle.slosh_mass[0] * (found.first_moment / mass + arm * found.second_moment / inertia)
    cases += [(found.engine_angle, *of_point[0]), (found.slosh[0] + answer, *of_point[1])]
    for k in range(2):
        cases.append((found.bending_displacement[k], air * vehicle.slope[k], zero))
        net = -vehicle.mass * weights * vehicle.displacement[k]
        expected = [side * net[(x - s) * side > 0].sum() for s in STATIONS]
        np.testing.assert_allclose(found.bending[k], expected, atol=1e-10 * np.abs(expected).max())
    for value, force, couple in cases:
        expected = particle_shears(vehicle, force, couple, masses, rotary, side)
        np.testing.assert_allclose(value, expected, atol=1e-10 * np.abs(expected).max())
    moved = found.center_of_pressure - vehicle.normal_force_at_stations
    expected = particle_shears(vehicle, zero, air, masses, rotary, side)  # a couple at every particle
    np.testing.assert_allclose(moved, expected, atol=1e-10 * np.abs(found.center_of_pressure).max())


def refined(vehicle: LoadedVehicle, stations: np.ndarray) -> LoadedVehicle:
    """The same vehicle on a line that is cut at more stations too."""
    old = vehicle.line
    line = Line.cut_at(old.edges, stations)
    cell = np.clip(np.searchsorted(old.edges, line.points) - 1, 0, old.edges.size - 2)
    left, right = old.points[2 * cell], old.points[2 * cell + 1]
    share = (line.points - left) / (right - left)

    def at(values):
        return values[..., 2 * cell] * (1 - share) + values[..., 2 * cell + 1] * share

    names = ("mass", "rotary_inertia", "normal_force", "displacement", "rotation", "slope")
    return replace(vehicle, line=line, **{name: at(getattr(vehicle, name)) for name in names})


def test_shear_is_the_derivative_of_the_moment_but_for_rotary_inertia(vehicle):
    """dM/ds = -V - c, c the couples that rotary inertia puts on a metre; to 1e-6 of the most, by differences of M."""
    h, rng = 2e-4, np.random.default_rng(7)
    edges = vehicle.line.edges
    x = np.sort(np.concatenate([rng.uniform(edges[0] + 0.1, edges[-1] - 0.1, 40), [0.5 * (edges[3] + edges[4])]]))
    x = x[np.abs(x[:, None] - edges).min(axis=1) > 2 * h]  # no jump of a density within the difference
    x = x[np.abs(x) > 2 * h]
    stations = np.sort(np.concatenate([x - h, x, x + h]))
    fine = refined(vehicle, stations)
    fine = replace(fine, normal_force_at_stations=np.zeros(stations.size))
    moments, shears = load_coefficients(fine, stations), shear_coefficients(fine, stations)
    line, mu, r = fine.line, fine.mass, fine.rotary_inertia
    mass = line.total(mu)
    center = line.total(line.points * mu) / mass
    inertia = line.total((line.points - center) ** 2 * mu + r)
    cell = np.searchsorted(edges, x) - 1
    rotary = vehicle.rotary_inertia[2 * cell]  # uniform in a cell
    turn = {
        "angle_of_attack": line.total((line.points - center) * fine.normal_force) / inertia,
        "engine_angle": -fine.control_thrust * center / inertia,
        "attitude_rate": -line.total((line.points - center) ** 2 * fine.normal_force)
        / fine.relative_velocity
        / inertia,
    }
    for name in NAMES:
        M, V = (np.atleast_2d(getattr(c, name)) for c in (moments, shears))
        slope = (M[:, 2::3] - M[:, 0::3]) / (2 * h)
        couples = -rotary * turn[name] if name in turn else 0.0
        if name == "bending":
            left, right = vehicle.rotation[:, 2 * cell], vehicle.rotation[:, 2 * cell + 1]
            points = vehicle.line.points
            share = (x - points[2 * cell]) / (points[2 * cell + 1] - points[2 * cell])
            couples = -rotary * (left * (1 - share) + right * share)
        elif name.startswith("bending"):
            density = fine.slope if name.endswith("displacement") else -fine.displacement / fine.relative_velocity
            couples = -rotary * line.total((line.points - center) * fine.normal_force * density)[:, None] / inertia
        here = V[:, 1::3]
        np.testing.assert_allclose(slope, -here - couples, atol=1e-6 * np.abs(here).max(), err_msg=name)


def test_loads_vanish_beyond_the_ends_and_jump_at_the_gimbal_by_the_force_there(vehicle):
    """Shear jumps by the control thrust for each rad, the moment does not; outside the vehicle nothing is left."""
    edges = vehicle.line.edges
    at = np.array([edges[0] - 1.0, edges[0], -1e-7, 0.0, edges[-1], edges[-1] + 1.0])
    fine = replace(refined(vehicle, np.array([0.0])), normal_force_at_stations=np.zeros(at.size))
    shears, moments = shear_coefficients(fine, at), load_coefficients(fine, at)
    inside = load_coefficients(vehicle, STATIONS), shear_coefficients(vehicle, STATIONS)
    for name in NAMES:
        for found, size in zip((moments, shears), inside, strict=True):
            value, scale = np.atleast_2d(getattr(found, name)), np.abs(getattr(size, name)).max()
            np.testing.assert_allclose(value[:, [0, 1, 4, 5]], 0.0, atol=1e-11 * scale, err_msg=name)
    assert shears.engine_angle[2] - shears.engine_angle[3] == pytest.approx(THRUST, rel=1e-12)
    assert moments.engine_angle[2] == pytest.approx(moments.engine_angle[3], rel=1e-6)
    for name in ("angle_of_attack", "bending"):
        value = np.atleast_2d(getattr(shears, name))
        np.testing.assert_allclose(value[:, 2], value[:, 3], rtol=1e-6)
    axial = axial_coefficients(fine, at, np.zeros(at.size))["mass_forward", "kg"]
    total = fine.line.total(fine.mass)
    wanted = total * np.array([1.0, 1.0, 0.0, 0.0])
    np.testing.assert_allclose(axial[[0, 1, 4, 5]], wanted, atol=1e-9 * float(total))


def test_uniform_beam_with_a_force_at_its_end_has_the_closed_form():
    """Force F at the aft end of a free beam of length L: V = -F (1 - z)(1 - 3 z), M = F L z (1 - z)^2, z = s / L."""
    length, per_metre = 40.0, 250.0
    stations = np.linspace(0, length, 21)
    line = Line.cut_at(stations)
    ones = np.ones_like(line.points)
    none = np.zeros((0, line.points.size))
    beam = LoadedVehicle(line, per_metre * ones, 0 * ones, 0 * ones, 0 * stations, THRUST, SPEED, none, none, none,
                         np.zeros(0), np.zeros(0))  # fmt: skip
    z = stations / length
    shear = -THRUST * (1 - z) * (1 - 3 * z)
    moment = THRUST * length * z * (1 - z) ** 2
    np.testing.assert_allclose(shear_coefficients(beam, stations).engine_angle, shear, atol=1e-9 * THRUST)
    found = load_coefficients(beam, stations).engine_angle
    np.testing.assert_allclose(found, moment, atol=1e-9 * THRUST * length)
    forward = axial_coefficients(beam, stations, 0 * z)["mass_forward", "kg"]
    np.testing.assert_allclose(forward, per_metre * (length - stations), atol=1e-9 * per_metre * length)


def particle_moments(vehicle: LoadedVehicle, force, couple, masses, rotary, side: int):
    """Bending moment at STATIONS from Newton's laws for rigid particles, by the part forward (1) or aft (-1)."""
    x = vehicle.line.points
    mass, center = masses.sum(), (x * masses).sum() / masses.sum()
    inertia = (masses * (x - center) ** 2).sum() + rotary.sum()
    lateral = force.sum() / mass
    turning = ((x - center) * force + couple).sum() / inertia
    net = force - masses * (lateral + turning * (x - center))
    net_couple = couple - rotary * turning
    found = []
    for s in STATIONS:
        part = (x - s) * side > 0
        found.append(side * ((x - s) * net + net_couple)[part].sum())
    return np.array(found)


@pytest.mark.parametrize("side", [1, -1])
def test_masses_beside_the_thrust_axis_load_stations_as_particles_do(vehicle, side):
    """1 m beside it, at 1 m/s2 along it: every particle is a couple about the axis, and the thrust is on the axis."""
    weights = vehicle.line.weights
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    expected = particle_moments(vehicle, np.zeros_like(masses), masses, masses, rotary, side)
    found = load_coefficients(vehicle, STATIONS).center_of_gravity_offset
    np.testing.assert_allclose(found, expected, atol=1e-10 * masses.sum())


@pytest.mark.parametrize("side", [1, -1])
def test_thrust_on_a_bent_axis_loads_stations_as_particles_do(vehicle, side):
    """Particles pull aft at the bent axis, the thrust forward at the gimbal; all turn as a rigid body."""
    x, weights = vehicle.line.points, vehicle.line.weights
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    mass, center = masses.sum(), (x * masses).sum() / masses.sum()
    inertia = (masses * (x - center) ** 2).sum() + rotary.sum()
    found = load_coefficients(vehicle, STATIONS).p_delta
    for mode, shape in enumerate(vehicle.displacement):
        gimbal, *there = (straight_through(x, shape, s) for s in (0.0, *STATIONS))
        turning = ((masses * shape).sum() - mass * gimbal) / inertia
        for k, s in enumerate(STATIONS):
            part = (x - s) * side > 0
            net = masses * (shape - there[k]) - (masses * (x - s) * (x - center) + rotary) * turning
            thrust = -mass * (gimbal - there[k]) * ((0.0 - s) * side > 0)
            assert found[mode, k] == pytest.approx(side * (net[part].sum() + thrust), abs=1e-9 * mass)


def straight_through(x: np.ndarray, shape: np.ndarray, at: float) -> float:
    """Return a shape at an edge of the line by the two points of the element forward of it, aft of it at the nose."""
    k = min(2 * int(np.searchsorted(x[::2], at)), x.size - 2)
    return float(shape[k] + (shape[k + 1] - shape[k]) * (at - x[k]) / (x[k + 1] - x[k]))


@pytest.mark.parametrize("side", [1, -1])
def test_air_and_engine_moments_are_those_of_particles_from_either_side(vehicle, side):
    """The aft part gives the same moment as the forward part: inertia meets every force."""
    weights = vehicle.line.weights
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    zero = np.zeros_like(masses)
    found = load_coefficients(vehicle, STATIONS)
    air = vehicle.normal_force * weights
    expected = particle_moments(vehicle, air, zero, masses, rotary, side)
    np.testing.assert_allclose(found.angle_of_attack, expected, atol=1e-10 * np.abs(expected).max())
    nearest = int(np.argmin(np.abs(vehicle.line.points)))
    x = vehicle.line.points[nearest]
    force, couple = zero.copy(), zero.copy()
    force[nearest], couple[nearest] = THRUST, -THRUST * x  # moved to the gimbal plane by a couple
    expected = particle_moments(vehicle, force, couple, masses, rotary, side)
    np.testing.assert_allclose(found.engine_angle, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("side", [1, -1])
def test_moved_normal_force_is_a_couple_at_every_particle(vehicle, side):
    """Each force moved forward by a metre is the force and a couple as large: from either side, at every station."""
    weights = vehicle.line.weights
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    air = vehicle.normal_force * weights
    expected = particle_moments(vehicle, np.zeros_like(air), air, masses, rotary, side)
    found = load_coefficients(vehicle, STATIONS).center_of_pressure
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_moments_vanish_at_both_ends(vehicle):
    line = vehicle.line
    ends = load_coefficients(vehicle, line.edges[[0, -1]])
    size = load_coefficients(vehicle, STATIONS)
    names = ("angle_of_attack", "engine_angle", "center_of_pressure", "bending", "attitude_rate")
    for name in (*names, "bending_displacement", "bending_rate"):
        scale = np.abs(getattr(size, name)).max()
        np.testing.assert_allclose(getattr(ends, name), 0.0, atol=1e-11 * scale, err_msg=name)
    assert ends.first_moment[0] == pytest.approx(line.total(vehicle.mass * (line.points - line.edges[0])), rel=1e-12)


def test_bending_moment_of_a_mode_is_its_inertia_from_either_side(vehicle):
    weights, x = vehicle.line.weights, vehicle.line.points
    found = load_coefficients(vehicle, STATIONS).bending
    for k in range(2):
        net = -vehicle.mass * weights * vehicle.displacement[k]
        couple = -vehicle.rotary_inertia * weights * vehicle.rotation[k]
        for side in (1, -1):
            expected = [side * ((x - s) * net + couple)[(x - s) * side > 0].sum() for s in STATIONS]
            np.testing.assert_allclose(found[k], expected, atol=1e-10 * np.abs(found[k]).max())


def test_slosh_with_the_answer_of_the_rigid_body_closes_at_both_ends(vehicle):
    """M'_xi and S_1, S_2 together are the moment of a lateral force and a couple on the free vehicle."""
    line, weights = vehicle.line, vehicle.line.weights
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    zero = np.zeros_like(masses)
    c = load_coefficients(vehicle, STATIONS)
    m, point = vehicle.slosh_mass[0], vehicle.slosh_point[0]
    mass, center = masses.sum(), (line.points * masses).sum() / masses.sum()
    inertia = (masses * (line.points - center) ** 2).sum() + rotary.sum()
    nearest = int(np.argmin(np.abs(line.points - point)))
    force, couple = zero.copy(), zero.copy()
    force[nearest], couple[nearest] = -m, -m * (point - line.points[nearest])
    answer = m * c.first_moment / mass + m * (point - center) * c.second_moment / inertia
    for side in (1, -1):
        expected = particle_moments(vehicle, force, couple, masses, rotary, side)
        np.testing.assert_allclose(c.slosh[0] + answer, expected, atol=1e-10 * np.abs(expected).max())
    couple = zero.copy()
    couple[nearest] = m * 12.0  # weight of a displaced slosh mass, axial acceleration 12 m/s2
    expected = particle_moments(vehicle, zero, couple, masses, rotary, 1)
    hanging = 12.0 * m * ((point > STATIONS) - c.second_moment / inertia)
    np.testing.assert_allclose(hanging, expected, atol=1e-10 * np.abs(expected).max())


def test_local_angle_of_attack_terms_are_loads_of_their_forces(vehicle):
    weights, x = vehicle.line.weights, vehicle.line.points
    masses, rotary = vehicle.mass * weights, vehicle.rotary_inertia * weights
    zero, c = np.zeros_like(masses), load_coefficients(vehicle, STATIONS)
    center = (x * masses).sum() / masses.sum()
    cases = [(c.attitude_rate, -(x - center) / SPEED)]
    for k in range(2):
        cases.append((c.bending_displacement[k], vehicle.slope[k]))
        cases.append((c.bending_rate[k], -vehicle.displacement[k] / SPEED))
    for found, angle in cases:
        force = vehicle.normal_force * weights * angle
        expected = particle_moments(vehicle, force, zero, masses, rotary, -1)
        np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_modes_of_other_masses_are_refused(vehicle):
    shifted = replace(vehicle, displacement=vehicle.displacement + np.array([[0.0], [0.2]]))
    with pytest.raises(DataError, match="mode 2 moves"):
        load_coefficients(shifted, STATIONS)
