"""Every run holds its peaks against another road, says so in words, and loses nothing when they disagree."""

from __future__ import annotations

import re
import sys

import casadi as ca
import numpy as np
import pytest
import xarray as xr

from ascentwind.model import define_system
from ascentwind.model.errors import IntegrationError
from ascentwind.runners import Study
from ascentwind.runners.cli.app import main
from ascentwind.runners.solvers.adjoint import AdjointSolver
from ascentwind.runners.statistics import peak_check
from ascentwind.runners.statistics.dataset import statistics_dataset
from ascentwind.runners.statistics.engines import ENGINES
from ascentwind.runners.statistics.peak_check import LIMIT, check_peaks, in_words, weighting_at, with_peak_check
from ascentwind.runners.statistics.results import ResponseStatistics

TIMES = [1.0, 2.0, 3.0, 4.0]
A, B, G = 0.8, 2.0, 0.5


@pytest.fixture(scope="module")
def study(cache) -> Study:
    """x' = -a x - u + g n, u = b sin t: the mean is negative; y = x and its double with a start of its own."""
    t, x, z, n, m, u = (ca.SX.sym(s) for s in ("t", "x", "z", "n", "m", "u"))
    system = define_system(
        "checked",
        time=t,
        states={"x": (x, -A * x - u + G * n), "z": (z, -z / 20 + m)},
        noises={"n": n, "m": m},
        inputs={"u": (u, B * ca.sin(t))},
        outputs={"x": x, "z": z},
        start_covariance={"m": ca.SX(np.diag([0.0, 0.3]))},
        end=6.0,
    )
    return Study.from_system(system)


def mean_of_x(t):
    return -B * (A * np.sin(t) - np.cos(t) + np.exp(-A * t)) / (A**2 + 1)


def std_of_x(t):
    return G * np.sqrt((1 - np.exp(-2 * A * t)) / (2 * A))


def std_of_z(t):
    return np.sqrt(10 + (0.3 - 10) * np.exp(-t / 10))


def statistics_of(*arguments) -> ResponseStatistics:
    return ResponseStatistics(statistics_dataset(*arguments))


@pytest.mark.parametrize("engine", ENGINES)
def test_the_other_road_gives_the_closed_form_at_each_response_s_own_peak(study, engine):
    found = study.response_statistics(TIMES, engine=engine)
    check = check_peaks(study, found)
    assert check.reference == ("covariance" if engine == "cvodes" else "cvodes")
    times = np.array(TIMES)
    time = times[np.argmax(np.abs(mean_of_x(times)) + 3 * std_of_x(times))]
    assert [p.time for p in check.peaks] == [time, 4.0]
    assert check.peaks[0].side == "mean - 3σ"
    np.testing.assert_allclose(check.mean, [mean_of_x(time), 0.0], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(check.std, [std_of_x(time), std_of_z(4.0)], rtol=1e-6)
    assert check.agree
    assert check.allowed == LIMIT or engine == "ensemble"
    assert "agree to" in check.verdict()


@pytest.mark.parametrize(
    ("factor", "agree"), [(1 + 0.5e-4, True), (1 - 0.5e-4, True), (1 + 2e-4, False), (1 - 2e-4, False), (np.nan, False)]
)
def test_a_standard_deviation_beyond_the_limit_is_told(study, factor, agree):
    """The first response is right, the second is not."""
    found = study.response_statistics(TIMES)
    variance = found["variance"].values[..., :-1].copy()
    variance[:, 1] *= factor**2
    wrong = ResponseStatistics(
        statistics_dataset(study, TIMES, ["x", "z"], found["mean"].values[..., 0], variance, found.attrs)
    )
    check = check_peaks(study, wrong)
    assert check.agree == agree
    said = check.verdict()
    assert ("The standard deviation of z at its peak" in said) != agree
    if np.isfinite(factor):
        assert check.std_difference[1] == pytest.approx(abs(factor - 1), rel=1e-2)
        assert check.std_difference[0] < 1e-6
    if not agree and np.isfinite(factor):
        assert f"is {factor * std_of_z(4.0):.6g} 1 here and {std_of_z(4.0):.6g} 1 by CVODES" in said
        assert "2 parts in 10 000 apart and 1 part in 10 000 is allowed" in said
        assert "look for a jump" in said


def test_a_mean_beyond_the_limit_is_told(study):
    found = study.response_statistics(TIMES)
    mean = found["mean"].values[..., 0] * np.array([1.01, 1.0])
    wrong = ResponseStatistics(
        statistics_dataset(study, TIMES, ["x", "z"], mean, found["variance"].values[..., :-1], found.attrs)
    )
    check = check_peaks(study, wrong)
    assert not check.agree
    assert check.verdict().startswith("The mean of x at its peak")


def test_a_few_runs_are_no_error(study):
    """What sampling explains is not told; a shift beyond it is."""
    from ascentwind.runners.statistics.ensemble import Ensemble

    found = study.response_statistics(TIMES, engine=Ensemble(runs=200, seed=3))
    check = check_peaks(study, found)
    assert check.agree
    assert 0.05 < check.allowed < 0.3
    variance = 2 * found["variance"].values[..., :-1]
    wrong = ResponseStatistics(
        statistics_dataset(study, TIMES, ["x", "z"], found["mean"].values[..., -1], variance, found.attrs)
    )
    assert not check_peaks(study, wrong).agree


def test_statistics_keep_the_peaks_and_their_weighting_functions(study, tmp_path):
    """g^2 integrates to the variance, g u to the mean; the file holds it."""
    statistics = study.response_statistics(TIMES)
    check = check_peaks(study, statistics)
    with_peak_check(statistics, check, study).save(tmp_path)
    with xr.open_dataset(tmp_path / "statistics.nc", engine="scipy") as found:
        assert found.attrs["peak_reference"] == "cvodes"
        assert [found[f"{name}_peak_side"].item() for name in "xz"] == [-1, 1]
        assert all(found[f"{name}_peak_std_difference"] < 1e-6 for name in "xz")
        np.testing.assert_allclose([found[f"{name}_peak_reference_std"] for name in "xz"], check.std)
        own = found.dropna("point", subset=["x_peak_weighting_time"])
        t = own["x_peak_weighting_time"].values
        assert t[-1] == check.peaks[0].time
        g = own["x_peak_noise_weighting"].sel(noise="n").values
        assert np.trapezoid(g**2, t) == pytest.approx(check.std[0] ** 2, rel=1e-3)
        np.testing.assert_allclose(g, G * np.exp(-A * (t[-1] - t)), rtol=1e-5)
        known = own["x_peak_input_weighting"].sel(input="u").values
        assert np.trapezoid(known * B * np.sin(t), t) == pytest.approx(check.mean[0], rel=1e-3)
    again, kept = study.weighting_function(check.peaks[0].time), weighting_at(study, check, check.peaks[0].time)
    xr.testing.assert_allclose(again, kept, rtol=1e-10)


@pytest.mark.parametrize(
    ("difference", "said"),
    [
        (0.0, "rounding"), (3e-17, "rounding"), (2.3e-7, "2 parts in 10 million"), (1e-4, "1 part in 10 000"),
        (9.97e-7, "1 part in a million"), (6e-9, "6 parts in a billion"), (4.2e-4, "4 parts in 10 000"),
        (0.0312, "3.1 %"), (0.68, "68 %"), (1.2e-15, "1 part in a quadrillion"), (np.nan, "beyond numbers"),
    ],
)  # fmt: skip
def test_differences_in_words(difference, said):
    assert in_words(difference) == said


@pytest.fixture
def ascentwind(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "400")

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *arguments])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        return int(stop.value.code or 0), printed.out, printed.err

    return run


