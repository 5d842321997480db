"""What a vehicle's tables state twice is compared: dynamic pressure, speed and altitude, forces, mass and stations.

Every check holds a number of one table against others over the rows of the trajectory. Beyond a first limit it is a
warning, beyond a second an error; the limits are wide for what vehicles may be and narrow for a wrong unit, sign or
column. docs/bring-your-own-vehicle.md lists them.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError, PlausibilityWarning
from ..standard_atmosphere import EARTH_RADIUS, GRAVITY, HIGHEST, LOWEST, standard_air
from ..tables import Table
from .biases import vehicle_biases
from .columns import OWN_ANGLE

if TYPE_CHECKING:
    from .vehicle import Vehicle

Array = NDArray[np.float64]

FELT = 0.1  # of the largest dynamic pressure: below, ratios to it are of no consequence
SHORTEST = 0.01  # s, between rows whose difference is taken as a rate
SLOSH_ROOT = 1.841  # omega^2 R / a of the first lateral mode in a deep circular tank
SAME_TANK = 1.2  # times the radius that a frequency belongs to at most, while all of the liquid sloshes that ever does
SAME_STATION = 1e-3  # m
# one sigma of biases: number shown of what is kept, least and largest of them without a word, in what unit
RELATIVE_BIAS = 1.0, 5e-4, 0.2, "parts of 1"
BIASES = {
    "center_of_gravity_offset": (1.0, 1e-4, 0.5, "m"),
    "thrust_misalignment": (math.degrees(1.0), 1e-3, 1.0, "degrees"),
    "wind": (1.0, 5e-4, 0.5, "parts of 1"),
}
STRIPS = 1e-3  # of their size, by which strips of the normal force may miss the vehicle's own
CURVED = 3.0  # times the waves of a uniform beam: slopes change faster where a vehicle is slender
NEAREST = 0.02  # of the length, between places whose displacements tell a slope
MOST_TOLD = 3
_GROUPS = {  # tables without a prefix, by the file they stand in; the others are the trajectory's
    **dict.fromkeys(("mass", "moment_of_inertia", "center_of_gravity"), "rigid_body"),
    **dict.fromkeys(("thrust", "control_thrust"), "propulsion"),
    **dict.fromkeys(("normal_force_slope", "center_of_pressure"), "aerodynamics"),
}


@dataclass(frozen=True)
class Contradiction:
    """Two statements of a vehicle's files that do not go together.

    Attributes
    ----------
    why : str
        Both numbers, and what to look at.
    file : Path
    column : str
    time : float or None
        Of the largest disagreement (s).
    refused : bool
        Whether no vehicle could be meant.
    """

    why: str
    file: Path
    column: str
    time: float | None
    refused: bool


def check_plausibility(vehicle: Vehicle) -> None:
    """Warn of contradictions between a vehicle's tables, and refuse those that no vehicle could mean.

    Raises
    ------
    DataError
        File, column, time, both numbers, and what to look at.
    """
    found = sorted(contradictions(vehicle), key=lambda c: not c.refused)
    if found and found[0].refused:
        first, *others = found
        also = "".join(f"; also {c.file.name}, '{c.column}': {c.why}" for c in others[: MOST_TOLD - 1])
        raise DataError(first.why + also, file=first.file, column=first.column, time=first.time)
    for one in found:
        at = "" if one.time is None else f", t = {one.time:g} s"
        warnings.warn(f"{one.file}, column '{one.column}'{at}: {one.why}", PlausibilityWarning, stacklevel=3)


def contradictions(vehicle: Vehicle) -> list[Contradiction]:
    """Return everything that does not go together in a vehicle's tables."""
    compared = _Compared(vehicle)
    return [
        *compared.air(),
        *compared.climb(),
        *compared.acceleration(),
        *compared.drag(),
        *compared.propellant(),
        *compared.control_thrust(),
        *compared.slosh(),
        *compared.bending(),
        *compared.aerodynamics(),
        *compared.moments(),
        *compared.stations(),
        *compared.strips(),
        *compared.rows(),
        *compared.ends(),
        *assumptions(vehicle),
    ]


