"""Sensitivities against central differences of CVODES: nothing of the gradient's computation is shared.

Differences are taken at three steps and extrapolated (Ridders 1982); the spread of the extrapolations is their
uncertainty, which the integrator's tolerance, divided by the step, keeps from vanishing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr

from ...codegen.system.executable import ExecutableSystem
from ...model.equations.vehicle_tables import vehicle_tables
from ...model.errors import ParameterValueError, PlanesError
from ...model.system.names import COMBINED, WIND
from ...model.system.time_tables import group_over_time
from ...model.tables import Table
from ...model.vehicle.vehicle import Vehicle
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.two_components import TwoComponentWind
from ..case.wind_start import covariance_at
from ..present.progress import each
from ..solvers.adjoint import AdjointSolver
from ..solvers.integration import CvodesSettings
from ..solvers.mean_response import mean_response, with_mean_tables
from .gradient import gradient_of
from .knots import table_rows, vehicle_rows
from .one import sensitivity
from .request import Request

if TYPE_CHECKING:
    from ..case.case import Case

TOLERANCE = 1e-12
STEP = 0.02  # largest change, relative to the value
LEVELS = 3
AGREEMENT = 1e-5


@dataclass(frozen=True)
class Difference:
    """A derivative by differences and how far it can be trusted."""

    derivative: float
    uncertainty: float


def central_difference(f: Callable[[float], float], at: float, step: float, levels: int = LEVELS) -> Difference:
    """Differentiate by central differences at steps halved ``levels`` - 1 times, extrapolated to zero (Ridders).

    Parameters
    ----------
    f : callable
    at, step : float
        The largest change is ``step``.
    levels : int
        At least two.
    """
    table: list[list[float]] = []
    best = Difference(np.nan, np.inf)
    for k in range(levels):
        h = step / 2**k
        row = [(f(at + h) - f(at - h)) / (2 * h)]
        for j in range(1, k + 1):
            row.append(row[j - 1] + (row[j - 1] - table[k - 1][j - 1]) / (4**j - 1))
            spread = max(abs(row[j] - row[j - 1]), abs(row[j] - table[k - 1][j - 1]))
            if spread <= best.uncertainty:
                best = Difference(row[j], spread)
        table.append(row)
    return best


def _difference(f: Callable[[float], float], at: float, step: float, value: float) -> Difference:
    """Differentiate by central differences; no surer than the tolerance lets the smallest of them be."""
    found = central_difference(f, at, step)
    return replace(found, uncertainty=max(found.uncertainty, TOLERANCE * abs(value) / (step / 2 ** (LEVELS - 1))))


def check_sensitivity(
    case: Case,
    response: str,
    time: float | Literal["peak"],
    source: str = COMBINED,
    quantity: str = "std",
    parameters: Iterable[str] | None = None,
    rows: int = 0,
) -> xr.Dataset:
    """See :meth:`Study.check_sensitivity`."""
    if rows < 0:
        raise ParameterValueError(f"{rows} rows cannot be checked; give 0 or more")
    request = Request.of(case, response, source, quantity)
    found = sensitivity(case, response, time, source, quantity, parameters, elasticity=False)
    time = float(found.attrs["t2_s"])
    value, executable = float(found.attrs["value"]), case.executable
    meeting: Mapping[int, float] = {}
    if case.system.conditions:  # switches that meet within the differences would spoil them
        pair = request.pair(case, time)
        meeting = {i: far for i, far in gradient_of(pair, *request.factors(pair)).reach.items() if far > 0}
    labels, at, derivatives, differences = [], [], [], []
    named = zip(
        found["parameter"].values.tolist(), found["parameter_value"].values, found["derivative"].values, strict=True
    )
    for name, number, derivative in each(list(named), "parameters by differences"):

        def of_parameter(x: float, i: int = case.system.parameter_names.index(name)) -> float:
            changed = executable.parameters.copy()
            changed[i] = x
            return _value(executable.with_numbers(parameters=changed), request, time)

        labels.append(name)
        at.append(number)
        derivatives.append(derivative)
        reach = 0.5 * meeting.get(case.system.parameter_names.index(name), np.inf)
        differences.append(_difference(of_parameter, number, min(reach, STEP * (abs(number) or 1.0)), value))
    for name, tables, derivative in each(_grouped_factors(found, parameters), "tables by differences"):

        def of_factor(x: float, tables: list[str] = tables) -> float:
            groups = tuple(group.scaled(dict.fromkeys(tables, x)) for group in executable.groups)
            return _value(executable.with_numbers(groups=groups), request, time)

        labels.append(name)
        at.append(1.0)
        derivatives.append(derivative)
        differences.append(_difference(of_factor, 1.0, STEP, value))
    for k in each(_largest_rows(found, rows), "rows by differences"):
        name, number = str(found["knot_table"].values[k]), float(found["knot_value"].values[k])
        row = int(np.sum(found["knot_table"].values[:k] == name))

        def of_row(x: float, name: str = name, row: int = row) -> float:
            if case.vehicle is None:
                return _value(_of_rows(executable, name, row, x), request, time)
            return _value(of_vehicle(executable, _with_row(case.vehicle, name, row, x)), request, time)

        labels.append(f"{name} at {found['knot_argument'].values[k]:g}")
        at.append(number)
        derivatives.append(float(found["knot_derivative"].values[k]))
        differences.append(_difference(of_row, number, STEP * _reach(case, name, row), value))
    return _agreement(labels, np.array(at), np.array(derivatives), differences, value, found.attrs)


def of_vehicle(executable: ExecutableSystem, vehicle: Vehicle) -> ExecutableSystem:
    """Return the same code with the tables of a changed vehicle and its wind's covariance at the start."""
    system = executable.system
    covariance = covariance_at(vehicle.wind.shaping_filter, vehicle.start_altitude)
    wind, rows = np.zeros((len(system.states),) * 2), system.block(WIND)
    wind[rows, rows] = covariance
    changed = replace(system, start_covariance={**system.start_covariance, WIND: wind})
    return replace(executable, system=changed, groups=vehicle_tables(vehicle))


