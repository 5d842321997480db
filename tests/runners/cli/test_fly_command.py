"""``ascentwind fly``: files, tables and what is refused; ``wind stats --normality``."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import sounding_files as files
import xarray as xr

import ascentwind as aw
from ascentwind.model.errors import OutputFolderError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.app import main

LEVELS = np.array([0.0, 1000.0, 3000.0, 5000.0, 7000.0, 9000.0, 11000.0, 13000.0])


@pytest.fixture
def winds(tmp_path):
    random = np.random.default_rng(0)
    u = 10 + LEVELS / 500 + 6 * random.standard_normal((30, 1)) + 4 * random.standard_normal((30, LEVELS.size))
    u[3, 5:] = np.nan  # a burst
    file = tmp_path / "march.csv"
    v = 0 * u + 5 * random.standard_normal(u.shape)
    file.write_text(files.own_text(LEVELS, u, v))
    return file


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["ascentwind", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def test_files_of_flown_winds(cache, winds, tmp_path, monkeypatch, capsys):
    out = tmp_path / "flown"
    asked = ["--times", "60:80:5", "--response", "bending_moment", "--out", out]
    assert run(monkeypatch, "fly", "as504", winds, *asked) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "30 soundings read, 30 kept" in told
    assert "what was not measured drawn" in told
    assert "move the level of 3 sigma by at most" in told
    assert {p.name for p in out.iterdir()} >= {"flown_winds.nc", "worst_profiles.csv", "flown_bending_moment.png"}
    with xr.open_dataset(out / "flown_winds.nc") as found:
        assert found["bending_moment_value"].sizes == {"profile": 30, "time": 5}
        assert found["bending_moment_value"].attrs["units"] == "N m"
    rows = (out / "worst_profiles.csv").read_text().splitlines()
    assert rows[0] == "response,unit,rank,profile,date,value,time_s"
    assert len(rows) == 21


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--response", "moment"], "did you mean 'bending_moment'"),
        (["--times", "900"], "lies beyond"),
        (["--component", "up"], "no wind component 'up'"),
        (["--component", "zonal", "--sign", "3"], "the sign of a wind is 3"),
        (["--levels", "50000,60000"], "no profile holds any of the 2 levels"),
    ],
)
def test_what_cannot_be_flown_writes_nothing(cache, winds, tmp_path, monkeypatch, capsys, arguments, says):
    out = tmp_path / "flown"
    assert run(monkeypatch, "fly", "as504", winds, "--out", out, *arguments) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not out.exists() or not list(out.iterdir())


def test_normality_of_soundings(winds, tmp_path, monkeypatch, capsys):
    out = tmp_path / "normal"
    assert run(monkeypatch, "wind", "stats", "--soundings", winds, "--component", "zonal", "--normality", out) == 0
    assert "skewness" in capsys.readouterr().out
    assert {p.name for p in out.iterdir()} == {"normality.png", "normality.svg", "manifest.json"}


def test_both_components_of_soundings_are_applied(winds, tmp_path, monkeypatch):
    """The fits are left out: what they would be of."""
    seen = []

    def stand_in(folder, statistics, *_):
        seen.append(statistics)
        raise OutputFolderError("seen")

    monkeypatch.setattr("ascentwind.runners.wind.apply.apply_components", stand_in)
    shutil.copytree(built_in_vehicles()["falcon1"], tmp_path / "mine")
    asked = ["--components", "both", "--azimuth", "90", "--soundings", winds, "--site", "Here"]
    assert run(monkeypatch, "wind", "apply", tmp_path / "mine", *asked) == 2
    (both,) = seen
    expected = aw.read_soundings(winds).statistics(Path(winds).stem, "Here")
    np.testing.assert_array_equal(both.zonal.standard_deviation, expected.zonal.standard_deviation)
    np.testing.assert_array_equal(both.meridional.mean, expected.meridional.mean)
