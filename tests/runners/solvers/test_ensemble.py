"""The ensemble: its random numbers, its exact steps, its intervals, and the spread it finds."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ascentwind.codegen.ensemble.compiled import EnsembleNeedsCompilerError, compiled_ensemble
from ascentwind.model import LinearSystem, define_system
from ascentwind.model.errors import IntegrationError, UnknownNameError
from ascentwind.runners import CovarianceEquation, Cvodes, Ensemble, Study
from ascentwind.runners.solvers.discretisation import discretise, exact_steps
from ascentwind.runners.solvers.ensemble import mean_interval, std_interval
from ascentwind.runners.statistics.ensemble import EnsembleOptionsError


def pair(start_covariance=None) -> LinearSystem:
    """A lag with a rate in time and a damped oscillator, a noise each, and a known input on the lag."""
    t, x, y, v, a, b, u = (ca.SX.sym(s) for s in ("t", "x", "y", "v", "a", "b", "u"))
    return define_system(
        "pair",
        time=t,
        states={"x": (x, -x / (1 + t) + a + u), "y": (y, v), "v": (v, -0.4 * v - 9 * y + b)},
        noises={"a": a, "b": b},
        inputs={"u": (u, 1.0)},
        outputs={"x": x, "sum": x + y},
        start_covariance=start_covariance,
    )


def lag_variance(t2):
    """x(t2) = integral of (1 + t)/(1 + t2) n dt."""
    return ((1 + t2) ** 3 - 1) / (3 * (1 + t2) ** 2)


def oscillator_variance(s, w=3.0, z=0.4 / 6):
    """White noise switched on (Caughey and Stumpf 1961)."""
    wd = w * np.sqrt(1 - z**2)
    swing = w**2 / wd**2 + z * w / wd * np.sin(2 * wd * s) - (z * w / wd) ** 2 * np.cos(2 * wd * s)
    return (1 - np.exp(-2 * z * w * s) * swing) / (4 * z * w**3)


@pytest.fixture(scope="module")
def study() -> Study:
    return Study.from_system(pair())


def philox(key, counter):
    """Philox 4x32-10 as its paper writes it, in Python's integers."""
    (k0, k1), (c0, c1, c2, c3) = key, counter
    for _ in range(10):
        a, b = 0xD2511F53 * c0, 0xCD9E8D57 * c2
        c0, c1, c2, c3 = (b >> 32) ^ c1 ^ k0, b & 0xFFFFFFFF, (a >> 32) ^ c3 ^ k1, a & 0xFFFFFFFF
        k0, k1 = (k0 + 0x9E3779B9) & 0xFFFFFFFF, (k1 + 0xBB67AE85) & 0xFFFFFFFF
    return c0, c1, c2, c3


def test_numbers_are_philox_and_box_muller(study):
    """Known answers are those published with Random123 (Salmon and others 2011), file kat_vectors."""
    assert philox((0, 0), (0, 0, 0, 0)) == (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)
    digits = (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344)
    assert philox((0xA4093822, 0x299F31D0), digits) == (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1)
    engine = compiled_ensemble(study.system)
    for seed, run, step, source in ((0, 0, 0, 0), (504 + (7 << 32), 12345, 130, 2)):
        found = engine.standard_normals(seed, run, step, source, 3)
        for k in range(3):
            b = philox((seed & 0xFFFFFFFF, seed >> 32), (run, step, source, k))
            u, v = ((((b[i] << 32 | b[i + 1]) >> 11) + 1) / 2**53 for i in (0, 2))
            expected = np.sqrt(-2 * np.log(u)) * np.array([np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)])
            np.testing.assert_allclose(found[2 * k : 2 * k + 2], expected, rtol=1e-12, atol=1e-14)


def test_steps_have_the_closed_form_variance_and_mean(study):
    times = [0.3, 2.0, 2.5, 9.0]
    found = discretise(study.executable, times, 0.01)
    t2 = np.array(times)
    variance = found.variance()
    # within a substep h the rate is held: that leaves 2 A' h^2 / 12 of the variance, and A' = 1/(1 + t)^2 < 1
    expected = np.stack([lag_variance(t2), 0 * t2], axis=1)
    np.testing.assert_allclose(variance[:, 0], expected, rtol=0.01**2 / 6, atol=1e-15)
    np.testing.assert_allclose(variance[:, 1, 1], oscillator_variance(t2), rtol=1e-10)
    # x' = -x/(1 + t) + 1: ((1 + t)^2 - 1)/(2 (1 + t))
    np.testing.assert_allclose(found.mean[:, 0], ((1 + t2) ** 2 - 1) / (2 * (1 + t2)), rtol=1e-9)