def _of_rows(executable: ExecutableSystem, name: str, row: int, value: float) -> ExecutableSystem:
    """Return the same code with another value in a row of a system's own tables."""

    def changed(table: Table) -> Table:
        values = table.values.copy()
        values[row] = value
        return replace(table, values=values)

    rows = [changed(table) if table.name == name else table for table in executable.system.rows]
    groups = tuple(
        group_over_time(group.name, rows, float(group.knots[0]), float(group.knots[-1]))[0]
        if name in group.names
        else group
        for group in executable.groups
    )
    return executable.with_numbers(groups=groups)


def _value(executable: ExecutableSystem, request: Request, time: float) -> float:
    filled = with_mean_tables(executable, partial(mean_response, relative_tolerance=TOLERANCE))
    run = AdjointSolver(filled, CvodesSettings(relative_tolerance=TOLERANCE)).run(time)
    columns = [executable.system.sources.index(s) for s in request.sources]
    return request.value(float(run.variance[request.row, columns].sum()), float(run.mean[request.row]))


def _largest_rows(found: xr.Dataset, count: int) -> list[int]:
    """Return the rows with the largest elasticities, at most one a table."""
    if not count or "knot_derivative" not in found:
        return []
    size = np.abs(found["knot_derivative"].values * found["knot_value"].values)
    chosen: dict[str, int] = {}
    for k in np.argsort(-size):
        chosen.setdefault(str(found["knot_table"].values[k]), int(k))
        if len(chosen) == count:
            break
    return list(chosen.values())


def _grouped_factors(found: xr.Dataset, parameters: Iterable[str] | None) -> list[tuple[str, list[str], float]]:
    """Return name, tables and derivative of each grouped factor, none where parameters are named."""
    if parameters is not None or "grouped_factor" not in found:
        return []
    parts = (found[f"grouped_factor{part}"].values.tolist() for part in ("", "_tables", "_derivative"))
    return [(name, tables.split(", "), derivative) for name, tables, derivative in zip(*parts, strict=True)]


def _reach(case: Case, name: str, row: int) -> float:
    """Return by how much a row may move: its own size, or for a vehicle's altitude, which must increase, its rise."""
    values = table_rows(case)[name].values
    rises = case.vehicle is not None and name == "altitude"
    return abs(float(np.diff(values)[max(row - 1, 0)] if rises else values[row]))


def _with_row(vehicle: Vehicle, name: str, row: int, value: float) -> Vehicle:
    table = vehicle_rows(vehicle)[name]
    values = table.values.copy()
    values[row] = value
    changed = replace(table, values=values)
    if name in vehicle.tables:
        return replace(vehicle, tables=vehicle.tables | {name: changed})
    if isinstance(vehicle.wind, TwoComponentWind):
        return replace(vehicle, wind=_with_component(vehicle.wind, changed))
    if name == "wind.mean":
        return replace(vehicle, wind=replace(vehicle.wind, mean=changed))
    return replace(vehicle, wind=replace(vehicle.wind, shaping_filter=_with_entry(vehicle, changed.name, values)))


def _with_component(wind: TwoComponentWind, changed: Table) -> TwoComponentWind:
    """Return a wind with another mean of one component."""
    for component, part in wind.components.items():
        if part.mean.name == changed.name:
            return replace(wind, **{component: replace(part, mean=changed)})
    raise PlanesError(f"a difference by a row of '{changed.name}'", "the vehicle")


def _with_entry(vehicle: Vehicle, name: str, values: np.ndarray) -> ShapingFilter:
    old = vehicle.wind.shaping_filter
    label, i, j = next(e for e, t in zip(old.entries, old.tables(), strict=True) if t.name == name)
    matrices = {"F": old.F.copy(), "G": old.G.copy(), "H": old.H[:, None, :].copy()}
    matrices[label][:, i, j] = values
    return replace(old, F=matrices["F"], G=matrices["G"], H=matrices["H"][:, 0, :])


def _agreement(
    labels: list[str],
    at: np.ndarray,
    derivative: np.ndarray,
    differences: list[Difference],
    value: float,
    attributes: dict,
) -> xr.Dataset:
    by_differences = np.array([d.derivative for d in differences])
    uncertainty = np.array([d.uncertainty for d in differences])
    apart = np.abs(derivative - by_differences)
    agrees = apart <= AGREEMENT * np.abs(by_differences) + uncertainty
    return xr.Dataset(
        {
            "value": ("item", at),
            "derivative": ("item", derivative, {"long_name": "by the adjoint"}),
            "difference": ("item", by_differences, {"long_name": "by extrapolated central differences"}),
            "uncertainty": ("item", uncertainty, {"long_name": "of the difference"}),
            "apart": ("item", apart, {"long_name": "absolute disagreement"}),
            "agrees": ("item", agrees.astype(np.int8), {"long_name": f"within {AGREEMENT:g} and the uncertainty"}),
        },
        {"item": labels},
        attributes | {"quantity_value": value, "differences": f"CVODES at {TOLERANCE:g}"},
    )
