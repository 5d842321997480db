"""Bending-moment coefficients at any stations: forces forward of a station less the inertia of what lies there.

With s the station, x metres forward of the gimbal plane and integrals over x > s, a lateral force of density f(x)
on the free vehicle makes the moment

    L[f] = int (x - s) f dx - S_1 F / m - S_2 M / I,    F = int_all f dx,  M = int_all (x - X_CG) f dx

    S_1 = int (x - s) mu dx,    S_2 = int (x - s)(x - X_CG) mu + r dx

because the vehicle answers with the accelerations F/m and M/I; mu is the mass per length with all liquid frozen, r the
rotary inertia per length. At either end L vanishes whatever f is. Coefficients of 4-13: M'_alpha = L[q A c'_N],
M'_beta = L of the control thrust at the gimbal plane, M'_eta = -int (x - s) mu Y + r Y' dx (modes are orthogonal to
rigid motion: nothing answers), M'_xi = -m_k (X_S - s) forward of s. The normal force moved forward as a whole by a
metre gives dM'_alpha/dX_CP = L[-q A dc'_N/dx] = N(s) - S_2 / I N, by parts, N(s) being what acts forward of s.

Forces along the axis load a station where masses or the axis lie beside it. A mass e beside the thrust axis pulls with
-A_X mu there: e A_X [int mu dx - S_2 m / I]. On an axis bent by Y the inertia -a mu and the thrust m a at the gimbal
(a = F_TX / m, drag spread as the mass) make a [int mu (Y - Y(s)) dx + S_2 m Y(0) / I], less m (Y(0) - Y(s)) aft of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataError
from .line_integrals import Line

LARGEST_IMBALANCE = 1e-6


@dataclass(frozen=True, eq=False)
class LoadedVehicle:
    """A vehicle at one time of its flight, as distributions along its axis.

    Attributes
    ----------
    line : Line
    mass, rotary_inertia : (points,) arrays
        Per length with all liquid frozen (kg/m); mass moment of inertia of the sections about their own lateral axis
        per length (kg m).
    normal_force : (points,) array
        q A c'_N (N/rad/m).
    control_thrust : float
        N, at the gimbal plane.
    relative_velocity : float
        m/s.
    displacement, rotation : (modes, points) arrays
        Of the modes (1; 1/m).
    slosh_mass, slosh_point : (tanks,) arrays
        kg; attach points in m forward of the gimbal plane.
    """

    line: Line
    mass: NDArray[np.float64]
    rotary_inertia: NDArray[np.float64]
    normal_force: NDArray[np.float64]
    control_thrust: float
    relative_velocity: float
    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]
    slosh_mass: NDArray[np.float64]
    slosh_point: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadCoefficients:
    """What makes the bending moment at stations; columns by the names of a load's table.

    Attributes
    ----------
    angle_of_attack, engine_angle : (s,) arrays
        N m/rad.
    center_of_pressure : (s,) array
        Change of ``angle_of_attack`` for each metre that the normal force moves forward as a whole, N/rad.
    bending, slosh : (modes, s) and (tanks, s) arrays
        N s2.
    center_of_gravity_offset : (s,) array
        Moment for each metre by which all masses lie beside the thrust axis and m/s2 along it (kg).
    p_delta : (modes, s) array
        Moment for each m of a mode and m/s2 of thrust over mass (kg).
    first_moment, second_moment : (s,) arrays
        S_1 (kg m) and S_2 (kg m2), by which the rigid body answers forces and couples.
    attitude_rate : (s,) array
        N m s/rad; this and the next two by the local angle of attack.
    bending_displacement, bending_rate : (modes, s) arrays
        N, N s.
    """

    angle_of_attack: NDArray[np.float64]
    engine_angle: NDArray[np.float64]
    center_of_pressure: NDArray[np.float64]
    bending: NDArray[np.float64]
    slosh: NDArray[np.float64]
    center_of_gravity_offset: NDArray[np.float64]
    p_delta: NDArray[np.float64]
    first_moment: NDArray[np.float64]
    second_moment: NDArray[np.float64]
    attitude_rate: NDArray[np.float64]
    bending_displacement: NDArray[np.float64]
    bending_rate: NDArray[np.float64]


def load_coefficients(vehicle: LoadedVehicle, stations: NDArray[np.float64]) -> LoadCoefficients:
    """Return the coefficients at stations (m forward of the gimbal plane, edges of the vehicle's line).

    Raises
    ------
    DataError
        If a mode is not orthogonal to the rigid motion of the masses: it belongs to another beam.
    """
    line, mu, r = vehicle.line, vehicle.mass, vehicle.rotary_inertia
    x = line.points
    mass = float(line.total(mu))
    center = float(line.total(x * mu)) / mass
    inertia = float(line.total((x - center) ** 2 * mu + r))

    def moment_about_station(force: NDArray, couple: NDArray | float = 0.0) -> NDArray:
        return line.forward(x * force + couple, stations) - stations * line.forward(force, stations)

    first = moment_about_station(mu)
    second = moment_about_station((x - center) * mu, r)

    def free(density: NDArray) -> NDArray:
        lateral, turning = line.total(density)[..., None], line.total((x - center) * density)[..., None]
        return moment_about_station(density) - first * lateral / mass - second * turning / inertia

    engine = vehicle.control_thrust * np.where(stations < 0, -stations, 0.0)
    engine += vehicle.control_thrust * (second * center / inertia - first / mass)
    _refuse_modes_of_other_masses(vehicle, mass, center, inertia)
    ahead = np.maximum(vehicle.slosh_point[:, None] - stations, 0.0)
    air = vehicle.normal_force
    turning = second * mass / inertia
    shape, at_gimbal = line.at(vehicle.displacement, stations), line.at(vehicle.displacement, np.zeros(1))
    bent = line.forward(mu * vehicle.displacement, stations) - shape * line.forward(mu, stations)
    return LoadCoefficients(
        angle_of_attack=free(air),
        engine_angle=engine,
        center_of_pressure=line.forward(air, stations) - second * line.total(air) / inertia,
        bending=-moment_about_station(mu * vehicle.displacement, r * vehicle.rotation),
        slosh=-vehicle.slosh_mass[:, None] * ahead,
        center_of_gravity_offset=line.forward(mu, stations) - turning,
        p_delta=bent + turning * at_gimbal - np.where(stations < 0, mass * (at_gimbal - shape), 0.0),
        first_moment=first,
        second_moment=second,
        attitude_rate=-free(air * (x - center)) / vehicle.relative_velocity,
        bending_displacement=free(air * vehicle.rotation),
        bending_rate=-free(air * vehicle.displacement) / vehicle.relative_velocity,
    )


def _refuse_modes_of_other_masses(vehicle: LoadedVehicle, mass: float, center: float, inertia: float) -> None:
    line, moving = vehicle.line, vehicle.mass * vehicle.displacement
    turning = line.total((line.points - center) * moving + vehicle.rotary_inertia * vehicle.rotation)
    size = np.sqrt(line.total(moving * vehicle.displacement))
    left = np.maximum(np.abs(line.total(moving)) / np.sqrt(mass), np.abs(turning) / np.sqrt(inertia)) / size
    if (left > LARGEST_IMBALANCE).any():
        mode = int(np.argmax(left))
        raise DataError(
            f"bending mode {mode + 1} moves the vehicle's centre of gravity or turns it ({left[mode]:.1e} of its own "
            "size); compute modes and loads from the same masses"
        )


def load_columns(coefficients: LoadCoefficients, tanks: Sequence[str]) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of a load's table by (name, unit), each (s,)."""
    c = coefficients
    return {
        ("angle_of_attack", "N m/rad"): c.angle_of_attack,
        ("engine_angle", "N m/rad"): c.engine_angle,
        **{(f"bending_{i}", "N s2"): row for i, row in enumerate(c.bending, start=1)},
        **{(f"slosh_{tank}", "N s2"): row for tank, row in zip(tanks, c.slosh, strict=True)},
        ("first_moment", "kg m"): c.first_moment,
        ("second_moment", "kg m2"): c.second_moment,
        ("center_of_pressure", "N/rad"): c.center_of_pressure,
        ("center_of_gravity_offset", "kg"): c.center_of_gravity_offset,
        **{(f"p_delta_{i}", "kg"): row for i, row in enumerate(c.p_delta, start=1)},
    }


def local_load_columns(coefficients: LoadCoefficients) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of what the local angle of attack adds to a load, by (name, unit), each (s,)."""
    c = coefficients
    return {
        ("attitude_rate", "N m s/rad"): c.attitude_rate,
        **{(f"bending_displacement_{i}", "N"): row for i, row in enumerate(c.bending_displacement, start=1)},
        **{(f"bending_rate_{i}", "N s"): row for i, row in enumerate(c.bending_rate, start=1)},
    }
