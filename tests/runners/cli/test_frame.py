"""What every command has: tables as JSON, a hint at the next command, and a word on an earlier run's files."""

from __future__ import annotations

import json
import re
import sys
from typing import Any

import numpy as np
import pytest
import typer
from scipy.io import savemat
from typer.core import TyperGroup

from ascentwind.runners.cli.app import app, main
from ascentwind.runners.cli.frame import NEXT, OWN_TEXT
from ascentwind.runners.present.terminal import in_json


def commands() -> dict[str, Any]:
    found = {}
    whole = typer.main.get_command(app)
    assert isinstance(whole, TyperGroup)
    for name, command in whole.commands.items():
        if isinstance(command, TyperGroup):
            found |= {f"{name} {inner}": c for inner, c in command.commands.items()}
        else:
            found[name] = command
    return found


COMMANDS = commands()


def test_every_command_has_json_and_a_hint():
    for name, command in COMMANDS.items():
        options = [option for p in command.params for option in p.opts]
        assert options.count("--json") == (name != "equations"), name
    assert set(NEXT) == set(COMMANDS)
    assert set(OWN_TEXT) <= set(COMMANDS)


@pytest.mark.parametrize(("name", "typed"), [(name, t) for name, told in NEXT.items() for t, _ in told])
def test_hints_name_commands_and_options_that_exist(name, typed):
    words = typed.split()
    following = " ".join(words[:2]) if words[0] == "wind" else words[0]
    assert following in COMMANDS
    options = {option for p in COMMANDS[following].params for option in p.opts}
    assert {w for w in words if w.startswith("--")} <= options
    places = set(re.findall(r"{(\w+)}", typed))
    known = {p.name for p in COMMANDS[name].params} | {"folder"} | ({"vehicle"} if name == "build-vehicle" else set())
    assert places <= known


@pytest.mark.parametrize(
    ("cell", "found"),
    [
        ("24.82 MN m", {"value": 24.82, "unit": "MN m"}),
        ("-180.2 kN", {"value": -180.2, "unit": "kN"}),
        ("+0.5267", 0.5267),
        ("1e-07", 1e-7),
        ("75 s", {"value": 75.0, "unit": "s"}),
        ("40 s*", {"value": 40.0, "unit": "s", "mark": "*"}),
        ("72°", {"value": 72.0, "unit": "°"}),
        ("0.00 %", {"value": 0.0, "unit": "%"}),
        ("293 kPa deg", {"value": 293.0, "unit": "kPa deg"}),
        ("mean - 3σ", "mean - 3σ"),
        ("10 - 150", "10 - 150"),
        ("3 cases of five", "3 cases of five"),
        ("", ""),
    ],
)
def test_cells(cell, found):
    assert in_json(cell) == found


@pytest.fixture
def ascentwind(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[str, str]:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        assert stop.value.code in (0, None), printed.err
        return printed.out, printed.err

    savemat("m.mat", {"time": [0.0, 10.0], "A": [[-0.5]], "B": [[3.0]], "C": [[1.0]]})
    (tmp_path / "s.toml").write_text('name = "lag"\ndata = "m.mat"\n[names]\noutputs = ["x"]\n')
    return run


def test_json_is_all_of_standard_output_and_says_the_closed_form(ascentwind, cache, tmp_path):
    out, err = ascentwind("run", "--system", "s.toml", "--times", "1,4", "--json")
    told = json.loads(out)
    (row,) = told["tables"][0]["rows"]
    assert row["response"] == "x"
    assert row["σ"] == pytest.approx(3 * np.sqrt(1 - np.exp(-4.0)), rel=1e-3)
    assert row["time"] == {"value": 4.0, "unit": "s", "mark": "*"} or row["time"] == {"value": 4.0, "unit": "s"}
    assert {f"lag-results/{name}" for name in told["files"]} == {
        str(p.relative_to(tmp_path)) for p in (tmp_path / "lag-results").iterdir() if p.name != "manifest.json"
    }
    assert "files in lag-results" in err
    out, _ = ascentwind("vehicles")
    assert "as504" in out and not out.startswith("{")  # the next command prints tables again


def test_a_second_run_says_what_becomes_of_the_first(ascentwind, cache):
    first, said = ascentwind("run", "--system", "s.toml", "--times", "1,4")
    assert "earlier" not in first
    assert "'ascentwind report lag-results' for one page of it" in said
    assert "sensitivity" not in said  # a system on disk is no vehicle
    second, _ = ascentwind("run", "--system", "s.toml", "--times", "1,2,4")
    assert "lag-results holds an earlier 'run': its 4 files are replaced" in second


def test_hints_leave_what_is_piped_alone(ascentwind):
    out, err = ascentwind("vehicles", "--json")
    assert {row["name"] for row in json.loads(out)["tables"][0]["rows"]} == {"as504", "falcon1"}
    assert "next: 'ascentwind run NAME'" in err


def test_every_option_says_what_it_is():
    silent = [f"{name} {p.name}" for name, c in COMMANDS.items() for p in c.params if hasattr(p, "help") and not p.help]
    assert silent == []


@pytest.mark.parametrize(("engine", "fine"), [(None, True), ("sweep", True), ("covariance", False)])
def test_figures_of_a_run_are_drawn_finely_where_that_costs_nothing(cache, engine, fine):
    from lag import lag

    from ascentwind.runners.cli.run import _drawn

    study = lag()
    statistics = study.response_statistics([1.0, 4.0], engine=engine)
    drawn = _drawn(study, statistics, [1.0, 4.0], None, 400)
    assert (drawn is not None and drawn.dataset.sizes["time"] > 100) == fine
