"""From the names of a plan to the numbers of a study: parameters, and factors on whole tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...model.errors import DataError, ParameterValueError, suggestion
from ...model.tables import TableGroup
from ...model.vehicle.grouped_factors import grouped_factors
from ..sensitivity.request import is_structure
from ..study import Study
from .plan import ParameterStudyPlan, PlannedQuantity

TABLES = "tables."
# last word of the names of tables that a vehicle's files may not hold negative, the first also not zero
POSITIVE = ("mass", "moment_of_inertia", "relative_velocity", "frequency", "generalized_mass")
NOT_NEGATIVE = ("dynamic_pressure", "thrust", "control_thrust")


@dataclass(frozen=True)
class Quantity:
    """A number that a parameter study varies.

    Attributes
    ----------
    name, unit : str
        The unit is '1' for a factor.
    targets : tuple of str
        Parameters, and tables as 'tables.NAME', that take its value.
    relative : bool
        Whether the value multiplies the nominal ones.
    nominal : float
        Its value in the unchanged study.
    """

    name: str
    unit: str
    targets: tuple[str, ...]
    relative: bool
    nominal: float


def table_names(groups: Sequence[TableGroup]) -> list[str]:
    """Return the tables that a factor may multiply, as 'tables.NAME'."""
    return [TABLES + name for group in groups if group.kind == "given" for name in group.names]


def resolve_quantities(study: Study, plan: ParameterStudyPlan) -> tuple[Quantity, ...]:
    """Look up the quantities of a plan.

    Raises
    ------
    DataError
        Unknown names with the nearest one, structure, a target named twice, a nominal value that is zero or not common.
    """
    taken: dict[str, str] = {}
    found = []
    for i, planned in enumerate(plan.quantities):
        where = f"{plan.kind}.quantity.{i}"
        targets = tuple(one for target in planned.targets for one in _members(study, target))
        for target in targets:
            _check_target(study, target, where)
            if target in taken:
                raise DataError(
                    f"'{target}' already belongs to quantity '{taken[target]}'; a number has one value", column=where
                )
            taken[target] = planned.name
        found.append(_resolve(study, planned, targets, where))
    return tuple(found)


def _grouped(study: Study) -> dict[str, tuple[str, ...]]:
    """Return by name of a grouped factor the targets that it stands for."""
    groups = {} if study.vehicle is None else grouped_factors(study.vehicle.tables)
    return {name: tuple(TABLES + table for table in tables) for name, tables in groups.items()}


def _members(study: Study, target: str) -> tuple[str, ...]:
    return _grouped(study).get(target, (target,))


def _check_target(study: Study, name: str, where: str) -> None:
    tables = table_names(study.executable.groups)
    known = [*study.system.parameter_names, *tables, *_grouped(study)]
    if name in known:
        return
    if TABLES + name in tables:
        raise DataError(f"'{name}' is a table; write '{TABLES}{name}' for a factor on the whole of it", column=where)
    if is_structure(study, name):
        raise DataError(
            f"'{name}' is structure, not a number: another value makes other equations; edit the vehicle file and "
            "make a study of each vehicle",
            column=where,
        )
    raise DataError(f"there is no parameter or table '{name}'{suggestion(name, known)}", column=where)


def _resolve(study: Study, planned: PlannedQuantity, targets: tuple[str, ...], where: str) -> Quantity:
    parameters = study.parameters
    values = {t: 1.0 if t not in parameters else parameters[t].value for t in targets}
    if planned.relative:
        zero = next((t for t, value in values.items() if value == 0), None)
        if zero is not None:
            raise DataError(
                f"'{zero}' is zero, so that a factor on it changes nothing; give absolute numbers, without relative",
                column=where,
            )
        return Quantity(planned.name, "1", targets, True, 1.0)
    if len(set(values.values())) > 1:
        listed = ", ".join(f"{t} = {value:g}" for t, value in values.items())
        raise DataError(f"has parameters of different nominal value ({listed}); set relative = true", column=where)
    first = targets[0]
    unit = parameters[first].unit if first in parameters else "1"
    return Quantity(planned.name, unit, targets, False, values[first])


def member_numbers(study: Study, quantities: Sequence[Quantity], row: NDArray[np.float64]) -> ExecutableSystem:
    """Return the system of a study with the numbers of one member.

    Parameters
    ----------
    row : (quantities,) array

    Raises
    ------
    ParameterValueError
        A value that the equations cannot use.
    """
    parameters = study.parameters
    changes: dict[str, float] = {}
    factors: dict[str, float] = {}
    for quantity, value in zip(quantities, row.tolist(), strict=True):
        for target in quantity.targets:
            if target in parameters:
                changes[target] = value * parameters[target].value if quantity.relative else value
            else:
                factors[target.removeprefix(TABLES)] = _checked_factor(target, value)
    groups = tuple(group.scaled(factors) for group in study.executable.groups)
    return study.executable.with_numbers(groups=groups, parameters=study.numbers(changes))


def _checked_factor(table: str, factor: float) -> float:
    """Refuse a factor that makes of a table what its file may not hold."""
    last = table.rpartition(".")[2]
    if (last in POSITIVE and factor <= 0) or (last in NOT_NEGATIVE and factor < 0):
        raise ParameterValueError(f"a factor of {factor:g} on '{table}' leaves it no sense; give a positive one")
    return factor
