"""Resultants of two planes: a small system in closed form, AS-504 against single planes and by azimuth, bad input."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from lag import lag
from planes import EACH, HORIZONTAL, in_both, in_one
from scipy.stats import ncx2

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.model.errors import ParameterValueError, PlanesError, UnknownNameError
from ascentwind.model.wind.two_components import TwoComponentFilter, TwoComponentWind
from ascentwind.runners.statistics.norm import LIKE_3_SIGMA, NormOfNormal
from ascentwind.runners.statistics.resultant_figures import direction_figure, history_figure

TIMES = np.arange(40.0, 121.0, 20.0)
MOMENTS = ["pitch_bending_moment", "yaw_bending_moment"]
PUSH = 1.5


def two_lags(common: float = 0.0) -> aw.Study:
    """x' = -x + w + push and y' = -y + w', with a part of the noise in common: stationary variance 1/2, mean push."""
    t, x, y, n, m, u = (ca.SX.sym(name) for name in ("t", "x", "y", "n", "m", "u"))
    system = define_system(
        "two_lags",
        time=t,
        states={"x": (x, -x + n + u), "y": (y, -y + common * n + np.sqrt(1 - common**2) * m)},
        noises={"n": n, "m": m},
        outputs={"pitch_load": x, "yaw_load": y, "pitch_other": x, "yaw_other": 2 * y, "alone": x + y},
        inputs={"u": (u, ca.SX(PUSH))},
        end=40.0,
    )
    units = {"pitch_load": "N", "yaw_load": "N", "pitch_other": "N", "yaw_other": "m"}
    outputs = tuple(replace(o, unit=units.get(o.name, "1")) for o in system.outputs)
    return aw.Study.from_system(replace(system, outputs=outputs), compile=False)


@pytest.fixture(scope="module")
def small():
    return two_lags().response_statistics([1.0, 20.0], engine="covariance")


@pytest.mark.parametrize("p", [0.1, LIKE_3_SIGMA, 1e-9])
def test_equal_planes_without_correlation_are_rice(small, p):
    found = small.resultants([p], ["resultant_load"]).dataset["level"].values[:, 0, 0, 0]
    for level, time in zip(found, (1.0, 20.0), strict=True):
        variance, mean = (1 - np.exp(-2 * time)) / 2, PUSH * (1 - np.exp(-time))
        assert ncx2.sf(level**2 / variance, 2, mean**2 / variance) == pytest.approx(p, rel=1e-5)


def test_resultants_hold_both_means_and_covariances_by_source():
    statistics = two_lags(common=0.6).response_statistics([20.0], engine="covariance")
    data = statistics.resultants([0.01], ["resultant_load"], sources=["n", "m", "combined"]).dataset.sel(
        resultant="resultant_load"
    )
    np.testing.assert_allclose(data["plane_mean"].values[0], [PUSH, 0.0], atol=1e-8)
    expected = {"n": [[0.5, 0.3], [0.3, 0.18]], "m": [[0.0, 0.0], [0.0, 0.32]], "combined": [[0.5, 0.3], [0.3, 0.5]]}
    for source, matrix in expected.items():
        np.testing.assert_allclose(data["plane_covariance"].sel(source=source).values[0], matrix, atol=1e-8)
    combined = data.sel(source="combined").isel(time=0)
    assert (float(combined["major"]), float(combined["minor"])) == pytest.approx((np.sqrt(0.8), np.sqrt(0.2)))
    assert float(combined["axis"]) == pytest.approx(np.pi / 4)
    assert float(combined["rms"]) == pytest.approx(np.sqrt(1 + PUSH**2))


def test_peaks_and_files(small, tmp_path):
    both = small.resultants([0.01, 1e-4], ["resultant_load"])
    (peak,) = both.peaks(1e-4)
    assert peak.time == 20.0 and peak.at_end
    assert peak.value == pytest.approx(float(both.norm("resultant_load").percentile(1e-4)[1]))
    netcdf, table = both.save(tmp_path)
    rows = table.read_text().splitlines()
    assert len(rows) == 1 + 2 * 2 and rows[0].startswith("time_s,resultant,unit,source,probability,mean_pitch,mean_yaw")
    assert netcdf.stat().st_size > 0
    for figure in (history_figure, direction_figure):
        assert figure(both, "resultant_load", "two lags").axes


def test_different_units_have_no_norm(small):
    with pytest.raises(ParameterValueError, match="'pitch_other' is in N and 'yaw_other' in m"):
        small.norm("pitch_other", "yaw_other")
    with pytest.raises(ParameterValueError, match="no norm"):
        small.resultants()


