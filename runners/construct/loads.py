"""Load coefficients at any stations: forces forward of a station less the inertia of what lies there.

With s the station, x metres forward of the gimbal plane and integrals over x > s, a lateral force of density f(x)
on the free vehicle makes the bending moment

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

The shear force is the same functional with 1 in the place of the lever arm x - s, and no couples: V = -dM/ds but for
the rotary inertia, which loads a station by couples. Its S_1 is the mass forward of s, and dV'_alpha/dX_CP =
q A c'_N(s) - S_2 / I N. The axial force, compression positive, is what pushes the part forward of s along the axis:
its inertia, mass forward times A_X, and its drag, less the thrust that acts forward of s (that is: aft of the gimbal
plane).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataError
from ...model.vehicle.columns import AXIAL, REACTION, Column, by_need_columns, whole_shear_columns
from ...model.vehicle.columns import load_columns as moment_columns
from ...model.vehicle.columns import local_load_columns as local_moment_columns
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
    normal_force_at_stations : (s,) array
        The same at the stations of the loads, or just forward of them where it jumps.
    control_thrust : float
        N, at the gimbal plane.
    relative_velocity : float
        m/s.
    displacement, rotation, slope : (modes, points) arrays
        Of the modes (1; 1/m; 1/m): where the axis lies, how sections turn, and dY/dx of the axis, shear strain too.
    slosh_mass, slosh_point : (tanks,) arrays
        kg; attach points in m forward of the gimbal plane.
    """

    line: Line
    mass: NDArray[np.float64]
    rotary_inertia: NDArray[np.float64]
    normal_force: NDArray[np.float64]
    normal_force_at_stations: NDArray[np.float64]
    control_thrust: float
    relative_velocity: float
    displacement: NDArray[np.float64]
    rotation: NDArray[np.float64]
    slope: NDArray[np.float64]
    slosh_mass: NDArray[np.float64]
    slosh_point: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadCoefficients:
    """What makes the bending moment or shear force at stations; columns by the names of a load's table.

    Units are those of the moment; of the shear force each is divided by m.

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
    inertia : float
        Of the whole vehicle about its centre of gravity, kg m2, with which S_2 goes.
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
    inertia: float

    def with_inertia(self, inertia: float) -> LoadCoefficients:
        """Return the coefficients with S_2 in proportion to the vehicle's own moment of inertia, kg m2.

        The line's masses are uniform in each element, and its moment of inertia some 1e-4 another one; in the equations
        S_2 stands over the vehicle's, and together they close at both ends.
        """
        return replace(self, second_moment=self.second_moment * inertia / self.inertia, inertia=inertia)


def load_coefficients(vehicle: LoadedVehicle, stations: NDArray[np.float64]) -> LoadCoefficients:
    """Return the bending moment's coefficients at stations (m forward of the gimbal plane, edges of the line).

    Raises
    ------
    DataError
        If a mode is not orthogonal to the rigid motion of the masses: it belongs to another beam.
    """
    line, mu, Y = vehicle.line, vehicle.mass, vehicle.displacement

    def moment_about_station(force: NDArray, couple: NDArray | float = 0.0) -> NDArray:
        return line.forward(line.points * force + couple, stations) - stations * line.forward(force, stations)

    forward, shape, at_gimbal = line.forward(mu, stations), line.at(Y, stations), line.at(Y, np.zeros(1))
    thrust = np.where(stations < 0, line.total(mu) * (at_gimbal - shape), 0.0)
    return _lateral(
        vehicle,
        moment_about_station,
        moved_air=line.forward(vehicle.normal_force, stations),
        engine=np.maximum(-stations, 0.0),
        ahead=np.maximum(vehicle.slosh_point[:, None] - stations, 0.0),
        pulled=forward,
        bent=line.forward(mu * Y, stations) - shape * forward - thrust,
    )


def shear_coefficients(vehicle: LoadedVehicle, stations: NDArray[np.float64]) -> LoadCoefficients:
    """Return the shear force's coefficients at stations; as :func:`load_coefficients`, positive towards +Y.

    At a station that lies where a force acts, the gimbal plane or a slosh mass, those just forward of it.

    Raises
    ------
    DataError
    """
    return _lateral(
        vehicle,
        lambda force, couple=0.0: vehicle.line.forward(force, stations),
        moved_air=vehicle.normal_force_at_stations,
        engine=np.where(stations < 0, 1.0, 0.0),
        ahead=np.where(vehicle.slosh_point[:, None] > stations, 1.0, 0.0),
    )


class _Forward(Protocol):
    """Sums a force and a couple, both per length (..., points), over the part forward of each station: (..., s)."""

    def __call__(self, force: NDArray, couple: NDArray | float = 0.0) -> NDArray: ...


def _lateral(
    vehicle: LoadedVehicle,
    forward: _Forward,
    moved_air: NDArray,
    engine: NDArray,
    ahead: NDArray,
    pulled: NDArray | float = 0.0,
    bent: NDArray | float = 0.0,
) -> LoadCoefficients:
    """Return the coefficients of a load by how it sums what lies forward of a station.

    Parameters
    ----------
    forward : callable
    moved_air : (s,) array
        What the normal force forward of the station gains for each metre that it moves, the vehicle held.
    engine, ahead : (s,) and (tanks, s) arrays
        What a unit force at the gimbal plane and at each slosh mass gives, the vehicle held.
    pulled, bent : (s,) and (modes, s) arrays
        What forces along the axis give by couples, the vehicle held: for each metre by which all masses lie beside the
        thrust, and each m of a mode, per m/s2. Across the axis they give nothing.
    """
    line, mu, r = vehicle.line, vehicle.mass, vehicle.rotary_inertia
    mass = float(line.total(mu))
    center = float(line.total(line.points * mu)) / mass
    arm = line.points - center
    inertia = float(line.total(arm**2 * mu + r))
    _refuse_modes_of_other_masses(vehicle, mass, center, inertia)
    first, second, air = forward(mu), forward(arm * mu, r), vehicle.normal_force
    turning = second * mass / inertia  # the answer to the couple of the vehicle's mass at a metre

    def free(density: NDArray) -> NDArray:
        lateral, turning = line.total(density)[..., None], line.total(arm * density)[..., None]
        return forward(density) - first * lateral / mass - second * turning / inertia

    return LoadCoefficients(
        angle_of_attack=free(air),
        engine_angle=vehicle.control_thrust * (engine + second * center / inertia - first / mass),
        center_of_pressure=moved_air - second * line.total(air) / inertia,
        bending=-forward(mu * vehicle.displacement, r * vehicle.rotation),
        slosh=-vehicle.slosh_mass[:, None] * ahead,
        center_of_gravity_offset=pulled - turning,
        p_delta=bent + turning * line.at(vehicle.displacement, np.zeros(1)),
        first_moment=first,
        second_moment=second,
        attitude_rate=-free(air * arm) / vehicle.relative_velocity,
        bending_displacement=free(air * vehicle.slope),
        bending_rate=-free(air * vehicle.displacement) / vehicle.relative_velocity,
        inertia=inertia,
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


def axial_coefficients(
    vehicle: LoadedVehicle, stations: NDArray[np.float64], drag_forward: NDArray[np.float64]
) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of an axial force's table by (name, unit), each (s,), of the same stations.

    Parameters
    ----------
    drag_forward : (s,) array
        Share of the drag that acts forward of each station.
    """
    return _columns(AXIAL, {"mass_forward": vehicle.line.forward(vehicle.mass, stations), "drag_forward": drag_forward})


