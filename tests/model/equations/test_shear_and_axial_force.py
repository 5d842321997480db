"""Shear, axial and equivalent axial loads: balances of all that lies forward of the station, and what follows."""

from __future__ import annotations

import re

import numpy as np
import pytest
from test_assembled import Assembled
from test_noise_loads import STATION, TIME, Line, line, numbers

from ascentwind.codegen.system.functions import core_functions
from ascentwind.model import load_vehicle
from ascentwind.model.equations.assemble import assemble
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.loads import load_name
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners import CovarianceEquation, Study, Sweep
from ascentwind.runners.station_loads.loads_along_vehicle import LOADS, load_rows, loads_along_vehicle

__all__ = ["line", "numbers"]  # fixtures
AS504 = built_in_vehicles()["as504"]
PLUS, MINUS = "equivalent_axial_load_plus_y", "equivalent_axial_load_minus_y"


@pytest.fixture(scope="module")
def whole(cache) -> Assembled:
    """AS-504 where every mass acts on every other and on the loads."""
    vehicle = load_vehicle(AS504, {"options.full_coupling": True, "options.slosh_reaction": True})
    system = assemble(vehicle, np.eye(vehicle.wind.shaping_filter.order))
    return Assembled(vehicle, system, core_functions(system))


def forward_inertia(line: Line, v: dict[str, float], rates: dict[str, float]) -> float:
    """Return mass times acceleration of all forward of the station, sloshing liquid in its tanks included."""
    forward, row = line.x > STATION, line.row
    lateral = rates["lateral_velocity"] + (line.x - v["center_of_gravity"]) * rates["attitude_rate"]
    for i in (1, 2):
        shape = np.interp(line.x, line.numbers.modes.x, line.numbers.modes.displacement[row, i - 1])
        lateral = lateral + shape * rates[f"bending_rate_{i}"]
    found = (line.mass * lateral)[forward].sum()
    for tank, slosh in line.numbers.slosh.items():
        found += slosh.mass[row] * (slosh.attach_point[row] > STATION) * rates[f"slosh_rate_{tank}"]
    return float(found)


def test_shear_is_the_force_forward_of_the_station_less_the_inertia_there(whole, line):
    """A state of every kind, one at a time: by the equations' own accelerations and cells of the construction."""
    v, A, _, C = whole.at(TIME)
    names, outputs = list(whole.system.state_names), list(whole.system.output_names)
    forward = line.x > STATION
    air = line.normal_force(0.0)[forward].sum()
    largest = np.abs(C[outputs.index("shear_force")])
    for state in ("attitude", "lateral_velocity", "bending_1", "bending_rate_2", "slosh_sic_lox", "slosh_sii_lox"):
        k = names.index(state)
        rates = {name: float(A[i, k]) for i, name in enumerate(names)}
        if state == "attitude":  # the weight of all masses across the tilted axis is no load of the axis
            rates["lateral_velocity"] -= v["axial_acceleration"]
        alpha = float(C[outputs.index("angle_of_attack"), k])
        expected = air * alpha - forward_inertia(line, v, rates)  # engines push aft of the station
        scale = max(abs(air * alpha), abs(float(largest[k])), abs(forward_inertia(line, v, rates)))
        assert float(C[outputs.index("shear_force"), k]) == pytest.approx(expected, abs=2e-3 * scale), state


@pytest.mark.parametrize("source", ["thrust", "center_of_pressure"])
def test_noise_enters_the_shear_by_what_it_puts_forward_of_the_station(whole, line, source):
    v, A, _, C = whole.at(TIME)
    names, outputs = list(whole.system.state_names), list(whole.system.output_names)
    k, sigma = names.index(f"deviation_{source}"), whole.vehicle.noise[source].sigma
    rates = {name: float(A[i, k]) / sigma for i, name in enumerate(names)}
    force = 0.0
    if source == "thrust":  # the frame does not follow the thrust along the axis
        rates["lateral_velocity"] -= v["thrust"] * v["mean.attitude"] / v["mass"]
    else:
        moved = line.moved()[line.x > STATION].sum()
        force = moved * v["center_of_pressure"] * v["mean.angle_of_attack"]
    expected = force - forward_inertia(line, v, rates)
    found = float(C[outputs.index("shear_force"), k]) / sigma
    assert found == pytest.approx(expected, abs=2e-3 * max(abs(force), abs(expected - force)))