def assumptions(vehicle: Vehicle) -> Iterator[Contradiction]:
    """Yield noise levels and dampings of vehicle.toml that are none of a launch vehicle; zero switches them off."""
    toml, flight = vehicle.folder / "vehicle.toml", vehicle.end - vehicle.start

    def beyond(key: str, x: float, low: float, high: float, why: str) -> Iterator[Contradiction]:
        if x != 0 and not low <= x <= high:
            yield Contradiction(f"is {x:g}, {why}", toml, key, None, False)

    for name, noise in vehicle.file.noise.items():
        tables = " and ".join(noise.tables)
        yield from beyond(
            f"noise.{name}.sigma", noise.sigma, 5e-4, 0.2,
            f"{100 * noise.sigma:.3g} % of {tables}, which is known to better than a fifth and worse than a "
            "two-thousandth; it is a relative deviation, 0.01 for 1 %",
        )  # fmt: skip
        if not noise.white:
            yield from beyond(
                f"noise.{name}.correlation_time_s", noise.correlation_time_s, 0.02, flight,
                f"where the flight lasts {flight:.3g} s and no deviation of {tables} changes within 0.02 s; it is in "
                "seconds",
            )  # fmt: skip
    for bias in vehicle_biases(vehicle.file).values():
        shown, low, high, unit = BIASES.get(bias.key, RELATIVE_BIAS)
        yield from beyond(
            f"biases.{bias.key}", shown * bias.standard_deviation, low, high,
            f"one sigma in {unit}; those of launch vehicles lie between {low:g} and {high:g}",
        )  # fmt: skip
    text = "of the critical damping, where {} have {}; it is a ratio, not a percentage"
    for i, mode in enumerate(vehicle.file.bending):
        key = f"bending.{i}.damping"
        yield from beyond(key, mode.damping, 5e-4, 0.05, text.format("bending modes", "0.001 to 0.03"))
    for i, tank in enumerate(vehicle.file.slosh):
        key = f"slosh.{i}.damping"
        yield from beyond(key, tank.damping, 1e-4, 0.3, text.format("liquids", "0.0005 in smooth tanks to 0.1 baffled"))


