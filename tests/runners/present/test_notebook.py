"""Results show themselves in notebooks: short, without script, and with what is markup in a name as text."""

from __future__ import annotations

import importlib
from html import escape

import pytest
from lag import lag, plan

from ascentwind.runners.present.notebook import html_of

LARGEST = 20_000  # characters
SHOWN = (
    "flight_load.load.FlightLoad", "flight_load.passage.Passage", "measured_winds.day_of_launch.DayOfLaunch",
    "measured_winds.fly.FlownWinds", "statistics.resultants.Resultants", "statistics.results.ResponseStatistics",
    "gusts.search.GustSweep", "design_wind.design_wind.DesignWind", "parameter_study.run.ParameterStudy",
    "design.design.DesignResult", "wind.synthesis.result.SynthesisResult", "study.Study",
)  # fmt: skip


@pytest.mark.parametrize("name", SHOWN)
def test_results_have_text_and_html_of_their_own(name):
    module, _, kind = name.rpartition(".")
    found = getattr(importlib.import_module(f"ascentwind.runners.{module}"), kind)
    assert callable(found._repr_html_)
    assert "__repr__" in {n for base in found.__mro__[:-1] for n in vars(base)}


def checked(result: object) -> str:
    page = result._repr_html_()  # pyright: ignore
    assert len(page) < LARGEST
    assert "<script" not in page
    assert len(repr(result)) < LARGEST / 4
    return page


def test_the_load_of_a_flight(cache):
    load = lag().flight_load("x", (10.0, 20.0))
    assert f"{load.levels[0].value:.5g}" in checked(load)


def test_a_parameter_study(tmp_path, cache):
    from ascentwind import run_parameter_study

    values = {"quantity": [{"name": "tau", "values": [2.0, 3.0]}]}
    found = run_parameter_study(plan(times="1,2", grid=values), tmp_path, study=lag())
    page = checked(found)
    assert "tau" in page and "2, 1 to 2 s" in page


def test_many_lines_are_counted_and_markup_stays_text():
    page = html_of("\n  ".join(["heading <b>", *(f"line {k}: <script>alert({k})</script>" for k in range(500))]))
    assert len(page) < LARGEST
    assert "470 more" in page
    assert "<script" not in page and "<b>" not in page
    assert escape("heading <b>") in page
