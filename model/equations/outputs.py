"""The responses of a vehicle: bending moments (4-13), angle of attack, engine angle, and what options ask for."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca

from ..system.labels import Output
from ..vehicle.noise_loads import loading_deviations
from ..vehicle.vehicle import Vehicle
from ..vehicle.vehicle_file import ExtraOutput, LoadEntry
from .coupling import Accelerations
from .forces import Handles
from .load_components import load_components
from .loads import bending_moment, bent_axis_moment, slosh_reaction, tanks_forward, typical_moment
from .local_aerodynamics import local_bending_moment
from .motion import Motion
from .typical_sizes import SCALES
from .vehicle_numbers import Numbers

Value = tuple[Output, ca.SX]


def outputs(vehicle: Vehicle, numbers: Numbers, motion: Motion, solved: Accelerations, handles: Handles) -> list[Value]:
    """Return the outputs with their expressions, the loads first."""
    found = [_load(vehicle, load, numbers, motion, solved, handles) for load in vehicle.file.loads]
    found.append((Output("angle_of_attack", "rad", SCALES["angle"], "alpha"), motion.alpha))
    found.append((Output("engine_angle", "rad", SCALES["angle"], "beta"), motion.beta))
    for extra in dict.fromkeys(vehicle.file.options.extra_outputs):
        found += _extra(extra, loading_deviations(vehicle.file), numbers, motion, solved)
    return found


def _load(
    vehicle: Vehicle, load: LoadEntry, numbers: Numbers, motion: Motion, solved: Accelerations, handles: Handles
) -> Value:
    tables, tanks, options = numbers.tables, numbers.tanks, vehicle.file.options
    moment = bending_moment(tables, load.output, tanks, motion.alpha, motion.beta, solved.bending, solved.slosh)
    if options.local_angle_of_attack:
        moment += local_bending_moment(tables, load.output, motion.attitude_rate, motion.eta, motion.eta_rate)
    if options.slosh_reaction:
        forward = tanks_forward(vehicle, load, numbers.time, numbers.parameters)
        moment += slosh_reaction(tables, load.output, tanks, forward, motion.xi, solved.slosh)
    if options.p_delta:
        moment += bent_axis_moment(tables, load.output, handles.bent_thrust, motion.eta)
    scale = typical_moment(vehicle.tables[f"loads.{load.output}.angle_of_attack"])
    return Output(load.output, "N m", scale, f"B.M. at station {load.station_m:g} m"), moment


def _extra(
    extra: ExtraOutput, loading: Iterable[str], numbers: Numbers, motion: Motion, solved: Accelerations
) -> list[Value]:
    if extra == "lateral_drift":
        return [(Output(extra, "m", SCALES["lateral_position"], "Y"), motion.lateral_position)]
    if extra == "drift_rate":
        return [(Output(extra, "m/s", SCALES["lateral_velocity"], "Y'"), motion.lateral_velocity)]
    if extra == "load_components":
        return load_components(motion, solved, numbers.tanks, {n: numbers.deviations[n].deviation for n in loading})
    return [(Output(extra, "Pa rad", SCALES[extra], "q alpha"), numbers.tables["dynamic_pressure"] * motion.alpha)]
