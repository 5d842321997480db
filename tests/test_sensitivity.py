"""Sensitivities against closed forms, against differences, and against identities that they must obey."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from ascentwind.codegen.node_functions import node_functions
from ascentwind.model import LinearSystem, define_system
from ascentwind.model.assemble import vehicle_tables
from ascentwind.model.errors import DirectNoiseError, TimeRangeError, UnknownNameError
from ascentwind.runners import IntegratorOptions, Study
from ascentwind.runners.adjoint import AdjointSolver
from ascentwind.runners.collocation import Collocation, CompiledCollocation, Grid
from ascentwind.runners.sensitivity import StructuralParameterError, UndefinedElasticityWarning, ZeroQuantityError
from ascentwind.runners.sensitivity_check import _with_row, central_difference
from ascentwind.runners.sensitivity_gradient import AdjointPair
from scipy.optimize import minimize_scalar


def derivative(f, at: float) -> float:
    """By a complex step, exact to rounding."""
    return float(np.imag(f(at + 1e-30j)) / 1e-30)


def found(system: LinearSystem, time, quantity="variance", **options):
    return Study.from_system(system).sensitivity(system.output_names[0], time, quantity=quantity, **options)


def gauss_markov(tau=2.0, spread=0.7) -> LinearSystem:
    t, x, n, tau_, s = (ca.SX.sym(name) for name in ("t", "x", "n", "tau", "s"))
    return define_system(
        "gauss_markov",
        time=t,
        states={"x": (x, -x / tau_ + ca.sqrt(2 / tau_) * n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"tau": (tau_, tau), "spread": (s, spread)},
        start_covariance={"n": s**2},
    )


def test_gauss_markov_process_with_a_start_covariance_of_its_own():
    """Var = 1 - e^(-2 t / tau) + s^2 e^(-2 t / tau)."""
    d = found(gauss_markov(), 1.5)
    expected = [
        derivative(lambda tau: 1 + (0.7**2 - 1) * np.exp(-3 / tau), 2.0),
        derivative(lambda s: s**2 * np.exp(-3 / 2.0), 0.7),
    ]
    np.testing.assert_allclose(d["derivative"], expected, rtol=1e-9)
    np.testing.assert_allclose(d["elasticity"], np.array(expected) * [2.0, 0.7] / d.attrs["value"], rtol=1e-9)


@pytest.mark.parametrize("time", [0.5, 2.0, 7.5])
def test_time_varying_lag(time):
    """x' = -a x / (1 + t) + n: Var = ((1 + t) - (1 + t)^(-2 a)) / (2 a + 1)."""
    t, x, n, a = (ca.SX.sym(s) for s in ("t", "x", "n", "a"))
    lag = define_system(
        "lag",
        time=t,
        states={"x": (x, -a * x / (1 + t) + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"a": (a, 1.2)},
    )
    expected = derivative(lambda a: ((1 + time) - (1 + time) ** (-2 * a)) / (2 * a + 1), 1.2)
    assert found(lag, time)["derivative"].item() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("w", "z"), [(6.0, 0.005), (1.0, 0.4), (20.0, 0.05)])
def test_oscillator_with_a_parameter_in_its_output(w, z):
    """Caughey and Stumpf 1961, y = k x: frequency, damping, noise level and output each by the closed form."""
    t, x, v, n = (ca.SX.sym(s) for s in ("t", "x", "v", "n"))
    symbols = {s: ca.SX.sym(s) for s in ("w", "z", "g", "k")}
    values = {"w": w, "z": z, "g": 1.7, "k": 3.0}
    system = define_system(
        "oscillator",
        time=t,
        states={
            "x": (x, v),
            "v": (v, -2 * symbols["z"] * symbols["w"] * v - symbols["w"] ** 2 * x + symbols["g"] * n),
        },
        noises={"n": n},
        outputs={"y": symbols["k"] * x},
        parameters={s: (symbols[s], values[s]) for s in values},
        start=1.0,
    )
    s = 2.0

    def variance(w, z, g, k):
        wd = w * np.sqrt(1 - z**2)
        ripple = w**2 / wd**2 + z * w / wd * np.sin(2 * wd * s) - (z * w / wd) ** 2 * np.cos(2 * wd * s)
        return k**2 * g**2 * (1 - np.exp(-2 * z * w * s) * ripple) / (4 * z * w**3)

    d = found(system, 1.0 + s, "std")
    # the phase error of the method, at most steps * 0.35^7 / 100800, is all that is left
    assert d.attrs["variance"] == pytest.approx(variance(**values), rel=2e-7)
    for name in values:
        expected = derivative(lambda p, name=name: np.sqrt(variance(**(values | {name: p}))), values[name])
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-6)


