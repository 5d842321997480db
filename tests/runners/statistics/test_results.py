"""Response statistics as an object, and every netCDF file that is written, read back with plain xarray."""

import pickle
import warnings

import numpy as np
import pytest
import xarray as xr
from lag import lag, plan

from ascentwind.model.errors import (
    AscentwindError,
    DataError,
    DeprecatedNameWarning,
    ParameterValueError,
    UnknownNameError,
)
from ascentwind.model.wind.range_reference import shipped_statistics
from ascentwind.runners.sensitivity.layout import stored_layout
from ascentwind.runners.station_loads.loads_along_vehicle import loads_along_vehicle
from ascentwind.runners.statistics.peak_check import check_peaks, with_peak_check
from ascentwind.runners.statistics.results import ResponseStatistics
from ascentwind.runners.study import Study
from ascentwind.runners.views.mean_comparison import mean_comparison


@pytest.fixture(scope="module")
def statistics(as504) -> ResponseStatistics:
    found = as504.response_statistics([40.0, 45.0], engine="covariance")
    return with_peak_check(found, check_peaks(as504, found), as504)


def plain(path) -> xr.Dataset:
    with xr.open_dataset(path, engine="scipy") as stored:
        return stored.load()


def one_unit_each(dataset: xr.Dataset) -> None:
    """Every number has a unit of its own, or is a count; pint reads them all where it is installed."""
    assert dataset.attrs["Conventions"].startswith("CF-")
    assert dataset.attrs["history"].startswith("ascentwind ")
    for name in dataset.data_vars:
        unit = dataset[name].attrs.get("units")
        assert unit or dataset[name].dtype.kind in "iOU", f"{name} has no unit"
        assert not unit or not {";", ":"} & set(unit), f"{name}: {unit}"
    pytest.importorskip("pint_xarray")
    quantified = dataset.pint.quantify()
    for name in dataset.data_vars:
        if dataset[name].attrs.get("units"):
            assert quantified[name].pint.units is not None, name


def test_the_file_of_a_run(statistics, tmp_path):
    statistics.save(tmp_path)
    stored = plain(tmp_path / "statistics.nc")
    one_unit_each(stored)
    for read in (stored, statistics, ResponseStatistics.open(tmp_path / "statistics.nc")):  # README's line
        sigma = read["bending_moment_std"].sel(source="wind", time=45)
        assert sigma == statistics.std.sel(response="bending_moment", source="wind", time=45)
    units = {
        "mean": "N m",
        "variance": "N^2 m^2",
        "peak": "N m",
        "peak_time": "s",
        "peak_noise_weighting": "N m s^-0.5",
    }
    for quantity, unit in units.items():
        assert stored[f"bending_moment_{quantity}"].attrs["units"] == unit
    assert stored["bending_moment_angle_of_attack_covariance"].attrs["units"] == "N m rad"
    assert stored["bending_moment_peak_input_weighting"].attrs["units"] == "N"  # per m/s and s


def test_open_gives_back_what_was_saved(statistics, tmp_path):
    statistics.save(tmp_path)
    again = ResponseStatistics.open(tmp_path)
    xr.testing.assert_allclose(again.dataset, statistics.dataset, rtol=1e-14)
    assert again.std.dims == statistics.std.dims
    assert again.attrs == statistics.attrs
    for name in statistics.dataset.variables:
        assert again.dataset[name].attrs == statistics.dataset[name].attrs
    assert [p.value for p in again.peaks()] == [p.value for p in statistics.peaks()]
    again.save(tmp_path / "twice")
    xr.testing.assert_identical(plain(tmp_path / "twice" / "statistics.nc"), plain(tmp_path / "statistics.nc"))
    assert (tmp_path / "twice" / "statistics.csv").read_bytes() == (tmp_path / "statistics.csv").read_bytes()