def test_axial_force_is_inertia_and_drag_forward_of_the_station(as504, line):
    """Its mean by cells of the construction; thrust that deviates accelerates what lies forward; no wind reaches it."""
    v = as504.tables(TIME)
    outputs, names = list(as504.system.output_names), list(as504.system.state_names)
    forward = line.mass[line.x > STATION].sum()
    found = as504.response_statistics([TIME], responses=["axial_force"])
    expected = forward * (v["thrust"] - v["axial_drag"]) / v["mass"] + v["axial_drag"]
    assert found.mean.values[0, 0, 0] == pytest.approx(expected, rel=1e-4)
    row = as504.matrices(TIME)[2][outputs.index("axial_force")]
    assert np.flatnonzero(row).tolist() == [names.index("deviation_thrust")]
    sigma = 0.01 * forward * v["thrust"] / v["mass"]
    assert found.std.sel(source="thrust").values[0, 0] == pytest.approx(sigma, rel=1e-4)
    assert (found.std.sel(source=["wind", "center_of_pressure"]).values == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("engine", [Sweep(relative_tolerance=1e-9), CovarianceEquation(1e-9)])
def test_derived_loads_follow_from_moment_and_axial_force(as504, engine):
    """N +- 2 M / R and q alpha, mean and covariance, by either engine; both engines agree in the variances."""
    found = as504.response_statistics([60.0, TIME], engine=engine).dataset
    R = as504.parameters["loads.bending_moment.radius"].value
    names = ["axial_force", "bending_moment"]
    P = found["covariance"].sel(response=names, other_response=names, source="combined").values
    mean = found["mean"].sel(source="combined")
    for name, sign in ((PLUS, 1), (MINUS, -1)):
        c = np.array([1, sign * 2 / R])
        variance = found["variance"].sel(response=name, source="combined").values
        np.testing.assert_allclose(variance, np.einsum("i,tij,j->t", c, P, c), rtol=1e-9)
        np.testing.assert_allclose(mean.sel(response=name), mean.sel(response=names).values @ c, rtol=1e-9)
    q = [as504.tables(t)["dynamic_pressure"] for t in (60.0, TIME)]
    np.testing.assert_allclose(
        found["std"].sel(response="q_alpha").T, q * found["std"].sel(response="angle_of_attack").T
    )
    other = as504.response_statistics([60.0, TIME], engine=Sweep(relative_tolerance=1e-9)).dataset
    np.testing.assert_allclose(found["std"], other["std"], rtol=1e-6)


def test_a_mirrored_mean_wind_changes_sides_and_no_load(as504):
    mirrored = as504.with_parameters({"wind.mean_scale": -1.0})
    here, there = (s.response_statistics([TIME]) for s in (as504, mirrored))
    for quantity in ("mean", "std"):
        a, b = (s.dataset[quantity].sel(source="combined").squeeze() for s in (here, there))
        np.testing.assert_allclose(a.sel(response=[PLUS, MINUS]), b.sel(response=[MINUS, PLUS]), rtol=1e-7)
        assert float(a.sel(response="axial_force")) == pytest.approx(float(b.sel(response="axial_force")), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("options", [("slosh_reaction",), ("slosh_reaction", "local_angle_of_attack")])
def test_along_the_vehicle_every_load_is_the_output_at_its_station(options):
    """By covariances of one run and by rows of the state, each against the output itself."""
    study = Study.load("as504", changes={f"options.{name}": True for name in options})
    tight, times = Sweep(relative_tolerance=1e-10), [60.0, TIME]
    direct = study.response_statistics(times, engine=tight).dataset
    for load, unit in LOADS.items():
        name = load_name("bending_moment", load)
        along = loads_along_vehicle(study, times, load=load, engine=tight).sel(station=25.0)
        assert along["mean"].attrs["units"] == unit
        expected = direct["std"].sel(response=name)
        np.testing.assert_allclose(along["std"], expected, rtol=1e-8, atol=1e-9 * float(expected.max()), err_msg=load)
        mean = direct["mean"].sel(response=name, source="combined")
        np.testing.assert_allclose(along["mean"], mean, rtol=1e-8, err_msg=load)
        rows = load_rows(study, times, [25.0], load=load)
        k = study.system.output_index(name)
        C = np.array([study.matrices(t)[2][k] for t in times])
        np.testing.assert_allclose(rows.state[:, 0], C, atol=1e-8 * np.abs(C).max(), err_msg=load)


@pytest.mark.slow
@pytest.mark.parametrize("name", built_in_vehicles())
def test_loads_vanish_at_both_ends(name):
    """The moment but for slosh: tables of the rigid body have another centre of gravity than the line, by up to 0.5 mm.

    The coefficients themselves are held to 1e-11 where they are computed.
    """
    study = Study.load(name)
    for load in ("bending_moment", "shear_force", "axial_force"):
        along = loads_along_vehicle(study, [60.0, 70.0], load=load)
        for quantity in ("mean", "std"):
            values = np.abs(along[quantity].values)
            most = 1e-5 if load == "bending_moment" else 1e-9
            assert (values[:, [0, -1]] <= most * values.max()).all(), (load, quantity)


def test_a_vehicle_without_the_tables_has_the_moment_alone(vehicle_folder):
    """As vehicles were made before: no shear, no axial force, and nothing else changes."""
    toml, added = vehicle_folder / "vehicle.toml", r"\[(loads\.(shear|axial)|tables\.(shear|axial)_along_vehicle)\]"
    text, end = toml.read_text(), r"(\n\n|\n(?=\[))"
    toml.write_text(re.sub(r"radius_m = .*\n", "", re.sub(rf"{added}(.*\n)*?events.*{end}", "\n", text)))
    study = Study.load(vehicle_folder, compile=False)
    assert study.system.output_names == ("bending_moment", "angle_of_attack", "engine_angle", "q_alpha")
    assert study.system.input_names == ("wind",)
    assert not study.system.conditions
    with pytest.raises(
        DataError, match=r"tables\.shear_along_vehicle.*the shear force along the vehicle.*build-vehicle"
    ):
        loads_along_vehicle(study, [TIME], load="shear_force")


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("forward_of_gimbal_m = 22.46\n", "", "need forward_of_gimbal_m; add it"),
        ("radius_m = 5.0292", "radius_m = -5.0", "radius_m"),
        ('output = "bending_moment"', 'output = "q_alpha"', "'q_alpha' is taken by a response of every vehicle"),
    ],
)
def test_stations_that_cannot_be_used_are_refused(edit, old, new, why):
    with pytest.raises(DataError, match=why):
        load_vehicle(edit(old, new))


