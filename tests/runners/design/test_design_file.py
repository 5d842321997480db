"""Design files and the command: results written, verdicts, and bad input named by file and key."""

from __future__ import annotations

import csv
import re
import sys

import pytest

from ascentwind.model.errors import DataError, UnknownNameError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.cli.app import main
from ascentwind.runners.design.file import find_design, load_design
from ascentwind.runners.design.problem import DesignProblemError

DESIGN = """
format = 1
vehicle = "as504"
times = "44,46"
frozen_times = "30,46"
[parameters]
"control.T1.gain" = [0.8, 1.3]
"control.T2.gain" = [0.8, 1.3]
[limits.peaks]
engine_angle = 0.03
[limits.damping]
rigid_body = 0.3
[trade]
response = "engine_angle"
limits = [0.03, 0.001]
[trade.variants]
"attitude gain alone" = ["control.T1.gain"]
"""


def command(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["ascentwind", "design", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


@pytest.mark.slow
def test_command_designs_recomputes_trades_and_writes(as504, tmp_path, monkeypatch, capsys):
    file, out = tmp_path / "task.toml", tmp_path / "out"
    file.write_text(DESIGN)
    assert command(monkeypatch, str(file), "--out", str(out)) == 0
    printed = re.sub(r"\s+", " ", capsys.readouterr().out)
    assert "stationary point: residual" in printed
    assert "CVODES differs by" in printed
    with (out / "design.csv").open() as text:
        rows = {row["name"]: row for row in csv.DictReader(text)}
    after = {
        name: float(rows[name]["after"]) for name in ("control.T1.gain", "peak bending_moment", "peak engine_angle")
    }
    stats = as504.with_parameters(
        {name: float(rows[name]["after"]) for name in ("control.T1.gain", "control.T2.gain")}
    ).response_statistics([44.0, 46.0])
    combined = stats.sel(source="combined")
    for name in ("bending_moment", "engine_angle"):
        peak = float((abs(combined["mean"]) + 3 * combined["std"]).sel(response=name).max())
        assert after[f"peak {name}"] == pytest.approx(peak, rel=1e-6)
    with (out / "trade.csv").open() as text:
        lengths = {len(row) for row in csv.reader(text)}
    assert len(lengths) == 1  # what was missed has all columns too, or no report reads it
    with (out / "trade.csv").open() as text:
        met, missed = csv.DictReader(text)
    assert met["converged"] == "1"
    assert float(met["peak"]) >= after["peak bending_moment"] * (1 - 1e-9)  # fewer parameters cannot do better
    assert missed["peak"] == ""
    assert float(missed["closest"]) > 0.001
    assert (out / "trade.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("old", "new", "error", "message"),
    [
        ("times =", "tims =", DataError, r"task.toml, column '(times|tims|frozen_tims)'"),
        ('"control.T2.gain" =', '"control.T2.gan" =', UnknownNameError, "did you mean 'control.T2.gain'"),
        ("[0.8, 1.3]", "[0.8]", DataError, r"task.toml, column 'parameters.control.T1.gain"),
        ('"attitude gain alone" = ["control.T1', '"a" = ["control.T3', UnknownNameError, "trade variant 'a'"),
        ('response = "engine_angle"', 'response = "engine_angel"', UnknownNameError, "did you mean 'engine_angle'"),
        ('response = "engine_angle"', 'response = "bending_moment"', DesignProblemError, "a limit on it has no place"),
        ('vehicle = "as504"', 'vehicle = "as505"', UnknownNameError, "no vehicle or folder 'as505'"),
    ],
)  # fmt: skip
def test_bad_design_files_are_refused(tmp_path, old, new, error, message):
    file = tmp_path / "task.toml"
    assert old in DESIGN
    file.write_text(DESIGN.replace(old, new))
    with pytest.raises(error, match=message):
        load_design(file)


def test_command_ends_with_code_2_when_a_limit_cannot_be_met(tmp_path, monkeypatch, capsys):
    file = tmp_path / "task.toml"
    file.write_text(DESIGN.replace("engine_angle = 0.03", "engine_angle = 0.001"))
    assert command(monkeypatch, str(file), "--out", str(tmp_path / "out"), "--no-trade") == 2
    printed = re.sub(r"\s+", " ", capsys.readouterr().err)
    assert re.search(r"peak engine_angle \[rad\] at \d+ s is 0\.\d+ at the closest .* 0.001 was asked for", printed)
    assert "Traceback" not in printed


def test_design_of_a_vehicle_is_found_in_its_folder(tmp_path, vehicle_folder):
    assert find_design("as504") == built_in_vehicles()["as504"] / "design.toml"
    (vehicle_folder / "design.toml").unlink()
    with pytest.raises(DataError, match=r"holds no design.toml; write one"):
        find_design(str(vehicle_folder))
    with pytest.raises(DataError, match="cannot be read"):
        load_design(tmp_path / "missing.toml")


@pytest.mark.parametrize("name", ["design.toml", "load_relief_design.toml"])
def test_shipped_designs_load(name, vehicle_folder):
    if name.startswith("load_relief"):
        with (vehicle_folder / "vehicle.toml").open("a") as file:
            file.write((vehicle_folder / "load_relief.toml").read_text())
    task = load_design(vehicle_folder / name)
    assert task.problem.study.vehicle is not None
    assert task.problem.study.vehicle.folder == vehicle_folder
    if name == "design.toml":
        assert set(task.variants) == {"all parameters"}
    else:
        assert task.trade is not None
        assert set(task.variants) == set(task.trade.variants)