@pytest.mark.slow
def test_other_files_have_one_unit_a_variable(as504, tmp_path):
    from ascentwind.runners.present.netcdf import write_netcdf

    sensitivity = as504.sensitivity("bending_moment", 40.0, quantity="variance")
    files = {
        "sensitivity": stored_layout(sensitivity),
        "along_vehicle": loads_along_vehicle(as504, [40.0, 45.0]),
        "mean": mean_comparison(as504),
    }
    for name, dataset in files.items():
        write_netcdf(dataset, tmp_path / f"{name}.nc")
        one_unit_each(plain(tmp_path / f"{name}.nc"))
    stored = plain(tmp_path / "sensitivity.nc")
    gain = stored["reference_area_derivative"]
    assert gain.attrs["units"] == "N^2"  # (N m)^2 by m^2
    assert gain == sensitivity["derivative"].sel(parameter="reference_area")
    grouped = stored["aerodynamics_grouped_factor_derivative"]
    assert grouped.attrs["units"] == "N^2 m^2"
    assert grouped == sensitivity["grouped_factor_derivative"].sel(grouped_factor="aerodynamics")
    mass = sensitivity.isel(knot=sensitivity["knot_table"].values == "mass")
    np.testing.assert_array_equal(stored["mass_knot_derivative"], mass["knot_derivative"])
    assert stored["mass_knot_derivative"].attrs["units"] == "N^2 m^2 kg^-1"
    np.testing.assert_array_equal(stored["elasticity"], sensitivity["elasticity"])


def test_the_file_of_a_parameter_study(cache, tmp_path):
    from ascentwind.runners.parameter_study.run import run_parameter_study

    given = plan(grid={"quantity": [{"name": "gain", "values": [2.0, 3.0]}]})
    found = run_parameter_study(given, tmp_path, study=lag())
    stored = plain(tmp_path / "study.nc")
    one_unit_each(stored)
    assert stored["gain_value"].values.tolist() == [2.0, 3.0]
    np.testing.assert_array_equal(stored["x_std"], found.data["std"].sel(response="x"))


def test_a_batch_keeps_its_parameter_values(as504, tmp_path):
    sets = [{"thrust.sigma": 0.005}, {"thrust.sigma": 0.02, "control.T1.gain": 0.8}]
    batch = as504.batch(sets, times=[40.0])
    assert batch.dataset["thrust.sigma"].values.tolist() == [0.005, 0.02]
    assert batch.dataset["control.T1.gain"].values.tolist() == [as504.parameters["control.T1.gain"].value, 0.8]
    assert batch.std.sel(member=1, response="engine_angle")["thrust.sigma"] == 0.02
    frame = batch.to_frame()
    assert len(frame) == 2 * 8 * 4
    assert set(frame["thrust.sigma"]) == {0.005, 0.02}
    batch.save(tmp_path)
    one_unit_each(plain(tmp_path / "statistics.nc"))
    again = ResponseStatistics.open(tmp_path)
    xr.testing.assert_allclose(again.dataset, batch.dataset, rtol=1e-14)
    for refused in (batch.peaks, lambda: batch.plot("engine_angle")):
        with pytest.raises(ParameterValueError, match="of a batch"):
            refused()
    assert len(batch.sel(member=1).peaks()) == 8


def test_a_parameter_called_like_a_dimension_stays_apart(cache):
    import casadi as ca

    from ascentwind.model import define_system

    t, x, n, tau = (ca.SX.sym(s) for s in ("t", "x", "n", "tau"))
    parts = {"states": {"x": (x, -x / tau + n)}, "noises": {"n": n}, "outputs": {"x": x}}
    system = define_system("lag", time=t, parameters={"source": (tau, 1.0)}, **parts)
    found = Study.from_system(system).batch([{"source": 2.0}], times=[1.0])
    assert found.dataset["parameter_source"].values.tolist() == [2.0]
    assert "combined" in found.dataset["source"].values


