"""Load-relief design: closed-form optima, exact derivatives, stationarity, and verdicts on what cannot be met."""

from __future__ import annotations

import warnings

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import root_scalar

from ascentwind.model import define_system
from ascentwind.model.deprecation import warn_deprecated
from ascentwind.model.errors import DeprecatedNameWarning, ParameterValueError, TimeRangeError, UnknownNameError
from ascentwind.runners import Study
from ascentwind.runners.design import design as designs
from ascentwind.runners.design.design import InfeasibleDesignError, RecomputedPeak, design, recompute_peaks, trade
from ascentwind.runners.design.peaks import TrialPeaks, gradients, three_sigma
from ascentwind.runners.design.problem import DesignProblemError, LoadReliefProblem
from ascentwind.runners.solvers.frozen_roots import FrozenRoots

LATE = (30.0, 40.0)  # s: a process of rate 1 is stationary by then
GAINS = ("control.T1.gain", "control.T2.gain")


@pytest.fixture(scope="module")
def lag(cache) -> Study:
    """x' = -k x + n: x has variance 1 / (2 k), k x has k / 2 and (1 + k^2) x has (1 + k^2)^2 / (2 k)."""
    t, x, n, k, s = (ca.SX.sym(name) for name in ("t", "x", "n", "k", "s"))
    system = define_system(
        "regulator",
        time=t,
        states={"x": (x, -k * x + s * n)},
        noises={"gust": n},
        outputs={"load": x, "effort": k * x, "both": (1 + k**2) * x},
        parameters={"k": (k, 1.0), "s": (s, 1.0)},
        end=60.0,
    )
    return Study.from_system(system)


@pytest.fixture(scope="module")
def problem(as504) -> LoadReliefProblem:
    """A short AS-504 problem: early end times are cheap."""
    return LoadReliefProblem(
        as504,
        dict.fromkeys(GAINS, (0.5, 2.0)),
        (50.0, 52.0, 54.0, 56.0),
        peak_limits={"engine_angle": 0.03},
        damping_limits={"rigid_body": 0.35, "bending_1": 0.01},
        frozen_times=(30.0, 56.0, 100.0),
    )


@pytest.fixture(scope="module")
def designed(problem):
    return design(problem)


def test_optimum_on_a_limit_is_the_closed_form_one(lag):
    limit = 1.8
    found = design(LoadReliefProblem(lag, {"k": (0.5, 3.0)}, LATE, response="load", peak_limits={"effort": limit}))
    k = 2 * (limit / 3) ** 2
    assert found.values["k"] == pytest.approx(k, rel=1e-7)
    assert found.peak == pytest.approx(3 / np.sqrt(2 * k), rel=1e-7)
    assert found.converged
    assert [name for name, _ in found.stationarity.multipliers][-1] == "peak effort, 40 s"


def test_a_grid_that_misses_much_does_not_move_the_optimum(lag, monkeypatch):
    """What it misses is taken at the result, again and again, and the last pass does without."""

    def off(trials: TrialPeaks, study: Study) -> np.ndarray | None:
        found = None if trials._grid is None else trials.exact(study)
        return None if found is None else found * (1 + 1e-3 * study.parameters["k"].value ** 2)

    def pretended(trials: TrialPeaks, *arguments) -> None:
        made(trials, *arguments)
        trials._grid = trials._grid or ()  # type: ignore[assignment]  # no grid pays for one state

    made = TrialPeaks.__init__
    monkeypatch.setattr(TrialPeaks, "__init__", pretended)
    monkeypatch.setattr(TrialPeaks, "_on_grid", off)
    limit = 1.8
    found = design(LoadReliefProblem(lag, {"k": (0.5, 3.0)}, LATE, response="load", peak_limits={"effort": limit}))
    assert found.values["k"] == pytest.approx(2 * (limit / 3) ** 2, rel=1e-7)
    assert found.converged


