"""Nothing of a construction counts twice, lies off the vehicle, or has a size that contradicts another."""

from __future__ import annotations

import shutil
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_construction import small_construction

from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.errors import DataError, ExtrapolationWarning, PlausibilityWarning
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.construct.ascent.limits import check_held

SHIPPED = built_in_vehicles()
TOML = "construction.toml"


@pytest.mark.parametrize("vehicle", SHIPPED)
def test_shipped_constructions_pass_without_a_word(vehicle):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_construction(SHIPPED[vehicle])


def copied(folder: Path) -> Path:
    shutil.copytree(SHIPPED["falcon1"], folder / "mine")
    return folder / "mine"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[[normal_force]]", "'normal_force': has two parts named 'nose'; remove or rename one"),
        ("[[tanks]]", "'tanks': has two tanks named 's1_lox'"),
        ("[[engines]]", "'engines': has two groups named"),
    ],
)
def test_an_entry_pasted_twice(tmp_path, table, message):
    toml = copied(tmp_path) / TOML
    head, *parts = toml.read_text().split(f"{table}\n")
    toml.write_text(table.join([f"{head}", *(f"\n{p}" for p in [parts[0], *parts])]))
    with pytest.raises(DataError, match=message):
        load_construction(toml.parent)


def test_a_mass_pasted_twice_names_both_lines(tmp_path):
    file = copied(tmp_path) / "construction" / "masses.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines, lines[-1]]) + "\n")
    with pytest.raises(DataError, match=rf"'item', line {len(lines) + 1}: '.*' stands in line {len(lines)} already"):
        load_construction(file.parents[1])


def repeated(field: str, **changes):
    """A construction whose first entry of a list stands twice, the second time changed."""
    base = small_construction()
    first, *others = getattr(base, field)
    return {field: (first, replace(first, **changes), *others)}


def doubled_section():
    tank = small_construction().tanks[0]
    return {"tanks": (replace(tank, sections=(*tank.sections, tank.sections[0])),)}


def stiffness(*stations):
    base = small_construction().stiffness
    n = len(stations)
    return {"stiffness": replace(base, station=np.array(stations), bending=np.full(n, 4e8), shear=np.full(n, 3e8))}


