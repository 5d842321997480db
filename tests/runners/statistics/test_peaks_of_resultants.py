"""Resultants at their peaks again by CVODES: mean and covariance of both planes in closed form, and wrong ones told."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from planes import in_both

import ascentwind as aw
from ascentwind.model import define_system
from ascentwind.runners.flight_load.files import with_flight_levels
from ascentwind.runners.solvers.adjoint import AdjointSolver
from ascentwind.runners.statistics.cvodes import Cvodes
from ascentwind.runners.statistics.peaks_of_resultants import check_resultants, with_resultant_check
from ascentwind.runners.statistics.resultants import Resultants

END, COMMON = 3.0, 0.6
TIMES = [1.0, 2.0, END]
NAME = "resultant_load"


@pytest.fixture(scope="module")
def study() -> aw.Study:
    """Two integrated noises that share one, from a start that varies, pushed by u = 1 and 2; three outputs to share."""
    x, y, n, m, u = (ca.SX.sym(name) for name in ("x", "y", "n", "m", "u"))
    system = define_system(
        "pushed",
        time=ca.SX.sym("t"),
        states={"x": (x, 2 * n + u), "y": (y, COMMON * n + m + 2 * u)},
        noises={"n": n, "m": m},
        inputs={"u": (u, ca.SX(1))},
        start_covariance={"m": ca.SX(np.array([[0.5, 0.2], [0.2, 0.3]]))},
        outputs={"pitch_load": x, "yaw_load": 3 * y, "other": x - y},
        end=END,
    )
    return aw.Study.from_system(system, compile=False)


def covariance(t: float) -> np.ndarray:
    start = np.array([[0.5, 0.2], [0.2, 0.3]])
    P = t * np.array([[4.0, 2 * COMMON], [2 * COMMON, COMMON**2 + 1]]) + start
    C = np.diag([1.0, 3.0])
    return C @ P @ C.T


def test_moments_of_pairs_by_the_adjoint(study):
    """Both orders of a pair, a response with itself, and more pairs than a run has columns."""
    solver = AdjointSolver(study.with_means, Cvodes(relative_tolerance=1e-10))
    mean, found = solver.pair_moments(2.0, [(0, 1), (1, 0), (0, 0)])
    expected = covariance(2.0)
    np.testing.assert_allclose(found[0].sum(axis=0), expected, rtol=1e-8)
    np.testing.assert_allclose(found[1].sum(axis=0), expected[::-1, ::-1], rtol=1e-8)
    np.testing.assert_allclose(found[2].sum(axis=0), expected[0, 0], rtol=1e-8)
    np.testing.assert_allclose(found[0, 0], 2.0 * np.array([[4, 3.6], [3.6, 9 * 0.36]]), rtol=1e-8)  # of n alone
    np.testing.assert_allclose(mean, [[2.0, 12.0], [12.0, 2.0], [2.0, 2.0]], rtol=1e-8)


def test_peaks_agree_and_are_kept(study, tmp_path):
    statistics = study.response_statistics(TIMES, engine="covariance")
    check = check_resultants(study, statistics.resultants())
    np.testing.assert_allclose(check.reference.covariance[0], covariance(END), rtol=1e-6)
    assert check.peaks[0].time == END
    assert check.agree
    assert check.difference[0] < 1e-6
    assert "they agree to" in check.verdict()
    found = with_resultant_check(statistics, check)
    loads = [study.flight_load(NAME, (0.5, END), 1e-2, draws=500)]
    found = with_flight_levels(found, loads)
    found.save(tmp_path)
    again = aw.ResponseStatistics.open(tmp_path)
    at = again.dataset.sel(resultant=NAME)
    np.testing.assert_allclose(at["resultant_peak_reference_covariance"], covariance(END), rtol=1e-6)
    np.testing.assert_allclose(at["resultant_peak_reference_mean"], [END, 6 * END], rtol=1e-6)
    assert float(at["resultant_peak"]) == pytest.approx(check.peaks[0].value)
    assert float(at["resultant_flight_level"]) == pytest.approx(float(loads[0].level[0]))
    assert str(at["resultant_unit"].item()) == str(again["unit"].sel(response="pitch_load").item())


@pytest.mark.parametrize("part", ["plane_mean", "plane_covariance", "level"])
def test_a_wrong_part_is_told(study, part):
    resultants = study.response_statistics(TIMES, engine="covariance").resultants()
    for factor, agree in ((1 + 2e-5, True), (1 + 5e-4, False)):
        wrong = resultants.dataset.copy()
        wrong[part] = wrong[part] * factor
        check = check_resultants(study, Resultants(wrong))
        assert check.agree == agree
        assert ("Do not trust the resultants" in check.verdict()) == (not agree)


@pytest.mark.slow
def test_as504_at_tight_tolerances():
    """CVODES, the sweep and the covariance equation within 1e-6, in mean, covariance and percentile."""
    study = aw.Study.from_vehicle(in_both())
    tight = {"sweep": aw.Sweep.tight(), "covariance": aw.CovarianceEquation.tight()}
    for engine in tight.values():
        resultants = study.response_statistics([60.0, 75.0, 90.0], engine=engine).resultants([1e-3])
        check = check_resultants(study, resultants, Cvodes.tight())
        assert check.difference.max() < 1e-6
