"""Limits of several responses and of the structure at its stations, against whole flights, jointly."""

from __future__ import annotations

import warnings
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DataErrorCollector, suggestion
from ..case.case import Case
from ..solvers.markov_chain import MarkovChain
from ..station_loads.loads_along_vehicle import LOADS, SAME_STATION, load_rows, vehicle_stations
from ..statistics.percentiles import Sides, checked_probabilities, checked_sides
from .limit_table import LimitError, Limits, limit_table
from .passage import LimitedLoad, Passage
from .process import ManyOutputs
from .request import UncheckedStationsWarning, checked_draws, refuse_without_variance
from .window import checked_window, window_chain

STEPS = 2400  # of the window; AS-504 in 60 s: 0.025 s

Rows = tuple[list[LimitedLoad], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


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
    rows_of = _output_row if table.station is None else _station_rows
    loads, rows, means, given = zip(*(rows_of(case, table, states, name) for name in table.values), strict=True)
    process = ManyOutputs(states, np.concatenate(rows, axis=1), np.concatenate(means, axis=1))
    refuse_without_variance(" and ".join(table.values), process)
    limit = np.concatenate(given, axis=1)
    return Passage(case, tuple(chain.from_iterable(loads)), process, limit, chosen, design, draws, seed)


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
    known = list(case.system.output_names) if table.station is None else list(LOADS)
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
                _inside(case, table, name)
    collector.raise_all()
    if table.station is None:
        case.checked_responses(table.values)
    return table


def _inside(case: Case, table: Limits, name: str) -> NDArray[np.bool_]:
    """Return which of the vehicle's stations lie within those of the table."""
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
    return inside


def _unit(case: Case, table: Limits, name: str) -> str:
    return LOADS[name] if table.station is not None else case.system.outputs[case.system.output_index(name)].unit


def _output_row(case: Case, table: Limits, states: MarkovChain, name: str) -> Rows:
    """Return a response: what it is, its row (m, 1, n), its mean and its limit (m, 1)."""
    which, unit = case.system.output_index(name), _unit(case, table, name)
    limit = table.of(name, unit, states.times)
    return [LimitedLoad(name, unit)], states.output[:, [which]], states.mean[:, [which]], limit


def _station_rows(case: Case, table: Limits, states: MarkovChain, name: str) -> Rows:
    """Return a load at the vehicle's stations within those of the table: rows (m, s, n), means and limits (m, s)."""
    found = load_rows(case, states.times.tolist(), load=name)
    limit, stations = table.of(name, LOADS[name], states.times), table.station
    assert stations is not None
    inside = _inside(case, table, name)
    if not inside.all():
        text = (
            f"the limit of {name.replace('_', ' ')} is given from station {stations[0]:g} to {stations[-1]:g} m: "
            f"{int((~inside).sum())} of the vehicle's {inside.size} stations lie outside and are not looked at"
        )
        warnings.warn(UncheckedStationsWarning(text), stacklevel=4)
    at = np.flatnonzero(inside)
    mean = np.einsum("msn,mn->ms", found.state[:, at], case.mean_states(states.times)) + found.direct_mean[:, at]
    own = np.stack([np.interp(found.station[at], stations, row) for row in limit])
    loads = [LimitedLoad(name, LOADS[name], float(s)) for s in found.station[at]]
    return loads, found.state[:, at], mean, own
