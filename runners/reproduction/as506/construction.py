"""AS-506 (Apollo 11) out of AS-504's construction: the flight whose evaluation report is public.

What differs stands in construction.toml beside this file, with where it was found. Shape, stiffness, aerodynamics and
atmosphere are AS-504's.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ....model.construction.construction import Construction
from ....model.construction.flight import EngineGroup
from ....model.errors import DataError
from ....model.files.toml_file import Positive, Section, read_toml

FILE = Path(__file__).with_name("construction.toml")
AS504_CENTER_CUTOFF = 134.34  # s, where flow and thrust jump in AS-504's engine files
ROUNDING = 10.0  # kg, of the two dozen lines of the report's tables


class BelowTank(Section):
    """Liquid below a tank, and how much of it leaves before cutoff."""

    item: str
    tank: str
    mass_kg: Positive
    leaves_kg: Positive


class Items(Section):
    """Items of AS-504 that have a mass together."""

    mass_kg: Positive
    items: tuple[str, ...]


class Tilt(Section):
    """A piece of the tilt programme over time since time base 1."""

    from_s: float
    to_s: float
    coefficients_deg: tuple[float, ...]


class Differences(Section):
    """What AS-506 has of its own."""

    release_mass_kg: Positive
    center_cutoff_s: Positive
    outboard_cutoff_s: Positive
    azimuth_deg: float
    pitch_arrest_s: Positive
    below_tank: BelowTank
    liquid_kg: dict[str, Positive]
    left_kg: dict[str, Positive]
    masses: tuple[Items, ...]
    tilt: tuple[Tilt, ...]

    @property
    def liquid(self) -> dict[str, float]:
        """Liquid in the tanks at release (kg)."""
        below = self.below_tank
        return self.liquid_kg | {below.tank: self.liquid_kg[below.tank] + below.leaves_kg}


def as506(as504: Construction) -> Construction:
    """Return the construction of AS-506.

    Parameters
    ----------
    as504 : Construction
        The shipped one.

    Raises
    ------
    DataError
        The masses do not add up to the vehicle's.
    """
    own = read_toml(FILE, Differences)
    masses, below = {m.name: m for m in as504.masses}, own.below_tank
    changed = {below.item: below.mass_kg - below.leaves_kg}
    for group in own.masses:
        factor = group.mass_kg / sum(masses[item].mass for item in group.items)
        changed |= {item: factor * masses[item].mass for item in group.items}
    total = sum(changed.values()) + sum(own.liquid.values())
    if abs(total - own.release_mass_kg) > ROUNDING:
        raise DataError(f"is not the sum of masses and liquids, {total:.0f} kg", file=FILE, column="release_mass_kg")
    segments = np.array([[t.from_s, t.to_s, *-np.deg2rad(t.coefficients_deg)] for t in own.tilt])
    return replace(
        as504,
        name="as506",
        masses=tuple(replace(m, mass=changed[m.name]) for m in as504.masses),
        tanks=tuple(replace(t, liquid=own.liquid[t.name]) for t in as504.tanks),
        engines=tuple(_engines(g, own) for g in as504.engines),
        pitch=replace(as504.pitch, arrest=own.pitch_arrest_s, segments=segments),
        site=replace(as504.site, azimuth=float(np.deg2rad(own.azimuth_deg))),
        end_time=own.outboard_cutoff_s,
    )


def _engines(group: EngineGroup, own: Differences) -> EngineGroup:
    """Return a group with AS-506's cutoff; the jump of flow and thrust moves there from AS-504's."""
    used = {tank: own.liquid[tank] - left for tank, left in own.left_kg.items()}
    draws = {tank: mass / sum(used.values()) for tank, mass in used.items()}
    time = group.time.copy()
    near = abs(time - AS504_CENTER_CUTOFF) < 1e-3
    time[near] += own.center_cutoff_s - AS504_CENTER_CUTOFF
    cutoff = own.outboard_cutoff_s if group.gimballed else own.center_cutoff_s
    return replace(group, time=time, draws=draws, cutoff=cutoff, residual={})