def test_steps_carry_a_start_covariance():
    P0 = np.diag([4.0, 0.0, 0.0])
    system = pair({"a": P0})
    with_start = discretise(Study.from_system(system).executable, [2.0], 0.01).variance()
    assert with_start[0, 0, 0] == pytest.approx(lag_variance(2.0) + 4.0 / 9.0, rel=0.01**2 / 6)


def test_halving_the_substep_quarters_the_error(study):
    errors = [
        abs(discretise(study.executable, [3.0], h).variance()[0, 0, 0] / lag_variance(3.0) - 1) for h in (0.2, 0.1)
    ]
    assert 3.0 < errors[0] / errors[1] < 5.5


def test_what_is_fast_follows_a_known_input_that_rises():
    """x' = (t - x) / T from rest: t - T + T e^(-t / T), T a fiftieth of the substep."""
    t, x, a, u, T = *(ca.SX.sym(s) for s in ("t", "x", "a", "u")), 1e-3
    lag = define_system(
        "lag", time=t, states={"x": (x, (u - x) / T + a)}, noises={"a": a}, inputs={"u": (u, t)}, outputs={"y": u - x},
        end=3.0,
    )  # fmt: skip
    times = np.array([0.002, 0.37, 3.0])
    found = discretise(Study.from_system(lag).executable, times.tolist(), 0.05)
    np.testing.assert_allclose(found.mean[:, 0], T - T * np.exp(-times / T), rtol=1e-10)


@pytest.mark.slow
def test_steps_of_as504_meet_the_adjoint(as504):
    """Behind a gain switch too; far below the sampling error of any ensemble one would run."""
    times = [40.0, 75.0, 110.0]
    found = discretise(as504.with_means, times, 0.05)
    adjoint = as504.response_statistics(times, engine=Cvodes(relative_tolerance=1e-9))
    np.testing.assert_allclose(np.sqrt(found.variance()), adjoint.std.values[:, :, :3], rtol=5e-5)
    np.testing.assert_allclose(found.mean, adjoint.mean.values[:, :, 0], rtol=1e-4)


def test_intervals_are_those_of_the_tables():
    """t(9; 0.95) = 1.833, chi2(9) = 3.325 and 16.92: any table, such as Bendat and Piersol's A.3 and A.4."""
    low, high = mean_interval(np.array(5.0), np.array(2.0), 10, 0.9)
    assert (low, high) == (
        pytest.approx(5 - 1.833 * 2 / np.sqrt(10), abs=1e-3),
        pytest.approx(5 + 1.833 * 2 / np.sqrt(10), abs=1e-3),
    )
    low, high = std_interval(np.array(2.0), 10, 0.9)
    assert low == pytest.approx(2 * np.sqrt(9 / 16.92), rel=1e-4)
    assert high == pytest.approx(2 * np.sqrt(9 / 3.325), rel=1e-4)


def coverage(study: Study, times, std, mean, seeds) -> float:
    """Share of standard deviations and means within the 99 % interval of 20,000 runs."""
    inside = []
    for seed in seeds:
        options = Ensemble(runs=20_000, seed=seed, confidence=0.99)
        found = study.response_statistics(times, engine=options)
        slack = 1e-6 * np.abs(mean)  # a source that does not reach a response has an interval of no length
        inside.append((found["std_low"].values <= std) & (std <= found["std_high"].values))
        inside.append((found["mean_low"].values - slack <= mean) & (mean <= found["mean_high"].values + slack))
    return float(np.mean(inside))


@pytest.mark.slow
def test_twenty_thousand_runs_contain_the_closed_form(study):
    times = np.array([0.5, 3.0])
    x, y = lag_variance(times), oscillator_variance(times)
    std = np.sqrt(np.stack([np.stack([x, 0 * x, x], axis=1), np.stack([x, y, x + y], axis=1)], axis=1))
    known = ((1 + times) ** 2 - 1) / (2 * (1 + times))
    mean = np.broadcast_to(known[:, None, None], std.shape)
    assert coverage(study, times, std, mean, range(20)) > 0.95
    assert coverage(study, times, 1.03 * std, mean, range(2)) < 0.75


@pytest.mark.slow
def test_twenty_thousand_runs_contain_the_adjoint_of_as504(as504):
    times = [30.0, 75.0, 110.0]
    adjoint = as504.response_statistics(times, engine="cvodes")
    assert coverage(as504, times, adjoint.std.values, adjoint.mean.values, range(1, 4)) >= 0.95


