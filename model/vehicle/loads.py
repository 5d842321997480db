"""The loads of a vehicle: bending moments, and at the same stations what tables of shear and axial force give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from . import columns as c
from .columns import Column
from .vehicle_file import LoadEntry, TableEntry, VehicleFile

BENDING_MOMENT, SHEAR_FORCE, AXIAL_FORCE = "bending_moment", "shear_force", "axial_force"
SIDES = {"equivalent_axial_load_plus_y": 1.0, "equivalent_axial_load_minus_y": -1.0}  # N + 2 M / R, N - 2 M / R


def load_name(output: str, quantity: str) -> str:
    """Return the name of another load at the station of a bending moment: 'bending_moment_2' has 'shear_force_2'."""
    return output.replace(BENDING_MOMENT, quantity, 1) if BENDING_MOMENT in output else f"{output}_{quantity}"


@dataclass(frozen=True)
class LateralLoad:
    """A load across the axis, by the form of 4-13: the bending moment or the shear force at a station.

    Attributes
    ----------
    output : str
    station : LoadEntry
    table : TableEntry
        Of its coefficients.
    local : TableEntry or None
        Of those for the local angle of attack.
    is_shear : bool
    """

    output: str
    station: LoadEntry
    table: TableEntry
    local: TableEntry | None
    is_shear: bool

    @property
    def unit(self) -> str:
        return "N" if self.is_shear else "N m"

    def columns(self, modes: int, tanks: Sequence[str]) -> tuple[Column, ...]:
        """Return the columns of its table that are always read."""
        return c.shear_columns(modes) if self.is_shear else c.load_columns(modes, tanks)

    @property
    def reaction(self) -> tuple[Column, Column]:
        """S_1 and S_2."""
        return c.SHEAR_REACTION if self.is_shear else c.REACTION

    def by_need(self, modes: int) -> tuple[Column, ...]:
        """Return the columns that options and deviations ask for, S_1 and S_2 among them."""
        return (*self.reaction, *(c.shear_by_need_columns(modes) if self.is_shear else c.by_need_columns(modes)))

    def local_columns(self, modes: int) -> tuple[Column, ...]:
        """Return the columns for the local angle of attack."""
        return c.local_shear_columns(modes) if self.is_shear else c.local_load_columns(modes)


def lateral_loads(file: VehicleFile) -> tuple[LateralLoad, ...]:
    """Return the bending moments, then the shear forces."""
    moments = (LateralLoad(load.output, load, load.table, load.local, False) for load in file.loads)
    shears = (
        LateralLoad(load_name(load.output, SHEAR_FORCE), load, load.shear, load.shear, True)
        for load in file.loads
        if load.shear
    )
    return (*moments, *shears)


def load_outputs(file: VehicleFile) -> tuple[str, ...]:
    """Return the names of all loads."""
    found = [load.output for load in lateral_loads(file)]
    found += [load_name(load.output, AXIAL_FORCE) for load in file.loads if load.axial]
    found += [load_name(load.output, side) for load in file.loads if load.axial and load.radius_m for side in SIDES]
    return tuple(found)
