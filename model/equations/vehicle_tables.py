"""The tables of a vehicle in groups: over flight time, over altitude, and the mean response."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..errors import UnknownNameError
from ..tables import MeanKind, TableGroup
from ..vehicle.mean_wind import PROGRAMME
from ..vehicle.planes import flown_planes
from ..vehicle.vehicle import Vehicle

# tables of the mean response in a plane, all in rad, and the output or state that each holds
MEAN_TABLES: dict[str, tuple[MeanKind, str]] = {
    "mean.angle_of_attack": ("output", "angle_of_attack"),
    "mean.engine_angle": ("output", "engine_angle"),
    "mean.attitude": ("state", "attitude"),
}
LEAST_KNOTS = 4  # of a piece
MET_ALTITUDE = "met_altitude"  # of the foremost gust zone; its rate is another table
# of the tables of the mean response, s: after a start or a jump the mean rings as fast as networks and bending do, and
# what the tables miss there no engine can see, because all read the same
MEAN_SPACINGS = ((1.0, 0.004), (3.0, 0.008), (8.0, 0.0125), (float("inf"), 0.025))  # until so long after it


def vehicle_tables(vehicle: Vehicle) -> tuple[TableGroup, ...]:
    """Return the table groups of a vehicle: over time, over altitude, and the mean response (zero until computed)."""
    polynomials = [(t.name, t.unit, t.polynomial) for t in vehicle.tables.values()]
    polynomials.append(("altitude_rate", "m/s", vehicle.tables["altitude"].polynomial.derivative()))
    if PROGRAMME in vehicle.tables:
        polynomials.append((f"{PROGRAMME}_rate", "rad/s", vehicle.tables[PROGRAMME].polynomial.derivative()))
    met = met_altitude_name(vehicle)
    if vehicle.zones is not None:
        polynomials.append((met, "m", vehicle.met_altitude))
        polynomials.append((f"{met}_rate", "m/s", vehicle.met_altitude.derivative()))
    flight = TableGroup.from_polynomials("flight", "time", polynomials, vehicle.start, vehicle.end)
    wind = vehicle.wind.shaping_filter
    own = [*vehicle.wind.means, *wind.tables()]
    if vehicle.turbulence is not None:
        own.append(vehicle.turbulence.intensity)
    over_altitude = [(t.name, t.unit, t.polynomial) for t in own]
    bottom, top = min(float(t.argument[0]) for t in own), max(float(t.argument[-1]) for t in own)
    wind_group = TableGroup.from_polynomials("wind", met, over_altitude, bottom, top)
    knots = mean_knots(vehicle.start, vehicle.end, vehicle.discontinuities)
    names = tuple(f"{plane.scope}{name}" for plane in flown_planes(vehicle) for name in MEAN_TABLES)
    zero = np.zeros((knots.size - 1, 4, len(names)))
    sources = tuple(mean_source(name) for name in names)
    mean_group = TableGroup("mean", "time", names, ("rad",) * len(names), knots, zero, "mean", sources)
    return flight, wind_group, mean_group


def mean_source(table: str) -> tuple[MeanKind, str]:
    """Return whether a table of the mean response holds an 'output' or a 'state', and which."""
    for name, (kind, what) in MEAN_TABLES.items():
        if table == name or table.endswith(f".{name}"):
            return kind, f"{table.removesuffix(name).removesuffix('.')}_{what}".removeprefix("_")
    raise UnknownNameError("table of the mean", table, MEAN_TABLES)


def met_altitude_name(vehicle: Vehicle) -> str:
    """Return the table whose value is the altitude of the wind that is met."""
    return "altitude" if vehicle.zones is None else MET_ALTITUDE


def mean_knots(start: float, end: float, discontinuities: Sequence[float]) -> np.ndarray:
    """Return the times (s) at which the mean response is tabulated, discontinuities among them."""
    pieces = []
    for low, high in pairwise([start, *discontinuities, end]):
        begin = low
        for until, spacing in MEAN_SPACINGS:
            end_of_piece = min(low + until, high)
            if end_of_piece > begin:
                count = max(LEAST_KNOTS, int(np.ceil((end_of_piece - begin) / spacing - 1e-9)))
                pieces.append(np.linspace(begin, end_of_piece, count + 1)[:-1])
                begin = end_of_piece
    return np.append(np.concatenate(pieces), end)
