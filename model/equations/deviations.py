"""How deviations enter the equations: one column for each noise (4.1.5, 4.1.6) and bias of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from ..errors import DataError
from ..vehicle.biases import CENTER_OF_GRAVITY_OFFSET, THRUST_MISALIGNMENT, vehicle_biases
from ..vehicle.loads import SIDES, lateral_loads, load_name
from ..vehicle.noise_loads import CENTER_OF_PRESSURE, deviating_tables, loading_deviations
from ..vehicle.vehicle import Vehicle
from .forces import Handles, aerodynamic_angle
from .motion import Motion
from .noise_loads import noise_load
from .vehicle_numbers import Numbers
from .vehicle_tables import MEAN_TABLES


@dataclass(frozen=True, eq=False)
class Undeviated:
    """The equations before noises and biases: what they act on.

    Attributes
    ----------
    states, rates, outputs : SX columns
    angles : (2 + zones,) SX
        Angle of attack, engine angle and those of gust zones in terms of the states.
    responses : tuple of str
        Names of the outputs.
    handles : Handles
    """

    states: ca.SX
    rates: ca.SX
    outputs: ca.SX
    angles: ca.SX
    responses: tuple[str, ...]
    handles: Handles


def deviated(vehicle: Vehicle, numbers: Numbers, motion: Motion, equations: Undeviated) -> tuple[ca.SX, ca.SX]:
    """Return rates and outputs with every noise and bias added, alpha and beta in terms of the states.

    The bias of the wind is no column of these: it is in alpha.

    Raises
    ------
    DataError
        If a noise deviates a table that the mean response cannot carry.
    """
    rates, outputs, n = equations.rates, equations.outputs, equations.states.numel()
    for name, column in _columns(vehicle, numbers, motion, equations):
        deviation = numbers.deviations[name].deviation
        rates += column[:n] * deviation
        outputs += column[n:] * deviation
    handles = equations.handles
    symbols = ca.vertcat(motion.alpha, motion.beta, motion.zone_angles, handles.vector)
    rates, outputs = ca.substitute(
        [rates, outputs], [symbols], [ca.vertcat(equations.angles, handles.values(numbers.tables))]
    )
    return rates, outputs


def _columns(vehicle: Vehicle, numbers: Numbers, motion: Motion, equations: Undeviated) -> Iterator[tuple[str, ca.SX]]:
    """Yield by source what a deviation of 1 puts into rates and outputs."""
    for name, tables in deviating_tables(vehicle.file).items():
        yield name, deviation_column(vehicle, name, tables, numbers, motion, equations)
    both = ca.vertcat(equations.rates, equations.outputs)
    if THRUST_MISALIGNMENT in numbers.biases:
        column = ca.jtimes(both, motion.beta, ca.SX(1))
        column[equations.states.numel() + equations.responses.index("engine_angle")] = 0  # the engines themselves stand
        yield THRUST_MISALIGNMENT, column
    if CENTER_OF_GRAVITY_OFFSET in numbers.biases:
        name, tables = CENTER_OF_GRAVITY_OFFSET, numbers.tables
        column = ca.jtimes(both, equations.handles.couple, tables["thrust"] - tables["axial_drag"])
        yield name, column + _direct(vehicle, name, numbers, motion, equations)


def deviation_column(
    vehicle: Vehicle,
    name: str,
    deviating: tuple[str, ...],
    numbers: Numbers,
    motion: Motion,
    equations: Undeviated,
) -> ca.SX:
    """Return d(rates, outputs)/d ln(factor on deviating tables) at the mean response, by CasADi's derivative."""
    tables, handles = numbers.tables, equations.handles
    both = ca.vertcat(equations.rates, equations.outputs)
    column = _direct(vehicle, name, numbers, motion, equations)
    for table in deviating:
        symbol = tables[table]
        if ca.depends_on(equations.angles, symbol):
            raise _refusal(
                vehicle,
                name,
                f"'{table}' changes the angle of attack or engine angle itself and cannot deviate as noise; "
                "choose a table of forces, masses or arms",
            )
        column += ca.jtimes(both, symbol, symbol)
        if table == CENTER_OF_PRESSURE:
            column += ca.jtimes(both, handles.moved, symbol)
    if column.is_zero():
        raise _refusal(vehicle, name, f"deviations of {', '.join(deviating)} change nothing in the equations")
    at_mean = ca.vertcat(*(tables[n] for n in MEAN_TABLES), 0, 0, 1, ca.SX.zeros(motion.zone_angles.numel()))
    angles = motion.alpha, motion.beta, motion.attitude
    symbols = ca.vertcat(*angles, handles.moved, handles.couple, numbers.undisturbed, motion.zone_angles)
    column = ca.substitute(column, symbols, at_mean)
    if ca.depends_on(column, ca.vertcat(equations.states, handles.other_plane)):
        raise _refusal(
            vehicle,
            name,
            f"deviations of {', '.join(deviating)} act on more than the mean angle of attack, engine angle and "
            "attitude; choose a table of forces or arms",
        )
    return column


def _direct(vehicle: Vehicle, name: str, numbers: Numbers, motion: Motion, equations: Undeviated) -> ca.SX:
    """Return what a deviation puts into the loads by coefficients that follow it, zero in all other rows."""
    loading, form = loading_deviations(vehicle.file).get(name, ()), vehicle.file.options.noise_loads
    n = equations.states.numel()
    column = ca.SX.zeros(n + equations.outputs.numel())
    rows = {name: n + k for k, name in enumerate(equations.responses)}
    for load in lateral_loads(vehicle.file):
        coefficients = numbers.tables.under(f"loads.{load.output}.")
        # a couple makes no shear but by the vehicle's answer to it, wherever it acts
        where = "couple_aft" if load.is_shear and form == "couple_forward" else form
        angles = aerodynamic_angle(numbers, motion), motion.beta
        value = noise_load(loading, where, coefficients, numbers.tables, numbers.area, *angles)
        column[rows[load.output]] = value
    for moment, radius in numbers.radii.items():
        for side, sign in SIDES.items():
            column[rows[load_name(moment, side)]] = sign * 2 / radius * column[rows[moment]]
    return column


def _refusal(vehicle: Vehicle, name: str, why: str) -> DataError:
    biases = vehicle_biases(vehicle.file)
    column = f"biases.{biases[name].key}" if name in biases else f"noise.{name}.tables"
    return DataError(why, file=vehicle.folder / "vehicle.toml", column=column)
