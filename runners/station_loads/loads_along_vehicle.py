"""Mean and spread of a load along the whole vehicle, from one run.

At a time the load of every station is linear in the same few quantities y: L = K y + c, c the axial force of the mean
flight. One run gives their means and, source by source, their covariances P; then E[L] = K E[y] + c and
Var[L] = diag(K P K').
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.system.evaluation import MatrixEvaluator
from ...model.equations.load_components import component_columns, deviation_output
from ...model.equations.loads import axial_force, axial_noise
from ...model.equations.noise_loads import noise_load
from ...model.equations.penetration import zone_coefficient
from ...model.equations.station_loads import KEYS, StationLoads, load_station_loads, station_table
from ...model.errors import DataError, IntegrationError, PlanesError, UnknownNameError
from ...model.system.names import COMBINED
from ...model.vehicle.columns import local_load_columns
from ...model.vehicle.loads import AXIAL_FORCE, BENDING_MOMENT, SHEAR_FORCE, SIDES
from ...model.vehicle.noise_loads import component_deviations, deviating_tables, loading_deviations
from ...model.vehicle.planes import Plane, flown_planes, one_wind
from ...model.vehicle.vehicle import Vehicle
from ...model.vehicle.zones import PREFIX as ZONES
from ..case.case import Case
from ..case.provenance import provenance
from ..present.progress import steps
from ..solvers.time_nodes import interval_before, time_nodes
from ..statistics.dataset import QUANTITIES
from ..statistics.engine import Engine
from ..statistics.engines import engine_with_covariances, response_statistics
from ..statistics.norm import LIKE_3_SIGMA, NormOfNormal
from ..statistics.percentiles import checked_probabilities
from ..statistics.results import ResponseStatistics

Array = NDArray[np.float64]

LOADS = {BENDING_MOMENT: "N m", SHEAR_FORCE: "N", AXIAL_FORCE: "N", **dict.fromkeys(SIDES, "N")}  # and their units
SAME_STATION = 1e-6  # m


@dataclass(frozen=True, eq=False)
class LoadRows:
    """A load at stations as rows of the Markov state: load = state x + direct_mean, which no white noise reaches.

    Attributes
    ----------
    time : (k,) array
        s.
    station, forward_of_gimbal : (s,) arrays
        Vehicle station and metres forward of the gimbal plane (m).
    state : (k, s, n) array
        C, over the states of the case's own system.
    direct_mean : (k, s) array
        What does not pass through the states: the mean wind without delay, and the axial force of the mean flight.
    direct : (k, s, n_u) array
        G, of the known inputs of the case's own system.
    unit : str
        Of the load.
    """

    time: Array
    station: Array
    forward_of_gimbal: Array
    state: Array
    direct_mean: Array
    direct: Array
    unit: str


def load_rows(
    case: Case,
    times: Iterable[float],
    stations: Iterable[float] | None = None,
    *,
    load: str = BENDING_MOMENT,
    slosh_reaction: bool = True,
    plane: Plane | None = None,
) -> LoadRows:
    """Return a load at stations in terms of the states at each time; from the left where flight jumps.

    Parameters
    ----------
    case : Case
        Of a vehicle with tables of the load along the vehicle.
    times : iterable of float
        Increasing, s.
    stations : iterable of float, optional
        Vehicle stations (m), each among those of the table; all of them without it.
    load : str
        One of ``LOADS``.
    slosh_reaction : bool
        As for :func:`loads_along_vehicle`.
    plane : Plane, optional
        Of a vehicle in both planes: which.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError, UnknownNameError
    """
    vehicle = case.vehicle_for(f"the {_words(load)} along the vehicle")
    if plane is None:
        one_wind(vehicle, "a load along the vehicle as rows of the states")
    view, prefix, scope = (vehicle, "", "") if plane is None else (plane.vehicle, plane.prefix, plane.scope)
    at = np.array(case.checked_times(times), float)
    along = _along(case, view, load, at, slosh_reaction, scope)
    chosen = np.arange(along.station.size) if stations is None else _chosen(along.station, stations, view, load)
    names = [prefix + name for name in _components(view)]
    components: Case = case.kept("load components", lambda: _with_components(case, vehicle))
    components.system.refuse_direct_noise(names)
    outputs = [components.system.output_index(name) for name in names]
    executable = components.executable.with_numbers(groups=case.with_means.groups)
    nodes = time_nodes(executable, at)
    sides = [interval_before(executable, float(node)) for node in nodes]
    evaluate = MatrixEvaluator(executable, ("C", "G", "inputs"))
    matrices = [evaluate(float(node), here.low, here.high) for node, here in zip(nodes, sides, strict=True)]
    state = np.array([C[outputs] for C, _, _ in matrices])
    direct = np.array([G[outputs] for _, G, _ in matrices])
    known = np.array([inputs[:, 0] for _, _, inputs in matrices])
    rows = along.rows[:, chosen]
    return LoadRows(
        at,
        along.station[chosen],
        along.forward_of_gimbal[chosen],
        np.einsum("tsc,tcn->tsn", rows, state),
        np.einsum("tsc,tcu,tu->ts", rows, direct, known) + along.constant[:, chosen],
        np.einsum("tsc,tcu->tsu", rows, direct),
        LOADS[load],
    )


def loads_along_vehicle(
    case: Case,
    times: Iterable[float],
    *,
    load: str = BENDING_MOMENT,
    slosh_reaction: bool = True,
    engine: str | Engine | None = None,
) -> xr.Dataset:
    """Return mean, variance, std and mean + 3 sigma of a load over (time, station, source).

    Parameters
    ----------
    case : Case
        Of a vehicle with tables of the load along the vehicle.
    times : iterable of float
        Flight times, s.
    load : str
        One of ``LOADS``; 'bending_moment' without it.
    slosh_reaction : bool
        Whether the whole vehicle answers slosh. Without, as the report has it, the moment does not vanish at the tail.
        Here it does not follow the vehicle's option, which is for its outputs.
    engine : Sweep, CovarianceEquation or their names, optional
        Those that give covariances; the sweep where something is compiled.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError, IntegrationError, UnknownNameError
    """
    (found,) = every_load_along_vehicle(case, times, [load], slosh_reaction=slosh_reaction, engine=engine)
    return found


def known_loads(vehicle: Vehicle) -> tuple[str, ...]:
    """Return those of ``LOADS`` whose tables along the vehicle it has."""
    have = {load for load, key in KEYS.items() if getattr(vehicle.file.tables, key) is not None}
    return tuple(load for load in LOADS if have.issuperset(_tables(load)))


def vehicle_stations(case: Case, load: str) -> Array:
    """Return the stations at which a load is known, m.

    Raises
    ------
    DataError, UnknownNameError
    """
    vehicle = case.vehicle_for(f"the {_words(load)} along the vehicle")
    return _tables_of(case, vehicle, load)[0].station


def every_load_along_vehicle(
    case: Case,
    times: Iterable[float],
    loads: Sequence[str],
    *,
    slosh_reaction: bool = True,
    engine: str | Engine | None = None,
) -> list[xr.Dataset]:
    """Return :func:`loads_along_vehicle` of several loads, from one run.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError, IntegrationError, UnknownNameError
    """
    vehicle = case.vehicle_for(f"the {' and the '.join(map(_words, loads))} along the vehicle")
    one_wind(vehicle, "a load along the vehicle")
    for load in loads:
        for table in _tables(load):
            station_table(vehicle, table)
    components = _with_components(case, vehicle)
    chosen = engine_with_covariances(case) if engine is None else engine
    found = response_statistics(components, times, responses=_components(vehicle), engine=chosen)
    if "covariance" not in found:
        raise IntegrationError(f"engine '{found.attrs['engine']}' gives no covariances; use sweep or covariance")
    return [_dataset(case, components, vehicle, load, found, slosh_reaction) for load in loads]


@steps("resultants along the vehicle")
def resultant_along_vehicle(
    case: Case,
    times: Iterable[float],
    *,
    load: str = BENDING_MOMENT,
    probability: float = LIKE_3_SIGMA,
    slosh_reaction: bool = True,
) -> xr.Dataset:
    """Return the resultant of a load of both planes at every station: means, covariance, level and direction.

    Parameters
    ----------
    case : Case
        Of a vehicle in both planes with tables of the load along the vehicle.
    times : iterable of float
        Flight times, s.
    load : {'bending_moment', 'shear_force'}
    probability : float
        With which the resultant exceeds its level at one instant.
    slosh_reaction : bool
        As for :func:`loads_along_vehicle`.

    Returns
    -------
    xarray.Dataset
        ``plane_mean`` (time, station, plane), ``plane_covariance`` (time, station, source, plane, other_plane), and
        from all sources ``level`` and ``direction`` (rad, from pitch towards yaw), both (time, station).

    Raises
    ------
    PlanesError
        The vehicle flies in one plane.
    DataError, TimeRangeError, DirectNoiseError, IntegrationError, UnknownNameError, ParameterValueError
    """
    vehicle = case.vehicle_for(f"the {_words(load)} along the vehicle")
    planes = flown_planes(vehicle)
    if len(planes) == 1:
        raise PlanesError.of_one("a resultant along the vehicle", vehicle.name)
    if load not in (BENDING_MOMENT, SHEAR_FORCE):
        raise UnknownNameError("load of two planes", load, (BENDING_MOMENT, SHEAR_FORCE))
    for plane in planes:
        station_table(plane.vehicle, load)
    (probability,) = checked_probabilities(probability)
    components = _with_components(case, vehicle)
    names = [[plane.prefix + name for name in _components(plane.vehicle)] for plane in planes]
    engine = engine_with_covariances(case)
    found = response_statistics(components, times, responses=[*names[0], *names[1]], engine=engine)
    at = found["time"].values
    along = [_along(components, p.vehicle, load, at, slosh_reaction, p.scope) for p in planes]
    if not np.array_equal(along[0].station, along[1].station):
        raise DataError(
            "holds other stations than that of the other plane; build both again",
            file=vehicle.folder / station_table(planes[0].vehicle, load).file,
            column="station",
        )
    means = found.mean.sel(source=COMBINED)
    mean = np.stack(
        [np.einsum("tnc,tc->tn", a.rows, means.sel(response=n).values) for a, n in zip(along, names, strict=True)],
        axis=2,
    )
    whole = found["covariance"]
    covariance = np.zeros((*mean.shape[:2], whole.sizes["source"], 2, 2))
    for i, j in ((0, 0), (0, 1), (1, 1)):
        P = whole.sel(response=names[i], other_response=names[j]).transpose("time", "source", ...).values
        part = np.einsum("tnc,tscd,tnd->tns", along[i].rows, P, along[j].rows, optimize=True)
        covariance[..., i, j] = covariance[..., j, i] = part
    law = NormOfNormal(mean, covariance[:, :, list(whole["source"].values).index(COMBINED)])
    level = law.percentile(probability)
    over = ("time", "station")
    units = {"units": LOADS[load]}
    return xr.Dataset(
        {
            "plane_mean": ((*over, "plane"), mean, units),
            "plane_covariance": ((*over, "source", "plane", "other_plane"), covariance),
            "level": (over, level, units | {"long_name": f"level that the resultant exceeds with {probability:g}"}),
            "direction": (over, law.direction(level).most_likely, {"units": "rad"}),
        },
        {
            "time": ("time", at, {"units": "s", "long_name": "flight time"}),
            "station": ("station", along[0].station, {"units": "m", "long_name": "vehicle station"}),
            "source": whole["source"].values,
            "plane": [plane.name for plane in planes],
            "other_plane": [plane.name for plane in planes],
        },
        provenance(case) | {"load": load, "probability": probability, "slosh_reaction": str(slosh_reaction).lower()},
    )


def _dataset(
    case: Case,
    components: Case,
    vehicle: Vehicle,
    load: str,
    found: ResponseStatistics,
    slosh_reaction: bool,
) -> xr.Dataset:
    at = found["time"].values
    along = _along(components, vehicle, load, at, slosh_reaction)
    mean = np.einsum("tnc,tc->tn", along.rows, found.mean.sel(source=COMBINED).values) + along.constant
    variance = np.einsum("tnc,tscd,tnd->tns", along.rows, found["covariance"].values, along.rows)
    variance = np.maximum(variance, 0.0)  # rounding, where every coefficient vanishes
    std = np.sqrt(variance)
    dims = ("time", "station", "source")
    dataset = xr.Dataset(
        {
            "mean": (dims[:2], mean),
            "variance": (dims, variance),
            "std": (dims, std),
            "mean_plus_3sigma": (dims, mean[:, :, None] + 3 * std),
        },
        {
            "time": ("time", at, {"units": "s", "long_name": "flight time"}),
            "station": ("station", along.station, {"units": "m", "long_name": "vehicle station"}),
            "forward_of_gimbal": ("station", along.forward_of_gimbal, {"units": "m"}),
            "source": found["source"].values,
        },
        provenance(case)
        | {
            "load": load,
            "engine": found.attrs["engine"],
            "slosh_reaction": str(slosh_reaction).lower(),
            "noise_loads": vehicle.file.options.noise_loads,
        },
    )
    squared = {"N m": "N^2 m^2", "N": "N^2"}[LOADS[load]]
    for name in dataset:
        units = squared if name == "variance" else LOADS[load]
        dataset[name].attrs |= {"units": units, "long_name": QUANTITIES[str(name)]}
    return dataset


@dataclass(frozen=True, eq=False)
class _Along:
    """K (times, stations, components) and c (times, stations) of a load at stations (m)."""

    station: Array
    forward_of_gimbal: Array
    rows: Array
    constant: Array


def _along(case: Case, vehicle: Vehicle, load: str, times: Array, slosh_reaction: bool, scope: str = "") -> _Along:
    """Return K and c; of one of two planes with the tables that begin with its ``scope`` in the place of the common."""
    times = np.array([interval_before(case.executable, node).high for node in time_nodes(case.executable, times)])
    at = [_scoped(case.tables(float(time)), scope) for time in times]
    flight = {name: np.array([tables[name] for tables in at])[:, None] for name in at[0]}
    parts = _tables_of(case, vehicle, load)
    first = parts[0]
    if any(not np.array_equal(part.station, first.station) for part in parts):
        raise DataError(
            "holds other stations than the table of the bending moment along the vehicle; build both again",
            file=vehicle.folder / station_table(vehicle, AXIAL_FORCE).file,
            column="station",
        )
    columns = {table: part.at(times) for table, part in zip(_tables(load), parts, strict=True)}
    zero = np.zeros((times.size, first.station.size))
    rows, constant = np.zeros((*zero.shape, len(_components(vehicle)))), zero
    if AXIAL_FORCE in columns:
        rows, constant = _axial_rows(vehicle, columns[AXIAL_FORCE], flight, first.forward_of_gimbal)
    lateral = next((table for table in columns if table != AXIAL_FORCE), None)
    if lateral is not None:
        part = parts[_tables(load).index(lateral)]
        across = _lateral_rows(case, vehicle, lateral, part, columns[lateral], flight, times, slosh_reaction)
        if load in SIDES:
            radius = columns[AXIAL_FORCE]["radius"]  # zero at a tip, where no moment is
            across *= SIDES[load] * np.divide(2.0, radius, out=zero.copy(), where=radius > 0)[:, :, None]
        rows = rows + across
    return _Along(first.station, first.forward_of_gimbal, rows, constant)


def _tables_of(case: Case, vehicle: Vehicle, load: str) -> list[StationLoads]:
    """Return what a load's tables hold, read once a case: some 100 000 numbers each."""

    def read(table: str) -> StationLoads:
        question = ("station loads", station_table(vehicle, table).file, table, vehicle.file.planes)
        return case.kept(question, lambda: load_station_loads(vehicle, table))

    return [read(table) for table in _tables(load)]


