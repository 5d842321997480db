"""Bad input to turbulence, zones, gusts and design winds, through Python and by the command: typed, never a number."""

from __future__ import annotations

import math
from typing import Any

import pytest
from planes import in_both
from typer.testing import CliRunner

import ascentwind as aw
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.app import app
from ascentwind.runners.flight_load.request import NoVarianceError

AS504 = built_in_vehicles()["as504"]
NAN, INF = math.nan, math.inf
ODD = (NAN, INF, -INF, "far", True, [2000.0], {})  # what is no number in every place that takes one

NOT_NUMBERS = {
    "wind.turbulence.high_pass_m": (0, -2000.0, 1e-300, 0.5, 30_001.0, 1e9, *ODD),
    "wind.turbulence.length_m": (0, -500.0, 1e-9, 1e9, *ODD),
    "wind.turbulence.correlation": (-1.0, 1.0, 2.0, *ODD),
    "wind.turbulence.severity": (-1, 0, "mild", "Moderate", "", *ODD),
    "wind.turbulence.form": ("drydn", 3, *ODD),
    "options.gust_zones": (0, -1, 2.5, 27, 200, 10**9, *ODD),
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in NOT_NUMBERS.items() for value in values])
def test_keys_of_the_vehicle(key, value):
    """Every one is refused when the vehicle is read, by the name of its key."""
    of_turbulence = {} if key.endswith("severity") or "zones" in key else {"wind.turbulence.severity": "moderate"}
    with pytest.raises(aw.errors.AscentwindError) as caught:
        aw.load_vehicle(AS504, changes=of_turbulence | {key: value})
    assert key in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("wind.turbulence.severity=-1", "'light', 'moderate' or 'severe'"),
        ("wind.turbulence.severity=mild", "'light', 'moderate' or 'severe'"),
        ("options.gust_zones=0", "greater than or equal to 1"),
        ("options.gust_zones=200", "take fewer zones"),
        ("options.gust_zones=nan", "integer"),
        ("options.gust_zones=true", "integer"),
    ],
)
def test_keys_by_the_command(setting, says):
    found = CliRunner().invoke(app, ["gust", "as504", "--set", setting])
    assert isinstance(found.exception, aw.errors.AscentwindError)
    assert says in str(found.exception)


def test_a_high_pass_by_the_command():
    settings = ("wind.turbulence.severity=moderate", "wind.turbulence.high_pass_m=1e6")
    found = CliRunner().invoke(app, ["gust", "as504", *(part for s in settings for part in ("--set", s))])
    assert isinstance(found.exception, aw.errors.DataError)
    assert "more than the 29997 m that the wind's statistics cover" in str(found.exception)


def gust(**asked: Any):
    """Ask for the response to one gust, of which something is changed."""
    asked = {"gust": aw.OneMinusCosine(), "start_altitude": 8000.0, "times": [70.0]} | asked
    return lambda study: study.gust_response(
        asked.pop("gust"), asked.pop("start_altitude"), asked.pop("times"), **asked
    )


def behind(**asked: Any):
    """Ask for a design wind, of which something is changed."""
    asked = {"response": "bending_moment", "time": 70.0} | asked
    return lambda study: study.design_wind(asked.pop("response"), asked.pop("time"), **asked)


def sweep(**asked: Any):
    return lambda study: study.gust_sweep(**asked)


GUST, VALUE, TIME, NAME = "GustError", "ParameterValueError", "TimeRangeError", "UnknownNameError"
QUESTIONS = [
    # a gust that starts where the flight is not
    *((gust(start_altitude=x), GUST, "below the ground") for x in (-1e-6, -1e6)),
    (gust(start_altitude=0.0), GUST, "below the start"),
    (gust(start_altitude=1e7), GUST, "never met"),
    *((gust(start_altitude=x), GUST, "cannot start at") for x in (NAN, INF, "high", True, [8000.0], None)),
    # one longer than the flight, or none
    (gust(gust=aw.OneMinusCosine(1e7)), GUST, "longer than the flight"),
    (sweep(lengths=[60.0, 1e7]), GUST, "longer than the flight"),
    *((gust(gust=x), GUST, "is no gust") for x in ("quasi-square", None, 9.0, aw.QuasiSquare)),
    *((sweep(gust=x), GUST, "is no gust") for x in ("quasi-square", 9.0, aw.QuasiSquare)),
    # lengths
    (sweep(lengths=[]), VALUE, "no length"),
    *((sweep(lengths=x), VALUE, "no list of lengths") for x in ("long", ["long"], 60.0, [None], [[60.0]])),
    *((sweep(lengths=[x]), GUST, "length of a gust") for x in (NAN, INF)),
    *((sweep(lengths=[x]), GUST, "no extent") for x in (0.0, -60.0)),
    # times before the start, and none
    *((gust(times=[x]), TIME, "before the start") for x in (5.0, -70.0, 70e-3)),
    (gust(times=[1e4]), TIME, "beyond"),
    *((gust(times=x), TIME, "") for x in ([NAN], [INF], ["soon"], [True], [[70.0]], [])),
    *((sweep(times=x), TIME, "") for x in ([5.0], [NAN], ["soon"], [])),
    # responses
    *((gust(responses=x), NAME, "") for x in (["bending_momentum"], ["bending_moment", ""], [3])),
    (sweep(responses=["bending_momentum"]), NAME, "bending_moment"),
    *((ask(responses=[]), VALUE, "no response") for ask in (gust, sweep)),
    # directions belong to both planes
    (gust(direction=1.0), VALUE, "no direction but its sign"),
    *((gust(direction=x), VALUE, "cannot blow towards") for x in (NAN, INF, "east", True, [1.0])),
    # design winds
    *((behind(time=x), TIME, "before the start") for x in (5.0, -70.0)),
    *((behind(time=x), TIME, "") for x in (None, NAN, INF, "soon", True, [70.0], 1e4)),
    *((behind(sigmas=x), VALUE, "sigmas") for x in (NAN, INF, -INF, "3", True, [3.0], None)),
    *((behind(combined=x), VALUE, "neither true nor false") for x in (1, "yes", None)),
    *((behind(response=x), VALUE, "one response by name") for x in (3, None, ["bending_moment"], True)),
    (behind(response="bending_momentum"), NAME, "bending_moment"),
    (behind(response="resultant_bending_moment"), "PlanesError", "resultant_bending_moment"),
]