class _Compared:
    """The vehicle's numbers at the rows of its trajectory."""

    def __init__(self, vehicle: Vehicle):
        self.vehicle = vehicle
        rows = vehicle.tables["altitude"].argument
        inside = rows[(rows >= vehicle.start) & (rows <= vehicle.end)]
        self.time = np.unique([vehicle.start, *inside, vehicle.end])
        self.files = {source.name: source.file for source in vehicle.sources}
        self.q = self.at("dynamic_pressure")
        self.felt = self.q > FELT * self.q.max()
        self.area = vehicle.file.reference_area_m2
        self.mass, self.center = self.at("mass"), self.at("center_of_gravity")
        self.gyration = np.sqrt(self.at("moment_of_inertia") / self.mass)

    def at(self, name: str) -> Array:
        return np.asarray(self.vehicle.tables[name].polynomial(self.time))

    def beyond(
        self,
        table: str,
        column: str,
        measure: Array,
        warned: tuple[float, float],
        refused: tuple[float, float],
        what: str,
        where: NDArray[np.bool_] | None = None,
        **numbers: Array | float,
    ) -> Iterator[Contradiction]:
        """Yield the time at which a measure is farthest outside of its limits, if it is outside at any.

        Parameters
        ----------
        measure : (t,) array
        warned, refused : (float, float)
            Least and largest value without a word, and that is taken at all.
        what : str
            Sentence with the measure as ``{x}`` and the ``numbers`` at that time by name.
        where : (t,) array of bool, optional
            Times that count.
        """
        counts = np.ones(measure.shape, bool) if where is None else where
        outside = np.maximum(_excess(measure, warned[0], -1), _excess(measure, warned[1], 1))
        outside = np.where(counts & np.isfinite(measure), outside, 0.0)
        k = int(np.argmax(outside))
        if outside[k] <= 0:
            return
        x = float(measure[k])
        shown = {name: float(np.broadcast_to(values, measure.shape)[k]) for name, values in numbers.items()}
        yield Contradiction(
            what.format(x=x, **shown),
            self.files[table],
            column,
            float(self.time[k]),
            not refused[0] <= x <= refused[1],
        )

    def air(self) -> Iterator[Contradiction]:
        """q = rho V^2 / 2 with the density of the 1976 standard atmosphere."""
        height, speed = self.at("altitude"), self.at("relative_velocity")
        density, _ = standard_air(np.clip(height, LOWEST, HIGHEST))
        yield from self.beyond(
            "trajectory", "dynamic_pressure", 2 * self.q / speed**2 / density, (0.75, 1.3), (0.5, 2.0),
            "is {q:.4g} Pa, but half the density times the speed squared is {there:.4g} Pa ({speed:.4g} m/s, "
            "{density:.3g} kg/m3 by the 1976 standard atmosphere at {height:.5g} m); look at the units and rows of "
            "dynamic_pressure, relative_velocity and altitude",
            self.felt, q=self.q, there=density * speed**2 / 2, speed=speed, density=density, height=height,
        )  # fmt: skip

    def climb(self) -> Iterator[Contradiction]:
        """The altitude does not rise faster than the vehicle flies, nor hardly at all; the speed follows the forces."""
        height, speed, step = self.at("altitude"), self.at("relative_velocity"), np.diff(self.time)
        long_enough = np.append(step >= SHORTEST, False)

        def over(values: Array) -> Array:
            return np.append(0.5 * (values[1:] + values[:-1]), np.nan)

        def rate(values: Array) -> Array:
            return np.append(np.diff(values) / step, np.nan)

        climbing = rate(height)
        yield from self.beyond(
            "trajectory", "altitude", climbing / over(speed), (0.0, 1.03), (-np.inf, 1.2),
            "rises by {climb:.4g} m/s, faster than the vehicle flies, {speed:.4g} m/s; look at the units and rows of "
            "altitude and relative_velocity",
            long_enough, climb=climbing, speed=over(speed),
        )  # fmt: skip
        flown = float(np.trapezoid(speed, self.time))
        gained = height - height[0]
        yield from self.beyond(
            "trajectory", "altitude", gained / flown, (0.05, np.inf), (0.01, np.inf),
            "has risen by {gained:.4g} m over a flight of {flown:.4g} m at relative_velocity: hardly a climb; look at "
            "the units of altitude (m) and relative_velocity (m/s)",
            self.time == self.time[-1], gained=gained, flown=flown,
        )  # fmt: skip
        sine = np.clip(climbing / over(speed), -1, 1)
        forces = over(self.at("axial_acceleration"))
        along = forces - GRAVITY * (EARTH_RADIUS / (EARTH_RADIUS + over(height))) ** 2 * sine
        gaining = rate(speed)
        scale = 10.0 + np.abs(forces)
        yield from self.beyond(
            "trajectory", "relative_velocity", (gaining - along) / scale, (-0.2, 0.2), (-1.0, 1.0),
            "changes by {gain:.4g} m/s2, but axial_acceleration less gravity along the path makes {along:.4g} m/s2; "
            "look at the units and rows of relative_velocity, axial_acceleration and altitude",
            long_enough, gain=gaining, along=along,
        )  # fmt: skip

    def acceleration(self) -> Iterator[Contradiction]:
        """(thrust - drag) / mass."""
        stated, thrust, drag = self.at("axial_acceleration"), self.at("thrust"), self.at("axial_drag")
        made = (thrust - drag) / self.mass
        yield from self.beyond(
            "trajectory", "axial_acceleration", (stated - made) / (1.0 + np.maximum(abs(stated), abs(made))),
            (-0.05, 0.05), (-0.3, 0.3),
            "is {stated:.4g} m/s2, but (thrust - axial_drag) / mass = ({thrust:.4g} N - {drag:.4g} N) / {mass:.4g} kg "
            "is {made:.4g} m/s2 (gravity is no part of it); look at the units and rows of the four",
            stated=stated, thrust=thrust, drag=drag, mass=self.mass, made=made,
        )  # fmt: skip

    def drag(self) -> Iterator[Contradiction]:
        drag = self.at("axial_drag")
        yield from self.beyond(
            "trajectory", "axial_drag", drag / (self.q * self.area), (0.1, 1.5), (-0.1, 40.0),
            "is {drag:.4g} N, which on {area:g} m2 at {q:.4g} Pa is a drag coefficient of {x:.3g}, where slender "
            "launchers have 0.2 to 0.8; look at the units of axial_drag, dynamic_pressure and reference_area_m2",
            self.felt, drag=drag, area=self.area, q=self.q,
        )  # fmt: skip

    def propellant(self) -> Iterator[Contradiction]:
        """The mass falls, by what a rocket of some specific impulse needs for the thrust."""
        impulse = float(np.trapezoid(self.at("thrust"), self.time))
        used = self.mass[0] - self.mass
        last = self.time == self.time[-1]
        text = (
            "falls by {used:.4g} kg over thrust of {impulse:.4g} N s: a specific impulse of {x:.4g} s; look at the "
            "units and rows of mass and thrust"
        )
        specific = impulse / (GRAVITY * np.maximum(used, 1e-9 * self.mass[0]))
        yield from self.beyond(
            "rigid_body", "mass", specific, (100.0, 600.0), (30.0, np.inf), text, last, used=used, impulse=impulse
        )
        later = np.append(np.diff(self.mass), np.nan) / self.mass
        yield from self.beyond(
            "rigid_body", "mass", later, (-np.inf, 1e-4), (-np.inf, 0.05),
            "rises from {mass:.6g} kg to {next:.6g} kg in the next row; correct the row",
            mass=self.mass, next=np.append(self.mass[1:], np.nan),
        )  # fmt: skip

    def control_thrust(self) -> Iterator[Contradiction]:
        thrust, part = self.at("thrust"), self.at("control_thrust")
        yield from self.beyond(
            "propulsion", "control_thrust", part / np.maximum(thrust, 1e-300), (0.0, 1 + 1e-6), (-np.inf, 1.05),
            "is {part:.4g} N, more than the whole thrust, {thrust:.4g} N; look at the two columns",
            part=part, thrust=thrust,
        )  # fmt: skip
        share = part / np.maximum(thrust, 1e-300)
        which = np.searchsorted(self.vehicle.tables["thrust"].breaks, self.time, side="right")
        phases, phase = np.unique(which, return_inverse=True)
        usual = np.array([np.median(share[which == k]) for k in phases])[phase]
        yield from self.beyond(
            "propulsion", "control_thrust", share / np.maximum(usual, 1e-300), (0.97, 1.03), (-np.inf, np.inf),
            "is {x:.4g} times its usual share {usual:.4g} of the thrust, {thrust:.4g} N, though no event lies between: "
            "look at the rows of the two columns, or name the time at which engines stop under [events]",
            share > 0, usual=usual, thrust=thrust,
        )  # fmt: skip

    def slosh(self) -> Iterator[Contradiction]:
        """Frequencies of a tank of some radius at the axial acceleration; masses below the vehicle's."""
        acceleration, total = self.at("axial_acceleration"), np.zeros_like(self.time)
        for tank in self.vehicle.slosh:
            table = f"slosh.{tank.name}"
            frequency = self.at(f"{table}.frequency")
            radius = SLOSH_ROOT * acceleration / frequency**2
            yield from self.beyond(
                table, "frequency", radius, (0.03, 15.0), (0.0003, 1500.0),
                "is {frequency:.4g} rad/s, which at {acceleration:.4g} m/s2 belongs to a tank of {x:.3g} m radius; "
                "look at its unit and that of axial_acceleration",
                acceleration > 0.5 * GRAVITY, frequency=frequency, acceleration=acceleration,
            )  # fmt: skip
            own = np.sqrt(self.area / np.pi)
            yield from self.beyond(
                table, "frequency", radius / own, (0.1, 1.5), (0.0, np.inf),
                "is {frequency:.4g} rad/s, which at {acceleration:.4g} m/s2 belongs to a tank of {radius:.3g} m "
                "radius, where reference_area_m2 is a circle of {own:.3g} m; look at its unit, rad/s, and at both",
                self.time == self.time[0], frequency=frequency, acceleration=acceleration, radius=radius, own=own,
            )  # fmt: skip
            mass = self.at(f"{table}.mass")
            full = (mass > 0.98 * mass.max()) & (acceleration > 0)
            usual = float(np.median(radius[full])) if full.any() else np.inf
            yield from self.beyond(
                table, "frequency", radius / usual, (1 / SAME_TANK, SAME_TANK), (0.0, np.inf),
                "is {frequency:.4g} rad/s, which at {acceleration:.4g} m/s2 belongs to a tank of {radius:.3g} m "
                "radius, at other times to one of {usual:.3g} m; look at its rows and those of axial_acceleration",
                full, frequency=frequency, acceleration=acceleration, radius=radius, usual=usual,
            )  # fmt: skip
            yield from self.beyond(
                table, "mass", mass / self.mass, (1e-4, np.inf), (0.0, np.inf),
                "is at most {own:.3g} kg on a vehicle of {mass:.4g} kg; look at its unit, or leave the tank out",
                mass == mass.max(), own=mass, mass=self.mass,
            )  # fmt: skip
            total += mass
        if self.vehicle.slosh:
            yield from self.beyond(
                f"slosh.{self.vehicle.slosh[0].name}", "mass", total / self.mass, (0.0, 0.9), (0.0, 1.0),
                "of all tanks together is {total:.4g} kg, the vehicle's {mass:.4g} kg; look at the units and tanks",
                total=total, mass=self.mass,
            )  # fmt: skip
        yield from self._twice("slosh", [f"slosh.{tank.name}" for tank in self.vehicle.slosh], "mass", "frequency")

    def bending(self) -> Iterator[Contradiction]:
        """First frequency times length of the uniform beam of this inertia: some hundred m/s on every vehicle."""
        tables = [f"bending.{i}" for i in range(1, len(self.vehicle.bending) + 1)]
        length = np.sqrt(12) * self.gyration
        for table in tables[:1]:
            frequency = self.at(f"{table}.frequency")
            yield from self.beyond(
                table, "frequency", frequency * length, (150.0, 6000.0), (1.5, 1e6),
                "of {frequency:.4g} rad/s on a vehicle that by its inertia is about {length:.3g} m long would be that "
                "of no launch vehicle; look at its unit (rad/s), and at moment_of_inertia and mass",
                frequency=frequency, length=length,
            )  # fmt: skip
        for lower, higher in pairwise(tables):
            one, other = self.at(f"{lower}.frequency"), self.at(f"{higher}.frequency")
            yield from self.beyond(
                higher, "frequency", other / one, (1.0, 5.0), (0.0, np.inf),
                "of {other:.4g} rad/s is {x:.3g} times that of the mode before, {one:.4g} rad/s; modes of a beam "
                "follow each other at 1.4 to 3 times: look at its unit (rad/s) and at the order of [[bending]]",
                one=one, other=other,
            )  # fmt: skip
        for table in tables:
            yield from self._shape(table, length)
            yield from self._turns(table, length)
        yield from self._twice("bending", tables, "frequency", "generalized_mass")

    def _turns(self, table: str, length: Array) -> Iterator[Contradiction]:
        """The slope of a mode is that of its displacement, as far as places are near each other for its waves.

        Between two places dx apart, half the sum of the slopes is off the slope of the chord by at most dx^2 / 12 times
        the third derivative, (k dx)^2 / 12 of the largest slope for waves of k = (i + 1/2) pi / length in mode i.
        """
        names = ["gimbal", *(tank.name for tank in self.vehicle.slosh)]
        places = np.array([0 * self.time, *(self.at(f"slosh.{name}.attach_point") for name in names[1:])])
        moved, turned = (
            np.array([self.at(f"{table}.{column}_at_{name}") for name in names]) for column in ("displacement", "slope")
        )
        largest = np.maximum(np.abs(turned).max(axis=0), np.abs(self.at(f"{table}.slope_at_sensor")))
        order = np.argsort(places[:, 0])
        for a, b in pairwise(order):
            apart = places[b] - places[a]
            chord = (moved[b] - moved[a]) / np.where(apart == 0, np.inf, apart)
            waves = (int(table.split(".")[1]) + 0.5) * np.pi * apart / length
            off = np.abs(chord - 0.5 * (turned[a] + turned[b])) / np.maximum(largest, 1e-300)
            yield from self.beyond(
                table, f"slope_at_{names[b]}", off / (0.1 + CURVED * waves**2 / 12), (0.0, 1.0), (0.0, np.inf),
                f"is {{there:.4g}} and slope_at_{names[a]} {{here:.4g}} per m, but displacements {{from_:.4g}} and "
                "{to:.4g} over {apart:.4g} m make a slope of {chord:.4g} per m; look at the signs and scales of both "
                "displacements and slopes",
                apart > NEAREST * length,
                there=turned[b], here=turned[a], from_=moved[a], to=moved[b], apart=apart, chord=chord,
            )  # fmt: skip

    def _shape(self, table: str, length: Array) -> Iterator[Contradiction]:
        """A mode's generalised mass, displacements and slopes against each other, the mass and the normal force."""
        names = [name.removeprefix(f"{table}.") for name in self.vehicle.tables if name.startswith(f"{table}.")]
        moved = self._largest(table, [n for n in names if n.startswith("displacement_at_")])
        turned = self._largest(table, [n for n in names if n.startswith("slope_at_")])
        share = self.at(f"{table}.generalized_mass") / (self.mass * np.maximum(moved, 1.0) ** 2)
        yield from self.beyond(
            table, "generalized_mass", share, (1e-3, 2.0), (0.0, np.inf),
            "is {x:.3g} times the vehicle's mass of {mass:.4g} kg at displacements up to {moved:.3g}; look at its unit "
            "and at the scale of the mode's displacements",
            mass=self.mass, moved=moved,
        )  # fmt: skip
        yield from self.beyond(
            table, "slope_at_gimbal", turned * length / np.maximum(moved, 1e-300), (0.1, 100.0), (0.0, np.inf),
            "and the other slopes reach {turned:.3g} per m, the displacements {moved:.3g}, on a vehicle about "
            "{length:.3g} m long; look at the units of slopes (1/m) and displacements",
            turned=turned, moved=moved, length=length,
        )  # fmt: skip
        slope = np.abs(self.at("normal_force_slope"))
        for column, size in (("displacement", np.maximum(moved, 1.0)), ("slope", turned)):
            name = f"normal_force_slope_times_{column}"
            if f"{table}.{name}" not in self.vehicle.tables:
                continue  # only read where a noise moves the normal force
            values = self.at(f"{table}.{name}")
            part = np.abs(values) / np.maximum(slope * size, 1e-300)
            largest = (part == part[self.felt].max()) & self.felt
            for limits, rows in (((0.0, 5.0), self.felt), ((1e-3, np.inf), largest)):
                yield from self.beyond(
                    table, name, part, limits, (0.0, np.inf),
                    f"is {{values:.4g}}, but normal_force_slope is {{slope:.4g}} and the mode's {column} at "
                    "most {size:.3g}; look at its scale",
                    rows, values=values, slope=slope, size=size,
                )  # fmt: skip

    def _largest(self, table: str, columns: list[str]) -> Array:
        return np.max([np.abs(self.at(f"{table}.{c}")) for c in columns], axis=0)

    def aerodynamics(self) -> Iterator[Contradiction]:
        slope = self.at("normal_force_slope")
        yield from self.beyond(
            "aerodynamics", "normal_force_slope", slope, (1.0, 20.0), (-6000.0, 6000.0),
            "of {slope:.4g} per rad is none that a launch vehicle has on its own cross-section ({area:g} m2), where a "
            "slender body that begins in a tip makes 2; look at its unit (1/rad), its sign and at reference_area_m2",
            self.felt, slope=slope, area=self.area,
        )  # fmt: skip

    def moments(self) -> Iterator[Contradiction]:
        """Load coefficients against the forces that make them, times the radius of gyration."""
        air = self.q * self.area * np.abs(self.at("normal_force_slope")) * self.gyration
        engines = self.at("control_thrust") * self.gyration
        for load in self.vehicle.file.loads:
            table = f"loads.{load.output}"
            for column, scale, force in (("angle_of_attack", air, "normal force"), ("engine_angle", engines, "thrust")):
                values = self.at(f"{table}.{column}")
                size = np.abs(values) / np.maximum(scale, 1e-300)
                text = (
                    f"is {{values:.4g}} N m/rad, where the {force} at the radius of gyration makes {{scale:.4g}} N "
                    "m/rad; look at its unit and rows"
                )
                yield from self.beyond(
                    table, column, size, (0.0, 3.0), (0.0, 30.0), text, self.felt, values=values, scale=scale
                )
                largest = (size == size[self.felt].max()) & self.felt
                yield from self.beyond(
                    table, column, size, (1e-3, np.inf), (0.0, np.inf), text, largest, values=values, scale=scale
                )

        for load in self.vehicle.file.loads:
            yield from self._inertia(f"loads.{load.output}")
            if load.forward_of_gimbal_m is not None:
                yield from self._slosh_moment(f"loads.{load.output}", load.forward_of_gimbal_m)
            yield from self._moved_line(f"loads.{load.output}")

    def _moved_line(self, table: str) -> Iterator[Contradiction]:
        """A normal force moved by a metre loads no station by more than its own couple, unless parts of it oppose."""
        column = "center_of_pressure"
        if f"{table}.{column}" not in self.vehicle.tables:  # read only where a noise needs it
            return
        values = self.at(f"{table}.{column}")
        force = self.q * self.area * np.abs(self.at("normal_force_slope"))
        yield from self.beyond(
            table, column, np.abs(values) / np.maximum(force, 1e-300), (0.0, 2.0), (0.0, 20.0),
            "is {values:.4g} N/rad, where the whole normal force is {force:.4g} N/rad; look at its unit and rows",
            self.felt, values=values, force=force,
        )  # fmt: skip

    def _inertia(self, table: str) -> Iterator[Contradiction]:
        """Moments that slosh and bending leave at a station, against their masses times the radius of gyration."""
        scales = {f"slosh_{t.name}": self.at(f"slosh.{t.name}.mass") * self.gyration for t in self.vehicle.slosh}
        for i in range(1, len(self.vehicle.bending) + 1):
            scales[f"bending_{i}"] = self.mass * self.gyration
        for column, scale in scales.items():
            values = self.at(f"{table}.{column}")
            yield from self.beyond(
                table, column, np.abs(values) / scale, (0.0, 20.0), (0.0, np.inf),
                "is {values:.4g} N s2, where its mass at the radius of gyration makes {scale:.4g} kg m; look at its "
                "unit and rows",
                values=values, scale=scale,
            )  # fmt: skip

    def _slosh_moment(self, table: str, station: float) -> Iterator[Contradiction]:
        """A sloshing mass pushes its tank at the attach point: minus its moment about stations aft of that."""
        for tank in self.vehicle.slosh:
            mass, place = (self.at(f"slosh.{tank.name}.{c}") for c in ("mass", "attach_point"))
            made, values = -mass * np.maximum(place - station, 0.0), self.at(f"{table}.slosh_{tank.name}")
            yield from self.beyond(
                table, f"slosh_{tank.name}", (values - made) / (mass * self.gyration), (-0.2, 0.2), (-np.inf, np.inf),
                "is {values:.4g} N s2, but {mass:.4g} kg at {place:.4g} m make {made:.4g} N s2 at a station "
                "{station:g} m forward of the gimbal plane; look at its sign and rows, and those of mass and "
                "attach_point",
                values=values, mass=mass, place=place, made=made, station=station,
            )  # fmt: skip

    def ends(self) -> Iterator[Contradiction]:
        """All tables of the flight end together: it ends with the first of them, and times may be shifted."""
        timed = [s for s in self.vehicle.sources if not s.name.startswith(("wind", "control."))]
        common = float(np.median([s.last for s in timed]))
        usual = float(np.median(np.diff(self.time)))
        for source in timed:
            if abs(source.last - common) > 1.5 * usual:
                cut = "the flight is cut off there" if source.last < common else "is its time shifted?"
                why = (
                    f"has its last row at {source.last:g} s, where other tables end at {common:g} s: {cut}; look at "
                    "its times, add rows that are missing, or end all tables together"
                )
                yield Contradiction(why, source.file, "time", None, False)
        pressure = self.vehicle.tables["dynamic_pressure"]
        before = pressure.values[pressure.argument < self.vehicle.start]
        if before.size and self.q[0] > FELT * max(float(before.max()), float(self.q.max())):
            why = (
                f"is {self.vehicle.start:g} s, where the dynamic pressure is {self.q[0]:.4g} Pa already and the tables "
                "have earlier rows: what the wind did before is left out; start earlier"
            )
            yield Contradiction(why, self.vehicle.folder / "vehicle.toml", "start_time_s", None, False)

    def rows(self) -> Iterator[Contradiction]:
        """No row of a smooth table stands apart from those around it."""
        cornered = {column.name for column in OWN_ANGLE.values()}  # by the tilt programme
        for name, table in self.vehicle.tables.items():
            found = None if name in cornered else _apart(table)
            if found is not None:
                k, expected = found
                source = self._source(name)
                yield Contradiction(
                    f"is {table.values[k]:.6g} between rows that make {expected:.6g}; correct the row, or name its "
                    "time under [events] if the table jumps there",
                    self.files[source],
                    name.removeprefix(f"{source}.").removeprefix("control."),
                    float(table.argument[k]),
                    False,
                )
        if self.vehicle.file.wind.fitted:
            yield from self._filter_rows()

    def _filter_rows(self) -> Iterator[Contradiction]:
        """No sample of the wind filter stands apart from those around it."""
        shaping = self.vehicle.wind.shaping_filter
        for name, unit, values in (
            ("F", "per_m", shaping.F),
            ("G", "per_root_m", shaping.G),
            ("H", "m_per_s", shaping.H),
        ):
            for place in np.ndindex(values.shape[1:]):
                found = _apart(Table(name, unit, shaping.altitude, values[:, *place], "cubic", shaping.kinks))
                if found is not None:
                    k, expected = found
                    yield Contradiction(
                        f"has {values[k, *place]:.6g} in {name}{[i + 1 for i in place]} at {shaping.altitude[k]:g} m "
                        f"between samples that make {expected:.6g}; correct it",
                        self.files["wind.filter"],
                        f"{name}_{unit}",
                        None,
                        False,
                    )
                    break

    def _source(self, name: str) -> str:
        """Return under which name the file of a table is listed."""
        sensor = name.removeprefix("control.").split(".")[0]
        if name.startswith("control."):
            return f"load_relief.{sensor}" if f"load_relief.{sensor}" in self.files else "control.gains"
        prefixes = [s for s in self.files if name.startswith(f"{s}.")]
        return max(prefixes, key=len) if prefixes else _GROUPS.get(name, "trajectory")

    def stations(self) -> Iterator[Contradiction]:
        """Everything on the vehicle lies within some radii of gyration of its centre of gravity."""

        def placed(table: str, column: str, values: Array | float, reach: float = 6.0) -> Iterator[Contradiction]:
            distance = np.broadcast_to((values - self.center) / self.gyration, self.time.shape)
            yield from self.beyond(
                table, column, distance, (-reach, reach), (-3 * reach, 3 * reach),
                "of {values:.4g} m lies {x:.3g} radii of gyration ({gyration:.3g} m) from the centre of gravity at "
                "{center:.4g} m, beyond the vehicle; look at units, signs and the count of stations",
                values=values, gyration=self.gyration, center=self.center,
            )  # fmt: skip

        yield from placed("aerodynamics", "center_of_pressure", self.at("center_of_pressure"))
        yield from placed("rigid_body", "center_of_gravity", 0.0 * self.time)
        yield from self.beyond(
            "rigid_body", "center_of_gravity", self.center, (0.0, np.inf), (-np.inf, np.inf),
            "of {x:.4g} m lies aft of the engines' gimbal plane; look at its sign: metres forward of that plane",
        )  # fmt: skip
        for tank in self.vehicle.slosh:
            yield from placed(f"slosh.{tank.name}", "attach_point", self.at(f"slosh.{tank.name}.attach_point"))
        yield from self._load_stations(placed)

    def strips(self) -> Iterator[Contradiction]:
        """Strips of the normal force add up to the vehicle's own, and lie on it."""
        if self.vehicle.zones is None:
            return
        strips = self.vehicle.zones.strips
        time = strips.time[(strips.time >= self.time[0]) & (strips.time <= self.time[-1])]
        rows, tables = np.isin(strips.time, time), self.vehicle.tables
        slope = tables["normal_force_slope"].polynomial(time)
        sums = {"normal_force_slope": (strips.slope, slope, "normal_force_slope")}
        moment = slope * tables["center_of_pressure"].polynomial(time)
        sums["first_moment"] = (strips.first_moment, moment, "normal_force_slope times center_of_pressure")
        for i, shape in enumerate(strips.displacement, start=1):
            name = f"bending.{i}.normal_force_slope_times_displacement"
            sums[f"displacement_{i}"] = (shape, tables[name].polynomial(time), name)
        for column, (by_strip, whole, what) in sums.items():
            made = by_strip[rows].sum(axis=1)
            off = np.abs(made - whole)
            k = int(np.argmax(off))
            if off[k] > STRIPS * np.abs(by_strip[rows]).sum(axis=1).max():
                yield Contradiction(
                    f"adds up to {made[k]:.6g} along the vehicle, but {what} is {whole[k]:.6g}; build the tables "
                    "together, or look at units, signs and rows",
                    self.files["zones"], column, float(time[k]), False,
                )  # fmt: skip
        reach = 6 * float(self.gyration.max())
        off = np.abs(strips.forward_of_gimbal - float(np.median(self.center)))
        if off.max() > reach:
            yield Contradiction(
                f"of {strips.forward_of_gimbal[int(np.argmax(off))]:.4g} m lies beyond the vehicle, more than six "
                "radii of gyration from its centre of gravity; look at its unit and at the count of stations",
                self.files["zones"], "forward_of_gimbal", None, True,
            )  # fmt: skip

    def _load_stations(self, placed) -> Iterator[Contradiction]:
        toml = self.vehicle.folder / "vehicle.toml"
        gimbal: float | None = None  # station of the gimbal plane
        for i, load in enumerate(self.vehicle.file.loads):
            key = f"loads.{i}.station_m"
            if load.forward_of_gimbal_m is not None:
                yield from _in_toml(placed(f"loads.{load.output}", key, load.forward_of_gimbal_m), toml)
                own = load.station_m - load.forward_of_gimbal_m
                if gimbal is not None and abs(own - gimbal) > SAME_STATION:
                    yield Contradiction(
                        f"is {load.station_m:g} m and forward_of_gimbal_m {load.forward_of_gimbal_m:g} m, which puts "
                        f"the gimbal plane at station {own:g} m; the load before puts it at {gimbal:g} m; correct one",
                        toml, key, None, True,
                    )  # fmt: skip
                gimbal = own
            else:
                own, reach = (load.station_m, 60.0) if gimbal is None else (load.station_m - gimbal, 6.0)
                yield from _in_toml(placed(f"loads.{load.output}", key, own, reach), toml)
            named = station_in_name(load.table.file)
            if named is not None and not named[0] <= load.station_m <= named[1]:
                yield Contradiction(
                    f"is {load.station_m:g} m, but its table is called {load.table.file}; rename the file, or build or "
                    "enter its numbers for this station",
                    toml, key, None, False,
                )  # fmt: skip

    def _twice(self, kind: str, tables: list[str], *columns: str) -> Iterator[Contradiction]:
        """Yield tables that hold the same numbers as another one: pasted twice, they count twice."""
        for i, table in enumerate(tables):
            for other in tables[:i]:
                if all(np.array_equal(self.at(f"{table}.{c}"), self.at(f"{other}.{c}")) for c in columns):
                    why = f"holds the numbers of {self.files[other].name}; remove one [[{kind}]], or it counts twice"
                    yield Contradiction(why, self.files[table], columns[0], None, True)


