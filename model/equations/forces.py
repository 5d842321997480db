"""Everything that accelerates: forces on the rigid body, on the modes and on the slosh masses, and what they do."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..system.symbols import TableSymbols
from ..vehicle.biases import CENTER_OF_GRAVITY_OFFSET
from ..vehicle.columns import MOVED_MODE, PRODUCT_OF_INERTIA
from ..vehicle.noise_loads import needed_columns
from ..vehicle.vehicle import Vehicle
from . import bending, rigid_body, slosh
from .coupling import Accelerations, accelerations
from .local_aerodynamics import local_forces
from .motion import Motion
from .noise_loads import moved_modal_force
from .penetration import zone_forces
from .vehicle_numbers import Numbers


@dataclass(frozen=True, eq=False)
class Handles:
    """Symbols by which deviations take hold of the forces; in the equations themselves they have a value.

    Attributes
    ----------
    moved : SX
        Metres that the normal force moves forward: zero.
    couple : SX
        Couple on the whole vehicle (N m): zero.
    bent_thrust : SX
        Thrust on the displaced gimbal (N): the table, whose deviations it does not follow.
    other_plane : SX
        Couple by the turning of the other plane (N m), where a product of inertia couples both; solved where both meet.
    """

    moved: ca.SX
    couple: ca.SX
    bent_thrust: ca.SX
    other_plane: ca.SX

    @staticmethod
    def new() -> Handles:
        """Declare the symbols."""
        return Handles(*(ca.SX.sym(name) for name in ("moved", "couple", "bent_thrust", "other_plane")))

    @property
    def vector(self) -> ca.SX:
        """Those that have a value in one plane."""
        return ca.vertcat(self.moved, self.couple, self.bent_thrust)

    @staticmethod
    def values(tables: TableSymbols) -> ca.SX:
        """Return what stands in their place."""
        return ca.vertcat(0, 0, tables["thrust"])


def aerodynamic_angle(numbers: Numbers, motion: Motion) -> ca.SX:
    """Return the angle of attack from where the normal force is zero, rad: what C'_N and M'_alpha multiply."""
    zero = numbers.zero_force_angle
    return motion.alpha if zero.is_zero() else motion.alpha + zero


def solved_motion(vehicle: Vehicle, numbers: Numbers, motion: Motion, handles: Handles) -> Accelerations:
    """Return Y'', phi_Z'', eta'' and xi'' (4-1, 4-2, 4-8, 4-11, 4-12).

    Parameters
    ----------
    vehicle : Vehicle
    numbers, motion, handles
        The vehicle's symbols.
    """
    options, tables, tanks, modes = vehicle.file.options, numbers.tables, numbers.tanks, numbers.modes
    area, beta, attitude = numbers.area, motion.beta, motion.attitude
    alpha = aerodynamic_angle(numbers, motion)
    eta, eta_rate = motion.eta, motion.eta_rate
    slopes, slosh_mass = bending.slopes(tables, modes, tanks), slosh.tank_column(tables, tanks, "mass")
    force = rigid_body.lateral_force(tables, area, alpha, beta, attitude)
    moment = rigid_body.yaw_moment(tables, area, alpha, beta)
    if options.full_coupling:
        moment += tables["axial_acceleration"] * ca.sum1(slosh_mass * motion.xi)
    if options.p_delta:
        moment -= handles.bent_thrust * bending.gimbal_displacement(tables, eta)
    if CENTER_OF_GRAVITY_OFFSET in numbers.biases:
        moment += handles.couple
    if PRODUCT_OF_INERTIA.name in tables:
        moment += handles.other_plane
    modal_force = bending.generalized_force(tables, area, numbers.bending_damping, eta, eta_rate, alpha, beta)
    if MOVED_MODE in needed_columns(vehicle.file)[1]:
        modal_force += moved_modal_force(tables, area, modes, alpha) * handles.moved
    if options.local_angle_of_attack:
        local = local_forces(tables, area, motion.attitude_rate, eta, eta_rate)
        force, moment, modal_force = force + local.force, moment + local.moment, modal_force + local.modal
    if motion.zone_angles.numel():
        zones = zone_forces(tables, area, motion.zone_angles, modes)
        moment, modal_force = moment + zones.moment, modal_force + zones.modal
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
