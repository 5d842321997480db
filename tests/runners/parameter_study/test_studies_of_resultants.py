"""Parameter studies of two planes: levels of resultants of members, against closed forms and single runs."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import xarray as xr
from lag import normal
from rich.console import Console

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.model.errors import AscentwindError
from ascentwind.runners import Study
from ascentwind.runners.parameter_study import changes, run_parameter_study, spread
from ascentwind.runners.parameter_study.dispersion_figures import band_figure
from ascentwind.runners.parameter_study.report import report
from ascentwind.runners.statistics.norm import LIKE_3_SIGMA, NormOfNormal

TAU = 2.0
NAMES = {"pitch_load": "N m", "yaw_load": "N m", "pitch_angle": "rad", "yaw_angle": "N"}


def two_lags(compile: bool = True) -> Study:
    """Two lags that share a part r of their noise: x' = -x/tau + gain n + level, y' = -y/tau + 2 gain (r n + ...)."""
    x, y, n, m, u, gain, r, level = (ca.SX.sym(s) for s in ("x", "y", "n", "m", "u", "gain", "r", "level"))
    system = define_system(
        "two lags",
        time=ca.SX.sym("t"),
        states={
            "x": (x, -x / TAU + gain * n + u),
            "y": (y, -y / TAU + 2 * gain * (r * n + ca.sqrt(1 - r**2) * m)),
        },
        noises={"n": n, "m": m},
        inputs={"u": (u, level)},
        outputs={"pitch_load": x, "yaw_load": y, "pitch_angle": x, "yaw_angle": y},
        parameters={"gain": (gain, 3.0), "r": (r, 0.4), "level": (level, 1.5)},
        end=50.0,
    )
    outputs = tuple(replace(o, unit=NAMES[o.name]) for o in system.outputs)
    return Study.from_system(replace(system, outputs=outputs), compile=compile)


def law(time: float, gain: float = 3.0, r: float = 0.4, level: float = 1.5) -> NormOfNormal:
    variance = gain**2 * TAU / 2 * (1 - np.exp(-2 * time / TAU))
    mean = level * TAU * (1 - np.exp(-time / TAU))
    return NormOfNormal(np.array([mean, 0.0]), variance * np.array([[1.0, 2 * r], [2 * r, 4.0]]))


def plan(**part) -> dict:
    return {"format": 1, "title": "two lags", "times": "1,3", "relative_tolerance": 1e-8} | part


GRID = {"quantity": [{"name": "gain", "values": [2.0, 4.0]}, {"name": "r", "values": [-0.9, 0.0, 0.9]}]}


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return two_lags()


@pytest.mark.parametrize("compiled", [True, False])
def test_levels_of_members_against_the_closed_form(study, tmp_path, compiled):
    """By the sweep, and where nothing is compiled by CVODES."""
    of = study if compiled else two_lags(compile=False)
    result = run_parameter_study(plan(grid=GRID, probability=1e-3), tmp_path, study=of)
    assert result.data["resultant"].values.tolist() == ["resultant_load"]  # the angles have different units
    for m, (gain, r) in enumerate(result.data["value"].values):
        for time in (1.0, 3.0):
            exact = law(time, gain, r)
            at = result.data.sel(resultant="resultant_load", time=time).isel(member=m)
            assert float(at["level"]) == pytest.approx(float(exact.percentile(1e-3)), rel=1e-6)
            np.testing.assert_allclose(at["plane_mean"], exact.mean, rtol=1e-6, atol=1e-12)
            together = at["plane_covariance"].sel(source="combined")
            np.testing.assert_allclose(together, exact.covariance, rtol=1e-6, atol=1e-9)
            by_source = at["plane_covariance"].sel(source=["n", "m"]).sum("source")
            np.testing.assert_allclose(by_source, together, rtol=1e-12, atol=1e-12)
    nominal = result.data["nominal_level"].sel(resultant="resultant_load").values
    np.testing.assert_allclose(nominal, [float(law(t).percentile(1e-3)) for t in (1.0, 3.0)], rtol=1e-6)


def test_a_dispersion_of_resultants_and_its_first_order(study, tmp_path):
    quantities = [normal("gain", 0.05), normal("level", 0.05)]
    given = plan(dispersion={"members": 64, "seed": 4, "sampling": "sobol", "quantity": quantities})
    result = run_parameter_study(given | {"responses": ["resultant_load", "yaw_load"]}, tmp_path, study=study)
    found = spread(result)
    h = 1e-5
    by = [
        (float(law(3.0, **{n: v + h}).percentile()) - float(law(3.0, **{n: v - h}).percentile())) / (2 * h)
        for n, v in (("gain", 3.0), ("level", 1.5))
    ]
    for measure in ("peak", "level"):
        at = found.sel(measure=measure, response="resultant_load")
        assert float(at["nominal"]) == pytest.approx(float(law(3.0).percentile(LIKE_3_SIGMA)), rel=1e-6)
        assert float(at["first_order_std"]) == pytest.approx(0.05 * np.hypot(by[0], by[1]), rel=1e-5)
        assert float(at["ratio"]) == pytest.approx(1.0, abs=0.02)
        assert float(at["peak_time"]) == 3.0
    of_resultant = found.sel(response="resultant_load")
    assert np.isnan(of_resultant.sel(measure=["mean", "std", "abs_mean_plus_3sigma"])["nominal"]).all()
    assert np.isnan(found.sel(response="yaw_load", measure="level")["nominal"])
    band = band_figure(result, found, "resultant_load")
    (nominal,) = [one for one in band.axes[0].get_lines() if one.get_label() == "nominal"]
    np.testing.assert_allclose(np.array(nominal.get_ydata()), result.data["nominal_level"].values[:, 0])


def test_files_and_screen_of_every_kind(study, tmp_path):
    swept = [{"name": "gain", "plus_minus": 0.001}, {"name": "r", "low": 0.3, "high": 0.5}]
    kinds = {
        "grid": {"quantity": [{"name": "gain", "values": [2.0, 3.0, 4.0]}]},
        "one_at_a_time": {"quantity": swept},
        "dispersion": {"members": 12, "seed": 1, "quantity": [normal("gain", 0.1)]},
    }
    figures = {"grid": ["grid"], "one_at_a_time": ["tornado"], "dispersion": ["spread", "band"]}
    for kind, part in kinds.items():
        given = plan(**{kind: part}, responses=["pitch_load", "resultant_load"])
        result, screen = run_parameter_study(given, tmp_path / kind, study=study), io.StringIO()
        written = report(result, tmp_path / kind, Console(file=screen, width=200))
        printed = " ".join(screen.getvalue().split())
        assert "resultant load passed with 0.00135" in printed and "mean + 3σ" in printed
        tables = {p.name: list(csv.DictReader(io.StringIO(p.read_text()))) for p in written if p.suffix == ".csv"}
        expected = {f"{f}_{r}.png" for f in figures[kind] for r in ("pitch_load", "resultant_load")}
        assert {p.name for p in written if p.suffix == ".png"} == expected
        _members(tables["members.csv"], result.data)
        if kind == "one_at_a_time":
            found = changes(result).sel(response="resultant_load", measure="peak", quantity="gain")
            low, high = found["change"].values
            assert (high - low) / 2 == pytest.approx(float(found["first_order_change"].sel(end="high")), rel=1e-5)
            kept = {(r["measure"], r["response"]) for r in tables["changes.csv"]}
            assert ("level", "resultant_load") in kept and ("std", "pitch_load") in kept
            assert not kept & {("std", "resultant_load"), ("level", "pitch_load")}
        stored = xr.open_dataset(tmp_path / kind / "study.nc", engine="scipy")
        assert stored["resultant_load_level"].attrs["units"] == "N m"
        assert stored["resultant_load_plane_covariance"].attrs["units"] == "N^2 m^2"
        stored.close()


def _members(rows: list[dict[str, str]], data: xr.Dataset) -> None:
    level = data["level"].sel(resultant="resultant_load").values
    for m, row in enumerate(rows):
        k = int(np.argmax(level[m]))
        assert float(row["peak level of resultant_load (N m)"]) == pytest.approx(level[m, k], rel=1e-9)
        assert float(row["at (s), resultant_load"]) == data["time"].values[k]
        at = data.isel(member=m, time=k).sel(resultant="resultant_load")
        here = NormOfNormal(at["plane_mean"].values, at["plane_covariance"].sel(source="combined").values)
        direction = float(here.direction(level[m, k]).most_likely)
        assert float(row["direction (rad), resultant_load"]) == pytest.approx(direction, rel=1e-6)


def test_stored_chunks_are_read_again(study, tmp_path):
    given = plan(grid=GRID, responses=["resultant_load"])
    first = run_parameter_study(given, tmp_path, study=study)
    whole = (tmp_path / "study.nc").read_bytes()
    chunk = next((tmp_path / "chunks").iterdir())
    before = chunk.stat().st_mtime_ns
    again = run_parameter_study(given, tmp_path, study=study)
    assert chunk.stat().st_mtime_ns == before, "computed again"
    assert (tmp_path / "study.nc").read_bytes() == whole
    xr.testing.assert_identical(first.data, again.data)


def test_members_that_fail_have_no_level(study, tmp_path):
    values = [3.0, 1e200]
    result = run_parameter_study(plan(grid={"quantity": [{"name": "gain", "values": values}]}), tmp_path, study=study)
    assert result.data["status"].values.tolist() == [0, 2]
    assert np.isnan(result.data["level"].values[1]).all()
    assert np.isfinite(result.data["level"].values[0]).all()


REFUSED = {
    "probability without a resultant": (
        {"probability": 0.01, "responses": ["yaw_load"]}, "'probability'.*none is asked for; leave it out",
    ),
    "probability of one": ({"probability": 1.0}, "probability.*less than 1"),
    "unlike units": ({"responses": ["resultant_angle"]}, "is in rad and 'yaw_angle' is in N: they have no norm"),
    "misspelt resultant": ({"responses": ["resultant_laod"]}, "did you mean 'resultant_load'"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused(study, tmp_path, name):
    part, message = REFUSED[name]
    with pytest.raises(AscentwindError, match=message):
        run_parameter_study(plan(grid=GRID, **part), tmp_path, study=study)


def test_a_resultant_of_one_plane_is_refused(as504, tmp_path):
    part = {"quantity": [{"name": "control.T1.gain", "values": [1.0]}]}
    with pytest.raises(aw.errors.PlanesError, match="resultant_bending_moment"):
        run_parameter_study(plan(grid=part, responses=["resultant_bending_moment"], times="75"), tmp_path, study=as504)


@pytest.mark.slow
def test_members_of_as504_are_single_runs(tmp_path, cache):
    """Each member of the study against response statistics of the same numbers, at a finer tolerance."""
    study = Study.load("as504", changes={"planes": "both"})
    part = {"quantity": [{"name": "wind.sigma_scale", "values": [0.8, 1.2]}, {"name": "wind.azimuth", "values": [1.0]}]}
    names = ["resultant_bending_moment", "total_angle_of_attack"]
    given = plan(grid=part, responses=names, times="74,75") | {"relative_tolerance": 1e-6}
    result = run_parameter_study(given, tmp_path, study=study)
    for m, scale in enumerate((0.8, 1.2)):
        single = study.with_parameters({"wind.sigma_scale": scale, "wind.azimuth": 1.0})
        alone = single.response_statistics([74.0, 75.0]).resultants(names=names).dataset
        level = alone["level"].sel(source="combined").values[..., 0]
        np.testing.assert_allclose(result.data["level"].values[m], level, rtol=1e-5)
