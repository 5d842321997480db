"""Limits as people write them: what is read, what is refused, and what they are between their rows."""

from __future__ import annotations

import re
import sys

import numpy as np
import pytest
from lag import lag

import ascentwind as aw
from ascentwind.model.errors import AscentwindError, DataError, TimeRangeError
from ascentwind.runners.cli.app import main
from ascentwind.runners.flight_load.limit_table import LimitError, Limits

GOOD = "time [s],bending_moment [N m]\n40,3e7\n100,2e7\n"
BOTH = "time [s],station [m],bending_moment [N m]\n40,0,1\n40,20,3\n100,0,2\n100,20,6\n"

# text of a file, and what its error must say
BAD = {
    "nothing": ("", "is empty"),
    "comments": ("# a\n", "is empty"),
    "header": ("time [s],bending_moment [N m]\n", "two rows"),
    "one row": ("time [s],bending_moment [N m]\n40,3e7\n", "two rows"),
    "no axis": ("tme [s],bending_moment [N m]\n40,1\n41,1\n", "neither a column .* did you mean 'time'"),
    "no limit": ("time [s]\n40\n100\n", "holds no limit"),
    "no unit": ("time [s],bending_moment\n40,1\n100,1\n", "bending_moment' has no unit"),
    "no unit of time": ("time,bending_moment [N m]\n40,1\n100,1\n", "'time' has no unit"),
    "minutes": ("time [min],bending_moment [N m]\n40,1\n100,1\n", r"\[min\], expected \[s\]"),
    "repeated": (GOOD + "100,1\n", "line 4: 100 repeats the row above"),
    "backward": (GOOD + "90,1\n", "line 4: 90 comes after 100"),
    "twice": ("time [s],bending_moment [N m],bending_moment [N m]\n40,1,1\n100,1,1\n", "twice in the header"),
    "text": (GOOD.replace("2e7", "much"), "column 'bending_moment', line 3: 'much' is not a finite number"),
    "nan": (GOOD.replace("2e7", "nan"), "line 3: 'nan' is not a finite number"),
    "inf": (GOOD.replace("2e7", "inf"), "line 3: 'inf' is not a finite number"),
    "missing": (GOOD.replace("2e7", ""), "line 3"),
    "ragged": (GOOD + "110,1,1\n", "line 4: has 3 cells"),
    "negative": (GOOD.replace("2e7", "-2e7"), "column 'bending_moment', line 3: -2e.07 is no limit"),
    "zero": (GOOD.replace("3e7", "0"), "column 'bending_moment', line 2: 0 is no limit"),
    "semicolons": (GOOD.replace(",", ";"), "separated by ';'"),
    "a gap": (BOTH.replace("100,20,6\n", "100,30,6\n"), "t = 100 s: has no limit for station 20 m"),
    "station twice": (BOTH.replace("100,20,6\n", "100,0,6\n100,20,6\n"), "line 5.*station 0 m stands twice"),
    "stations down": (BOTH.replace("40,0,1\n40,20,3", "40,20,3\n40,0,1"), "increasing order"),
    "by station first": ("station [m],time [s],bending_moment [N m]\n0,40,1\n0,100,2\n20,40,3\n20,100,6\n", "line 4"),
    "one time": ("time [s],station [m],bending_moment [N m]\n40,0,1\n40,20,3\n", "two values of it"),
}  # fmt: skip


def write(folder, text: str | bytes):
    file = folder / "limit.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused_and_named(case, tmp_path):
    text, why = BAD[case]
    with pytest.raises(DataError, match=why) as told:
        Limits.read(write(tmp_path, text))
    assert "limit.csv" in str(told.value)


def test_all_bad_values_of_a_file_are_told_at_once(tmp_path):
    file = write(tmp_path, "time [s],a [N],b [N]\n1,0,1\n2,1,-3\n3,1,1\n")
    with pytest.raises(DataError) as told:
        Limits.read(file)
    assert all(text in str(told.value) for text in ("column 'a', line 2", "column 'b', line 3"))


