"""From densities over time to the rows of a vehicle's tables: each row's basis function, integrated.

Cubic, linear and step tables are linear in their rows, so that the basis function of a row is the interpolation of a
unit vector; monotone cubics (pchip) are not, and are differentiated by central differences of their interpolation.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ..model.tables import Table
from ..model.vehicle import Vehicle
from .sensitivity_gradient import AdjointPair, Gradient

if TYPE_CHECKING:
    from .study import Study

PCHIP_STEP = 1e-5  # of a table's largest value


def vehicle_rows(vehicle: Vehicle) -> dict[str, Table]:
    """Return the tables of a vehicle with rows of their own: over time, of the mean wind and of its filter."""
    wind = vehicle.wind
    return {t.name: t for t in (*vehicle.tables.values(), wind.mean, *wind.shaping_filter.tables())}


def knot_sensitivities(study: Study, pair: AdjointPair, gradient: Gradient) -> xr.Dataset | None:
    """Return the derivative with respect to every row of every table of a vehicle; None without a vehicle.

    A row of the altitude moves the rate of climb and, through the wind's tables, the wind that is met; the wind
    filter's covariance at the start is held.
    """
    from .sensitivity import total_density

    if study.vehicle is None:
        return None
    groups = study.with_means.groups
    group_of = {name: group for group in groups for name in group.names}
    names = list(group_of)
    density = total_density(groups, pair.tables, gradient.tables)
    at_end = total_density(groups, pair.tables_at_end[None], gradient.tables_at_end[None])[0]
    known: dict[tuple, NDArray] = {}
    of, argument, values, derivative = [], [], [], []
    for table in vehicle_rows(study.vehicle).values():
        group, column = group_of[table.name], names.index(table.name)
        if group.argument == "time":
            points = np.append(gradient.times, pair.end)
        else:
            at = names.index(group.argument)
            points = np.append(pair.tables[:, at], pair.tables_at_end[at])
        points = np.clip(points, group.knots[0], group.knots[-1])
        basis = _cached_basis(table, points, 0, known)
        found = (gradient.weights * density[:, column]) @ basis[:-1] + at_end[column] * basis[-1]
        if table.name == "altitude":
            rate, slope = names.index("altitude_rate"), _cached_basis(table, points, 1, known)
            found = found + (gradient.weights * density[:, rate]) @ slope[:-1] + at_end[rate] * slope[-1]
        of += [table.name] * found.size
        argument.append(table.argument)
        values.append(table.values)
        derivative.append(found)
    dataset = xr.Dataset(
        {
            "knot_value": ("knot", np.concatenate(values)),
            "knot_derivative": ("knot", np.concatenate(derivative)),
        },
        {
            "knot_table": ("knot", of),
            "knot_argument": ("knot", np.concatenate(argument), {"long_name": "s, or m for the wind's tables"}),
        },
    )
    dataset["knot_derivative"].attrs = {"long_name": "derivative with respect to one row, response unit per table unit"}
    return dataset


def _cached_basis(table: Table, points: NDArray, order: int, known: dict[tuple, NDArray]) -> NDArray[np.float64]:
    shape = (table.argument.tobytes(), table.interpolation, table.breaks, order, points.tobytes())
    if table.interpolation == "pchip":
        shape += (table.values.tobytes(),)
    if shape not in known:
        known[shape] = row_basis(table, points, order)
    return known[shape]


def row_basis(table: Table, points: NDArray, order: int = 0) -> NDArray[np.float64]:
    """Return the derivative of a table's value (or its slope, ``order`` 1) at points by its rows, (k, rows)."""
    if table.interpolation != "cubic":
        return _differences(table, points, order)
    x, found = table.argument, np.zeros((points.size, table.argument.size))
    edges = [x[0], *(b for b in sorted(set(table.breaks)) if x[0] < b < x[-1]), x[-1]]
    for k, (low, high) in enumerate(pairwise(edges)):
        inside = (x >= low) & (x <= high)
        at = ((points >= low) | (k == 0)) & ((points < high) | (k == len(edges) - 2))
        if inside.sum() > 2:
            spline = CubicSpline(x[inside], np.eye(inside.sum()), bc_type="not-a-knot")
            found[np.ix_(at, inside)] = spline(points[at], order)
        else:
            found[np.ix_(at, inside)] = _differences(
                Table(table.name, table.unit, x[inside], table.values[inside], "linear"), points[at], order
            )
    return found


def _differences(table: Table, points: NDArray, order: int) -> NDArray[np.float64]:
    step = PCHIP_STEP * max(1e-300, float(np.abs(table.values).max()))
    columns = []
    for row in np.eye(table.argument.size):
        up, down = (
            replace(table, values=table.values + sign * step * row).polynomial(points, order) for sign in (1, -1)
        )
        columns.append((up - down) / (2 * step))
    return np.stack(columns, axis=1)
