"""Load relief: feedback of a body-mounted accelerometer and of a measured angle of attack into the engine command.

beta = T3(s) { K1 T1(s) phi_m + K2 T2(s) phidot_m + K3 F_A(s) a_A + K4 F_a(s) alpha_s } + sum_j Y'_j(X_E) eta_j,
K3 and K4 a gain times a schedule over flight time,

    a_A = Y'' - (F_TX - F_AX) / m phi_Z + (X_A - X_CG) phi_Z'' + sum_j [Y_j(X_A) eta_j'' - A_X Y'_j(X_A) eta_j]
    alpha_s = phi_Z + sum_j Y'_j(X_s) eta_j + [W - Y' - (X_s - X_CG) phi_Z' - sum_j Y_j(X_s) eta_j'] / V_RS

(docs/equations.md, section 3). Both filters have more poles than zeros, as real sensors do: then neither the engine
angle nor white noise comes back to the command without delay, and no algebraic loop has to be solved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..system.symbols import ParameterSymbols, TableSymbols
from ..vehicle.vehicle_file import SensorFeedbackEntry
from .block import Block
from .control import TransferFunction, transfer_function, transfer_function_symbols
from .coupling import Accelerations
from .motion import Motion

GAIN_UNITS = {"accelerometer": "rad s2/m", "angle_of_attack": "1"}
SIGNALS = {"accelerometer": ("m/s2", 1.0), "angle_of_attack": ("rad", 0.02)}  # unit and typical size


@dataclass(frozen=True)
class Sensor:
    """Numbers of one feedback as symbols.

    Attributes
    ----------
    position : SX
        Metres forward of the gimbal plane.
    displacement, slope : (modes,) SX
        Y_j and Y'_j (1/m) where the sensor sits.
    gain, numerator, denominator : SX
        Of the filter.
    factor : SX
        Of the gain schedule.
    """

    position: ca.SX
    displacement: ca.SX
    slope: ca.SX
    gain: ca.SX
    numerator: ca.SX
    denominator: ca.SX
    factor: ca.SX

    def feedback(self, name: str, signal: ca.SX) -> TransferFunction:
        """Return what the sensor adds to the engine command, rad."""
        filtered = transfer_function(name, self.gain, self.numerator, self.denominator, signal)
        return TransferFunction(filtered.states, filtered.derivative, self.factor * filtered.output)


def sensor_symbols(
    entries: Mapping[str, SensorFeedbackEntry], modes: int, tables: TableSymbols, parameters: ParameterSymbols
) -> dict[str, Sensor]:
    """Declare the parameters of the feedbacks that a vehicle has."""
    found = {}
    for name, entry in entries.items():
        prefix = f"control.{name}"
        where = f"position of the {name.replace('_', ' ')} sensor; its bending modes are tables and do not follow"
        position = parameters.add(f"{prefix}.position", entry.position_m, "m", where)
        displacement, slope = (
            ca.vertcat(ca.SX(0, 1), *(tables[f"{prefix}.{quantity}_{i}"] for i in range(1, modes + 1)))
            for quantity in ("displacement", "slope")
        )
        gain, numerator, denominator = transfer_function_symbols(
            name, entry.filter, parameters, entry.gain, GAIN_UNITS[name]
        )
        factor = tables[f"{prefix}.factor"] if entry.schedule else ca.SX(1)
        found[name] = Sensor(position, displacement, slope, gain, numerator, denominator, factor)
    return found


def sensed_acceleration(
    tables: TableSymbols, sensor: Sensor, solved: Accelerations, attitude: ca.SX, eta: ca.SX
) -> ca.SX:
    """a_A, m/s2: acceleration less gravity, across the bent axis at the sensor.

    The frame's own acceleration is written (F_TX - F_AX) / m for the rigid body, not A_X: thrust along the axis is
    then invisible to the sensor also where it deviates, as it must be.
    """
    along = (tables["thrust"] - tables["axial_drag"]) / tables["mass"]
    rigid = solved.lateral - along * attitude + (sensor.position - tables["center_of_gravity"]) * solved.rotation
    return rigid + sensor.displacement.T @ solved.bending - tables["axial_acceleration"] * (sensor.slope.T @ eta)


def sensed_angle_of_attack(
    tables: TableSymbols,
    sensor: Sensor,
    angle_of_attack: ca.SX,
    attitude_rate: ca.SX,
    eta: ca.SX,
    eta_rate: ca.SX,
) -> ca.SX:
    """alpha_s, rad: the angle of attack (4-3) with the turn and the motion of the place where it is measured."""
    arm = sensor.position - tables["center_of_gravity"]
    motion = arm * attitude_rate + sensor.displacement.T @ eta_rate
    return angle_of_attack + sensor.slope.T @ eta - motion / tables["relative_velocity"]


def feedbacks(
    tables: TableSymbols, sensors: Mapping[str, Sensor], motion: Motion, solved: Accelerations
) -> dict[str, TransferFunction]:
    """Return what every sensor adds to the engine command, rad."""
    signals = {}
    if "accelerometer" in sensors:
        signals["accelerometer"] = sensed_acceleration(
            tables, sensors["accelerometer"], solved, motion.attitude, motion.eta
        )
    if "angle_of_attack" in sensors:
        signals["angle_of_attack"] = sensed_angle_of_attack(
            tables, sensors["angle_of_attack"], motion.alpha, motion.attitude_rate, motion.eta, motion.eta_rate
        )
    return {name: sensors[name].feedback(name, signal) for name, signal in signals.items()}


def filter_block(name: str, filtered: TransferFunction) -> Block:
    """Return the states of a sensor's filter, which have the unit of its signal."""
    return Block.numbered(f"{name}_filter", filtered.states, filtered.derivative, *SIGNALS[name])
