"""Availability by month and azimuth: against a study in that wind, symmetry, intervals, the check, and bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planes import in_both

import ascentwind as aw
from ascentwind.model.errors import DataError, ParameterValueError, UnknownNameError
from ascentwind.model.tables import Table
from ascentwind.model.wind.month_winds import MONTHS, MonthWind, month_file, read_month, read_months
from ascentwind.model.wind.range_reference import shipped_two_components
from ascentwind.model.wind.statistics import WindModel
from ascentwind.model.wind.two_components import TwoComponentFilter, TwoComponentWind, plane_weights
from ascentwind.runners.flight_load.limit_table import LimitError
from ascentwind.runners.measured_winds.random_wind import filter_wind

WINDOW = (60.0, 90.0)
LIMITS = aw.Limits.over_time([0.0, 150.0], {"bending_moment": [1.5e7, 1.5e7]}, {"bending_moment": "N m"})


def test_twelve_months_ship_and_are_those_of_their_tables():
    """Covariances of both components by their rms, u-v correlation at one level inside 90 % of its sampling, means."""
    found = read_months(None)
    assert [month.period for month in found] == list(MONTHS)
    for month in found:
        both = shipped_two_components(month.period, top=30000.0)
        h = both.zonal.altitude
        for weights, part, mean in (
            ((1.0, 0.0), both.zonal, month.mean[0]),
            ((0.0, 1.0), both.meridional, month.mean[1]),
        ):
            R = filter_wind(month.filter_along(weights), h, 0 * h).covariance
            assert np.sqrt(np.mean((R - part.covariance) ** 2)) < 0.2, month.period  # m2/s2, of some hundred
            np.testing.assert_allclose(np.sqrt(np.diagonal(R)), part.standard_deviation, rtol=1e-4)
            np.testing.assert_allclose(mean, part.mean, atol=1e-6)
        together = np.diagonal(filter_wind(month.filter_along((1.0, 1.0)), h, 0 * h).covariance)
        u, v = both.zonal.standard_deviation, both.meridional.standard_deviation
        correlation = (together - u**2 - v**2) / (2 * u * v)
        inside = 1.645 / np.sqrt(month.independent_samples)  # 90 % of a correlation of as many soundings
        assert np.abs(correlation - both.intralevel_correlation).max() < inside
        assert month.independent_samples == 80


def test_what_is_written_is_read_back(tmp_path):
    march = read_months(None, ["march"])[0]
    file = tmp_path / month_file("march")
    file.write_text(march.text())
    again = read_month(file)
    assert again.text() == march.text()
    assert isinstance(again, MonthWind)


@pytest.mark.slow
def test_a_month_is_what_a_study_in_that_wind_says(as504):
    """February at 85 deg: the same wind put into the vehicle as one filter of six states, and its limit passage."""
    azimuth = np.radians(85.0)
    found = as504.availability(LIMITS, months=["february"], azimuths=[azimuth], window=WINDOW, draws=4000)
    (month,), weights = read_months(None, ["february"]), plane_weights(azimuth, "yaw")
    h = month.altitude
    wind = WindModel(Table("wind.mean", "m/s", h, month.mean_along(weights, h), "pchip"), month.filter_along(weights))
    with pytest.warns(aw.errors.ExtrapolationWarning):
        study = as504.with_wind(wind)
    wanted = study.limit_passage(LIMITS, WINDOW, draws=4000).probability
    spread = np.hypot(wanted.standard_error, float(found["standard_error"][0, 0]))
    assert float(found["probability"][0, 0]) == pytest.approx(wanted.value, abs=4 * spread + 0.06 * wanted.value)


@pytest.mark.slow
def test_a_month_of_both_planes_is_what_a_study_in_that_wind_says(cache):
    """February at 95 deg, 23 deg off the vehicle's own: both filters and their correlation put into the vehicle."""
    moments = ["pitch_bending_moment", "yaw_bending_moment"]
    limits = aw.Limits.over_time([0.0, 150.0], {n: [2e7, 2e7] for n in moments}, dict.fromkeys(moments, "N m"))
    azimuth, vehicle = np.radians(95.0), in_both()
    both = aw.Study.from_vehicle(vehicle)
    found = both.availability(limits, months=["february"], azimuths=[azimuth], window=WINDOW, draws=4000)
    (month,) = read_months(None, ["february"])
    zonal, meridional = (
        WindModel(Table(old.name, "m/s", month.altitude, mean, "pchip"), part)
        for old, mean, part in zip(vehicle.wind.means, month.mean, (month.zonal, month.meridional), strict=True)
    )
    filters = TwoComponentFilter(month.zonal, month.meridional, month.noise_correlation, month.start_correlation)
    study = aw.Study.from_vehicle(replace(vehicle, wind=TwoComponentWind(zonal, meridional, filters)))
    study = study.with_parameters({"wind.azimuth": azimuth})
    wanted = study.limit_passage(limits, WINDOW, draws=4000).probability
    spread = np.hypot(wanted.standard_error, float(found["standard_error"][0, 0]))
    assert float(found["probability"][0, 0]) == pytest.approx(wanted.value, abs=4 * spread + 0.06 * wanted.value)
    levels = study.response_statistics(np.arange(60.0, 90.1, 0.5), responses=moments).percentile(0.00135)
    for name in moments:
        assert found["level"].sel(response=name).item() == pytest.approx(
            float(levels.sel(response=name).max()), rel=5e-3
        )


