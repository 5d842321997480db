"""Solid motors and what is dropped: tubes that burn radially by closed forms, and flights that lose their boosters."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from small_construction import MACH, small_construction

from ascentwind.model.construction.construction_file import construction_files, load_construction
from ascentwind.model.construction.flight import Drag, EngineGroup, NormalForceComponent
from ascentwind.model.construction.grain import Grain
from ascentwind.model.construction.jettison import Jettison
from ascentwind.model.construction.structure import LumpedMass
from ascentwind.model.errors import AscentwindError, DataError, UnknownNameError
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.construct.ascent.mean_flight import EVENT_MARGIN, fly
from ascentwind.runners.construct.beam.beam import FreeBeam
from ascentwind.runners.construct.mass.line import beam_edges, mass_line, rotary_line
from ascentwind.runners.construct.mass.properties import mass_properties
from ascentwind.runners.construct.vehicle_numbers import compute_vehicle

DENSITY, RADIUS, BEGIN, END = 1750.0, 0.6, 2.0, 9.0
PROPELLANT = 8000.0
GRAIN = Grain("booster", 1, BEGIN, END, RADIUS, 0.0, DENSITY, PROPELLANT)
TIME = np.array([0.0, 40.0, 50.0])
THRUST = np.array([4e5, 4e5, 0.0])
FLOW = np.array([PROPELLANT / 45, PROPELLANT / 45, 0.0])  # 40 s and half of 10 s: 8000 kg


def alone(grain: Grain):
    """A vehicle of which nearly all is the grain."""
    rest = LumpedMass("rest", 0.0, 30.0, 1e-6)
    return small_construction(masses=(rest,), tanks=(), engines=(motor(grain),), grains=(grain,))


def motor(grain: Grain) -> EngineGroup:
    return EngineGroup(
        grain.name, grain.count, False, 0.3, TIME, THRUST, FLOW, {grain.name: 1.0}, 50.0, "burnout", solid=True
    )


def boosted(**changes):
    """The small vehicle with two boosters beside it that leave, with their cases and noses, at 60 s."""
    plain = small_construction()
    boosters = replace(GRAIN, count=2, distance=1.6, propellant=2 * PROPELLANT)
    noses = NormalForceComponent("booster noses", np.array([9.0, 11.0]), np.ones(2), MACH, np.full(4, 1.5))
    parts = {
        "masses": (*plain.masses, LumpedMass("booster cases", 1.5, 11.0, 2200.0, 1.7)),
        "engines": (*plain.engines, motor(boosters)),
        "normal_force": (*plain.normal_force, noses),
        "grains": (boosters,),
        "jettisons": (
            Jettison("booster_separation", 60.0, ("booster cases",), ("booster",), ("booster noses",),
                     Drag(np.array([0.0, 5.0]), np.array([0.2, 0.2]))),
        ),
    }  # fmt: skip
    return small_construction(**(parts | changes))


@pytest.fixture(scope="module")
def flight():
    return fly(boosted())


@pytest.mark.parametrize("burnt", [0.0, 2500.0, 7900.0])
def test_a_tube_that_burns_radially(burnt):
    """Mass, centre and moment of inertia by integrals over the tube between port and case."""
    left = PROPELLANT - burnt
    first = np.sqrt(RADIUS**2 - PROPELLANT / (DENSITY * np.pi * (END - BEGIN)))
    port = np.sqrt(first**2 + burnt / (DENSITY * np.pi * (END - BEGIN)))  # the burnt tube lies between both
    assert float(GRAIN.port_radius(left)) == pytest.approx(port, rel=1e-12)
    found = mass_properties(alone(GRAIN), {"booster": left})
    middle = 0.5 * (BEGIN + END)
    rings, _ = quad(lambda r: 2 * np.pi * r * DENSITY, port, RADIUS)
    assert float(found.mass) == pytest.approx(rings * (END - BEGIN), rel=1e-8)
    assert float(found.center_of_gravity) == pytest.approx(middle - 2.0, rel=1e-6)
    across, _ = quad(lambda r: np.pi * r**3 * DENSITY, port, RADIUS)  # of a slice, about its diameter
    along, _ = quad(lambda x: (x - middle) ** 2 * rings, BEGIN, END)
    assert float(found.moment_of_inertia) == pytest.approx(across * (END - BEGIN) + along, rel=1e-6)


def test_motors_around_the_axis():
    """Three motors at 1.6 m: their inertia about any lateral axis, by the parallel-axis theorem for each."""
    three = replace(GRAIN, count=3, distance=1.6, propellant=3 * 6000.0)
    one = 0.25 * 6000.0 * (RADIUS**2 + float(replace(GRAIN, propellant=6000.0).port_radius(6000.0)) ** 2)
    for turned in (0.0, 0.4, 1.1):
        sides = 1.6 * np.cos(turned + 2 * np.pi * np.arange(3) / 3)
        assert float(three.rotary_inertia(18000.0)) == pytest.approx(float(np.sum(one + 6000.0 * sides**2)), rel=1e-12)


def test_lines_hold_the_grain():
    vehicle = boosted()
    edges = beam_edges(vehicle)
    amounts = {"booster": np.array([16000.0, 4000.0, 0.0]), "booster cases": np.array([2200.0, 2200.0, 0.0])}
    lines, turning = mass_line(vehicle, edges, amounts), rotary_line(vehicle, edges, amounts)
    whole = mass_properties(vehicle, amounts)
    np.testing.assert_allclose(lines.sum(axis=1), whole.mass, rtol=1e-12)
    np.testing.assert_allclose(
        turning.sum(axis=1) - rotary_line(small_construction(), edges).sum(),
        vehicle.grains[0].rotary_inertia(amounts["booster"]) + 0.5 * amounts["booster cases"] * 1.7**2,
        rtol=1e-9,
        atol=1e-9,
    )
    np.testing.assert_allclose(lines[2], mass_line(small_construction(), edges, {}), atol=1e-9)


def test_a_flight_that_drops_its_boosters(flight):
    """Masses by the integral of the flows, thrust by the tables, and what leaves at 60 s and not before."""
    plain = small_construction()
    dry = sum(m.mass for m in plain.masses)
    time = flight.time
    rate, left = PROPELLANT / 45, np.clip(50.0 - time, 0.0, 10.0)
    grain = 2 * np.where(time < 40.0, PROPELLANT - rate * time, rate * left**2 / 20)
    dropped = time > 60.0
    exact = dry + 20000.0 - 0.7 * 140.0 * time + np.where(dropped, 0.0, 2200.0 + grain)
    np.testing.assert_allclose(flight.mass, exact, rtol=1e-8)
    assert flight.events["booster_separation"] == 60.0 and flight.events["burnout"] == 50.0
    before, after = (
        int(np.flatnonzero(np.isclose(time, 60.0 + s * EVENT_MARGIN, rtol=0, atol=1e-9))[0]) for s in (-1, 1)
    )
    assert flight.mass[before] - flight.mass[after] == pytest.approx(2200.0, abs=0.05)
    for name in ("relative_velocity", "altitude", "dynamic_pressure"):  # nothing of the motion jumps
        assert getattr(flight, name)[after] == pytest.approx(getattr(flight, name)[before], rel=1e-4)
    ratio = flight.drag / (flight.dynamic_pressure * plain.reference_area)
    curve = np.interp(flight.mach, plain.drag.mach, plain.drag.coefficient)
    np.testing.assert_allclose(ratio, np.where(dropped, 0.2, curve), rtol=1e-8)
    ambient = np.interp(time, TIME, THRUST) - 0.3 * flight.pressure
    burning = np.where(time < 50.0, 2 * np.maximum(ambient, 0.0), 0.0)
    np.testing.assert_allclose(flight.thrust, 4e5 - 0.5 * flight.pressure + burning, rtol=1e-9)
    assert (ambient[(time < 50.0) & (time > 49.0)] < 0).any()  # tail-off below the air's pressure makes no suction


def test_after_the_drop_it_is_the_vehicle_without_boosters():
    """Masses, modes and air forces of the rows after 60 s are those of the vehicle that never had them."""
    vehicle, plain = boosted(), small_construction()
    found = compute_vehicle(vehicle, 10.0)
    row = int(np.argmax(found.flight.time > 65.0))
    liquid = {"oxidizer": float(found.flight.liquid["oxidizer"][row])}
    other = mass_properties(plain, liquid)
    for name in ("mass", "center_of_gravity", "moment_of_inertia"):
        assert getattr(found.properties, name)[row] == pytest.approx(float(getattr(other, name)), rel=1e-9)
    edges = beam_edges(plain)
    beam = FreeBeam.of(plain, edges)
    frequency, shapes = beam.eigenmodes(mass_line(plain, edges, liquid), 2)
    modes = beam.scaled(frequency, shapes)
    order = np.argsort(found.modes.frequency[row])
    np.testing.assert_allclose(found.modes.frequency[row][order], modes.frequency, rtol=1e-9)
    np.testing.assert_allclose(found.modes.generalized_mass[row][order], modes.generalized_mass, rtol=1e-8)
    noses = [c.name == "booster noses" for c in vehicle.normal_force]
    slopes = np.array([np.interp(found.flight.mach, c.mach, c.slope) for c in vehicle.normal_force])
    slopes[np.ix_(np.flatnonzero(noses), np.flatnonzero(found.flight.time > 60.0))] = 0.0
    np.testing.assert_allclose(found.normal_force_slope, slopes.sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found.line.total(found.intensity), slopes.sum(axis=0), rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"propellant": 1e5}, "has 100000 kg in a motor, more than the 13854.*kg of a full cylinder"),
        ({"end": 1.0}, "ends at 1 m, not forward of its begin"),
        ({"distance": 0.2}, "stand 0.2 m off the axis, within their own radius of 0.6 m"),
        ({"density": 0.0}, "needs positive count, radius, density"),
    ],
)
def test_grains_that_cannot_be(changes, says):
    with pytest.raises(DataError, match=says):
        replace(GRAIN, **changes)


def test_jettisons_that_cannot_be():
    once = boosted().jettisons[0]
    with pytest.raises(UnknownNameError, match="no solid motor 'boster'; did you mean 'booster'"):
        boosted(jettisons=(replace(once, motors=("boster",)),))
    with pytest.raises(UnknownNameError, match="no item of masses 'booster case'; did you mean 'booster cases'"):
        boosted(jettisons=(replace(once, masses=("booster case",)),))
    with pytest.raises(DataError, match="drops no mass"):
        replace(once, masses=(), motors=())
    with pytest.raises(DataError, match="two drops of masses 'booster cases'"):
        boosted(jettisons=(once, replace(once, event="again", motors=(), normal_force=())))
    with pytest.raises(DataError, match="at 99 s does not lie between release and end_time_s"):
        boosted(jettisons=(replace(once, time=99.0),))
    short = boosted(jettisons=(replace(once, time=89.0),), engines=(motor(boosted().grains[0]),))
    with pytest.raises(DataError, match="comes after the last engines stop at 50 s"):
        fly(short)


# --- as files ---

MOTOR = """
[[solid_motors]]
name = "booster"
count = 2
gimballed = false
exit_area_m2 = 0.1
file = "construction/booster.csv"
grain = { begin_m = 3.0, end_m = 6.0, radius_m = 0.3, density_kg_m3 = 1750.0, distance_m = 1.2 }
propellant_kg = 900.0
burnout_event = "booster_burnout"
status = "assumed"
source = "made up"

