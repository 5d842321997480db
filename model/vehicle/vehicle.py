"""A vehicle: the numbers of one TOML file and its CSV tables, checked, and ready for the equations."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from ..polynomials import PiecewisePolynomial
from ..tables import Table, taylor_coefficients
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
from .zones import AHEAD, Zones


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
    zones : Zones, optional
        That enter a gust one after the other; without, the whole vehicle feels one wind.
    own_angles : dict of str to Table
        Angle of attack of the flight without wind itself (rad) by plane, where the trajectory's table has it; whether
        the equations take it in is ``options.trajectory_angle_of_attack``.
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
    zones: Zones | None = None
    own_angles: dict[str, Table] = field(default_factory=dict)

    def __repr__(self) -> str:
        parts = f"{len(self.bending)} bending modes, {len(self.slosh)} slosh masses, {len(self.noise)} noises"
        return (
            f"Vehicle '{self.name}' ({self.title}): {parts}, {len(self.tables)} tables of {len(self.sources)} files in "
            f"{self.folder}, {self.start:g} to {self.end:g} s"
        )

    @property
    def start_altitude(self) -> float:
        """Altitude where the flight starts in its wind, m."""
        return float(self.met_altitude(self.start))

    @cached_property
    def met_altitude(self) -> PiecewisePolynomial:
        """Altitude (m) over time at which the vehicle meets the wind: of its foremost gust zone, or its own."""
        altitude = self.tables["altitude"].polynomial
        return altitude if self.zones is None else _sum(altitude, self.tables[AHEAD].polynomial)

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


def _sum(first: PiecewisePolynomial, second: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return the sum of two piecewise cubics where both are known."""
    low, high = max(first.x[0], second.x[0]), min(first.x[-1], second.x[-1])
    knots = np.unique(np.concatenate([[low, high], first.x, second.x]))
    knots = knots[(knots >= low) & (knots <= high)]
    middle = 0.5 * (knots[:-1] + knots[1:])
    ours, theirs = (taylor_coefficients(p, knots[:-1], middle) for p in (first, second))
    return PiecewisePolynomial(ours + theirs, knots)
