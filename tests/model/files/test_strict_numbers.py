"""A number is a number: nothing else that Python would take for one passes, in any file or option."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ascentwind.model.errors import AscentwindError, DataError, TimeRangeError
from ascentwind.model.files.numbers import parse_number
from ascentwind.model.files.toml_file import validated
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.wind.filter_file import read_filter
from ascentwind.runners.case.times import parse_time_or_peak, parse_times
from ascentwind.runners.cli.terminal import parse_changes
from ascentwind.runners.design.file import DesignEntry
from ascentwind.runners.parameter_study.plan import read_plan

AS504 = built_in_vehicles()["as504"]
NO_NUMBERS = [
    *("true", "yes", "1_000", "\uff11\uff12", "\u0663", "nan", "inf", "-Infinity", "1e999"),
    *("0x10", "1,5", "1 2", "", "1e", "--1"),
]


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_text_that_is_no_number(text):
    with pytest.raises(ValueError):
        parse_number(text)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_is_read_back(value):
    assert parse_number(repr(value)) == value
    assert parse_number(f" {value:+.17g} ") == value


@given(st.text(alphabet="0123456789+-.eE_ \u0661\uff11", max_size=8))
def test_what_passes_is_what_a_float_of_plain_digits_is(text):
    try:
        found = parse_number(text)
    except ValueError:
        return
    assert found == float(text) and text.isascii() and "_" not in text


@pytest.mark.parametrize("cell", NO_NUMBERS)
def test_cells_of_tables(edit, cell):
    quoted = f'"{cell}"'
    folder = edit("\n0,1,1", f"\n0,{quoted},1", "control_gains.csv")
    message = f"control_gains.csv, column 'attitude_factor', line .*'{re.escape(cell)}' is not a finite number"
    with pytest.raises(DataError, match=message):
        load_vehicle(folder)


WRONG_TYPES = [
    ("start_time_s = 10.0", "start_time_s = true", "start_time_s.*valid number .found True"),
    ("start_time_s = 10.0", 'start_time_s = "10"', "start_time_s.*valid number .found '10'"),
    ("format = 1", "format = true", "'format': should be 1 .found True"),
    ("format = 1", 'format = "1"', "'format'"),
    ("full_coupling = false", "full_coupling = 0", "options.full_coupling.*valid boolean"),
    ("full_coupling = false", 'full_coupling = "no"', "options.full_coupling.*valid boolean"),
    ("numerator = [1188.87]", 'numerator = ["1188.87"]', "control.T3.numerator.0.*valid number"),
    ("sigma = 0.01", 'sigma = "0.01"', "noise.thrust.sigma.*valid number"),
    ("weighting_times_s = [65.0,", "weighting_times_s = [nan,", "weighting_times_s.0.*finite"),
    ("center_engine_cutoff = 134.34", "center_engine_cutoff = true", "events.center_engine_cutoff.*valid number"),
    ('title = "', 'title = 5 # "', "'title'.*valid string"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), WRONG_TYPES)
def test_values_of_vehicle_toml(edit, old, new, message):
    with pytest.raises(DataError, match=message):
        load_vehicle(edit(old, new))


def test_toml_writes_its_own_numbers_as_it_likes(edit):
    """1_000 and 1e1 are numbers of TOML."""
    assert load_vehicle(edit("start_time_s = 10.0", "start_time_s = 1_0")).start == 10.0


@pytest.mark.parametrize("change", ['start_time_s="11"', "start_time_s=true", "options.full_coupling=1"])
def test_changes_on_the_command_line(change):
    with pytest.raises(DataError, match="valid number|valid boolean"):
        load_vehicle(AS504, parse_changes([change]))


def test_one_change_holds_one_value():
    with pytest.raises(DataError, match="more than one TOML value"):
        parse_changes(["start_time_s=11\nformat = 2"])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"format": 1', '"format": true'),
        ('"format": 1', '"format": 1, "name": "twice"'),
        *(
            (r'("altitude_m": \[)[^,]*', rf"\g<1>{word}")
            for word in ("true", '"3"', "NaN", "1e999", "null", "1" + "0" * 400)
        ),
    ],
)
def test_numbers_of_a_filter(tmp_path, old, new):
    text = (AS504 / "wind_march_zonal_filter.json").read_text()
    changed = re.sub(old, new, text, count=1)
    assert changed != text
    (tmp_path / "filter.json").write_text(changed)
    with pytest.raises(DataError, match="filter.json: "):
        read_filter(tmp_path / "filter.json")


GRID = {"format": 1, "title": "t", "grid": {"quantity": [{"name": "mass", "values": [0.9, 1.1]}]}}
DISPERSION = {"format": 1, "title": "t", "dispersion": {"members": 8, "seed": 1, "quantity": [
    {"name": "mass", "distribution": "normal", "sigma": 0.1}]}}  # fmt: skip


@pytest.mark.parametrize("value", [True, "0.9", None, float("nan")])
def test_values_of_a_plan(value):
    plan = {**GRID, "grid": {"quantity": [{"name": "mass", "values": [value, 1.1]}]}}
    with pytest.raises(DataError, match="grid.quantity.0.values.0"):
        read_plan(plan)


@pytest.mark.parametrize("members", [True, "8", 8.5])
def test_members_of_a_plan(members):
    with pytest.raises(DataError, match="dispersion.members"):
        read_plan({**DISPERSION, "dispersion": {**DISPERSION["dispersion"], "members": members}})


def test_numbers_that_a_plan_takes():
    """TOML's 1e4, NumPy's arrays and integers."""
    plan = read_plan({**DISPERSION, "dispersion": {**DISPERSION["dispersion"], "members": 1e4, "seed": np.int64(3)}})
    assert plan.dispersion is not None and (plan.dispersion.members, plan.dispersion.seed) == (10_000, 3)
    grid = read_plan({**GRID, "grid": {"quantity": [{"name": "mass", "values": np.linspace(0.9, 1.1, 3)}]}}).grid
    assert grid is not None and grid.quantity[0].axis() == pytest.approx([0.9, 1.0, 1.1])


def test_values_of_a_design():
    with pytest.raises(DataError, match="parameters.gain.1"):
        validated({"format": 1, "times": "40:50:5", "parameters": {"gain": [0.0, "1"]}}, DesignEntry)


@pytest.mark.parametrize("text", ["1_0:20:5", "\uff110", "nan", "40,inf", "1e999"])
def test_times(text):
    with pytest.raises(TimeRangeError):
        parse_times(text)
    with pytest.raises(AscentwindError):
        parse_time_or_peak(text)
