"""The mean flight against an integration of its own in the turning frame, closed forms, AS-506, and bad input."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import ambiance
import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ascentwind.model.construction import Construction, earth
from ascentwind.model.construction.atmosphere import atmosphere
from ascentwind.model.construction.construction_file import load_construction
from ascentwind.model.construction.flight import AtmosphereFactors, Drag, EngineGroup, PitchProgramme
from ascentwind.model.errors import DataError
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.runners.construct.ascent.integration import Ascent
from ascentwind.runners.construct.ascent.mean_flight import EVENT_MARGIN, MeanFlight, _edges, _leg_of, _legs, fly
from ascentwind.runners.reproduction.as506.flight import trajectory_checks


@pytest.fixture(scope="module")
def construction() -> Construction:
    return load_construction(built_in_vehicles()["as504"])


@pytest.fixture(scope="module")
def flight(construction) -> MeanFlight:
    return fly(construction)


def engines(construction: Construction, **changes) -> Construction:
    """The outboard engines alone, with constant thrust and flow."""
    group = EngineGroup(
        name="outboard",
        count=5,
        gimballed=True,
        exit_area=10.0,
        time=np.array([0.0, 200.0]),
        vacuum_thrust=np.full(2, 7.9e6),
        mass_flow=np.full(2, 2650.0),
        draws={"sic_lox": 0.7, "sic_rp1": 0.3},
        cutoff=None,
        cutoff_event="cutoff",
        residual={},
    )
    return replace(construction, engines=(replace(group, **changes),))


def table_programme(time, angle_deg, kind: Literal["table", "gravity_turn"] = "table", arrest=1e3) -> PitchProgramme:
    return PitchProgramme(kind, 0.0, 0.0, arrest, np.zeros((0, 7)), np.array(time), np.deg2rad(angle_deg))


def test_gravity_and_centrifugal_force_make_the_normal_gravity_of_wgs84():
    """Somigliana's closed form, NIMA TR8350.2 equation 4-1; J2 alone leaves out 1.2e-5 at the pole (5 J4)."""
    for latitude in np.deg2rad([0.0, 28.6, 45.0, 90.0]):
        position = earth.site_position(latitude, 0.0)
        up, _ = earth.plumbline_axes(latitude, 0.0)
        felt = ca.evalf(earth.gravity(ca.MX(ca.DM(position)))).full().ravel() + earth.ROTATION_RATE**2 * position * [
            1,
            1,
            0,
        ]
        s2 = np.sin(latitude) ** 2
        normal = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - 0.00669437999014 * s2)
        assert -felt @ up == pytest.approx(normal, rel=1.5e-5)
        assert np.linalg.norm(np.cross(felt, up)) < 1e-5 * normal


def test_ellipsoid_has_the_published_radii():
    """WGS 84: semi-minor axis 6 356 752.3142 m (NIMA TR8350.2, table 3.3)."""
    assert earth.site_position(np.pi / 2, 0.0)[2] == pytest.approx(6356752.3142, abs=1e-4)
    assert earth.site_position(0.0, 0.0)[0] == 6378137.0


@pytest.mark.parametrize("altitude", [0.0, 5e3, 8e4])
@pytest.mark.parametrize("latitude", [0.0, 0.5, 1.2])
def test_geodetic_is_the_inverse_of_the_site(latitude, altitude):
    position = ca.DM(earth.site_position(latitude, altitude))
    found, normal = (ca.evalf(e).full().ravel() for e in earth.geodetic(ca.MX(position)))
    assert found[0] == pytest.approx(altitude, abs=1e-6)
    np.testing.assert_allclose(normal, earth.plumbline_axes(latitude, 0.0)[0], atol=1e-12)


def test_atmosphere_is_the_standard_times_its_factors():
    h = ca.MX.sym("h")
    factors = AtmosphereFactors(np.array([0.0, 1e4, 2e4]), np.array([0.9, 1.1, 1.0]), np.array([1.1, 1.0, 0.9]))
    air, plain = atmosphere(h, factors), atmosphere(h, None)
    values = ca.Function("air", [h], [air.density, air.pressure, air.speed_of_sound, plain.density, plain.pressure])
    for altitude in (0.0, 5.0e3, 10.98e3, 31.7e3, 80.9e3):
        standard = ambiance.Atmosphere(altitude)
        density = np.interp(altitude, factors.altitude, factors.density)
        temperature = np.interp(altitude, factors.altitude, factors.temperature)
        expected = [
            density * standard.density[0],
            density * temperature * standard.pressure[0],
            np.sqrt(temperature) * standard.speed_of_sound[0],
            standard.density[0],
            standard.pressure[0],
        ]
        np.testing.assert_allclose([float(v) for v in values(altitude)], expected, rtol=2e-5)


