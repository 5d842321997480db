"""``ascentwind availability`` and ``ascentwind wind months``: files, tables and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import sounding_files as files
import xarray as xr

from ascentwind.model.wind.month_winds import read_months
from ascentwind.runners.cli.app import main
from ascentwind.runners.measured_winds.random_wind import filter_wind
from ascentwind.runners.wind import month_fit


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["ascentwind", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def ask(monkeypatch, folder, *more, limits="time [s],bending_moment [N m]\n0,1.5e7\n150,1.5e7\n") -> int:
    (folder / "limit.csv").write_text(limits)
    asked = ["--limit", folder / "limit.csv", "--window", "65:85", "--out", folder / "out", *more]
    return run(monkeypatch, "availability", "as504", *asked)


def test_files_of_availability(cache, tmp_path, monkeypatch, capsys):
    assert ask(monkeypatch, tmp_path, "--months", "1,june", "--azimuths", "60:100:40", "--check-hours", "3") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "january" in told and "june" in told and "stops" in told
    rows = (tmp_path / "out" / "availability.csv").read_text().splitlines()
    assert rows[0] == "month,azimuth_deg,probability,lower,upper,standard_error,spacing_error,stopped,remaining_risk"
    assert [row.split(",")[:2] for row in rows[1:]] == [[m, a] for m in ("january", "june") for a in ("60", "100")]
    with xr.open_dataset(tmp_path / "out" / "availability.nc") as found:
        assert found["probability"].sizes == {"month": 2, "azimuth": 2}
        assert found["bending_moment_level"].attrs["units"] == "N m"
    assert (tmp_path / "out" / "rose_bending_moment.png").exists()


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--months", "13"], "no month '13'"),
        (["--months", "juli"], "did you mean 'july'"),
        (["--azimuths", "40;120"], "names no azimuths"),
        (["--winds", "nowhere"], "holds no month"),
    ],
)
def test_what_cannot_be_answered_writes_nothing(cache, tmp_path, monkeypatch, capsys, more, says):
    assert ask(monkeypatch, tmp_path, *more) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


def test_months_of_soundings(tmp_path, monkeypatch, capsys):
    """The months that soundings have; the fit itself is stood in for by a shipped month's filters."""
    march = read_months(None, ["march"])[0]
    monkeypatch.setattr(month_fit, "synthesise", lambda part, *a, **k: Fitted(march, part.name))
    random, levels = np.random.default_rng(0), np.array([0.0, 3000.0, 6000.0, 9000.0, 12000.0, 16000.0])
    u, v = (random.normal(5, 6, (40, 1)) + random.normal(0, 4, (40, 6)) for _ in "uv")
    file = tmp_path / "s.csv"
    file.write_text(files.own_text(levels, u, v))  # 31 days of March, 9 of April
    asked = ["wind", "months", "--soundings", file, "--site", "Here", "--out", tmp_path / "months"]
    assert run(monkeypatch, *asked) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "april left out" in told and "1 months in" in told
    (found,) = read_months(tmp_path / "months")
    assert (found.period, found.site, found.edition) == ("march", "Here", "soundings of s.csv")
    np.testing.assert_allclose(found.mean[0], u[:31].mean(axis=0), rtol=1e-6)
    assert run(monkeypatch, *asked, "--months", "april") == 2
    assert "statistics need 10" in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
@pytest.mark.filterwarnings("error::ascentwind.errors.StalledFitWarning")
def test_a_month_made_again_is_the_shipped_one(tmp_path, monkeypatch):
    """July by the command: what the tolerance of a fit, 1e-4 of its cost, leaves open on another machine."""
    assert run(monkeypatch, "wind", "months", "--months", "july", "--out", tmp_path) == 0
    (made,), (shipped,) = read_months(tmp_path), read_months(None, ["july"])
    h = shipped.altitude
    for weights, most in (((1.0, 0.0), 0.01), ((0.0, 1.0), 0.01), ((1.0, 1.0), 0.05)):
        here, there = (filter_wind(m.filter_along(weights), h, 0 * h).covariance for m in (made, shipped))
        assert np.sqrt(np.mean((here - there) ** 2)) < most
    np.testing.assert_allclose(made.mean, shipped.mean, rtol=1e-7)


class Fitted:
    def __init__(self, month, name: str):
        self.shaping_filter = month.zonal if "zonal" in name else month.meridional
