"""Sensitivities of AS-504 against CVODES, against differences, and against identities that they must obey."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ascentwind.codegen.nodes.compiled import node_functions_of
from ascentwind.runners import Cvodes, Sweep
from ascentwind.runners.sensitivity.check import _with_row, central_difference, of_vehicle
from ascentwind.runners.sensitivity.gradient import gradient_of
from ascentwind.runners.sensitivity.pair import AdjointPair
from ascentwind.runners.sensitivity.request import GroupedFactorError
from ascentwind.runners.solvers.adjoint import AdjointSolver
from ascentwind.runners.solvers.collocation_grid import StepLengths
from ascentwind.runners.solvers.flight_nodes import FlightNodes


def pair_of(as504, executable, steps=None, time=30.0) -> AdjointPair:
    """Bending moment from wind alone, which no mean enters."""
    return AdjointPair(
        FlightNodes.until(executable, node_functions_of(as504.executable), [time], steps), 0, time, ("wind",)
    )


@pytest.fixture(scope="module")
def at_75(as504):
    return as504.sensitivity("bending_moment", 75.0, quantity="variance")


def test_collocation_meets_cvodes(as504, at_75):
    run = AdjointSolver(as504.with_means, Cvodes(relative_tolerance=1e-12)).run(75.0)
    assert at_75.attrs["variance"] == pytest.approx(run.variance[0].sum(), rel=1e-8)
    assert at_75.attrs["mean"] == pytest.approx(run.mean[0], rel=1e-8)


@pytest.mark.slow
def test_every_parameter_against_differences_of_the_same_discretisation(as504):
    """From wind alone, which no mean enters: rounding is all that stands between, so that small ones count too."""

    def pair(changes: dict[str, float]) -> AdjointPair:
        return pair_of(as504, as504.with_parameters(changes).executable, StepLengths(0.05, 0.002))

    nominal = pair({})
    gradient = gradient_of(nominal, 1.0, 0.0).parameters
    checked = 0
    for i, (name, parameter) in enumerate(as504.parameters.items()):
        elasticity = gradient[i] * parameter.value / nominal.variance
        if abs(elasticity) < 1e-6:
            continue
        expected = central_difference(
            lambda p, name=name: pair({name: p}).variance,
            parameter.value,
            0.02 * parameter.value,
            levels=3,
        )
        assert gradient[i] == pytest.approx(expected.derivative, rel=1e-5), name
        checked += 1
    assert checked >= 30


@pytest.mark.slow
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


@pytest.mark.slow
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
    ("time", "table", "argument", "step"),
    [
        (30.0, "altitude", 28.0, 1.0),
        (30.0, "wind_filter.H_1_1", 1500.0, 0.1),
        (30.0, "center_of_gravity", 30.0, 0.05),
        (12.0, "altitude", 10.0, 1.0),
        (12.0, "wind_filter.F_2_2", 65.3125, 1e-4),
        (12.0, "wind_filter.G_2_2", 65.3125, 1e-2),
    ],
)
def test_rows_against_differences_of_the_same_discretisation(as504, time, table, argument, step):
    """A row of the altitude moves the rate of climb, the wind that is met and the covariance at the start."""
    d = as504.sensitivity("bending_moment", time, source="wind", quantity="variance")
    at = int(np.flatnonzero((d["knot_table"].values == table) & (d["knot_argument"].values == argument)).item())
    row = int(np.sum(d["knot_table"].values[:at] == table))

    def variance(value: float) -> float:
        executable = of_vehicle(as504.executable, _with_row(as504.vehicle, table, row, value))
        return pair_of(as504, executable, time=time).variance

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
    total = total + at_75["table_elasticity_through_start"]
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


@pytest.fixture(scope="module")
def aerodynamics(at_75) -> list[str]:
    """The tables of that grouped factor."""
    return at_75["grouped_factor_tables"].sel(grouped_factor="aerodynamics").item().split(", ")


def test_aerodynamics_is_the_change_of_all_normal_forces_by_one_percent(as504, at_75, aerodynamics):
    """Other numbers in the sweep's tables, among them the mean that thrust and centre-of-pressure noise follow."""

    def variance(factor: float) -> float:
        groups = tuple(g.scaled(dict.fromkeys(aerodynamics, factor)) for g in as504.executable.groups)
        changed = replace(as504, executable=as504.executable.with_numbers(groups=groups))
        found = changed.response_statistics(
            [75.0], responses=["bending_moment"], engine=Sweep(relative_tolerance=1e-10)
        )
        return found["variance"].sel(source="combined").item()

    difference = central_difference(variance, 1.0, 0.01)
    derivative = at_75["grouped_factor_derivative"].item()
    assert derivative == pytest.approx(difference.derivative, rel=1e-6)
    assert at_75["grouped_factor_elasticity"].item() == pytest.approx(derivative / at_75.attrs["value"], rel=1e-12)


def test_aerodynamics_is_the_reference_area_with_what_the_loads_hold_of_it(at_75, aerodynamics):
    """Forces of motion hold the area, those of loads their own coefficients: two ways to the same factor."""
    of_loads = [name for name in aerodynamics if name.startswith("loads.")]
    columns = ("angle_of_attack", "center_of_pressure")
    assert of_loads == [f"loads.{load}.{name}" for load in ("bending_moment", "shear_force") for name in columns]
    expected = at_75["elasticity"].sel(parameter="reference_area").item()
    expected += at_75["table_elasticity"].sel(table=of_loads).sum().item()
    assert at_75["grouped_factor_elasticity"].item() == pytest.approx(expected, rel=1e-9)


def test_a_grouped_factor_is_no_parameter(as504):
    with pytest.raises(GroupedFactorError, match="'aerodynamics' is a factor on several tables.*leave it out"):
        as504.sensitivity("bending_moment", 75.0, parameters=["aerodynamics"])
