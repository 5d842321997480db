"""Beam modes: uniform beams against closed forms, AS-504 against the report, modes followed through a crossing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import root_scalar
from small_construction import small_construction
from threadpoolctl import threadpool_info, threadpool_limits

from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.construction.structure import LumpedMass, Stiffness, Tank, TankSection
from ascentwind.model.errors import ModeError
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.construct.beam.beam import FreeBeam, beam_modes
from ascentwind.runners.construct.beam.elements import stiffness_at
from ascentwind.runners.construct.beam.modes import followed_modes
from ascentwind.runners.construct.mass.line import beam_edges, mass_line

ENGINE = replace(small_construction().engines[0], draws={}, residual={})
LENGTH, BENDING, MASS = 30.0, 2e8, 6000.0


def uniform(shear: float, radius: float, **changes):
    """A uniform free beam; sections of radius of gyration ``radius`` have the rotary inertia mass radius^2 / 2."""
    return small_construction(
        masses=(LumpedMass("beam", 0.0, LENGTH, MASS, radius),),
        tanks=(),
        engines=(ENGINE,),
        stiffness=Stiffness(np.array([0.0, LENGTH]), np.full(2, BENDING), np.full(2, shear)),
        **changes,
    )


def modes_of(vehicle, count: int, liquid=None):
    edges = beam_edges(vehicle)
    return beam_modes(vehicle, mass_line(vehicle, edges, liquid or {}), edges, count)


def timoshenko(shear: float, radius: float, low: float, high: float) -> float:
    """The exact frequency between two bounds: transfer matrix of (w, turn, M, V), free at both ends."""
    mu, rotary = MASS / LENGTH, MASS / LENGTH * radius**2 / 2

    def determinant(frequency: float) -> float:
        a = np.array(
            [
                [0, 1, 0, 1 / shear],
                [0, 0, 1 / BENDING, 0],
                [0, -rotary * frequency**2, 0, -1],
                [-mu * frequency**2, 0, 0, 0],
            ]
        )
        return float(np.linalg.det(expm(a * LENGTH)[2:, :2]))

    return float(root_scalar(determinant, bracket=(low, high), method="brentq", xtol=1e-10).root)


def test_uniform_euler_beam():
    """cos x cosh x = 1; shape at the middle of the first mode -0.6078 of the end (Blevins, table 8-1)."""
    brackets = ((4.5, 5.0), (7.5, 8.2), (10.5, 11.5))
    roots = [root_scalar(lambda x: np.cos(x) - 1 / np.cosh(x), bracket=b, method="brentq").root for b in brackets]
    exact = np.array(roots) ** 2 / LENGTH**2 * np.sqrt(BENDING * LENGTH / MASS)
    found = modes_of(uniform(1e14, 0.0), 3)
    np.testing.assert_allclose(found.frequency, exact, rtol=1e-3)
    middle = np.interp(LENGTH / 2, found.x + 2.0, found.displacement[0])
    assert middle == pytest.approx(-0.6078, abs=1e-3)
    # int of the shape squared is a quarter of the length
    np.testing.assert_allclose(found.generalized_mass, MASS / 4, rtol=2e-3)


def test_uniform_timoshenko_beam():
    """Flexible in shear and with rotary inertia, both far from small: 13 to 58 % lower than Euler's."""
    shear, radius = 4e6, 1.5
    euler = modes_of(uniform(1e14, 0.0), 3).frequency
    found = modes_of(uniform(shear, radius), 3)
    exact = []
    for f in found.frequency:
        exact.append(timoshenko(shear, radius, 0.97 * f, 1.03 * f))
    np.testing.assert_allclose(found.frequency, exact, rtol=1e-3)
    assert (np.array(exact) < 0.9 * euler).all()


def test_stiffness_is_exact_for_a_static_load_on_varying_elements():
    """Cantilever part of a beam with a jump: tip deflection by integrals, three coarse elements that cross the jump."""
    stiffness = Stiffness(
        np.array([0.0, 10.0, 10.0, 30.0]), np.array([4e8, 2e8, 1e8, 5e7]), np.array([3e7, 2e7, 1e7, 5e6])
    )
    vehicle = small_construction(stiffness=stiffness)
    edges = np.array([0.0, 7.0, 19.0, 30.0])
    beam = FreeBeam.of(vehicle, edges - vehicle.gimbal_station)
    s = np.concatenate([np.linspace(0, 10, 20001)[:-1] + 0.00025, np.linspace(10, 30, 40001)[:-1] + 0.00025])
    ei, kga = stiffness_at(stiffness, s)
    assert (ei[:20000] > 1.9e8).all() and (ei[20000:] < 1.01e8).all()
    # clamped at the aft end, loaded at 19 m: deflection at the forward end by virtual work
    moment, unit = np.clip(19.0 - s, 0, None), 30.0 - s
    deflection = np.sum(moment * unit / ei + (s < 19.0) / kga) * 0.0005
    assert beam.flexibility[3, 2] == pytest.approx(deflection, rel=1e-6)
    assert beam.flexibility == pytest.approx(beam.flexibility.T, rel=1e-13)


