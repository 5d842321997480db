"""Files as other programs leave them: separators, byte order marks, encodings, endless lines, deep nests."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from ascentwind.model.errors import DataError, OutputFolderError, PlausibilityWarning, SeveralDataErrors
from ascentwind.model.files.csv_table import read_csv_table
from ascentwind.model.tables import Table
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.vehicle_file import read_vehicle_file
from ascentwind.model.wind.filter_file import read_filter
from ascentwind.runners.cli.new_vehicle import copy_vehicle

GOOD = "time [s],mass [kg]\n0,5\n1,4\n"
HUGE = 200_000


@pytest.mark.parametrize(
    "content",
    [
        GOOD.encode("utf-8-sig"),
        GOOD.replace("\n", "\r\n").encode(),
        GOOD.replace("\n", "\r").encode(),
        b"# " + b"x" * HUGE + b"\n" + GOOD.encode(),
        b'# a comment, "with a quote left open\n' + GOOD.encode(),
        b'   # indented, "too\n\n' + GOOD.encode() + b"\n,,\n",
        GOOD.replace("\n", ",,\n").encode(),
        GOOD.replace("mass [kg]", "mass [kg],, ").encode(),
        b"# \x0c form feed \xe2\x80\xa8 line separator\n" + GOOD.encode(),
    ],
    ids=[
        "mark",
        "dos",
        "old mac",
        "long comment",
        "quote",
        "blank rows",
        "blank columns",
        "blank header",
        "separators",
    ],
)
def test_the_same_table(tmp_path, content):
    file = tmp_path / "table.csv"
    file.write_bytes(content)
    table = read_csv_table(file, "time", "s")
    np.testing.assert_array_equal(table.column("mass", "kg"), [5.0, 4.0])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (GOOD.replace(",", ";").encode(), "line 1: has its cells separated by ';'; save it with commas"),
        (GOOD.replace(",", "\t").encode(), "separated by tabs"),
        (GOOD.encode("utf-16"), "is UTF-16, not UTF-8 text; save it as UTF-8"),
        (GOOD.encode("utf-16-le"), "is binary or UTF-16, not UTF-8 text"),
        (GOOD.encode("utf-32"), "is UTF-32"),
        ("time [s],mass [kg]\n0,5\n1,4 µ\n".encode("latin-1"), r"line 3: is not UTF-8 text \(byte 0xb5\)"),
        (b"\x89PNG\r\n\x1a\n\0\0", "is binary"),
        (b"", "needs a header and at least two rows"),
        (b"\n,,\n#\n", "needs a header"),
        (GOOD.encode() + b"2," + b"9" * HUGE + b"\n", "line 4: cannot be read"),
        (GOOD.encode() + b"2," + b"9" * 5000 + b"\n", "line 4: '9999.*... is not a finite number|line 4: '9{57}"),
        (GOOD.encode() + b'2,"3\n3,4\n', "line 4: cannot be read"),
        (GOOD.encode() + b"2,,\n3,4,\n", "line 4: '' is not a finite number"),
        (GOOD.replace("mass [kg]", "").encode(), "line 1: a column without a header"),
        (b"time [s],mass [kg],[1]\n0,1,2\n1,2,3\n", r"line 1: header '\[1\]' has no unit"),
    ],
)
def test_what_is_no_table_is_said(tmp_path, content, message):
    file = tmp_path / "table.csv"
    file.write_bytes(content)
    with pytest.raises(DataError, match=message) as caught:
        read_csv_table(file, "time", "s")
    assert len(str(caught.value)) < 400 + len(str(file))


def test_all_errors_of_a_table_are_told_at_once(tmp_path):
    file = tmp_path / "table.csv"
    file.write_text("time [s],mass [kg]\n0,x\n1\n2,y\n" + "3,?\n" * 50)
    with pytest.raises(SeveralDataErrors, match="line 2: 'x'") as caught:
        read_csv_table(file, "time", "s")
    lines = str(caught.value).splitlines()
    assert [e.row for e in caught.value.errors[:3]] == [2, 3, 4]
    assert len(lines) == 21 and lines[-1] == "and 33 more"


def test_all_errors_of_a_vehicle_are_told_at_once(vehicle_folder):
    """In vehicle.toml first, then in all its tables together."""
    toml = vehicle_folder / "vehicle.toml"
    whole = toml.read_text()
    spoiled = whole.replace("damping = 0.01 ", "damping = -1 ", 1).replace("start_time_s", "start_tim_s", 1)
    toml.write_text(spoiled.replace("full_coupling", "full_copling", 1))
    with pytest.raises(SeveralDataErrors) as caught:
        load_vehicle(vehicle_folder)
    columns = [str(error.column) for error in caught.value.errors]
    assert sorted(columns) == sorted(["start_tim_s", "options.full_copling", "slosh.0.damping"])
    toml.write_text(whole.replace('["center_of_pressure"]', '["center_of_pressure", "center_of_pressure"]'))
    for name, old, new in (
        ("rigid_body.csv", "mass [kg]", "mass [lb]"),
        ("rigid_body.csv", "moment_of_inertia", "inertia"),
        ("trajectory.csv", "altitude [m]", "altitude [km]"),
    ):
        path = vehicle_folder / name
        path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SeveralDataErrors) as caught:
        load_vehicle(vehicle_folder)
    told = str(caught.value)
    for part in ("lists 'center_of_pressure' twice", "[lb]", "moment_of_inertia [kg m2]' is missing", "[km]"):
        assert part in told


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[noise.thrust]", "[noise.wind]", "noise.wind': is called as the source of the wind filter; rename it"),
        ("[noise.thrust]", "[noise.combined]", "noise.combined': is called as the sum over all sources"),
        ("[noise.thrust]", "[noise.wind_1]", "noise.wind_1': is called as a white noise of the wind filter"),
        ("[noise.thrust]", "[noise.tables]", "noise.tables': is called as the prefix of factors on tables"),
        ('name = "sic_lox"', 'name = "sensor"', "'sensor' is taken by the bending tables' columns at the sensor"),
        ('name = "sic_lox"', 'name = "rate_sic_rp1"', "two tanks make one state 'slosh_rate_sic_rp1'"),
        ('output = "bending_moment"', 'output = "engine_angle"', "'engine_angle' is taken by a response of every"),
        ('output = "bending_moment"', 'output = "statistics"', "'statistics' is taken by a file of the results"),
        ('output = "bending_moment"', 'output = "attitude_rate"', "taken by one of the load_components"),
        ("extra_outputs = []", 'extra_outputs = ["drift_rate", "drift_rate"]', "lists 'drift_rate' twice"),
        ("weighting_times_s = [", "weighting_times_s = [70, 70, ", "lists 70 twice"),
        ('["thrust", "control_thrust"]', '["thrust", "thrust"]', "noise.thrust.tables': lists 'thrust' twice"),
    ],
)
def test_names_that_stand_for_two_things(edit, old, new, message):
    with pytest.raises(DataError, match=message):
        load_vehicle(edit(old, new))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("format = " + "9" * 5000, "a number that cannot be read"),
        ("format = " + "[" * 5000 + "]" * 5000, "nests lists or tables too deep"),
        ("format = " + "{a=" * 5000 + "1" + "}" * 5000, "nests lists or tables too deep"),
        ("format." + "a." * 3000 + "b = 1", "format|nests"),
        ("start_time_s = 1" + "0" * 400, "start_time_s"),
        ("title = 'a\0b'", "binary or UTF-16"),
        ('title = "\\u0000"', "'title': holds a control character"),
    ],
)
def test_toml_beyond_reason_is_refused(tmp_path, content, message):
    file = tmp_path / "vehicle.toml"
    file.write_text(content)
    with pytest.raises(DataError, match=message) as caught:
        read_vehicle_file(file)
    assert len(str(caught.value)) < 12_000


def test_toml_with_a_byte_order_mark_is_read(vehicle_folder):
    toml = vehicle_folder / "vehicle.toml"
    toml.write_bytes(toml.read_bytes().decode().replace("\n", "\r\n").encode("utf-8-sig"))
    assert load_vehicle(vehicle_folder).name == "as504"


def test_table_whose_spline_leaves_the_range_of_numbers():
    x = np.arange(5.0)
    with pytest.raises(DataError, match=r"cannot be interpolated between 0 and 4: with values up to 1e\+308"):
        _ = Table("mass", "kg", x, np.array([1e308, -1e308, 1e308, -1e308, 1e308])).polynomial
    for interpolation in ("linear", "pchip"):
        with pytest.raises(DataError, match="leaves the range of numbers"):
            _ = Table("mass", "kg", 1e-10 * x, np.array([1, 1e308, 1, 1e308, 1]), interpolation).polynomial


KINKS = [[[10000.0]], 10000.0, ["a"], [None], [[1.0, 2.0]], [123.456], {"a": 1.0}, [True], "10000", None]


@pytest.mark.parametrize("kinks", KINKS)
def test_odd_kinks_of_a_filter_are_refused(vehicle_folder, kinks):
    file = vehicle_folder / "wind_march_zonal_filter.json"
    data = json.loads(file.read_text())
    data["kinks_m"] = kinks
    file.write_text(json.dumps(data))
    with pytest.raises(DataError, match="kink|is not a wind filter"):
        load_vehicle(vehicle_folder)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[" * 100_000, "nests lists too deep"),
        ('{"format": ' + "1" * 5000 + "}", "is not a wind filter|format"),
        ("[]", "is not a wind filter"),
        ("", "is not a wind filter"),
        ("\ufeff[]", "is not a wind filter"),
    ],
)
def test_json_beyond_reason_is_refused(tmp_path, content, message):
    file = tmp_path / "filter.json"
    file.write_text(content)
    with pytest.raises(DataError, match=message):
        read_filter(file)


def test_a_copy_inside_its_source_is_refused(vehicle_folder):
    before = sorted(p.name for p in vehicle_folder.iterdir())
    for inside in (vehicle_folder / "copy", vehicle_folder / "a" / "b", vehicle_folder / ".." / "vehicle" / "copy"):
        with pytest.raises(OutputFolderError, match="lies inside"):
            copy_vehicle(str(vehicle_folder), inside)
    assert sorted(p.name for p in vehicle_folder.iterdir()) == before


def test_rows_lost_from_the_middle_are_warned_of(vehicle_folder):
    file = vehicle_folder / "rigid_body.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join(line for line in lines if not re.match(r"(6|7)\d,", line)) + "\n")
    with pytest.warns(
        PlausibilityWarning, match=r"rigid_body.csv, line \d+: no rows between 59 and 80 s, where others are 1"
    ):
        load_vehicle(vehicle_folder)