@pytest.mark.parametrize(
    "text", ["\ufeff" + GOOD, GOOD.replace("\n", "\r\n"), "# where from\n" + GOOD, GOOD + "\n,,\n"]
)
def test_what_spreadsheets_write_is_read(text, tmp_path):
    limits = Limits.read(write(tmp_path, text))
    np.testing.assert_array_equal(limits.values["bending_moment"], [[3e7], [2e7]])


@pytest.mark.parametrize("spoil", ["none", "folder", "utf16"])
def test_what_is_no_file_is_refused(spoil, tmp_path):
    file = tmp_path / "limit.csv"
    if spoil == "folder":
        file.mkdir()
    elif spoil == "utf16":
        file.write_bytes(GOOD.encode("utf-16"))
    with pytest.raises(DataError, match=r"limit\.csv"):
        Limits.read(file)


def test_between_rows_a_limit_is_straight(tmp_path):
    limits = Limits.read(write(tmp_path, BOTH))
    np.testing.assert_array_equal(limits.time, [40, 100])
    np.testing.assert_array_equal(limits.station, [0, 20])
    found = limits.of("bending_moment", "N m", np.array([40.0, 55.0, 100.0]))
    np.testing.assert_allclose(found, [[1, 3], [1.25, 3.75], [2, 6]], rtol=1e-15)
    everywhere = Limits.constant(5.0, "x", "m").of("x", "m", np.array([-3.0, 1e9]))
    np.testing.assert_array_equal(everywhere, [[5.0], [5.0]])


def test_outside_its_rows_a_limit_is_refused(tmp_path):
    limits = Limits.read(write(tmp_path, GOOD))
    for window in ([39.9, 90.0], [50.0, 100.1]):
        with pytest.raises(TimeRangeError, match="is given from 40 to 100 s"):
            limits.of("bending_moment", "N m", np.array(window))
    with pytest.raises(LimitError, match=r"unit is \[N m\], expected \[kN m\]"):
        limits.of("bending_moment", "kN m", np.array([50.0]))


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), "much", [1.0, 2.0], {}, True])
def test_numbers_that_are_no_limit(as504, value):
    with pytest.raises(AscentwindError):
        as504.flight_load("bending_moment", (70.0, 72.0), limit=value)


@pytest.mark.parametrize(
    ("time", "values", "units", "why"),
    [
        ([1.0, 2.0], {}, {}, "holds no limit"),
        ([1.0, 2.0], {"x": [1.0, 2.0, 3.0]}, {"x": "m"}, "shape"),
        ([1.0, 2.0], {"x": [1.0, 2.0]}, {}, "has no unit"),
        ([1.0, 2.0], {"x": [1.0, np.inf]}, {"x": "m"}, "inf is no limit"),
        ([1.0, np.nan], {"x": [1.0, 2.0]}, {"x": "m"}, "increasing"),
        ([2.0, 1.0], {"x": [1.0, 2.0]}, {"x": "m"}, "increasing"),
        ([1.0], {"x": [1.0]}, {"x": "m"}, "two values"),
        (["a", "b"], {"x": [1.0, 2.0]}, {"x": "m"}, "no numbers"),
        ([1.0, 2.0], {"x": ["a", 2.0]}, {"x": "m"}, "no numbers"),
        ([1.0, 2.0], {"x": [[1.0], [2.0, 3.0]]}, {"x": "m"}, "no numbers"),
    ],
)
def test_tables_that_are_no_limits(time, values, units, why):
    with pytest.raises(LimitError, match=why):
        aw.Limits.over_time(time, values, units)


