"""The exported C library: its numbers against the engine's and closed forms, its codes, and compilers and checkers."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from jumping_system import END, GAIN, JUMP, TAU, jumping_system

from ascentwind.codegen.export.source import ExportError, c_string, library_prefix
from ascentwind.codegen.toolchain.compiler import find_compiler, optimizing
from ascentwind.runners import Study
from ascentwind.runners.export.c_library import c_library, write_texts

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
OK, NULL, NO_TIMES, NAN_TIME, ORDER, OFF, TOLERANCE, SPACING = range(8)
INPUT_FAILED = 13
needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def study(cache) -> Study:
    return Study.from_system(jumping_system())


@pytest.fixture(scope="module")
def folder(study, tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("library")
    write_texts(c_library(study, [0.0, 1.0, JUMP, 4.5, END]), made)
    return made


@pytest.fixture(scope="module")
def library(folder) -> ctypes.CDLL:
    """The sources in one shared library, by the engine's own compiler and flags."""
    compiler = find_compiler()
    assert compiler is not None
    compiler = optimizing(compiler)
    sources = sorted(str(path) for path in folder.glob("system_1_l_g*.c"))
    made = folder / "library.so"
    subprocess.run([*compiler.command, *compiler.flags, "-o", str(made), *sources, "-lm"], check=True)
    return ctypes.CDLL(str(made))


def at(array: np.ndarray | None):
    return None if array is None else array.ctypes.data_as(ctypes.c_void_p)


def statistics(library, times, tolerance: float = 1e-7):
    times = np.array(times, float)
    mean, covariance = np.full((times.size, 3), np.nan), np.full((times.size, 2, 3, 3), np.nan)
    error = np.full((times.size, 2, 3), np.nan)
    call = library.system_1_l_g_statistics
    code = call(times.size, at(times), ctypes.c_double(tolerance), at(mean), at(covariance), at(error), None)
    return code, mean, covariance, error


@needs_compiler
def test_statistics_are_the_engines_own(study, library):
    times = [0.0, 0.37, 1.0, JUMP, JUMP + 1e-3, 4.5, END]
    code, mean, covariance, _ = statistics(library, times)
    assert code == OK
    names = ["x", "y, in \\ it"]
    expected = study.response_statistics(times, responses=names)
    std = np.sqrt(np.einsum("ksrr->krs", covariance))[:, :2]
    assert std == pytest.approx(expected.std.sel(source=["gust", 'bu"mp']).values, rel=1e-12, abs=1e-14)
    assert mean[:, :2] == pytest.approx(expected.mean.sel(source="combined").values, rel=1e-12)
    assert np.isinf(covariance[:, 1, 2, 2]).all() and np.isfinite(covariance[:, 0, 2, 2]).all()


@needs_compiler
def test_statistics_reach_the_closed_form(library):
    times = np.array([0.5, 2.0, JUMP])
    _, mean, covariance, error = statistics(library, times, 1e-10)
    variance = 0.25 * np.exp(-2 * times / TAU) + GAIN**2 * TAU / 2 * (1 - np.exp(-2 * times / TAU))
    assert covariance[:, 0, 0, 0] == pytest.approx(variance, rel=1e-9)
    assert mean[:, 0] == pytest.approx(GAIN * 1.5 * TAU * (1 - np.exp(-times / TAU)), rel=1e-9)
    assert (error[:, 0, 0] < 1e-8).all()


@needs_compiler
@pytest.mark.parametrize("time", [0.0, 1.25, JUMP, np.nextafter(JUMP, 9), END])
def test_matrices_are_the_studys(study, library, time):
    A, B, C, D = (np.full(shape, np.nan) for shape in ((3, 3), (3, 2), (3, 3), (3, 2)))
    call, seconds = library.system_1_l_g_matrices, ctypes.c_double(time)
    assert call(seconds, at(A), at(B), at(C), at(D), None, None, None) == OK
    for found, expected in zip((A, B, C, D), study.matrices(float(time)), strict=True):
        assert np.array_equal(found, expected)
    rate, adjoint = np.empty(3), np.array([0.3, -2.0, 1.1])
    assert library.system_1_l_g_adjoint_rate(seconds, at(adjoint), at(rate)) == OK
    assert rate == pytest.approx(-A.T @ adjoint, rel=1e-14)