def test_one_plane_has_no_resultant():
    statistics = lag().response_statistics([1.0], engine="covariance")
    with pytest.raises(PlanesError, match="both planes"):
        statistics.resultants()


def test_names_are_near_misses(small):
    with pytest.raises(UnknownNameError, match="did you mean 'pitch_load'"):
        small.norm("pitch_lod", "yaw_load")
    with pytest.raises(UnknownNameError, match="did you mean 'resultant_load'"):
        small.resultants(names=["resultant_lod"])
    with pytest.raises(UnknownNameError, match="noise source"):
        small.norm("pitch_load", "yaw_load", "wind")
    with pytest.raises(ParameterValueError, match="probability of 2"):
        small.resultants([2.0])


def test_an_engine_without_covariances_is_told():
    statistics = two_lags().response_statistics([1.0], engine="cvodes")
    with pytest.raises(ParameterValueError, match="cvodes does not give"):
        statistics.norm("pitch_load", "yaw_load")


# ---- AS-504 ----


@pytest.fixture(scope="module")
def horizontal():
    return aw.Study.from_vehicle(in_both(HORIZONTAL))


def moments(study: aw.Study, tolerance: float = 1e-9) -> NormOfNormal:
    return study.response_statistics(TIMES, engine=aw.Sweep(relative_tolerance=tolerance)).norm(*MOMENTS)


@pytest.mark.slow
@pytest.mark.parametrize("azimuth", [0.0, 1.0, 3.5, 6.2])
def test_no_percentile_depends_on_the_azimuth_with_horizontal_wind_in_pitch(horizontal, azimuth):
    tight = 1e-11
    before = moments(horizontal, tight)
    after = moments(horizontal.with_parameters({"wind.azimuth": azimuth}), tight)
    turned = azimuth - horizontal.parameters["wind.azimuth"].value
    for p in (0.1, LIKE_3_SIGMA, 1e-6):
        level = before.percentile(p)
        np.testing.assert_allclose(after.percentile(p), level, rtol=1e-9)
        apart = after.direction(level).most_likely - before.direction(level).most_likely + turned
        np.testing.assert_allclose(np.angle(np.exp(1j * apart)), 0.0, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("plane", "component"), [("yaw", "zonal"), ("pitch", "meridional")])
def test_azimuth_zero_and_a_deviation_each_are_the_single_planes(plane, component):
    """The matrices are equal to 1e-12 (tests/model/equations/test_planes.py); here what integration makes of them."""
    engine = aw.Sweep(relative_tolerance=1e-11)
    joint = aw.Study.from_vehicle(in_both(HORIZONTAL | EACH, independent=True)).with_parameters({"wind.azimuth": 0.0})
    alone = aw.Study.from_vehicle(in_one(plane, component, HORIZONTAL))
    found = joint.response_statistics(TIMES, engine=engine)
    expected = alone.response_statistics(TIMES, engine=engine)
    for name in ("bending_moment", "angle_of_attack", "engine_angle"):
        for quantity in ("mean", "std"):
            np.testing.assert_allclose(
                found[quantity].sel(response=f"{plane}_{name}").values,
                expected[quantity].sel(response=name).values,
                rtol=3e-9,
            )
    covariance = found.norm(*MOMENTS).covariance
    np.testing.assert_allclose(covariance[:, 0, 1] / np.sqrt(covariance[:, 0, 0] * covariance[:, 1, 1]), 0, atol=1e-12)


@pytest.mark.slow
def test_the_same_filter_in_both_components_makes_planes_equal_and_independent(horizontal):
    vehicle = in_both(HORIZONTAL)
    wind = vehicle.wind
    assert isinstance(wind, TwoComponentWind)
    f = wind.filters
    same = TwoComponentFilter(
        f.zonal, replace(f.zonal, origin=None), replace(f.noise_correlation, values=0 * f.noise_correlation.values), 0.0
    )
    still = {
        c: replace(part, mean=replace(part.mean, values=0 * part.mean.values)) for c, part in wind.components.items()
    }
    study = aw.Study.from_vehicle(replace(vehicle, wind=replace(wind, filters=same, record=None, **still)))
    for azimuth in (0.4, 2.0):
        covariance = moments(study.with_parameters({"wind.azimuth": azimuth})).covariance
        scale = covariance[:, 0, 0]
        np.testing.assert_allclose(covariance[:, 1, 1] / scale, 1.0, atol=1e-7)
        np.testing.assert_allclose(covariance[:, 0, 1] / scale, 0.0, atol=1e-7)


