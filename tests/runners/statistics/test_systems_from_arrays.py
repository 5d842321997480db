"""Systems from numbers over time: statistics and derivatives against closed forms, SciPy and AS-504's own."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import xarray as xr
from published_launcher import STATES, TABLE, launcher
from scipy.integrate import quad, solve_ivp

from ascentwind.model import LinearSystem, define_system
from ascentwind.runners import CovarianceEquation, Cvodes, Study, Sweep

TIGHT = (Sweep(1e-11), Cvodes(relative_tolerance=1e-11), CovarianceEquation(relative_tolerance=1e-11))


def deviation(study: Study, time: float, engine) -> float:
    return float(study.response_statistics([time], engine=engine).std.sel(source="combined")[0, 0])


@pytest.mark.parametrize("engine", TIGHT, ids=lambda e: e.name)
def test_constant_coefficients_reach_the_closed_form(cache, engine):
    """x' = -x/2 + 3 w + 3 u: variance 9 (1 - exp(-t)), mean 9 (1 - exp(-t/2)) for u = 1.5."""
    system = LinearSystem.from_arrays(
        [0.0, 20.0], A=[[-0.5]], B=[[3.0]], C=[[1.0]], E=[[3.0]], u=[1.5], name="constant"
    )  # fmt: skip
    found = Study.from_system(system).response_statistics([0.7, 5.0], engine=engine)
    time = np.array([0.7, 5.0])
    assert found.std.sel(source="combined").values[:, 0] == pytest.approx(3 * np.sqrt(1 - np.exp(-time)), rel=1e-9)
    assert found.mean.sel(source="combined").values[:, 0] == pytest.approx(9 * (1 - np.exp(-time / 2)), rel=1e-9)


def by_quadrature(a, until: float, gain=lambda t: 1.0, cuts=()) -> float:
    """Return the standard deviation of x' = -a(t) x + gain(t) w from rest."""

    def weight(t: float) -> float:
        points = [c for c in cuts if t < c < until] or None
        return (gain(t) * np.exp(-quad(a, t, until, points=points, epsabs=1e-13)[0])) ** 2

    return np.sqrt(quad(weight, 0.0, until, points=list(cuts) or None, epsabs=1e-13, epsrel=1e-12)[0])


@pytest.mark.parametrize("engine", TIGHT[:2], ids=lambda e: e.name)
def test_kinks_and_jumps_reach_the_closed_form(cache, engine):
    times, rate = np.array([0.0, 1.0, 2.0, 2.0, 4.0]), np.array([0.2, 1.0, 0.4, 2.0, 0.5])
    gain = np.array([1.0, 1.0, 1.0, 3.0, 3.0])
    system = LinearSystem.from_arrays(times, -rate[:, None, None], gain[:, None, None], [[1.0]], name="bent")

    def a(t: float) -> float:
        return float(np.interp(t, times[:3], rate[:3]) if t < 2 else np.interp(t, times[3:], rate[3:]))

    study = Study.from_system(system)
    for time in (1.7, 2.0, 3.1):
        expected = by_quadrature(a, time, lambda t: 1.0 if t < 2 else 3.0, [c for c in (1.0, 2.0) if c < time])
        assert deviation(study, time, engine) == pytest.approx(expected, rel=1e-9)


def test_a_table_of_a_defined_system_is_the_same(cache):
    times, rate = [0.0, 1.0, 3.0], [0.2, 1.0, 0.4]
    t, x, w, a = (ca.SX.sym(s) for s in "txwa")
    defined = define_system(
        "tabulated", time=t, states={"x": (x, -a * x + w)}, noises={"w": w}, outputs={"x": x},
        tables={"a": (a, times, rate)},
    )  # fmt: skip
    expected = by_quadrature(lambda t: float(np.interp(t, times, rate)), 2.5, cuts=[1.0])
    assert deviation(Study.from_system(defined), 2.5, Sweep(1e-11)) == pytest.approx(expected, rel=1e-9)


def test_derivatives_by_rows_are_those_of_the_closed_form(cache):
    times, rate = np.array([0.0, 1.0, 2.0, 2.0, 4.0]), np.array([0.2, 1.0, 0.4, 2.0, 0.5])
    system = LinearSystem.from_arrays(times, -rate[:, None, None], [[1.5]], [[1.0]], name="rows")
    found = Study.from_system(system).sensitivity("y1", 3.0)
    assert found.knot_table.values.tolist() == ["A(1,1)"] * 5
    assert found.knot_value.values == pytest.approx(-rate)

    def moved(row: int, by: float) -> float:
        values = rate.copy()
        values[row] -= by
        a = lambda t: float(np.interp(t, times[:3], values[:3]) if t < 2 else np.interp(t, times[3:], values[3:]))  # noqa: E731
        return by_quadrature(a, 3.0, lambda t: 1.5, [1.0, 2.0])

    for row in range(5):
        difference = (moved(row, 1e-4) - moved(row, -1e-4)) / 2e-4
        assert float(found.knot_derivative[row]) == pytest.approx(difference, rel=1e-6, abs=1e-9)
    by_gain = found.derivative.sel(parameter="B(1,1)")
    assert float(by_gain) == pytest.approx(float(found.attrs["value"]) / 1.5, rel=1e-9)