@pytest.fixture(scope="module")
def months(as504):
    return as504.availability(LIMITS, months=["january", "june"], azimuths=np.radians([50.0, 110.0]), window=WINDOW)


def test_winter_is_worse_than_summer_and_intervals_hold_their_value(months):
    p = months["probability"].values
    assert (p[0] > 3 * p[1]).all()
    assert ((months["lower"] < months["probability"]) & (months["probability"] < months["upper"])).all()
    assert months.attrs["site"] == "Cape Canaveral"
    assert months["level"].sizes == {"month": 2, "azimuth": 2, "response": 1}


def test_a_launch_the_other_way_is_its_mirror(as504):
    """Az + 180 deg turns the sign of the wind: the response without wind's known inputs aside, the same chances."""
    pair = as504.availability(LIMITS, months=["march"], azimuths=np.radians([60.0, 240.0]), window=WINDOW)
    p, se = pair["probability"].values[0], pair["standard_error"].values[0]
    assert p[0] == pytest.approx(p[1], abs=4 * np.hypot(*se))


def test_a_check_stops_the_bad_days(as504):
    found = as504.availability(
        LIMITS, months=["february"], azimuths=[np.radians(72.0)], window=WINDOW, check_hours=2.0, threshold=0.02
    )
    p, stopped, remains = (float(found[k][0, 0]) for k in ("probability", "stopped", "remaining_risk"))
    assert 0 < stopped < 0.8
    assert remains < 0.5 * p
    late = as504.availability(
        LIMITS, months=["february"], azimuths=[np.radians(72.0)], window=WINDOW, check_hours=0.5, threshold=0.02
    )
    assert float(late["remaining_risk"][0, 0]) <= remains * 1.5


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ({"months": ["marsh"]}, UnknownNameError, "no month 'marsh'; did you mean 'march'"),
        ({"azimuths": []}, ParameterValueError, "azimuths are finite numbers"),
        ({"azimuths": [72.0]}, DataError, "are these degrees"),
        ({"threshold": 2.0}, ParameterValueError, "threshold = 2.0"),
        ({"check_hours": -1.0}, ParameterValueError, "a check -1.0 h before launch"),
        ({"limits": aw.Limits.constant(1.0, "bending_moment", "kN m")}, LimitError, r"\[kN m\], expected \[N m\]"),
        ({"limits": aw.Limits.constant(1.0, "moment", "N m")}, LimitError, "did you mean 'bending_moment'"),
        ({"winds": "nowhere"}, DataError, "nowhere: holds no month"),
    ],
)
def test_what_cannot_be_answered_is_refused(as504, change, error, says):
    asked = {"limits": LIMITS, "months": ["march"], "window": WINDOW} | change
    with pytest.raises(error, match=says):
        as504.availability(asked.pop("limits"), **asked)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"format":1', '"format":2', "has format 2; this version reads 1"),
        ('"start_correlation"', '"start"', "lacks 'start_correlation'; write months with 'ascentwind wind months'"),
        ('"H_m_per_s":[[', '"H_m_per_s":[["x",', "is not the wind of a month"),
        ("{", "", "is not the wind of a month"),
    ],
)
def test_spoilt_files_are_named(tmp_path, old, new, says):
    text = read_months(None, ["march"])[0].text()
    assert old in text
    (tmp_path / "march.json").write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=f"march.json: {says}"):
        read_months(tmp_path)


def test_months_of_a_folder(tmp_path):
    march = read_months(None, ["march"])[0]
    (tmp_path / "march.json").write_text(march.text())
    assert [month.period for month in read_months(tmp_path)] == ["march"]
    with pytest.raises(DataError, match="holds no april; it has march"):
        read_months(tmp_path, ["april"])
    (tmp_path / "april.json").write_text(march.text().replace("Cape Canaveral", "Kourou").replace('"march"', '"april"'))
    with pytest.raises(DataError, match="months of Cape Canaveral and Kourou"):
        read_months(tmp_path)
