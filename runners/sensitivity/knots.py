"""From densities over time to the rows of tables.

A table is a cubic in each interval between knots, so that all a row needs of a density are its moments in the
intervals, the integrals of the density times 1, u, u^2, u^3 with u from the left knot. The cubics of a unit vector
give the row's share. Monotone cubics (pchip) are not linear in their rows; theirs are central differences of the
interpolation alone.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse import csc_array

from ...model.equations.vehicle_tables import MET_ALTITUDE
from ...model.tables import ORDER, Table, TableGroup
from ...model.vehicle.vehicle import Vehicle
from ...model.vehicle.zones import AHEAD
from ..present.netcdf import RULE
from .pair import AdjointPair
from .start import StartShare
from .tables import Parts, TotalDensity

if TYPE_CHECKING:
    from ..case.case import Case

RATES = {"altitude_rate": "altitude", f"{MET_ALTITUDE}_rate": MET_ALTITUDE}
PCHIP_STEP = 1e-5  # of a table's largest value


def vehicle_rows(vehicle: Vehicle) -> dict[str, Table]:
    """Return the tables of a vehicle with rows of their own: over time, of the mean wind and of its filter."""
    wind = vehicle.wind
    return {t.name: t for t in (*vehicle.tables.values(), *wind.means, *wind.shaping_filter.tables())}


def table_rows(case: Case) -> dict[str, Table]:
    """Return the tables of a case with rows of their own: a vehicle's, or those that a system was given."""
    return {t.name: t for t in case.system.rows} if case.vehicle is None else vehicle_rows(case.vehicle)


def knot_sensitivities(
    case: Case, pair: AdjointPair, total: TotalDensity, start: StartShare | None, value: float | None
) -> Parts:
    """Return the derivative with respect to every row of every table; nothing where none has rows.

    A row of the altitude moves the rate of climb and, through the wind's tables, the wind that is met.

    Parameters
    ----------
    total : TotalDensity
    start : StartShare or None
        What goes through the covariance at the start.
    value : float or None
        Of the quantity; None leaves elasticities out.
    """
    groups, rows = case.with_means.groups, table_rows(case)
    if not rows:
        return {}, {}
    names = [name for group in groups for name in group.names]
    moments: dict[str, NDArray] = {}
    first = 0
    for group in groups:
        last = first + len(group.names)
        if rows.keys() & set(group.names):
            if group.argument == "time":
                points = np.append(pair.times, pair.end)
            else:
                at = names.index(group.argument)
                points = np.append(pair.tables[:, at], pair.tables_at_end[at])
            inside, at_end = pair.weights[:, None] * total.along[:, first:last], total.at_end[None, first:last]
            found = interval_moments(group, points, np.concatenate([inside, at_end]))
            moments |= dict(zip(group.names, np.moveaxis(found, 2, 0), strict=True))
        first = last
    if start is not None:
        _add_start(groups, start, case.system.start, moments)
    if case.vehicle is not None:
        for name, of in RATES.items():  # the slope of an altitude: c1 + 2 c2 u + 3 c3 u^2
            if name in moments:
                moments[of] = moments[of].copy()
                moments[of][:, 1:] += np.arange(1, ORDER) * moments[name][:, :-1]
        if MET_ALTITUDE in moments:  # the sum of both
            for name in ("altitude", AHEAD):
                moments[name] = moments[name] + moments[MET_ALTITUDE]
    knots_of = {name: group.knots for group in groups for name in group.names}
    alike: dict[tuple, list[str]] = {}
    for name, table in rows.items():
        alike.setdefault(_shape(table, knots_of[name]), []).append(name)
    by_table: dict[str, NDArray] = {}
    for shape, of in alike.items():
        flat = np.stack([moments[name].ravel() for name in of])
        by_table |= dict(zip(of, flat @ _row_cubics(*shape), strict=True))
    values = np.concatenate([table.values for table in rows.values()])
    derivatives = np.concatenate([by_table[name] for name in rows])
    explained = {RULE: "quantity knot^-1", "long_name": "derivative with respect to one row"}
    of_value = {RULE: "knot", "long_name": "value of a row"}
    variables = {"knot_value": ("knot", values, of_value), "knot_derivative": ("knot", derivatives, explained)}
    if value is not None:
        relative = {"units": "1", "long_name": "percent per percent of the knot's value"}
        variables["knot_elasticity"] = ("knot", derivatives * values / value, relative)
    counts = [table.values.size for table in rows.values()]
    argument = {name: "s" if group.argument == "time" else "m" for group in groups for name in group.names}
    return variables, {
        "knot_table": ("knot", np.repeat(list(rows), counts)),
        "knot_unit": ("knot", np.repeat([table.unit for table in rows.values()], counts)),
        "knot_argument_unit": ("knot", np.repeat([argument[name] for name in rows], counts)),
        "knot_argument": (
            "knot",
            np.concatenate([table.argument for table in rows.values()]),
            {"long_name": "s, or m for the wind's tables"},
        ),
    }


