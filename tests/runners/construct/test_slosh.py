"""Slosh: potential flow against exact solutions, cylinder formulas against it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root_scalar
from scipy.special import jvp
from small_construction import small_construction

from ascentwind.model.construction.structure import Tank, TankSection
from ascentwind.model.construction.tank_shape import TankShape
from ascentwind.model.errors import DataError, UnknownNameError
from ascentwind.runners.construct.slosh import slosh_history
from ascentwind.runners.construct.slosh_potential import first_slosh_mode

DENSITY, RADIUS = 900.0, 1.3
UPRIGHT = Tank("can", (TankSection("cylinder", 4.0, 20.0, RADIUS),), DENSITY, 1000.0, True)
SPHERE = Tank("ball", (TankSection("ellipsoid", 4.0, 6.0, 1.0, center=5.0, semi_axis=1.0),), DENSITY, 1000.0, True)
ENGINES = (replace(small_construction().engines[0], draws={}, residual={}),)
ROOT = float(root_scalar(lambda k: float(jvp(1, k)), bracket=(1.5, 2.0), method="brentq", xtol=1e-15).root)


def exact_cylinder(depth, acceleration):
    """Frequency, mass, depth of the oscillator: Abramson, NASA SP-106, chapter 2, from the root of J1' itself."""
    tanh = np.tanh(ROOT * depth / RADIUS)
    liquid = DENSITY * math.pi * RADIUS**2 * depth
    return (
        np.sqrt(ROOT * acceleration / RADIUS * tanh),
        liquid * 2 * RADIUS * tanh / (ROOT * (ROOT**2 - 1) * depth),
        2 * RADIUS / ROOT * np.tanh(ROOT * depth / (2 * RADIUS)),
    )


@pytest.mark.parametrize("method", ["cylinder", "surface_radius", "potential"])
def test_every_method_is_exact_for_an_upright_cylinder(method):
    depth = np.array([0.05, 0.4, 1.3, 3.0, 9.0])
    acceleration = np.array([10.0, 12.0, 15.0, 20.0, 30.0])
    vehicle = small_construction(tanks=(UPRIGHT,), engines=ENGINES, slosh_method=method)
    found = slosh_history(vehicle, "can", DENSITY * math.pi * RADIUS**2 * depth, acceleration)
    frequency, mass, below = exact_cylinder(depth, acceleration)
    tolerance = 1e-4 if method == "potential" else 1e-12
    np.testing.assert_allclose(found.frequency, frequency, rtol=tolerance)
    np.testing.assert_allclose(found.mass, mass, rtol=tolerance)
    np.testing.assert_allclose(found.attach_point, 4.0 + depth - below - 2.0, rtol=tolerance)


def test_half_full_sphere_has_the_published_frequency():
    """omega^2 R / a = 1.5602: Budiansky, J. Aero/Space Sci. 27, 1960, and many after him."""
    assert first_slosh_mode(TankShape.of(SPHERE), 5.0).wave_number == pytest.approx(1.5602, abs=5e-5)


@pytest.mark.parametrize("level", [4.2, 4.6, 5.0, 5.4, 5.7])
def test_wall_pressure_of_a_sphere_has_no_moment_about_its_centre(level):
    """Force of the spring at z and weight of the displaced mass balance there: z - centre = -1 / wave number."""
    mode = first_slosh_mode(TankShape.of(SPHERE), level)
    assert level - mode.depth == pytest.approx(5.0 - 1 / mode.wave_number, abs=2e-4)


def test_little_liquid_in_a_sphere_swings_as_a_pendulum():
    """In a shallow bowl the liquid slides as a body: omega^2 = a / R, all of it."""
    shape = TankShape.of(SPHERE)
    mode = first_slosh_mode(shape, 4.001)
    assert mode.wave_number == pytest.approx(1.0, rel=1e-3)
    assert mode.volume == pytest.approx(float(shape.volume(4.001)), rel=1e-3)


def test_surface_radius_follows_the_dome_and_stays_below_the_shallow_limit():
    vehicle = small_construction(tanks=(SPHERE,), engines=ENGINES, slosh_method="surface_radius")
    shape = TankShape.of(SPHERE)
    level = np.array([4.05, 5.0, 5.6])
    liquid = DENSITY * shape.volume(level)
    found = slosh_history(vehicle, "ball", liquid, 10.0)
    radius, height = np.sqrt(1 - (level - 5) ** 2), level - 4
    np.testing.assert_allclose(found.frequency**2, 10 * ROOT / radius * np.tanh(ROOT * height / radius), rtol=1e-12)
    assert found.mass[0] == pytest.approx(2 / (ROOT**2 - 1) * liquid[0], rel=1e-12)
    assert (found.mass < liquid).all()


def test_what_cannot_slosh_is_refused_with_its_time():
    vehicle = small_construction(tanks=(UPRIGHT,), engines=ENGINES)
    with pytest.raises(DataError, match=r"t = 3 s: tank 'can' cannot slosh with 0 kg of liquid"):
        slosh_history(vehicle, "can", [10.0, 0.0], 9.0, time=[2.0, 3.0])
    with pytest.raises(DataError, match="cannot slosh with -1 m/s2 of axial acceleration"):
        slosh_history(vehicle, "can", 10.0, -1.0)
    with pytest.raises(UnknownNameError, match="no tank 'cam'; did you mean 'can'"):
        slosh_history(vehicle, "cam", 10.0, 9.0)
