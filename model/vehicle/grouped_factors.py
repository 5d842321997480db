"""Numbers that one cause moves together: a common factor on several tables of a vehicle."""

from __future__ import annotations

from collections.abc import Iterable

from .columns import MOVED_LINE, MOVED_MODE, PREFIX

AERODYNAMICS = "aerodynamics"
_OF_NORMAL_FORCE = ("normal_force_slope", "normal_force_slope_times_displacement", MOVED_MODE.name)
_OF_LOADS = ("angle_of_attack", MOVED_LINE.name)


def grouped_factors(tables: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return by name of a grouped factor the tables that it multiplies, of those that a vehicle has.

    'aerodynamics' is the normal force of every point of the vehicle: its slope, its work on the modes, the integrals of
    the local angle of attack, and what it does to the loads. Each force holds one of these tables, once. A factor on
    the dynamic pressure of the air is the same, and not one more: the loads' tables hold it already.
    """
    found = tuple(name for name in tables if _is_normal_force(name))
    return {AERODYNAMICS: found} if found else {}


def _is_normal_force(name: str) -> bool:
    last = name.rpartition(".")[2]
    of_load = name.startswith("loads.") and last in _OF_LOADS
    return of_load or last in _OF_NORMAL_FORCE or name.startswith(PREFIX)