def test_a_table_as_a_frame(statistics):
    frame = statistics.to_frame()
    assert list(frame.columns) == ["time", "response", "unit", "source", "mean", "variance", "std", "mean_plus_3sigma"]
    row = frame[(frame.time == 45) & (frame.response == "engine_angle") & (frame.source == "wind")]
    assert row["std"].item() == float(statistics.std.sel(time=45, response="engine_angle", source="wind"))
    assert row["unit"].item() == "rad"


def test_a_part_is_statistics_again(statistics, tmp_path):
    part = statistics.sel(response="engine_angle", time=45)
    assert part.std.dims == ("source",)
    (peak,) = part.peaks()
    assert (peak.response, peak.time, peak.unit) == ("engine_angle", 45.0, "rad")
    part.save(tmp_path)
    again = ResponseStatistics.open(tmp_path)
    np.testing.assert_array_equal(again.std.values[0, 0], part.std.values)
    assert len(repr(part).splitlines()) < 15
    assert pickle.loads(pickle.dumps(part)).std.equals(part.std)


def test_names_that_are_not_there(statistics, tmp_path):
    for refused in (
        lambda: statistics["bending_moment_sdt"],
        lambda: statistics.sel(response="bending_momnet"),
        lambda: statistics.sel(source=["wind", "thurst"]),
        lambda: statistics.plot("engine_angel"),
    ):
        with pytest.raises(UnknownNameError, match="did you mean"):
            refused()
    with pytest.raises(ParameterValueError, match="all sources together"):
        statistics.sel(source="wind").peaks()
    with pytest.raises(AttributeError, match="no attribute 'stdd'"):
        _ = statistics.stdd


@pytest.mark.parametrize("spoil", ["missing", "text", "other"])
def test_files_that_are_none(tmp_path, spoil):
    path = tmp_path / "statistics.nc"
    if spoil == "text":
        path.write_text("no netCDF")
    elif spoil == "other":
        xr.Dataset({"mean": ("x", [1.0])}).to_netcdf(path, engine="scipy")
    with pytest.raises(DataError, match="statistics.nc") as told:
        ResponseStatistics.open(path)
    assert isinstance(told.value, AscentwindError)


def test_what_a_dataset_had_still_works_and_says_where_it_went(statistics):
    with pytest.warns(DeprecatedNameWarning, match=r"statistics\.dataset\.isel"):
        first = statistics.isel(time=0)
    assert first["time"] == 40.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert statistics.time.values.tolist() == [40.0, 45.0]


def test_what_is_printed_fits_a_screen(as504, statistics, cache):
    batch = ResponseStatistics(statistics.dataset.expand_dims(member=40))
    for shown in (as504, statistics, batch, lag()):
        text, page = repr(shown), shown._repr_html_()
        assert len(text) < 2500
        assert len(text.splitlines()) <= 24
        assert len(page) < 20_000
    parts = (as504.system, as504.executable, as504.vehicle, as504.vehicle.wind, as504.vehicle.wind.shaping_filter)
    for part in (*parts, shipped_statistics(), lag().system):
        assert len(repr(part)) < 2500
        assert len(repr(part).splitlines()) <= 24
    assert repr(as504.system).startswith(f"LinearSystem 'as504': {len(as504.system.states)} states, ")
    assert as504.vehicle.title in repr(as504.vehicle)
    assert "as504" in repr(as504)
    assert "bending_moment [N m]" in repr(as504)
    assert "reference_area = 80" in repr(as504.with_parameters({"reference_area": 80.0}))
    peak = statistics.peaks()[0]
    assert f"{peak.value:.4g}" in repr(statistics)
    named = ResponseStatistics(statistics.dataset.assign_attrs(system="<script>alert()</script>"))
    assert "<script" not in named._repr_html_()


def test_the_figure_of_a_response(statistics):
    (axes,) = statistics.plot("engine_angle").axes
    assert "engine angle" in axes.get_ylabel()
    assert "AS-504" in axes.get_title()
