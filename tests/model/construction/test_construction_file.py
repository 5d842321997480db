"""construction.toml and its CSV files: AS-504's as published, and what bad input is told."""

from __future__ import annotations

import math
import shutil

import numpy as np
import pytest

from ascentwind.model.construction.construction_file import construction_files, load_construction
from ascentwind.model.construction.tank_shape import TankShape
from ascentwind.model.errors import AscentwindError, DataError
from ascentwind.model.vehicle.shipped import find_vehicle


@pytest.fixture(scope="module")
def as504():
    return load_construction(find_vehicle("as504"))


def test_tanks_hold_what_is_published(as504):
    """Volumes: S-IC 343 600 and 218 900 US gal (Technical Information Summary AS-507); S-IVB 2830 and 10 426 ft3."""
    volume = {tank.name: TankShape.of(tank).capacity for tank in as504.tanks}
    gallon, cubic_foot = 3.785411784e-3, 0.3048**3
    # The published S-IC figures leave out the ullage, 5 % of the LOX tank
    assert volume["sic_lox"] == pytest.approx(343_600 * gallon, rel=0.05)
    assert volume["sic_rp1"] == pytest.approx(218_900 * gallon, rel=0.006)
    assert volume["sivb_lox"] == pytest.approx(2830 * cubic_foot, rel=0.002)
    assert volume["sivb_lh2"] == pytest.approx(10_426 * cubic_foot, rel=0.002)


def test_levels_equal_another_persons_calculation(as504):
    """Stations of the free surface at release by a separate code for the same tanks (docs/construction.md)."""
    tanks = {tank.name: tank for tank in as504.tanks}
    for name, level, center in (("sic_lox", 36.7723, 28.7399), ("sic_rp1", 17.3596, 11.9991)):
        shape = TankShape.of(tanks[name])
        surface = shape.level(tanks[name].liquid / tanks[name].density)
        moments = shape.moments(surface)
        assert float(surface) == pytest.approx(level, abs=1e-4)
        assert moments[1] / moments[0] == pytest.approx(center, abs=1e-4)


def test_thrust_and_flow_of_as504(as504):
    """Total thrust 34.35 MN at lift-off and 40.05 MN before centre cutoff (MPR-SAT-FE-69-9, figure 5-3 as digitised)."""
    thrust = {}
    for time, pressure in ((0.3, 101_325.0), (134.3, 189.0)):
        thrust[time] = sum(
            g.count * (np.interp(time, g.time, g.vacuum_thrust) - g.exit_area * pressure) for g in as504.engines
        )
    assert thrust[0.3] == pytest.approx(34.35e6, rel=3e-3)
    assert thrust[134.3] == pytest.approx(40.05e6, rel=1e-3)
    outboard = next(g for g in as504.engines if g.gimballed)
    fine = np.linspace(0, 134.34, 5000)
    law = 2644 + 44 * (fine / 135) ** 3
    np.testing.assert_allclose(np.interp(fine, outboard.time, outboard.vacuum_thrust), 2981.2 * law, rtol=1e-4)
    assert sum(outboard.draws.values()) == pytest.approx(1.0)


def test_pitch_programme_of_as504(as504):
    """Pitch at times since time base 1, from Project Apollo - NASSP's evaluation of the same polynomials (rounded)."""
    published = {20: 1.11, 30: 3.68, 40: 8.0, 50: 13.96, 60: 20.9, 80: 35.2, 100: 47.4, 120: 56.7, 147: 65.18}
    for time, angle in published.items():
        row = next(r for r in as504.pitch.segments if r[0] <= time <= r[1])
        assert math.degrees(np.polynomial.polynomial.polyval(time, row[2:])) == pytest.approx(angle, abs=0.06)


def test_normal_force_slopes_sum_to_the_table(as504):
    """C_N_alpha at Mach 0, 1.2, 3 of the build-up (docs/data.md)."""
    for mach, slope in ((0.0, 3.917), (1.2, 4.78064), (3.0, 3.93912)):
        assert sum(np.interp(mach, c.mach, c.slope) for c in as504.normal_force) == pytest.approx(slope, abs=1e-4)


def test_every_file_is_found_once():
    files = construction_files(find_vehicle("as504"))
    assert [f.name for f in files[:3]] == ["construction.toml", "masses.csv", "stiffness.csv"]
    assert len(set(files)) == len(files) == 10
    assert all(f.is_file() for f in files)