class Weights(ctypes.Structure):
    _fields_ = (
        ("count", ctypes.c_int),
        ("points", ctypes.c_int),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in ("time", "noise", "input", "direct")),
    )


@needs_compiler
def test_weighting_functions_are_the_studys(study, library):
    times, weights = np.array([2.0, JUMP, 5.0]), Weights()
    call = library.system_1_l_g_weighting
    tolerance = ctypes.c_double(1e-7)
    assert call(3, at(times), ctypes.c_double(0.25), tolerance, ctypes.byref(weights), None) == OK
    points = weights.points
    time = np.ctypeslib.as_array(weights.time, (points,)).copy()
    noise = np.ctypeslib.as_array(weights.noise, (3, points, 3, 2)).copy()
    inputs = np.ctypeslib.as_array(weights.input, (3, points, 3, 1)).copy()
    direct = np.ctypeslib.as_array(weights.direct, (3, 3, 1)).copy()
    library.system_1_l_g_weights_free(ctypes.byref(weights))
    assert not weights.time
    expected = study.weighting_functions(times, spacing=0.25)
    left = np.append(True, np.diff(time) > 0)  # where a time stands twice, the first is seen from the left
    assert time[left] == pytest.approx(expected.t.values, rel=1e-15)
    weighting = expected.noise_weighting.transpose("time", "t", "response", "noise").values
    assert noise[:, left] == pytest.approx(weighting, rel=1e-12, abs=1e-14)
    weighting = expected.input_weighting.transpose("time", "t", "response", "input").values
    assert inputs[:, left] == pytest.approx(weighting, rel=1e-12, abs=1e-14)
    assert direct[:, :, 0].tolist() == [[0, 1, 0]] * 3
    after = np.flatnonzero((time == JUMP) & ~left)
    assert inputs[2, after, 0] == pytest.approx(2 * inputs[2, after - 1, 0], rel=1e-12)  # the gain doubles at the jump


@needs_compiler
def test_responses_to_a_history_reach_the_closed_form(library):
    """u = t drives the lag to gain tau (t - tau (1 - exp(-t/tau))) before the jump."""
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.POINTER(ctypes.c_double), ctypes.c_void_p)

    @kind
    def ramp(time, inputs, _):
        inputs[0] = time
        return 0

    @kind
    def broken(time, inputs, _):
        inputs[0] = float("nan") if time < 1 else 0.0
        return 0

    times, found = np.array([1.0, 2.9]), np.empty((2, 3))
    call, spacing, tolerance = library.system_1_l_g_responses, ctypes.c_double(0.02), ctypes.c_double(1e-10)
    assert call(2, at(times), spacing, tolerance, ramp, None, at(found), None) == OK
    assert found[:, 0] == pytest.approx(GAIN * TAU * (times - TAU * (1 - np.exp(-times / TAU))), rel=1e-9)
    assert call(2, at(times), spacing, tolerance, broken, None, at(found), None) == INPUT_FAILED


@needs_compiler
@pytest.mark.parametrize(
    ("times", "tolerance", "code"),
    [
        ([], 1e-7, NO_TIMES),
        ([np.nan], 1e-7, NAN_TIME),
        ([1.0, np.inf], 1e-7, NAN_TIME),
        ([1.0, 1.0], 1e-7, ORDER),
        ([2.0, 1.0], 1e-7, ORDER),
        ([-1.0], 1e-7, OFF),
        ([9.0], 1e-7, OFF),
        ([1.0], 0.0, TOLERANCE),
        ([1.0], 1.0, TOLERANCE),
        ([1.0], np.nan, TOLERANCE),
    ],
)
def test_every_fault_has_its_code(library, times, tolerance, code):
    assert statistics(library, times, tolerance)[0] == code
    message = library.system_1_l_g_message
    message.restype = ctypes.c_char_p
    assert message(code) not in (b"", message(OK), message(99))


