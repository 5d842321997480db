"""What may not be asked of a flight's load, and how it is said."""

from __future__ import annotations

import warnings

import casadi as ca
import numpy as np
import pytest
from maxima import ornstein_uhlenbeck

from ascentwind.model import define_system
from ascentwind.model.errors import (
    AscentwindError,
    DataError,
    DirectNoiseError,
    ParameterValueError,
    TimeRangeError,
    UnknownNameError,
)
from ascentwind.runners import Study
from ascentwind.runners.flight_load.limit_table import LimitError, Limits
from ascentwind.runners.flight_load.request import CertainPassageWarning, NoVarianceError


@pytest.fixture(scope="module")
def study() -> Study:
    return ornstein_uhlenbeck(end=4.0, mean=1.0)


@pytest.mark.parametrize(
    "window",
    [
        (-1.0, 2.0),
        (0.0, 4.5),
        (3.0, 1.0),
        (2.0, 2.0),
        (0.0, float("nan")),
        (0.0, float("inf")),
        (1.0,),
        (0.0, 1.0, 2.0),
        "0:4",
        5.0,
        (0.0, "x"),
        (None, 2.0),
        np.zeros((2, 2)),
    ],
)
def test_windows_off_the_flight_are_refused(study, window):
    with pytest.raises(TimeRangeError):
        study.flight_load("y", window)
    with pytest.raises(TimeRangeError):
        study.limit_passage(Limits.constant(5.0, "y", "1"), window)


def test_a_system_without_end_needs_a_window():
    x, n = ca.SX.sym("x"), ca.SX.sym("n")
    endless = Study.from_system(
        define_system("endless", time=ca.SX.sym("t"), states={"x": (x, n - x)}, noises={"n": n}, outputs={"x": x})
    )
    with pytest.raises(TimeRangeError, match="give a window"):
        endless.flight_load("x")
    assert endless.flight_load("x", (0.0, 1.0), 0.1, draws=200).window == (0.0, 1.0)


@pytest.mark.parametrize(
    "probabilities",
    [0.0, 1.0, -0.1, 2.0, float("nan"), float("inf"), "x", ["x"], [0.1, 1.0], [], None, [None], [0.1, float("nan")],
     True],
)  # fmt: skip
def test_probabilities_that_are_none_are_refused(study, probabilities):
    with pytest.raises(ParameterValueError):
        study.flight_load("y", probabilities=probabilities)


@pytest.mark.parametrize("draws", [0, -5, 99, 1e3, 200.5, "many", None, True, float("nan")])
def test_numbers_of_draws_that_are_none_are_refused(study, draws):
    with pytest.raises(ParameterValueError, match="draws"):
        study.flight_load("y", draws=draws)


@pytest.mark.parametrize("seed", [-1, 0.5, "x", None, True, float("nan")])
def test_seeds_that_are_none_are_refused(study, seed):
    with pytest.raises(ParameterValueError, match="seed"):
        study.flight_load("y", seed=seed)


@pytest.mark.parametrize("sides", ["top", "", None, 1, "Upper"])
def test_unknown_sides_are_refused(study, sides):
    with pytest.raises(UnknownNameError, match="sides"):
        study.flight_load("y", sides=sides)


def test_an_unknown_response_names_the_nearest(study):
    with pytest.raises(UnknownNameError, match="y"):
        study.flight_load("yy")


def still() -> Study:
    """A response that no noise reaches, one that white noise reaches directly, one of a state."""
    x, n, u = (ca.SX.sym(s) for s in ("x", "n", "u"))
    return Study.from_system(
        define_system(
            "still",
            time=ca.SX.sym("t"),
            states={"x": (x, n - x)},
            noises={"n": n},
            inputs={"u": (u, 2.0)},
            outputs={"known": 0 * x + u, "direct": x + n, "x": x},
            end=3.0,
        )
    )


def test_loads_without_odds_are_refused():
    study = still()
    with pytest.raises(NoVarianceError, match="'known'"):
        study.flight_load("known")
    with pytest.raises(NoVarianceError, match="known"):
        study.limit_passage(Limits.constant(5.0, "known", "1"))
    with pytest.raises(DirectNoiseError, match="direct"):
        study.flight_load("direct")
    with pytest.raises(DirectNoiseError, match="direct"):
        study.limit_passage(Limits.constant(5.0, "direct", "1"))


@pytest.mark.parametrize("limit", [0.0, -5.0, float("nan"), float("inf"), [3.0], True])
def test_limits_that_are_none_are_refused(study, limit):
    with pytest.raises(LimitError):
        study.flight_load("y", limit=limit)


def test_passage_without_a_limit_is_refused(study):
    with pytest.raises(LimitError, match="no limit of 'y' was given"):
        _ = study.flight_load("y", draws=200, probabilities=0.1).passage