TOML, MASSES, STIFF = "construction.toml", "construction/masses.csv", "construction/stiffness.csv"
ENGINE, PITCH = "construction/engine_center.csv", "construction/pitch.csv"
CASES = [
    ("slosh", TOML, 'slosh_method = "surface_radius"', 'slosh_methd = "potential"', "slosh_methd.*did you mean 'slosh_method'"),
    ("method", TOML, 'slosh_method = "surface_radius"', 'slosh_method = "sphere"', "slosh_method.*'potential'.*found 'sphere'"),
    ("tail", MASSES, "F-1 engines (5),-2.921", "F-1 engines (5),-9.5", "masses.csv, line 5: mass 'F-1 engines.*beyond the vehicle's ends at -3.048"),
    ("turned", MASSES, "IU,81.853024,82.767424", "IU,82.767424,81.853024", r"line \d+: mass 'IU' ends at 81.853 m, aft of its begin"),
    ("weightless", MASSES, "82.767424,1942,", "82.767424,0,", r"line \d+: mass 'IU' is 0 kg; give a positive mass"),
    ("letters", MASSES, "82.767424,1942,", "82.767424,heavy,", r"column 'mass', line \d+: 'heavy' is not a finite number"),
    ("unit", MASSES, "mass [kg]", "mass [lb]", r"column 'mass': unit is \[lb\], expected \[kg\]"),
    ("status", MASSES, "3.13,found", "3.13,measured", r"column 'status', line \d+: 'measured' is not a status"),
    ("nosource", MASSES, ",status,source", ",status,sauce [1]", "column 'source' is missing"),
    ("nounit", MASSES, "mass [kg]", "mass", "header 'mass' has no unit"),
    ("negative", STIFF, "3.8e+09", "-3.8e+09", r"stiffness.csv, column 'bending', line \d+: -3.8e\+09 is not positive"),
    ("order", STIFF, "71.9328", "69.5", r"stiffness.csv, column 'station', line \d+: .* comes after"),
    ("short", STIFF, "107.696", "107.0", "construction.toml: stiffness is given from -3.048 to 107 m, the vehicle reaches"),
    ("overfilled", TOML, "liquid_kg = 1444641.0", "liquid_kg = 1600000.0", "tank 'sic_lox' is overfilled: 1.6e.06 kg .* 1402 m3 of 1364 m3"),
    ("negative liquid", TOML, "liquid_kg = 1444641.0", "liquid_kg = -1.0", "tanks.0.liquid_kg"),
    ("ellipsoid", TOML, "semi_axis_m = 3.25", "semi_axis_m = 2.25", "tanks.sii_lox.*ellipsoid section .* reaches beyond its tips"),
    ("no axis", TOML, ", semi_axis_m = 3.256026", "", 'semi_axis_m belongs to kind = "ellipsoid"'),
    ("drawn", TOML, "draws = { sic_lox = 0.699, sic_rp1 = 0.301 }", "draws = { sic_lax = 0.699 }", "no tank 'sic_lax'; did you mean 'sic_lox'"),
    ("too much", TOML, "sic_rp1 = 0.301", "sic_rp1 = 0.401", "engine group 'outboard' needs positive draws with a sum of at most 1"),
    ("thrust", ENGINE, "0,7882292.8", "0,-7882292.8", r"engine_center.csv, column 'vacuum_thrust', line \d+"),
    ("gap", PITCH, "33.6,68.6", "34.6,68.6", r"pitch.csv, column 'begin', line 4: begins at 34.6 s where the row above ends at 33.6 s"),
    ("component", TOML, 'name = "fins"', 'name = "finz"', r"normal_force.csv: column 'finz \[1/rad\]' is missing; did you mean 'fins'"),
    ("arrest", TOML, "arrest_s = 147.0", "", "arrest_s is needed"),
    ("station", TOML, "load_stations_m = [25.0]", "load_stations_m = [125.0]", "load station 125 m is not on the vehicle"),
    ("file", TOML, "construction/drag.csv", "construction/dragg.csv", "dragg.csv: cannot be read"),
    ("tank order", TOML, 'kind = "cylinder", begin_m = 23.1648, end_m = 35.5854', 'kind = "cylinder", begin_m = 23.1648, end_m = 3.5', "tanks.sic_lox.*ends at 3.5 m, not forward of its begin"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "message"), [c[1:] for c in CASES], ids=[c[0] for c in CASES])
def test_bad_input_is_named(tmp_path, file, old, new, message):
    folder = tmp_path / "mine"
    shutil.copytree(find_vehicle("as504"), folder)
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1))
    with pytest.raises(AscentwindError, match=message):
        load_construction(folder)


def test_the_file_itself_may_be_missing(tmp_path):
    with pytest.raises(DataError, match=r"construction\.toml: cannot be read"):
        load_construction(tmp_path)
