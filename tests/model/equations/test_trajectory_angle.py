"""The angle of attack of the flight without wind itself, and a heading that turns along the flight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planes import HORIZONTAL, in_both, in_one

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.errors import DataError
from ascentwind.model.tables import Table
from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.vehicle import Vehicle
from ascentwind.model.wind.statistics import WindModel
from ascentwind.model.wind.two_components import TwoComponentWind
from ascentwind.runners import Study
from ascentwind.runners.solvers.mean_response import mean_response
from ascentwind.runners.views.trajectory_angle import in_words, trajectory_angle, trajectory_angle_csv

TIMES = (20.0, 75.0, 120.0)
OWN = {"options.trajectory_angle_of_attack": True}
TURNING = {"wind.azimuth_change": True}


def matrices(study: Study, time: float) -> dict:
    names = ("A", "B", "C", "E", "G")
    found = MatrixEvaluator(study.with_means, names)(time, study.system.start, study.system.end)
    return dict(zip(names, found, strict=True))


@pytest.mark.parametrize("plane", ["pitch", "yaw"])
def test_own_angle_acts_as_its_wind_but_on_the_path_it_has_turned_already(plane):
    """A known input of value one puts into every row V alpha times what a wind across the path puts there.

    The lateral velocity is measured from the flight without wind, which has met that force: none is left there.
    """
    with_it, without = (
        Study.from_vehicle(in_one(plane, "zonal", HORIZONTAL | changes), compile=False) for changes in (OWN, {})
    )
    system, vehicle = with_it.system, with_it.vehicle_for("a test")
    row = system.state_names.index("lateral_velocity")
    for time in TIMES:
        found, known, at = matrices(with_it, time), matrices(without, time), with_it.tables(time)
        own = float(vehicle.own_angles[plane].polynomial(time))
        wind = at["relative_velocity"] * own
        for name in ("E", "G"):
            expected = known[name][:, -1] + wind * known[name][:, 0]
            if name == "E":
                force = at["dynamic_pressure"] * with_it.parameters["reference_area"].value * at["normal_force_slope"]
                assert expected[row] == pytest.approx(force * own / at["mass"], rel=1e-9)
                expected[row] = 0.0
            scale = np.abs(expected).max()
            np.testing.assert_allclose(found[name][:, -1], expected, rtol=1e-10, atol=1e-12 * scale, err_msg=name)
        assert found["G"][system.output_index("angle_of_attack"), -1] == pytest.approx(own, rel=1e-12)
        moved = [i for i, name in enumerate(system.state_names) if not name.startswith("deviation")]
        np.testing.assert_array_equal(found["A"][:, moved], known["A"][:, moved])


def test_own_angle_is_in_the_means_of_both_planes():
    """The deviations of thrust and centre of pressure act on the angle that is there, the flight's own included."""
    vehicle = in_both(OWN)
    assert isinstance(vehicle.wind, TwoComponentWind)
    still = replace(
        vehicle.wind,
        **{
            name: replace(part, mean=replace(part.mean, values=0 * part.mean.values))
            for name, part in vehicle.wind.components.items()
        },
    )
    study = Study.from_vehicle(replace(vehicle, wind=still), compile=False)
    system, times = study.system, np.array([10.0, 30.0, 75.0])
    mean = mean_response(study.with_means, times)
    for plane in ("pitch", "yaw"):
        own = vehicle.own_angles[plane].polynomial(times)
        attitude, drift = (
            mean.states[:, system.state_names.index(f"{plane}_{name}")] for name in ("attitude", "lateral_velocity")
        )
        speed = np.array([study.tables(t)["relative_velocity"] for t in times])
        total = own + attitude - drift / speed
        np.testing.assert_allclose(mean.outputs[:, system.output_index(f"{plane}_angle_of_attack")], total, rtol=1e-9)
        assert study.tables(75.0)[f"{plane}.mean.angle_of_attack"] == pytest.approx(total[-1], rel=1e-6)


