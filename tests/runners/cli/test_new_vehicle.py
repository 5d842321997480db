"""A new vehicle with its own name, title, site, azimuth and month: options, questions, and what they change."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from ascentwind.model import load_vehicle
from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.errors import AscentwindError
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.cli import first_choices
from ascentwind.runners.cli.app import app
from ascentwind.runners.cli.first_choices import Choices, asked, site_of


def made(*arguments: str) -> str:
    found = CliRunner().invoke(app, ["new-vehicle", *arguments])
    if found.exception is not None and not isinstance(found.exception, SystemExit):
        raise found.exception
    assert found.exit_code == 0, found.output
    return found.output


def test_name_and_title_are_those_given(tmp_path):
    made(str(tmp_path / "mine"), "--from", "falcon1", "--name", "rocket_2", "--title", "Our rocket, first flight")
    vehicle = load_vehicle(tmp_path / "mine")
    assert (vehicle.name, vehicle.title) == ("rocket_2", "Our rocket, first flight")
    assert load_construction(tmp_path / "mine").name == "rocket_2"


@pytest.mark.slow
def test_azimuth_month_and_site_change_flight_and_wind(tmp_path):
    said = made(
        str(tmp_path / "mine"), "--from", "falcon1", "--azimuth", "80", "--month", "july", "--site", "Somewhere,28.4"
    )
    assert "tables built anew" in said and "the wind is still that of Cape Canaveral" in said
    vehicle, before = load_vehicle(tmp_path / "mine"), load_vehicle(find_vehicle("falcon1"))
    site = load_construction(tmp_path / "mine").site
    assert np.degrees([site.azimuth, site.latitude]) == pytest.approx([80.0, 28.4])
    record = vehicle.file.wind.record
    assert record is not None and (record.period, record.azimuth_deg, record.component) == ("july", 80.0, "meridional")
    speeds = [v.tables["relative_velocity"].values[-1] for v in (vehicle, before)]
    assert speeds[0] != speeds[1] and speeds[0] == pytest.approx(speeds[1], rel=0.01)


@pytest.mark.slow
def test_a_flight_that_cannot_be_built_costs_no_folder(tmp_path):
    """From the equator Falcon 1 passes the top of the atmosphere before the end of its tables."""
    said = made(str(tmp_path / "mine"), "--from", "falcon1", "--site", "Kourou,5.236")
    assert "the tables are still of the flight copied: the flight passes 81000 m" in said
    load_vehicle(tmp_path / "mine")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--name", "2nd"], "'2nd' is no name"),
        (["--title", 'my "best"'], "the title is one line of text"),
        (["--title", " "], "the title is one line of text"),
        (["--azimuth", "400"], "the azimuth is 400 deg"),
        (["--site", "Kourou,north"], "the site is 'Kourou,north'; write NAME or NAME,LATITUDE"),
        (["--site", "Kourou,100"], "the site's latitude is 100 deg"),
        (["--month", "juli"], "no month 'juli'; did you mean 'july'"),
        (["--azimuth", "0", "--month", "july"], "meridional"),  # which blows along a path towards the north
    ],
)
def test_bad_choices_leave_no_folder(tmp_path, arguments, says):
    with pytest.raises(AscentwindError, match=says):
        made(str(tmp_path / "mine"), "--from", "falcon1", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_a_site_has_a_name_and_perhaps_a_latitude():
    assert site_of("Cape Canaveral") == ("Cape Canaveral", None)
    assert site_of("Esrange, 67.89") == ("Esrange", 67.89)
    assert site_of(None) == (None, None)


@pytest.fixture
def answers(monkeypatch):
    """Somebody at the terminal, who answers in turn; returns the questions."""
    given, questions = [], []

    def prompt(text, **_):
        questions.append(text)
        return given.pop(0)

    monkeypatch.setattr(first_choices.typer, "prompt", prompt)
    for stream in ("stdin", "stdout"):
        monkeypatch.setattr(getattr(sys, stream), "isatty", lambda: True, raising=False)
    return given, questions


def test_what_was_not_given_is_asked_for(answers, tmp_path):
    given, questions = answers
    given += ["rocket", "", "Esrange,67.89", "12.5", "may"]
    assert asked(Choices(), tmp_path / "mine") == Choices("rocket", None, "Esrange", 67.89, 12.5, "may")
    assert [q.split()[0].rstrip(",") for q in questions] == ["name", "title", "site", "azimuth", "month"]
    given += ["", ""]
    questions.clear()
    known = Choices("rocket", None, "Esrange", 67.89, 12.5, None)
    assert asked(known, tmp_path / "mine") == known
    assert [q.split()[0].rstrip(",") for q in questions] == ["title", "month"]
    given += ["", "", "", "north", ""]
    with pytest.raises(AscentwindError, match="the azimuth is 'north'; give degrees"):
        asked(Choices(), tmp_path / "mine")


def test_nobody_is_asked_where_nobody_sits(tmp_path):
    assert asked(Choices(), tmp_path) == Choices()