def test_trials_on_the_grid_follow_controlled_steps(as504):
    times, names = (50.0, 52.0, 54.0, 56.0), ["bending_moment", "engine_angle"]
    trials = TrialPeaks(as504, names, times)
    changed = as504.with_parameters({"control.T1.gain": 1.5, "control.T2.gain": 1.1})
    found, exact = trials(changed), three_sigma(changed, names, times)
    assert found is not None and exact is not None
    assert 0 < np.abs(found / exact - 1).max() < 2e-6
    settled, moved = trials.settle(changed)
    assert settled is not None
    np.testing.assert_array_equal(settled, exact)
    assert 0 < moved < 2e-6
    assert trials(changed) == pytest.approx(exact, rel=1e-13)
    trials.leave_grid()
    assert trials(as504) == pytest.approx(three_sigma(as504, names, times), rel=0, abs=0)


def test_smooth_optimum_inside_the_bounds_is_the_closed_form_one(lag):
    found = design(LoadReliefProblem(lag, {"k": (0.25, 3.0)}, LATE, response="both"))
    assert found.values["k"] == pytest.approx(1 / np.sqrt(3), rel=1e-5)
    assert found.peak == pytest.approx(3 * (4 / 3) / np.sqrt(2 / np.sqrt(3)), rel=1e-9)
    assert found.converged
    assert found.stationarity.residual <= 1e-6


def test_a_limit_that_cannot_be_met_is_named_with_the_closest_value(lag):
    problem = LoadReliefProblem(lag, {"k": (0.5, 3.0)}, LATE, response="load", peak_limits={"effort": 1.0})
    with pytest.raises(
        InfeasibleDesignError, match=r"peak effort \[1\] at \d+ s is 1.5 at the closest \(k = 0.5\)"
    ) as caught:
        design(problem)
    assert caught.value.closest == pytest.approx(1.5, rel=1e-6)
    points = trade(problem, "effort", [1.0, 1.6, 1.8])
    assert [p.limit for p in points] == [1.8, 1.6, 1.0]
    for point in points[:2]:
        k = 2 * (point.limit / 3) ** 2
        assert point.result is not None
        assert point.result.peak == pytest.approx(3 / np.sqrt(2 * k), rel=1e-6)
    assert points[2].result is None
    assert points[2].closest == pytest.approx(1.5, rel=1e-6)


def test_the_closest_value_of_one_limit_keeps_the_others(lag):
    """Of two limits one can hold alone; the other is told as close as it comes then, not as a compromise."""
    limits = {"effort": 1.0, "both": 3.74}
    bracket = (0.5, 1 / np.sqrt(3))
    k = float(
        root_scalar(lambda k: 3 * (1 + k**2) / np.sqrt(2 * k) - limits["both"], bracket=bracket, method="brentq").root
    )
    with pytest.raises(InfeasibleDesignError, match="peak effort") as caught:
        design(LoadReliefProblem(lag, {"k": (0.5, 3.0)}, LATE, response="load", peak_limits=limits))
    assert caught.value.closest == pytest.approx(3 * np.sqrt(k / 2), rel=1e-6)


@pytest.mark.parametrize("rate", [-0.1, -20.0])
def test_an_unstable_start_is_left_behind(lag, rate):
    """The second flight leaves the range of numbers: it cannot be integrated at all."""
    study = lag.with_parameters({"k": rate})
    found = design(LoadReliefProblem(study, {"k": (rate, 3.0)}, LATE, response="both", frozen_times=(10.0,)))
    assert found.values["k"] == pytest.approx(1 / np.sqrt(3), rel=1e-4)
    assert found.converged


