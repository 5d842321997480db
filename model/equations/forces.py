"""Everything that accelerates: forces on the rigid body, on the modes and on the slosh masses, and what they do."""

from __future__ import annotations

import casadi as ca

from ..vehicle.columns import MOVED_MODE
from ..vehicle.noise_loads import needed_columns
from ..vehicle.vehicle import Vehicle
from . import bending, rigid_body, slosh
from .coupling import Accelerations, accelerations
from .local_aerodynamics import local_forces
from .motion import Motion
from .noise_loads import moved_modal_force
from .vehicle_numbers import Numbers


def solved_motion(vehicle: Vehicle, numbers: Numbers, motion: Motion, moved: ca.SX) -> Accelerations:
    """Return Y'', phi_Z'', eta'' and xi'' (4-1, 4-2, 4-8, 4-11, 4-12).

    Parameters
    ----------
    vehicle : Vehicle
    numbers, motion
        The vehicle's symbols.
    moved : SX
        Metres that the normal force moves forward, a deviation: zero in the equations themselves.
    """
    options, tables, tanks, modes = vehicle.file.options, numbers.tables, numbers.tanks, numbers.modes
    area, alpha, beta, attitude = numbers.area, motion.alpha, motion.beta, motion.attitude
    eta, eta_rate = motion.eta, motion.eta_rate
    slopes, slosh_mass = bending.slopes(tables, modes, tanks), slosh.tank_column(tables, tanks, "mass")
    force = rigid_body.lateral_force(tables, area, alpha, beta, attitude)
    moment = rigid_body.yaw_moment(tables, area, alpha, beta)
    if options.full_coupling:
        moment += tables["axial_acceleration"] * ca.sum1(slosh_mass * motion.xi)
    modal_force = bending.generalized_force(tables, area, numbers.bending_damping, eta, eta_rate, alpha, beta)
    if MOVED_MODE in needed_columns(vehicle.file)[1]:
        modal_force += moved_modal_force(tables, area, modes, alpha) * moved
    if options.local_angle_of_attack:
        local = local_forces(tables, area, motion.attitude_rate, eta, eta_rate)
        force, moment, modal_force = force + local.force, moment + local.moment, modal_force + local.modal
    return accelerations(
        mass=tables["mass"],
        inertia=tables["moment_of_inertia"],
        modal_mass=bending.mode_column(tables, modes, "generalized_mass"),
        slosh_mass=slosh_mass,
        arms=slosh.attach_arms(tables, tanks),
        displacements=bending.displacements(tables, modes, tanks),
        force=force,
        moment=moment,
        modal_force=modal_force + slosh.slosh_stiffness_force(tables, tanks, slopes, motion.xi),
        slosh_forcing=slosh.slosh_forcing(
            tables, tanks, numbers.slosh_damping, motion.xi, motion.xi_rate, attitude, eta, slopes
        ),
        full=options.full_coupling,
    )