def test_own_angle_is_told_either_way():
    vehicle = in_one("pitch", "zonal")
    found = trajectory_angle(vehicle, [40.0, 70.0])
    assert found is not None
    angle, wind = (found[name].sel(plane="pitch").values for name in ("angle_of_attack", "equivalent_wind"))
    speed = vehicle.tables["relative_velocity"].polynomial([40.0, 70.0])
    np.testing.assert_allclose(wind, speed * angle, rtol=1e-14)
    assert np.degrees(angle[1]) == pytest.approx(-0.463, abs=0.001)  # nose up, by fly() at 70 s
    (sentence,) = in_words(found)
    assert "0.46° nose up at 70 s" in sentence and "-2.9 m/s" in sentence and "left out" in sentence
    taken = trajectory_angle(in_both(OWN), [70.0])
    assert taken is not None and [s.endswith("taken in.") for s in in_words(taken)] == [True, True]
    assert trajectory_angle_csv(taken).splitlines()[0].count(",") == 4
    assert trajectory_angle(replace(vehicle, own_angles={}), [70.0]) is None


# ---- a heading that turns ----

RATE = 0.02  # rad/s


def turning(vehicle: Vehicle, change) -> Vehicle:
    knots = vehicle.tables["altitude"].argument
    table = Table("azimuth_change", "rad", knots, change(knots), "cubic", vehicle.discontinuities)
    return replace(vehicle, tables=vehicle.tables | {"azimuth_change": table})


def constant_wind(vehicle: Vehicle, east: float, north: float) -> Vehicle:
    wind = vehicle.wind
    assert isinstance(wind, TwoComponentWind)
    parts = {
        name: replace(part, mean=replace(part.mean, values=np.full_like(part.mean.values, value)))
        for (name, part), value in zip(wind.components.items(), (east, north), strict=True)
    }
    return replace(vehicle, wind=replace(wind, **parts))


def test_a_rotating_azimuth_turns_a_constant_wind():
    """Closed form: of 10 m/s east and 4 m/s north, across and along an azimuth Az + w t."""
    vehicle = turning(constant_wind(in_both(HORIZONTAL | TURNING), 10.0, 4.0), lambda t: RATE * t)
    study = Study.from_vehicle(vehicle, compile=False)
    for azimuth in (0.0, 1.0):
        turned = study.with_parameters({"wind.azimuth": azimuth})
        for time in TIMES:
            G, V = matrices(turned, time)["G"], turned.tables(time)["relative_velocity"]
            heading = azimuth + RATE * time
            for plane, met in (
                ("pitch", 10 * np.sin(heading) + 4 * np.cos(heading)),
                ("yaw", 10 * np.cos(heading) - 4 * np.sin(heading)),
            ):
                row = G[turned.system.output_index(f"{plane}_angle_of_attack"), :2]
                assert row @ [10.0, 4.0] == pytest.approx(met / V, rel=1e-12)


def test_a_mean_of_a_rotating_azimuth_is_that_of_a_wind_that_turns_over_altitude():
    """The yaw plane alone in the mean wind 10 cos(w t(h)) knows no azimuth and answers alike."""
    vehicle = turning(constant_wind(in_both(HORIZONTAL | TURNING), 10.0, 0.0), lambda t: RATE * t)
    both = Study.from_vehicle(vehicle, compile=False).with_parameters({"wind.azimuth": 0.0})
    alone = in_one("yaw", "zonal")
    assert isinstance(alone.wind, WindModel)
    times = np.arange(vehicle.start, vehicle.end, 0.1)
    over = Table("wind.mean", "m/s", vehicle.tables["altitude"].polynomial(times), 10 * np.cos(RATE * times), "cubic")
    one = Study.from_vehicle(replace(alone, wind=replace(alone.wind, mean=over)), compile=False)
    at = np.array([10.0, 40.0, 75.0, 110.0])
    found, expected = (mean_response(s.executable, at).outputs for s in (both, one))
    for name in ("bending_moment", "angle_of_attack", "engine_angle"):
        np.testing.assert_allclose(
            found[1:, both.system.output_index(f"yaw_{name}")],
            expected[1:, one.system.output_index(name)],
            rtol=1e-6,
            err_msg=name,
        )


