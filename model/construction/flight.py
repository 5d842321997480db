"""Engines, aerodynamics, pitch programme, site and atmosphere of the mean flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError


@dataclass(frozen=True, eq=False)
class EngineGroup:
    """Engines that run alike.

    Attributes
    ----------
    name : str
    count : int
    gimballed : bool
        Whether they make the control thrust.
    exit_area : float
        Of one engine (m2): thrust is that in vacuum less exit_area times the ambient pressure.
    time : (n,) array
        Range time (s); linear between, held outside.
    vacuum_thrust, mass_flow : (n,) arrays
        Of one engine (N, kg/s; positive).
    draws : mapping
        Tank name to its share of ``mass_flow``; the rest, if the sum is below 1, leaves no tank.
    cutoff : float, optional
        Commanded cutoff (s). Without, the engines run until a tank of theirs is empty.
    cutoff_event : str
        Name of that event in the vehicle's [events], such as 'center_engine_cutoff'.
    residual : mapping
        Tank name to the liquid (kg) that is left at depletion.
    solid : bool
        A motor that burns by its table alone: nothing before the first row, tail-off to nothing in the last, thrust
        never below zero.
    """

    name: str
    count: int
    gimballed: bool
    exit_area: float
    time: NDArray[np.float64]
    vacuum_thrust: NDArray[np.float64]
    mass_flow: NDArray[np.float64]
    draws: Mapping[str, float]
    cutoff: float | None
    cutoff_event: str
    residual: Mapping[str, float] = field(default_factory=dict)
    solid: bool = False

    def __post_init__(self):
        if self.count < 1 or not self.exit_area >= 0:
            raise DataError(f"engine group '{self.name}' needs a count of 1 or more and an exit area of 0 or more")
        if self.solid:
            for values, what in ((self.vacuum_thrust, "thrust"), (self.mass_flow, "mass flow")):
                if not (values >= 0).all() or not (values[:-1] > 0).any():
                    raise DataError(f"solid motor '{self.name}' needs {what} of 0 or more, and some above")
        elif not (self.vacuum_thrust > 0).all() or not (self.mass_flow > 0).all():
            raise DataError(f"engine group '{self.name}' needs positive thrust and mass flow in every row")
        if any(share <= 0 for share in self.draws.values()) or sum(self.draws.values()) > 1 + 1e-9:
            raise DataError(f"engine group '{self.name}' needs positive draws with a sum of at most 1")


@dataclass(frozen=True, eq=False)
class NormalForceComponent:
    """A part of the normal force: a slope over Mach number, and how it is spread along the vehicle.

    Attributes
    ----------
    name : str
    station, shape : (n,) arrays
        Stations (m) and relative local intensity, linear between; scaled to integrate to 1.
    mach, slope : (m,) arrays
        Normal-force slope C_N_alpha of this part on the reference area (1/rad); linear between.
    """

    name: str
    station: NDArray[np.float64]
    shape: NDArray[np.float64]
    mach: NDArray[np.float64]
    slope: NDArray[np.float64]

    def __post_init__(self):
        if self.station.size < 2 or (np.diff(self.station) <= 0).any():
            raise DataError(f"normal-force component '{self.name}' needs stations that increase")
        if self.mach.size < 2 or (np.diff(self.mach) <= 0).any():
            raise DataError(f"normal-force component '{self.name}' needs Mach numbers that increase")
        if not np.trapezoid(self.shape, self.station) > 0:
            raise DataError(f"normal-force component '{self.name}' has a shape without area")


@dataclass(frozen=True, eq=False)
class Drag:
    """Zero-lift drag coefficient on the reference area over Mach number; linear between."""

    mach: NDArray[np.float64]
    coefficient: NDArray[np.float64]

    def __post_init__(self):
        if self.mach.size < 2 or (np.diff(self.mach) <= 0).any() or not (self.coefficient >= 0).all():
            raise DataError("drag needs Mach numbers that increase and coefficients of zero or more")


@dataclass(frozen=True, eq=False)
class PitchProgramme:
    """Pitch angle in the launch plumbline frame: 0 vertical, positive downrange.

    Attributes
    ----------
    kind : {'polynomials', 'table', 'gravity_turn'}
        'polynomials': segments of a quartic in the time since ``time_base``; 'table': linear between times;
        'gravity_turn': 'table' up to the last time, from there the axis follows the relative velocity.
    time_base : float
        Range time (s) at which the programme's time is zero.
    begin : float
        Programme time before which the vehicle stays vertical (s).
    arrest : float
        Programme time from which the angle is held (s); not used by 'gravity_turn'.
    segments : (n, 7) array
        From, to (s), five coefficients by rising power (rad, rad/s, ...); of zero rows for the other kinds.
    time, angle : (m,) arrays
        Of 'table' and 'gravity_turn' (s, rad).
    """

    kind: Literal["polynomials", "table", "gravity_turn"]
    time_base: float
    begin: float
    arrest: float
    segments: NDArray[np.float64]
    time: NDArray[np.float64]
    angle: NDArray[np.float64]


@dataclass(frozen=True)
class Site:
    """Where and when the flight begins.

    Attributes
    ----------
    latitude, azimuth : float
        Geodetic latitude; flight azimuth east of north (rad).
    altitude : float
        Of the vehicle's centre of gravity at release (m).
    platform_release : float
        Range time (s) at which the plumbline frame stops turning with the Earth.
    release : float
        Range time (s) at which the vehicle is let go.
    """

    latitude: float
    azimuth: float
    altitude: float
    platform_release: float
    release: float


@dataclass(frozen=True, eq=False)
class AtmosphereFactors:
    """Factors on density and temperature of the 1976 standard atmosphere over altitude (m); pressure by the gas law."""

    altitude: NDArray[np.float64]
    density: NDArray[np.float64]
    temperature: NDArray[np.float64]

    def __post_init__(self):
        if (np.diff(self.altitude) <= 0).any() or not (self.density > 0).all() or not (self.temperature > 0).all():
            raise DataError("atmosphere factors need altitudes that increase and positive factors")
