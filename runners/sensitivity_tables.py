"""What a sensitivity says of tables: over flight time, as wholes, and by kilometres of wind."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..model.tables import TableGroup
from .collocation_grid import tables_at
from .sensitivity_gradient import AdjointPair, Gradient
from .start_covariance import StartShare

if TYPE_CHECKING:
    from .study import Study

BAND = 1000.0  # m, of altitude
WIND_MEAN = "wind.mean"
WIND_OUTPUT = "wind_filter.H_"  # tables that a relative change of the wind's sigma multiplies


def tables_dataset(
    study: Study,
    pair: AdjointPair,
    gradient: Gradient,
    density: NDArray,
    at_end: NDArray,
    start: StartShare | None,
    value: float,
    elasticity: bool,
) -> xr.Dataset:
    """Return the derivatives by tables over time, by whole tables and by kilometres of wind.

    Parameters
    ----------
    density : (k, n_v) array
        Derivative with respect to the table values at the nodes, per second, by :func:`total_density`.
    at_end : (n_v,) array
        Weight of its delta at t2.
    start : StartShare or None
        What goes through the covariance at the start.
    value : float
        Of the quantity.
    elasticity : bool
    """
    groups = study.with_means.groups
    names = [n for g in groups for n in g.names]
    units = [u for g in groups for u in g.units]
    columns = [names.index(n) for g in groups if g.name != "mean" for n in g.names]
    values, values_at_end = pair.tables, pair.tables_at_end
    dataset = xr.Dataset(
        {
            "table_value": (("table", "t"), values[:, columns].T),
            "table_derivative": (("table", "t"), density[:, columns].T),
            "table_derivative_at_end": ("table", at_end[columns]),
            "node_weight": ("t", gradient.weights, {"units": "s", "long_name": "quadrature weight of a time"}),
        },
        {
            "table": [names[c] for c in columns],
            "table_unit": ("table", [units[c] for c in columns]),
            "t": ("t", gradient.times, {"units": "s", "long_name": "flight time"}),
        },
    )
    dataset["table_derivative"].attrs = {
        "long_name": "derivative with respect to the table's value at a time, response unit per table unit and second"
    }
    dataset["table_derivative_at_end"].attrs = {"long_name": "weight of the delta at t2, response unit per table unit"}
    if elasticity:
        relative = (gradient.weights @ (density * values) + at_end * values_at_end) / value
        if start is not None:
            through = _through_start(study, start, names) / value
            relative = relative + through
            dataset["table_elasticity_through_start"] = ("table", through[columns], {"units": "1"})
            dataset["table_elasticity_through_start"].attrs["long_name"] = "part of it by the covariance at the start"
        dataset["table_elasticity"] = ("table", relative[columns], {"units": "1"})
        dataset["table_elasticity"].attrs["long_name"] = "percent per percent of the whole table, others held"
    over = next((g.argument for g in groups if g.argument != "time"), None)
    if over is not None:
        at = values[:, names.index(over)]
        dataset[over] = ("t", at, {"units": units[names.index(over)], "long_name": f"{over} at a time"})
        if elasticity:
            relative, last = gradient.weights[:, None] * density * values / value, at_end * values_at_end / value
            for label, what, chosen in (
                ("wind_sigma_elasticity", "the wind's sigma", [n for n in names if n.startswith(WIND_OUTPUT)]),
                ("wind_mean_elasticity", "the mean wind", [n for n in names if n == WIND_MEAN]),
            ):
                if chosen:
                    rows = [names.index(n) for n in chosen]
                    end = (float(values_at_end[names.index(over)]), float(last[rows].sum()))
                    dataset = dataset.merge(_bands(label, what, at, relative[:, rows].sum(axis=1), *end))
    return dataset


def _through_start(study: Study, start: StartShare, names: list[str]) -> NDArray[np.float64]:
    """Return what a relative change of whole tables does through the covariance at the start."""
    groups, found = study.with_means.groups, np.zeros(len(names))
    for group in groups:
        if set(group.names) & set(start.by_table):
            values = dict(zip(group.names, group.evaluate(start.altitudes).T, strict=True))
            for name, weights in start.by_table.items():
                found[names.index(name)] = weights @ values[name]
    at = names.index("altitude")
    found[at] = start.by_altitude * tables_at(groups, np.array([study.system.start]))[0, at]
    return found


def _bands(
    label: str, what: str, altitude: NDArray, share: NDArray, altitude_at_end: float, share_at_end: float
) -> xr.Dataset:
    """Return the elasticity to a quantity over altitude in each kilometre."""
    edges = BAND * np.arange(np.floor(altitude.min() / BAND), np.floor(altitude.max() / BAND) + 2)
    found = np.histogram(altitude, edges, weights=share)[0]
    found[min(int((altitude_at_end - edges[0]) / BAND), found.size - 1)] += share_at_end
    return xr.Dataset(
        {label: ("band", found, {"units": "1", "long_name": f"percent per percent of {what} in that kilometre"})},
        {"band": ("band", edges[:-1] + BAND / 2, {"units": "m", "long_name": "middle of a kilometre of altitude"})},
    )


def total_density(groups: tuple[TableGroup, ...], values: NDArray, density: NDArray) -> NDArray[np.float64]:
    """Return densities in which the argument of a group (altitude) carries what it does through that group."""
    names = [n for g in groups for n in g.names]
    total = density.copy()
    first = 0
    for group in groups:
        if group.argument != "time":
            at = names.index(group.argument)
            slope = _slopes(group, values[:, at])
            total[:, at] += np.sum(density[:, first : first + len(group.names)] * slope, axis=1)
        first += len(group.names)
    return total


def _slopes(group: TableGroup, argument: NDArray) -> NDArray[np.float64]:
    c = group.coefficients
    powers = np.stack([c[:, 1], 2 * c[:, 2], 3 * c[:, 3], np.zeros_like(c[:, 0])], axis=1)
    inside = (argument >= group.knots[0]) & (argument <= group.knots[-1])
    return replace(group, coefficients=powers).evaluate(argument) * inside[:, None]