def driven(end=float("inf")) -> LinearSystem:
    """x' = -a x + u + g n, y = x + c u, u = b sin t."""
    t, x, n, u, a, b, c, g = (ca.SX.sym(s) for s in ("t", "x", "n", "u", "a", "b", "c", "g"))
    return define_system(
        "driven",
        time=t,
        states={"x": (x, -a * x + u + g * n)},
        noises={"n": n},
        inputs={"u": (u, b * ca.sin(t))},
        outputs={"y": x + c * u, "x": x},
        parameters={"a": (a, 0.8), "b": (b, 2.0), "c": (c, 0.3), "g": (g, 0.5)},
        end=end,
    )


DRIVEN = {"a": 0.8, "b": 2.0, "c": 0.3, "g": 0.5}


def driven_mean(t, a, b, c, g):
    return b * ((a * np.sin(t) - np.cos(t) + np.exp(-a * t)) / (a**2 + 1) + c * np.sin(t))


def driven_std(t, a, b, c, g):
    return g * np.sqrt((1 - np.exp(-2 * a * t)) / (2 * a))


@pytest.mark.parametrize(
    ("quantity", "closed"),
    [
        ("mean", driven_mean),
        ("std", driven_std),
        ("mean_plus_3sigma", lambda t, **p: driven_mean(t, **p) + 3 * driven_std(t, **p)),
    ],
)
def test_mean_and_mean_plus_3sigma_of_a_driven_lag(quantity, closed):
    d = found(driven(), 2.3, quantity)
    for name, value in DRIVEN.items():
        expected = derivative(lambda p, name=name: closed(2.3, **(DRIVEN | {name: p})), value)
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_at_the_peak_the_derivative_is_that_of_the_maximum():
    """Against differences of the maximum over time of the closed form, its time found by another optimiser."""

    def largest(**p):
        best = minimize_scalar(
            lambda t: -driven_mean(t, **p) - 3 * driven_std(t, **p), bounds=(0.5, 4), options={"xatol": 1e-10}
        )
        return -best.fun, best.x

    d = found(driven(end=6.0), "peak", "mean_plus_3sigma")
    value, time = largest(**DRIVEN)
    assert d.attrs["t2_s"] == pytest.approx(time, abs=1e-5)
    assert d.attrs["value"] == pytest.approx(value, rel=1e-9)
    assert not d.attrs["peak_at_end_of_range"]
    for name, at in DRIVEN.items():
        expected = central_difference(lambda p, name=name: largest(**(DRIVEN | {name: p}))[0], at, 0.02).derivative
        assert d["derivative"].sel(parameter=name).item() == pytest.approx(expected, rel=1e-6)


def test_a_peak_at_the_end_says_so():
    d = found(driven(end=1.0), "peak", "mean_plus_3sigma")
    assert d.attrs["t2_s"] == 1.0
    assert d.attrs["peak_at_end_of_range"]


@pytest.mark.parametrize("time", [1.0, 2.0])
def test_a_jump_of_the_state_matrix_is_seen_from_its_sides(time):
    """x' = -a x + n before 1 s, b x + n after it."""
    t, x, n, a, b = (ca.SX.sym(s) for s in ("t", "x", "n", "a", "b"))
    system = define_system(
        "jump",
        time=t,
        states={"x": (x, ca.if_else(t < 1, -a, -b) * x + n)},
        noises={"n": n},
        outputs={"x": x},
        parameters={"a": (a, 1.0), "b": (b, 3.0)},
        discontinuities=[1.0],
    )

    def variance(a, b):
        before = (1 - np.exp(-2 * a)) / (2 * a)
        s = time - 1
        return before * np.exp(-2 * b * s) + (1 - np.exp(-2 * b * s)) / (2 * b)

    d = found(system, time)
    expected = [derivative(lambda a: variance(a, 3.0), 1.0), derivative(lambda b: variance(1.0, b), 3.0)]
    np.testing.assert_allclose(d["derivative"], expected, rtol=1e-9, atol=1e-15)