def _scoped(tables: dict[str, float], scope: str) -> dict[str, float]:
    own = {name.removeprefix(scope): value for name, value in tables.items() if scope and name.startswith(scope)}
    return tables | own


def _axial_rows(
    vehicle: Vehicle, columns: dict[str, Array], flight: dict[str, Array], forward: Array
) -> tuple[Array, Array]:
    force, tables = axial_force(columns, flight, forward), deviating_tables(vehicle.file)
    rows = np.zeros((*force.shape, len(_components(vehicle))))
    for name in component_deviations(vehicle.file):
        where = _components(vehicle).index(deviation_output(name))
        rows[:, :, where] = axial_noise(tables.get(name, ()), columns, flight, forward)
    return rows, force


def _lateral_rows(
    case: Case,
    vehicle: Vehicle,
    load: str,
    part: StationLoads,
    columns: dict[str, Array],
    flight: dict[str, Array],
    times: Array,
    slosh_reaction: bool,
) -> Array:
    tanks, file = [tank.name for tank in vehicle.slosh], vehicle.file
    zero = np.zeros_like(columns["angle_of_attack"])
    forward = {tank: flight[f"slosh.{tank}.attach_point"] > part.forward_of_gimbal for tank in tanks}
    if load == SHEAR_FORCE:
        columns |= {f"slosh_{tank}": -flight[f"slosh.{tank}.mass"] * forward[tank] for tank in tanks}
    columns |= {f"slosh_displacement_{tank}": zero for tank in tanks}
    if not file.options.local_angle_of_attack:
        columns |= {column.name: zero for column in local_load_columns(len(vehicle.bending))}
    if slosh_reaction:
        weights = {tank: zero + (forward[tank] if load == BENDING_MOMENT else 0.0) for tank in tanks}
        columns |= _with_reaction(columns, weights, flight)
    if file.options.p_delta:
        for i in range(1, len(vehicle.bending) + 1):
            pull = columns[f"p_delta_{i}"] * flight["thrust"] / flight["mass"]
            columns[f"bending_displacement_{i}"] = columns[f"bending_displacement_{i}"] + pull
    area, form = case.parameters["reference_area"].value, file.options.noise_loads
    if vehicle.zones is not None:
        forward_of = vehicle.zones.along(times, part.forward_of_gimbal, load == SHEAR_FORCE)
        for j in range(1, vehicle.zones.count + 1):
            turned = flight[f"{ZONES}first_moment_{j}"]
            columns[f"zone_angle_{j}"] = zone_coefficient(columns, flight, area, forward_of[:, :, j - 1], turned)
    if load == SHEAR_FORCE and form == "couple_forward":
        form = "couple_aft"  # a couple makes no shear but by the vehicle's answer to it, wherever it acts
    means = flight["mean.angle_of_attack"], flight["mean.engine_angle"]
    deviations = loading_deviations(file)
    for name in component_deviations(file):
        value = noise_load(deviations.get(name, ()), form, columns, flight, area, *means)
        columns[deviation_output(name)] = zero + value
    return np.stack([columns[c] for c in _columns(vehicle).values()], axis=2)


