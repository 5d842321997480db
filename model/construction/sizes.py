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
        impulse = group.vacuum_thrust / (GRAVITY * group.mass_flow)
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
        (0.02, 4.0),
        (-1.0, 40.0),
        f"has a drag coefficient of {coefficient:g}; look at its area",
    )
    slope = np.array([max(c.slope.max(), -c.slope.min()) for c in construction.normal_force])
    for component, size in zip(construction.normal_force, slope, strict=True):
        yield from beyond(
            f"normal_force.{component.name}.file", float(size), (0.0, 60.0), (0.0, 6000.0),
            f"has a slope of {size:g} per rad; look at its unit (1/rad) and at reference_area_m2",
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
    altitude = construction.site.altitude
    yield from beyond(
        "site.altitude_m", altitude, (-500.0, 15_000.0), (-5000.0, 80_000.0),
        f"is {altitude:g} m, where no flight begins; look at its unit",
    )  # fmt: skip