FILES = {
    "ends before the window": ("time [s],y [1]\n0,5\n3,5\n", TimeRangeError, "given from 0 to 3 s"),
    "begins after the window": ("time [s],y [1]\n1,5\n4,5\n", TimeRangeError, "given from 1 to 4 s"),
    "another unit": ("time [s],y [m]\n0,5\n4,5\n", LimitError, r"\[m\], expected \[1\]"),
    "no unit": ("time [s],y\n0,5\n4,5\n", DataError, "y"),
    "time in minutes": ("time [min],y [1]\n0,5\n4,5\n", DataError, r"\[s\]"),
    "negative": ("time [s],y [1]\n0,5\n4,-5\n", LimitError, "-5 is no limit"),
    "zero": ("time [s],y [1]\n0,5\n4,0\n", LimitError, "0 is no limit"),
    "not a number": ("time [s],y [1]\n0,5\n4,nan\n", DataError, "nan"),
    "infinite": ("time [s],y [1]\n0,5\n4,inf\n", DataError, "inf"),
    "text": ("time [s],y [1]\n0,5\n4,much\n", DataError, "much"),
    "a gap": ("time [s],y [1]\n0,5\n2,\n4,5\n", DataError, "line 3"),
    "twice the same time": ("time [s],y [1]\n0,5\n2,5\n2,6\n4,5\n", DataError, "line 4"),
    "not sorted": ("time [s],y [1]\n0,5\n3,5\n2,6\n4,5\n", DataError, "line 4"),
    "one row": ("time [s],y [1]\n0,5\n", DataError, "two"),
    "only a header": ("time [s],y [1]\n", DataError, "limit.csv"),
    "empty": ("", DataError, "empty"),
    "no response": ("time [s]\n0\n4\n", DataError, "holds no limit"),
    "no time": ("when [s],y [1]\n0,5\n4,5\n", DataError, "time"),
    "another response": ("time [s],z [1]\n0,5\n4,5\n", UnknownNameError, "'y'"),
    "the same response twice": ("time [s],y [1],y [1]\n0,5,5\n4,5,5\n", DataError, "y"),
    "over stations": ("station [m],y [1]\n0,5\n4,5\n", DataError, "limit_passage"),
    "stations missing at a time": ("time [s],station [m],y [1]\n0,0,5\n0,1,5\n4,0,5\n", DataError, "station 1 m"),
    "a station twice": ("time [s],station [m],y [1]\n0,0,5\n0,0,5\n4,0,5\n", DataError, "twice"),
    "stations out of order": ("time [s],station [m],y [1]\n0,1,5\n0,0,5\n4,0,5\n4,1,5\n", DataError, "order"),
}


@pytest.mark.parametrize("case", FILES)
def test_limit_files_that_cannot_be_used_are_refused(study, tmp_path, case):
    text, error, message = FILES[case]
    file = tmp_path / "limit.csv"
    file.write_text(text)
    with pytest.raises(error, match=message):
        study.flight_load("y", limit=file)
    with pytest.raises(AscentwindError):
        study.limit_passage(file)


def test_a_limit_file_that_is_not_there_is_named(study, tmp_path):
    for missing in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(DataError, match=missing.name):
            study.flight_load("y", limit=missing)


@pytest.mark.parametrize("limits", [3.0, None, ["limit.csv"], True])
def test_tables_of_limits_that_are_none_are_refused(study, limits):
    with pytest.raises(LimitError):
        study.limit_passage(limits)


@pytest.mark.parametrize(
    ("time", "values"),
    [
        ([0.0, 4.0], {"y": [5.0]}),
        ([4.0, 0.0], {"y": [5.0, 5.0]}),
        ([0.0, float("nan")], {"y": [5.0, 5.0]}),
        ([0.0, float("inf")], {"y": [5.0, 5.0]}),
        ([[0.0, 4.0]], {"y": [5.0, 5.0]}),
        ([0.0], {"y": [5.0]}),
        ([0.0, 4.0], {}),
        ([0.0, 4.0], {"y": [5.0, float("nan")]}),
        ([0.0, 4.0], {"y": ["a", "b"]}),
        (["a", "b"], {"y": [5.0, 5.0]}),
        (None, {"y": [5.0, 5.0]}),
    ],
)
def test_limits_over_time_that_cannot_be_used_are_refused(time, values):
    with pytest.raises(LimitError):
        Limits.over_time(time, values, {"y": "1"})


def test_a_limit_without_its_unit_is_refused(study):
    with pytest.raises(LimitError, match="unit"):
        Limits.over_time([0.0, 4.0], {"y": [5.0, 5.0]}, {})


def test_a_limit_below_the_mean_is_said_and_nearly_always_passed(study, tmp_path):
    """The mean is one: 0.9 is below it; a limit that dips below it for a while too."""
    with pytest.warns(CertainPassageWarning, match="below its mean at 0 s"):
        found = study.flight_load("y", limit=0.9, draws=400).passage.probability
    assert 0.5 < found.value <= 1.0
    file = tmp_path / "limit.csv"
    file.write_text("time [s],y [1]\n0,5\n1.9,5\n2,0.5\n2.1,5\n4,5\n")
    with pytest.warns(CertainPassageWarning, match="below its mean at 1.99"):
        found = study.limit_passage(file, draws=400).probability
    assert 0.5 < found.value <= 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        high = study.flight_load("y", limit=40.0, draws=400).passage
        assert 0.0 <= high.probability.value < 1e-200
        assert high.margin_of_safety > 5


def test_a_probability_that_was_not_asked_for_names_those_that_were(study):
    load = study.flight_load("y", probabilities=[0.1, 0.01], draws=200)
    for ask in (load.number_of, load.sensitivity):
        with pytest.raises(ParameterValueError, match=r"0\.1, 0\.01"):
            ask(0.2)
