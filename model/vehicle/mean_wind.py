"""What the mean wind makes of the flight: the speed through the air with head- and tailwind, and the biased programme.

Both are of the mean wind and azimuth that a vehicle is loaded with, and stay when parameters turn or scale the wind:
they belong to the flight, not to the wind of the day.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from ..tables import Table
from .columns import AZIMUTH_CHANGE, OWN_ANGLE, ZERO_ANGLE
from .planes import flown_planes
from .vehicle import Vehicle

Array = NDArray[np.float64]
GROUND_VELOCITY = "ground_velocity"  # m/s, relative to the turning Earth: the speed without wind
PROGRAMME = "biased_programme"  # rad, added to the attitude that the control law follows in pitch
BIASED_OVER = 30.0  # s, from the start on, in which the programme goes over to the biased one
SIDE = 1e-9  # s, beside a jump
MOST_TILT = math.pi / 4
_TOLERANCE = 1e-9
# powers of the speed in the columns of a load, by the beginning of their names
_AIR = {"angle_of_attack": 2, "center_of_pressure": 2, "bending_displacement": 2, "attitude_rate": 1, "bending_rate": 1}


def mean_wind(vehicle: Vehicle, time: ArrayLike) -> tuple[Array, Array]:
    """Return the mean wind along the heading and across it (m/s, a tail wind and to the right positive) over time (s).

    One wind of a vehicle that flies in pitch alone is along the heading.
    """
    altitude = vehicle.tables["altitude"].polynomial(time)
    winds = [mean.polynomial(np.clip(altitude, *mean.argument[[0, -1]])) for mean in vehicle.wind.means]
    if len(winds) == 1:
        return winds[0], np.zeros_like(winds[0])
    assert vehicle.file.wind.azimuth_deg is not None  # checked by load_vehicle
    azimuth = math.radians(vehicle.file.wind.azimuth_deg)
    if AZIMUTH_CHANGE.name in vehicle.tables:
        azimuth = azimuth + vehicle.tables[AZIMUTH_CHANGE.name].polynomial(time)
    (east, north), sin, cos = winds, np.sin(azimuth), np.cos(azimuth)
    return east * sin + north * cos, east * cos - north * sin


def speed_without_wind(vehicle: Vehicle) -> Table:
    """Return the speed of the flight relative to air that turns with the Earth, m/s."""
    return vehicle.tables.get(GROUND_VELOCITY, vehicle.tables["relative_velocity"])


def air_speed(vehicle: Vehicle, time: ArrayLike) -> Array:
    """Return the speed through the mean wind (m/s) over time (s), root of V^2 - 2 V W_p cos(gamma) + W_p^2 + W_c^2."""
    along, across = mean_wind(vehicle, time)
    speed, climb = speed_without_wind(vehicle).polynomial(time), _climb(vehicle, time)
    level = np.sqrt(np.maximum(speed**2 - climb**2, 0.0))
    return np.sqrt((level - along) ** 2 + climb**2 + across**2)


def through_mean_wind(vehicle: Vehicle) -> Vehicle:
    """Return a vehicle whose speed, dynamic pressure and drag are those through the mean wind along the same path.

    Coefficients stay those of the Mach number without wind.
    """
    tables = vehicle.tables
    trajectory, rows = tables["relative_velocity"], tables["relative_velocity"].argument
    ratio = air_speed(vehicle, rows) / trajectory.values
    changed = {
        "relative_velocity": ratio * trajectory.values,
        "dynamic_pressure": ratio**2 * tables["dynamic_pressure"].values,
        "axial_drag": ratio**2 * tables["axial_drag"].values,
    }
    less = tables["axial_drag"].values - changed["axial_drag"]
    mass = tables["mass"].polynomial(np.clip(rows, *tables["mass"].argument[[0, -1]]))
    changed["axial_acceleration"] = tables["axial_acceleration"].values + less / mass
    new = {name: replace(tables[name], values=values) for name, values in changed.items()}
    found = replace(vehicle, tables=tables | new | {GROUND_VELOCITY: replace(trajectory, name=GROUND_VELOCITY)})
    loads = {n: in_air(found, t, n) for n, t in tables.items() if "loads" in n.split(".")}
    return replace(found, tables=found.tables | loads)


def in_air(vehicle: Vehicle, table: Table, name: str) -> Table:
    """Return a table of a load's coefficients in the air that a vehicle flies through.

    Forces of the air go with the dynamic pressure, and with the speed where a motion makes their angle; the column's
    name tells which. All others stay.
    """
    power = next((p for start, p in _AIR.items() if name.split(".")[-1].startswith(start)), 0)
    if GROUND_VELOCITY not in vehicle.tables or not power:
        return table
    through, over = (
        vehicle.tables[n].polynomial(np.clip(table.argument, *vehicle.tables[n].argument[[0, -1]]))
        for n in ("relative_velocity", GROUND_VELOCITY)
    )
    return replace(table, values=(through / over) ** power * table.values)


def with_biased_programme(vehicle: Vehicle) -> Vehicle:
    """Return a vehicle whose tilt programme flies the mean wind at zero angle of attack in pitch.

    The attitude phi that the programme adds to that of the flight is, of a rigid body that turns as it is told, where
    alpha = 0 (W the mean wind across the path, alpha_0 the angle of attack of the flight without wind where the
    equations take it in):

        phi = (Y' - W) / V - alpha_0,    m Y'' = (F_TX - F_AX) phi + q A (C_N0 - C'_N alpha_0)

    Forward in time that is a gravity turn, which falls away from the flight. Of its solutions the programme takes the
    one that stands upright at the end, phi = 0, and goes over to it from the start in 30 s: there Y' is that of the
    solution times a step that is smooth up to its second derivative, and phi what m Y'' then asks for, by

        m Y'' = q A [C'_N (phi + (W - Y') / V) + C_N0] + (F_TX - F_AX) phi.

    Raises
    ------
    DataError
        The programme tilts by more than half a right angle.
    """
    (view,) = (plane.vehicle for plane in flown_planes(vehicle) if plane.name == "pitch")
    tables, area = view.tables, vehicle.file.reference_area_m2
    given = {name: table for name, table in tables.items() if name in _NEEDED}
    start, end = vehicle.start, vehicle.end
    full = start + BIASED_OVER

    def held(time: ArrayLike) -> dict[str, Array]:
        at = {name: table.polynomial(time) for name, table in given.items()}
        force = at["dynamic_pressure"] * area
        own, zero = (at.get(column.name, np.zeros_like(force)) for column in (OWN_ANGLE["pitch"], ZERO_ANGLE))
        return {
            "wind": _across(vehicle, time), "speed": at["relative_velocity"], "mass": at["mass"], "own": own,
            "slope": force * at["normal_force_slope"], "zero": force * zero, "push": at["thrust"] - at["axial_drag"],
        }  # fmt: skip

    def upright(time: ArrayLike, drift: Array) -> Array:
        """Return Y'' at zero angle of attack."""
        at = held(time)
        phi = (drift - at["wind"]) / at["speed"] - at["own"]
        return (at["push"] * phi + at["zero"] - at["slope"] * at["own"]) / at["mass"]

    rows = tables["relative_velocity"].argument
    edges = np.unique([start, *vehicle.discontinuities, end])
    rows = np.unique([*rows[(rows > start) & (rows < end)], *edges])
    last = held(end)
    drift = np.full_like(rows, float(last["wind"] + last["speed"] * last["own"]))
    for low, high in reversed(list(pairwise(edges))):
        inside = (rows >= low) & (rows <= high)
        times = np.clip(rows[inside], low + SIDE, high - SIDE)  # a table that jumps at an edge is on this side of it
        before = float(drift[np.flatnonzero(inside)[-1]])
        found = scipy.integrate.solve_ivp(
            upright, (high - SIDE, low + SIDE), [before], t_eval=times[::-1], rtol=_TOLERANCE, atol=_TOLERANCE,
            max_step=1.0,
        )  # fmt: skip
        drift[inside] = found.y[0, ::-1]
    times = np.where(rows == end, end - SIDE, rows)
    at, rate = held(times), upright(times, drift)
    s = np.clip((rows - start) / BIASED_OVER, 0.0, 1.0)
    step, its_rate = s**3 * (10 - 15 * s + 6 * s**2), 30 * (s * (1 - s)) ** 2 / BIASED_OVER
    rate, drift = step * rate + its_rate * drift, step * drift
    met = (at["wind"] - drift) / at["speed"]
    attitude = (at["mass"] * rate - at["slope"] * met - at["zero"]) / (at["slope"] + at["push"])
    attitude = np.where(rows < full, attitude, -met - at["own"])
    worst = int(np.argmax(np.abs(attitude)))
    if not abs(attitude[worst]) < MOST_TILT:
        raise DataError(
            f"tilts the vehicle by {math.degrees(attitude[worst]):.0f} degrees to fly the mean wind at zero angle of "
            "attack; look at the wind's mean, or begin the flight later",
            file=vehicle.folder / "vehicle.toml",
            column="options.wind_biased_programme",
            time=float(rows[worst]),
        )
    table = Table(PROGRAMME, "rad", rows, attitude, "cubic", vehicle.discontinuities)
    return replace(vehicle, tables=vehicle.tables | {PROGRAMME: table})


_NEEDED = frozenset(
    (
        "relative_velocity", "dynamic_pressure", "normal_force_slope", "thrust", "axial_drag", "mass",
        OWN_ANGLE["pitch"].name, ZERO_ANGLE.name,
    )
)  # fmt: skip


def _across(vehicle: Vehicle, time: ArrayLike) -> Array:
    """Return the mean wind across the path in pitch, m/s, as the equations have it."""
    along, _ = mean_wind(vehicle, time)
    if vehicle.file.wind.pitch_wind == "horizontal":
        return along
    return along * _climb(vehicle, time) / speed_without_wind(vehicle).polynomial(time)


def _climb(vehicle: Vehicle, time: ArrayLike) -> Array:
    return vehicle.tables["altitude"].polynomial.derivative()(time)
