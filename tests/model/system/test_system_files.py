"""Systems on disk: every format read back to the same system, other people's files, and what is wrong with files."""

from __future__ import annotations

import numpy as np
import pytest
from jumping_system import jumping_system
from scipy.io import savemat

from ascentwind.errors import DataError
from ascentwind.model.system.system_file import read_system
from ascentwind.runners import Study
from ascentwind.runners.export.matrix_files import write_matrices

TOML = 'name = "mine"\ndata = "{}"\n'
TIMES = np.array([0.0, 1.0, 3.0])
A = np.array([[[0.0, 1.0], [-4.0 - t, -0.2]] for t in TIMES])
PAGES = {"time": TIMES, "A": np.moveaxis(A, 0, -1), "B": [[0.0], [1.0]], "C": np.eye(2)}


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return Study.from_system(jumping_system(), compile=False)


def toml(folder, data, more=""):
    file = folder / "system.toml"
    file.write_text(TOML.format(data) + more)
    return file


@pytest.mark.parametrize(("format", "data"), [("netcdf", "x.nc"), ("mat", "x.mat"), ("csv", ".")])
def test_what_was_exported_is_read_back(study, tmp_path, format, data):
    grid = study.matrix_grid([0.0, 1.0, 3.0, 5.5, 8.0])
    write_matrices(grid, format, tmp_path, "x")
    system = read_system(toml(tmp_path, data))
    assert system.state_names == ("x", "y", "v") and system.output_names == ("x", "y, in \\ it", "white")
    assert [n.source for n in system.noises] == ["gust", 'bu"mp'] and system.input_names == ("u",)
    assert system.discontinuities == (3.0,) and (system.start, system.end) == (0, 8)
    assert system.states[0].unit == "m"
    again = Study.from_system(system, compile=False)
    for time in (0.5, 3.0, 6.0):
        for found, expected in zip(again.matrices(time), study.matrices(time), strict=True):
            assert found == pytest.approx(expected, rel=1e-14)
    found, expected = (s.response_statistics([2.0, 7.0], responses=["y, in \\ it"]) for s in (again, study))
    assert found.std.values == pytest.approx(expected.std.values, rel=1e-5)
    assert found.mean.values == pytest.approx(expected.mean.values, rel=1e-5)


def matlab_73(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in PAGES.items():
            file[name] = np.atleast_2d(np.asarray(value, float)).T  # columns first, as MATLAB writes
        cells = file.create_dataset("state", (1, 2), h5py.ref_dtype)
        for k, name in enumerate(("angle", "rate")):
            hidden = file.create_dataset(f"#refs#/{k}", data=np.array([[ord(c)] for c in name], np.uint16))
            cells[0, k] = hidden.ref
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab_files_of_both_versions(tmp_path, version):
    path = tmp_path / "m.mat"
    if version == "5":
        savemat(path, PAGES | {"state": np.array([["angle"], ["rate"]], object)})
    else:
        matlab_73(path)
    system = read_system(toml(tmp_path, "m.mat"))
    assert system.state_names == ("angle", "rate")
    assert [t.values.tolist() for t in system.rows] == [[-4, -5, -7]]


def test_other_names_in_the_file_and_in_the_toml(tmp_path):
    savemat(tmp_path / "m.mat", {"t": TIMES, "Amat": PAGES["A"], "B": PAGES["B"], "C": PAGES["C"]})
    more = '[variables]\ntime = "t"\nA = "Amat"\n[names]\nstates = ["a", "b"]\nnoises = ["n"]\n[sources]\nn = "wind"\n'
    system = read_system(toml(tmp_path, "m.mat", more + '[units]\na = "rad"\n'))
    assert system.state_names == ("a", "b") and system.sources == ("wind",) and system.states[0].unit == "rad"


def csv_folder(folder, **tables):
    given = {
        "A": "time [s],\"A(1,1)\"\n0,-1\n1,-2\n", "B": "time [s],\"B(1,1)\"\n0,1\n1,1\n",
        "C": "time [s],\"C(1,1)\"\n0,1\n1,1\n",
    } | tables  # fmt: skip
    for name, text in given.items():
        if text is not None:
            (folder / f"{name}.csv").write_text(text)
    return toml(folder, ".")


def test_a_folder_of_csv_without_names(tmp_path):
    system = read_system(csv_folder(tmp_path))
    assert system.state_names == ("x1",) and system.rows[0].values.tolist() == [-1, -2]


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"A": None}, "holds no A.csv"),
        ({"A": "time [s],\"A(1,1)\"\n"}, "begins with a header"),
        ({"A": "t [s],\"A(1,1)\"\n0,1\n1,1\n"}, "begins with a header"),
        ({"A": "time [s],\"A(0,1)\"\n0,1\n1,1\n"}, "counted from 1"),
        ({"A": "time [s],\"B(1,1)\"\n0,1\n1,1\n"}, "is no entry"),
        ({"A": "time [s],\"A(1,1)\",\"A(1,1)\"\n0,1,1\n1,1,1\n"}, "is there twice"),
        ({"A": "time [s],\"A(1,1)\"\n0,x\n1,1\n"}, "line 2"),
        ({"A": "time [s],\"A(1,1)\"\n0\n1,1\n"}, "1 cells under 2"),
        ({"A": "time [s],\"A(1,1)\"\n1,1\n0,1\n"}, "times"),
        ({"B": "time [s],\"B(1,1)\"\n0,1\n2,1\n"}, "other times than A.csv"),
        ({"names": "kind,number,name\nstat,1,a\n"}, "did you mean 'state'"),
        ({"names": "kind,number,name\nstate,1,a\n", "A": "time [s],\"A(2,1)\"\n0,1\n1,1\n"}, "row 2"),
        ({"start_covariance": "source,row,column,value\n1,1,1,1\n"}, "names no source"),
    ],
)  # fmt: skip
def test_wrong_folders(tmp_path, tables, says):
    with pytest.raises(DataError) as error:
        read_system(csv_folder(tmp_path, **tables))
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("variables", "more", "says"),
    [
        ({"A": None}, "", "has no variable 'A'"),
        ({"A": None, "Amat": [[1.0]]}, '[variables]\nA = "Amatt"\n', "did you mean 'Amat'"),
        ({"C": np.ones((3, 3))}, "", "C has 3 columns for the 2 states"),
        ({"A": np.ones((2, 2, 4))}, "", "for 3 times"),
        ({"B": [[1j], [0]]}, "", "B is complex"),
        ({"time": [0.0, 2.0, 1.0]}, "", "times decrease"),
        ({}, "[units]\nq = 'm'\n", "'q'"),
        ({}, "interpolaton = 'cubic'\n", "interpolation"),
        ({}, "discontinuities = [9.0]\n", "not between"),
    ],
)
def test_wrong_matlab_files(tmp_path, variables, more, says):
    held = {name: value for name, value in (PAGES | variables).items() if value is not None}
    savemat(tmp_path / "m.mat", held)
    with pytest.raises(DataError) as error:
        read_system(toml(tmp_path, "m.mat", more))
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("m.mat", b"no matlab", "cannot be read as a MATLAB file"),
        ("m.nc", b"no netcdf", "cannot be read as netCDF"),
        ("m.txt", b"", "neither a .nc nor a .mat"),
        ("m.mat", None, "is not there"),
    ],
)
def test_files_that_are_none(tmp_path, name, content, says):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(DataError) as error:
        read_system(toml(tmp_path, name))
    assert says in str(error.value)
