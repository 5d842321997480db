"""What a sensitivity says of tables: over flight time, as wholes, and by kilometres of wind."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...model.equations.vehicle_tables import MET_ALTITUDE
from ...model.tables import TableGroup
from ...model.vehicle.grouped_factors import grouped_factors
from ...model.vehicle.vehicle import Vehicle
from ..present.netcdf import RULE
from ..solvers.collocation_grid import tables_at
from .gradient import Gradient
from .pair import AdjointPair
from .start import StartShare

if TYPE_CHECKING:
    from ..case.case import Case

BAND = 1000.0  # m, of altitude
WIND_MEAN = "wind.mean"
WIND_OUTPUT = "wind_filter.H_"  # tables that a relative change of the wind's sigma multiplies
Parts = tuple[dict, dict]  # variables and coordinates of a dataset


@dataclass(frozen=True, eq=False)
class TotalDensity:
    """Derivatives by table values in which the argument of a group carries what it does through that group.

    Attributes
    ----------
    along : (k, n_v) array
        At the nodes, per second.
    at_end : (n_v,) array
        Weight of the delta at t2.
    """

    along: NDArray[np.float64]
    at_end: NDArray[np.float64]


def table_sensitivities(
    case: Case,
    pair: AdjointPair,
    total: TotalDensity,
    start: StartShare | None,
    value: float | None,
) -> Parts:
    """Return the derivatives by tables over time, by whole tables and by kilometres of wind.

    Parameters
    ----------
    total : TotalDensity
    start : StartShare or None
        What goes through the covariance at the start.
    value : float or None
        Of the quantity; None leaves elasticities out.
    """
    groups = case.with_means.groups
    names = [n for g in groups for n in g.names]
    units = [u for g in groups for u in g.units]
    columns = [names.index(n) for g in groups if g.kind == "given" for n in g.names]
    values, values_at_end, weights = pair.tables, pair.tables_at_end, pair.weights
    per_second = {RULE: "quantity table^-1 s^-1", "long_name": "derivative with respect to the table's value at a time"}
    variables: dict[str, tuple] = {
        "table_value": (("table", "t"), values[:, columns].T, {RULE: "table", "long_name": "value at a time"}),
        "table_derivative": (("table", "t"), total.along[:, columns].T, per_second),
        "table_derivative_at_end": (
            "table",
            total.at_end[columns],
            {RULE: "quantity table^-1", "long_name": "weight of the delta at t2"},
        ),
        "node_weight": ("t", weights, {"units": "s", "long_name": "quadrature weight of a time"}),
    }
    coordinates: dict[str, object] = {
        "table": [names[c] for c in columns],
        "table_unit": ("table", [units[c] for c in columns]),
        "t": ("t", pair.times, {"units": "s", "long_name": "flight time"}),
    }
    over = next((g.argument for g in groups if g.argument != "time"), None)
    if over is not None:
        attributes = {"units": units[names.index(over)], "long_name": f"{over} at a time"}
        variables[over] = ("t", values[:, names.index(over)], attributes)
    by_factor = weights @ (total.along * values) + total.at_end * values_at_end
    through = np.zeros(len(names)) if start is None else _through_start(case, start, names)
    by_factor = by_factor + through
    if case.vehicle is not None:
        more = _by_grouped_factor(case.vehicle, names, by_factor, value)
        variables, coordinates = variables | more[0], coordinates | more[1]
    if value is None:
        return variables, coordinates
    relative, through = by_factor / value, through / value
    if start is not None:
        label = {"units": "1", "long_name": "part of it by the covariance at the start"}
        variables["table_elasticity_through_start"] = ("table", through[columns], label)
    label = {"units": "1", "long_name": "percent per percent of the whole table, others held"}
    variables["table_elasticity"] = ("table", relative[columns], label)
    if over is not None:
        more = _by_kilometre(pair, total, names, names.index(over), value)
        variables, coordinates = variables | more[0], coordinates | more[1]
    return variables, coordinates


def _by_grouped_factor(vehicle: Vehicle, names: list[str], by_factor: NDArray, value: float | None) -> Parts:
    """Return the derivatives by factors on several tables together, at a factor of 1."""
    groups = grouped_factors(vehicle.tables)
    found = np.array([sum(by_factor[names.index(name)] for name in tables) for tables in groups.values()])
    label = {RULE: "quantity", "long_name": "derivative with respect to a factor on several tables"}
    variables: dict[str, tuple] = {"grouped_factor_derivative": ("grouped_factor", found, label)}
    if value is not None:
        label = {"units": "1", "long_name": "percent per percent of several tables together"}
        variables["grouped_factor_elasticity"] = ("grouped_factor", found / value, label)
    of_group = ("grouped_factor", [", ".join(tables) for tables in groups.values()])
    return variables, {"grouped_factor": list(groups), "grouped_factor_tables": of_group}


def _by_kilometre(pair: AdjointPair, total: TotalDensity, names: list[str], over: int, value: float) -> Parts:
    """Return the elasticities to the wind's sigma and mean in each kilometre of altitude, column ``over``."""
    altitude, end = pair.tables[:, over], float(pair.tables_at_end[over])
    edges = BAND * np.arange(np.floor(altitude.min() / BAND), np.floor(altitude.max() / BAND) + 2)
    variables = {}
    for label, what, chosen in (
        ("wind_sigma_elasticity", "the wind's sigma", [n.startswith(WIND_OUTPUT) for n in names]),
        ("wind_mean_elasticity", "the mean wind", [n.startswith(WIND_MEAN) for n in names]),
    ):
        if any(chosen):
            share = pair.weights * np.sum(total.along[:, chosen] * pair.tables[:, chosen], axis=1) / value
            found = np.histogram(altitude, edges, weights=share)[0]
            at_end = total.at_end[chosen] @ pair.tables_at_end[chosen] / value
            found[min(int((end - edges[0]) / BAND), found.size - 1)] += at_end
            attributes = {"units": "1", "long_name": f"percent per percent of {what} in that kilometre"}
            variables[label] = ("band", found, attributes)
    middle = {"units": "m", "long_name": "middle of a kilometre of altitude"}
    return variables, {"band": ("band", edges[:-1] + BAND / 2, middle)} if variables else {}


