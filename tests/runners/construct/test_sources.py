"""Structures from NASTRAN and workbooks: a bar solved apart from our beam, and what bad decks are told."""

from __future__ import annotations

import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from nastran_bar import MAPPING
from small_construction import small_construction

from ascentwind.model.construction.construction_file import (
    construction_files,
    load_construction,
    read_masses,
    read_modes,
    read_stiffness,
)
from ascentwind.model.construction.given_modes import GivenModes
from ascentwind.model.errors import DataError, ExtrapolationWarning, ModeError, OutputFolderError, PlausibilityWarning
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.model.wind.soundings.grids import MissingLibraryError
from ascentwind.runners.cli.app import main
from ascentwind.runners.construct.beam.beam import beam_modes
from ascentwind.runners.construct.beam.given import given_modes
from ascentwind.runners.construct.beam.modes import followed_modes
from ascentwind.runners.construct.mass.line import beam_edges, mass_line
from ascentwind.runners.construct.mass.properties import mass_properties
from ascentwind.runners.construct.sources.import_structure import import_structure
from ascentwind.runners.construct.sources.structure_lines import Structure, structure_tables
from ascentwind.runners.construct.vehicle_numbers import compute_vehicle

ENGINE = replace(small_construction().engines[0], draws={}, residual={})


@pytest.fixture(scope="module")
def bar():
    pytest.importorskip("pyNastran")
    from nastran_bar import solved

    return solved()


@pytest.fixture(scope="module", params=[".f06", ".op2"])
def imported(request, bar, tmp_path_factory):
    from nastran_bar import write_bar

    folder = tmp_path_factory.mktemp("bar")
    written, checks = import_structure(write_bar(folder, request.param, bar), folder / "out")
    assert [path.name for path in written] == ["masses.csv", "stiffness.csv", "modes.csv"]
    return folder / "out", checks


def built_of(folder: Path, **changes):
    parts = {"masses": read_masses(folder / "masses.csv"), "stiffness": read_stiffness(folder / "stiffness.csv")}
    return small_construction(tanks=(), engines=(ENGINE,), bending_modes=2, **(parts | changes))


def test_a_bar_has_the_modes_of_our_beam(bar, imported):
    """Frequencies and generalised masses of the deck, solved by other elements, within 0.1 % of our beam's."""
    folder, checks = imported
    vehicle, modes = built_of(folder), read_modes(folder / "modes.csv")
    np.testing.assert_allclose(modes.frequency[0], bar.radians[2:], rtol=1e-6)
    edges = beam_edges(vehicle)
    own = beam_modes(vehicle, mass_line(vehicle, edges, {}), edges, 2)
    np.testing.assert_allclose(modes.frequency[0], own.frequency, rtol=1e-3)
    np.testing.assert_allclose(modes.generalized_mass[0], own.generalized_mass, rtol=1e-3)
    for k in range(2):  # sign and size: 1 at the forward end, rotation as the slope
        there = np.interp(modes.station, own.x + vehicle.gimbal_station, own.displacement[k])
        np.testing.assert_allclose(modes.displacement[0, k], there, atol=2e-3)
        turned = np.interp(modes.station, own.x + vehicle.gimbal_station, own.rotation[k])
        np.testing.assert_allclose(modes.rotation[0, k], turned, atol=2e-3)
    assert checks[0] == "bar.bdf: 7130 kg, 151 grids from 0 to 30 m"
    assert all("Hz, forward end at" in sentence for sentence in checks[1:]) and len(checks) == 3


def test_masses_are_those_of_the_deck(imported):
    """6480 kg of bar and two lumps at 10 and 23 m, spread over 0.2 m; each has 200 kg m2 about its own axis."""
    vehicle = built_of(imported[0])
    found = mass_properties(vehicle, {})
    assert float(found.mass) == pytest.approx(7130.0, rel=1e-8)
    center = (6480 * 15 + 400 * 10 + 250 * 23) / 7130
    assert float(found.center_of_gravity) == pytest.approx(center - 2.0, rel=1e-8)
    inertia = 6480 * (30**2 / 12 + (15 - center) ** 2)
    inertia += 400 * (10 - center) ** 2 + 250 * (23 - center) ** 2 + 2 * 200 + 650 * 0.2**2 / 12
    assert float(found.moment_of_inertia) == pytest.approx(inertia, rel=1e-8)


