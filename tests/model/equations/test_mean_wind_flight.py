"""The flight through its mean wind: speed and pressure with head- and tailwind, and the wind-biased programme."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planes import in_both, in_one

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.equations.station_loads import load_station_loads
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.mean_wind import BIASED_OVER, GROUND_VELOCITY, PROGRAMME, mean_wind
from ascentwind.model.vehicle.mean_wind import through_mean_wind as through
from ascentwind.model.vehicle.mean_wind import with_biased_programme as biased
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.vehicle import Vehicle
from ascentwind.model.wind.statistics import WindModel
from ascentwind.runners import Study
from ascentwind.runners.solvers.mean_response import mean_response
from ascentwind.runners.views.trajectory_angle import air_speed_in_words

TIMES = (20.0, 60.0, 75.0, 120.0)
AIR = {"wind.air_speed": "mean_wind"}
BIASED = {"options.wind_biased_programme": True}


def matrices(study: Study, time: float) -> dict:
    names = ("A", "C", "E", "G")
    found = MatrixEvaluator(study.with_means, names)(time, study.system.start, study.system.end)
    return dict(zip(names, found, strict=True))


def along(vehicle: Vehicle, speed: float) -> Vehicle:
    """The same wind at all altitudes, along the heading of a vehicle in pitch."""
    assert isinstance(vehicle.wind, WindModel)
    mean = replace(vehicle.wind.mean, values=np.full_like(vehicle.wind.mean.values, speed))
    return replace(vehicle, wind=replace(vehicle.wind, mean=mean))


# ---- speed through the air ----


@pytest.mark.parametrize("wind", [30.0, -30.0])
def test_angles_in_the_mean_wind_are_those_of_the_triangle(wind):
    """Ground speed, wind and speed through the air are the sides of a triangle.

    Mean: sin alpha = W sin(gamma) / V_air by the law of sines; a deviation from it turns the path by
    d/dW atan2(W sin(gamma), V - W cos(gamma)) = V sin(gamma) / V_air^2.
    """
    plain = along(in_one("pitch", "zonal"), wind)
    study = Study.from_vehicle(through(plain), compile=False)
    row = study.system.output_index("angle_of_attack")
    for time in TIMES:
        at = {n: float(t.polynomial(time)) for n, t in plain.tables.items() if n in ("relative_velocity", "mass")}
        V, climb = at["relative_velocity"], float(plain.tables["altitude"].polynomial.derivative()(time))
        gamma = np.arcsin(min(climb / V, 1.0))
        path = np.array([V * np.cos(gamma) - wind, V * np.sin(gamma)])
        air = np.hypot(*path)
        now = study.tables(time)
        assert now["relative_velocity"] == pytest.approx(air, rel=2e-5)  # between rows of the trajectory
        q = plain.tables["dynamic_pressure"].polynomial(time)
        assert now["dynamic_pressure"] == pytest.approx(q * (air / V) ** 2, rel=1e-4)
        drag = plain.tables["axial_drag"].polynomial(time)
        assert now["axial_drag"] == pytest.approx(drag * (air / V) ** 2, rel=1e-3)
        gained = now["axial_acceleration"] - plain.tables["axial_acceleration"].polynomial(time)
        assert gained == pytest.approx(drag * (1 - (air / V) ** 2) / at["mass"], rel=2e-2, abs=1e-4)
        m, air = matrices(study, time), now["relative_velocity"]
        assert m["G"][row, 0] == pytest.approx(climb / air**2, rel=1e-9)
        assert m["G"][row] @ [wind, 1.0] == pytest.approx(wind * climb / V / air, rel=1e-9)
        wind_state = [k for k, name in enumerate(study.system.state_names) if name.startswith("wind")]
        H = plain.wind.shaping_filter.at(float(plain.tables["altitude"].polynomial(time)))[2]
        np.testing.assert_allclose(m["C"][row, wind_state], climb / air**2 * H, rtol=1e-6)
        step = 1e-4
        turned = [np.arctan2(w * np.sin(gamma), V - w * np.cos(gamma)) for w in (wind - step, wind + step)]
        slope = V * np.sin(gamma) / np.hypot(*path) ** 2
        assert (turned[1] - turned[0]) / (2 * step) == pytest.approx(slope, rel=1e-6)


def test_a_wind_across_the_heading_raises_the_speed_of_both_planes():
    vehicle = in_both()
    found = through(vehicle)
    wind = np.array(mean_wind(vehicle, TIMES))
    V, climb = vehicle.tables["relative_velocity"].polynomial(TIMES), vehicle.tables["altitude"].polynomial(TIMES, 1)
    expected = V**2 - 2 * wind[0] * np.sqrt(V**2 - climb**2) + (wind**2).sum(axis=0)
    np.testing.assert_allclose(found.tables["relative_velocity"].polynomial(TIMES) ** 2, expected, rtol=1e-3)
    assert found.tables[GROUND_VELOCITY].values is vehicle.tables["relative_velocity"].values


def test_every_force_of_the_air_follows_the_speed():
    """Of all columns of A and C without sensors: what the air does, by its power of V, and nothing else."""
    options = {"planes": "pitch", "options.local_angle_of_attack": True}
    plain = along(load_vehicle(built_in_vehicles()["as504"], options), 40.0)
    changed = through(plain)
    one, other = (Study.from_vehicle(v, compile=False) for v in (plain, changed))
    time = 75.0  # a row of the trajectory
    ratio = other.tables(time)["relative_velocity"] / one.tables(time)["relative_velocity"]
    names = one.system.state_names
    moment = one.system.output_index("bending_moment")
    here, there = matrices(one, time), matrices(other, time)
    # a wind's force goes with q / V, an angle's with q
    for column, power in (("lateral_velocity", 1), ("bending_rate_1", 1)):
        k = names.index(column)
        row = moment if column == "lateral_velocity" else names.index("attitude_rate")
        matrix = "C" if column == "lateral_velocity" else "A"
        pair = here[matrix][row, k], there[matrix][row, k]
        assert pair[1] / pair[0] == pytest.approx(ratio**power, rel=1e-9), column
    k = names.index("attitude")
    thrust = one.tables(time)["thrust"]
    air = [
        m["A"][names.index("lateral_velocity"), k] - (thrust - s.tables(time)["axial_drag"]) / s.tables(time)["mass"]
        for m, s in ((here, one), (there, other))
    ]
    assert air[1] / air[0] == pytest.approx(ratio**2, rel=1e-9)
    # stations along the vehicle have the coefficients of the station's own table
    for vehicle in (plain, changed):
        stations = load_station_loads(vehicle)
        k = int(np.argmin(np.abs(stations.station - 25.0)))
        for column in ("angle_of_attack", "engine_angle", "bending_displacement_1", "bending_rate_1"):
            own = next(t for n, t in vehicle.tables.items() if n.endswith(f"loads.bending_moment.{column}"))
            value = stations.at(np.array([time]))[column][0, k]
            assert value == pytest.approx(float(own.polynomial(time)), rel=1e-6), column


def test_the_change_of_speed_is_told_either_way():
    vehicle = in_both()
    text = air_speed_in_words(vehicle, [60.0, 75.0])
    assert "404.8 m/s at 75 s" in text and "-8.3 %" in text and 'wind.air_speed = "mean_wind"' in text
    assert air_speed_in_words(in_both(AIR), [75.0]).endswith("taken in.")


# ---- the wind-biased programme ----


@pytest.mark.parametrize("changes", [{}, {"options.trajectory_angle_of_attack": True}, AIR])
def test_the_programme_is_a_flight_at_zero_angle_of_attack(changes):
    """With Y' = V (phi + alpha_0) + W taken from the table, m dY'/dt is the force across the path."""
    vehicle = in_both(BIASED | changes)
    t = np.arange(vehicle.start + BIASED_OVER + 2.0, 130.0, 0.5)
    at = {n: table.polynomial(t) for n, table in vehicle.tables.items()}
    own = at.get("angle_of_attack_pitch", 0 * t)
    W = mean_wind(vehicle, t)[0] * vehicle.tables["altitude"].polynomial(t, 1)
    W /= at.get(GROUND_VELOCITY, at["relative_velocity"])
    drift = at["relative_velocity"] * (at[PROGRAMME] + own) + W
    force = (at["thrust"] - at["axial_drag"]) * at[PROGRAMME]
    force -= at["dynamic_pressure"] * vehicle.file.reference_area_m2 * at["normal_force_slope"] * own
    gained = np.concatenate([[0.0], np.cumsum(0.25 * (force / at["mass"])[1:] + 0.25 * (force / at["mass"])[:-1])])
    np.testing.assert_allclose(drift - drift[0], gained, atol=0.02 * np.ptp(drift))
    assert abs(vehicle.tables[PROGRAMME].polynomial(vehicle.end)) < 1e-9
    assert abs(vehicle.tables[PROGRAMME].polynomial(vehicle.start)) < 1e-3


@pytest.mark.slow
def test_the_mean_flies_it_and_nothing_but_the_mean_changes():
    plain, vehicle = in_both(), in_both(BIASED)
    one, other = (Study.from_vehicle(v, compile=False) for v in (plain, vehicle))
    times = np.array([10.0, 50.0, 60.0, 75.0, 90.0])
    before, after = (mean_response(s.executable, times).outputs[1:] for s in (one, other))
    k = one.system.output_index("pitch_angle_of_attack")
    assert (np.abs(after[:, k]) < 0.05 * np.abs(before[:, k]).max()).all()
    yaw = [i for i, name in enumerate(one.system.output_names) if name.startswith("yaw_")]
    scale = np.abs(before[:, yaw]).max(axis=0)
    np.testing.assert_allclose(after[:, yaw] / scale, before[:, yaw] / scale, atol=1e-6)
    here, there = matrices(one, 75.0), matrices(other, 75.0)
    free = [i for i, name in enumerate(one.system.state_names) if not name.startswith("deviation")]
    for name in ("A", "C"):
        np.testing.assert_array_equal(here[name][:, free], there[name][:, free])
    np.testing.assert_array_equal(here["E"][:, :2], there["E"][:, :2])


def test_without_wind_nothing_is_biased():
    vehicle = biased(along(in_one("pitch", "zonal"), 0.0))
    assert np.abs(vehicle.tables[PROGRAMME].values).max() < 1e-12


@pytest.mark.parametrize("planes", ["yaw", "pitch"])
def test_roll_is_of_both_planes(planes):
    with pytest.raises(DataError, match=f'roll_deg.*planes = "{planes}"'):
        load_vehicle(built_in_vehicles()["as504"], {"planes": planes, "roll_deg": 10.0})


@pytest.mark.parametrize("changes", [AIR, BIASED])
def test_options_of_pitch_are_refused_in_yaw(changes):
    with pytest.raises(DataError, match=f'{next(iter(changes))}.*changes nothing in planes = "yaw"'):
        load_vehicle(built_in_vehicles()["as504"], changes)


def test_a_programme_that_tilts_too_far_is_refused():
    with pytest.raises(DataError, match="wind_biased_programme.*degrees to fly the mean wind"):
        biased(along(in_one("pitch", "zonal"), 200.0))