def test_a_seed_is_the_same_noise_on_any_number_of_threads(study, monkeypatch):
    monkeypatch.setattr("ascentwind.runners.statistics.ensemble.available_cores", lambda: 4)
    one, four, other = (
        study.response_statistics([1.0], engine=Ensemble(runs=1700, seed=s, threads=n)).std
        for s, n in ((1, 1), (1, 4), (2, 4))
    )
    np.testing.assert_array_equal(one.values, four.values)
    assert not np.array_equal(one.values[..., 0], other.values[..., 0])


def test_paths_are_the_runs_that_the_statistics_are_of(study):
    options = Ensemble(runs=600, paths=600, path_spacing=0.25)
    found = study.response_statistics([1.0, 3.0], engine=options)
    assert found["sample_path"].sizes == {"path": 600, "t": 13, "response": 2}
    at = found["sample_path"].sel(t=[1.0, 3.0]).values
    np.testing.assert_allclose(at.std(axis=0, ddof=1), found.std.sel(source="combined").values, rtol=1e-12)
    np.testing.assert_allclose(at.mean(axis=0), found.mean.sel(source="combined").values, rtol=1e-12)


def test_paths_are_continuous_in_time(study):
    """Neighbouring points of a path belong to one flight: y hardly moves in 10 ms, against its spread."""
    options = Ensemble(runs=50, paths=50, path_spacing=0.01)
    found = study.response_statistics([3.0], engine=options)
    late = found["sample_path"].values[:, 100:]
    assert np.abs(np.diff(late, axis=1)).max() < 0.5 * late[:, -1, 0].std()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": 9}, "9 runs are too few.*10 or more"),
        ({"seed": -1}, "seed -1"),
        ({"confidence": 1.0}, "confidence of 1 "),
        ({"paths": 501}, "501 paths cannot be kept of 500"),
        ({"substep": 0.0}, "positive"),
        ({"threads": 10_000}, "10000 threads.*cores"),
    ],
)
def test_impossible_options_are_refused(options, words):
    with pytest.raises(EnsembleOptionsError, match=words):
        Ensemble(**options)


@pytest.mark.filterwarnings("ignore:no C compiler")
def test_engines_are_named_and_take_their_own_options(study, monkeypatch):
    with pytest.raises(UnknownNameError, match="did you mean 'ensemble'"):
        study.response_statistics([1.0], engine="ensembel")
    monkeypatch.setenv("CC", "")
    interpreted = Study.from_system(study.system)  # the other may have compiled its ensemble before
    with pytest.raises(EnsembleNeedsCompilerError, match="no C compiler"):
        interpreted.response_statistics([1.0], engine="ensemble")


def test_a_system_that_grows_beyond_numbers_is_refused():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system("burst", time=t, states={"x": (x, 50 * x + n)}, noises={"n": n}, outputs={"x": x})
    with pytest.raises(IntegrationError, match="before 20 s left the range"):
        discretise(Study.from_system(system).executable, [20.0], 0.05)


@pytest.mark.parametrize("engine", ["cvodes", "covariance"])
def test_check_is_the_error_within_its_order(study, engine):
    """The difference to a finer discretisation against the true error, from the closed form."""
    options = (Cvodes if engine == "cvodes" else CovarianceEquation)(relative_tolerance=1e-4)
    found = study.response_statistics([3.0], engine=options, check=True)
    error = abs(float(found.std.values[0, 0, 0]) / np.sqrt(lag_variance(3.0)) - 1)
    difference = float(found["discretisation_difference"].values[0, 0, 0])
    assert 0.2 * error < difference < 5 * error


@pytest.mark.parametrize("start", [1e-3, 1e-2, 0.1])
def test_substeps_follow_a_singularity(start):
    """x' = -2 x / t + n from just after t = 0: the integral of (t / t2)^4."""
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system(
        "singular", time=t, states={"x": (x, -2 * x / t + n)}, noises={"n": n}, outputs={"x": x}, start=start
    )
    times = np.array([2 * start, 0.5, 3.0])
    executable, exact = Study.from_system(system, compile=False).executable, (times**5 - start**5) / (5 * times**4)
    np.testing.assert_allclose(discretise(executable, times.tolist(), 0.05).variance()[:, 0, 0], exact, rtol=2e-3)
    even = exact_steps(executable, times.tolist(), 0.05, graded=False)
    assert abs(even.output[0, 0, 0] ** 2 * even.added[0, 0, 0, 0] / exact[0] - 1) > 0.01


@pytest.mark.slow
def test_a_singularity_within_the_flight_is_told():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system(
        "pole", time=t, states={"x": (x, -x / (t - 1.01) ** 2 + n)}, noises={"n": n}, outputs={"x": x}
    )
    with pytest.raises(IntegrationError, match=r"near 1\.01.* s"):
        discretise(Study.from_system(system, compile=False).executable, [2.0], 0.05)
