"""A vehicle's numbers as symbols: declared once, for the model and for the equations of the report alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca

from ..system.symbols import ParameterSymbols, TableSymbols
from ..tables import TableGroup
from ..vehicle.biases import vehicle_biases
from ..vehicle.vehicle import Vehicle
from .control import transfer_function_symbols
from .load_relief import Sensor, sensor_symbols
from .noise import NoiseProcess, bias_process, noise_process
from .turbulence import TurbulenceNumbers
from .vehicle_tables import vehicle_tables


@dataclass(frozen=True, eq=False)
class Numbers:
    """What is known of a vehicle at a time: table values, parameters, and what is made of them.

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
    sensors : dict of str to Sensor
        Of load relief.
    radii : dict of str to SX
        Of the vehicle (m), by the bending moment whose station they are at.
    undisturbed : SX
        The known input of value one that carries what no wind and no deviation makes: the axial force's mean.
    turbulence : TurbulenceNumbers or None
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
    sensors: dict[str, Sensor]
    radii: dict[str, ca.SX]
    undisturbed: ca.SX
    turbulence: TurbulenceNumbers | None

    @property
    def deviations(self) -> dict[str, NoiseProcess]:
        """Noises and biases of the vehicle, by source."""
        return self.noises | self.biases

    @staticmethod
    def of(vehicle: Vehicle) -> Numbers:
        """Declare the numbers of a vehicle."""
        groups, parameters = vehicle_tables(vehicle), ParameterSymbols()
        tables = TableSymbols(tuple(name for group in groups for name in group.names))
        modes, tanks = len(vehicle.bending), tuple(tank.name for tank in vehicle.slosh)
        return Numbers(
            ca.SX.sym("t"),
            modes,
            tanks,
            groups,
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
            noises={n: noise_process(n, e, parameters) for n, e in vehicle.noise.items()},
            biases={n: bias_process(b, parameters) for n, b in vehicle_biases(vehicle.file).items()},
            sigma_scale=parameters.add("wind.sigma_scale", 1.0, "1", "factor on the wind's standard deviation"),
            mean_scale=parameters.add("wind.mean_scale", 1.0, "1", "factor on the mean wind"),
            sensors=sensor_symbols(vehicle.file.control.load_relief, modes, tables, parameters),
            radii={
                load.output: parameters.add(
                    f"loads.{load.output}.radius", load.radius_m, "m", f"radius of the vehicle where {load.output} is"
                )
                for load in vehicle.file.loads
                if load.radius_m is not None
            },
            undisturbed=ca.SX.sym("undisturbed"),
            turbulence=TurbulenceNumbers.of(vehicle.turbulence, parameters) if vehicle.turbulence else None,
        )


def _column(entries: Iterable[ca.SX]) -> ca.SX:
    return ca.vertcat(ca.SX(0, 1), *entries)