def test_damping_and_growth_are_those_of_the_frozen_state_matrix_with_their_derivatives(as504):
    times, names = (30.0, 75.0, 120.0), (*GAINS, "bending.1.damping", "slosh.sic_lox.damping")
    roots = FrozenRoots(as504.executable, times, names)
    found = roots(as504.executable.parameters)
    for k, time in enumerate(times):
        A, state_names = as504.matrices(time)[0], as504.system.state_names
        eigenvalues, vectors = np.linalg.eig(A)
        assert found.growth[k] == pytest.approx(
            max(s.real for s, v in zip(eigenvalues, vectors.T, strict=True) if _in_vehicle(v, state_names)), rel=1e-9
        )
        for family, frequency in (("bending_1", (6.0, 7.5)), ("bending_2", (11.0, 17.0))):
            mode = next(s for s in eigenvalues if frequency[0] < s.imag < frequency[1])
            assert found.damping[k, roots.families.index(family)] == pytest.approx(-mode.real / abs(mode), rel=1e-9)
        slosh = [s for s in eigenvalues if 2.0 < s.imag < 5.5 and abs(s.real) < 0.1]
        assert len(slosh) == 4
        least = min(-s.real / abs(s) for s in slosh)
        assert found.damping[k, roots.families.index("slosh")] == pytest.approx(least, rel=1e-9)
    for i, name in enumerate(names):
        value = as504.parameters[name].value
        step = 1e-4 * value  # roundoff of the eigenvalues of A, 1e-12, is then 1e-8 of a derivative
        up, down = (roots(as504.with_parameters({name: value + s}).executable.parameters) for s in (step, -step))
        for what in ("damping", "growth"):
            difference = (getattr(up, what) - getattr(down, what)) / (2 * step)
            exact = getattr(found, f"{what}_gradient")[..., i]
            np.testing.assert_allclose(exact, difference, rtol=1e-5, atol=1e-7 * max(1.0, np.abs(difference).max()))


def _in_vehicle(vector: np.ndarray, names: tuple[str, ...]) -> bool:
    """Whether an eigenvector is none of the wind filter's or a deviation's, which drive the vehicle."""
    driving = [i for i, n in enumerate(names) if n.startswith(("wind_", "deviation_"))]
    return bool(np.abs(vector[driving]).max() < 1e-9 * np.abs(vector).max())


def test_derivatives_of_both_sides_of_the_mean_against_differences(as504):
    rows = [("bending_moment", 1.0, 45.0), ("bending_moment", -1.0, 45.0), ("engine_angle", 1.0, 50.0)]
    found = gradients(as504, rows, GAINS)
    for i, name in enumerate(GAINS):
        step, sides = 2e-3, []
        for s in (-2, -1, 1, 2):
            values = three_sigma(
                as504.with_parameters({name: 1 + s * step}), ["bending_moment", "engine_angle"], (45.0, 50.0)
            )
            assert values is not None
            sides.append([values[0, 0, 0], values[0, 1, 0], values[1, 0, 1]])
        a, b, c, d = np.array(sides)
        difference = (a - 8 * b + 8 * c - d) / (12 * step)
        np.testing.assert_allclose([found[row][i] for row in rows], difference, rtol=1e-5)


def test_three_sigma_of_both_signs_holds_the_peak_of_the_magnitude(as504):
    values = three_sigma(as504, ["bending_moment"], (60.0, 95.0))
    stats = as504.response_statistics([60.0, 95.0], responses=["bending_moment"]).sel(source="combined")
    magnitude = np.abs(stats["mean"].values) + 3 * stats["std"].values
    assert values is not None
    np.testing.assert_allclose(values[0].max(axis=0), magnitude[:, 0], rtol=1e-6)
    assert stats["mean"].values[1, 0] < 0  # the sign matters at 95 s


@pytest.mark.slow
def test_as504_design_is_stationary_and_no_neighbour_is_better(problem, designed):
    assert designed.converged
    assert designed.stationarity.residual <= 1e-6
    assert designed.peak < 0.999 * designed.quantities[0].before
    roots = FrozenRoots(problem.study.executable, problem.frozen_times, GAINS)
    random, feasible = np.random.default_rng(504), 0
    for _ in range(40):
        values = {n: v + 0.01 * random.uniform(-1, 1) for n, v in designed.values.items()}
        study = problem.study.with_parameters(values)
        damping = roots(study.executable.parameters).damping
        least = {f: damping[:, roots.families.index(f)].min() for f in problem.damping_limits}
        if any(least[f] < limit for f, limit in problem.damping_limits.items()):
            continue
        heights = three_sigma(study, ["bending_moment", "engine_angle"], problem.times)
        assert heights is not None
        if heights[1].max() <= problem.peak_limits["engine_angle"]:
            feasible += 1
            assert heights[0].max() >= designed.peak * (1 - 1e-9)
    assert feasible > 3


