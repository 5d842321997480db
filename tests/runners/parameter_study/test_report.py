"""Tables, printed report and figures of parameter studies against NumPy on the stored numbers and closed forms."""

from __future__ import annotations

import csv
import io
import re
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from lag import GAIN, INPUT, TAU, closed_form, dispersion, lag, normal, plan
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from rich.console import Console
from scipy import stats

from ascentwind.runners.parameter_study import run_parameter_study
from ascentwind.runners.parameter_study.changes import changes
from ascentwind.runners.parameter_study.dispersion_figures import band_figure, histogram_figure, tornado_figure
from ascentwind.runners.parameter_study.grid_figure import grid_figure
from ascentwind.runners.parameter_study.measures import measures
from ascentwind.runners.parameter_study.report import report
from ascentwind.runners.parameter_study.spread import _moments, spread

TIMES = "1:3:0.5"
SWEPT = {
    "quantity": [
        {"name": "level", "plus_minus": 0.1},
        {"name": "gain", "low": 2.0, "high": 4.5},
        {"name": "tau", "low": -5.0, "high": 2.2},  # unstable at its low value
    ]
}


@pytest.fixture(scope="module")
def study(cache):
    return lag()


def reported(study, given: dict, folder: Path, columns: int = 80) -> SimpleNamespace:
    """Run a study and report it in a terminal of so many columns."""
    result = run_parameter_study(given | {"times": TIMES}, folder, study=study)
    screen = io.StringIO()
    written = report(result, folder, Console(file=screen, width=columns))
    tables = {p.name: list(csv.DictReader(io.StringIO(p.read_text()))) for p in written if p.suffix == ".csv"}
    stored = xr.open_dataset(folder / "study.nc", engine="scipy").load()
    return SimpleNamespace(result=result, text=screen.getvalue(), tables=tables, stored=stored, written=written)


def upper(stored: xr.Dataset) -> np.ndarray:
    """Return |mean| + 3 sigma of the members, (member, time)."""
    return (abs(stored["x_mean"]) + 3 * stored["x_std"].sel(source="combined")).values


def labelled(figure: Figure) -> tuple[str, ...]:
    """Return the labels of all axes."""
    return tuple(text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text)


def line(figure: Figure, label: str, panel: int = 0) -> np.ndarray:
    """Return x and y of a line by its label, (2, points)."""
    (found,) = [one for one in figure.axes[panel].get_lines() if one.get_label() == label]
    return np.array(found.get_data(), float)


@pytest.fixture(scope="module")
def dispersed(study, tmp_path_factory):
    given = dispersion(300, normal("gain", 0.3), normal("level", 0.2))
    return reported(study, given, tmp_path_factory.mktemp("dispersed"))


def test_spread_csv_is_what_numpy_makes_of_the_stored_members(dispersed):
    stored, rows = dispersed.stored, {r["measure"]: r for r in dispersed.tables["spread.csv"]}
    at = int(np.argmax((stored["x_nominal_mean"] + 3 * stored["x_nominal_std"].sel(source="combined")).values))
    mean, std = stored["x_mean"].values[:, at], stored["x_std"].sel(source="combined").values[:, at]
    samples = {"peak": upper(stored).max(axis=1), "abs_mean_plus_3sigma": mean + 3 * std, "mean": mean, "std": std}
    assert rows.keys() == samples.keys()
    for measure, sample in samples.items():
        row = {k: float(v) for k, v in rows[measure].items() if k not in ("measure", "response", "unit") and v}
        assert row["sample_mean"] == pytest.approx(sample.mean(), rel=1e-9)
        assert row["sample_std"] == pytest.approx(sample.std(ddof=1), rel=1e-9)
        half = 1.959964 * sample.std(ddof=1) / np.sqrt(sample.size)
        assert row["sample_mean_high"] - row["sample_mean"] == pytest.approx(half, rel=1e-5)
        assert row["sample_mean"] - row["sample_mean_low"] == pytest.approx(half, rel=1e-5)
        for percent in (1, 5, 50, 95, 99):
            assert row[f"percentile_{percent}"] == pytest.approx(np.percentile(sample, percent), rel=1e-9)
        ordered = np.sort(sample)
        low, high = (int(stats.binom.ppf(p, sample.size, 0.95)) for p in (0.025, 0.975))
        assert row["percentile_95_low"] == pytest.approx(ordered[low - 1], rel=1e-9)
        assert row["percentile_95_high"] == pytest.approx(ordered[high], rel=1e-9)
        assert row["ratio"] == pytest.approx(sample.std(ddof=1) / row["first_order_std"], rel=1e-9)
        assert row.get("at (s)") == (None if measure == "peak" else 3.0)
    variance_of_std = ((std - std.mean()) ** 4).mean() - std.var(ddof=1) ** 2 * 297 / 299
    half = 1.959964 * np.sqrt(variance_of_std / 300) / (2 * std.std(ddof=1))
    assert float(rows["std"]["sample_std_high"]) - std.std(ddof=1) == pytest.approx(half, rel=1e-5)