def load_columns(coefficients: LoadCoefficients, tanks: Sequence[str]) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of a bending moment's table by (name, unit), each (s,)."""
    columns = (
        *moment_columns(len(coefficients.bending), tanks),
        *REACTION,
        *by_need_columns(len(coefficients.bending)),
    )
    return _columns(columns, _by_name(coefficients, tanks))


def shear_columns(coefficients: LoadCoefficients) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of a shear force's table by (name, unit), each (s,)."""
    return _columns(whole_shear_columns(len(coefficients.bending)), _by_name(coefficients, ()))


def _by_name(c: LoadCoefficients, tanks: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    numbered = {
        "bending": c.bending,
        "p_delta": c.p_delta,
        "bending_displacement": c.bending_displacement,
        "bending_rate": c.bending_rate,
    }
    return {
        "angle_of_attack": c.angle_of_attack,
        "engine_angle": c.engine_angle,
        **{f"{name}_{i}": row for name, rows in numbered.items() for i, row in enumerate(rows, start=1)},
        **{f"slosh_{tank}": row for tank, row in zip(tanks, c.slosh, strict=bool(tanks))},
        "first_moment": c.first_moment,
        "second_moment": c.second_moment,
        "center_of_pressure": c.center_of_pressure,
        "center_of_gravity_offset": c.center_of_gravity_offset,
        "attitude_rate": c.attitude_rate,
    }


def _columns(
    columns: Iterable[Column], values: Mapping[str, NDArray[np.float64]]
) -> dict[tuple[str, str], NDArray[np.float64]]:
    return {(column.name, column.unit): values[column.name] for column in columns}


def local_load_columns(coefficients: LoadCoefficients) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return the columns of what the local angle of attack adds to a bending moment, by (name, unit), each (s,)."""
    return _columns(local_moment_columns(len(coefficients.bending)), _by_name(coefficients, ()))
