"""Mean and spread of the bending moment along the whole vehicle, from one run.

At a time the moment of every station is linear in the same few quantities y: M = K y. One run gives their means and,
source by source, their covariances P; then E[M] = K E[y] and Var[M] = diag(K P K').
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.equations.load_components import component_columns, deviation_output
from ...model.equations.noise_loads import noise_load
from ...model.equations.station_loads import StationLoads, load_station_loads
from ...model.errors import DataError, IntegrationError
from ...model.system.names import COMBINED
from ...model.vehicle.columns import local_load_columns
from ...model.vehicle.noise_loads import loading_deviations
from ...model.vehicle.vehicle import Vehicle
from ..case.provenance import provenance
from ..solvers.time_nodes import interval_before, time_nodes
from ..statistics.dataset import QUANTITIES
from ..statistics.engine import Engine

if TYPE_CHECKING:
    from ..study import Study

SAME_STATION = 1e-6  # m


@dataclass(frozen=True, eq=False)
class LoadRows:
    """Loads at stations as rows of the Markov state: load = state x + direct_mean, about which no white noise acts.

    Attributes
    ----------
    time : (k,) array
        s.
    station, forward_of_gimbal : (s,) arrays
        Vehicle station and metres forward of the gimbal plane (m).
    state : (k, s, n) array
        C, over the states of the study's own system.
    direct_mean : (k, s) array
        What the mean wind adds without delay: G u.
    """

    time: NDArray[np.float64]
    station: NDArray[np.float64]
    forward_of_gimbal: NDArray[np.float64]
    state: NDArray[np.float64]
    direct_mean: NDArray[np.float64]


def load_rows(
    study: Study,
    times: Iterable[float],
    stations: Iterable[float] | None = None,
    *,
    slosh_reaction: bool = True,
) -> LoadRows:
    """Return the bending moment at stations in terms of the states at each time; from the left where flight jumps.

    Parameters
    ----------
    study : Study
        Of a vehicle with ``tables.loads_along_vehicle``.
    times : iterable of float
        Increasing, s.
    stations : iterable of float, optional
        Vehicle stations (m), each among those of the table; all of them without it.
    slosh_reaction : bool
        As for :func:`moments_along_vehicle`.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError
    """
    vehicle = study.vehicle_for("the bending moment along the vehicle")
    at = np.array(study.checked_times(times), float)
    loads = load_station_loads(vehicle)
    chosen = np.arange(loads.station.size) if stations is None else _chosen(loads, stations, vehicle)
    names = list(
        component_columns(len(vehicle.bending), [tank.name for tank in vehicle.slosh], loading_deviations(vehicle.file))
    )
    components = _with_components(study)
    components.system.refuse_direct_noise(names)
    rows = station_rows(study, loads, at, slosh_reaction)[:, chosen]
    outputs = [components.system.output_index(name) for name in names]
    executable = components.executable.with_numbers(groups=study.with_means.groups)
    nodes = time_nodes(executable, at)
    sides = [interval_before(executable, float(node)) for node in nodes]
    matrices = [executable.matrices(node, here.low, here.high) for node, here in zip(nodes, sides, strict=True)]
    state = np.array([m["C"][outputs] for m in matrices])
    direct = np.array([(m["G"] @ m["inputs"])[outputs, 0] for m in matrices])
    return LoadRows(
        at,
        loads.station[chosen],
        loads.forward_of_gimbal[chosen],
        np.einsum("tsc,tcn->tsn", rows, state),
        np.einsum("tsc,tc->ts", rows, direct),
    )


def _chosen(loads: StationLoads, stations: Iterable[float], vehicle: Vehicle) -> NDArray[np.intp]:
    """Return which of the table's stations are wanted."""
    wanted = np.array(list(stations), float)
    nearest = np.abs(loads.station - wanted[:, None]).argmin(axis=1)
    off = ~(np.abs(loads.station[nearest] - wanted) <= SAME_STATION)
    if off.any():
        k = int(np.argmax(off))
        entry = vehicle.file.tables.loads_along_vehicle
        raise DataError(
            f"has no station at {wanted[k]:g} m; the nearest is {loads.station[nearest[k]]:.9g} m. Choose among its "
            "stations, or build the vehicle with a load there",
            file=vehicle.folder / entry.file if entry else None,
            column="station",
        )
    return nearest


