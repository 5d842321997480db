"""The response to gusts: the product of their wind with the weights, integrated piece by piece."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..case.times import end_times
from ..present.netcdf import RULE
from .clocking import Quantities, checked_direction, checked_quantities
from .shapes import Gust, GustError, checked_gust
from .weights import WindWeights, wind_weights

# s and points of the weights, at most, of a panel in which the product is integrated as a polynomial of degree 11
PANEL, POINTS = 0.05, 7
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


def gust_products(weights: WindWeights, climb: Climb, gust: Gust, starts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a gust that starts at each of several altitudes puts into the quantities of the weights.

    Parameters
    ----------
    weights : WindWeights
    climb : Climb
    gust : Gust
    starts : (p,) array
        m; not met before the weights begin.

    Returns
    -------
    (p, r) array
    """
    corners = climb.time_at(starts[:, None] + np.array(gust.corners))
    if gust.holds:
        corners = np.append(corners, np.full((starts.size, 1), weights.time), axis=1)
    cut = np.clip(corners[:, :, None], weights.edges[:-1], weights.edges[1:])
    begin, end = cut[:, :-1], cut[:, 1:]
    row, pair, piece = np.nonzero(end > begin)
    begin, span = begin[row, pair, piece], (end - begin)[row, pair, piece]
    # each of these, where wind and weights are smooth, is cut into panels
    panels = np.maximum(1, np.ceil(span / weights.panels(PANEL, POINTS)[piece] - 1e-9).astype(int))
    of = np.repeat(np.arange(row.size), panels)
    number = np.arange(of.size) - (np.cumsum(panels) - panels)[of]
    width, row = (span / panels)[of], row[of]
    times = (begin[of] + number * width)[:, None] + width[:, None] * (0.5 * (1 + NODES))
    wind = gust.at(climb.altitude(times) - starts[row, None]) * (0.5 * width[:, None] * WEIGHTS)
    found = np.zeros((starts.size, weights.direct.size))
    np.add.at(found, row, np.matmul(wind[:, None, :], weights.polynomial(times))[:, 0])
    now = gust.at(climb.altitude(weights.time) - starts)
    return found + now[:, None] * weights.direct


def check_length(climb: Climb, length: float) -> None:
    """Raise if a gust (m) is longer than the flight.

    Raises
    ------
    GustError
    """
    low, high = float(climb.altitudes[0]), float(climb.altitudes[-1])
    if length > high - low:
        raise GustError(
            f"a gust of {length:g} m is longer than the flight, which climbs from {low:.6g} to {high:.6g} m; make it "
            "shorter"
        )


def check_start(climb: Climb, start: float) -> None:
    """Raise if a gust starts (m) where the flight is not.

    Raises
    ------
    GustError
    """
    low, high = float(climb.altitudes[0]), float(climb.altitudes[-1])
    if isinstance(start, bool) or not isinstance(start, int | float) or abs(start) == np.inf or start != start:
        raise GustError(f"a gust cannot start at {start!r:.60} m; give an altitude, a number")
    if start < low:
        where = "below the ground" if start < 0 else "below the start of the flight"
        raise GustError(f"the gust starts at {start:g} m, {where}: flight begins at {low:.6g} m; let it start there")
    if start >= high:
        raise GustError(
            f"the gust starts at {start:g} m, above the end of the flight at {high:.6g} m, and is never met"
        )


def gust_response(
    case: Case,
    gust: Gust,
    start_altitude: float,
    times: Iterable[float],
    responses: Iterable[str] | None,
    direction: float | None = None,
) -> xr.Dataset:
    """See :meth:`Study.gust_response`."""
    climb = Climb.of(case)
    check_length(climb, checked_gust(gust).length)
    check_start(climb, start_altitude)
    ends, names = case.checked_times(end_times(times)), checked_quantities(case, responses)
    direction, quantities = checked_direction(case, direction), Quantities.of(case, names)
    met = float(climb.time_at(start_altitude))
    found = np.zeros((len(ends), len(names)))
    after = [k for k, time in enumerate(ends) if time > met]
    if after:
        weights = wind_weights(case, [ends[k] for k in after], quantities.outputs, ends[-1] - met)
        start = np.array([float(start_altitude)])
        products = np.array([gust_products(each, climb, gust, start)[0] for each in weights])
        found[after] = quantities.towards(products, direction)
    toward = {} if direction is None else {"direction_rad": direction}
    return xr.Dataset(
        {
            "response_to_gust": (
                ("time", "response"),
                found,
                {RULE: "response", "long_name": "response to the gust alone"},
            )
        },
        {
            "time": ("time", ends, {"units": "s", "long_name": "flight time"}),
            "response": names,
            "unit": ("response", list(quantities.units)),
        },
        provenance(case) | described(gust) | {"start_altitude_m": float(start_altitude)} | toward,
    )


def described(gust: Gust) -> dict[str, object]:
    """Return a gust in words and numbers, for the attributes of a result."""
    found: dict[str, object] = {"gust": gust.name, "amplitude_m_s": gust.amplitude, "length_m": gust.length}
    edge = getattr(gust, "edge", None)
    return found if edge is None else found | {"edge_m": edge}