@needs_compiler
@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf, 1e-9])
def test_spacings_that_are_none(library, spacing):
    weights, times = Weights(), np.array([1.0])
    tolerance, spacing = ctypes.c_double(1e-7), ctypes.c_double(spacing)
    assert library.system_1_l_g_weighting(1, at(times), spacing, tolerance, ctypes.byref(weights), None) == SPACING
    assert library.system_1_l_g_weighting(1, at(times), spacing, tolerance, None, None) == NULL
    assert library.system_1_l_g_statistics(1, None, tolerance, None, None, None, None) == NULL


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("checked", ["plain", "sanitizers", "valgrind"])
def test_examples_build_without_a_warning_and_run_clean(folder, tmp_path, compiler, checked):
    if shutil.which(compiler) is None or (checked == "valgrind" and shutil.which("valgrind") is None):
        pytest.skip(f"no {compiler}, or no {checked}")
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all") if checked == "sanitizers" else ()
    sources = sorted(str(path) for path in folder.glob("system_1_l_g*.c"))
    program = tmp_path / "example"
    command = [
        compiler,
        *STRICT,
        "-O1",
        "-g",
        *flags,
        "-o",
        str(program),
        str(folder / "example_statistics.c"),
        *sources,
    ]
    built = subprocess.run([*command, "-lm"], capture_output=True, text=True)
    if checked == "sanitizers" and "sanitize" in built.stderr + built.stdout and built.returncode:
        pytest.skip("the sanitizers' libraries are not installed")
    assert (built.returncode, built.stderr) == (0, "")
    watched = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full"] if checked == "valgrind" else []
    done = subprocess.run([*watched, str(program), str(folder / "expected.csv")], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[1:] and len(done.stdout.splitlines()) == 11  # 5 times, 2 responses, a header
    spoilt = (folder / "expected.csv").read_text().replace(",x,", ",x,1", 1)
    (tmp_path / "spoilt.csv").write_text(spoilt)
    assert subprocess.run([str(program), str(tmp_path / "spoilt.csv")], capture_output=True).returncode == 1


def test_the_table_needs_no_compiler(monkeypatch):
    monkeypatch.setenv("CC", "")
    texts = c_library(Study.from_system(jumping_system("plain")), [1.0])
    assert {"plain.h", "plain.c", "plain_sweep.c", "Makefile", "CMakeLists.txt", "README.md"} <= texts.keys()
    assert "example_history.c" not in texts  # no measured wind without a vehicle


def test_a_system_without_end_is_refused():
    with pytest.raises(ExportError, match="has no end"):
        c_library(Study.from_system(jumping_system(end=float("inf")), compile=False))


@pytest.mark.parametrize(
    ("name", "prefix"),
    [("as504", "as504"), ("My-Rocket 2", "my_rocket_2"), ("1a", "system_1a"), ("math", "system_math"), ("ß", "system")],
)
def test_prefixes_are_identifiers(name, prefix):
    assert library_prefix(name) == prefix


def test_names_stay_inside_their_strings():
    assert c_string('a"b\\c??/ é') == '"a\\042b\\134c\\077\\077/ \\303\\251"'


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_as504_by_two_commands(as504, tmp_path):
    """Other flags than the engine's; the mean wind put through the weighting functions is the mean response."""
    write_texts(c_library(as504, [60.0, 75.0]), tmp_path)
    made = subprocess.run(["make", "CFLAGS=-O1 -Wconversion -Werror"], cwd=tmp_path, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "libas504.a").stat().st_size < 3e6
    done = subprocess.run(["make", "check"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = done.stderr.splitlines()
    assert float(told[-1].rpartition(" ")[2]) < 1e-9
    command = ["./example_history", "measured.csv", "limits.csv"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in done.stdout.splitlines() if line.startswith(("60,", "75,"))]
    mean = as504.response_statistics([60.0, 75.0]).mean.sel(source="combined")
    for time, name, _, value, _, margin in rows:
        expected = float(mean.sel(time=float(time), response=name))
        assert float(value) == pytest.approx(expected, rel=2e-4, abs=1e-9), name
        assert float(margin) > 0.2  # limits are a quarter above the largest |mean| + 3 sigma
    assert len(rows) == 2 * len(as504.system.outputs)