def _with_reaction(columns: dict[str, Array], weights: dict[str, Array], flight: dict[str, Array]) -> dict[str, Array]:
    """Return the slosh columns with the rigid body's answer, as slosh_reaction of model/equations/loads.py has it."""
    turning = columns["second_moment"] / flight["moment_of_inertia"]
    sinking = columns["first_moment"] / flight["mass"]
    found = {}
    for tank, weight in weights.items():
        mass, point = flight[f"slosh.{tank}.mass"], flight[f"slosh.{tank}.attach_point"]
        inertia = mass * (sinking + (point - flight["center_of_gravity"]) * turning)
        found[f"slosh_{tank}"] = columns[f"slosh_{tank}"] + inertia
        found[f"slosh_displacement_{tank}"] = flight["axial_acceleration"] * mass * (weight - turning)
    return found


def _tables(load: str) -> tuple[str, ...]:
    """Return the loads whose tables make a load.

    Raises
    ------
    UnknownNameError
    """
    if load not in LOADS:
        raise UnknownNameError("load along the vehicle", load, list(LOADS))
    return (BENDING_MOMENT, AXIAL_FORCE) if load in SIDES else (load,)


def _columns(vehicle: Vehicle) -> dict[str, str]:
    tanks = [tank.name for tank in vehicle.slosh]
    zones = 1 if vehicle.zones is None else vehicle.zones.count
    return component_columns(len(vehicle.bending), tanks, component_deviations(vehicle.file), zones)


