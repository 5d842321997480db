"""Sizes that hardly go together in a construction: units, areas and stiffnesses that no vehicle has."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import DataError, PlausibilityWarning
from .construction import Construction
from .tank_shape import TankShape

GRAVITY = 9.80665  # m/s2
LARGEST_MACH = 40.0
LARGEST_REMAINDER = 0.1  # of the burn, by which tanks may differ
LARGEST_KICK = math.radians(0.5)
SMALLEST_GAP = 0.02  # of the vehicle's length, without mass


def check_sizes(construction: Construction, file: Path) -> None:
    """Warn of sizes that hardly go together in a construction, and refuse those that no vehicle could mean.

    Raises
    ------
    DataError
        Both numbers and what to look at.
    """
    found = list(_sizes(construction))
    for column, why, refused in sorted(found, key=lambda f: not f[2]):
        if refused:
            raise DataError(why, file=file, column=column)
        warnings.warn(f"{file}, column '{column}': {why}", PlausibilityWarning, stacklevel=3)


def _sizes(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """Yield key, sentence, and whether it is refused."""

    def beyond(
        column: str, x: float, warned: tuple[float, float], refused: tuple[float, float], why: str
    ) -> Iterator[tuple[str, str, bool]]:
        if not warned[0] <= x <= warned[1]:
            yield column, why, not refused[0] <= x <= refused[1]

    for group in construction.engines:
        burning = (group.vacuum_thrust > 0) & (group.mass_flow > 0)
        impulse = np.where(burning, group.vacuum_thrust, 300.0) / (
            GRAVITY * np.where(burning, group.mass_flow, 1 / GRAVITY)
        )
        k = int(np.argmax(np.abs(np.log(impulse / 300))))
        yield from beyond(
            f"engines.{group.name}.file", float(impulse[k]), (180, 500), (30, 2000),
            f"has {group.vacuum_thrust[k]:g} N from {group.mass_flow[k]:g} kg/s at {group.time[k]:g} s, a specific "
            f"impulse of {impulse[k]:.4g} s in vacuum; look at the units of vacuum_thrust and mass_flow",
        )  # fmt: skip
    thrust = sum(
        g.count * float(np.interp(construction.site.release, g.time, g.vacuum_thrust)) for g in construction.engines
    )
    mass = sum(m.mass for m in construction.masses) + sum(t.liquid for t in construction.tanks)
    mass += sum(g.propellant for g in construction.grains)
    yield from beyond(
        "engines", thrust / (GRAVITY * mass), (1.0, 6.0), (0.5, 60.0),
        f"make {thrust:.4g} N in vacuum at release, {thrust / (GRAVITY * mass):.3g} times the weight of {mass:.4g} kg; "
        "look at count, units of vacuum_thrust, masses and liquids",
    )  # fmt: skip
    for tank in construction.tanks:
        yield from beyond(
            f"tanks.{tank.name}.density_kg_m3", tank.density, (50, 2500), (5, 25_000),
            f"is {tank.density:g}, which no propellant has (hydrogen 71, kerosene 810, oxygen 1141); look at its unit",
        )  # fmt: skip
        share = tank.liquid / (tank.density * TankShape.of(tank).capacity)
        yield from beyond(
            f"tanks.{tank.name}.liquid_kg", share if tank.liquid else 1.0, (0.02, 1.0), (0.0, math.inf),
            f"is {tank.liquid:g} kg, {100 * share:.2g} % of what the tank holds; look at the units of both",
        )  # fmt: skip
    if construction.tanks:
        radius = max(TankShape.of(tank).largest_radius for tank in construction.tanks)
        circle = math.pi * radius**2
        yield from beyond(
            "reference_area_m2", construction.reference_area / circle, (0.2, 8.0), (0.002, 800.0),
            f"is {construction.reference_area:g}, where the widest tank has a section of {circle:.4g} m2; look at "
            "the units of both",
        )  # fmt: skip
        length = construction.forward_end - construction.aft_end
        yield from beyond(
            "forward_end_m", length / (2 * radius), (2.0, 60.0), (0.5, 600.0),
            f"makes a vehicle {length:.4g} m long, where the widest tank is {2 * radius:.3g} m wide; look at the units "
            "of both",
        )  # fmt: skip
    coefficient = float(construction.drag.coefficient.max())
    yield from beyond(
        "drag.file",
        coefficient,
        (0.1, 1.5),
        (-1.0, 40.0),
        f"has a drag coefficient of {coefficient:g}, where slender launchers have 0.2 to 0.8; look at its area",
    )
    slope = np.array([max(c.slope.max(), -c.slope.min()) for c in construction.normal_force])
    for component, size in zip(construction.normal_force, slope, strict=True):
        yield from beyond(
            f"normal_force.{component.name}.file", float(size), (0.0, 12.0), (0.0, 6000.0),
            f"has a slope of {size:g} per rad, where a slender nose makes 2 on its own cross-section, and fins "
            "some; look at its unit (1/rad) and at reference_area_m2",
        )  # fmt: skip
    radii = np.sqrt(construction.stiffness.bending / construction.stiffness.shear / 2.6)
    for station, radius in zip(construction.stiffness.station, radii, strict=True):
        sizes = list(beyond(
            "stiffness.file", float(radius), (0.005, 50.0), (5e-6, 5e4),
            f"has bending and shear at station {station:g} m that a thin wall of {radius:.3g} m radius would have "
            "(EI / kGA = 2.6 R^2); look at the units, N m2 and N",
        ))  # fmt: skip
        if sizes:
            yield from sizes
            break
    yield from _widths(construction)
    yield from _gaps(construction)
    yield from _machs(construction)
    yield from _propellants(construction)
    yield from _pitch(construction)
    altitude = construction.site.altitude
    yield from beyond(
        "site.altitude_m", altitude, (-500.0, 15_000.0), (-5000.0, 80_000.0),
        f"is {altitude:g} m, where no flight begins; look at its unit",
    )  # fmt: skip


def _widths(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """Radii that stiffnesses and masses tell of, against that of the reference area."""
    own = math.sqrt(construction.reference_area / math.pi)
    stiffness = construction.stiffness
    radii = np.sqrt(stiffness.bending / stiffness.shear / 2.6)
    k = int(np.argmax(radii))
    if not 0.3 <= radii[k] / own <= 2.0:
        why = (
            f"has bending and shear of thin walls of at most {radii[k]:.3g} m radius (EI / kGA = 2.6 R^2, at station "
            f"{stiffness.station[k]:g} m), where reference_area_m2 is a circle of {own:.3g} m radius; look at the "
            "units of bending, shear and area"
        )
        yield "stiffness.file", why, False
    wide = max(construction.masses, key=lambda m: m.radius, default=None)
    if wide is not None and wide.radius > 1.5 * own:
        why = (
            f"has a radius of gyration of {wide.radius:g} m for '{wide.name}', where reference_area_m2 is a circle of "
            f"{own:.3g} m radius; look at its unit"
        )
        yield "masses.file", why, False


def _gaps(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """Stretches of the vehicle without any mass."""
    aft, forward = construction.aft_end, construction.forward_end
    reached = aft
    for mass in sorted((*construction.masses, *construction.grains), key=lambda m: m.begin):
        yield from _gap(reached, mass.begin, forward - aft)
        reached = max(reached, mass.end)
    yield from _gap(reached, forward, forward - aft)


def _gap(begin: float, end: float, length: float) -> Iterator[tuple[str, str, bool]]:
    if end - begin > SMALLEST_GAP * length:
        why = f"has nothing between {begin:g} and {end:g} m of the vehicle; add the masses if their rows were lost"
        yield "masses.file", why, False


def _machs(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """Mach numbers that no ascent reaches in the air: another unit."""
    curves = {"drag.file": construction.drag.mach}
    curves |= {f"normal_force.{c.name}.file": c.mach for c in construction.normal_force}
    for key, mach in curves.items():
        if mach[-1] > LARGEST_MACH:
            why = f"goes up to Mach {mach[-1]:g}, where no ascent meets air any more; look at the column mach"
            yield key, why, False


def _propellants(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """Tanks run dry together, and engines draw all that they burn from them."""
    flow = dict.fromkeys((t.name for t in construction.tanks), 0.0)
    residual = dict(flow)
    for group in (g for g in construction.engines if not g.solid):
        drawn = sum(group.draws.values())
        if group.draws and drawn < 0.95:
            why = f"take {drawn:.3g} of the flow from tanks, the rest from nowhere; shares of all propellants make 1"
            yield f"engines.{group.name}.draws", why, False
        for tank, share in group.draws.items():
            flow[tank] += group.count * share * float(group.mass_flow.mean())
        for tank, left in group.residual.items():
            residual[tank] = max(residual[tank], left)
    lasting = {t.name: (t.liquid - residual[t.name]) / flow[t.name] for t in construction.tanks if flow[t.name] > 0}
    if lasting:
        first, last = min(lasting, key=lasting.__getitem__), max(lasting, key=lasting.__getitem__)
        if lasting[first] < (1 - LARGEST_REMAINDER) * lasting[last]:
            why = (
                f"lasts for {lasting[first]:.4g} s in {first} and {lasting[last]:.4g} s in {last}, and much of that is "
                "left over; look at liquid_kg, residual_kg and the shares of draws"
            )
            yield f"tanks.{first}.liquid_kg", why, False


def _pitch(construction: Construction) -> Iterator[tuple[str, str, bool]]:
    """A pitch programme begins vertically and ends downrange."""
    pitch = construction.pitch
    if pitch.kind == "polynomials":
        (begin, end, *powers), (last_begin, last_end, *last_powers) = pitch.segments[0], pitch.segments[-1]
        first = float(np.polynomial.polynomial.polyval(np.clip(pitch.begin, begin, end), powers))
        last = float(np.polynomial.polynomial.polyval(np.clip(pitch.arrest, last_begin, last_end), last_powers))
    else:
        first, last = float(pitch.angle[0]), float(pitch.angle[-1])
    if abs(first) > LARGEST_KICK:
        why = f"begins at {math.degrees(first):.3g} deg, to which the axis jumps from the vertical; add the rows before"
        yield "pitch.file", why, False
    if last < 0:
        why = (
            f"ends at {math.degrees(last):.3g} deg: uprange; pitch is positive downrange, towards azimuth_deg. Look at "
            "its sign"
        )
        yield "pitch.file", why, False