def _add_start(groups: tuple[TableGroup, ...], start: StartShare, begin: float, moments: dict[str, NDArray]) -> None:
    group_of = {name: group for group in groups for name in group.names}
    of_filter = next(group_of[name] for name in start.by_table)
    found = interval_moments(of_filter, start.altitudes, np.stack(list(start.by_table.values()), axis=1))
    for name, part in zip(start.by_table, np.moveaxis(found, 2, 0), strict=True):
        moments[name] = moments[name] + part
    met = MET_ALTITUDE if MET_ALTITUDE in moments else "altitude"
    at_start = interval_moments(group_of[met], np.array([begin]), np.array([[start.by_altitude]]))[..., 0]
    moments[met] = moments[met] + at_start


def interval_moments(group: TableGroup, points: NDArray, weighted: NDArray) -> NDArray[np.float64]:
    """Return the sums of 1, u, u^2, u^3 times weights in every interval of a group.

    Parameters
    ----------
    points : (k,) array
        Arguments; beyond the first and last knot values are held.
    weighted : (k, m) array
        Weight of each table at each point.

    Returns
    -------
    (intervals, 4, m) array
    """
    x, count = np.clip(points, group.knots[0], group.knots[-1]), group.knots.size - 1
    interval = np.clip(np.searchsorted(group.knots, x, side="right") - 1, 0, count - 1)
    powers = (x - group.knots[interval])[:, None] ** np.arange(ORDER)
    rows = ORDER * interval[:, None] + np.arange(ORDER)
    columns = np.arange(0, powers.size + 1, ORDER)  # where each point's four entries begin
    sums = csc_array((powers.ravel(), rows.ravel(), columns), (ORDER * count, x.size)) @ weighted
    return sums.reshape(count, ORDER, -1)


def _shape(table: Table, knots: NDArray) -> tuple[bytes, bytes, str, tuple[float, ...], bytes]:
    """Return all that the cubics of a table's rows depend on; the same for many tables."""
    values = table.values.tobytes() if table.interpolation == "pchip" else b""
    return table.argument.tobytes(), values, table.interpolation, table.breaks, knots.tobytes()


@lru_cache(maxsize=64)
def _row_cubics(
    argument: bytes, values: bytes, interpolation: str, breaks: tuple[float, ...], knots: bytes
) -> NDArray[np.float64]:
    """Return the cubics of every row in the k intervals between knots, (4 k, rows), lowest power first."""
    x, ends = np.frombuffer(argument), np.frombuffer(knots)
    found = np.zeros((ends.size - 1, ORDER, x.size))
    middle = 0.5 * (ends[:-1] + ends[1:])
    edges = [x[0], *(b for b in sorted(set(breaks)) if x[0] < b < x[-1]), x[-1]]
    for low, high in [(x[0], x[-1])] if interpolation == "step" else pairwise(edges):
        inside = np.flatnonzero((x >= low) & (x <= high))
        at = np.flatnonzero((middle > low) & (middle < high))
        cubics = _unit_cubics(x[inside], np.frombuffer(values)[inside] if values else None, interpolation)
        piece = np.clip(np.searchsorted(x[inside], middle[at], side="right") - 1, 0, cubics.shape[1] - 1)
        c3, c2, c1, c0 = cubics[:, piece]
        u = (ends[at] - x[inside][piece])[:, None]
        shifted = (c0 + u * (c1 + u * (c2 + u * c3)), c1 + u * (2 * c2 + 3 * c3 * u), c2 + 3 * c3 * u, c3)
        for power, coefficient in enumerate(shifted):
            found[at[:, None], power, inside] = coefficient
    found[middle < x[0], 0, 0] = 1.0
    found[middle > x[-1], 0, -1] = 1.0
    return found.reshape(-1, x.size)


def _unit_cubics(x: NDArray, values: NDArray | None, interpolation: str) -> NDArray[np.float64]:
    """Return the cubics between the rows of one piece for each row, (4, rows - 1, rows), highest power first."""
    unit = np.eye(x.size)
    if interpolation == "step":
        return np.concatenate([np.zeros((ORDER - 1, x.size - 1, x.size)), unit[None, :-1]])
    if interpolation == "linear" or x.size == 2:
        slope = np.diff(unit, axis=0) / np.diff(x)[:, None]
        return np.concatenate([np.zeros((2, x.size - 1, x.size)), slope[None], unit[None, :-1]])
    if values is None:
        return CubicSpline(x, unit, bc_type="not-a-knot").c
    table = Table("row", "1", x, values, interpolation)
    step = PCHIP_STEP * max(1e-300, float(np.abs(values).max()))
    sides = [
        np.stack([replace(table, values=values + sign * step * row).polynomial.c for row in unit], axis=-1)
        for sign in (1, -1)
    ]
    return (sides[0] - sides[1]) / (2 * step)