def test_angles_of_attack_by_plane_and_turn_of_the_pitch_plane(construction, flight):
    """By vectors of the state: in and across the plane of the programme, and that plane by the north below."""
    ascent = Ascent(construction)
    legs, _ = _legs(ascent, _edges(construction, flight.time))
    up, downrange = earth.plumbline_axes(construction.site.latitude, construction.site.azimuth)
    for time in (10.0, 40.0, 70.0, 120.0):
        state, row = ascent.state(_leg_of(legs, time), time), int(np.argmin(np.abs(flight.time - time)))
        relative = state[3:6] - np.cross([0.0, 0.0, earth.ROTATION_RATE], state[:3])
        pitch = flight.pitch[row]
        body = np.array(
            [
                np.cos(pitch) * up + np.sin(pitch) * downrange,
                np.cos(pitch) * downrange - np.sin(pitch) * up,
                np.cross(downrange, up),
            ]
        )
        forward, over, right = body @ relative
        assert np.tan(flight.angle_of_attack_pitch[row]) == pytest.approx(-over / forward, rel=1e-8)
        assert np.tan(flight.angle_of_attack_yaw[row]) == pytest.approx(-right / forward, rel=1e-8)
        total = np.hypot(over, right) / forward
        assert np.tan(flight.angle_of_attack[row]) == pytest.approx(total, rel=1e-8)
        normal = ca.evalf(earth.geodetic(ca.MX(ca.DM(state[:3])))[1]).full().ravel()
        east = np.cross([0.0, 0.0, 1.0], normal)
        heading = np.arctan2(downrange @ east, downrange @ np.cross(normal, east))
        assert flight.azimuth_change[row] == pytest.approx(heading - construction.site.azimuth, abs=1e-9)


@pytest.mark.slow
def test_flight_equals_an_integration_in_the_turning_frame(construction, flight):
    """Same physics by another road: Earth-fixed axes with Coriolis and centrifugal force, alpha as an angle, DOP853."""
    c, site = construction, construction.site
    tanks = [t.name for t in c.tanks]
    liquid0 = np.array([t.liquid for t in c.tanks])
    dry = sum(m.mass for m in c.masses)
    spin = np.array([0.0, 0.0, earth.ROTATION_RATE])
    up, downrange = earth.plumbline_axes(site.latitude, site.azimuth)

    def rate(t, y):
        r, v, liquid = y[:3], y[3:6], y[6:]
        # geodetic altitude by Newton's method on the ellipsoid's normal
        p, lat = np.hypot(r[0], r[1]), np.arctan2(r[2], np.hypot(r[0], r[1]) * (1 - 0.00669437999014))
        h = 0.0
        for _ in range(4):
            n = 6378137 / np.sqrt(1 - 0.00669437999014 * np.sin(lat) ** 2)
            h = p * np.cos(lat) + r[2] * np.sin(lat) - n * (1 - 0.00669437999014 * np.sin(lat) ** 2)
            lat = np.arctan2(r[2], p * (1 - 0.00669437999014 * n / (n + h)))
        standard = ambiance.Atmosphere(h)
        factors = c.atmosphere
        density = standard.density[0] * np.interp(h, factors.altitude, factors.density)
        temperature = standard.temperature[0] * np.interp(h, factors.altitude, factors.temperature)
        pressure = density * 287.05287 * temperature
        speed = np.linalg.norm(v)
        mach = speed / np.sqrt(1.4 * 287.05287 * temperature)
        tau = min(t - c.pitch.time_base, c.pitch.arrest)
        segment = next(s for s in c.pitch.segments if tau <= s[1])
        chi = 0.0 if tau < c.pitch.begin else np.polynomial.polynomial.polyval(tau, segment[2:])
        axis = np.cos(chi) * up + np.sin(chi) * downrange
        angle = earth.ROTATION_RATE * (t - site.platform_release)
        cos, sin = np.cos(angle), np.sin(angle)
        axis = np.array([cos * axis[0] + sin * axis[1], -sin * axis[0] + cos * axis[1], axis[2]])
        thrust, flow = 0.0, np.zeros(len(tanks))
        for g in c.engines:
            if g.cutoff is None or t <= g.cutoff:
                thrust += g.count * (np.interp(t, g.time, g.vacuum_thrust) - g.exit_area * pressure)
                share = np.array([g.draws.get(tank, 0.0) for tank in tanks])
                flow += g.count * np.interp(t, g.time, g.mass_flow) * share
        q = 0.5 * density * speed**2
        slope = sum(np.interp(mach, n.mach, n.slope) for n in c.normal_force)
        lateral = v - (v @ axis) * axis
        across = np.linalg.norm(lateral)
        normal = np.zeros(3)
        if across > 0:
            normal = -q * c.reference_area * slope * np.arctan2(across, v @ axis) * lateral / across
        drag = q * c.reference_area * np.interp(mach, c.drag.mach, c.drag.coefficient)
        distance = np.linalg.norm(r)
        unit = r / distance
        j2 = 1.5 * earth.J2 * (6378137 / distance) ** 2
        z = unit[2]
        gravity = (
            -earth.GRAVITATIONAL_PARAMETER
            / distance**2
            * ((1 + j2 * (1 - 5 * z**2)) * unit + 2 * j2 * z * np.array([0.0, 0.0, 1.0]))
        )
        force = (thrust - drag) * axis + normal
        turning = -2 * np.cross(spin, v) - np.cross(spin, np.cross(spin, r))
        return np.concatenate([v, gravity + turning + force / (dry + liquid.sum()), -flow])

    y = np.concatenate([earth.site_position(site.latitude, site.altitude), np.zeros(3), liquid0])
    t, end = site.release, 100.0
    for stop in (0.6 + 13.0, 0.6 + 33.6, 0.6 + 68.6, 0.6 + 95.6, end):
        y = solve_ivp(rate, (t, stop), y, method="DOP853", rtol=1e-8, atol=1e-6, max_step=2.0).y[:, -1]
        t = stop
    row = int(np.searchsorted(flight.time, end))
    assert flight.time[row] == end
    assert flight.relative_velocity[row] == pytest.approx(np.linalg.norm(y[3:6]), rel=2e-6)
    assert flight.mass[row] == pytest.approx(dry + y[6:].sum(), rel=1e-7)
    fixed = earth.geodetic(ca.MX(ca.DM(y[:3])))[0]
    assert flight.altitude[row] == pytest.approx(float(ca.evalf(fixed)), rel=2e-6)


