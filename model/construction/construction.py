"""Everything a vehicle is built of, checked as a whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, DataErrorCollector, UnknownNameError
from .consistency import (
    refuse_misplaced,
    refuse_repeated_engines,
    refuse_repeated_forces,
    refuse_repeated_jettisons,
    refuse_repeated_masses,
    refuse_repeated_stations,
)
from .flight import AtmosphereFactors, Drag, EngineGroup, NormalForceComponent, PitchProgramme, Site
from .given_modes import GivenModes
from .grain import Grain
from .jettison import Jettison
from .outline import Outline
from .structure import LumpedMass, Stiffness, Tank
from .tank_shape import TankShape


@dataclass(frozen=True, eq=False)
class Construction:
    """The raw inputs of a vehicle; stations in metres, forward positive.

    Attributes
    ----------
    name : str
    gimbal_station, sensor_station : float
        Engine gimbal plane; attitude and rate sensors (m). Tables count metres forward of the gimbal plane.
    aft_end, forward_end : float
        Ends of the vehicle (m): masses, liquid and beam lie between them.
    reference_area : float
        m2.
    masses : tuple of LumpedMass
        Everything but the liquid in ``tanks``.
    tanks : tuple of Tank
    stiffness : Stiffness
    bending_modes : int
        How many modes the model has.
    normal_force : tuple of NormalForceComponent
    drag : Drag
    engines : tuple of EngineGroup
    pitch : PitchProgramme
    site : Site
    atmosphere : AtmosphereFactors or None
        None: the 1976 standard atmosphere itself.
    load_stations : tuple of float
        Stations whose bending moment is an output (m).
    end_time : float
        Latest end of the tables (s); the flight may end before at depletion.
    slosh_method : {'surface_radius', 'cylinder', 'potential'}
        Cylinder formulas with the radius of the free surface at the liquid's level, or with the tank's largest radius;
        or the first mode of potential flow in the tank's own shape.
    outline : Outline or None
        None: axial forces are not computed.
    modes : GivenModes or None
        Modes that others computed; None: those of the free beam with ``stiffness``.
    grains : tuple of Grain
        Of solid motors; each has an engine group of its name.
    jettisons : tuple of Jettison
    """

    name: str
    gimbal_station: float
    sensor_station: float
    aft_end: float
    forward_end: float
    reference_area: float
    masses: tuple[LumpedMass, ...]
    tanks: tuple[Tank, ...]
    stiffness: Stiffness
    bending_modes: int
    normal_force: tuple[NormalForceComponent, ...]
    drag: Drag
    engines: tuple[EngineGroup, ...]
    pitch: PitchProgramme
    site: Site
    atmosphere: AtmosphereFactors | None
    load_stations: tuple[float, ...]
    end_time: float
    slosh_method: Literal["surface_radius", "cylinder", "potential"] = "surface_radius"
    outline: Outline | None = None
    modes: GivenModes | None = None
    grains: tuple[Grain, ...] = ()
    jettisons: tuple[Jettison, ...] = ()

    def __post_init__(self):
        collector = DataErrorCollector()
        checks = (
            self._check_places,
            lambda: refuse_repeated_masses(self.masses, self.tanks, self.grains),
            lambda: refuse_repeated_engines(self.engines),
            lambda: refuse_repeated_jettisons(self.jettisons),
            lambda: refuse_repeated_forces(self.normal_force),
            lambda: refuse_repeated_stations(self.load_stations, self.stiffness),
            *(lambda m=mass: m.require_within(self.aft_end, self.forward_end) for mass in self.masses),
            *(lambda t=tank: self._check_tank(t) for tank in self.tanks),
            *(lambda g=grain: self._check_grain(g) for grain in self.grains),
            *(lambda j=jettison: self._check_time(j) for jettison in self.jettisons),
            lambda: self._check_reach("stiffness is", self.stiffness.station),
            self._check_load_stations,
            self._check_outline,
            self._check_modes,
        )
        for check in checks:
            with collector.part():
                check()
        if not self.engines:
            collector.errors.append(DataError("the vehicle has no engines; add [[engines]]"))
        collector.raise_all()
        self._check_names()

    def _check_places(self) -> None:
        places = {"gimbal_station_m": [self.gimbal_station], "sensor_station_m": [self.sensor_station]}
        for component in self.normal_force:
            places[f"normal_force.{component.name}.station_m"] = [float(s) for s in component.station[[0, -1]]]
        refuse_misplaced(self.aft_end, self.forward_end, places)

    def _check_tank(self, tank: Tank) -> None:
        if tank.bottom < self.aft_end or tank.top > self.forward_end:
            raise DataError(f"tank '{tank.name}' lies beyond the vehicle's ends; correct its sections")
        capacity = TankShape.of(tank).capacity
        if tank.liquid > tank.density * capacity:
            raise DataError(
                f"tank '{tank.name}' is overfilled: {tank.liquid:g} kg at {tank.density:g} kg/m3 take "
                f"{tank.liquid / tank.density:.4g} m3 of {capacity:.4g} m3; correct liquid, density or sections"
            )

    def _check_grain(self, grain: Grain) -> None:
        slack = 1e-6 * (self.forward_end - self.aft_end)
        if grain.begin < self.aft_end - slack or grain.end > self.forward_end + slack:
            raise DataError(f"grain '{grain.name}' lies beyond the vehicle's ends; correct its stations")

    def _check_time(self, jettison: Jettison) -> None:
        if not self.site.release < jettison.time < self.end_time:
            raise DataError(
                f"jettison '{jettison.event}' at {jettison.time:g} s does not lie between release and end_time_s, "
                f"{self.site.release:g} and {self.end_time:g} s; correct time_s"
            )

    def _check_reach(self, what: str, station: NDArray[np.float64]) -> None:
        if station[0] > self.aft_end or station[-1] < self.forward_end:
            raise DataError(
                f"{what} given from {station[0]:g} to {station[-1]:g} m, the vehicle reaches from {self.aft_end:g} to "
                f"{self.forward_end:g} m; add stations"
            )

    def _check_load_stations(self) -> None:
        for station in self.load_stations:
            if not self.aft_end < station < self.forward_end:
                raise DataError(f"load station {station:g} m is not on the vehicle; choose one between its ends")

    def _check_outline(self) -> None:
        if self.outline is not None:
            self._check_reach("the outline is", self.outline.station)
            for tank in self.tanks:
                self.outline.require_around(tank)

    def _check_modes(self) -> None:
        if self.modes is None:
            return
        count = self.modes.frequency.shape[1]
        if count != self.bending_modes:
            raise DataError(
                f"is {self.bending_modes}, but {count} modes are given; make them equal", column="bending_modes"
            )
        ends, slack = self.modes.station[[0, -1]], 1e-6 * (self.forward_end - self.aft_end)
        if abs(ends[0] - self.aft_end) > slack or abs(ends[1] - self.forward_end) > slack:
            raise DataError(
                f"modes are given from {ends[0]:g} to {ends[1]:g} m, the vehicle reaches from {self.aft_end:g} to "
                f"{self.forward_end:g} m; give them from end to end"
            )

    def _check_names(self) -> None:
        """Refuse names of things that are not there."""
        names = [*(tank.name for tank in self.tanks), *(grain.name for grain in self.grains)]
        for group in self.engines:
            for tank in (*group.draws, *group.residual):
                if tank not in names:
                    raise UnknownNameError("tank", tank, names)
        for jettison in self.jettisons:
            jettison.require_known(
                [m.name for m in self.masses], [g.name for g in self.grains], [c.name for c in self.normal_force]
            )

    @property
    def stores(self) -> dict[str, float]:
        """What changes in flight, by name, and what is there of it at release (kg): liquid, grains, dropped items."""
        dropped = {name for jettison in self.jettisons for name in jettison.masses}
        return {
            **{tank.name: tank.liquid for tank in self.tanks},
            **{grain.name: grain.propellant for grain in self.grains},
            **{item.name: item.mass for item in self.masses if item.name in dropped},
        }

    def forward_of_gimbal(self, station: float) -> float:
        """Return metres forward of the gimbal plane."""
        return station - self.gimbal_station