RUN = ("run", "as504", "--times", "40,45", "--out", "found")


@pytest.mark.slow
def test_a_run_says_that_cvodes_agrees(ascentwind, tmp_path):
    code, out, _ = ascentwind(*RUN)
    assert code == 0
    (line,) = [text for text in out.splitlines() if text.startswith("Peaks computed again")]
    assert re.search(r"with CVODES by one adjoint run back from each: they agree to \d parts? in \d* ?[a-z]*", line)
    assert (ResponseStatistics.open(tmp_path / "found")["peak_difference"] < 1e-5).all()


@pytest.mark.slow
def test_a_run_by_cvodes_is_held_against_the_covariance_equation(ascentwind, tmp_path):
    code, out, _ = ascentwind(*RUN, "--engine", "cvodes")
    assert code == 0
    assert "Peaks computed again with the covariance equation: they agree to" in out
    assert ResponseStatistics.open(tmp_path / "found").attrs["peak_reference"] == "covariance"


@pytest.mark.slow
def test_a_run_that_disagrees_ends_with_code_1_and_keeps_its_files(ascentwind, tmp_path, monkeypatch):
    whole = AdjointSolver._result

    def wrong(self, *arguments):
        found = whole(self, *arguments)
        found.variance[:] *= 1.001
        return found

    monkeypatch.setattr(AdjointSolver, "_result", wrong)
    code, out, _ = ascentwind(*RUN)
    assert code == 1
    assert re.search(r"The standard deviation of [a-z ]+ at its peak, 4\d s, is .* by CVODES on the same system", out)
    names = {p.name for p in (tmp_path / "found").iterdir()}
    assert {"statistics.nc", "statistics.csv", "bending_moment.png", "weighting_functions.png"} <= names
    assert (ResponseStatistics.open(tmp_path / "found")["peak_std_difference"] > LIMIT).all()


@pytest.mark.slow
def test_a_run_whose_check_fails_keeps_its_files(ascentwind, tmp_path, monkeypatch):
    def gives_up(*_):
        raise IntegrationError("the integrator gave up")

    monkeypatch.setattr(peak_check, "check_peaks", gives_up)
    code, _, err = ascentwind(*RUN)
    assert code == 1
    assert "stand unchecked: the integrator gave up" in err
    names = {p.name for p in (tmp_path / "found").iterdir()}
    assert {"statistics.nc", "statistics.csv", "bending_moment.png", "weighting_functions.png"} <= names