def _through_start(case: Case, start: StartShare, names: list[str]) -> NDArray[np.float64]:
    """Return what a relative change of whole tables does through the covariance at the start."""
    groups, found = case.with_means.groups, np.zeros(len(names))
    for group in groups:
        if set(group.names) & set(start.by_table):
            values = dict(zip(group.names, group.evaluate(start.altitudes).T, strict=True))
            for name, weights in start.by_table.items():
                found[names.index(name)] = weights @ values[name]
    at = names.index(MET_ALTITUDE if MET_ALTITUDE in names else "altitude")
    found[at] = start.by_altitude * tables_at(groups, np.array([case.system.start]))[0, at]
    return found


def total_density(groups: tuple[TableGroup, ...], pair: AdjointPair, gradient: Gradient) -> TotalDensity:
    """Let the argument of a group (altitude) carry what it does through that group."""
    names = [n for g in groups for n in g.names]
    along, at_end = gradient.tables.copy(), gradient.tables_at_end.copy()
    first = 0
    for group in groups:
        last = first + len(group.names)
        if group.argument != "time":
            at = names.index(group.argument)
            for found, given, values in (
                (along, gradient.tables, pair.tables),
                (at_end[None], gradient.tables_at_end[None], pair.tables_at_end[None]),
            ):
                found[:, at] += np.einsum("kv,kv->k", given[:, first:last], _slopes(group, values[:, at]))
        first = last
    return TotalDensity(along, at_end)


def _slopes(group: TableGroup, argument: NDArray) -> NDArray[np.float64]:
    c = group.coefficients
    powers = np.stack([c[:, 1], 2 * c[:, 2], 3 * c[:, 3], np.zeros_like(c[:, 0])], axis=1)
    inside = (argument >= group.knots[0]) & (argument <= group.knots[-1])
    return replace(group, coefficients=powers).evaluate(argument) * inside[:, None]