[[jettisons]]
event = "booster_separation"
time_s = 45.0
masses = ["Booster cases"]
motors = ["booster"]
status = "assumed"
source = "made up"
"""
CURVE = """time [s],vacuum_thrust [N],mass_flow [kg/s],status,source
0,80000,30,assumed,made up
28,80000,30,assumed,made up
32,0,0,assumed,made up
"""


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "mine"
    shutil.copytree(find_vehicle("falcon1"), made)
    with (made / "construction.toml").open("a") as file:
        file.write(MOTOR)
    (made / "construction" / "booster.csv").write_text(CURVE)
    with (made / "construction" / "masses.csv").open("a") as file:
        file.write("Booster cases,3.0,7.0,160,1.1,assumed,made up\n")
    return made


def test_motors_are_read_from_a_folder(folder):
    vehicle = load_construction(folder)
    (grain,), group = vehicle.grains, vehicle.engines[-1]
    assert grain.propellant == 1800.0 and grain.count == 2 and grain.distance == 1.2
    assert group.solid and group.cutoff == 32.0 and group.draws == {"booster": 1.0}
    assert float(np.trapezoid(group.mass_flow, group.time)) == pytest.approx(900.0, rel=1e-12)
    assert vehicle.stores["Booster cases"] == 160.0
    assert folder / "construction" / "booster.csv" in construction_files(folder)


BAD = [
    ("construction.toml", "propellant_kg = 900.0", "propellant_kg = 950.0", "burns 900 kg from 0 to 32 s, .* 950"),
    ("construction.toml", "radius_m = 0.3,", "radius_m = 0.2,", r"solid_motors.booster'.*more than the 659.\d+ kg"),
    ("construction.toml", "end_m = 6.0", "end_m = 60.0", "grain 'booster' lies beyond the vehicle's ends"),
    ("construction.toml", "time_s = 45.0", "time_s = 450.0", "'booster_separation' at 450 s does not lie between"),
    ("construction.toml", '["Booster cases"]', '["Booster case"]', "no item of masses 'Booster case'; did you mean"),
    ("construction.toml", 'name = "booster"', 'name = "s1_lox"', "two tanks, motors or masses named 's1_lox'"),
    ("construction.toml", 'burnout_event = "booster_burnout"\n', "", "solid_motors.0.burnout_event': is missing"),
    ("construction/booster.csv", "0,80000,30", "5,80000,30", "line 2: begins with 80000 N .* a row of zeros"),
    ("construction/booster.csv", "28,80000,30", "28,-80000,30", "'vacuum_thrust', line 3: -80000 is not allowed"),
    ("construction/booster.csv", "[kg/s]", "[lb/s]", r"column 'mass_flow': unit is \[lb/s\]"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "says"), BAD)
def test_bad_motors_are_told(folder, file, old, new, says):
    text = (folder / file).read_text()
    head, _, tail = text.rpartition(old)
    assert head or tail
    (folder / file).write_text(head + new + tail)
    with pytest.raises(AscentwindError) as found:
        load_construction(folder)
    assert re.search(says, str(found.value)), str(found.value)
