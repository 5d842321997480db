"""How deviating tables enter the equations: one column for each noise of a vehicle (4.1.5, 4.1.6)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..errors import DataError
from ..vehicle.noise_loads import CENTER_OF_PRESSURE, loading_noises
from ..vehicle.vehicle import Vehicle
from .motion import Motion
from .noise_loads import noise_load
from .vehicle_numbers import Numbers
from .vehicle_tables import MEAN_TABLES


@dataclass(frozen=True, eq=False)
class Undeviated:
    """The equations before noises: what they act on.

    Attributes
    ----------
    states, rates, outputs : SX columns
        The loads are the first outputs.
    angles : (2,) SX
        Angle of attack and engine angle in terms of the states.
    moved : SX
        How far the normal force moves with its centre (m).
    """

    states: ca.SX
    rates: ca.SX
    outputs: ca.SX
    angles: ca.SX
    moved: ca.SX


def deviated(vehicle: Vehicle, numbers: Numbers, motion: Motion, equations: Undeviated) -> tuple[ca.SX, ca.SX]:
    """Return rates and outputs with every noise added, alpha and beta in terms of the states.

    Raises
    ------
    DataError
        If a noise deviates a table that the mean response cannot carry.
    """
    rates, outputs, n = equations.rates, equations.outputs, equations.states.numel()
    for name, process in numbers.noises.items():
        column = deviation_column(vehicle, name, numbers, motion, equations)
        rates += column[:n] * process.deviation
        outputs += column[n:] * process.deviation
    angles = ca.vertcat(motion.alpha, motion.beta, equations.moved)
    rates, outputs = ca.substitute([rates, outputs], [angles], [ca.vertcat(equations.angles, 0)])
    return rates, outputs


def deviation_column(vehicle: Vehicle, name: str, numbers: Numbers, motion: Motion, equations: Undeviated) -> ca.SX:
    """Return d(rates, outputs)/d ln(factor on the tables of a noise) at the mean response, by CasADi's derivative."""
    tables, deviating = numbers.tables, vehicle.noise[name].tables
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
            column += ca.jtimes(both, equations.moved, symbol)
    if column.is_zero():
        raise _refusal(vehicle, name, f"deviations of {', '.join(deviating)} change nothing in the equations")
    at_mean = ca.vertcat(*(tables[n] for n in MEAN_TABLES), 0)
    column = ca.substitute(column, ca.vertcat(motion.alpha, motion.beta, motion.attitude, equations.moved), at_mean)
    if ca.depends_on(column, equations.states):
        raise _refusal(
            vehicle,
            name,
            f"deviations of {', '.join(deviating)} act on more than the mean angle of attack, engine angle and "
            "attitude; choose a table of forces or arms",
        )
    return column


def _direct(vehicle: Vehicle, name: str, numbers: Numbers, motion: Motion, equations: Undeviated) -> ca.SX:
    """Return what a noise puts into the loads by coefficients that follow its tables, zero in all other rows."""
    loading, form = loading_noises(vehicle.file).get(name, ()), vehicle.file.options.noise_loads
    n = equations.states.numel()
    column = ca.SX.zeros(n + equations.outputs.numel())
    for k, load in enumerate(vehicle.file.loads):
        coefficients = numbers.tables.under(f"loads.{load.output}.")
        column[n + k] = noise_load(loading, form, coefficients, numbers.tables, numbers.area, motion.alpha, motion.beta)
    return column


def _refusal(vehicle: Vehicle, name: str, why: str) -> DataError:
    return DataError(why, file=vehicle.folder / "vehicle.toml", column=f"noise.{name}.tables")