def edited(folder: Path, name: str, old: str, new: str) -> None:
    text = (folder / name).read_text()
    assert old in text, (name, old)
    (folder / name).write_text(text.replace(old, new, 1))


BAD = [
    ("off the line", "bar.bdf", "GRID,7,,1200.0,0.", "GRID,7,,1200.0,40.", "bar.bdf: GRID 7 lies 0.04 m off the centr"),
    ("two at one place", "bar.bdf", "GRID,7,,1200.0", "GRID,7,,1000.0", "GRID 6 and GRID 7 lie at one station"),
    ("metres in the mapping", "mapping.toml", 'length = "mm"', 'length = "m"', "reach over 30000 m, 30000 m, but aft_"),
    ("kilograms in the mapping", "mapping.toml", 'mass = "t"', 'mass = "kg"', r"MAT1 1 has a E of 7e\+07 Pa .* mixes"),
    ("one material in kg", "bar.bdf", "0.3,2.7e-09", "0.3,2700.", r"MAT1 1 has a density of 2.7e\+15 kg/m3"),
    ("pascals", "bar.bdf", "MAT1,1,70000.0", "MAT1,1,7.+10", r"MAT1 1 has a E of 7e\+16 Pa .* mixes units"),
    ("a lump in kg", "bar.bdf", "CONM2,901,51,,0.4", "CONM2,901,51,,400.", "bar.bdf: has 406730 kg .* mass_kg .* 7130"),
    ("a lump elsewhere", "bar.bdf", "CONM2,901,51,", "GRID,900,,0.,0.,9.\nCONM2,901,900,", "CONM2 901 stands on GRID"),
    ("a lump aside", "bar.bdf", "CONM2,901,51,,0.4", "CONM2,901,51,,0.4,0.,0.,55.", "CONM2 901 lies 0.055 m off"),
    ("a gap", "bar.bdf", "CBAR,8,11,8,9,0.,1.,0.\n", "", "no CBAR or CBEAM joins GRID 8 to GRID 9"),
    ("a bar across", "bar.bdf", "CBAR,8,11,8,9,", "CBAR,8,11,8,10,", "CBAR 8 joins GRID 8 to GRID 10, .* no neigh"),
    ("a pin", "bar.bdf", "CBAR,8,11,8,9,0.,1.,0.", "CBAR,8,11,8,9,0.,1.,0.\n,5", "CBAR 8 has offsets or pins"),
    ("askew", "bar.bdf", "CBAR,8,11,8,9,0.,1.,0.", "CBAR,8,11,8,9,0.,1.,1.", "CBAR 8 has its planes askew"),
    ("a shell", "bar.bdf", "MAT1,", "CQUAD4,700,70,1,2,3,4\nPSHELL,70,1,1.\nMAT1,", "CQUAD4 700 is no beam; condense"),
    ("tied", "bar.bdf", "MAT1,", "RBE2,800,3,123456,9\nMAT1,", "RBE2 800 ties grids of the centreline together"),
    ("no such grid", "mapping.toml", '"1:151"', "1, 2, 999", "bar.bdf: has no GRID 999"),
    ("a range turned", "mapping.toml", '"1:151"', '"151:1"', "mapping.toml, column 'grids': '151:1' is no range"),
    ("lateral along", "mapping.toml", 'lateral = "z"', 'lateral = "-x"', "column 'lateral': lies along forward"),
    ("no deck", "mapping.toml", '"bar.bdf"', '"bat.bdf"', "bat.bdf: is not there"),
    ("no deck at all", "bar.bdf", "MAT1,1,", "MAT1,one,", r"bar.bdf: cannot be read by pyNastran \("),
    ("no mode", "mapping.toml", "[3, 4]", "[3, 9]", "bar.f06: has no mode 9; its modes: 1, 2, 3, 4"),
    ("a rigid mode", "mapping.toml", "[3, 4]", "[2, 3]", "bar.f06: mode 2 is a rigid-body mode"),
    ("in the other plane", "mapping.toml", 'lateral = "z"', 'lateral = "y"', "mode 3 has 0.00 of its motion in"),
    ("no results", "mapping.toml", '"bar.f06"', '"other.f06"', "other.f06: cannot be read"),
    ("another kind", "mapping.toml", '"bar.f06"', '"bar.bdf"', "bar.bdf: is neither .op2 nor .f06"),
    ("other masses", "bar.bdf", "CONM2,901,51,,0.4", "CONM2,901,116,,0.4", r"modes? 3 .* masses of bar.bdf"),
    ("stiffer", "bar.bdf", "MAT1,1,70000.0", "MAT1,1,80000.0", r"mode 4 has 80.* rad/s where its shape and bar"),
    ("letters", "bar.f06", "  3      G ", "  3      G   abc ", r"bar.f06, line \d+: 'abc' is"),
    ("mapping key", "mapping.toml", "mass_kg", "mass_lb", "mass_lb.*did you mean 'mass'"),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "says"), [c[1:] for c in BAD], ids=[c[0] for c in BAD])
