"""``ascentwind day-of-launch``: the page, its files, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from ascentwind.runners.cli.app import main

LIMITS = "time [s],bending_moment [N m]\n0,2.3e7\n150,2.3e7\n"


@pytest.fixture
def files(tmp_path):
    rows = [f"{h},{10 + h / 500:.2f},0" for h in range(300, 13000, 400)]
    (tmp_path / "balloon.csv").write_text("\n".join(["altitude [m],u [m/s],v [m/s]", *rows]))
    (tmp_path / "limit.csv").write_text(LIMITS)
    return tmp_path


def run(monkeypatch, folder, *more) -> int:
    arguments = ["--sounding", folder / "balloon.csv", "--hours-before", "3", "--limit", folder / "limit.csv"]
    arguments += ["--window", "60:85", "--out", folder / "launch", *more]
    monkeypatch.setattr("sys.argv", ["ascentwind", "day-of-launch", "as504", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


@pytest.mark.slow
def test_the_page_says_go_and_why(cache, files, monkeypatch, capsys):
    assert run(monkeypatch, files) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert told.startswith("GO: AS-504")
    page = (files / "launch" / "day_of_launch.md").read_text()
    wanted = ("Chance of passing any limit", "Of the season", "to the power 0.67", "to the power 1", "assumed")
    for part in (*wanted, "bending moment: passed by"):
        assert part in page
    with xr.open_dataset(files / "launch" / "day_of_launch.nc") as found:
        assert found["bending_moment_mean"].attrs["units"] == "N m"
        assert np.isfinite(found["bending_moment_std"]).all()
    assert run(monkeypatch, files, "--threshold", "1e-9", "--lasts", "40") == 0
    assert "NO-GO: AS-504" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("change", "more", "says"),
    [
        ({"limit.csv": LIMITS.replace("N m", "kN m")}, [], "unit is [kN m], expected [N m]"),
        ({"limit.csv": LIMITS.replace("bending_moment", "moment")}, [], "did you mean 'bending_moment'"),
        ({"limit.csv": "station [m],bending_moment [N m]\n200,1e7\n250,1e7\n"}, [], "the vehicle has no station"),
        ({}, ["--hours-before", "2"], "1 soundings and 2 times before launch"),
        ({}, ["--threshold", "0"], "threshold = 0"),
        ({}, ["--lasts", "-3"], "a persistence of hours = -3"),
        ({"balloon.csv": "altitude [m],u [m/s],v [m/s]\n10,3,0\n100,4,0\n"}, [], "holds 10 to 100 m, and the flight"),
        ({"balloon.csv": "altitude [m],u [m/s],v [m/s]\n500,3,0\n1000,140,0\n"}, [], "is it in knots, or"),
    ],
)  # fmt: skip
def test_what_cannot_be_answered_writes_nothing(cache, files, monkeypatch, capsys, change, more, says):
    for name, text in change.items():
        (files / name).write_text(text)
    assert run(monkeypatch, files, *more) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    folder = files / "launch"
    assert not folder.exists() or not list(folder.iterdir())