def test_rotations_follow_a_load_in_equilibrium():
    """Three forces on a uniform beam, at 0, 10 and 30 m: the rotation is the integral of moment / EI, without shear."""
    vehicle = uniform(1e5, 0.0)
    nodes = np.array([0.0, 10.0, 20.0, 30.0])
    beam = FreeBeam.of(vehicle, nodes - vehicle.gimbal_station)
    force = 1e4 * np.array([2.0, -3.0, 0.0, 1.0])
    s = np.linspace(0.0, 30.0, 30001)
    moment = sum(f * np.clip(x - s, 0, None) for f, x in zip(force, nodes, strict=True))
    exact = [np.trapezoid(np.where(s <= x, moment, 0.0), s) / BENDING for x in nodes]
    np.testing.assert_allclose(beam.turn @ (beam.flexibility @ force), exact, rtol=1e-3, atol=1e-9)


def test_modes_are_orthogonal_and_carry_no_momentum():
    vehicle = small_construction()
    edges = beam_edges(vehicle)
    masses = mass_line(vehicle, edges, {"oxidizer": 9000.0})
    beam = FreeBeam.of(vehicle, edges)
    shapes = np.vstack([beam_modes(vehicle, masses, edges, 5).displacement, np.ones(edges.size), edges])
    products = beam.product(masses, shapes, shapes)
    size = np.sqrt(np.diag(products))
    off = products / np.outer(size, size) - np.eye(7)
    off[5, 6] = off[6, 5] = 0.0
    assert np.abs(off).max() < 1e-10


def test_rotation_is_slope_less_shear_and_displacement_ends_at_one():
    found = modes_of(uniform(1e14, 0.0), 3)
    assert found.displacement[:, -1] == pytest.approx(np.ones(3), abs=1e-12)
    slope = np.gradient(found.displacement, found.x, axis=1)
    scale = np.abs(found.rotation).max()
    assert np.abs(slope - found.rotation)[:, 2:-2].max() < 2e-3 * scale


def test_as504_at_75_s_has_the_reports_frequencies():
    """CR-103010, section 3.1: about 6, 13, 18 rad/s. Liquid: what five engines leave at 75 s, about 13.2 t/s."""
    vehicle = load_construction(find_vehicle("as504"))
    burnt = 13_215.0 * (75.0 - 0.3)
    liquid = {"sic_lox": 1_444_641 - 0.699 * burnt, "sic_rp1": 634_901 - 0.301 * burnt}
    found = modes_of(vehicle, 3, liquid)
    np.testing.assert_allclose(found.frequency, [6.0, 13.0, 18.0], rtol=0.1)
    finer = beam_modes(vehicle, mass_line(vehicle, e := beam_edges(vehicle, 0.33), liquid), e, 3)
    np.testing.assert_allclose(found.frequency, finer.frequency, rtol=1e-3)


def crossing_vehicle():
    """Two beams joined by a soft hinge; the aft one holds a tank: as it drains, its mode passes the forward one's."""
    masses = (
        LumpedMass("aft", 0.0, 14.9, 3000.0),
        LumpedMass("hinge", 14.9, 15.1, 2.0),
        LumpedMass("forward", 15.1, 30.0, 3000.0),
    )
    station = np.array([0.0, 14.9, 14.9, 15.1, 15.1, 30.0])
    bending, shear = np.array([2e8, 2e8, 1e5, 1e5, 1.1e8, 1.1e8]), np.array([1e9, 1e9, 1e4, 1e4, 1e9, 1e9])
    tank = Tank("oxidizer", (TankSection("cylinder", 2.0, 13.0, 0.9),), 1100.0, 20000.0, True)
    return small_construction(masses=masses, stiffness=Stiffness(station, bending, shear), tanks=(tank,))


