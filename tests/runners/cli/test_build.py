"""``build-vehicle`` and ``run --along-vehicle`` on the command line: files they leave and how they refuse."""

from __future__ import annotations

import csv
import sys

import numpy as np
import pytest
import xarray as xr

from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.app import main
from ascentwind.runners.construct.vehicle_figures import FIGURES
from ascentwind.runners.station_loads.loads_along_vehicle import LOADS
from ascentwind.runners.views.along_vehicle_files import COLUMNS


@pytest.fixture
def ascentwind(monkeypatch, capsys, tmp_path):
    """Run the command line in a folder of its own and return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        return int(stop.value.code or 0), printed.out, printed.err

    return run


@pytest.mark.slow
def test_build_vehicle_writes_a_folder_that_runs_and_figures(ascentwind, tmp_path):
    code, printed, _ = ascentwind("build-vehicle", "as504", "--out", "mine", "--spacing", "10")
    assert code == 0
    assert "center engine cutoff" in printed and "134.34" in printed
    assert {p.name for p in built_in_vehicles()["as504"].glob("*.toml")} <= {
        p.name for p in (tmp_path / "mine").iterdir()
    }
    assert {p.stem for p in (tmp_path / "mine" / "figures").glob("*.png")} == set(FIGURES)
    code, printed, _ = ascentwind("inspect", "mine", "--time", "75")
    assert code == 0 and "bending.1.frequency" in printed


def test_build_vehicle_refuses_with_exit_code_2(ascentwind, tmp_path):
    code, _, errors = ascentwind("build-vehicle", "as504")
    assert code == 2 and "--out" in errors
    code, _, errors = ascentwind("build-vehicle", "nowhere")
    assert code == 2 and "nowhere" in errors and "Traceback" not in errors


@pytest.mark.slow
def test_run_along_vehicle_leaves_files_with_the_peak(ascentwind, tmp_path):
    code, _, _ = ascentwind("run", "as504", "--times", "70:80:5", "--out", "found", "--along-vehicle", "75")
    assert code == 0
    for load in LOADS:
        assert (tmp_path / "found" / f"{load}_along_vehicle.png").stat().st_size > 20_000
    name = "bending_moment_along_vehicle"
    with xr.open_dataset(tmp_path / "found" / f"{name}.nc", engine="scipy") as stored:
        largest = stored["mean_plus_3sigma"].sel(time=75.0)[:, -1]
        assert 20 < float(stored["station"][int(np.argmax(largest.values))]) < 35
        assert float(np.abs(largest[[0, -1]]).max()) < 1e-4 * float(largest.max())
        rows = list(csv.reader((tmp_path / "found" / f"{name}.csv").open()))
        assert tuple(rows[0]) == COLUMNS and len(rows) == 1 + stored["std"].size


@pytest.mark.parametrize(("time", "message"), [("noon", "'noon' is not a time"), ("500", "beyond the")])
def test_bad_time_along_the_vehicle_is_refused_before_anything_runs(ascentwind, tmp_path, time, message):
    code, _, errors = ascentwind("run", "as504", "--times", "70:80:5", "--out", "found", "--along-vehicle", time)
    assert code == 2 and message in errors
    assert not (tmp_path / "found").exists()
