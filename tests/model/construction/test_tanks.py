"""Tanks: areas, volumes, levels and moments against elementary formulas and quadrature."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ascentwind.model.construction.structure import Tank, TankSection
from ascentwind.model.construction.tank_shape import TankShape
from ascentwind.model.errors import DataError

LENGTH = st.floats(0.2, 6.0)


def tank(*sections: TankSection) -> Tank:
    return Tank("t", sections, 1000.0, 0.0, True)


def dome(tip: float, base: float, radius: float) -> TankSection:
    """Half an ellipsoid from its tip to its base."""
    return TankSection("ellipsoid", min(tip, base), max(tip, base), radius, center=base, semi_axis=abs(base - tip))


@st.composite
def tanks(draw) -> Tank:
    """A domed tank with a conical part, an inner dome and tunnels, somewhere on a vehicle."""
    station, radius = draw(st.floats(-20, 80)), draw(st.floats(1.0, 5.0))
    a, b, c, d = np.cumsum([draw(LENGTH) for _ in range(4)]) + station
    top_radius = radius * draw(st.floats(0.5, 1.5))
    sections = [
        dome(station, a, radius),
        TankSection("cylinder", a, b, radius),
        TankSection("cone", b, c, radius, end_radius=top_radius),
        dome(d, c, top_radius),
    ]
    if draw(st.booleans()):
        sections.append(
            TankSection("ellipsoid", a, b, 0.6 * radius, center=a, semi_axis=b - a, sign=-1),
        )
    if draw(st.booleans()):
        sections.append(TankSection("cylinder", station, d, 0.1 * radius, sign=-1, count=3))
    return tank(*sections)


def signed_area(t: Tank, x: float) -> float:
    """The area from the sections' own definitions, not from their polynomials."""
    total = 0.0
    for s in t.sections:
        if s.begin <= x <= s.end:
            if s.kind == "ellipsoid":
                r = s.radius * math.sqrt(max(1 - ((x - s.center) / s.semi_axis) ** 2, 0.0))
            elif s.kind == "cone":
                r = np.interp(x, [s.begin, s.end], [s.radius, s.end_radius])
            else:
                r = s.radius
            total += s.sign * s.count * math.pi * r**2
    return max(total, 0.0)


@settings(max_examples=60, deadline=None)
@given(tanks(), st.floats(0.0, 1.0))
def test_level_returns_the_volume_and_moments_match_quadrature(t, share):
    shape = TankShape.of(t)
    level = float(shape.level(share * shape.capacity))
    assert float(shape.volume(level)) == pytest.approx(share * shape.capacity, rel=1e-11, abs=1e-11)
    joints = sorted({s for part in t.sections for s in (part.begin, part.end)} | set(shape.edges))
    cuts = [t.bottom, *(j for j in joints if t.bottom < j < level), level]
    for power in range(3):
        expected = sum(
            quad(lambda x, p=power: signed_area(t, x) * x**p, a, b, epsabs=1e-10, epsrel=1e-10)[0]
            for a, b in pairwise(cuts)
        )
        scale = shape.capacity * (1 + abs(level)) ** power
        assert float(shape.moments(level)[power]) == pytest.approx(expected, abs=1e-8 * scale)


@settings(max_examples=40, deadline=None)
@given(tanks())
def test_level_and_volume_increase_together(t):
    shape = TankShape.of(t)
    volumes = np.linspace(0, shape.capacity, 300)
    levels = shape.level(volumes)
    assert (np.diff(levels) > 0).all()
    # at a tip the volume grows as the square of the height: rounding of 1e-14 in it is 1e-7 in the level
    assert levels[[0, -1]] == pytest.approx(shape.edges[[0, -1]], abs=1e-6)
    middle = 0.5 * (levels[1:] + levels[:-1])
    # a radius belongs to the area, the area to the slope of the volume
    slope = (shape.volume(middle + 1e-5) - shape.volume(middle - 1e-5)) / 2e-5
    near_joint = (np.abs(middle[:, None] - shape.edges) < 2e-5).any(axis=1)
    np.testing.assert_allclose((math.pi * shape.radius(middle) ** 2)[~near_joint], slope[~near_joint], rtol=1e-4)
    assert shape.largest_radius >= shape.radius(levels).max() - 1e-12


def test_elementary_volumes():
    cone = TankShape.of(tank(TankSection("cone", 1.0, 4.0, 2.0, end_radius=1.0)))
    assert cone.capacity == pytest.approx(math.pi * 3 / 3 * (4 + 2 + 1), rel=1e-14)
    ellipsoid = TankShape.of(tank(TankSection("ellipsoid", -2.0, 2.0, 3.0, center=0.0, semi_axis=2.0)))
    assert ellipsoid.capacity == pytest.approx(4 / 3 * math.pi * 9 * 2, rel=1e-14)
    lower = ellipsoid.moments(0.0)
    assert lower[1] / lower[0] == pytest.approx(-3 / 8 * 2, rel=1e-13)  # centroid of half an ellipsoid
    annulus = TankShape.of(
        tank(TankSection("cylinder", 0.0, 2.0, 2.0), TankSection("cylinder", 0.0, 2.0, 0.5, sign=-1, count=4))
    )
    assert annulus.capacity == pytest.approx(math.pi * 2 * (4 - 1), rel=1e-14)
    assert annulus.largest_radius == pytest.approx(math.sqrt(3.0), rel=1e-14)


def test_a_tunnel_through_the_tip_of_a_dome_leaves_no_negative_area():
    shape = TankShape.of(tank(dome(0.0, 2.0, 3.0), TankSection("cylinder", 0.0, 2.0, 0.5, sign=-1)))
    free = 2.0 - 2.0 * math.sqrt(1 - (0.5 / 3.0) ** 2)  # where the dome becomes as wide as the tunnel
    assert shape.edges[0] == pytest.approx(free, rel=1e-12)
    assert float(shape.area(0.5 * free)) == 0.0
    assert float(shape.volume(free)) == 0.0


def test_tanks_that_cannot_be():
    with pytest.raises(DataError, match="'t' is closed off at station 1 m"):
        TankShape.of(tank(TankSection("cylinder", 0, 3, 1.0), TankSection("cylinder", 1, 2, 1.5, sign=-1)))
    with pytest.raises(DataError, match="reaches beyond its tips at -2 and 2 m"):
        TankSection("ellipsoid", -2.5, 2.0, 1.0, center=0.0, semi_axis=2.0)
    shape = TankShape.of(tank(TankSection("cylinder", 0.0, 1.0, 1.0)))
    with pytest.raises(DataError, match=r"of 3.142 m3 cannot hold 4 m3"):
        shape.level([1.0, 4.0])
    with pytest.raises(DataError, match="cannot hold -1 m3"):
        shape.level(-1.0)
