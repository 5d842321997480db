"""What limits are of, as rows of the states: responses, resultants of both planes, and loads at stations.

A row is one response, or a load at one station in one plane. A limit is of one row, or of the norm of two.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from ...model.vehicle.planes import flown_planes
from ..case.case import Case
from ..flight_load.limit_table import LimitError, Limits
from ..flight_load.limits import checked_limits, stations_inside
from ..flight_load.norms import Norms
from ..flight_load.passage import LimitedLoad
from ..flight_load.process import Grid, JointOutputs, signed_diffusion
from ..solvers.markov_chain import MarkovChain
from ..station_loads.loads_along_vehicle import LOADS, load_rows, vehicle_stations
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import Sides
from ..statistics.resultants import resultant_name, resultant_pairs
from .level_weights import LevelWeights, level_weights, weights_of_rows

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """A response, or a load at one station in one plane.

    Attributes
    ----------
    label : str
        A name of its own, such as 'yaw_bending_moment_at_25m'.
    unit : str
    output : int or None
        Number of the response.
    load, plane : str
        Of a load along the vehicle; no plane where there is one.
    station : float
        m.
    """

    label: str
    unit: str
    output: int | None = None
    load: str = ""
    plane: str = ""
    station: float = float("nan")


@dataclass(frozen=True)
class Limit:
    """A limit of one row, or of the norm of two.

    Attributes
    ----------
    load : LimitedLoad
    column : str
        Of the table of limits.
    rows : tuple of int
    """

    load: LimitedLoad
    column: str
    rows: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class LimitedLoads:
    """Rows, and limits of some of them.

    Attributes
    ----------
    case : Case
    rows : tuple of Row
        R of them.
    limits : tuple of Limit
        q of them.
    table : Limits or None
        Where they are from.
    """

    case: Case
    rows: tuple[Row, ...]
    limits: tuple[Limit, ...]
    table: Limits | None

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the rows."""
        return tuple(row.label for row in self.rows)

    def over(self, chain: MarkovChain, case: Case | None = None) -> tuple[Array, Array | None, Array]:
        """Return rows over the states of a chain (m, R, n), direct ones of known inputs, and means (m, R).

        Parameters
        ----------
        chain : MarkovChain
        case : Case, optional
            Whose chain it is, where its tables differ.

        Returns
        -------
        state : (m, R, n) array
        direct : (m, R, n_u) array or None
            None where all rows are responses.
        mean : (m, R) array
        """
        case = case or self.case
        outputs = [row.output for row in self.rows if row.output is not None]
        if len(outputs) == len(self.rows):
            return chain.output[:, outputs], None, chain.mean[:, outputs]
        m, n, R = chain.times.size, chain.output.shape[2], len(self.rows)
        state, mean = np.empty((m, R, n)), np.empty((m, R))
        direct = np.zeros((m, R, len(case.system.input_names)))
        states = case.mean_states(chain.times)
        planes = {plane.name: plane for plane in flown_planes(case.vehicle_for("a load along the vehicle"))}
        for load, plane in dict.fromkeys((row.load, row.plane) for row in self.rows):
            at = [k for k, row in enumerate(self.rows) if (row.load, row.plane) == (load, plane)]
            if not load:
                raise LimitError("responses and loads along the vehicle are asked for apart")
            found = load_rows(
                case, chain.times.tolist(), [self.rows[k].station for k in at], load=load,
                plane=planes[plane] if plane else None,
            )  # fmt: skip
            state[:, at], direct[:, at] = found.state, found.direct
            mean[:, at] = np.einsum("msn,mn->ms", found.state, states) + found.direct_mean
        return state, direct, mean

    def values(self, times: Array) -> Array:
        """Return the limits at times (s), (m, q)."""
        found = np.empty((times.size, len(self.limits)))
        for k, limit in enumerate(self.limits):
            assert self.table is not None
            whole = self.table.of(limit.column, limit.load.unit, times)
            stations = self.table.station
            found[:, k] = (
                whole[:, 0] if stations is None else [np.interp(limit.load.station, stations, row) for row in whole]
            )
        return found

    def chances(self, mean: Array, covariance: Array, values: Array, sides: Sides) -> Array:
        """Return the chance of being beyond each limit at each instant, (m, q).

        Parameters
        ----------
        mean : (m, R) array
        covariance : (m, R, R) array
        values : (m, q) array
            Of the limits.
        sides : {'both', 'upper', 'lower'}
        """
        found = np.zeros(values.shape)
        for k, limit in enumerate(self.limits):
            rows = list(limit.rows)
            if len(rows) == 2:
                law = NormOfNormal(mean[:, rows], symmetric(covariance[:, rows][:, :, rows]))
                found[:, k] = law.exceedance(values[:, k])
                continue
            std = np.sqrt(np.maximum(covariance[:, rows[0], rows[0]], 0.0))
            unit, own = np.where(std > 0, std, 1e-300), mean[:, rows[0]]
            if sides != "lower":
                found[:, k] += ndtr((own - values[:, k]) / unit)
            if sides != "upper":
                found[:, k] += ndtr(-(values[:, k] + own) / unit)
        return found

    def beyond(self, values: Array, paths: Array, sides: Sides) -> NDArray[np.bool_]:
        """Return which paths (count, m, R) are beyond any limit (m, q) at any time, (count,)."""
        found = np.zeros(len(paths), bool)
        for k, limit in enumerate(self.limits):
            if len(limit.rows) == 2:
                size = np.hypot(*(paths[:, :, row] for row in limit.rows))
            else:
                own = paths[:, :, limit.rows[0]]
                size = {"both": np.abs(own), "upper": own, "lower": -own}[sides]
            found |= (size > values[:, k]).any(axis=1)
        return found

    def only(self, limits: Sequence[int]) -> tuple[LimitedLoads, list[int]]:
        """Return some of the limits with their rows, and the numbers of these rows."""
        kept = [self.limits[k] for k in limits]
        rows = list(dict.fromkeys(row for limit in kept for row in limit.rows))
        moved = tuple(Limit(x.load, x.column, tuple(rows.index(row) for row in x.rows)) for x in kept)
        return LimitedLoads(self.case, tuple(self.rows[row] for row in rows), moved, self.table), rows

    def process(self, times: Array, mean: Array, covariance: Array, direct: Array) -> JointOutputs | Norms:
        """Return what is limited as a process.

        Parameters
        ----------
        times : (m,) array
            s.
        mean : (m, R) array
        covariance : (m, R, m, R) array
        direct : (m, R, noises) array
            What white noise does to the rows directly.
        """
        if not any(len(limit.rows) == 2 for limit in self.limits):
            rows = [limit.rows[0] for limit in self.limits]
            grid = Grid(times, mean[:, rows], signed_diffusion(direct[:, rows]))
            return JointOutputs(grid, covariance[:, rows][:, :, :, rows])
        # a response beside resultants is one with nothing
        m, R = mean.shape
        flat = [row for limit in self.limits for row in (*limit.rows, R)[:2]]
        means, noise = np.zeros((m, R + 1)), np.zeros((m, R + 1, direct.shape[2]))
        means[:, :R], noise[:, :R] = mean, direct
        whole = np.zeros((m, R + 1, m, R + 1))
        whole[:, :R, :, :R] = covariance
        pairs = noise[:, flat].reshape(m, len(self.limits), 2, -1)
        grid = Grid(times, means[:, flat], np.sqrt((noise[:, flat] ** 2).sum(axis=2)))
        return Norms(JointOutputs(grid, whole[:, flat][:, :, :, flat]), pairs @ pairs.swapaxes(2, 3))