def test_multiplier_is_what_a_looser_limit_gains(lag):
    at = {}
    for limit in (1.8, 1.8 * 1.001):
        at[limit] = design(
            LoadReliefProblem(lag, {"k": (0.5, 3.0)}, LATE, response="load", peak_limits={"effort": limit})
        )
    tight, loose = at.values()
    total = sum(m for name, m in tight.stationarity.multipliers if name.startswith("peak effort"))
    gained = (tight.peak - loose.peak) / tight.quantities[0].before / 0.001
    assert total == pytest.approx(gained, rel=5e-3)


@pytest.mark.slow
def test_cvodes_confirms_the_design(designed):
    recomputed = recompute_peaks(designed)
    assert {v.response for v in recomputed} == {"bending_moment", "engine_angle"}
    assert max(v.designed for v in recomputed if v.response == "bending_moment") == pytest.approx(
        designed.peak, rel=1e-12
    )
    for line in recomputed:
        assert line.difference <= 1e-6


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"parameters": {"q": (0.0, 1.0)}}, UnknownNameError, "no parameter 'q'"),
        ({"parameters": {"k": (3.0, 0.5)}}, ParameterValueError, "bounds of 'k' are 3 and 0.5"),
        ({"parameters": {"k": (2.0, 3.0)}}, ParameterValueError, "'k' is 1, outside its bounds 2 to 3"),
        ({"parameters": {}}, DesignProblemError, "at least one parameter"),
        ({"response": "lod"}, UnknownNameError, "no response 'lod'; did you mean 'load'"),
        ({"peak_limits": {"efort": 1.0}}, UnknownNameError, "did you mean 'effort'"),
        ({"peak_limits": {"load": 1.0}}, DesignProblemError, "a limit on it has no place"),
        ({"peak_limits": {"effort": -1.0}}, DesignProblemError, "limit on 'effort' is -1"),
        ({"damping_limits": {"rigid_body": 0.3}}, DesignProblemError, "add frozen_times"),
        (
            {"damping_limits": {"rigid_boy": 0.3}, "frozen_times": (10.0,)},
            UnknownNameError,
            "no family of roots 'rigid_boy'; did you mean 'rigid_body'",
        ),
        ({"damping_limits": {"rigid_body": 30.0}, "frozen_times": (10.0,)}, DesignProblemError, "30 for 'rigid_body'"),
        ({"times": (0.0, 30.0)}, TimeRangeError, "after the start"),
        ({"times": (30.0, 90.0)}, TimeRangeError, "beyond the end"),
    ],
)
def test_problems_that_make_no_sense_are_refused(lag, changes, error, message):
    given = {"parameters": {"k": (0.5, 3.0)}, "times": LATE, "response": "load", **changes}
    with pytest.raises(error, match=message):
        LoadReliefProblem(lag, **given)


@pytest.mark.parametrize(
    ("old", "successor"),
    [("verify_design", recompute_peaks), ("Verification", RecomputedPeak)],
    ids=["function", "class"],
)
def test_an_old_name_is_its_successor_and_warns_once(old, successor):
    warn_deprecated.cache_clear()
    where = "ascentwind.runners.design.design"
    with pytest.warns(DeprecatedNameWarning, match=rf"{where}.{old} goes .* use {where}.{successor.__name__}$"):
        found = getattr(designs, old)
    assert found is successor
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert getattr(designs, old) is found
    with pytest.raises(AttributeError, match="no attribute 'verify_designs'"):
        getattr(designs, "verify_designs")  # noqa: B009