@pytest.mark.parametrize(("ask", "error", "says"), QUESTIONS)
def test_questions(as504, ask, error, says):
    with pytest.raises(aw.errors.AscentwindError, match=says) as caught:
        ask(as504)
    assert type(caught.value).__name__ == error


def test_a_load_that_the_wind_does_not_reach(as504):
    with pytest.raises(NoVarianceError, match="the wind does not reach 'axial_force'"):
        as504.design_wind("axial_force", 70.0)
    found = as504.gust_sweep(times=[70.0], responses=["axial_force"], lengths=[60.0])
    assert found.worst("axial_force").value == 0.0
    with pytest.raises(aw.errors.UnknownNameError, match="response of the sweep"):
        found.worst("bending_moment")


@pytest.mark.parametrize("sigmas", [-3.0, -1e-9, 0, 0.0])
def test_the_other_side_is_allowed_and_said(as504, sigmas):
    found = as504.design_wind("angle_of_attack", 30.0, sigmas=sigmas)
    assert found.load <= found.mean_response
    assert found.side in repr(found)
    assert found.side == ("below the mean" if sigmas < 0 else "the mean itself: the mean wind")


@pytest.mark.parametrize("shape", [aw.OneMinusCosine, aw.QuasiSquare, aw.RampAndHold])
@pytest.mark.parametrize("value", [*ODD, None, 10**400, 1j], ids=str)
def test_sizes_of_gusts(shape, value):
    for name in ("length", "amplitude", *(["edge"] if shape is aw.QuasiSquare else [])):
        with pytest.raises(aw.errors.AscentwindError, match=r"^the (length|amplitude|edges)"):
            shape(**{name: value})


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        (["--length", "1e7"], GUST, "longer than the flight"),
        (["--length", "-60"], GUST, "no extent"),
        (["--amplitude", "0"], GUST, "blows nothing"),
        (["--times", "5"], TIME, "before the start"),
        (["--times", "soon"], TIME, ""),
        (["--response", "bending_momentum"], NAME, "bending_moment"),
        (["--shape", "square"], NAME, "quasi-square"),
    ],
)
def test_questions_by_the_command(as504, arguments, error, says, tmp_path):
    found = CliRunner().invoke(app, ["gust", "as504", "--out", str(tmp_path / "out"), *arguments])
    assert type(found.exception).__name__ == error
    assert says in str(found.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("word", ["--length", "--amplitude"])
@pytest.mark.parametrize("value", ["nan", "inf", "long", ""])
def test_no_numbers_by_the_command(word, value):
    found = CliRunner().invoke(app, ["gust", "as504", word, value])
    assert found.exit_code != 0
    assert found.exception is None or isinstance(found.exception, aw.errors.AscentwindError | SystemExit)


def test_zones_of_a_plane_with_forces_of_its_own(vehicle_folder):
    """One table tells the normal force along the vehicle, which cannot be that of two."""
    toml = vehicle_folder / "vehicle.toml"
    toml.write_text(
        toml.read_text() + '\n[pitch.tables.aerodynamics]\nfile = "aerodynamics.csv"\nstatus = "computed"\n'
        'source = "of this test"\n'
    )
    with pytest.raises(aw.errors.DataError, match=r"one normal force for both planes, but \[pitch\]"):
        aw.load_vehicle(vehicle_folder, changes={"planes": "both", "options.gust_zones": 5})


def test_directions_in_both_planes():
    study = aw.Study.from_vehicle(in_both(), compile=False)
    for direction, says in (
        (None, "blows in some direction"),
        (90.0, "degrees"),
        (NAN, "cannot blow"),
        (True, "cannot"),
    ):
        with pytest.raises(aw.errors.ParameterValueError, match=says):
            study.gust_response(aw.OneMinusCosine(), 8000.0, [70.0], direction=direction)
    with pytest.raises(aw.errors.UnknownNameError, match="response or resultant"):
        study.design_wind("resultant_bending_momentum", 70.0)
