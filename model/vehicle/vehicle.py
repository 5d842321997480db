"""A vehicle: the numbers of one TOML file and its CSV tables, checked, and ready for the equations."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..tables import Table
from ..wind.statistics import WindModel
from ..wind.turbulence import Turbulence
from ..wind.two_components import TwoComponentWind
from .vehicle_file import (
    BendingEntry,
    NoiseEntry,
    SloshEntry,
    TransferFunctionEntry,
    VehicleFile,
)


@dataclass(frozen=True)
class TableSource:
    """Where the numbers of a table come from, and the last time or altitude it covers."""

    name: str
    file: Path
    status: str
    source: str
    first: float
    last: float


@dataclass(frozen=True, eq=False, repr=False)
class Vehicle:
    """Everything the equations need to know about a vehicle.

    Attributes
    ----------
    name, title : str
    folder : Path
    file : VehicleFile
        The TOML file as read.
    tables : dict of str to Table
        Quantities over flight time by their full name, such as 'bending.1.frequency'.
    wind : WindModel or TwoComponentWind
        The second of a vehicle that flies in both planes.
    start, end : float
        Flight times covered, s.
    discontinuities : tuple of float
        Times at which a table jumps.
    sources : tuple of TableSource
        Provenance by file.
    turbulence : Turbulence, optional
        Beside the wind of the statistics, whichever that is.
    """

    name: str
    title: str
    folder: Path
    file: VehicleFile
    tables: dict[str, Table]
    wind: WindModel | TwoComponentWind
    start: float
    end: float
    discontinuities: tuple[float, ...]
    sources: tuple[TableSource, ...]
    turbulence: Turbulence | None = None

    def __repr__(self) -> str:
        parts = f"{len(self.bending)} bending modes, {len(self.slosh)} slosh masses, {len(self.noise)} noises"
        return (
            f"Vehicle '{self.name}' ({self.title}): {parts}, {len(self.tables)} tables of {len(self.sources)} files in "
            f"{self.folder}, {self.start:g} to {self.end:g} s"
        )

    @property
    def start_altitude(self) -> float:
        """Altitude where the flight starts, m."""
        return float(self.tables["altitude"].polynomial(self.start))

    @property
    def bending(self) -> tuple[BendingEntry, ...]:
        return self.file.bending

    @property
    def slosh(self) -> tuple[SloshEntry, ...]:
        return self.file.slosh

    @property
    def noise(self) -> dict[str, NoiseEntry]:
        return self.file.noise

    @property
    def transfer_functions(self) -> dict[str, TransferFunctionEntry]:
        """T1 (attitude), T2 (attitude rate) and T3 (actuator), equations 4-5 to 4-7."""
        return {"T1": self.file.control.T1, "T2": self.file.control.T2, "T3": self.file.control.T3}