def test_first_order_in_spread_csv_is_the_closed_form(dispersed):
    """mean = gain level m and sigma = gain s: the spread of each by both quantities."""
    mean, std = closed_form(3.0)
    by_gain = {"mean": mean / GAIN, "std": std / GAIN, "abs_mean_plus_3sigma": (mean + 3 * std) / GAIN}
    by_level = {"mean": mean / INPUT, "std": 0.0, "abs_mean_plus_3sigma": mean / INPUT}
    rows = {r["measure"]: r for r in dispersed.tables["spread.csv"]}
    for measure, slope in by_gain.items():
        expected = np.hypot(slope * 0.3, by_level[measure] * 0.2)
        assert float(rows[measure]["first_order_std"]) == pytest.approx(expected, rel=1e-6)


def test_members_csv_holds_every_member(dispersed):
    rows, stored = dispersed.tables["members.csv"], dispersed.stored
    assert len(rows) == 300
    peak, times = upper(stored), stored["time"].values
    for m in (0, 7, 299):
        assert float(rows[m]["gain (1)"]) == pytest.approx(stored["gain_value"].values[m], rel=1e-9)
        assert float(rows[m]["peak |mean| + 3 sigma of x (1)"]) == pytest.approx(peak[m].max(), rel=1e-9)
        assert float(rows[m]["at (s), x"]) == times[np.argmax(peak[m])]
        assert (rows[m]["member"], rows[m]["status"], rows[m]["reason"]) == (str(m), "computed", "")


def test_members_csv_names_the_side_of_each_peak(study, tmp_path):
    found = reported(study, plan(grid={"quantity": [{"name": "level", "values": [-1.5, 1.5]}]}), tmp_path)
    rows = found.tables["members.csv"]
    assert [row["side, x"] for row in rows] == ["mean - 3σ", "mean + 3σ"]
    first, second = (float(row["peak |mean| + 3 sigma of x (1)"]) for row in rows)
    assert first == pytest.approx(second, rel=1e-9)


def test_the_screen_shows_whole_numbers_in_a_narrow_terminal(dispersed, study, tmp_path):
    peak = upper(dispersed.stored).max(axis=1)
    assert "300 members: 300 computed, 0 unstable, 0 failed" in dispersed.text
    shown = {row.split("│")[1].strip(): row.split("│")[2].strip() for row in dispersed.text.splitlines() if "│" in row}
    assert shown["mean"] == f"{peak.mean():.3g}"
    assert shown["σ"] == f"{peak.std(ddof=1):.3g}"
    assert shown["95 %"] == f"{np.percentile(peak, 95):.3g}"
    assert shown["gain"].endswith("%")
    narrow = reported(study, dispersion(20, normal("gain", 0.3)), tmp_path, columns=20).text
    assert "first-order σ" in narrow
    assert not re.search(r"\w…[ │]", narrow)  # the sign of a cell cut off
    assert "over " in narrow  # a percentile with an open end


def test_histogram_shows_members_and_first_order(dispersed):
    found = spread(dispersed.result)
    figure = histogram_figure(dispersed.result, measures(dispersed.result), found, "x")
    assert labelled(figure) == (
        "peak of |mean| + 3σ x (1)", "density (1/1)", "peak of |mean| + 3σ x (1)", "members below (%)"
    )  # fmt: skip
    peak = np.sort(upper(dispersed.stored).max(axis=1))
    (bars,) = figure.axes[0].patches
    assert isinstance(bars, StepPatch)
    heights, edges, _ = bars.get_data()
    np.testing.assert_allclose(heights, np.histogram(peak, bins=edges, density=True)[0], rtol=1e-9)
    at = found.sel(measure="peak", response="x")
    x, density = line(figure, f"first order: σ {float(at['first_order_std']):.3g} 1")
    np.testing.assert_allclose(density, stats.norm.pdf(x, at["first_order_mean"], at["first_order_std"]), rtol=1e-9)
    x, below = line(figure, "members", 1)
    np.testing.assert_allclose(x, peak)
    np.testing.assert_allclose(below, 100 * np.arange(1, 301) / 300)
    mean, std = closed_form(3.0)
    np.testing.assert_allclose(line(figure, "nominal")[0], mean + 3 * std, rtol=1e-6)