def _components(vehicle: Vehicle) -> list[str]:
    """Return the outputs that every load along the vehicle is made of."""
    return list(_columns(vehicle))


def _with_components(case: Case, vehicle: Vehicle) -> Case:
    """Return the case with the quantities that loads are made of as outputs."""
    wanted = dict.fromkeys((*vehicle.file.options.extra_outputs, "load_components"))
    options = vehicle.file.options.model_copy(update={"extra_outputs": tuple(wanted)})
    vehicle = replace(vehicle, file=vehicle.file.model_copy(update={"options": options}))
    made = type(case).from_vehicle(vehicle, compile=case.executable.shared_library is not None)
    return made.with_parameters({name: p.value for name, p in case.parameters.items()})


def _chosen(found: Array, stations: Iterable[float], vehicle: Vehicle, load: str) -> NDArray[np.intp]:
    """Return which of the table's stations are wanted."""
    wanted = np.array(list(stations), float)
    nearest = np.abs(found - wanted[:, None]).argmin(axis=1)
    off = ~(np.abs(found[nearest] - wanted) <= SAME_STATION)
    if off.any():
        k = int(np.argmax(off))
        raise DataError(
            f"has no station at {wanted[k]:g} m; the nearest is {found[nearest[k]]:.9g} m. Choose among its "
            "stations, or build the vehicle with a load there",
            file=vehicle.folder / station_table(vehicle, _tables(load)[0]).file,
            column="station",
        )
    return nearest


def _words(load: str) -> str:
    _tables(load)
    return load.replace("_", " ")
