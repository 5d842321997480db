"""Equations 4-1 to 4-13 of the report, one by one, before they are put together: each as one expression.

The same functions make them that make the system (rigid_body, control, bending, slosh, loads).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..system.symbols import ParameterSymbols, TableSymbols
from ..vehicle.vehicle import Vehicle
from . import bending, rigid_body, slosh
from .assemble import vehicle_tables
from .control import transfer_function_symbols
from .loads import bending_moment


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
    groups, modes = vehicle_tables(vehicle), len(vehicle.bending)
    tank_names = [t.name for t in vehicle.slosh]
    tables = TableSymbols(tuple(name for group in groups for name in group.names))
    parameters, named = ParameterSymbols(), {}
    area = parameters.add("reference_area", vehicle.file.reference_area_m2)

    def symbol(name: str) -> ca.SX:
        return named.setdefault(name, ca.SX.sym(name))

    def column(names: list[str]) -> ca.SX:
        return ca.vertcat(ca.SX(0, 1), *map(symbol, names))

    alpha, beta, attitude = symbol("angle_of_attack"), symbol("engine_angle"), symbol("attitude")
    numbers = range(1, modes + 1)
    eta, eta_rate, eta_acceleration = (
        column([f"{kind}_{i}" for i in numbers]) for kind in ("bending", "bending_rate", "bending_acceleration")
    )
    xi, xi_rate, xi_acceleration = (
        column([f"{kind}_{t}" for t in tank_names]) for kind in ("slosh", "slosh_rate", "slosh_acceleration")
    )
    found = [
        ("4-1", "lateral_acceleration", rigid_body.lateral_force(tables, area, alpha, beta, attitude) / tables["mass"]),
        (
            "4-2",
            "attitude_acceleration",
            rigid_body.yaw_moment(tables, area, alpha, beta) / tables["moment_of_inertia"],
        ),
        (
            "4-3",
            "angle_of_attack",
            rigid_body.angle_of_attack(tables, attitude, symbol("lateral_velocity"), symbol("wind")),
        ),
        ("4-4", "engine_angle", symbol("T3") + bending.mode_column(tables, modes, "slope_at_gimbal").T @ eta),
    ]
    s = symbol("s")
    for number, name in (("4-5", "T1"), ("4-6", "T2"), ("4-7", "T3")):
        gain, above, below = transfer_function_symbols(name, vehicle.transfer_functions[name], parameters)
        found.append((number, f"{name}(s)", gain * _polynomial(above, s) / _polynomial(below, s)))
    if modes:
        damping = ca.vertcat(*(parameters.add(f"bending.{i}.damping", 0.0) for i in numbers))
        still = ca.SX.zeros(modes)
        mass = tables["bending.1.generalized_mass"]

        def force(eta: ca.SX, eta_rate: ca.SX, alpha: ca.SX, beta: ca.SX) -> ca.SX:
            return bending.generalized_force(tables, area, damping, eta, eta_rate, alpha, beta)[0]

        of_slosh = ca.SX(0)
        if tank_names:
            stiffness = slosh.slosh_stiffness_force(tables, tank_names, bending.slopes(tables, modes, tank_names), xi)
            inertia = bending.displacements(tables, modes, tank_names) @ (
                slosh.tank_column(tables, tank_names, "mass") * xi_acceleration
            )
            of_slosh = (stiffness - inertia)[0]
        whole = force(eta, eta_rate, alpha, beta) + symbol("slosh_force_on_mode_1")
        found += [
            ("4-8", "bending_acceleration_1", whole / mass),
            ("4-9", "engine_force_on_mode_1", force(still, still, ca.SX(0), beta)),
            ("4-10", "aerodynamic_force_on_mode_1", force(still, still, alpha, ca.SX(0))),
            ("4-11", "slosh_force_on_mode_1", of_slosh),
        ]
    if tank_names:
        damping = ca.vertcat(*(parameters.add(f"slosh.{t}.damping", 0.0) for t in tank_names))
        slopes, shapes = (f(tables, modes, tank_names) for f in (bending.slopes, bending.displacements))
        forcing = slosh.slosh_forcing(tables, tank_names, damping, xi, xi_rate, attitude, eta, slopes)
        inertia = (
            symbol("lateral_acceleration")
            + slosh.attach_arms(tables, tank_names) * symbol("attitude_acceleration")
            + shapes.T @ eta_acceleration
        )
        found.append(("4-12", f"slosh_acceleration_{tank_names[0]}", (forcing - inertia)[0]))
    if vehicle.file.loads:
        load = vehicle.file.loads[0].output
        moment = bending_moment(tables, load, tank_names, alpha, beta, eta_acceleration, xi_acceleration)
        found.append(("4-13", load, moment))
    names = [name for group in groups for name in group.names]
    known = {name: tables[name] for name in names} | named
    known |= {p.name: parameters.vector[i] for i, p in enumerate(parameters.parameters)}
    return {number: ReportEquation(number, left, right, known) for number, left, right in found}


def _polynomial(coefficients: ca.SX, s: ca.SX) -> ca.SX:
    """Return the polynomial with coefficients in descending powers."""
    count = coefficients.numel()
    return sum((coefficients[k] * s ** (count - 1 - k) for k in range(count)), ca.SX(0))