def test_bad_decks_are_refused_by_file_and_card(tmp_path, bar, file, old, new, says):
    from nastran_bar import write_bar

    mapping = write_bar(tmp_path, ".f06", bar)
    edited(tmp_path, file, old, new)
    with pytest.raises(DataError, match=says) as found:
        import_structure(mapping, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert str(tmp_path) in str(found.value)


@pytest.mark.parametrize("suffix", [".f06", ".op2"])
def test_results_without_mode_shapes_are_refused(tmp_path, bar, suffix):
    from nastran_bar import write_bar

    mapping = write_bar(tmp_path, suffix, bar)
    results = tmp_path / f"bar{suffix}"
    if suffix == ".f06":
        results.write_text(results.read_text().partition("E I G E N V E C T O R")[0])
    else:
        results.write_bytes(results.read_bytes()[:40])
    with pytest.raises(
        DataError, match=rf"bar{suffix}: (holds no mode shapes; run SOL 103|cannot be read by pyNastran)"
    ):
        import_structure(mapping, tmp_path / "out")


def test_shapes_of_another_normalisation_and_sign_make_the_same_tables(tmp_path, bar):
    from nastran_bar import write_bar

    turned = replace(bar, displacement=-7 * bar.displacement, rotation=-7 * bar.rotation)
    texts = []
    for name, shapes in (("a", bar), ("b", turned)):
        mapping = write_bar(tmp_path / name, ".op2", shapes)  # no generalised masses, which would be others
        import_structure(mapping, tmp_path / name / "out")
        texts.append(read_modes(tmp_path / name / "out" / "modes.csv"))
    np.testing.assert_allclose(texts[0].displacement, texts[1].displacement, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(texts[0].generalized_mass, texts[1].generalized_mass, rtol=1e-6)
    mapping = write_bar(tmp_path / "c", ".f06", turned)  # unit generalised masses beside shapes of 49
    with pytest.raises(DataError, match=r"has a generalised mass of 1000 kg where its shape and bar.bdf give 49\d{3}"):
        import_structure(mapping, tmp_path / "c" / "out")


def test_tables_that_are_there_are_kept(tmp_path, bar):
    from nastran_bar import write_bar

    mapping = write_bar(tmp_path, ".f06", bar)
    (tmp_path / "masses.csv").write_text("mine")
    with pytest.raises(OutputFolderError, match=r"masses\.csv exists already"):
        import_structure(mapping, tmp_path)
    assert (tmp_path / "masses.csv").read_text() == "mine" and not (tmp_path / "modes.csv").exists()


# --- modes that others computed, in a vehicle ---


def own_modes(vehicle, times, liquid) -> GivenModes:
    """The vehicle's own modes as others would give them."""
    found = followed_modes(vehicle, times, liquid, 2)
    station = found.x + vehicle.gimbal_station
    station[[0, -1]] = vehicle.aft_end, vehicle.forward_end
    return GivenModes(
        np.asarray(times), station, found.frequency, found.generalized_mass, found.displacement, found.rotation
    )


def test_a_vehicle_with_its_own_modes_given_has_its_own_tables():
    """Modes at the rows of the flight, handed back: everything that rests on them comes out as before."""
    vehicle = small_construction()
    before = compute_vehicle(vehicle, 20.0)
    given = own_modes(vehicle, before.flight.time, before.flight.liquid)
    after = compute_vehicle(replace(vehicle, modes=given), 20.0)
    np.testing.assert_allclose(after.modes.frequency, before.modes.frequency, rtol=1e-12)
    np.testing.assert_allclose(after.modes.generalized_mass, before.modes.generalized_mass, rtol=1e-9)
    np.testing.assert_allclose(after.displacement, before.displacement, atol=1e-9)
    for a, b in zip(after.loads, before.loads, strict=True):
        np.testing.assert_allclose(a.bending, b.bending, atol=1e-7 * np.abs(b.bending).max())


def test_what_is_left_of_rigid_motion_is_taken_out():
    """Modes of other rows of the flight, linear between: none carries momentum, and loads close at both ends."""
    vehicle = small_construction()
    times, liquid = np.linspace(0.0, 80.0, 5), {"oxidizer": np.linspace(20000.0, 12000.0, 5)}
    with_modes = replace(vehicle, modes=own_modes(vehicle, times, liquid))
    rows = np.linspace(0.0, 80.0, 9)
    amounts = {"oxidizer": np.linspace(20000.0, 12000.0, 9)}
    found = given_modes(with_modes, rows, amounts)
    exact = followed_modes(vehicle, rows, amounts, 2)
    np.testing.assert_allclose(found.frequency, exact.frequency, rtol=5e-3)
    np.testing.assert_allclose(found.generalized_mass, exact.generalized_mass, rtol=1e-2)
    np.testing.assert_allclose(found.displacement, exact.displacement, atol=1e-2)
    line = mass_line(vehicle, found.x, amounts)
    middle = 0.5 * (found.displacement[..., 1:] + found.displacement[..., :-1])
    momentum = np.einsum("tke,te->tk", middle, line) / line.sum(axis=1)[:, None]
    assert np.abs(momentum).max() < 1e-12


TIMES, LIQUID = np.array([0.0, 80.0]), {"oxidizer": np.array([20000.0, 12000.0])}


@pytest.fixture(scope="module")
def given():
    return own_modes(small_construction(), TIMES, LIQUID)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            lambda m: {"generalized_mass": 2 * m.generalized_mass},
            r"mode [12] at 0 s has a generalised mass of .* masses give",
        ),
        (
            lambda m: {"displacement": m.displacement + 0.2},
            "mode [12] at 0 s (moves|turns) the vehicle's masses as a whole",
        ),
        (
            lambda m: {"displacement": np.stack([m.displacement[:, 0], m.displacement.mean(axis=1)], axis=1)},
            "modes 1 and 2 at 0 s are not orthogonal",
        ),
        (
            lambda m: {
                name: np.stack([getattr(m, name)[0], getattr(m, name)[1, ::-1]])
                for name in ("displacement", "rotation", "generalized_mass", "frequency")
            },
            r"mode [12] has another shape at 80 s than at the time before",
        ),
    ],
)
def test_modes_of_other_masses_are_refused(given, change, says):
    vehicle = replace(small_construction(), modes=replace(given, **change(given)))
    with pytest.raises(ModeError, match=says):
        given_modes(vehicle, TIMES, LIQUID)


