"""Motion in the yaw plane with large angles: the rigid vehicle, its control law and a wind across the path.

Axes: x along the flight without wind, Y across it in the yaw plane. U is the speed along x, V that of the flight
without wind. Forces act in body axes, turned by the attitude phi:

    axial = F_T - F_C (1 - cos beta) - F_A q*/q,    lateral = q* A C'_N alpha + F_C sin beta
    m U' = axial cos phi - lateral sin phi - (F_T - F_A) + m V'
    m Y'' = axial sin phi + lateral cos phi
    I phi'' = q* A C'_N (X_CP - X_CG) alpha - F_C X_CG sin beta
    alpha = phi + atan2(W - Y', U),    q* = q [U^2 + (W - Y')^2] / V^2

In the plane across the pitch plane gravity acts along x alone; with the turn of the path it is what V' and the flight's
own axial force leave over. Mass, thrust and aerodynamic coefficients are those of the flight without wind at that time.
For phi = alpha = beta = 0, U = V and no wind the derivatives of these equations are the report's 4-1 to 4-3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..equations.control import transfer_function, transfer_function_symbols
from ..equations.rigid_body import normal_force_slope
from ..system.symbols import ParameterSymbols, TableSymbols
from ..vehicle.vehicle_file import TransferFunctionEntry


@dataclass(frozen=True, eq=False)
class PlanarMotion:
    """Accelerations along and across the flight (m/s2), of the attitude (rad/s2), and angle of attack (rad)."""

    forward: ca.SX
    lateral: ca.SX
    rotation: ca.SX
    angle_of_attack: ca.SX


def planar_motion(
    tables: TableSymbols,
    reference_area: ca.SX,
    flight_acceleration: ca.SX,
    forward_speed: ca.SX,
    lateral_velocity: ca.SX,
    attitude: ca.SX,
    engine_angle: ca.SX,
    wind: ca.SX,
) -> PlanarMotion:
    """Write down the equations of the module.

    Parameters
    ----------
    tables : TableSymbols
        The vehicle's tables over flight time.
    reference_area, flight_acceleration : SX
        A (m2); V' (m/s2).
    forward_speed, lateral_velocity : SX
        U, Y' (m/s).
    attitude, engine_angle : SX
        phi, beta (rad).
    wind : SX
        W (m/s).
    """
    across = wind - lateral_velocity
    alpha = attitude + ca.atan2(across, forward_speed)
    pressure_ratio = (forward_speed**2 + across**2) / tables["relative_velocity"] ** 2
    normal = pressure_ratio * normal_force_slope(tables, reference_area) * alpha
    thrust, control, drag = tables["thrust"], tables["control_thrust"], tables["axial_drag"]
    axial = thrust - control * (1 - ca.cos(engine_angle)) - drag * pressure_ratio
    side = normal + control * ca.sin(engine_angle)
    cos, sin, mass = ca.cos(attitude), ca.sin(attitude), tables["mass"]
    arm = tables["center_of_pressure"] - tables["center_of_gravity"]
    moment = normal * arm - control * tables["center_of_gravity"] * ca.sin(engine_angle)
    return PlanarMotion(
        forward=(axial * cos - side * sin - (thrust - drag)) / mass + flight_acceleration,
        lateral=(axial * sin + side * cos) / mass,
        rotation=moment / tables["moment_of_inertia"],
        angle_of_attack=alpha,
    )


@dataclass(frozen=True, eq=False)
class PlanarLoop:
    """The planar motion closed by the control law, without bending and slosh.

    Attributes
    ----------
    states : SX
        U, Y', phi, phi', then those of T1, T2 and T3.
    derivative, outputs : SX
        Outputs: angle of attack, engine angle, attitude (rad).
    flight : SX
        The states on the flight without wind.
    wind, flight_acceleration : SX
        W, V'.
    tables : TableSymbols
    parameters : ParameterSymbols
        Named as in the assembled model.
    """

    states: ca.SX
    derivative: ca.SX
    outputs: ca.SX
    flight: ca.SX
    wind: ca.SX
    flight_acceleration: ca.SX
    tables: TableSymbols
    parameters: ParameterSymbols

    def linearised(self) -> tuple[ca.SX, ca.SX]:
        """Return derivative and outputs, linearised by CasADi about the flight without wind."""
        at = ca.vertcat(self.states, self.wind)
        reference = ca.vertcat(self.flight, 0)
        both = ca.vertcat(self.derivative, self.outputs)
        value, jacobian = ca.substitute([both, ca.jacobian(both, at)], [at], [reference])
        line = value + jacobian @ (at - reference)
        return line[: self.states.numel()], line[self.states.numel() :]


def planar_loop(
    table_names: tuple[str, ...], transfer_functions: Mapping[str, TransferFunctionEntry], reference_area: float
) -> PlanarLoop:
    """Close the loop: beta = T3 { K1 T1 phi + K2 T2 phi' }.

    Parameters
    ----------
    table_names : tuple of str
        In the order of the table values.
    transfer_functions : mapping
        T1, T2 and T3.
    reference_area : float
        m2.
    """
    tables, parameters = TableSymbols(table_names), ParameterSymbols()
    area = parameters.add("reference_area", reference_area)
    networks = {n: transfer_function_symbols(n, e, parameters) for n, e in transfer_functions.items()}
    motion_states = ca.SX.sym("motion", 4)
    speed, lateral_velocity, attitude, rate = ca.vertsplit(motion_states)
    wind, flight_acceleration = ca.SX.sym("wind"), ca.SX.sym("flight_acceleration")
    T1 = transfer_function("T1", *networks["T1"], attitude)
    T2 = transfer_function("T2", *networks["T2"], rate)
    command = tables["control.attitude_factor"] * T1.output + tables["control.rate_factor"] * T2.output
    T3 = transfer_function("T3", *networks["T3"], command)
    motion = planar_motion(tables, area, flight_acceleration, speed, lateral_velocity, attitude, T3.output, wind)
    filters = ca.vertcat(T1.states, T2.states, T3.states)
    return PlanarLoop(
        states=ca.vertcat(motion_states, filters),
        derivative=ca.vertcat(
            motion.forward, motion.lateral, rate, motion.rotation, T1.derivative, T2.derivative, T3.derivative
        ),
        outputs=ca.vertcat(motion.angle_of_attack, T3.output, attitude),
        flight=ca.vertcat(tables["relative_velocity"], ca.SX.zeros(3 + filters.numel())),
        wind=wind,
        flight_acceleration=flight_acceleration,
        tables=tables,
        parameters=parameters,
    )
