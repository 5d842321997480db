"""Ascent of a point mass over a rotating oblate Earth, symbolically.

Inertial frame of ``earth``: r' = v, v' = g(r) + [ (T - D) a - N w ] / m, amount' = -sum of the running groups'
count x flow x share, for liquid and grains; dropped masses stay until they are taken off.

- a: the vehicle's axis. By the pitch programme cos(chi) up + sin(chi) downrange in the plumbline frame that stops
  turning with the Earth at platform release, or along the velocity relative to the air (gravity turn).
- T = sum over running groups of count (vacuum thrust - exit area x ambient pressure), along a.
- D = q S C_D, axial. N w: q S C_N_alpha sin(alpha) across the axis, away from the lateral part w of the relative
  velocity; sin(alpha) in the place of alpha needs no angle at rest and differs by 1.5e-4 at 1.7 degrees.
- The air turns with the Earth; no wind.

Quantities over time (programme, thrust, flow) come in as polynomials of the present piece, so that the integrator,
which stops where pieces meet, sees smooth functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from . import earth
from .atmosphere import atmosphere
from .construction import Construction

OBSERVED = (
    "altitude",
    "relative_velocity",
    "mach",
    "dynamic_pressure",
    "pressure",
    "thrust",
    "control_thrust",
    "drag",
    "axial_acceleration",
    "mass",
    "flight_path_angle",
    "pitch",
    "angle_of_attack",
    "angle_of_attack_pitch",
    "angle_of_attack_yaw",
    "azimuth_change",
    "inertial_speed",
    "inertial_flight_path_angle",
    "surface_range",
    "dynamic_pressure_rate",
)
PITCH_COEFFICIENTS = 5


@dataclass(frozen=True, eq=False)
class AscentEquations:
    """Functions of (time, state, piece).

    The state is inertial position (m), inertial velocity (m/s) and the construction's stores (kg). The piece is five
    coefficients of chi (rad) by rising power of the time since the programme's time base, then for each engine group
    vacuum thrust (N) and mass flow (kg/s) of one engine as constant and slope over range time; zeros when not running;
    then for each jettison 1 before it and 0 after.

    Attributes
    ----------
    derivative : Function
        Of the state.
    observe : Function
        The values named in ``OBSERVED``, SI.
    state_size, piece_size : int
    """

    derivative: ca.Function
    observe: ca.Function
    state_size: int
    piece_size: int


def total_slope(construction: Construction) -> tuple[np.ndarray, np.ndarray]:
    """Return Mach numbers (n,) common to all normal-force components and the sum of their slopes there (1/rad)."""
    components = construction.normal_force
    low, high = max(c.mach[0] for c in components), min(c.mach[-1] for c in components)
    mach = np.unique(np.concatenate([c.mach for c in components]))
    mach = mach[(mach >= low) & (mach <= high)]
    return mach, np.sum([np.interp(mach, c.mach, c.slope) for c in components], axis=0)


def ascent_equations(construction: Construction, along_velocity: bool = False) -> AscentEquations:
    """Write down the equations of a construction.

    Parameters
    ----------
    construction : Construction
    along_velocity : bool
        The axis follows the relative velocity instead of the pitch programme.
    """
    site, stores = construction.site, construction.stores
    time, state = ca.MX.sym("time"), ca.MX.sym("state", 6 + len(stores))
    piece = ca.MX.sym("piece", PITCH_COEFFICIENTS + 4 * len(construction.engines) + len(construction.jettisons))
    position, velocity, amounts = state[:3], state[3:6], state[6:]
    mass = sum(m.mass for m in construction.masses if m.name not in stores) + ca.sum1(amounts)

    altitude, normal = earth.geodetic(position)
    air = atmosphere(altitude, construction.atmosphere)
    relative = velocity - ca.cross(ca.DM([0, 0, earth.ROTATION_RATE]), position)
    speed = ca.sqrt(ca.sumsqr(relative))
    mach = speed / air.speed_of_sound
    dynamic_pressure = 0.5 * air.density * ca.sumsqr(relative)

    up, downrange = (ca.DM(axis) for axis in earth.plumbline_axes(site.latitude, site.azimuth))
    chi = ca.polyval(piece[:PITCH_COEFFICIENTS][::-1], time - construction.pitch.time_base)
    axis = relative / speed if along_velocity else ca.cos(chi) * up + ca.sin(chi) * downrange

    thrust = control_thrust = ca.MX(0)
    flow = ca.MX.zeros(len(stores))
    for i, group in enumerate(construction.engines):
        first = PITCH_COEFFICIENTS + 4 * i
        vacuum, rate = (piece[first + k] + piece[first + k + 1] * time for k in (0, 2))
        running = ca.if_else(vacuum > 0, 1, 0)
        of_group = group.count * (vacuum - running * group.exit_area * air.pressure)
        of_group = ca.fmax(of_group, 0) if group.solid else of_group
        thrust += of_group
        control_thrust += of_group if group.gimballed else 0
        shares = ca.DM([group.draws.get(store, 0.0) for store in stores])
        flow += group.count * rate * shares

    area = construction.reference_area
    coefficient = _over_mach("drag", construction.drag.mach, construction.drag.coefficient, mach)
    slope = _over_mach("normal_force", *total_slope(construction), mach)
    on = ca.vertsplit(piece[PITCH_COEFFICIENTS + 4 * len(construction.engines) :])
    for jettison, still in zip(construction.jettisons, on, strict=True):
        if jettison.drag is not None:
            after = _over_mach("drag_after", jettison.drag.mach, jettison.drag.coefficient, mach)
            coefficient = still * coefficient + (1 - still) * after
        for part in construction.normal_force:
            if part.name in jettison.normal_force:
                slope -= (1 - still) * _over_mach("dropped", part.mach, part.slope, mach)
    drag = dynamic_pressure * area * coefficient
    lateral = relative - ca.dot(relative, axis) * axis
    normal_force = -0.5 * air.density * speed * area * slope * lateral
    acceleration = earth.gravity(position) + ((thrust - drag) * axis + normal_force) / mass
    derivative = ca.vertcat(velocity, acceleration, -flow)

    site_now = ca.mtimes(
        earth.rotation_about_pole(earth.ROTATION_RATE * (time - site.platform_release)),
        ca.DM(earth.site_position(site.latitude, 0.0)),
    )
    across = ca.norm_2(ca.cross(site_now, position))
    pitch, right = ca.atan2(ca.dot(axis, downrange), ca.dot(axis, up)), ca.cross(downrange, up)
    over = ca.cos(pitch) * downrange - ca.sin(pitch) * up
    along = ca.dot(relative, axis)
    observed = {
        "altitude": altitude,
        "relative_velocity": speed,
        "mach": mach,
        "dynamic_pressure": dynamic_pressure,
        "pressure": air.pressure,
        "thrust": thrust,
        "control_thrust": control_thrust,
        "drag": drag,
        "axial_acceleration": (thrust - drag) / mass,
        "mass": mass,
        "flight_path_angle": _elevation(relative, normal),
        "pitch": pitch,
        "angle_of_attack": ca.atan2(ca.norm_2(lateral), along),
        "angle_of_attack_pitch": -ca.atan2(ca.dot(lateral, over), along),
        "angle_of_attack_yaw": -ca.atan2(ca.dot(lateral, right), along),
        "azimuth_change": _turn(downrange, position, normal, site.azimuth),
        "inertial_speed": ca.norm_2(velocity),
        "inertial_flight_path_angle": _elevation(velocity, normal),
        "surface_range": ca.atan2(across, ca.dot(site_now, position)) * ca.norm_2(site_now),
        "dynamic_pressure_rate": ca.jtimes(dynamic_pressure, state, derivative),
    }
    inputs = [time, state, piece]
    return AscentEquations(
        derivative=ca.Function("ascent", inputs, [derivative]),
        observe=ca.Function("observe", inputs, [ca.vertcat(*(observed[name] for name in OBSERVED))]),
        state_size=state.numel(),
        piece_size=piece.numel(),
    )


def _turn(downrange: ca.DM, position: ca.MX, normal: ca.MX, azimuth: float) -> ca.MX:
    """Return how far a horizontal axis lies to the right of an azimuth from the north of where the vehicle is (rad)."""
    east = ca.cross(ca.DM([0, 0, 1]), position)
    east = east / ca.norm_2(east)
    east_part, north_part = ca.dot(downrange, east), ca.dot(downrange, ca.cross(normal, east))
    sin, cos = np.sin(azimuth), np.cos(azimuth)
    return ca.atan2(east_part * cos - north_part * sin, east_part * sin + north_part * cos)


def _elevation(vector: ca.MX, normal: ca.MX) -> ca.MX:
    """Return the angle of a vector above the local horizontal (rad)."""
    upward = ca.dot(vector, normal)
    return ca.atan2(upward, ca.norm_2(vector - upward * normal))


def _over_mach(name: str, mach: np.ndarray, values: np.ndarray, at: ca.MX) -> ca.MX:
    """Interpolate linearly over Mach number, held outside."""
    table = ca.interpolant(name, "linear", [mach.tolist()], values.tolist())
    return table(ca.fmin(ca.fmax(at, mach[0]), mach[-1]))