def test_modes_that_hardly_fit_are_warned_of(given):
    vehicle = replace(small_construction(), modes=replace(given, frequency=1.4 * given.frequency))
    with pytest.warns(PlausibilityWarning, match=r"given modes have .* where a beam of the given stiffness has"):
        given_modes(vehicle, TIMES, LIQUID)
    vehicle = replace(small_construction(), modes=given)
    with pytest.warns(ExtrapolationWarning, match="modes are given from 0 to 80 s and held for 20 s"):
        given_modes(vehicle, np.array([0.0, 80.0, 100.0]), {"oxidizer": np.array([20000.0, 12000.0, 12000.0])})


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"bending_modes": 3}, "bending_modes.*is 3, but 2 modes are given"),
        ({"forward_end": 29.0, "load_stations": ()}, "."),
    ],
)
def test_modes_of_another_vehicle_are_refused(given, change, says):
    with pytest.raises(DataError, match=says):
        small_construction(modes=given, **change)


HEADER = "time [s],mode [1],frequency [rad/s],generalized_mass [kg],station [m],displacement [1],rotation [1/m]"
MODES = f"""{HEADER},status,source
0,1,6.0,100,0,2,-0.3,found,x
0,1,6.0,100,10,0,-0.2,found,x
0,1,6.0,100,20,-1,0.1,found,x
0,1,6.0,100,30,-2,0.3,found,x
"""