def test_one_source_alone():
    t, x, m, n, f, g = (ca.SX.sym(s) for s in ("t", "x", "m", "n", "f", "g"))
    system = define_system(
        "two",
        time=t,
        states={"x": (x, -x + f * m + g * n)},
        noises={"m": m, "n": n},
        outputs={"x": x},
        parameters={"f": (f, 1.0), "g": (g, 2.0)},
    )
    unit = 0.5 * (1 - np.exp(-4.0))
    np.testing.assert_allclose(found(system, 2.0)["derivative"], [2 * unit, 4 * unit], rtol=1e-9)
    np.testing.assert_allclose(found(system, 2.0, source="n")["derivative"], [0, 4 * unit], rtol=1e-9)


# AS-504


@pytest.fixture(scope="module")
def at_75(as504):
    return as504.sensitivity("bending_moment", 75.0, quantity="variance")


def test_collocation_meets_cvodes(as504, at_75):
    run = AdjointSolver(as504.with_means, IntegratorOptions(relative_tolerance=1e-12)).run(75.0)
    assert at_75.attrs["variance"] == pytest.approx(run.variance[0].sum(), rel=1e-8)
    assert at_75.attrs["mean"] == pytest.approx(run.mean[0], rel=1e-8)


def test_every_parameter_against_differences_of_the_same_discretisation(as504):
    """From wind alone, which no mean enters: rounding is all that stands between, so that small ones count too."""
    functions = node_functions(as504.system)

    def pair(changes: dict[str, float]) -> AdjointPair:
        return AdjointPair(as504.with_parameters(changes).executable, functions, 0, 30.0, ("wind",), 0.05)

    nominal = pair({})
    gradient = nominal.gradient(1.0, 0.0).parameters
    checked = 0
    for i, (name, parameter) in enumerate(as504.parameters.items()):
        elasticity = gradient[i] * parameter.value / nominal.variance
        if abs(elasticity) < 1e-6:
            continue
        expected = central_difference(
            lambda p, name=name: pair({name: p}).variance,
            parameter.value,
            0.02 * parameter.value,
            levels=2,
        )
        assert gradient[i] == pytest.approx(expected.derivative, rel=1e-5), name
        checked += 1
    assert checked >= 30


def test_parameters_and_rows_against_differences_of_cvodes(as504):
    """Another integrator and no gradient; the centre of pressure's noise is there through the mean response."""
    d = as504.check_sensitivity(
        "bending_moment",
        75.0,
        quantity="mean_plus_3sigma",
        parameters=["control.T1.gain", "center_of_pressure.sigma"],
        rows=2,
    )
    assert d.sizes["item"] == 4
    assert d["agrees"].all()
    assert (d["apart"] <= 1e-5 * abs(d["difference"])).all()
    assert (abs(d["uncertainty"]) <= 1e-4 * abs(d["difference"])).all()


def test_the_mean_path_against_differences_of_cvodes(as504):
    """The variance by centre-of-pressure noise follows the mean wind only through the mean response."""
    d = as504.check_sensitivity(
        "engine_angle", 60.0, quantity="variance", source="center_of_pressure", parameters=["wind.mean_scale"]
    )
    assert (d["apart"] <= 1e-5 * abs(d["difference"])).all()
    # the mean is proportional to the mean wind, and the variance to the square of the mean
    expected = 2 * d.attrs["quantity_value"]
    assert d["derivative"].item() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("table", "argument", "step"),
    [("altitude", 28.0, 1.0), ("wind_filter.H_1_1", 1500.0, 0.1), ("center_of_gravity", 30.0, 0.05)],
)
def test_rows_against_differences_of_the_same_discretisation(as504, table, argument, step):
    """A row of the altitude moves the rate of climb, and the wind that is met; from wind alone, as above."""
    d = as504.sensitivity("bending_moment", 30.0, source="wind", quantity="variance")
    at = int(np.flatnonzero((d["knot_table"].values == table) & (d["knot_argument"].values == argument)).item())
    row = int(np.sum(d["knot_table"].values[:at] == table))

    def variance(value: float) -> float:
        groups = vehicle_tables(_with_row(as504.vehicle, table, row, value))
        executable = as504.executable.with_numbers(groups=groups)
        return AdjointPair(executable, node_functions(as504.system), 0, 30.0, ("wind",)).variance

    expected = central_difference(variance, float(d["knot_value"][at]), step)
    assert expected.uncertainty < 1e-6 * abs(expected.derivative)
    assert d["knot_derivative"][at].item() == pytest.approx(expected.derivative, rel=1e-5)