def moments_along_vehicle(
    study: Study,
    times: Iterable[float],
    *,
    slosh_reaction: bool = True,
    engine: str | Engine | None = None,
) -> xr.Dataset:
    """Return mean, variance, std and mean + 3 sigma of the bending moment over (time, station, source).

    Parameters
    ----------
    study : Study
        Of a vehicle with ``tables.loads_along_vehicle``.
    times : iterable of float
        Flight times, s.
    slosh_reaction : bool
        Whether the whole vehicle answers slosh. Without, as the report has it, the moment does not vanish at the tail.
        Here it does not follow the vehicle's option, which is for its outputs.
    engine : Sweep, CovarianceEquation or their names, optional
        Those that give covariances; the sweep where something is compiled.

    Raises
    ------
    DataError, TimeRangeError, DirectNoiseError, IntegrationError
    """
    vehicle = study.vehicle_for("the bending moment along the vehicle")
    loads = load_station_loads(vehicle)
    tanks = [tank.name for tank in vehicle.slosh]
    names = list(component_columns(len(vehicle.bending), tanks, loading_deviations(vehicle.file)))
    components = _with_components(study)
    if engine is None:
        engine = "covariance" if study.executable.shared_library is None else "sweep"
    found = components.response_statistics(times, responses=names, engine=engine)
    if "covariance" not in found:
        raise IntegrationError(f"engine '{found.attrs['engine']}' gives no covariances; use sweep or covariance")
    at = found["time"].values
    rows = station_rows(components, loads, at, slosh_reaction)
    mean = np.einsum("tnc,tc->tn", rows, found.mean.sel(source=COMBINED).values)
    variance = np.einsum("tnc,tscd,tnd->tns", rows, found["covariance"].values, rows)
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
            "station": ("station", loads.station, {"units": "m", "long_name": "vehicle station"}),
            "forward_of_gimbal": ("station", loads.forward_of_gimbal, {"units": "m"}),
            "source": found["source"].values,
        },
        provenance(study)
        | {
            "engine": found.attrs["engine"],
            "slosh_reaction": str(slosh_reaction).lower(),
            "noise_loads": vehicle.file.options.noise_loads,
        },
    )
    for name in dataset:
        dataset[name].attrs |= {"units": "N^2 m^2" if name == "variance" else "N m", "long_name": QUANTITIES[str(name)]}
    return dataset


def _with_components(study: Study) -> Study:
    """Return the study with the quantities that moments are made of as outputs."""
    vehicle = study.vehicle_for("the bending moment along the vehicle")
    wanted = dict.fromkeys((*vehicle.file.options.extra_outputs, "load_components"))
    options = vehicle.file.options.model_copy(update={"extra_outputs": tuple(wanted)})
    vehicle = replace(vehicle, file=vehicle.file.model_copy(update={"options": options}))
    made = type(study).from_vehicle(vehicle, compile=study.executable.shared_library is not None)
    return made.with_parameters({name: p.value for name, p in study.parameters.items()})


def station_rows(
    study: Study, loads: StationLoads, times: NDArray[np.float64], slosh_reaction: bool
) -> NDArray[np.float64]:
    """Return K, the coefficient of each component at each station, (times, stations, components)."""
    vehicle = study.vehicle_for("the bending moment along the vehicle")
    tanks = [tank.name for tank in vehicle.slosh]
    times = np.array([interval_before(study.executable, node).high for node in time_nodes(study.executable, times)])
    columns = loads.at(times)
    zero = np.zeros((times.size, loads.station.size))
    columns |= {f"slosh_displacement_{tank}": zero for tank in tanks}
    if not vehicle.file.options.local_angle_of_attack:
        columns |= {column.name: zero for column in local_load_columns(len(vehicle.bending))}
    at = [study.tables(float(time)) for time in times]
    flight = {name: np.array([tables[name] for tables in at])[:, None] for name in at[0]}
    if slosh_reaction:
        columns |= _with_reaction(columns, loads, tanks, flight)
    file, area = vehicle.file, study.parameters["reference_area"].value
    if file.options.p_delta:
        for i in range(1, len(vehicle.bending) + 1):
            pull = columns[f"p_delta_{i}"] * flight["thrust"] / flight["mass"]
            columns[f"bending_displacement_{i}"] = columns[f"bending_displacement_{i}"] + pull
    deviations = loading_deviations(file)
    means = flight["mean.angle_of_attack"], flight["mean.engine_angle"]
    for name, tables in deviations.items():
        columns[deviation_output(name)] = noise_load(tables, file.options.noise_loads, columns, flight, area, *means)
    wanted = component_columns(len(vehicle.bending), tanks, deviations)
    return np.stack([columns[c] for c in wanted.values()], axis=2)


def _with_reaction(
    columns: dict[str, NDArray[np.float64]],
    loads: StationLoads,
    tanks: list[str],
    flight: dict[str, NDArray[np.float64]],
) -> dict[str, NDArray[np.float64]]:
    """Return the slosh columns with the rigid body's answer, as slosh_reaction of model/equations/loads.py has it."""
    turning = columns["second_moment"] / flight["moment_of_inertia"]
    sinking = columns["first_moment"] / flight["mass"]
    found = {}
    for tank in tanks:
        mass, point = flight[f"slosh.{tank}.mass"], flight[f"slosh.{tank}.attach_point"]
        inertia = mass * (sinking + (point - flight["center_of_gravity"]) * turning)
        found[f"slosh_{tank}"] = columns[f"slosh_{tank}"] + inertia
        found[f"slosh_displacement_{tank}"] = (
            flight["axial_acceleration"] * mass * ((point > loads.forward_of_gimbal) - turning)
        )
    return found
