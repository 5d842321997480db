"""``ascentwind wind read``: profiles on common levels, the report, and nothing written where something is wrong."""

from __future__ import annotations

import numpy as np
import pytest
import sounding_files as files

from ascentwind.model.wind.soundings.read import read_soundings
from ascentwind.runners.cli.app import main

LEVELS = np.array([0.0, 1000.0, 3000.0, 5000.0])


@pytest.fixture
def igra(tmp_path):
    random = np.random.default_rng(0)
    u, v = random.normal(10, 4, (40, 4)), random.normal(0, 4, (40, 4))
    file = tmp_path / "igra.txt"
    file.write_text(files.igra_text(LEVELS, u, v))
    return file


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["ascentwind", "wind", "read", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def test_profiles_are_written_at_levels(igra, tmp_path, monkeypatch, capsys):
    out = tmp_path / "march.csv"
    arguments = [igra, "--levels", "0:5000:500", "--months", "march", "--hours", "12", "--years", "2003:2003"]
    assert run(monkeypatch, *arguments, "--out", out) == 0
    told = capsys.readouterr().out
    assert "40 soundings read, 31 kept" in told
    assert "9 passed over: another month" in told
    back, wanted = read_soundings(out), read_soundings(igra, np.arange(0, 5001, 500), months=[3])
    np.testing.assert_allclose(back.u, wanted.u, rtol=1e-5)
    assert (back.time == wanted.time).all()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--levels", "0;1000"], "names no levels; write START:STOP:STEP"),
        (["--levels", "0:6000:-5"], "names no levels"),
        (["--months", "juli"], "there is no month 'juli'; did you mean 'july'"),
        (["--months", "july"], "no sounding is left of 40 read"),
        (["--hours", "noon"], "names no hour"),
        (["--years", "2003:2001"], "names no year"),
        (["--incomplete", "keep"], "incomplete profiles"),
        (["--largest-gap", "0"], "not positive"),
        (["--levels", "9000,9500"], "no profile holds any of the 2 levels"),
    ],
)
def test_what_cannot_be_read_writes_nothing(igra, tmp_path, monkeypatch, capsys, arguments, says):
    out = tmp_path / "out.csv"
    assert run(monkeypatch, igra, "--out", out, *arguments) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not out.exists()