def test_scaling_all_wind_scales_the_variance_by_the_square(at_75):
    """Not term by term: sigma acts directly, the mean through the noise columns of thrust and centre of pressure."""
    both = at_75["elasticity"].sel(parameter=["wind.sigma_scale", "wind.mean_scale"])
    assert both.sum().item() == pytest.approx(2.0, rel=1e-8)
    assert both.min().item() > 0.1


def test_seconds_rows_and_kilometres_add_up_to_the_whole(at_75):
    whole = at_75["table_elasticity"]
    weighted = at_75["table_derivative"] * at_75["table_value"] * at_75["node_weight"]
    at_end = at_75["table_derivative_at_end"] * at_75["table_value"].isel(t=-1)
    total = (weighted.sum("t") + at_end) / at_75.attrs["value"]
    np.testing.assert_allclose(total, whole, rtol=1e-3, atol=1e-6)  # the last node lies just before t2
    rows = at_75["knot_elasticity"].groupby(at_75["knot_table"]).sum()
    for table in ("mass", "thrust", "bending.1.frequency", "control.rate_factor", "wind_filter.H_1_1", "wind.mean"):
        # the rows of a cubic, linear or step table carry a common factor exactly; of pchip to its differences
        assert rows.sel(knot_table=table).item() == pytest.approx(whole.sel(table=table).item(), rel=1e-7), table
    both = whole.sel(table=["altitude", "altitude_rate"]).sum().item()
    assert rows.sel(knot_table="altitude").item() == pytest.approx(both, rel=1e-8)
    for bands, parameter in (("sigma", "wind.sigma_scale"), ("mean", "wind.mean_scale")):
        expected = at_75["elasticity"].sel(parameter=parameter).item()
        assert at_75[f"wind_{bands}_elasticity"].sum().item() == pytest.approx(expected, rel=1e-9)


def test_dimensional_analysis_of_the_networks(at_75):
    """Numerator and denominator by one factor, gain and numerator: the same transfer function."""
    e = at_75["elasticity"].to_series()
    for network in ("T1", "T2", "T3"):
        numerator = e[[n for n in e.index if n.startswith(f"control.{network}.numerator")]].sum()
        denominator = e[[n for n in e.index if n.startswith(f"control.{network}.denominator")]].sum()
        assert numerator == pytest.approx(-denominator, rel=1e-6)
        assert numerator == pytest.approx(e[f"control.{network}.gain"], rel=1e-6)


def test_compiled_collocation_is_that_by_lapack():
    """Random stable matrices, with forcing, forward and backward; and the duality of both."""
    random = np.random.default_rng(504)
    library = node_functions(driven()).shared_library
    assert library is not None
    edges = np.cumsum(np.append(0.0, random.uniform(0.01, 0.1, 20)))
    A = random.standard_normal((20, 3, 5, 5)) * (random.random((5, 5)) < 0.6) - 2 * np.eye(5)
    x, a, f, g = *random.standard_normal((2, 5)), *random.standard_normal((2, 20, 3, 5))
    grid = Grid(edges)
    compiled, reference = CompiledCollocation(grid, A, library), Collocation(grid, A)
    for one, other in zip(compiled.forward(x, f), reference.forward(x, f), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13)
    for one, other in zip(compiled.backward(a, g), reference.backward(a, g), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13)
    stages, end = compiled.forward(x, f)
    adjoints, start = compiled.backward(a, g)
    weights = grid.weights[..., None]
    # a'x at both ends differs by the integral of a'f - x'g, exactly, as the method is symplectic
    assert a @ end - start @ x == pytest.approx(np.sum(weights * (adjoints * f - stages * g)), abs=1e-12)