REFUSED = {
    "tank renamed": (lambda: repeated("tanks", name="fuel"), "'oxidizer' and 'fuel', the same in all but their names"),
    "part renamed": (lambda: repeated("normal_force", name="tip"), "'nose' and 'tip', the same in all but their names"),
    "mass": (lambda: repeated("masses"), "two items named 'engines'"),
    "engine": (lambda: repeated("engines"), "two groups named 'main'"),
    "cutoff": (lambda: repeated("engines", name="other"), "both call their cutoff 'main_engine_cutoff'"),
    "section": (doubled_section, r"tanks.oxidizer.sections.*two sections alike"),
    "load station": (lambda: {"load_stations": (12.0, 12.0)}, "two stations at 12 m"),
    "stiffness": (lambda: stiffness(0.0, 3.0, 3.0, 3.0, 30.0), "3 m of the stiffness stands more than twice"),
    "gimbal": (lambda: {"gimbal_station": 9999.0}, "'gimbal_station_m': 9999 m lies beyond the vehicle's ends"),
    "sensor": (lambda: {"sensor_station": -24.0}, "'sensor_station_m': -24 m lies beyond"),
    "ends": (lambda: {"aft_end": 30.0, "forward_end": 0.0}, "aft of aft_end_m = 30 m"),
    "part": (
        lambda: {
            "normal_force": (replace(small_construction().normal_force[0], station=np.array([2.5, 27.0, 9999.0])),)
        },
        r"normal_force.nose.station_m.*9999 m lies beyond",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_construction_cannot_mean(case):
    changes, message = REFUSED[case]
    with pytest.raises(DataError, match=message):
        small_construction(**changes())


def test_groups_cut_off_at_one_command_may_share_its_event():
    base = small_construction().engines[0]
    pair = (replace(base, cutoff=80.0), replace(base, name="other", cutoff=80.0))
    assert len(small_construction(engines=pair).engines) == 2


SIZES = {
    "thrust in kN": ("construction/engine.csv", ",404857,", ",404.857,", DataError, "a specific impulse of 0.304 s"),
    "flow in t/s": ("construction/engine.csv", ",135.804,", ",0.135804,", DataError, "a specific impulse of 3.04e"),
    "flow in lb/s": ("construction/engine.csv", ",135.804,", ",299.4,", PlausibilityWarning, "specific impulse of 137"),
    "flow twice": ("construction/engine.csv", ",135.804,", ",435.804,", PlausibilityWarning, "impulse of 94"),
    "area in cm2": (TOML, "reference_area_m2 = 2.21793", "reference_area_m2 = 22179.3", DataError, "widest tank has"),
    "area in ft2": (TOML, "reference_area_m2 = 2.21793", "reference_area_m2 = 23.9", PlausibilityWarning, "widest"),
    "density in g/cm3": (TOML, "density_kg_m3 = 806.0", "density_kg_m3 = 0.806", DataError, "overfilled|no propellant"),
    "density in lb/ft3": (TOML, "density_kg_m3 = 1141.0\nliquid_kg = 2371.0",
                          "density_kg_m3 = 11410.0\nliquid_kg = 2371.0", PlausibilityWarning, "no propellant has"),
    "liquid in t": (TOML, "liquid_kg = 14885.0", "liquid_kg = 14.885", PlausibilityWarning, "of what the tank holds"),
    "altitude in km": (TOML, "altitude_m = 10.0", "altitude_m = 16000.0", PlausibilityWarning, "no flight begins"),
    "shear in kN": ("construction/stiffness.csv", ",250000000,", ",2500,", PlausibilityWarning, "thin wall of"),
    "shear and bending swapped": ("construction/stiffness.csv", "bending [N m2],shear [N]", "shear [N],bending [N m2]",
                                  PlausibilityWarning, "thin walls of at most"),
    "drag in another area": ("construction/drag.csv", "1.1,0.6,", "1.1,1.97,", PlausibilityWarning, "of 1.97[;,]"),
    "gyration in mm": ("construction/masses.csv", ",470,0.4,", ",470,400,", PlausibilityWarning, "radius of gyration"),
    "a mass lost": ("construction/masses.csv", 'cones",20.75688,', 'cones",21.6,', PlausibilityWarning,
                    "nothing between 20.7569 and 21.6 m"),
    "mach in m/s": ("construction/drag.csv", "\n15,", "\n5100,", PlausibilityWarning, "goes up to Mach 5100"),
    "half of one propellant": (TOML, "liquid_kg = 6765.0", "liquid_kg = 3400.0", PlausibilityWarning,
                               "lasts for 77.* s in s1_rp1 and 157.* s in s1_lox"),
    "propellant from nowhere": (TOML, "s1_lox = 0.6875", "s1_lox = 0.5875", PlausibilityWarning, "0.9 of the flow"),
    "pitch uprange": ("construction/pitch.csv", "\n20,1.83,", "\n20,-1.83,", PlausibilityWarning, "uprange"),
    "pitch that jumps": ("construction/pitch.csv", "\n0,0,", "\n0,4,", PlausibilityWarning, "jumps from the vertical"),
    "part that is not placed": ("construction/normal_force.csv", "over [1/rad]", "over [1/rad],fins [1/rad]",
                                DataError, r"no \[\[normal_force\]\] of construction.toml places"),
    "arrest": (TOML, 'kind = "gravity_turn" ', 'kind = "table"\narrest_s = 30.0 ', DataError, "ends at 20 s"),
}  # fmt: skip


@pytest.mark.parametrize("case", SIZES)
def test_sizes_that_contradict_each_other(tmp_path, case):
    file, old, new, kind, message = SIZES[case]
    path = copied(tmp_path) / file
    text = path.read_text()
    assert old in text
    changed = text.replace(old, new)
    if case == "part that is not placed":
        changed = changed.replace(",assumed,", ",0.1,assumed,")
    path.write_text(changed)
    if kind is DataError:
        with pytest.raises(DataError, match=message):
            load_construction(tmp_path / "mine")
    else:
        with pytest.warns(PlausibilityWarning, match=message):
            load_construction(tmp_path / "mine")


def test_a_section_that_was_lost(tmp_path):
    """The column of its slope is still there."""
    toml = copied(tmp_path) / TOML
    head, *parts = toml.read_text().split("[[normal_force]]\n")
    toml.write_text("[[normal_force]]\n".join([head, *parts[:-1]]))
    with pytest.raises(
        DataError, match=r"normal_force.csv, column 'carry_over': is a part of the normal force that no"
    ):
        load_construction(toml.parent)


def test_rows_of_the_stiffness_that_were_lost(tmp_path):
    """From the thrust frame to the fairing without a row."""
    file = copied(tmp_path) / "construction" / "stiffness.csv"
    lines = file.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("aft skirt"))
    last = next(i for i, line in enumerate(lines) if line.startswith("upper-stage forward"))
    file.write_text("\n".join(lines[:first] + lines[last:]) + "\n")
    with pytest.warns(PlausibilityWarning, match="no row between 3.38582 m of 'thrust frame' and 18.7706 m of 'upper"):
        load_construction(file.parents[1])


def test_thrust_held_beyond_its_table():
    """A curve that ends at 100 s, held for 55 s more, is refused; half a second is told, and rounding is not."""
    group = replace(small_construction().engines[0], time=np.array([0.0, 100.0]))
    with pytest.raises(DataError, match=r"t = 100 s: engines 'main' burn from 0 to 155 s, .* from 0 to 100 s .* 55 s"):
        check_held(group, 0.0, 155.0)
    with pytest.warns(ExtrapolationWarning, match=r"held for 0\.5 s"):
        check_held(group, 0.0, 100.5)
    with pytest.raises(DataError, match=r"t = -20 s"):
        check_held(group, -20.0, 90.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_held(group, 0.0, 100.1)
