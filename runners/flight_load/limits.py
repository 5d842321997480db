"""Limits of several responses and of the structure at its stations, against whole flights, jointly."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataErrorCollector, suggestion
from ...model.vehicle.loads import BENDING_MOMENT, SHEAR_FORCE
from ...model.vehicle.planes import Plane, flown_planes
from ..case.case import Case
from ..solvers.markov_chain import MarkovChain
from ..station_loads.loads_along_vehicle import LOADS, SAME_STATION, load_rows, vehicle_stations
from ..statistics.percentiles import Sides, checked_probabilities, checked_sides
from ..statistics.resultants import resultant_name, resultant_pairs
from .limit_table import LimitError, Limits, limit_table
from .norms import Norms
from .passage import LimitedLoad, Passage
from .process import ManyOutputs
from .request import UncheckedStationsWarning, checked_draws, refuse_without_variance
from .response import STEPS, ResponseInWindow
from .window import checked_window, window_chain


@dataclass(frozen=True, eq=False)
class LimitedRows:
    """Loads of one column of limits in terms of the states.

    Attributes
    ----------
    loads : list of LimitedLoad
        s of them.
    row : (m, s, p, n) array
        p is one for a response and two for a resultant.
    mean : (m, s, p) array
    limit : (m, s) array
    """

    loads: list[LimitedLoad]
    row: NDArray[np.float64]
    mean: NDArray[np.float64]
    limit: NDArray[np.float64]

    def flat(self, parts: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return rows (m, s * parts, n) and means (m, s * parts); a response beside resultants is one with nothing."""
        m, s, p, n = self.row.shape
        row, mean = np.zeros((m, s, parts, n)), np.zeros((m, s, parts))
        row[:, :, :p], mean[:, :, :p] = self.row, self.mean
        return row.reshape(m, s * parts, n), mean.reshape(m, s * parts)


def limit_passage(
    case: Case,
    limits: str | Path | Limits,
    window: tuple[float, float] | None,
    probability: float,
    sides: Sides,
    draws: int,
    seed: int,
) -> Passage:
    """See :meth:`Study.limit_passage`."""
    checked_draws(draws, seed)
    (design,) = checked_probabilities(probability)
    chosen, flown = checked_sides(sides), checked_window(case, window)
    table = checked_limits(case, limits, flown)
    states = window_chain(case, flown, STEPS)
    rows_of = _response_rows if table.station is None else _station_rows
    found = [rows_of(case, table, states, name) for name in table.values]
    parts = max(each.row.shape[2] for each in found)
    rows, means = (np.concatenate(arrays, axis=1) for arrays in zip(*(f.flat(parts) for f in found), strict=True))
    if parts == 2 and chosen != "both":
        raise LimitError(f"limits a resultant, which has no {chosen} side; ask for both sides", file=table.file)
    process = Norms.many(states, rows, means) if parts == 2 else ManyOutputs(states, rows, means)
    refuse_without_variance(" and ".join(table.values), process)
    limit = np.concatenate([each.limit for each in found], axis=1)
    loads = tuple(chain.from_iterable(each.loads for each in found))
    return Passage(case, loads, process, limit, chosen, design, draws, seed)


def checked_limits(case: Case, limits: str | Path | Limits, window: tuple[float, float]) -> Limits:
    """Return limits that a case can be held against over a window.

    Parameters
    ----------
    case : Case
    limits : path or Limits
    window : (float, float)
        s.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError
    """
    table = limit_table(limits)
    pairs = resultant_pairs(case.system.output_names)
    known = [*case.system.output_names, *pairs] if table.station is None else _loads_along(case)
    what = "response" if table.station is None else "load along the vehicle"
    collector = DataErrorCollector()
    for name in table.values:
        if name not in known:
            why = f"there is no such {what}{suggestion(name, known)}"
            collector.errors.append(LimitError(why, file=table.file, column=name))
            continue
        with collector.part():
            table.of(name, _unit(case, table, name), np.array(window))
            if table.station is not None:
                stations_inside(case, table, name)
    collector.raise_all()
    if table.station is None:
        case.checked_responses([output for name in table.values for output in pairs.get(name, (name,))])
    return table


def _planes(case: Case) -> tuple[Plane | None, ...]:
    """Return both planes of a vehicle that flies in both, of any other none in particular."""
    planes = flown_planes(case.vehicle_for("a load along the vehicle"))
    return (None,) if len(planes) == 1 else planes


def _loads_along(case: Case) -> list[str]:
    """Return the loads along a vehicle that can be limited: of both planes those across the axis, as resultants."""
    return list(LOADS) if len(_planes(case)) == 1 else [BENDING_MOMENT, SHEAR_FORCE]


def stations_inside(case: Case, table: Limits, name: str, warn: bool = False) -> NDArray[np.bool_]:
    """Return which of the vehicle's stations lie within those of the table; warn where some do not.

    Raises
    ------
    LimitError
        None does.
    """
    found, stations = vehicle_stations(case, name), table.station
    assert stations is not None
    inside = (found >= stations[0] - SAME_STATION) & (found <= stations[-1] + SAME_STATION)
    if not inside.any():
        raise LimitError(
            f"ends at stations {stations[0]:g} and {stations[-1]:g} m, between which the vehicle has no station; its "
            f"stations go from {found[0]:g} to {found[-1]:g} m",
            file=table.file,
            column="station",
        )
    if warn and not inside.all():
        text = (
            f"the limit of {name.replace('_', ' ')} is given from station {stations[0]:g} to {stations[-1]:g} m: "
            f"{int((~inside).sum())} of the vehicle's {inside.size} stations lie outside and are not looked at"
        )
        warnings.warn(UncheckedStationsWarning(text), stacklevel=5)
    return inside


def _unit(case: Case, table: Limits, name: str) -> str:
    return LOADS[name] if table.station is not None else ResponseInWindow(case, name, (0.0, 0.0), 0).unit


def _response_rows(case: Case, table: Limits, states: MarkovChain, name: str) -> LimitedRows:
    """Return a response, or the resultant of two, with its limit."""
    of = ResponseInWindow(case, name, (0.0, 0.0), 0)
    row, mean = states.output[:, None, of.rows], states.mean[:, None, of.rows]
    limit = table.of(name, of.unit, states.times)
    return LimitedRows([LimitedLoad(name, of.unit, resultant=of.is_resultant)], row, mean, limit)


def _station_rows(case: Case, table: Limits, states: MarkovChain, name: str) -> LimitedRows:
    """Return a load at the vehicle's stations within those of the table; of two planes its resultant."""
    planes = _planes(case)
    found = [load_rows(case, states.times.tolist(), load=name, plane=plane) for plane in planes]
    limit, stations = table.of(name, LOADS[name], states.times), table.station
    assert stations is not None
    inside = stations_inside(case, table, name, warn=True)
    at, means = np.flatnonzero(inside), case.mean_states(states.times)
    row = np.stack([plane.state[:, at] for plane in found], axis=2)
    mean = np.einsum("mspn,mn->msp", row, means) + np.stack([plane.direct_mean[:, at] for plane in found], axis=2)
    station, resultant = found[0].station[at], len(planes) == 2
    own = np.stack([np.interp(station, stations, values) for values in limit])
    called = resultant_name(name) if resultant else name
    loads = [LimitedLoad(called, LOADS[name], float(s), resultant) for s in station]
    return LimitedRows(loads, row, mean, own)