@pytest.mark.parametrize("interpolation", ["linear", "cubic", "pchip", "step"])
def test_derivatives_by_rows_are_held_against_differences(interpolation):
    """For systems from arrays with a jump, and from symbols with tables, as for vehicles."""
    times = np.array([0.0, 0.7, 1.5, 2.0, 2.0, 2.6, 3.3, 4.0])
    rate = np.array([0.2, 1.0, 0.7, 0.4, 2.0, 1.4, 0.9, 0.5])
    A, B = -rate[:, None, None], np.linspace(1.0, 2.0, 8)[:, None, None] ** 2
    system = LinearSystem.from_arrays(times, A, B, [[1.0]], name="rows", interpolation=interpolation)
    t, x, w, a, b = (ca.SX.sym(s) for s in "txwab")
    defined = define_system(
        "tabulated", time=t, states={"x": (x, -a * x + b * w)}, noises={"w": w}, outputs={"x": x},
        tables={"a": (a, [0.0, 1.0, 2.0, 3.0, 4.0], rate[3:]), "b": (b, [0.0, 5.0], [1.0, 2.0])},
    )  # fmt: skip
    for of, at in ((system, 3.0), (defined, 3.5)):
        study = Study.from_system(of, compile=False)
        found = study.check_sensitivity(of.output_names[0], at, rows=2)
        tables = [str(item).partition(" at ")[0] for item in found.item.values if " at " in str(item)]
        assert sorted(tables) == sorted(table.name for table in of.rows)
        assert found["agrees"].all(), found.to_dataframe().to_string()


@pytest.mark.skipif(not TABLE.exists(), reason="the published table is not beside the repository")
def test_a_launcher_of_13_states_agrees_with_the_covariance_equation_of_scipy(cache):
    times, A, B, C = launcher()
    names = {"states": STATES, "noises": ["gust", "gyro noise"], "outputs": ["pitch", "engine", "bending"]}
    study = Study.from_system(LinearSystem.from_arrays(times, A, B, C, names=names, name="launcher"))
    ends = [20.0, 40.0, 67.5]
    found = study.response_statistics(ends, engine=Sweep(1e-10)).std.sel(source="combined").values
    n, P, at = len(STATES), np.zeros((len(STATES),) * 2), times[0]
    scale = np.where(np.array(STATES) == "bending", 1e-2, 1.0)
    expected = []
    for k, end in enumerate(times[1:], 1):
        for until in [*(t for t in ends if at < t < end), end]:
            if at >= ends[-1]:
                break

            def rate(t, y, k=k):
                part = (t - times[k - 1]) / (times[k] - times[k - 1])
                F, G = (m[k - 1] + part * (m[k] - m[k - 1]) for m in (A, B))
                P = y.reshape(n, n) * np.outer(scale, scale)
                return ((F @ P + P @ F.T + G @ G.T) / np.outer(scale, scale)).ravel()

            start = (P / np.outer(scale, scale)).ravel()
            P = solve_ivp(rate, (at, until), start, "DOP853", rtol=1e-11, atol=1e-18).y[:, -1].reshape(n, n)
            P, at = P * np.outer(scale, scale), until
            if until in ends:
                expected.append(np.sqrt(np.diag(C @ P @ C.T)))
    assert found == pytest.approx(np.array(expected), rel=1e-8)


def gridded(grid: xr.Dataset, name: str) -> LinearSystem:
    """AS-504's matrices as anybody has them: numbers over time with names."""
    labels = {kind: [str(x) for x in grid[kind].values] for kind in ("state", "noise", "response", "input", "source")}
    sources = dict(zip(labels["noise"], map(str, grid.noise_source.values), strict=True))
    scales = [*zip(labels["state"], grid.state_scale.values.tolist(), strict=True)]
    scales += zip(labels["response"], grid.response_scale.values.tolist(), strict=True)
    kinds = {"states": "state", "noises": "noise", "outputs": "response", "inputs": "input"}
    return LinearSystem.from_arrays(
        grid.time.values, grid.A, grid.B, grid.C, grid.D, grid.E, grid.G, u=grid.u.values, name=name,
        names={kind: labels[of] for kind, of in kinds.items()},
        sources=sources, scales=dict(scales), interpolation="cubic", discontinuities=grid.jump.values.tolist(),
        start_covariance={source: grid.start_covariance.sel(source=source).values for source in labels["source"]},
    )  # fmt: skip


@pytest.mark.slow
def test_as504_from_its_grid_of_matrices(as504):
    """Every 0.05 s: standard deviations, and derivatives by table entries contracted with dA/dp."""
    grid = as504.matrix_grid()
    study = Study.from_system(gridded(grid, "as504_gridded"))
    times = [60.0, 75.0, 105.6, 140.0]
    expected = as504.response_statistics(times, engine=Sweep(1e-9))
    found = study.response_statistics(times, engine=Sweep(1e-9))
    assert found.std.values == pytest.approx(expected.std.values, rel=1e-5, abs=1e-12)
    name = "control.T1.gain"
    value, step = as504.parameters[name].value, 1e-4
    sides = [as504.with_parameters({name: value * (1 + sign * step)}).matrix_grid(grid.time.values) for sign in (1, -1)]
    of_grid, of_vehicle = study.sensitivity("bending_moment", 75.0), as504.sensitivity("bending_moment", 75.0)

    def change(label: str) -> np.ndarray:
        """Return dA/dp of an entry over time."""
        i, j = (int(k) - 1 for k in label[2:-1].split(","))
        high, low = (side[label[0]].values[:, i, j] for side in sides)
        return (high - low) / (2 * step * value)

    by_row, of_table = of_grid.knot_derivative.values, of_grid.knot_table.values
    entries = [label for label in dict.fromkeys(of_table.tolist()) if label[0] != "u"]  # inputs make no variance
    contracted = sum(by_row[of_table == label] @ change(label) for label in entries)
    constant = zip(of_grid.parameter.values.tolist(), of_grid.derivative.values, strict=True)
    contracted += sum(float(d) * change(label)[0] for label, d in constant if label[0] != "u")
    assert contracted == pytest.approx(float(of_vehicle.derivative.sel(parameter=name)), rel=1e-4)