@pytest.mark.slow
def test_mirrored_wind_and_azimuth_have_the_same_resultant(horizontal):
    """v -> -v and Az -> 180 deg - Az is a mirror in the east-west line."""
    study = aw.Study.load("as504", changes={"planes": "both"})
    vehicle = study.vehicle_for("a mirror")
    wind = vehicle.wind
    assert isinstance(wind, TwoComponentWind)
    f = wind.filters
    south = replace(wind.meridional, mean=replace(wind.meridional.mean, values=-wind.meridional.mean.values))
    r = replace(f.noise_correlation, values=-f.noise_correlation.values)
    mirrored = replace(
        wind, meridional=south, filters=TwoComponentFilter(f.zonal, f.meridional, r, -f.start_correlation)
    )
    other = aw.Study.from_vehicle(replace(vehicle, wind=mirrored))
    azimuth = study.parameters["wind.azimuth"].value
    other = other.with_parameters({"wind.azimuth": np.pi - azimuth})
    np.testing.assert_allclose(moments(other).percentile(), moments(study).percentile(), rtol=1e-8)


@pytest.mark.slow
def test_bounds_and_what_is_no_percentile(horizontal):
    law = moments(horizontal)
    level = law.percentile()
    angle = np.linspace(0, 2 * np.pi, 721)
    e = np.stack([np.cos(angle), np.sin(angle)])
    support = (law.mean @ e + 3 * np.sqrt(np.einsum("it,kij,jt->kt", e, law.covariance, e))).max(axis=1)
    sigma = np.sqrt(np.einsum("kii->ki", law.covariance))
    crude = np.linalg.norm(np.abs(law.mean) + 3 * sigma, axis=1)
    assert (support <= level).all() and (level < crude).all()


@pytest.mark.slow
def test_cvodes_and_the_covariance_equation_agree():
    """CVODES gives no covariance between responses: that of two follows from the variance of their sum."""
    study = aw.Study.load("as504", changes={"planes": "both"})
    by_sweep = study.response_statistics([75.0], engine=aw.Sweep(relative_tolerance=1e-10)).norm(*MOMENTS).percentile()
    by_equation = study.response_statistics([75.0], responses=MOMENTS, engine="covariance").norm(*MOMENTS).percentile()
    np.testing.assert_allclose(by_equation, by_sweep, rtol=1e-6)
    rows = [study.system.output_index(name) for name in MOMENTS]
    system = study.system
    sum_of_both = replace(system.outputs[rows[0]], name="sum")
    summed = replace(
        system,
        output=ca.vertcat(system.output, system.output[rows[0]] + system.output[rows[1]]),
        outputs=(*system.outputs, sum_of_both),
    )
    by_cvodes = aw.Study.from_system(summed).response_statistics([75.0], responses=[*MOMENTS, "sum"], engine="cvodes")
    variance = by_cvodes.variance.sel(source="combined").values[0]
    mixed = (variance[2] - variance[0] - variance[1]) / 2
    law = NormOfNormal(by_cvodes.mean.values[0, :2, -1], np.array([[variance[0], mixed], [mixed, variance[1]]]))
    np.testing.assert_allclose(law.percentile(), by_sweep[0], rtol=1e-6)


@pytest.mark.slow
def test_simulated_flights_pass_the_level_as_often():
    study = aw.Study.load("as504", changes={"planes": "both"})
    law = study.response_statistics([75.0]).norm(*MOMENTS)
    runs, p = 20_000, 0.05
    flown = study.response_statistics(
        [75.0], engine=aw.Ensemble(runs=runs, paths=runs, path_spacing=100.0, substep=0.1)
    )
    at = flown.dataset["sample_path"].sel(response=MOMENTS).isel(t=-1).values
    beyond = (np.linalg.norm(at, axis=1) > law.percentile(p)).mean()
    assert abs(beyond - p) < 2.576 * np.sqrt(p * (1 - p) / runs)


def test_a_history_is_drawn_finely_and_says_the_peak_of_the_times_asked(small):
    fine = two_lags().response_statistics(np.linspace(1.0, 20.0, 30), engine="covariance")
    both, smooth = (s.resultants([0.01], ["resultant_load"]) for s in (small, fine))
    axes = history_figure(both, "resultant_load", "two lags", smooth).axes[0]
    level = smooth.dataset["level"].values[:, 0, 0, 0]
    np.testing.assert_allclose(np.asarray(axes.get_lines()[0].get_ydata(), float), level)
    assert f"{both.peaks(0.01)[0].value:.3g} N at 20 s" in {text.get_text() for text in axes.texts}
