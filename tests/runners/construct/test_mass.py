"""Mass properties and mass line: against slices summed one by one, against each other, against AS-506."""

from __future__ import annotations

import numpy as np
import pytest
from small_construction import small_construction

from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.construction.structure import LumpedMass, Tank, TankSection
from ascentwind.model.construction.tank_shape import TankShape
from ascentwind.model.errors import DataError, UnknownNameError
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.construct.beam.beam import FreeBeam
from ascentwind.runners.construct.mass.line import beam_edges, mass_line, rotary_line
from ascentwind.runners.construct.mass.properties import mass_properties
from ascentwind.runners.reproduction.as506.mass import mass_checks

CONE = Tank("oxidizer", (TankSection("cone", 5.0, 15.0, 0.5, end_radius=0.9),), 1100.0, 12000.0, True)


@pytest.fixture(scope="module")
def as504():
    return load_construction(find_vehicle("as504"))


def test_mass_properties_equal_a_sum_over_thin_slices():
    vehicle = small_construction(tanks=(CONE,))
    liquid = 7000.0
    level = float(TankShape.of(CONE).level(liquid / CONE.density))
    count = 20000
    parts = []  # station, mass, own pitch inertia
    for item in vehicle.masses:
        middle = item.begin + (item.end - item.begin) * (np.arange(count) + 0.5) / count
        parts.append((middle, np.full(count, item.mass / count), item.radius**2 / 2))
    edges = np.linspace(5.0, level, count + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    radius = 0.5 + 0.4 * (middle - 5) / 10
    parts.append((middle, CONE.density * np.pi * radius**2 * np.diff(edges), 0.0))
    mass = sum(m.sum() for _, m, _ in parts)
    center = sum((s * m).sum() for s, m, _ in parts) / mass
    inertia = sum((m * ((s - center) ** 2 + own)).sum() for s, m, own in parts)
    found = mass_properties(vehicle, {"oxidizer": [liquid, liquid]})
    assert found.mass == pytest.approx([mass, mass], rel=1e-8)
    assert found.center_of_gravity + vehicle.gimbal_station == pytest.approx([center, center], rel=1e-8)
    assert found.moment_of_inertia == pytest.approx([inertia, inertia], rel=1e-7)


@pytest.mark.parametrize("liquid", [0.0, 3000.0, 12000.0])
def test_mass_line_holds_everything(liquid):
    vehicle = small_construction(tanks=(CONE,))
    edges = beam_edges(vehicle, 0.01)
    masses, rotary = mass_line(vehicle, edges, {"oxidizer": liquid}), rotary_line(vehicle, edges)
    whole = mass_properties(vehicle, {"oxidizer": liquid})
    middle = 0.5 * (edges[1:] + edges[:-1])
    center = (masses * middle).sum() / masses.sum()
    assert masses.sum() == pytest.approx(float(whole.mass), rel=1e-14)
    # elements of 1 cm: the point mass of 150 kg is out by half of one at most
    assert center == pytest.approx(float(whole.center_of_gravity), abs=150 * 0.005 / float(whole.mass) + 1e-6)
    inertia = (masses * (middle - center) ** 2).sum() + rotary.sum()
    assert inertia == pytest.approx(float(whole.moment_of_inertia), rel=1e-4)


def test_beam_has_the_rigid_body_of_the_mass_properties(as504):
    """Mass matrix applied to translation and rotation; elements are uniform, the liquid's edge inside one is not."""
    edges = beam_edges(as504)
    beam = FreeBeam.of(as504, edges)
    rigid = np.array([np.ones(edges.size), edges])
    m = beam.product(mass_line(as504, edges, {}), rigid, rigid)
    whole = mass_properties(as504, {})
    assert m[0, 0] == pytest.approx(float(whole.mass), rel=1e-13)
    assert m[0, 1] / m[0, 0] == pytest.approx(float(whole.center_of_gravity), abs=2e-3)
    assert m[1, 1] - m[0, 1] ** 2 / m[0, 0] == pytest.approx(float(whole.moment_of_inertia), rel=2e-4)


def test_beam_is_cut_at_gimbal_sensors_and_loads_but_never_too_short():
    vehicle = small_construction(load_stations=(12.0, 24.005))
    edges = beam_edges(vehicle, 0.5) + vehicle.gimbal_station
    for station in (0.0, 2.0, 12.0, 24.0, 30.0):
        assert np.abs(edges - station).min() < 1e-12
    assert np.diff(edges).min() > 0.5 / 4
    assert np.diff(edges).max() <= 0.5 + 1e-9


def test_a_point_mass_on_an_edge_is_counted_once():
    vehicle = small_construction(masses=(LumpedMass("box", 12.0, 12.0, 10.0), LumpedMass("tip", 30.0, 30.0, 5.0)))
    masses = mass_line(vehicle, np.array([0.0, 12.0, 30.0]) - 2.0, {"oxidizer": 0.0})
    assert masses == pytest.approx([0.0, 15.0])


def test_as504_weighs_what_its_mass_sheet_says(as504):
    """Ground ignition 2 942 262 kg less the build-up of AS-506, 2 938 315 - 2 899 008 kg (FER table 20-1)."""
    assert float(mass_properties(as504, {}).mass) == pytest.approx(2_942_262 - (2_938_315 - 2_899_008), abs=100)
    items = {m.name: m.mass for m in as504.masses}
    stage = sum(
        items[name]
        for name in ("S-IVB J-2 engine, thrust cone", "S-IVB aft skirt, APS", "S-IVB tank, common bulkhead, lines")
    )
    assert stage + items["S-IVB forward skirt, equipment"] == pytest.approx(11_380, abs=1)  # S-IVB dry, mass sheet


def test_as506_meets_its_flight(as504):
    rows = {row.quantity: row for row in mass_checks(as504)}
    for name, row in rows.items():
        assert row.holds, f"{name}: {row.ours} against {row.flight}"
    assert rows["hold-down release, mass"].ours == pytest.approx(2899.01, abs=0.01)
    assert rows["outboard cutoff, centre of gravity, station"].limit == 0.15


def test_tanks_that_the_vehicle_does_not_have(as504):
    with pytest.raises(UnknownNameError, match="no tank 'sic_lix'; did you mean 'sic_lox'"):
        mass_properties(as504, {"sic_lix": 1.0})
    with pytest.raises(UnknownNameError, match="did you mean 'sic_rp1'"):
        mass_line(as504, beam_edges(as504), {"sic_rp": 1.0})
    with pytest.raises(DataError, match="cannot hold"):
        mass_properties(as504, {"sic_lox": 2e6})