def test_names_of_loads_that_two_have_are_refused(vehicle_folder):
    vehicle = load_vehicle(vehicle_folder)
    load = vehicle.file.loads[0]
    assert load_name("bending_moment_2", "shear_force") == "shear_force_2"
    assert load_name("tower", "shear_force") == "tower_shear_force"
    text = (vehicle_folder / "vehicle.toml").read_text()
    table = f'[loads.table]\nfile = "{load.table.file}"\nstatus = "computed"\nsource = "again"\n'
    entry = f'[[loads]]\noutput = "shear_force"\nstation_m = 25.0\n{table}events = ["center_engine_cutoff"]\n\n'
    (vehicle_folder / "vehicle.toml").write_text(
        text.replace("# Relative deviations", entry + "# Relative deviations", 1)
    )
    with pytest.raises(DataError, match="two loads have the same output name 'shear_force'"):
        load_vehicle(vehicle_folder)


def test_radius_is_a_parameter(as504):
    """Of the equivalent loads alone, by 2 M / R."""
    twice = as504.with_parameters({"loads.bending_moment.radius": 2 * 5.0292})
    a, b = (s.response_statistics([TIME]).mean.sel(source="wind", time=TIME) for s in (as504, twice))
    change = a - b
    M = float(a.sel(response="bending_moment"))
    assert float(change.sel(response=PLUS)) == pytest.approx(M / 5.0292, rel=1e-6)
    assert float(change.sel(response="shear_force")) == pytest.approx(0, abs=1e-6 * abs(M))


@pytest.mark.slow
def test_sensitivities_of_the_new_loads(as504):
    """The axial force's deviation is proportional to the noise's, its mean to no parameter; shear by differences."""
    found = as504.sensitivity("axial_force", TIME)
    elasticity = found["elasticity"].to_series()
    assert elasticity["thrust.sigma"] == pytest.approx(1, rel=1e-6)
    assert abs(elasticity.drop("thrust.sigma")).max() < 1e-6
    mean = as504.sensitivity("axial_force", TIME, quantity="mean")
    assert abs(mean["derivative"].values).max() < 1e-6 * 2e7  # no parameter is in it, tables alone
    checked = as504.check_sensitivity("shear_force", TIME, parameters=["thrust.sigma", "bending.1.damping"])
    assert checked["agrees"].values.all()
