"""Equations 4-1 to 4-13 of the report, one by one, before they are put together: each as one expression.

The same functions and symbols make them that make the system (rigid_body, control, bending, slosh, loads).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..vehicle.planes import flown_planes
from ..vehicle.vehicle import Vehicle
from . import bending, rigid_body, slosh
from .control_law import engine_angle
from .loads import bending_moment
from .motion import Motion, named
from .vehicle_numbers import Numbers, Shared


@dataclass(frozen=True, eq=False)
class ReportEquation:
    """One equation solved for what stands on its left.

    Attributes
    ----------
    number : str
        In the report, such as '4-1'.
    left : str
        Name of the left-hand side.
    right : SX scalar
    symbols : mapping of str to SX
        Everything that it may depend on, by name.
    """

    number: str
    left: str
    right: ca.SX
    symbols: Mapping[str, ca.SX]

    def depends_on(self) -> list[str]:
        """Return the names on which the right-hand side depends."""
        free = {symbol.__hash__() for symbol in ca.symvar(self.right)}
        return [name for name, symbol in self.symbols.items() if symbol.__hash__() in free]


def report_equations(vehicle: Vehicle) -> dict[str, ReportEquation]:
    """Return the equations of a vehicle by number; of its modes, tanks and loads the first.

    4-1, 4-2, 4-8 and 4-12 are solved for the acceleration; 4-5 to 4-7 are the networks over the Laplace variable s;
    4-9 and 4-10 are the two parts of the force on the mode in 4-8, and 4-11 the third.
    """
    plane = flown_planes(vehicle)[-1]
    vehicle, numbers = plane.vehicle, Numbers.of(plane, Shared.of(vehicle))
    equations = _Equations(numbers, Motion.of(numbers.modes, numbers.tanks))
    found = [*equations.rigid_body(), *equations.control()]
    if numbers.modes:
        found += equations.bending()
    if numbers.tanks:
        found.append(equations.slosh())
    if vehicle.file.loads:
        found.append(equations.load(vehicle.file.loads[0].output))
    known = equations.known()
    return {number: ReportEquation(number, left, right, known) for number, left, right in found}


Equation = tuple[str, str, ca.SX]  # number, left-hand side, right-hand side


class _Equations:
    """The blocks of the report in the model's symbols, and symbols for what one equation takes from another."""

    def __init__(self, numbers: Numbers, motion: Motion):
        self.numbers, self.motion, self.tables = numbers, motion, numbers.tables
        modes, tanks = range(1, numbers.modes + 1), numbers.tanks
        self.bending_acceleration = named(f"bending_acceleration_{i}" for i in modes)
        self.slosh_acceleration = named(f"slosh_acceleration_{tank}" for tank in tanks)
        others = ("wind", "T3", "s", "slosh_force_on_mode_1", "lateral_acceleration", "attitude_acceleration")
        self.other = {name: ca.SX.sym(name) for name in others}

    def known(self) -> dict[str, ca.SX]:
        """Return every symbol by name: tables, motion, parameters."""
        m = self.motion
        motion = ca.vertcat(
            m.alpha, m.beta, m.attitude, m.eta, m.eta_rate, self.bending_acceleration, m.xi, m.xi_rate,
            self.slosh_acceleration, m.lateral_velocity, *self.other.values(),
        )  # fmt: skip
        tables = {name: self.tables[name] for group in self.numbers.groups for name in group.names}
        parameters = self.numbers.parameters
        values = {p.name: parameters.vector[i] for i, p in enumerate(parameters.parameters)}
        return tables | {symbol.name(): symbol for symbol in ca.symvar(motion)} | values

    def rigid_body(self) -> list[Equation]:
        tables, area, m = self.tables, self.numbers.area, self.motion
        force = rigid_body.lateral_force(tables, area, m.alpha, m.beta, m.attitude)
        moment = rigid_body.yaw_moment(tables, area, m.alpha, m.beta)
        alpha = rigid_body.angle_of_attack(tables, m.attitude, m.lateral_velocity, self.other["wind"])
        return [
            ("4-1", "lateral_acceleration", force / tables["mass"]),
            ("4-2", "attitude_acceleration", moment / tables["moment_of_inertia"]),
            ("4-3", "angle_of_attack", alpha),
        ]

    def control(self) -> list[Equation]:
        found = [("4-4", "engine_angle", engine_angle(self.tables, self.other["T3"], self.motion.eta))]
        s = self.other["s"]
        for number, name in (("4-5", "T1"), ("4-6", "T2"), ("4-7", "T3")):
            gain, above, below = self.numbers.networks[name]
            found.append((number, f"{name}(s)", gain * _polynomial(above, s) / _polynomial(below, s)))
        return found

    def bending(self) -> list[Equation]:
        m, still, none = self.motion, ca.SX.zeros(self.numbers.modes), ca.SX(0)
        whole = self._modal_force(m.eta, m.eta_rate, m.alpha, m.beta) + self.other["slosh_force_on_mode_1"]
        return [
            ("4-8", "bending_acceleration_1", whole / self.tables["bending.1.generalized_mass"]),
            ("4-9", "engine_force_on_mode_1", self._modal_force(still, still, none, m.beta)),
            ("4-10", "aerodynamic_force_on_mode_1", self._modal_force(still, still, m.alpha, none)),
            ("4-11", "slosh_force_on_mode_1", self._slosh_force()),
        ]

    def _modal_force(self, eta: ca.SX, eta_rate: ca.SX, alpha: ca.SX, beta: ca.SX) -> ca.SX:
        n = self.numbers
        return bending.generalized_force(self.tables, n.area, n.bending_damping, eta, eta_rate, alpha, beta)[0]

    def _slosh_force(self) -> ca.SX:
        tables, tanks, modes = self.tables, self.numbers.tanks, self.numbers.modes
        if not tanks:
            return ca.SX(0)
        slopes, shapes = bending.slopes(tables, modes, tanks), bending.displacements(tables, modes, tanks)
        stiffness = slosh.slosh_stiffness_force(tables, tanks, slopes, self.motion.xi)
        return (stiffness - shapes @ (slosh.tank_column(tables, tanks, "mass") * self.slosh_acceleration))[0]

    def slosh(self) -> Equation:
        tables, tanks, modes, m = self.tables, self.numbers.tanks, self.numbers.modes, self.motion
        slopes, shapes = bending.slopes(tables, modes, tanks), bending.displacements(tables, modes, tanks)
        damping = self.numbers.slosh_damping
        forcing = slosh.slosh_forcing(tables, tanks, damping, m.xi, m.xi_rate, m.attitude, m.eta, slopes)
        inertia = (
            self.other["lateral_acceleration"]
            + slosh.attach_arms(tables, tanks) * self.other["attitude_acceleration"]
            + shapes.T @ self.bending_acceleration
        )
        return "4-12", f"slosh_acceleration_{tanks[0]}", (forcing - inertia)[0]

    def load(self, load: str) -> Equation:
        m, tanks = self.motion, self.numbers.tanks
        of_modes, of_tanks = self.bending_acceleration, self.slosh_acceleration
        return "4-13", load, bending_moment(self.tables, load, tanks, m.alpha, m.beta, of_modes, of_tanks)


def _polynomial(coefficients: ca.SX, s: ca.SX) -> ca.SX:
    """Return the polynomial with coefficients in descending powers."""
    count = coefficients.numel()
    return sum((coefficients[k] * s ** (count - 1 - k) for k in range(count)), ca.SX(0))
