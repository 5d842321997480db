"""The main job for a system on disk."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat
from typer.testing import CliRunner

from ascentwind.errors import AscentwindError
from ascentwind.runners.cli.app import app


@pytest.fixture
def file(tmp_path, monkeypatch):
    """x' = -x/2 + 3 w: variance 9 (1 - exp(-t))."""
    monkeypatch.chdir(tmp_path)
    savemat("m.mat", {"time": [0.0, 10.0], "A": [[-0.5]], "B": [[3.0]], "C": [[1.0]]})
    (tmp_path / "s.toml").write_text('name = "lag"\ndata = "m.mat"\n[names]\noutputs = ["x"]\n')
    return tmp_path


def test_tables_and_figures_of_a_system(file, cache):
    found = CliRunner().invoke(app, ["run", "--system", "s.toml", "--times", "1,4", "--probability", "0.01"])
    assert found.exit_code == 0, found.output
    assert "Peaks of" in found.output and "lag-results" in found.output
    with xr.open_dataset(file / "lag-results" / "statistics.nc") as statistics:
        names = [str(n) for n in statistics.data_vars if str(n).endswith("x_std")]
        assert names, list(statistics.data_vars)
        std = statistics[names[0]].sel(source="combined").values
    assert std == pytest.approx(3 * np.sqrt(1 - np.exp(-np.array([1.0, 4.0]))), rel=1e-6)
    assert (file / "lag-results" / "x.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["as504"], "VEHICLE is of a vehicle"),
        (["--set", "title='x'"], "--set is of a vehicle"),
        (["--turbulence", "light"], "--turbulence is of a vehicle"),
        (["--along-vehicle", "peak"], "--along-vehicle is of a vehicle"),
        (["--azimuths", "0,90"], "--azimuths is of a vehicle"),
        (["--times", "11"], "beyond the end"),
    ],
)
def test_what_a_system_has_not(file, arguments, says):
    found = CliRunner().invoke(app, ["run", "--system", "s.toml", *arguments])
    assert isinstance(found.exception, AscentwindError), found.output
    assert says in str(found.exception)
    assert not (file / "lag-results").exists()


def test_a_run_of_nothing():
    found = CliRunner().invoke(app, ["run"])
    assert found.exit_code == 2 and "--system" in found.output
