"""Matrices over time and frozen ones: files read back by others' readers, and frequency responses."""

from __future__ import annotations

import csv
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from jumping_system import END, JUMP, jumping_system
from scipy.io import loadmat
from scipy.signal import freqresp

from ascentwind import errors
from ascentwind.runners import Study
from ascentwind.runners.export.matrix_files import write_matrices
from ascentwind.runners.export.matrix_grid import SHAPES

TIMES = [0.0, 1.0, JUMP, 5.5, END]


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return Study.from_system(jumping_system(), compile=False)


@pytest.fixture(scope="module")
def grid(study) -> xr.Dataset:
    return study.matrix_grid(TIMES)


def test_a_jump_is_there_from_both_sides(study, grid):
    time = grid.time.values
    assert time.size == 6 and (np.diff(time) > 0).all()
    assert time[2] < JUMP <= time[3] and time[3] - time[2] < 1e-13 * JUMP * 1e2
    assert grid.jump.values.tolist() == [JUMP]
    column = grid.B.sel(noise="n", state_rate="x").values
    assert column.tolist() == [3, 3, 3, 6, 6, 6]
    A, B, C, D = study.matrices(5.5)
    at = grid.sel(time=5.5)
    for name, expected in zip("ABCD", (A, B, C, D), strict=True):
        assert np.array_equal(at[name].values, expected)
    assert at.E.values[:, 0].tolist() == [6, 0, 0] and at.G.values[:, 0].tolist() == [0, 1, 0]
    assert grid.u.values[:, 0].tolist() == [1.5] * 6
    assert grid.start_covariance.sel(source="gust", state_rate="x", state="x") == 0.25


@pytest.mark.parametrize(
    ("times", "found"),
    [
        ([JUMP], [6]),  # after it, as study.matrices has it
        ([1.0, JUMP], [3, 3]),  # the end is seen from its left
        ([JUMP, 5.0], [6, 6]),
        ([1.0, 2.0], [3, 3]),
        ([1.0, 5.0], [3, 3, 6, 6]),
        ([0.0], [3]),
    ],
)
def test_ends_of_the_grid_that_are_jumps(study, times, found):
    assert study.matrix_grid(times).B.sel(noise="n", state_rate="x").values.tolist() == found


def test_a_matrix_at_a_time_is_a_labelled_frame(grid):
    frame = grid.A.sel(time=1.0).to_pandas()
    assert isinstance(frame, pd.DataFrame)
    assert frame.loc["v", "y"] == -9 and list(frame.columns) == ["x", "y", "v"]


def test_matlab_file_read_back(grid, tmp_path):
    (path,) = write_matrices(grid, "mat", tmp_path, "system")
    found = loadmat(path)
    for name in SHAPES:
        assert np.array_equal(np.moveaxis(found[name], -1, 0), grid[name].values), name
    assert np.array_equal(found["time"][:, 0], grid.time.values)
    assert [str(cell[0]) for cell in found["response"][:, 0]] == list(grid.response.values)
    assert [str(cell[0]) for cell in found["state_unit"][:, 0]] == ["m", "1", "1"]
    assert np.array_equal(np.moveaxis(found["start_covariance"], -1, 0), grid.start_covariance.values)


def test_netcdf_opens_in_plain_xarray(grid, tmp_path):
    (path,) = write_matrices(grid, "netcdf", tmp_path, "system")
    with xr.open_dataset(path) as found:
        for name in (*SHAPES, "u", "start_covariance", "jump"):
            assert np.array_equal(found[name].values, grid[name].values), name
        assert list(found.response.values) == list(grid.response.values)
        assert found.attrs["end_s"] == END


def test_netcdf_opens_in_pint_xarray(grid, tmp_path):
    pytest.importorskip("pint_xarray")
    (path,) = write_matrices(grid, "netcdf", tmp_path, "system")
    with xr.open_dataset(path) as found:
        assert str(found.pint.quantify()["jump"].pint.units) == "second"


def test_csv_holds_every_entry_that_is_not_zero(grid, tmp_path):
    paths = {path.stem: path for path in write_matrices(grid, "csv", tmp_path, "system")}
    for name, dims in SHAPES.items():
        values = np.zeros_like(grid[name].values)
        table = pd.read_csv(paths[name])
        assert table.iloc[:, 0].values == pytest.approx(grid.time.values, rel=1e-16)
        for column in table.columns[1:]:
            i, j = (int(k) - 1 for k in column[len(name) + 1 : -1].split(","))
            values[:, i, j] = table[column]
        assert np.array_equal(values, grid[name].values), (name, dims)
    with paths["names"].open(newline="") as file:
        rows = list(csv.reader(file))
    assert ["response", "2", "y, in \\ it", "1", "1.0", ""] in rows
    assert ["noise", "2", "m", "", "", 'bu"mp'] in rows
    assert ["jump", "1", "3.0", "s", "", ""] in rows


def frequency_response(study: Study, time: float, omega: float) -> np.ndarray:
    A, B, C, D = study.matrices(time)
    grid = study.matrix_grid([time])
    B, D = np.hstack([B, grid.E.values[0]]), np.hstack([D, grid.G.values[0]])
    return C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, B) + D


@pytest.mark.filterwarnings("ignore")  # of the zeros that SciPy looks for on its way
@pytest.mark.parametrize("time", [1.0, JUMP])
def test_scipy_state_space_has_the_frequency_response(study, time):
    model = study.to_statespace(time, library="scipy")
    for omega in (0.1, 3.0, 40.0):
        expected = frequency_response(study, time, omega)
        for i in range(3):
            for j in range(3):
                alone = type(model)(model.A, model.B[:, [j]], model.C[[i]], model.D[[i]][:, [j]])
                found = freqresp(alone, [omega])[1][0]
                assert found == pytest.approx(expected[i, j], rel=1e-12, abs=1e-12)


def test_python_control_keeps_names_and_frequency_response(study):
    control = pytest.importorskip("control")
    model = study.to_statespace(1.0)
    assert model.state_labels == ["x", "y", "v"]
    assert model.input_labels == ["n", "m", "u"]
    assert model.output_labels == ["x", "y, in \\ it", "white"]
    assert isinstance(model, control.StateSpace)
    for omega in (0.1, 3.0, 40.0):
        assert model(1j * omega) == pytest.approx(frequency_response(study, 1.0, omega), rel=1e-12, abs=1e-12)


def test_python_control_is_missed_by_name(study, monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(errors.MissingLibraryError, match=r"ascentwind\[control\]"):
        study.to_statespace(1.0)
    with pytest.raises(errors.UnknownNameError, match="scipy"):
        study.to_statespace(1.0, library="scipi")


def test_a_system_without_end_needs_times():
    study = Study.from_system(jumping_system(end=float("inf")), compile=False)
    assert study.matrix_grid([1.0]).sizes["time"] == 1
    with pytest.raises(errors.ExportError, match="give times"):
        study.matrix_grid()
    for times in ([-1.0], [float("nan")], []):
        with pytest.raises(errors.TimeRangeError):
            study.matrix_grid(times)
