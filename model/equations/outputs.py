"""The responses of a vehicle: loads, angle of attack, engine angle, q alpha, and what options ask for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import casadi as ca

from ..system.labels import Output
from ..vehicle.loads import AXIAL_FORCE, SIDES, LateralLoad, lateral_loads, load_name
from ..vehicle.noise_loads import component_deviations
from ..vehicle.vehicle import Vehicle
from ..vehicle.vehicle_file import ExtraOutput, LoadEntry
from .coupling import Accelerations
from .forces import Handles, aerodynamic_angle
from .load_components import load_components
from .loads import (
    axial_force,
    bending_moment,
    bent_axis_load,
    shear_force,
    slosh_reaction,
    tanks_forward,
    typical_axial_force,
    typical_load,
)
from .local_aerodynamics import local_load
from .motion import Motion
from .penetration import zone_load
from .typical_sizes import SCALES
from .vehicle_numbers import Numbers

Value = tuple[Output, ca.SX]


def outputs(vehicle: Vehicle, numbers: Numbers, motion: Motion, solved: Accelerations, handles: Handles) -> list[Value]:
    """Return the outputs with their expressions: bending moments, angles, the other loads, q alpha, extra outputs."""
    forward = {load.output: _tanks_forward(vehicle, load, numbers) for load in vehicle.file.loads}
    lateral = [
        (load, _lateral(vehicle, load, forward[load.station.output], numbers, motion, solved, handles))
        for load in lateral_loads(vehicle.file)
    ]
    found = [value for load, value in lateral if not load.is_shear]
    moments = {output.name: value for output, value in found}
    found.append((Output("angle_of_attack", "rad", SCALES["angle"], "alpha"), motion.alpha))
    found.append((Output("engine_angle", "rad", SCALES["angle"], "beta"), motion.beta))
    found += [value for load, value in lateral if load.is_shear]
    found += _along_axis(vehicle, numbers, moments)
    q_alpha = numbers.tables["dynamic_pressure"] * motion.alpha
    found.append((Output("q_alpha", "Pa rad", SCALES["q_alpha"], "q alpha"), q_alpha))
    for extra in dict.fromkeys(vehicle.file.options.extra_outputs):
        found += _extra(extra, component_deviations(vehicle.file), numbers, motion, solved)
    return found


def _tanks_forward(vehicle: Vehicle, load: LoadEntry, numbers: Numbers) -> ca.SX:
    """Return which slosh masses are forward of a station, where its loads ask for it; zero elsewhere."""
    if not (load.shear or vehicle.file.options.slosh_reaction):
        return ca.SX.zeros(len(numbers.tanks))
    assert load.forward_of_gimbal_m is not None  # checked by LoadEntry and load_vehicle
    return tanks_forward(vehicle, load.output, load.forward_of_gimbal_m, numbers.time, numbers.parameters)


def _lateral(
    vehicle: Vehicle,
    load: LateralLoad,
    forward: ca.SX,
    numbers: Numbers,
    motion: Motion,
    solved: Accelerations,
    handles: Handles,
) -> Value:
    tables, tanks, options, name = numbers.tables, numbers.tanks, vehicle.file.options, load.output
    angles = aerodynamic_angle(numbers, motion), motion.beta
    if load.is_shear:
        value = shear_force(tables, name, tanks, forward, *angles, solved.bending, solved.slosh)
    else:
        value = bending_moment(tables, name, tanks, *angles, solved.bending, solved.slosh)
    if options.local_angle_of_attack:
        value += local_load(tables, name, motion.attitude_rate, motion.eta, motion.eta_rate)
    if options.slosh_reaction:
        weights = ca.SX.zeros(len(tanks)) if load.is_shear else forward
        value += slosh_reaction(tables, name, tanks, weights, motion.xi, solved.slosh)
    if options.p_delta:
        value += bent_axis_load(tables, name, handles.bent_thrust, motion.eta)
    if motion.zone_angles.numel():
        value += zone_load(tables, numbers.area, name, motion.zone_angles)
    scale = typical_load(vehicle.tables[f"loads.{name}.angle_of_attack"])
    what = "shear force" if load.is_shear else "B.M."
    return Output(name, load.unit, scale, f"{what} at station {load.station.station_m:g} m"), value


def _along_axis(vehicle: Vehicle, numbers: Numbers, moments: Mapping[str, ca.SX]) -> list[Value]:
    """Return the axial forces, then the equivalent axial loads, which moments make with them."""
    axial, equivalent = [], []
    for load in vehicle.file.loads:
        if load.axial is None:
            continue
        name, station = load_name(load.output, AXIAL_FORCE), f"at station {load.station_m:g} m"
        coefficients = numbers.tables.under(f"loads.{name}.")
        force = axial_force(coefficients, numbers.tables, load.forward_of_gimbal_m) * numbers.undisturbed
        mass_forward, acceleration = (vehicle.tables[n] for n in (f"loads.{name}.mass_forward", "axial_acceleration"))
        scale = typical_axial_force(mass_forward, acceleration)
        axial.append((Output(name, "N", scale, f"axial force {station}"), force))
        if load.output not in numbers.radii:
            continue
        scale = typical_load(vehicle.tables[f"loads.{load.output}.angle_of_attack"])  # 2 / R, near 1 per metre
        for side, sign in SIDES.items():
            value = force + sign * 2 * moments[load.output] / numbers.radii[load.output]
            equivalent.append(
                (Output(load_name(load.output, side), "N", scale, f"N {'+-'[sign < 0]} 2 M / R {station}"), value)
            )
    return [*axial, *equivalent]


def _extra(
    extra: ExtraOutput, loading: Iterable[str], numbers: Numbers, motion: Motion, solved: Accelerations
) -> list[Value]:
    if extra == "lateral_drift":
        return [(Output(extra, "m", SCALES["lateral_position"], "Y"), motion.lateral_position)]
    if extra == "drift_rate":
        return [(Output(extra, "m/s", SCALES["lateral_velocity"], "Y'"), motion.lateral_velocity)]
    if extra == "load_components":
        return load_components(motion, solved, numbers.tanks, {n: numbers.deviations[n].deviation for n in loading})
    return [(Output(extra, "Pa rad", SCALES["q_alpha"], "q alpha"), numbers.tables["dynamic_pressure"] * motion.alpha)]
