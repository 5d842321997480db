"""A vehicle's numbers as symbols: declared once, for the model and for the equations of the report alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import casadi as ca

from ..system.symbols import ParameterSymbols, SharedParameters, TableSymbols
from ..tables import TableGroup
from ..vehicle.biases import vehicle_biases
from ..vehicle.columns import AZIMUTH_CHANGE, ZERO_ANGLE
from ..vehicle.planes import BOTH, Plane
from ..vehicle.vehicle import Vehicle
from .control import transfer_function_symbols
from .load_relief import Sensor, sensor_symbols
from .noise import NoiseProcess, bias_process, noise_process
from .turbulence import TurbulenceNumbers
from .vehicle_tables import vehicle_tables


@dataclass(frozen=True, eq=False)
class Shared:
    """What the planes of a vehicle have in common: time, tables, parameters, and deviations that act in each.

    Attributes
    ----------
    time, undisturbed : SX
    groups : tuple of TableGroup
    tables : TableSymbols
    parameters : ParameterSymbols
    processes : dict of str to (source, NoiseProcess)
        By the name of their white noise.
    """

    time: ca.SX
    undisturbed: ca.SX
    groups: tuple[TableGroup, ...]
    tables: TableSymbols
    parameters: ParameterSymbols
    processes: dict[str, tuple[str, NoiseProcess]] = field(default_factory=dict)

    @staticmethod
    def of(vehicle: Vehicle) -> Shared:
        """Declare it."""
        groups = vehicle_tables(vehicle)
        tables = TableSymbols(tuple(name for group in groups for name in group.names))
        return Shared(ca.SX.sym("t"), ca.SX.sym("undisturbed"), groups, tables, ParameterSymbols())

    def process(self, source: str, plane: Plane, common: bool, made: Callable[[], NoiseProcess]) -> NoiseProcess:
        """Return the deviation by a source in a plane: the one of both, or the plane's own."""
        name = source if common or not plane.prefix else f"{source}_{plane.name}"
        if name not in self.processes:
            self.processes[name] = source, made()
        return self.processes[name][1]