def test_as506_meets_its_flight(construction):
    checks = trajectory_checks(construction)
    limited = [check for check in checks if check.limit is not None]
    assert len(limited) == 4
    assert all(check.holds for check in limited), checks


def test_rows_stand_on_both_sides_of_a_cutoff_and_do_not_depend_on_the_spacing(construction, flight):
    cutoff = flight.events["center_engine_cutoff"]
    before, after = np.searchsorted(flight.time, [cutoff - 0.5 * EVENT_MARGIN, cutoff + 0.5 * EVENT_MARGIN]) - [1, 0]
    assert flight.time[[before, after]] == pytest.approx([cutoff - EVENT_MARGIN, cutoff + EVENT_MARGIN], abs=1e-9)
    assert flight.thrust[after] == pytest.approx(0.8 * flight.thrust[before], rel=2e-3)
    assert flight.control_thrust[after] == flight.thrust[after]
    coarse = fly(construction, spacing=5.0)
    for name in ("altitude", "relative_velocity", "dynamic_pressure", "thrust", "mass"):
        fine = np.interp(coarse.time, flight.time, getattr(flight, name))
        np.testing.assert_allclose(getattr(coarse, name), fine, rtol=1e-9, err_msg=name)


def test_mass_flow_is_integrated_exactly(construction, flight):
    """Straight lines between rows: the trapezoidal rule over the rows is exact."""
    end, release = 100.0, construction.site.release
    used = 0.0
    for g in construction.engines:
        knots = np.unique(np.concatenate([[release, end], g.time[(g.time > release) & (g.time < end)]]))
        used += g.count * np.trapezoid(np.interp(knots, g.time, g.mass_flow), knots)
    m0 = sum(m.mass for m in construction.masses) + sum(t.liquid for t in construction.tanks)
    assert flight.mass[flight.time == end] == pytest.approx(m0 - used, rel=1e-10)


def test_events_are_where_their_quantities_say(construction, flight):
    assert np.interp(flight.events["mach_one"], flight.time, flight.mach) == pytest.approx(1.0, abs=1e-4)
    peak = flight.events["max_dynamic_pressure"]
    before, at, after = (
        fly(replace(construction, end_time=t), spacing=5.0).dynamic_pressure[-1] for t in (peak - 0.1, peak, peak + 0.1)
    )
    assert before < at > after
    assert at >= flight.dynamic_pressure.max()


def test_what_holds_at_events_lies_between_the_rows_around_them(flight):
    assert flight.at_events.keys() == flight.events.keys()
    assert flight.at_events["mach_one"]["mach"] == pytest.approx(1, abs=1e-9)
    assert flight.at_events["max_dynamic_pressure"]["dynamic_pressure"] >= flight.dynamic_pressure.max()
    for event, time in flight.events.items():
        k = int(np.searchsorted(flight.time, time))
        if not 0 < k < flight.time.size:
            continue
        for name in ("altitude", "mass", "relative_velocity"):
            low, high = sorted(getattr(flight, name)[k - 1 : k + 1])
            assert low <= flight.at_events[event][name] <= high, (event, name)
    release = flight.at_events["release"]
    assert release["mach"] == 0 and release["mass"] > flight.mass[0]