def test_a_constant_change_is_another_azimuth():
    vehicle = in_both(HORIZONTAL | TURNING)
    changed = Study.from_vehicle(turning(vehicle, lambda t: 0.3 + 0 * t), compile=False)
    plain = Study.from_vehicle(in_both(HORIZONTAL), compile=False)
    plain = plain.with_parameters({"wind.azimuth": plain.parameters["wind.azimuth"].value + 0.3})
    for name, value in matrices(changed, 75.0).items():
        other = matrices(plain, 75.0)[name]
        np.testing.assert_allclose(value, other, rtol=1e-9, atol=1e-12 * np.abs(other).max(), err_msg=name)


def test_the_heading_of_as504_turns_by_a_fifth_of_a_degree_until_its_peak():
    table = in_both(TURNING).tables["azimuth_change"]
    assert np.degrees(table.polynomial(75.0)) == pytest.approx(0.200, abs=0.001)
    assert "azimuth_change" not in in_both().tables


CASES = {
    "own angle without its column": (OWN, ("angle_of_attack_pitch [rad]", "other [rad]"), "needs it"),
    "own angle in degrees": (OWN, ("angle_of_attack_pitch [rad]", "angle_of_attack_pitch [deg]"), "rad"),
    "change without its column": (TURNING, (",azimuth_change [rad]", ",azimuth_chang [rad]"), "azimuth_chang"),
    "change in degrees": (TURNING, ("azimuth_change [rad]", "azimuth_change [deg]"), "rad"),
}


@pytest.mark.parametrize("name", CASES)
def test_columns_that_cannot_be(name, edit):
    changes, (old, new), words = CASES[name]
    folder = edit(old, new, "trajectory.csv")
    with pytest.raises(DataError, match=words):
        load_vehicle(folder, {"planes": "both"} | changes)


def test_an_option_without_its_column_says_what_makes_it(vehicle_folder):
    file = vehicle_folder / "trajectory.csv"
    lines = [line if line.startswith("#") else line.rsplit(",", 3)[0] for line in file.read_text().splitlines()]
    file.write_text("\n".join(lines) + "\n")
    load_vehicle(vehicle_folder, {"planes": "both"})
    for changes, key in ((OWN, "options.trajectory_angle_of_attack"), (TURNING, "wind.azimuth_change")):
        with pytest.raises(DataError, match=f"is missing, but {key} needs it; 'ascentwind build-vehicle'"):
            load_vehicle(vehicle_folder, {"planes": "both"} | changes)


def test_an_angle_in_degrees_under_a_head_of_radians_is_refused(vehicle_folder):
    file = vehicle_folder / "trajectory.csv"
    rows = file.read_text().splitlines()
    cells = rows[70].split(",")
    rows[70] = ",".join([*cells[:6], "0.6", *cells[7:]])
    file.write_text("\n".join(rows) + "\n")
    with pytest.raises(DataError, match=r"trajectory.csv.*is 0.6 rad, 34 degrees.*in degrees\?"):
        load_vehicle(vehicle_folder)


def test_options_that_do_not_go_together(vehicle_folder):
    with pytest.raises(DataError, match="linear mean"):
        load_vehicle(vehicle_folder, OWN | {"options.mean_response": "nonlinear"})
    with pytest.raises(DataError, match='planes = "both"'):
        load_vehicle(vehicle_folder, TURNING)


def test_azimuth_of_another_flight_is_refused_in_every_plane(vehicle_folder):
    for planes in ("yaw", "pitch", "both"):
        with pytest.raises(DataError, match="azimuth_deg"):
            load_vehicle(vehicle_folder, {"planes": planes, "wind.azimuth_deg": 71.0})
    toml = vehicle_folder / "vehicle.toml"
    text = toml.read_text()
    toml.write_text(text.replace("azimuth_deg = 72.0", "azimuth_deg = 71.0"))
    for planes in ("yaw", "pitch", "both"):
        with pytest.raises(DataError, match=r"site.azimuth_deg = 72"):
            load_vehicle(vehicle_folder, {"planes": planes})
