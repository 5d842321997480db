"""Biases: what is constant over a flight and random from flight to flight (docs/equations.md, section 5).

thrust                    relative, on the tables thrust and control_thrust
center_of_pressure        relative, on the table center_of_pressure
center_of_gravity_offset  m towards +Y, of every section's mass from the thrust axis
thrust_misalignment       rad, of the control engines' thrust from the direction that they are turned to
wind                      relative, of the mean wind at all altitudes
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from .vehicle import Vehicle
from .vehicle_file import AngleBiasEntry, LengthBiasEntry, RelativeBiasEntry, VehicleFile

CENTER_OF_GRAVITY_OFFSET = "center_of_gravity_offset"
THRUST_MISALIGNMENT = "thrust_misalignment"
WIND_BIAS = "wind_bias"


@dataclass(frozen=True)
class Bias:
    """A bias of a vehicle.

    Attributes
    ----------
    key : str
        Under [biases] of vehicle.toml.
    source : str
        Its name among the sources of a result.
    standard_deviation : float
        In ``unit``.
    unit : str
        SI; '1' of a relative error.
    tables : tuple of str
        Those that it deviates by a common factor.
    common : bool
        Whether both planes have the same; else one each.
    """

    key: str
    source: str
    standard_deviation: float
    unit: str
    tables: tuple[str, ...] = ()
    common: bool = True


_SOURCES = {
    "thrust": ("thrust_bias", ("thrust", "control_thrust")),
    "center_of_pressure": ("center_of_pressure_bias", ("center_of_pressure",)),
    CENTER_OF_GRAVITY_OFFSET: (CENTER_OF_GRAVITY_OFFSET, ()),
    THRUST_MISALIGNMENT: (THRUST_MISALIGNMENT, ()),
    "wind": (WIND_BIAS, ()),
}
# key of the sigma, SI unit, and what one of the file's is in it
_UNITS = {
    RelativeBiasEntry: ("standard_deviation", "1", 1.0),
    LengthBiasEntry: ("standard_deviation_m", "m", 1.0),
    AngleBiasEntry: ("standard_deviation_deg", "rad", math.radians(1.0)),
}


def vehicle_biases(file: VehicleFile) -> dict[str, Bias]:
    """Return the biases that a vehicle has, by source."""
    found = {}
    for key, (source, tables) in _SOURCES.items():
        entry = getattr(file.biases, key)
        if entry is not None:
            file_key, unit, factor = _UNITS[type(entry)]
            common = isinstance(entry, RelativeBiasEntry) and entry.planes == "common"
            found[source] = Bias(key, source, factor * getattr(entry, file_key), unit, tables, common)
    return found


def check_biases(vehicle: Vehicle) -> None:
    """Refuse a relative error of what is zero.

    Raises
    ------
    DataError
    """
    nothing = {"wind": vehicle.wind.means, "thrust": (vehicle.tables["control_thrust"],)}
    for bias in vehicle_biases(vehicle.file).values():
        of = nothing.get(bias.key, ())
        if of and not any(np.any(table.values) for table in of):
            raise DataError(
                f"is a relative error, but '{of[0].name}' is zero everywhere: a bias with no spread; remove it",
                file=vehicle.folder / "vehicle.toml",
                column=f"biases.{bias.key}",
            )
