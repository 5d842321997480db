"""The command flight-load on AS-504: its files, what it prints, a second run."""

from __future__ import annotations

import csv
import json
import re
import sys

import numpy as np
import pytest
import xarray as xr

from ascentwind.runners.cli.app import main
from ascentwind.runners.present.terminal import console

STATIONS = "station [m],bending_moment [N m],shear_force [N]\n0,28e6,1.8e6\n30,28e6,1.8e6\n111,6e6,0.8e6\n"
TIMES = "time [s],bending_moment [N m],engine_angle [rad]\n70,30e6,0.03\n82,29e6,0.03\n"
COMMON = ("--window", "72:80", "--draws", "400", "--response", "bending_moment", "--probability", "0.01")


@pytest.fixture
def flight_load(monkeypatch, capsys, tmp_path):
    """Run the command in a folder of its own and return what it printed, in one line."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setattr(console, "_width", None)

    def run(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["ascentwind", "flight-load", "as504", *COMMON, *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        assert stop.value.code in (0, None), printed.err
        return " ".join(printed.out.split())

    return run


def with_units(path) -> xr.Dataset:
    """Every number of a file has a unit that pint reads."""
    with xr.open_dataset(path, engine="scipy") as stored:
        found = stored.load()
    assert found.attrs["Conventions"].startswith("CF-")
    for name in found.data_vars:
        assert found[name].attrs.get("units"), name
    pytest.importorskip("pint_xarray")
    found.pint.quantify()
    return found


@pytest.mark.slow
def test_limits_along_the_vehicle(flight_load, tmp_path):
    (tmp_path / "limit.csv").write_text(STATIONS)
    arguments = ("--probability", "0.00135", "--limit", "limit.csv", "--out", "found")
    printed = flight_load(*arguments)
    assert "72 to 80 s" in printed
    assert re.search(r"Any of 6\d limits is passed by 0\.0\d+ of flights", printed)
    folder = tmp_path / "found"
    levels, limits = with_units(folder / "flight_load.nc"), with_units(folder / "limits.nc")
    assert levels["probability"].values.tolist() == [0.01, 0.00135]
    assert levels["bending_moment_flight_level"].attrs["units"] == "N m"
    assert limits["shear_force_at_25m_limit"].attrs["units"] == "N"
    rows = list(csv.DictReader((folder / "flight_load.csv").open()))
    assert [float(row["probability"]) for row in rows] == [0.01, 0.00135]
    np.testing.assert_allclose(
        [float(r["flight_level"]) for r in rows], levels["bending_moment_flight_level"], rtol=1e-9
    )
    for r in csv.DictReader((folder / "limits.csv").open()):
        limit, level, margin = (float(r[name]) for name in ("limit", "level", "margin"))
        assert limit - level == pytest.approx(margin, abs=1.5e-9 * limit)  # three roundings to ten digits
    manifest = json.loads((folder / "manifest.json").read_text())["flight-load"]
    assert manifest["complete"]
    names = {path.name for path in folder.iterdir()} - {"manifest.json"}
    assert set(manifest["files"]) == names
    assert {"limits_along_vehicle.png", "exceedance_bending_moment.svg", "exceedance.csv"} < names
    once = {name: (folder / name).read_bytes() for name in names}
    flight_load(*arguments)  # the same seed, the same bytes
    assert {name: (folder / name).read_bytes() for name in names} == once
    flight_load("--out", "found", "--seed", "2", "--sides", "upper", "--set", "options.full_coupling=true")
    assert not (folder / "limits.nc").exists()  # of the run before
    assert (folder / "flight_load.nc").read_bytes() != once["flight_load.nc"]


@pytest.mark.slow
def test_limits_over_time(flight_load, tmp_path):
    (tmp_path / "limit.csv").write_text(TIMES)
    printed = flight_load("--limit", "limit.csv")
    assert re.search(r"The limit of bending moment is passed by \S+ of flights", printed)
    assert "Any of 2 limits is passed" in printed
    folder = tmp_path / "as504-flight-load"
    found = with_units(folder / "flight_load.nc")
    assert 0 < float(found["bending_moment_limit_passage_probability"]) < 0.01
    limits = with_units(folder / "limits.nc")
    assert limits["engine_angle_limit"].attrs["units"] == "rad"
    assert (folder / "limit_bending_moment.png").read_bytes().startswith(b"\x89PNG")