def test_modes_keep_their_shape_through_a_crossing():
    vehicle = crossing_vehicle()
    time = np.linspace(0.0, 80.0, 17)
    liquid = {"oxidizer": 20000.0 * (1 - time / 81.0)}
    found = followed_modes(vehicle, time, liquid, 4)
    aft_mode, forward_mode = found.frequency[:, 2], found.frequency[:, 3]
    assert aft_mode[0] < forward_mode[0] and aft_mode[-1] > forward_mode[-1]
    assert np.ptp(forward_mode) < 0.01 * forward_mode[0] < np.ptp(aft_mode)
    # the aft beam's mode moves the aft beam at both ends of the flight
    station = found.x + vehicle.gimbal_station
    aft, forward = station < 14.9, station > 15.1
    for i in (0, -1):
        squares = found.displacement[i] ** 2
        assert squares[2, aft].sum() > 10 * squares[2, forward].sum()
        assert squares[3, forward].sum() > 10 * squares[3, aft].sum()
    # each is one of the true modes at its time
    for i, amount in enumerate(liquid["oxidizer"]):
        np.testing.assert_allclose(
            np.sort(found.frequency[i]), modes_of(vehicle, 4, {"oxidizer": amount}).frequency, rtol=1e-9
        )


def test_coarse_times_are_halved_until_a_shape_is_known_again():
    vehicle = small_construction(masses=(LumpedMass("shell", 0.0, 30.0, 3000.0),))
    time = np.linspace(0.0, 80.0, 41)
    liquid = {"oxidizer": 20000.0 * (1 - time / 81.0)}
    fine = followed_modes(vehicle, time, liquid, 4)
    coarse = followed_modes(vehicle, time[[0, -1]], {"oxidizer": liquid["oxidizer"][[0, -1]]}, 4)
    jump = FreeBeam.of(vehicle, fine.x).product(
        mass_line(vehicle, fine.x, {"oxidizer": liquid["oxidizer"][-1]}), fine.displacement[0], fine.displacement[-1]
    )
    cosines = jump**2 / fine.generalized_mass[-1] / fine.generalized_mass[0][:, None]
    assert np.diag(cosines).min() < 0.8, "nothing to halve: the case tests nothing"
    np.testing.assert_allclose(coarse.frequency, fine.frequency[[0, -1]], rtol=1e-9)
    np.testing.assert_allclose(coarse.displacement, fine.displacement[[0, -1]], atol=1e-6)


def test_modes_that_cannot_be_scaled_or_followed():
    vehicle = uniform(1e14, 0.0)
    with pytest.raises(ModeError, match="2 beam elements have 1 modes, not 2"):
        beam_modes(vehicle, [1.0, 1.0], np.array([-2.0, 10.0, 28.0]), 2)
    edges = beam_edges(vehicle)
    beam = FreeBeam.of(vehicle, edges)
    with pytest.raises(ModeError, match="bending mode 2 at t = 7 s does not move the forward end"):
        beam.scaled(np.array([5.0, 9.0]), np.array([edges + 3.0, edges - edges[-1]]), 7.0)
    hollow = replace(vehicle, masses=(LumpedMass("aft", 0.0, 14.0, 100.0), LumpedMass("forward", 16.0, 30.0, 100.0)))
    with pytest.raises(ModeError, match=r"no mass lies between 14\.\d+ and 14\.\d+ m"):
        modes_of(hollow, 1)


def test_modes_that_change_beyond_recognition_are_named():
    """Twenty tonnes of liquid leave a structure of a third of a kilogram: the last kilograms change everything."""
    vehicle = small_construction(masses=(LumpedMass("foil", 0.0, 30.0, 0.3), LumpedMass("box", 25.0, 30.0, 500.0)))
    with pytest.raises(
        ModeError, match=r"bending mode 4 cannot be followed past t = 9\.2\d+ s.*modal assurance of 0\.0"
    ):
        followed_modes(vehicle, [0.0, 10.0], {"oxidizer": [20000.0, 0.0]}, 4)


def test_modes_are_followed_on_one_thread_of_the_blas(monkeypatch):
    """The matrices are so small that more threads, which wait for each other, take ten times as long."""
    used, exact = [], FreeBeam.eigenmodes

    def watched(self, masses, count):
        used.extend(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        return exact(self, masses, count)

    monkeypatch.setattr(FreeBeam, "eigenmodes", watched)
    with threadpool_limits(2, user_api="blas"):
        followed_modes(small_construction(), [0.0, 1.0], {"oxidizer": [20000.0, 19900.0]}, 2)
    assert used and set(used) == {1}
