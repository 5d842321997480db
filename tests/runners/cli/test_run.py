"""The command line on real input: files, figures and printed tables."""

from __future__ import annotations

import csv
import json
import re
import sys

import numpy as np
import pytest
import xarray as xr

from ascentwind.runners import Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.present.terminal import console
from ascentwind.runners.statistics.files import COLUMNS
from ascentwind.runners.views.mean_comparison import mean_comparison


@pytest.fixture
def ascentwind(monkeypatch, capsys, tmp_path):
    """Run the command line in a folder of its own and return what it printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setattr(console, "_width", None)  # that of COLUMNS when the console was first imported

    def run(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        assert stop.value.code in (0, None), printed.err
        return printed.out

    return run


@pytest.mark.slow
def test_run_writes_tables_and_figures(ascentwind, tmp_path, as504):
    printed = ascentwind("run", "as504", "--times", "70:80:5", "--out", "found")
    assert re.search(r"bending moment\D+75 s\D+24\.\d+ MN m", printed)
    assert "wind" in printed
    with xr.open_dataset(tmp_path / "found" / "statistics.nc", engine="scipy") as stored:
        expected = as504.response_statistics([70.0, 75.0, 80.0])
        for name, unit in (
            ("bending_moment", "N m"),
            ("angle_of_attack", "rad"),
            ("shear_force", "N"),
            ("q_alpha", "Pa rad"),
        ):
            np.testing.assert_allclose(
                stored[f"{name}_variance"], expected.variance.sel(response=name), rtol=1e-12, atol=0.0
            )
            assert stored[f"{name}_std"].attrs["units"] == unit
    rows = list(csv.reader((tmp_path / "found" / "statistics.csv").open()))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 1 + 3 * 8 * 4
    row = next(r for r in rows if r[:2] == ["75", "bending_moment"] and r[3] == "wind")
    std = float(expected.std.sel(time=75, response="bending_moment", source="wind"))
    assert float(row[6]) == pytest.approx(std, rel=1e-8)
    for name in (*expected["response"].values, "weighting_functions"):
        png = (tmp_path / "found" / f"{name}.png").read_bytes()
        assert png.startswith(b"\x89PNG")
        assert "flight time" in (tmp_path / "found" / f"{name}.svg").read_text() or name == "weighting_functions"
    assert sorted(p.suffix for p in (tmp_path / "found").iterdir()) == sorted(
        [".nc", ".csv", ".json"] + 9 * [".png", ".svg"]
    )


@pytest.mark.slow
def test_sensitivity_ranks_and_writes(ascentwind, tmp_path, as504):
    printed = ascentwind("sensitivity", "as504", "--time", "40", "--quantity", "std", "--out", "found")
    expected = as504.sensitivity("bending_moment", 40.0)
    e = expected["elasticity"].to_series()
    first = e.abs().idxmax()
    assert re.search(rf"parameter.*\n.*\n. {re.escape(first)} ", printed)
    assert f"{e[first]:+.4f}" in printed
    rows = list(csv.reader((tmp_path / "found" / "sensitivity.csv").open()))
    stored = {row[1]: float(row[5]) for row in rows if row[0] == "parameter"}
    assert stored == pytest.approx(e.to_dict(), rel=1e-8)
    assert {row[0] for row in rows[1:]} == {"parameter", "grouped factor", "table", "row", "kilometre"}
    with xr.open_dataset(tmp_path / "found" / "sensitivity.nc", engine="scipy") as dataset:
        mass = expected.isel(knot=expected["knot_table"].values == "mass")
        np.testing.assert_allclose(dataset["mass_knot_derivative"], mass["knot_derivative"], rtol=1e-9, atol=1e-12)
        assert dataset["mass_knot_derivative"].attrs["units"] == "N m kg^-1"
        assert dataset.attrs["t2_s"] == 40.0
    for name in ("tornado", "over_time", "over_altitude"):
        assert (tmp_path / "found" / f"sensitivity_{name}.png").read_bytes().startswith(b"\x89PNG")


def test_inspect_as_json_is_what_the_study_says(ascentwind):
    found = json.loads(ascentwind("inspect", "as504", "--time", "75", "--json"))
    A, B, C, D = Study.load("as504", compile=False).matrices(75.0)  # the command compiles nothing either
    for name, matrix in zip("ABCD", (A, B, C, D), strict=True):
        np.testing.assert_array_equal(np.array(found[name]).reshape(matrix.shape), matrix)
    tables = {row["name"]: row for row in found["tables"]}
    assert tables["center_of_pressure"]["symbol"] == "X_CP"
    assert all(row["symbol"] for row in found["tables"])
    assert tables["mass"]["value"] == pytest.approx(1915800, rel=1e-4)  # vehicle-data 2.2, 75 s
    roots = sorted(complex(r["real_rad_s"], r["imaginary_rad_s"]).real for r in found["roots"])
    assert roots[0] == pytest.approx(min(np.linalg.eigvals(A).real), rel=1e-9)


def test_inspect_prints_names(ascentwind):
    printed = ascentwind("inspect", "as504", "--time", "75")
    for word in ("relative_velocity", "V_RS", "control.T2.numerator.s4", "slosh_sivb_lox", "damping ratio"):
        assert word in printed


def test_new_vehicle_is_a_vehicle_of_its_own(ascentwind, tmp_path):
    ascentwind("new-vehicle", "mine", "--from", "as504")
    study = Study.load(tmp_path / "mine", compile=False)
    assert study.system.name == "mine"
    assert "as504" in ascentwind("vehicles")


@pytest.mark.slow
def test_regenerate_writes_and_then_leaves_alone(ascentwind):
    assert ascentwind("regenerate", "as504", "--out", "c").count("written (new)") == 5
    assert ascentwind("regenerate", "as504", "--out", "c").count("unchanged") == 5


@pytest.mark.slow
def test_regenerate_says_what_changed(ascentwind, tmp_path, vehicle_folder, edit):
    ascentwind("regenerate", str(vehicle_folder), "--out", "c")
    edit("extra_outputs = []", 'extra_outputs = ["lateral_drift"]')
    printed = ascentwind("regenerate", str(vehicle_folder), "--out", "c")
    assert "extra outputs: none -> lateral_drift" in re.sub(r"\s+", " ", printed)


def test_doctor_names_compiler_and_engine(ascentwind, monkeypatch):
    assert re.search(r"default engine\W+sweep, compiled C\W", ascentwind("doctor"))
    monkeypatch.setenv("CC", "")
    printed = ascentwind("doctor")
    assert "install cc" in printed
    assert "CasADi's interpreter" in printed


def test_mean_prints_both_means(ascentwind, tmp_path, as504):
    printed = ascentwind("mean", "as504", "--out", "found")
    found = mean_comparison(as504)["mean"].sel(response="angle_of_attack")
    linear, rigid, nonlinear = (np.rad2deg(found.sel(model=m).values) for m in found["model"].values)
    k = [int(np.argmax(abs(v))) for v in (linear, nonlinear - rigid, linear - rigid)]
    row = next(line for line in printed.splitlines() if "angle of attack" in line)
    cells = [float(x) for x in re.findall(r"-?\d+\.\d+", row)]
    expected = [linear[k[0]], found.time[k[0]], (nonlinear - rigid)[k[1]], found.time[k[1]], (linear - rigid)[k[2]]]
    assert cells[:5] == pytest.approx([float(x) for x in expected], abs=0.051)
    assert cells[2] == pytest.approx(float(expected[2]), abs=6e-5)
    assert (tmp_path / "found" / "mean_response.png").read_bytes().startswith(b"\x89PNG")
    assert "attitude (deg)" in (tmp_path / "found" / "mean_response.svg").read_text()


@pytest.mark.slow
def test_run_keeps_and_prints_levels_that_were_asked_for(ascentwind, tmp_path, as504):
    printed = ascentwind(
        "run", "as504", "--times", "70:80:5", "--probability", "0.01", "--along-vehicle", "75", "--out", "found"
    )
    statistics = as504.response_statistics([70.0, 75.0, 80.0])
    level = statistics.percentile(0.01).sel(response="bending_moment")
    k = int(level.values.argmax())
    shown = re.escape(f"{float(level[k]) / 1e6:.4g} MN m")
    assert re.search(rf"bending moment\W+{float(level['time'][k]):g} s\W+{shown}\W+upper", printed)
    rows = list(csv.DictReader((tmp_path / "found" / "statistics.csv").open()))
    row = next(r for r in rows if (r["time_s"], r["response"], r["source"]) == ("75", "bending_moment", "combined"))
    assert float(row["level_0.01"]) == pytest.approx(float(level.sel(time=75.0)), rel=1e-8)
    along = csv.DictReader((tmp_path / "found" / "bending_moment_along_vehicle.csv").open())
    largest = max(abs(float(r["mean"])) + 3 * float(r["std"]) for r in along if r["source"] == "combined")
    assert re.search(rf"bending moment\W+{re.escape(f'{largest / 1e6:.4g}')} MN m\W+mean [+-] 3σ", printed)


@pytest.mark.slow
def test_flight_load_keeps_and_prints_how_well_levels_are_known(ascentwind, tmp_path, as504):
    asked = ("--window", "70:80", "--response", "engine_angle", "--probability", "0.01", "--sensitivity")
    printed = ascentwind("flight-load", "as504", *asked, "--out", "found")
    load = as504.flight_load("engine_angle", (70.0, 80.0), [0.01])
    low, high = load.wind_interval()[0].values
    (row,) = csv.DictReader((tmp_path / "found" / "flight_load.csv").open())
    assert (row["side"], row["independent_samples"], row["monte_carlo_runs"]) == ("upper", "80", "230")
    assert [float(row[f"wind_{end}_95"]) for end in ("lower", "upper")] == pytest.approx([low, high], rel=1e-6)
    with xr.open_dataset(tmp_path / "found" / "flight_load.nc", engine="scipy") as stored:
        np.testing.assert_allclose(np.ravel(stored["engine_angle_wind_interval"]), [low, high], rtol=1e-6)
        assert stored["engine_angle_wind_interval"].attrs["units"] == "rad"
        assert float(np.ravel(stored["engine_angle_monte_carlo_runs"])[0]) == 230
    assert "by 80 independent soundings of the wind" in " ".join(printed.split())
    assert "230 simulated flights without a failure" in printed
    rows = list(csv.DictReader((tmp_path / "found" / "flight_load_sensitivity.csv").open()))
    sizes = [abs(float(r["elasticity"])) for r in rows]
    assert sizes == sorted(sizes, reverse=True)
    assert {"wind.sigma_scale", "wind.mean_scale"} < {r["parameter"] for r in rows}
    assert rows[0]["parameter"] in printed