def test_compiled_and_interpreted_agree(as504):
    random = np.random.default_rng(504)
    system, p = as504.system, as504.executable.parameters
    compiled, interpreted = node_functions(system), node_functions(system, False)
    assert compiled.shared_library is not None
    t, v = np.array([40.0, 75.0, 120.0]), np.array([list(as504.tables(x).values()) for x in (40.0, 75.0, 120.0)])
    a, x = random.standard_normal((2, 3, len(system.states)))
    c, m = random.standard_normal((3, len(system.outputs))), random.standard_normal(len(system.noises))
    for name, arguments in (("quadratic_gradient", (t, v, p, a, x, c, m)), ("linear_gradient", (t, v, p, a, x, c))):
        ours, reference = (getattr(f, name)(*arguments) for f in (compiled, interpreted))
        np.testing.assert_allclose(ours, reference, rtol=1e-10, atol=1e-12 * np.abs(reference).max())
    matrices = as504.matrices(75.0)
    for name, expected in zip("ABC", matrices[:3], strict=True):
        np.testing.assert_allclose(compiled.matrices(t, v, p)[name][1], expected, rtol=1e-12, atol=1e-300)


# bad input


def test_names_are_checked_and_the_nearest_offered(as504):
    with pytest.raises(UnknownNameError, match="no response 'bending'.*'bending_moment'"):
        as504.sensitivity("bending", 75.0)
    with pytest.raises(UnknownNameError, match="no noise source 'winds'.*'wind'"):
        as504.sensitivity("bending_moment", 75.0, source="winds")
    with pytest.raises(UnknownNameError, match="no quantity 'sdt'.*'std'"):
        as504.sensitivity("bending_moment", 75.0, quantity="sdt")
    with pytest.raises(UnknownNameError, match=r"no parameter 'control.T1.gian'.*'control.T1.gain'"):
        as504.sensitivity("bending_moment", 75.0, parameters=["control.T1.gian"])


@pytest.mark.parametrize("name", ["slosh.count", "bending modes", "control.T1.order"])
def test_structure_has_no_derivative(as504, name):
    with pytest.raises(StructuralParameterError, match=f"'{name}' is structure, not a number"):
        as504.sensitivity("bending_moment", 75.0, parameters=["control.T1.gain", name])


def test_times_are_checked(as504):
    for time, message in ((200.0, "beyond"), (5.0, "before the start"), (10.0, "no history"), ("top", "'peak'")):
        with pytest.raises(TimeRangeError, match=message):
            as504.sensitivity("bending_moment", time)
    with pytest.raises(TimeRangeError, match="no end to search"):
        found(driven(), "peak", "mean")


def test_a_quantity_of_zero_has_no_elasticity_and_its_root_no_derivative():
    study = Study.from_system(driven()).with_parameters({"g": 0.0})
    with pytest.raises(ZeroQuantityError, match="its root has no derivative"):
        study.sensitivity("y", 2.0, quantity="mean_plus_3sigma")
    with pytest.raises(ZeroQuantityError, match="not defined; pass elasticity=False"):
        study.sensitivity("y", 2.0, quantity="variance")
    d = study.sensitivity("y", 2.0, quantity="variance", elasticity=False)
    assert "elasticity" not in d
    np.testing.assert_array_equal(d["derivative"], 0.0)


def test_a_parameter_of_zero_is_named_and_marked():
    study = Study.from_system(driven()).with_parameters({"c": 0.0})
    with pytest.warns(UndefinedElasticityWarning, match="^c: zero"):
        d = study.sensitivity("y", 2.0, quantity="mean")
    assert d["elasticity_defined"].values.tolist() == [1, 1, 0, 1]
    assert d["derivative"].sel(parameter="c").item() == pytest.approx(2.0 * np.sin(2.0), rel=1e-9)


def test_direct_noise_is_refused():
    t, x, n = (ca.SX.sym(s) for s in ("t", "x", "n"))
    system = define_system("d", time=t, states={"x": (x, -x + n)}, noises={"n": n}, outputs={"y": x + n})
    with pytest.raises(DirectNoiseError):
        found(system, 1.0)