def test_band_shows_percentiles_over_time(dispersed):
    figure = band_figure(dispersed.result, spread(dispersed.result), "x")
    assert labelled(figure) == ("flight time (s)", "|mean| + 3σ x (1)")
    values, times = upper(dispersed.stored), dispersed.stored["time"].values
    x, median = line(figure, "median")
    np.testing.assert_allclose(x, times)
    np.testing.assert_allclose(median, np.median(values, axis=0))
    mean, std = closed_form(times)
    np.testing.assert_allclose(line(figure, "nominal")[1], mean + 3 * std, rtol=1e-6)
    for collection, percents in zip(figure.axes[0].collections, ((1, 99), (5, 95)), strict=False):
        corners = np.asarray(collection.get_paths()[0].vertices)[:, 1]
        ends = np.percentile(values, percents, axis=0)
        assert (corners.min(), corners.max()) == pytest.approx((ends.min(), ends.max()))
    legend = figure.axes[0].get_legend()
    assert legend is not None
    named = [text.get_text() for text in legend.get_texts()]
    assert named == ["1 to 99 %", "5 to 95 %", "median", "nominal", "5 to 95 %, first order"]


@pytest.mark.slow
def test_unstable_members_leave_tables_and_figures_readable(study, tmp_path):
    """At tau = -0.3 s the lag grows by 2e4 in 3 s, at -0.1 s by 1e13."""
    given = dispersion(24, {"name": "tau", "distribution": "uniform", "low": -0.3, "high": 0.3}, seed=6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = reported(study, given, tmp_path)
        figures = [
            histogram_figure(found.result, measures(found.result), spread(found.result), "x"),
            band_figure(found.result, spread(found.result), "x"),
        ]
    status, peak = found.stored["status"].values, upper(found.stored).max(axis=1)
    assert np.nanmax(peak) > 1e6
    first_order = float(found.tables["spread.csv"][0]["first_order_std"])
    low, high = figures[0].axes[0].get_xlim()
    assert high - low < 1.1 * (np.ptp(peak[status == 0]) + 10 * first_order)
    (bars,) = figures[0].axes[0].patches
    assert f"{(status != 2).sum()} members, {(status == 1).sum()} beyond the axis" in str(bars.get_label())
    mean, std = closed_form(3.0)
    assert figures[1].axes[0].get_ylim()[1] < 1.2 * (mean + 3 * std)


def test_intervals_of_members_that_have_grown_without_measure():
    """Fourth powers of 1e91, as an unstable vehicle reaches, have no number."""
    samples = np.random.default_rng(2).lognormal(size=(2, 40))
    plain, large = _moments(samples), _moments(1e91 * samples)
    for name, values in plain.items():
        np.testing.assert_allclose(large[name], 1e91 * values, rtol=1e-12, err_msg=name)
    assert not _moments(np.full((1, 5), 3.0))["sample_std_high"].any()


@pytest.fixture(scope="module")
def swept(study, tmp_path_factory):
    return reported(study, plan(one_at_a_time=SWEPT), tmp_path_factory.mktemp("swept"))


def test_changes_csv_is_the_closed_form(swept):
    rows = {(r["measure"], r["quantity"], float(r["value"])): r for r in swept.tables["changes.csv"]}
    mean, std = closed_form(3.0)
    for measure, of in (("mean", lambda m, s: m), ("std", lambda m, s: s), ("peak", lambda m, s: m + 3 * s)):
        nominal = of(mean, std)
        for gain in (2.0, 4.5):
            row = rows[measure, "gain", gain]
            assert float(row["change"]) == pytest.approx(nominal * (gain / GAIN - 1), rel=1e-5)
            assert float(row["first_order_change"]) == pytest.approx(nominal * (gain / GAIN - 1), rel=1e-5)
            assert float(row["nominal"]) == pytest.approx(nominal, rel=1e-6)
            assert (row["status"], row["quantity_unit"]) == ("computed", "1")
        changed = of(*closed_form(3.0, 2.2)) - nominal
        assert float(rows[measure, "tau", 2.2]["change"]) == pytest.approx(changed, rel=1e-5)
    assert float(rows["mean", "level", 1.6]["change"]) == pytest.approx(mean * 0.1 / INPUT, rel=1e-5)
    assert rows["peak", "tau", -5.0]["status"] == "unstable"
    assert rows["mean", "gain", 2.0]["at (s)"] == "3"
    assert rows["peak", "gain", 2.0]["at (s)"] == ""


def test_the_screen_shows_changes_with_their_status(swept):
    mean, std = closed_form(3.0)
    change = (mean + 3 * std) * (4.5 / GAIN - 1)
    assert re.search(rf"│ +4.5 │ +\+{change:.4g} │ +\+{change:.4g} │", swept.text)
    assert re.search(r"│ tau +│ +-5 │ +\+[\d.]+, unstable │", swept.text)
    assert "member 4: " in swept.text


def test_tornado_bars_are_the_changes(swept):
    figure = tornado_figure(swept.result, changes(swept.result), "x")
    (axes,) = figure.axes
    mean, std = closed_form(3.0)
    peak = mean + 3 * std
    assert axes.get_xlabel() == f"change of the peak |mean| + 3σ x from {peak:.4g} 1 (1)"
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == ["gain\n2 … 4.5", "tau\n-5 … 2.2", "level\n1.4 … 1.6"]  # the largest on top
    low, high = ([bar.get_width() for bar in container] for container in axes.containers)
    level = float(mean * 0.1 / INPUT)
    mean, std = closed_form(3.0, 2.2)
    tau = float(mean + 3 * std - peak)
    np.testing.assert_allclose(low, [float(peak * (2.0 / GAIN - 1)), 0.0, -level], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(high, [float(peak * (4.5 / GAIN - 1)), tau, level], rtol=1e-5)
    assert [t.get_text() for t in axes.texts] == ["", "unstable at the low value", ""]
    marks = line(figure, "first order")[0]
    np.testing.assert_allclose(marks[[0, 3]], [peak * (2.0 / GAIN - 1), peak * (4.5 / GAIN - 1)], rtol=1e-5)
    assert np.isnan(marks[1])  # nothing beside a bar that is not there


def test_grids_are_shown_at_their_values(study, tmp_path):
    gain, tau = ({"name": "gain", "values": [4.0, 2.0]}, {"name": "tau", "values": [1.0, 0.0, 3.0, -5.0]})
    one = reported(study, plan(grid={"quantity": [tau]}), tmp_path / "one")
    figure = grid_figure(one.result, measures(one.result), "x")
    assert labelled(figure) == ("tau", "peak |mean| + 3σ x (1)")
    expected = [sum(np.array(closed_form(3.0, value)) * (1, 3)) for value in (1.0, 3.0)]
    x, y = line(figure, "computed")
    np.testing.assert_allclose(x, [-5.0, 0.0, 1.0, 3.0])
    np.testing.assert_allclose(y, [np.nan, np.nan, *expected], rtol=1e-6)
    assert line(figure, "failed")[0].tolist() == [0.0]
    assert line(figure, "unstable")[0].tolist() == [-5.0]
    two = reported(study, plan(grid={"quantity": [gain, tau]}), tmp_path / "two")
    assert two.tables["members.csv"][1]["status"] == "failed"
    assert two.tables["members.csv"][1]["peak |mean| + 3 sigma of x (1)"] == ""
    largest = max(
        float(r["peak |mean| + 3 sigma of x (1)"]) for r in two.tables["members.csv"] if r["status"] != "failed"
    )
    assert re.search(rf"largest │ +{largest:.4g} │ +4 │ +-5 │", two.text)
    figure = grid_figure(two.result, measures(two.result), "x")
    assert labelled(figure)[:2] == ("gain", "tau")
    assert "peak |mean| + 3σ x (1)" in labelled(figure)
    assert line(figure, "nominal").ravel().tolist() == [GAIN, TAU]
    (contours,) = figure.axes[0].collections
    corners = [np.asarray(path.vertices).tolist() for path in contours.get_paths()]
    assert [4.0, 3.0] in [found for found in corners if found][-1]  # where gain and tau are largest
    points = {tuple(p) for p in line(figure, "computed").T.tolist()}
    assert points == {(4.0, 1.0), (4.0, 3.0), (2.0, 1.0), (2.0, 3.0)}


def test_every_response_gets_its_files(as504, tmp_path):
    """In the units people read: MN m and degrees."""
    given = {"format": 1, "title": "t", "times": "70,75", "responses": ["bending_moment", "engine_angle"]}
    given["grid"] = {"quantity": [{"name": "reference_area", "values": [75.0, 85.0]}]}
    result = run_parameter_study(given, tmp_path, study=as504)
    written = report(result, tmp_path, Console(file=io.StringIO()))
    names = [f"grid_{r}.{kind}" for r in given["responses"] for kind in ("png", "svg")]
    assert sorted(p.name for p in written) == sorted(["members.csv", *names])
    assert all(p.stat().st_size > 10_000 for p in written if p.suffix == ".png")
    for response, label, factor in (("bending_moment", "MN m", 1e-6), ("engine_angle", "deg", 180 / np.pi)):
        figure = grid_figure(result, measures(result), response)
        assert labelled(figure) == ("reference_area (m2)", f"peak |mean| + 3σ {response.replace('_', ' ')} ({label})")
        part = result.data.sel(response=response)
        peaks = (abs(part["mean"]) + 3 * part["std"].sel(source="combined")).values.max(axis=1)
        np.testing.assert_allclose(line(figure, "computed")[1], factor * peaks)