def test_a_table_of_modes_is_scaled(tmp_path):
    file = tmp_path / "modes.csv"
    file.write_text(MODES)
    found = read_modes(file)
    assert found.displacement[0, 0].tolist() == [-1, 0, 0.5, 1]
    assert found.generalized_mass[0, 0] == 25 and found.rotation[0, 0, 0] == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("0,1,6.0,100,20,-1,0.1,found,x\n", "", "needs? four stations"),
        (
            "0,1,6.0,100,20,-1",
            "0,2,6.0,100,20,-1",
            "has 4 rows; every mode from 1 to 2 takes a row at each of 1 times and 4",
        ),
        (
            "0,1,6.0,100,20,-1",
            "0,1,6.0,101,20,-1",
            r"column 'generalized_mass', line 4: differs from station to station",
        ),
        ("30,-2,", "30,0.001,", "mode 1 does not move the forward end"),
        ("0,1,6.0,100,20,-1", "0,-1,6.0,100,20,-1", "has 4 rows"),
    ],
)
def test_bad_tables_of_modes_are_told(tmp_path, old, new, says):
    file = tmp_path / "modes.csv"
    assert old in MODES
    file.write_text(MODES.replace(old, new))
    with pytest.raises(DataError, match=says) as found:
        read_modes(file)
    assert re.search(r"modes\.csv", str(found.value))


# --- workbooks ---


