"""Levels of any probability over the end times, in memory and in files."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import xarray as xr
from lag import closed_form, lag
from scipy.stats import foldnorm, norm

from ascentwind.model.errors import ParameterValueError, UnknownNameError
from ascentwind.runners.statistics.files import COLUMNS
from ascentwind.runners.statistics.results import ResponseStatistics

TIMES = [1.0, 3.0, 9.0]


@pytest.fixture(scope="module")
def statistics(cache) -> ResponseStatistics:
    return lag().response_statistics(TIMES, engine="covariance")


def test_one_side_is_mean_and_quantile_of_the_closed_form(statistics):
    mean, std = closed_form(np.array(TIMES))
    for p in (0.3, 0.01, 1e-6):
        upper, lower = (statistics.percentile(p, sides) for sides in ("upper", "lower"))
        np.testing.assert_allclose(upper.sel(response="x"), mean + norm.isf(p) * std, rtol=1e-6)
        np.testing.assert_allclose(lower.sel(response="x"), -mean + norm.isf(p) * std, rtol=1e-6)
        assert set(upper["side"].values.ravel()) == {"upper"}
        assert set(lower["side"].values.ravel()) == {"lower"}


def test_both_sides_are_the_folded_normal_with_its_side_named(statistics):
    mean, std = closed_form(np.array(TIMES))
    found = statistics.percentile(0.05)
    assert found.dims == ("time", "response")
    np.testing.assert_allclose(found.sel(response="x"), foldnorm.isf(0.05, mean / std, scale=std), rtol=1e-6)
    assert set(found["side"].values.ravel()) == {"upper"}
    assert found.attrs["probability"] == 0.05
    assert found.attrs["sides"] == "both"
    mirrored = lag().with_parameters({"level": -1.5}).response_statistics(TIMES, engine="covariance")
    other = mirrored.percentile(0.05)
    np.testing.assert_allclose(other, found, rtol=1e-9)
    assert set(other["side"].values.ravel()) == {"lower"}


def test_three_sigma_has_its_own_probability(statistics):
    found = statistics.percentile(float(norm.sf(3.0)), "upper", source="gust")
    expected = statistics.mean_plus_3sigma.sel(source="gust")
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_batch_and_a_part_keep_their_dimensions(statistics):
    batch = lag().batch([{"gain": 2.0}, {"gain": 3.0}], TIMES)
    assert batch.percentile(0.01).dims == ("member", "time", "response")
    np.testing.assert_allclose(batch.percentile(0.01).sel(member=1), statistics.percentile(0.01), rtol=1e-5)
    part = statistics.sel(response="x", source="combined", time=3.0)
    assert float(part.percentile(0.01)) == pytest.approx(float(statistics.percentile(0.01).sel(time=3.0)[0]))


def test_what_cannot_be_asked_is_refused(statistics):
    for p in (0.0, 1.0, -1.0, float("nan"), "many"):
        with pytest.raises(ParameterValueError):
            statistics.percentile(p)
        with pytest.raises(ParameterValueError):
            statistics.with_percentiles([0.1, p])
    with pytest.raises(UnknownNameError, match="upper"):
        statistics.percentile(0.1, "uper")
    with pytest.raises(UnknownNameError, match="gust"):
        statistics.percentile(0.1, source="gusts")
    with pytest.raises(UnknownNameError, match="gust"):
        statistics.sel(source="gust").percentile(0.1)


def test_files_hold_levels_where_they_were_asked_for(statistics, tmp_path):
    statistics.save(tmp_path / "plain")
    header = next(csv.reader((tmp_path / "plain" / "statistics.csv").open()))
    assert tuple(header) == COLUMNS
    asked = statistics.with_percentiles([0.05, 0.00135])
    asked.save(tmp_path / "asked")
    rows = list(csv.DictReader((tmp_path / "asked" / "statistics.csv").open()))
    assert list(rows[0])[len(COLUMNS) :] == ["level_0.05", "level_0.00135"]
    row = next(r for r in rows if r["time_s"] == "3" and r["source"] == "combined")
    for p in (0.05, 0.00135):
        assert float(row[f"level_{p}"]) == pytest.approx(float(statistics.percentile(p).sel(time=3.0)[0]), rel=1e-8)
    with xr.open_dataset(tmp_path / "asked" / "statistics.nc", engine="scipy") as stored:
        assert stored["x_level"].dims == ("time", "source", "probability")
        assert stored["x_level"].attrs["units"] == stored["x_std"].attrs["units"]
    again = ResponseStatistics.open(tmp_path / "asked")
    xr.testing.assert_allclose(again.dataset, asked.dataset, rtol=1e-14)
    assert {"level", "probability"}.isdisjoint(ResponseStatistics.open(tmp_path / "plain").dataset.variables)