@pytest.fixture
def refused(monkeypatch, capsys, tmp_path):
    """Run the command line, which must refuse with exit code 2 and leave no folder; return what it said."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["ascentwind", "flight-load", "as504", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        assert stop.value.code == 2, printed
        assert "Traceback" not in printed.err
        assert not (tmp_path / "as504-flight-load").exists()
        return " ".join((printed.err + printed.out).split())

    return run


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (GOOD.replace("bending_moment", "bending_momnet"), "column 'bending_momnet': .*did you mean 'bending_moment'"),
        (GOOD.replace("N m", "kN m"), r"column 'bending_moment': unit is \[kN m\], expected \[N m\]"),
        (GOOD.replace("100", "99"), "given from 40 to 99 s and asked for from 40 to 100 s"),
        (GOOD.replace("2e7", "-1"), "line 3: -1 is no limit"),
        ("station [m],bending_moment [N m]\n900,3e7\n990,2e7\n", "between which the vehicle has no station"),
        ("station [m],angle_of_attack [rad]\n0,1\n60,1\n", "no such load along the vehicle; known: bending_moment"),
        ("time [s],a [N],engine_angel [rad]\n40,1,1\n100,1,1\n", "column 'a'.*column 'engine_angel'.*'engine_angle'"),
    ],
)  # fmt: skip
def test_limits_that_the_vehicle_has_not(refused, tmp_path, text, why):
    said = refused("--window", "40:100", "--limit", str(write(tmp_path, text)))
    assert "limit.csv" in said
    assert re.search(why, said), said


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--window", "40"], "'40' is no window; write BEGIN:END"),
        (["--window", "40:100:1"], "is no window"),
        (["--window", "a:b"], "is no window"),
        (["--window", "nan:100"], "is no window"),
        (["--window", "100:40"], "ends at 40 s, not after"),
        (["--window", "40:40"], "ends at 40 s, not after"),
        (["--window", "40:1000"], "1000"),
        (["--window", "-5:40"], "-5"),
        (["--probability", "0"], "between 0 and 1"),
        (["--probability", "1"], "between 0 and 1"),
        (["--probability", "much"], "much"),
        (["--sides", "bth"], "did you mean 'both'"),
        (["--draws", "5"], "draws = 5"),
        (["--wind-error", "-0.1"], "a spread of -0.1 is none"),
        (["--wind-error", "0.5"], "would change the sign"),
        (["--draws", "1.5"], "1.5"),
        (["--seed", "-1"], "seed = -1"),
        (["--response", "bending_momnet"], "did you mean 'bending_moment'"),
        (["--limit", "none.csv"], "none.csv"),
        (["--set", "weighting_times_s=[70]"], "weighting_times_s is not used here"),
    ],
)  # fmt: skip
def test_options_that_cannot_be(refused, arguments, why):
    assert why in refused(*arguments)


def test_limits_over_stations_of_what_has_none(cache, vehicle_folder, tmp_path):
    limits = Limits.read(write(tmp_path, "station [m],bending_moment [N m]\n0,3e7\n60,2e7\n"))
    toml = vehicle_folder / "vehicle.toml"
    text = toml.read_text()
    first, last = text.index("[tables.loads_along_vehicle]"), text.index("[tables.shear_along_vehicle]")
    toml.write_text(text[:first] + text[last:])
    with pytest.raises(DataError, match="along the vehicle needs it; 'ascentwind build-vehicle'"):
        aw.Study.load(vehicle_folder, compile=False).limit_passage(limits, (40.0, 100.0))
    with pytest.raises(aw.errors.NoVehicleError):
        lag().limit_passage(limits, (0.0, 1.0))
    with pytest.raises(LimitError, match="ask with Study.limit_passage"):
        aw.Study.load("as504").flight_load("bending_moment", limit=limits)


@pytest.mark.parametrize("limits", [5.0, None, ["a"], {"bending_moment": 3e7}])
def test_what_is_no_table_of_limits(as504, limits):
    with pytest.raises(LimitError, match="give a file or aw.Limits"):
        as504.limit_passage(limits)


def test_a_limit_of_another_response_is_told(refused, tmp_path):
    file = str(write(tmp_path, GOOD))
    assert "holds no limit of engine_angle" in refused(
        "--window", "40:100", "--response", "engine_angle", "--limit", file
    )
