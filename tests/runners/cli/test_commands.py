"""What all commands have in common: changes by --set, the version, completion, and files imported when asked for."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

import ascentwind
from ascentwind.runners import Study
from ascentwind.runners.cli.app import app
from ascentwind.runners.cli.commands import FILES

DESIGN = """format = 1
vehicle = "as504"
times = "70,75"
[parameters]
"control.T1.gain" = [0.9, 1.1]
"""
STUDY = """format = 1
title = "gains"
vehicle = "as504"
times = "70,75"
[dispersion]
members = 2
seed = 1
[[dispersion.quantity]]
name = "gain"
parameters = ["control.T1.gain"]
relative = true
distribution = "normal"
sigma = 0.1
"""
TAKE_CHANGES = [
    ["run", "as504"],
    ["verify", "as504"],
    ["tolerance", "as504"],
    ["sensitivity", "as504"],
    ["mean", "as504"],
    ["flight-load", "as504"],
    ["gust", "as504"],
    ["fly", "as504", "wind.csv"],
    ["export", "as504", "--format", "c"],
    ["availability", "as504", "--limit", "limit.csv"],
    ["day-of-launch", "as504", "--sounding", "wind.csv", "--hours-before", "3", "--limit", "limit.csv"],
    ["inspect", "as504", "--time", "70"],
    ["equations"],
    ["regenerate", "as504"],
    ["design", "design.toml"],
    ["study", "study.toml"],
    ["wind", "compare", "as504"],
]


class Asked(Exception):
    """Ends a command where it loads its vehicle."""


@pytest.fixture
def changes_asked_for(monkeypatch, tmp_path):
    """Return with which changes a command loads its vehicle."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "design.toml").write_text(DESIGN)
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "limit.csv").write_text("time [s],bending_moment [N m]\n0,2e7\n150,2e7\n")
    (tmp_path / "wind.csv").write_text("altitude [m],u [m/s],v [m/s]\n0,3,0\n9000,30,0\n")

    def load(vehicle, *, compile=True, changes=None):
        raise Asked(vehicle, changes)

    monkeypatch.setattr(Study, "load", load)

    def run(arguments):
        found = CliRunner().invoke(app, arguments)
        assert isinstance(found.exception, Asked), found.output
        vehicle, changes = found.exception.args
        assert vehicle == "as504"
        assert {p.name for p in tmp_path.iterdir()} == {"design.toml", "study.toml", "limit.csv", "wind.csv"}, (
            "a folder was made before the vehicle is known"
        )
        return changes

    return run


def all_commands() -> Mapping[str, Any]:
    group: Any = typer.main.get_command(app)
    return group.commands


@pytest.mark.parametrize("arguments", TAKE_CHANGES, ids=" ".join)
def test_changes_reach_the_vehicle(changes_asked_for, arguments):
    assert not changes_asked_for(arguments)
    typed = ["--set", "options.full_coupling=true", "--set", "control.T1.gain=0.9"]
    assert changes_asked_for([*arguments, *typed]) == {"options.full_coupling": True, "control.T1.gain": 0.9}


def test_every_command_with_changes_is_tried():
    def takes(command) -> bool:
        return any("--set" in parameter.opts for parameter in command.params)

    commands = all_commands()
    found = {name for name, command in commands.items() if takes(command)}
    found |= {f"wind {name}" for name, command in commands["wind"].commands.items() if takes(command)}
    assert found == {" ".join(words[: 2 if words[0] == "wind" else 1]) for words in TAKE_CHANGES}


def test_changes_change_what_is_printed():
    def state_matrix(*typed: str) -> list:
        printed = CliRunner().invoke(app, ["inspect", "as504", "--time", "75", "--json", *typed])
        return json.loads(printed.stdout)

    assert state_matrix() != state_matrix("--set", "options.full_coupling=true")


def test_the_version_is_that_of_the_package():
    found = CliRunner().invoke(app, ["--version"])
    assert (found.exit_code, found.output) == (0, f"ascentwind {ascentwind.__version__}\n")


def test_a_file_is_imported_for_its_own_command_alone():
    code = (
        "import sys; from typer.testing import CliRunner; from ascentwind.runners.cli.app import app; "
        "CliRunner().invoke(app, ['cache', '--help']); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    inside = "ascentwind.runners.cli."
    files = {name.removeprefix(inside) for name in done.stdout.split() if name.startswith(inside)}
    assert files & set(FILES.values()) == {"upkeep"}


@pytest.mark.parametrize("name", FILES)
def test_every_command_stands_in_its_file(name):
    module = importlib.import_module(f"ascentwind.runners.cli.{FILES[name]}")
    assert hasattr(module, name.replace("-", "_"))
    command = all_commands()[name]
    assert command.name == name
    assert command.help


def completions(line: str) -> list[str]:
    """Return what bash offers at the end of a line, asked as its completion script asks."""
    words = line.split(" ")
    environment = os.environ | {
        "_ASCENTWIND_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1),
    }  # fmt: skip
    program = [str(Path(sys.executable).parent / "ascentwind")]
    done = subprocess.run(program, env=environment, capture_output=True, text=True, check=False, timeout=300)
    assert not done.stderr
    return done.stdout.split()


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("ascentwind ve", ["verify", "vehicles"]),
        ("ascentwind wind co", ["compare"]),
        ("ascentwind run as", ["as504"]),
        ("ascentwind run as504 --along", ["--along-vehicle"]),
    ],
)
def test_shells_complete(line, offered):
    assert sorted(completions(line)) == sorted(offered)