def book(folder: Path, sheets: dict[str, list[list]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets.items():
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    made.save(folder / "stick.xlsx")
    return folder / "stick.xlsx"


MASSES = [
    ["item", "begin [in]", "end [in]", "mass [lb]", "radius_of_gyration [in]"],
    ["engine", 0, 40, 2000, 10],
    [],
    ["shell", 40, 1181.1, 12000.0, "30"],
]
STIFFNESS = [
    ["item", "station [in]", "bending [lbf in2]", "shear [lbf]", "status", "source"],
    ["all", 0, 1e11, 1e8, "assumed", "by hand"],
    ["all", 1181.1, 5e10, 5e7, "assumed", "by hand"],
]


def test_a_workbook_in_inches_and_pounds(tmp_path):
    """1 lb = 0.45359237 kg, 1 in = 25.4 mm, 1 lbf = 4.4482216152605 N."""
    source = book(tmp_path, {"masses": MASSES, "stiffness": STIFFNESS, "notes": [["anything"]]})
    written, said = import_structure(source, tmp_path / "out")
    assert [path.name for path in written] == ["masses.csv", "stiffness.csv"]
    masses, stiffness = read_masses(written[0]), read_stiffness(written[1])
    assert [m.mass for m in masses] == pytest.approx([907.18474, 5443.10844], rel=1e-12)
    assert masses[1].end == pytest.approx(29.99994, rel=1e-12) and masses[1].radius == pytest.approx(0.762)
    assert stiffness.bending[0] == pytest.approx(1e11 * 4.4482216152605 * 0.0254**2, rel=1e-12)
    assert stiffness.shear[1] == pytest.approx(5e7 * 4.4482216152605, rel=1e-12)
    assert "converted: begin from in, end from in, mass from lb" in said[0] and said[-1].endswith("not read: notes")
    assert 'found,"stick.xlsx, sheet masses"' in written[0].read_text()


def changed(rows, row, column, value):
    copy = [list(r) for r in rows]
    copy[row][column] = value
    return copy


@pytest.mark.parametrize(
    ("sheets", "says"),
    [
        ({"mass": MASSES}, "has no sheet named masses, stiffness, modes"),
        (
            {"masses": changed(MASSES, 0, 3, "mass [stone]")},
            r"masses: mass', line 1: unit is \[stone\]; write one of \[kg\]",
        ),
        ({"masses": changed(MASSES, 0, 3, "mass")}, r"masses: mass', line 1: unit is \[\]"),
        (
            {"masses": changed(MASSES, 0, 3, "mas [lb]")},
            "masses: mas', line 1: is not a column here; did you mean 'mass'",
        ),
        ({"masses": changed(MASSES, 0, 3, "begin [m]")}, "masses: begin', line 1: stands twice"),
        ({"masses": changed(MASSES, 3, 3, "heavy")}, r"masses: mass', line 4: 'heavy' is not a finite number"),
        ({"masses": changed(MASSES, 3, 3, None)}, r"masses: mass', line 4: is empty, or a formula"),
        ({"masses": changed(MASSES, 3, 3, True)}, r"masses: mass', line 4: 'True' is not"),
        ({"masses": changed(MASSES, 3, 3, -5)}, r"stick.xlsx, column 'masses', line 4: mass 'shell' is -2.2\d+ kg"),
        ({"masses": changed(MASSES, 3, 0, "engine")}, r"masses: item', line 4: 'engine' stands in line 2 already"),
        ({"masses": changed(MASSES, 3, 0, None)}, r"masses: item', line 4: is empty; fill the cell"),
        (
            {"stiffness": changed(STIFFNESS, 2, 4, "measured")},
            r"stiffness: status', line 3: 'measured' is not a status",
        ),
        ({"stiffness": [STIFFNESS[1]]}, "stiffness"),
        ({"stiffness": []}, "stiffness', line 1: has no header in its first row"),
        (
            {"masses": changed(MASSES, 3, 3, "x"), "stiffness": changed(STIFFNESS, 2, 2, "y")},
            r"(?s)masses: mass', line 4: 'x'.*stiffness: bending', line 3: 'y'",
        ),
    ],
)
def test_bad_workbooks_are_told_by_sheet_and_row(tmp_path, sheets, says):
    with pytest.raises(DataError, match=says):
        import_structure(book(tmp_path, sheets), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_no_workbook_is_refused(tmp_path):
    pytest.importorskip("openpyxl")
    file = tmp_path / "stick.xlsx"
    file.write_text("a,b\n1,2\n")
    with pytest.raises(DataError, match=r"stick\.xlsx: is no \.xlsx workbook"):
        import_structure(file, tmp_path / "out")
    with pytest.raises(DataError, match=r"none\.xlsx: cannot be read"):
        import_structure(tmp_path / "none.xlsx", tmp_path / "out")
    with pytest.raises(DataError, match=r"stick\.txt: is neither a mapping file"):
        import_structure(tmp_path / "stick.txt", tmp_path / "out")


def test_a_missing_library_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    monkeypatch.setitem(sys.modules, "pyNastran", None)
    monkeypatch.setitem(sys.modules, "pyNastran.bdf.bdf", None)
    (tmp_path / "m.toml").write_text(MAPPING)
    for name, extra in (("stick.xlsx", "spreadsheet"), ("m.toml", "nastran")):
        with pytest.raises(MissingLibraryError, match=rf"pip install 'ascentwind\[{extra}\]'"):
            import_structure(tmp_path / name, tmp_path / "out")


def test_a_construction_names_its_modes(tmp_path):
    """Falcon 1 with modes as a file, each scaled by something else: they come back as the beam's own."""
    folder = tmp_path / "mine"
    shutil.copytree(find_vehicle("falcon1"), folder)
    vehicle = load_construction(folder)
    given = own_modes(vehicle, np.array([0.0, 155.0]), {})
    (folder / "construction" / "modes.csv").write_text(
        structure_tables(Structure((), (), given, "computed", "the beam"))["modes.csv"]
    )
    toml = folder / "construction.toml"
    toml.write_text(toml.read_text().replace("[drag]", '[modes]\nfile = "construction/modes.csv"\n\n[drag]', 1))
    modes = load_construction(folder).modes
    assert modes is not None and (folder / "construction" / "modes.csv") in construction_files(folder)
    np.testing.assert_allclose(modes.displacement, given.displacement, atol=1e-8)
    np.testing.assert_allclose(modes.generalized_mass, given.generalized_mass, rtol=1e-8)


def test_the_command_says_what_it_compared(tmp_path, bar, monkeypatch, capsys):
    from nastran_bar import write_bar

    mapping = write_bar(tmp_path, ".f06", bar)
    out = tmp_path / "out"
    monkeypatch.setattr(sys, "argv", ["ascentwind", "import-structure", str(mapping), "--out", str(out)])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    printed = capsys.readouterr().out
    assert f"mode 3: {bar.radians[2] / (2 * np.pi):.5g} Hz, forward end at" in printed and "3 files in" in printed