@dataclass(frozen=True, eq=False)
class Numbers:
    """What is known of a vehicle in one plane at a time: table values, parameters, and what is made of them.

    Attributes
    ----------
    time : SX
        Flight time (s).
    modes : int
    tanks : tuple of str
    groups : tuple of TableGroup
    tables : TableSymbols
    parameters : ParameterSymbols
    area : SX
        Reference area A (m2).
    networks : dict of str to (gain, numerator, denominator)
        T1, T2, T3.
    bending_damping, slosh_damping : (modes,) and (tanks,) SX
    noises, biases : dict of str to NoiseProcess
        By source.
    sigma_scale, mean_scale : SX
        Factors on the wind's standard deviation and mean.
    azimuth : SX
        Of the flight at a time, rad; where two components of the wind are turned by it.
    roll : SX or None
        By which the vehicle's planes are turned from those of the flight, pitch towards yaw, rad; where it has one.
    sensors : dict of str to Sensor
        Of load relief.
    radii : dict of str to SX
        Of the vehicle (m), by the bending moment whose station they are at.
    undisturbed : SX
        The known input of value one that carries what no wind and no deviation makes: the axial force's mean.
    turbulence : TurbulenceNumbers or None
    zones : int
        Gust zones; one is the whole vehicle.
    """

    time: ca.SX
    modes: int
    tanks: tuple[str, ...]
    groups: tuple[TableGroup, ...]
    tables: TableSymbols
    parameters: ParameterSymbols
    area: ca.SX
    networks: dict[str, tuple[ca.SX, ca.SX, ca.SX]]
    bending_damping: ca.SX
    slosh_damping: ca.SX
    noises: dict[str, NoiseProcess]
    biases: dict[str, NoiseProcess]
    sigma_scale: ca.SX
    mean_scale: ca.SX
    azimuth: ca.SX
    roll: ca.SX | None
    sensors: dict[str, Sensor]
    radii: dict[str, ca.SX]
    undisturbed: ca.SX
    turbulence: TurbulenceNumbers | None
    zones: int

    @property
    def deviations(self) -> dict[str, NoiseProcess]:
        """Noises and biases of the vehicle, by source."""
        return self.noises | self.biases

    @property
    def zero_force_angle(self) -> ca.SX:
        """What is added to the angle of attack so that the normal force is C'_N times the sum (rad); mostly zero."""
        if ZERO_ANGLE.name not in self.tables:
            return ca.SX(0)
        return self.tables[ZERO_ANGLE.name] / self.tables["normal_force_slope"] * self.undisturbed

    @staticmethod
    def of(plane: Plane, shared: Shared) -> Numbers:
        """Declare the numbers of a plane."""
        vehicle, tables = plane.vehicle, shared.tables.scoped(plane.scope) if plane.scope else shared.tables
        parameters = shared.parameters
        if plane.scope:
            parameters = SharedParameters(parameters, lambda name: f"{plane.scope if plane.owns(name) else ''}{name}")
        modes, tanks = len(vehicle.bending), tuple(tank.name for tank in vehicle.slosh)
        return Numbers(
            shared.time,
            modes,
            tanks,
            shared.groups,
            tables,
            parameters,
            area=parameters.add("reference_area", vehicle.file.reference_area_m2, "m2", "reference area A"),
            networks={n: transfer_function_symbols(n, e, parameters) for n, e in vehicle.transfer_functions.items()},
            bending_damping=_column(
                parameters.add(f"bending.{i}.damping", m.damping, "1", f"damping ratio of bending mode {i}")
                for i, m in enumerate(vehicle.bending, start=1)
            ),
            slosh_damping=_column(
                parameters.add(f"slosh.{t.name}.damping", t.damping, "1", f"damping ratio of slosh in {t.name}")
                for t in vehicle.slosh
            ),
            noises={
                n: shared.process(n, plane, e.planes == "common", partial(noise_process, n, e, parameters))
                for n, e in vehicle.noise.items()
            },
            biases={
                n: shared.process(n, plane, b.common, partial(bias_process, b, parameters))
                for n, b in vehicle_biases(vehicle.file).items()
            },
            sigma_scale=parameters.add("wind.sigma_scale", 1.0, "1", "factor on the wind's standard deviation"),
            mean_scale=parameters.add("wind.mean_scale", 1.0, "1", "factor on the mean wind"),
            azimuth=_azimuth(vehicle, tables, parameters),
            roll=None
            if vehicle.file.roll_deg is None
            else parameters.add("roll", math.radians(vehicle.file.roll_deg), "rad", "roll of the vehicle's planes"),
            sensors=sensor_symbols(vehicle.file.control.load_relief, modes, tables, parameters),
            radii={
                load.output: parameters.add(
                    f"loads.{load.output}.radius", load.radius_m, "m", f"radius of the vehicle where {load.output} is"
                )
                for load in vehicle.file.loads
                if load.radius_m is not None
            },
            undisturbed=shared.undisturbed,
            turbulence=TurbulenceNumbers.of(vehicle.turbulence, parameters) if vehicle.turbulence else None,
            zones=1 if vehicle.zones is None else vehicle.zones.count,
        )


def _azimuth(vehicle: Vehicle, tables: TableSymbols, parameters: ParameterSymbols) -> ca.SX:
    if vehicle.file.planes != BOTH:
        return ca.SX(0)
    azimuth_deg = vehicle.file.wind.azimuth_deg
    assert azimuth_deg is not None  # checked by load_vehicle
    meaning = "azimuth of the flight, from north towards east"
    azimuth = parameters.add("wind.azimuth", math.radians(azimuth_deg), "rad", meaning)
    return azimuth + tables[AZIMUTH_CHANGE.name] if AZIMUTH_CHANGE.name in tables else azimuth


def _column(entries: Iterable[ca.SX]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *entries)