def test_depletion_is_located(construction):
    """Constant flow: the tank is at its residual after (liquid - residual) / (count x flow x share)."""
    lox = next(t.liquid for t in construction.tanks if t.name == "sic_lox")
    changed = engines(construction, residual={"sic_lox": 0.3 * lox})
    found = fly(replace(changed, end_time=140.0), spacing=2.0)
    expected = construction.site.release + 0.7 * lox / (5 * 2650.0 * 0.7)
    assert expected < 140
    assert found.events["cutoff"] == pytest.approx(expected, abs=1e-6)
    assert found.time[-1] == pytest.approx(expected - EVENT_MARGIN, abs=1e-6)
    assert found.liquid["sic_lox"][-1] == pytest.approx(0.3 * lox, rel=1e-5)


def test_vertical_flight_without_air_is_the_rocket_equation(construction):
    """Speed = c ln(m0 / m) - g t, with the small change of gravity over altitude by quadrature of the flight itself."""
    vacuum = replace(
        engines(construction, exit_area=0.0),
        pitch=table_programme([0.0, 1.0], [0.0, 0.0]),
        drag=Drag(np.array([0.0, 20.0]), np.zeros(2)),
        normal_force=tuple(replace(n, slope=0 * n.slope) for n in construction.normal_force),
        end_time=40.0,
    )
    found = fly(vacuum)
    m0, release = sum(m.mass for m in vacuum.masses) + sum(t.liquid for t in vacuum.tanks), vacuum.site.release
    duration = found.time - release
    latitude = vacuum.site.latitude
    s2 = np.sin(latitude) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - 0.00669437999014 * s2)
    lost = np.interp(duration, *_integral(duration, surface * (1 - 2 * found.altitude / 6.371e6)))
    ideal = 7.9e6 / 2650.0 * np.log(m0 / (m0 - 5 * 2650.0 * duration)) - lost
    np.testing.assert_allclose(found.relative_velocity[5:], ideal[5:], rtol=5e-4)


def _integral(x, y):
    return x, y[0] * x[0] + np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])


def test_gravity_turn_flies_without_angle_of_attack(construction):
    turn = replace(
        construction, pitch=table_programme([13.0, 20.0, 30.0], [0.0, 2.0, 4.0], "gravity_turn"), end_time=80.0
    )
    found = fly(turn, spacing=2.0)
    after = found.time > 30.5
    assert np.abs(found.angle_of_attack[after]).max() < 1e-7
    assert found.angle_of_attack[~after].max() > 1e-3
    assert (np.diff(found.flight_path_angle[after]) < 0).all()
    assert found.events["gravity_turn"] == 30.0


@pytest.mark.parametrize(
    ("change", "words", "time"),
    [
        (
            lambda c: replace(c, pitch=table_programme([20.0, 30.0], [0.0, 130.0])),
            ("comes back to the ground", "pitch programme"),
            (30.0, 60.0),
        ),
        (
            lambda c: replace(c, drag=Drag(np.array([0.0, 2.0]), np.array([0.3, 0.4]))),
            ("Mach 2", "drag", "extend"),
            (80.0, 95.0),
        ),
        (
            lambda c: replace(
                c,
                normal_force=(
                    replace(c.normal_force[0], mach=np.array([0.0, 1.5]), slope=np.ones(2)),
                    *c.normal_force[1:],
                ),
            ),
            ("Mach 1.5", "escape_tower", "extend"),
            (70.0, 85.0),
        ),
        (
            lambda c: engines(c, cutoff=149.0, draws={"sic_rp1": 0.5}),
            ("'sic_rp1' is drained", "149 s", "residual"),
            (90.0, 100.0),
        ),
        (lambda c: engines(c, vacuum_thrust=np.full(2, 6e6)), ("does not lift",), (0.3, 0.3)),
        (
            lambda c: replace(engines(c), pitch=table_programme([0.0, 1.0], [0.0, 0.0]), end_time=190.0),
            ("passes 81000 m",),
            (110.0, 160.0),
        ),
    ],
    ids=["ground", "drag", "normal force", "drained", "too heavy", "atmosphere"],
)
def test_flights_that_cannot_be_flown(construction, change, words, time):
    with pytest.raises(DataError) as caught:
        fly(change(construction))
    assert all(word in str(caught.value) for word in words), caught.value
    assert caught.value.time is not None
    assert time[0] <= caught.value.time <= time[1], caught.value
