"""Where coefficients of a system change in far less time than the flight takes: smooth pulses, which steps pass over.

Nothing in an integrator's step tells of a pulse between the times at which it looks. Bounds of the coefficients by
interval arithmetic do: where they allow for more than the values at hand show, or these values bend, a piece of flight
is halved, until every piece shows what it may hold. The ends of pieces narrow against most of the flight are where
integrators begin anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from .interval_arithmetic import bounds
from .time_conditions import Stops

PIECES = 16  # of the flight, looked at first
NARROW = 1 / 200  # of the flight, a piece whose ends are kept
NARROW_AMONG = 1 / 8  # of the median piece, the same: coefficients that oscillate all the flight hold no pulse
NARROWEST = 1e-9  # of the flight, a piece that is not halved
MOST_PIECES = 20_000  # looked at in all
MOST_FOUND = 5_000
SHOWN = 2.0  # times the spread of the values at hand, which bounds may exceed these by
BENT = 0.3  # times the same spread, the distance of the middle value from the straight line
LITTLE = 0.05  # of the largest value at hand, which either may be more
NEGLIGIBLE = 1e-9  # of the largest value on the flight, the same

Coefficients = ca.Function  # (t, p) -> values, and their derivatives with respect to time


def coefficients(matrices: Sequence[ca.SX], time: ca.SX, p: ca.SX, tables: ca.SX) -> Coefficients | None:
    """Return the entries of matrices that depend on time and on no table; None where there are none.

    A table is as smooth as its rows, and integrators stop at those of it that jump.
    """
    entries = [e for matrix in matrices for e in cast("list[ca.SX]", matrix.nonzeros())]
    varying = [e for e in entries if ca.depends_on(e, time) and not ca.depends_on(e, tables)]
    if not varying:
        return None
    values = ca.vertcat(*varying)
    rates = ca.densify(ca.jacobian(values, time))
    return ca.Function("coefficients", [time, p], [values, rates], {"allow_free": False})


def pulse_marks(
    function: Coefficients, parameters: NDArray[np.float64], stops: Stops, start: float, end: float
) -> NDArray[np.float64]:
    """Return the ends of the narrow pieces of flight that coefficients with pulses ask for, (k,), s, increasing.

    None where they ask for more pieces than a search is worth: coefficients that oscillate all the flight.
    """
    span = end - start
    low, high = _first_pieces(stops, start, end)
    looked, most_pieces = 0, MOST_PIECES + 4 * low.size
    largest = np.zeros((function.numel_out(0), 1))
    found: list[NDArray[np.float64]] = []
    with np.errstate(all="ignore"):
        while low.size:
            looked += low.size
            if looked > most_pieces:
                return np.zeros(0)
            values, within = _values(function, parameters, low, high), _bounds(function, parameters, low, high)
            size = np.abs(values).max(axis=0)
            largest = np.fmax(largest, size.max(axis=1, keepdims=True))
            least, most = values.min(axis=0), values.max(axis=0)
            little, spread = LITTLE * size + NEGLIGIBLE * largest, most - least
            hidden = np.maximum(within[1] - most, least - within[0]) > SHOWN * spread + little
            bent = np.abs(values[1] - 0.5 * (values[0] + values[2])) > BENT * spread + little
            halved = (hidden | bent).any(axis=0) & (high - low > NARROWEST * span)
            found.append(np.stack([low[~halved], high[~halved]]))
            low, high = low[halved], high[halved]
            middle = 0.5 * (low + high)
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    pieces = np.concatenate(found, axis=1)
    widths = pieces[1] - pieces[0]
    order = np.argsort(widths)
    median = widths[order][np.searchsorted(np.cumsum(widths[order]), 0.5 * span)]
    marks = np.unique(pieces[:, widths < min(NARROW * span, NARROW_AMONG * median)])
    return marks[(marks > start) & (marks < end)] if marks.size <= MOST_FOUND else np.zeros(0)


def _first_pieces(stops: Stops, start: float, end: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where pieces begin and end, none of which holds a switch."""
    inside, first, last = stops.between(start, end)
    stretches = zip([first, *stops.after[inside]], [*stops.before[inside], last], strict=True)
    edges = [np.linspace(a, b, 1 + max(1, int(np.ceil(PIECES * (b - a) / (end - start))))) for a, b in stretches]
    return np.concatenate([e[:-1] for e in edges]), np.concatenate([e[1:] for e in edges])


def _values(function: Coefficients, p: NDArray, low: NDArray, high: NDArray) -> NDArray[np.float64]:
    """Return values at both ends and in the middle of pieces, (3, entries, pieces)."""
    times = np.concatenate([low, 0.5 * (low + high), high])
    values = function(times[None], np.tile(p[:, None], times.size))[0].full()
    return np.moveaxis(values.reshape(values.shape[0], 3, low.size), 1, 0)


def _bounds(
    function: Coefficients, p: NDArray, low: NDArray, high: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bounds of the values over pieces, (entries, pieces): their own, or by the mean value theorem if closer."""
    fixed = [(np.full(low.size, value), np.full(low.size, value)) for value in p]
    own, rates = (np.array(of) for of in bounds(function, [[(low, high)], fixed]))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    at_middle = function(middle[None], np.tile(p[:, None], low.size))[0].full()
    reach = np.abs(rates).max(axis=1) * half
    return np.fmax(own[:, 0], at_middle - reach), np.fmin(own[:, 1], at_middle + reach)
