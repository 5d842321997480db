"""Two planes as one system: blocks of single planes, signs, the wind by azimuth, deviations in common or apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planes import EACH, HORIZONTAL, in_both, in_one

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.model.tables import table_values
from ascentwind.model.vehicle.planes import flown_planes
from ascentwind.model.wind.two_components import TwoComponentWind, plane_weights
from ascentwind.runners import Study

TIMES = (20.0, 75.0, 120.0)
THREE = ("bending_moment", "angle_of_attack", "engine_angle")


def study(vehicle) -> Study:
    return Study.from_vehicle(vehicle, compile=False)


@pytest.fixture(scope="module")
def both():
    return study(in_both())


def all_matrices(s: Study, time: float) -> dict:
    names = ("A", "B", "C", "D", "E", "G")
    return dict(zip(names, MatrixEvaluator(s.with_means, names)(time, s.system.start, s.system.end), strict=True))


def rows(system, prefix: str, names) -> list[int]:
    return [system.state_names.index(prefix + name) for name in names]


@pytest.mark.parametrize("zones", [1, 5])
@pytest.mark.parametrize(("plane", "component"), [("yaw", "zonal"), ("pitch", "meridional")])
def test_azimuth_zero_with_a_deviation_each_is_the_plane_alone(plane, component, zones):
    """At azimuth 0 yaw meets u and pitch meets v: every entry of every matrix is that of the plane alone."""
    changes = HORIZONTAL | {"options.gust_zones": zones}
    joint = study(in_both(changes | EACH, independent=True)).with_parameters({"wind.azimuth": 0.0})
    alone = study(in_one(plane, component, changes))
    system, single = joint.system, alone.system
    own = [name for name in single.state_names if not name.startswith(("wind", "deviation"))]
    first = 0 if component == "zonal" else 3
    states = rows(system, f"{plane}_", own)
    states += [system.state_names.index(f"wind_{first + k}") for k in (1, 2, 3)]
    states += [system.state_names.index(f"deviation_{n}_{plane}") for n in ("thrust", "center_of_pressure")]
    noises = [f"wind_{2 * (first // 3) + k}" for k in (1, 2)] + [
        f"{n}_{plane}" for n in ("thrust", "center_of_pressure")
    ]
    columns = [system.noise_names.index(name) for name in noises]
    inputs = [system.input_names.index(f"wind_{component}"), system.input_names.index("undisturbed_flight")]
    shared = [n for n in single.output_names if f"{plane}_{n}" in system.output_names]
    outputs = [system.output_index(f"{plane}_{n}") for n in shared]
    for time in TIMES:
        found, expected = all_matrices(joint, time), all_matrices(alone, time)
        kept = [single.output_index(n) for n in shared]
        for name, at, one in (
            ("A", np.ix_(states, states), np.s_[:, :]),
            ("B", np.ix_(states, columns), np.s_[:, :]),
            ("C", np.ix_(outputs, states), np.s_[kept]),
            ("D", np.ix_(outputs, columns), np.s_[kept]),
            ("E", np.ix_(states, inputs), np.s_[:, :]),
            ("G", np.ix_(outputs, inputs), np.s_[kept]),
        ):
            scale = np.abs(expected[name]).max() or 1.0
            np.testing.assert_allclose(
                found[name][at], expected[name][one], rtol=1e-12, atol=1e-9 * scale, err_msg=name
            )
        # nothing else reaches the plane
        others = [k for k in range(len(system.states)) if k not in states]
        assert not found["A"][np.ix_(states[: len(own)], others)].any()


@pytest.mark.slow
@pytest.mark.parametrize(("plane", "component"), [("yaw", "zonal"), ("pitch", "meridional")])
def test_azimuth_zero_with_a_deviation_each_is_the_plane_alone_to_rounding(plane, component):
    """With one table of the mean for both, matrices agree to 1e-15 and, integrated by the same steps, results to 1e-12.

    Engines choose their own steps in either system, and agree as far as their tolerance.
    """
    joint = study(in_both(HORIZONTAL | EACH, independent=True)).with_parameters({"wind.azimuth": 0.0})
    alone = study(in_one(plane, component, HORIZONTAL))
    both, one = joint.with_means, alone.with_means
    at = next(i for i, g in enumerate(one.groups) if g.kind == "mean")
    given = next(g for g in both.groups if g.kind == "mean")
    columns = [given.names.index(f"{plane}.{name}") for name in one.groups[at].names]
    mean = replace(one.groups[at], coefficients=given.coefficients[:, :, columns])
    one = one.with_numbers(groups=(*one.groups[:at], mean, *one.groups[at + 1 :]))
    names: tuple[str, ...] = ("A", "B", "C", "E", "G", "inputs")
    systems = [(s, MatrixEvaluator(s, names)) for s in (both, one)]
    first = 0 if component == "zonal" else 3

    def other(name: str) -> str:
        if name.startswith("wind_"):
            return f"wind_{first + int(name.removeprefix('wind_'))}"
        return f"{name}_{plane}" if name.startswith("deviation_") else f"{plane}_{name}"

    states = [joint.system.state_names.index(other(name)) for name in alone.system.state_names]
    outputs = [alone.system.output_index(name) for name in THREE]
    of_plane = [joint.system.output_index(f"{plane}_{name}") for name in THREE]
    inputs = [joint.system.input_names.index(f"wind_{component}"), joint.system.input_names.index("undisturbed_flight")]
    start, end = alone.system.start, alone.system.end
    for time in TIMES:
        found, expected = (
            dict[str, np.ndarray](zip(names, evaluate(time, start, end), strict=True)) for _, evaluate in systems
        )
        for name, rows, cols in (("A", states, states), ("C", of_plane, states), ("E", states, inputs)):
            wanted = expected[name][outputs] if name == "C" else expected[name]
            scale = np.abs(wanted).max()
            np.testing.assert_allclose(found[name][np.ix_(rows, cols)], wanted, rtol=1e-13, atol=1e-15 * scale)

    found, expected = (
        classical(system, evaluate, start + 6.0, rows)
        for (system, evaluate), rows in zip(systems, (of_plane, outputs), strict=True)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def classical(system, evaluate, stop: float, rows: list[int], step: float = 0.01) -> np.ndarray:
    """Mean and standard deviation of outputs at a time by the classical Runge-Kutta formula with equal steps."""
    low, high = system.system.start, system.system.end
    sources = system.system.sources
    P = np.sum([system.system.start_covariance_matrix(source, system.parameters) for source in sources], axis=0)
    x = np.zeros(P.shape[0])

    def rate(at, P, x):
        A, B, _, E, _, inputs = at
        AP = A @ P
        return AP + AP.T + B @ B.T, A @ x + E @ inputs[:, 0]

    for k in range(round((stop - low) / step)):
        at = [evaluate(low + (k + part) * step, low, high) for part in (0.0, 0.5, 1.0)]
        first = rate(at[0], P, x)
        second = rate(at[1], P + step / 2 * first[0], x + step / 2 * first[1])
        third = rate(at[1], P + step / 2 * second[0], x + step / 2 * second[1])
        fourth = rate(at[2], P + step * third[0], x + step * third[1])
        P, x = (
            value + step / 6 * (a + 2 * b + 2 * c + d)
            for value, a, b, c, d in zip((P, x), first, second, third, fourth, strict=True)
        )
    _, _, C, _, G, inputs = evaluate(stop, low, high)
    return np.array([C[rows] @ x + G[rows] @ inputs[:, 0], np.sqrt(np.diag(C[rows] @ P @ C[rows].T))])


def test_planes_meet_in_wind_and_deviations_alone(both):
    system = both.system
    pitch, yaw = ([i for i, n in enumerate(system.state_names) if n.startswith(p)] for p in ("pitch_", "yaw_"))
    A = all_matrices(both, 75.0)["A"]
    assert not A[np.ix_(pitch, yaw)].any() and not A[np.ix_(yaw, pitch)].any()
    for name in ("deviation_thrust", "deviation_center_of_pressure"):
        column = A[:, system.state_names.index(name)]
        assert column[pitch].any() and column[yaw].any()


@pytest.mark.parametrize("azimuth", [0.0, 0.7, 2.0, 4.0])
def test_wind_is_turned_by_the_azimuth(both, azimuth):
    """The angle of attack feels W / V: u cos Az - v sin Az in yaw, (u sin Az + v cos Az) sin gamma in pitch."""
    s = both.with_parameters({"wind.azimuth": azimuth})
    for time in TIMES:
        G, at = all_matrices(s, time)["G"], s.tables(time)
        sine = at["altitude_rate"] / at["relative_velocity"]
        for plane, factor in (("pitch", sine), ("yaw", 1.0)):
            row = G[s.system.output_index(f"{plane}_angle_of_attack"), :2]
            expected = factor * np.array(plane_weights(azimuth, plane)) / at["relative_velocity"]
            np.testing.assert_allclose(row, expected, rtol=1e-12, atol=1e-18)


def test_pitch_alone_takes_the_part_across_the_path():
    s = study(in_one("pitch", "zonal"))
    G, at = all_matrices(s, 75.0)["G"], s.tables(75.0)
    expected = at["altitude_rate"] / at["relative_velocity"] ** 2
    assert G[s.system.output_index("angle_of_attack"), 0] == pytest.approx(expected, rel=1e-12)


def test_a_tail_wind_pitches_over_and_turns_to_a_positive_angle(both):
    """With azimuth 90 a wind towards the east is a tail wind: positive angle of attack in pitch, nothing in yaw."""
    vehicle = in_both()
    assert isinstance(vehicle.wind, TwoComponentWind)
    east = replace(vehicle.wind.zonal.mean, values=np.full_like(vehicle.wind.zonal.mean.values, 10.0))
    still = replace(vehicle.wind.meridional.mean, values=np.zeros_like(east.values))
    wind = replace(
        vehicle.wind,
        zonal=replace(vehicle.wind.zonal, mean=east),
        meridional=replace(vehicle.wind.meridional, mean=still),
    )
    s = study(replace(vehicle, wind=wind)).with_parameters({"wind.azimuth": np.pi / 2})
    mean = s.with_means
    tables = table_values(mean.groups, 75.0)
    assert tables["pitch.mean.angle_of_attack"] > 0.005
    assert tables["yaw.mean.angle_of_attack"] == pytest.approx(0.0, abs=1e-12)


def test_start_covariance_holds_the_correlation_of_the_surface_winds(both):
    P = both.system.start_covariance["wind"]
    rows = both.system.block("wind")
    wind = np.asarray(P)[rows, rows]
    H = both.vehicle.wind.shaping_filter.at(float(both.start_altitude))[2]
    u, v = (np.where(np.arange(6) < 3, H, 0.0), np.where(np.arange(6) < 3, 0.0, H))
    r = u @ wind @ v / np.sqrt((u @ wind @ u) * (v @ wind @ v))
    assert r == pytest.approx(-0.216, abs=0.05)


def test_own_deviations_have_own_noises_of_the_same_source():
    s = study(in_both(EACH)).system
    assert [n.name for n in s.noises if n.source == "thrust"] == ["thrust_pitch", "thrust_yaw"]
    assert "thrust" in s.sources and s.parameter_names.count("thrust.sigma") == 1


def test_axial_force_belongs_to_no_plane(both):
    assert both.system.output_names.count("axial_force") == 1
    assert "pitch_axial_force" not in both.system.output_names


def test_one_plane_keeps_its_names():
    plane = flown_planes(in_one("yaw", "zonal"))
    assert [(p.name, p.prefix, p.scope) for p in plane] == [("yaw", "", "")]


BIASES = {"biases.thrust.standard_deviation": 0.01, "biases.center_of_pressure.standard_deviation": 0.03}


def test_a_bias_is_one_for_both_planes_or_one_each():
    """One each enters its plane alone, by the column that the common one has there; the sigma stays one parameter."""
    common = study(in_both(BIASES))
    each = study(in_both(BIASES | {"biases.center_of_pressure.planes": "each"}))
    names = [n.name for n in each.system.noises if n.source == "center_of_pressure_bias"]
    assert names == ["center_of_pressure_bias_pitch", "center_of_pressure_bias_yaw"]
    assert each.system.parameter_names.count("center_of_pressure_bias.standard_deviation") == 1
    assert [n.name for n in each.system.noises if n.source == "thrust_bias"] == ["thrust_bias"]
    one, two = all_matrices(common, 75.0)["A"], all_matrices(each, 75.0)["A"]
    column = one[:, common.system.state_names.index("deviation_center_of_pressure_bias")]
    for plane in ("pitch", "yaw"):
        own = two[:, each.system.state_names.index(f"deviation_center_of_pressure_bias_{plane}")]
        for i, name in enumerate(each.system.state_names):
            inside = name.startswith(f"{plane}_")
            assert own[i] == pytest.approx(column[common.system.state_names.index(name)] if inside else 0.0, rel=1e-12)
    start = np.asarray(each.system.start_covariance["center_of_pressure_bias"])
    assert np.trace(start) == 2 and np.count_nonzero(start) == 2


def test_a_rolled_vehicle_with_horizontal_wind_is_one_of_another_azimuth():
    """Closed form: pitch towards yaw by rho is azimuth + rho where the whole wind acts in both planes."""
    roll = 25.0
    rolled, plain = study(in_both(HORIZONTAL | {"roll_deg": roll})), study(in_both(HORIZONTAL))
    turned = plain.with_parameters({"wind.azimuth": plain.parameters["wind.azimuth"].value + np.radians(roll)})
    found, expected = all_matrices(rolled, 75.0), all_matrices(turned, 75.0)
    for name in ("A", "C", "E", "G"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-12 * np.abs(expected[name]).max())
    assert rolled.parameters["roll"].value == pytest.approx(np.radians(roll))


def test_roll_turns_what_pitch_and_yaw_of_the_flight_meet():
    """Wind across the path, the flight's own angle and the biased programme, all by one rotation."""
    options = {"options.trajectory_angle_of_attack": True, "options.wind_biased_programme": True}
    rolled, plain = study(in_both(options | {"roll_deg": 30.0})), study(in_both(options))
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    for time in TIMES:
        found, flat = all_matrices(rolled, time), all_matrices(plain, time)
        for matrix, which in (("G", "angle_of_attack"), ("E", "T1_1"), ("E", "T1_3")):
            names = plain.system.output_names if matrix == "G" else plain.system.state_names
            pitch, yaw = (names.index(f"{plane}_{which}") for plane in ("pitch", "yaw"))
            expected = c * flat[matrix][pitch] + s * flat[matrix][yaw], c * flat[matrix][yaw] - s * flat[matrix][pitch]
            for row, value in zip((pitch, yaw), expected, strict=True):
                np.testing.assert_allclose(found[matrix][row], value, rtol=1e-10, atol=1e-15)
