"""Files that people keep open as they stand: xarray, pint-xarray, MATLAB and Excel."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from kept_files import opens_as_a_sheet, opens_in_excel, opens_in_matlab, opens_in_xarray

from ascentwind.runners.cli.app import main

SYSTEM = """name = "lag"
data = "tables"
default_times = "1:3:1"
"""
TABLES = {
    "A": 'time [s],"A(1,1)"\n0,-1\n1,-2\n4,-1\n',
    "B": 'time [s],"B(1,1)"\n0,1\n1,1\n4,1\n',
    "C": 'time [s],"C(1,1)"\n0,1\n1,1\n4,1\n',
}
COMMANDS = {
    "run": ["run", "falcon1", "--times", "60:70:5", "--probability", "0.01"],
    "along the vehicle": ["run", "falcon1", "--times", "65", "--along-vehicle", "65"],
    "both planes": ["run", "as504", "--set", "planes=both", "--times", "70"],
    "sensitivity": ["sensitivity", "falcon1", "--time", "65"],
    "flight-load": ["flight-load", "falcon1", "--window", "60:70", "--response", "bending_moment"],
    "csv": ["export", "falcon1", "--format", "csv", "--times", "60:64:1"],
    "mat": ["export", "falcon1", "--format", "mat", "--times", "60:64:1"],
    "netcdf": ["export", "falcon1", "--format", "netcdf", "--times", "60:64:1"],
}


@pytest.fixture
def files(monkeypatch, tmp_path):
    """Run the command line and return the files that it left."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> list[Path]:
        before = set(tmp_path.rglob("*"))
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments, "--out", "found"])
        with pytest.raises(SystemExit) as stop:
            main()
        assert not stop.value.code
        return sorted(path for path in set(tmp_path.rglob("*")) - before if path.is_file())

    return run


def hold(found: list[Path], folder: Path) -> None:
    there = {name: importlib.util.find_spec(name) is not None for name in ("pint_xarray", "openpyxl")}
    looked_at = 0
    for path in found:
        looked_at += path.suffix in (".csv", ".nc", ".mat")
        if path.suffix == ".csv":
            opens_as_a_sheet(path)
            if there["openpyxl"] and path.stat().st_size < 200_000:
                opens_in_excel(path, folder)
        elif path.suffix == ".nc":
            opens_in_xarray(path, there["pint_xarray"])
        elif path.suffix == ".mat":
            opens_in_matlab(path)
    assert looked_at


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_files_of_a_vehicle_open_as_they_stand(command, files, tmp_path):
    hold(files(*COMMANDS[command]), tmp_path)


def test_files_of_a_system_open_as_they_stand(files, tmp_path):
    (tmp_path / "tables").mkdir()
    for name, text in TABLES.items():
        (tmp_path / "tables" / f"{name}.csv").write_text(text)
    (tmp_path / "lag.toml").write_text(SYSTEM)
    hold(files("run", "--system", "lag.toml"), tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "# a comment\na,b\n1,2\n",
        "a,b\n1\n",
        "a,a\n1,2\n",
        "a,b\n=1+1,2\n",
        "a,b\n-x,2\n",
        "a,b\n3/4,2\n",
        "größe,b\n1,2\n",
        "1,2\n3,4\n",
        "a,b\n",
    ],
)
def test_what_excel_would_show_wrong_is_found(tmp_path, text):
    file = tmp_path / "t.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(AssertionError):
        opens_as_a_sheet(file)