def _apart(table: Table) -> tuple[int, float] | None:
    """Return the row of a table that is far off the cubic through two rows on either side, and the cubic's value there.

    It must be off by a fifth of the other rows' range, and by twenty times what nine of ten other rows are.
    """
    x, y = table.argument, table.values
    if table.interpolation not in ("cubic", "pchip") or x.size < 12:
        return None
    k = np.arange(2, x.size - 2)
    around = np.stack([k - 2, k - 1, k + 1, k + 2])
    weights = np.ones(around.shape)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[i] *= (x[k] - x[around[j]]) / (x[around[i]] - x[around[j]])
    expected = np.sum(weights * y[around], axis=0)
    off = np.abs(y[k] - expected) / np.maximum(1.0, np.abs(weights).sum(axis=0))
    for event in table.breaks:  # across a jump no row fits
        off[(x[k - 2] <= event) & (event <= x[k + 2])] = 0.0
    worst = int(np.argmax(off))
    others = np.delete(y, k[worst])
    usual = float(np.quantile(np.delete(off, range(max(worst - 2, 0), min(worst + 3, off.size))), 0.9))
    size = max(float(np.ptp(others)), 1e-2 * float(np.abs(others).max()))
    if off[worst] > max(0.2 / 3 * size, 20 * usual):
        return int(k[worst]), float(expected[worst])
    return None


def _excess(values: Array, limit: float, sign: int) -> Array:
    """Return by how much values pass a limit upwards (sign 1) or downwards (-1), relative to it if it is not zero."""
    return np.zeros_like(values) if not np.isfinite(limit) else sign * (values - limit) / (abs(limit) or 1.0)


def _in_toml(found: Iterator[Contradiction], toml: Path) -> Iterator[Contradiction]:
    for one in found:
        yield Contradiction(one.why, toml, one.column, one.time, one.refused)


def station_in_name(file: str) -> tuple[float, float] | None:
    """Return the stations (m) that a file's name can mean: 'loads_station_16m.csv' is from 15 to 17; None without."""
    match = re.search(r"station_?(\d+)(?:[._](\d+))?_?m(?![a-z])", Path(file).name)
    if match is None:
        return None
    value, step = float(f"{match[1]}.{match[2] or 0}"), 10.0 ** -len(match[2] or "")
    return value - step * (1 - 1e-9), value + step * (1 - 1e-9)