def symmetric(covariance: Array) -> Array:
    """Return covariances (..., k, k) without what rounding makes of their symmetry."""
    return 0.5 * (covariance + covariance.swapaxes(-1, -2))


def limited_loads(
    case: Case,
    limits: str | Path | Limits | None,
    responses: Iterable[str] | None,
    window: tuple[float, float],
    sides: Sides,
) -> LimitedLoads:
    """Return responses that are asked for, and limits with what they are of.

    Without ``responses`` those with a limit, or all where there is no limit.

    Raises
    ------
    DataError, LimitError, UnknownNameError, TimeRangeError
    """
    table = None if limits is None else checked_limits(case, limits, window)
    rows, found = [], []
    if table is None or table.station is None or responses is not None:
        names = [] if table is not None and responses is None else case.checked_responses(responses)
        rows = [_response(case, name) for name in names]
    if table is not None and table.station is not None:
        if responses is not None:
            raise LimitError(
                "is over stations of the structure; leave responses out, or ask for them without it", file=table.file
            )
        rows, found = _along_stations(case, table)
    elif table is not None:
        pairs = resultant_pairs(case.system.output_names)
        for name in table.values:
            both = pairs.get(name)
            parts = [_response(case, part) for part in both or (name,)]
            for part in parts:
                if part not in rows:
                    rows.append(part)
            unit = parts[0].unit
            load = LimitedLoad(name, unit, resultant=both is not None)
            found.append(Limit(load, name, tuple(rows.index(part) for part in parts)))
    if sides != "both" and any(len(limit.rows) == 2 for limit in found):
        raise LimitError(f"limits a resultant, which has no {sides} side; ask for both sides")
    return LimitedLoads(case, tuple(rows), tuple(found), table)


def _response(case: Case, name: str) -> Row:
    output = case.system.output_index(name)
    return Row(name, case.system.outputs[output].unit, output)


def _along_stations(case: Case, table: Limits) -> tuple[list[Row], list[Limit]]:
    planes = flown_planes(case.vehicle_for("a load along the vehicle"))
    names = [""] if len(planes) == 1 else [plane.name for plane in planes]
    rows, found = [], []
    for load in table.values:
        inside = stations_inside(case, table, load, warn=True)
        for station in vehicle_stations(case, load)[inside].tolist():
            unit, first = LOADS[load], len(rows)
            for plane in names:
                label = f"{plane}_{load}" if plane else load
                rows.append(Row(f"{label}_at_{station:.6g}m", unit, None, load, plane, station))
            both = len(names) == 2
            limited = LimitedLoad(resultant_name(load) if both else load, unit, station, resultant=both)
            found.append(Limit(limited, load, tuple(range(first, len(rows)))))
    return rows, found


def kept_rows(case: Case, loads: LimitedLoads, chain: MarkovChain) -> tuple[Array, Array | None, Array]:
    """Return :meth:`LimitedLoads.over` of a chain of the case, kept with it by times: loads along a vehicle are dear.

    Parameters
    ----------
    case : Case
    loads : LimitedLoads
    chain : MarkovChain
    """
    return case.kept(("rows of loads", loads.rows, chain.times.tobytes()), lambda: loads.over(chain, case))


def row_weights(case: Case, loads: LimitedLoads, chain: MarkovChain, levels: Array) -> LevelWeights:
    """Return the weights of the wind at levels (m) in rows at the times of a chain, kept with the case by those times.

    Parameters
    ----------
    case : Case
    loads : LimitedLoads
    chain : MarkovChain
    levels : (k,) array
    """
    times = chain.times.tolist()
    outputs = [row.label for row in loads.rows if row.output is not None]
    if len(outputs) == len(loads.rows):
        return level_weights(case, times, levels, outputs)
    state, direct, _ = kept_rows(case, loads, chain)
    assert direct is not None
    return weights_of_rows(case, times, levels, state, direct)
