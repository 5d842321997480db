"""What a construction says twice must agree, and nothing in it may stand twice."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import DataError
from .flight import EngineGroup, NormalForceComponent
from .grain import Grain
from .jettison import Jettison
from .structure import LumpedMass, Stiffness, Tank


def refuse_repeated_masses(masses: Sequence[LumpedMass], tanks: Sequence[Tank], grains: Sequence[Grain] = ()) -> None:
    """Refuse items, tanks and grains that stand twice and would count twice.

    Raises
    ------
    DataError
        The list and what is repeated in it.
    """
    _refuse_twice("masses", "items named", (m.name for m in masses))
    _refuse_twice("tanks", "tanks named", (t.name for t in tanks))
    _refuse_twice("solid_motors", "motors named", (g.name for g in grains))
    _refuse_twice(
        "solid_motors",
        "tanks, motors or masses named",
        (p.name for p in (*tanks, *grains, *(masses if grains else ()))),
    )
    for tank in tanks:
        _refuse_twice(f"tanks.{tank.name}.sections", "sections", tank.sections, "; write it once, with count for more")
    _refuse_same("tanks", {t.name: replace(t, name="") for t in tanks})


def refuse_repeated_forces(components: Sequence[NormalForceComponent]) -> None:
    """Refuse parts of the normal force that stand twice and would count twice.

    Raises
    ------
    DataError
    """
    _refuse_twice("normal_force", "parts named", (c.name for c in components))
    parts = {c.name: tuple(a.tobytes() for a in (c.station, c.shape, c.mach, c.slope)) for c in components}
    _refuse_same("normal_force", parts)


def refuse_repeated_engines(groups: Sequence[EngineGroup]) -> None:
    """Refuse groups of engines with one name, and cutoffs of two times with one name.

    Raises
    ------
    DataError
    """
    _refuse_twice("engines", "groups named", (g.name for g in groups))
    cutoffs: dict[str, EngineGroup] = {}
    for group in groups:
        earlier = cutoffs.setdefault(group.cutoff_event, group)
        if earlier is not group and (group.cutoff is None or group.cutoff != earlier.cutoff):
            raise DataError(
                f"engines '{earlier.name}' and '{group.name}' both call their cutoff '{group.cutoff_event}', but are "
                "not cut off at one cutoff_s; give each its own cutoff_event",
                column="engines",
            )


def refuse_repeated_jettisons(jettisons: Sequence[Jettison]) -> None:
    """Refuse events that stand twice, and parts that leave twice.

    Raises
    ------
    DataError
    """
    _refuse_twice("jettisons", "events named", (j.event for j in jettisons))
    for kind in ("masses", "motors", "normal_force"):
        _refuse_twice("jettisons", f"drops of {kind}", (name for j in jettisons for name in getattr(j, kind)))


def refuse_repeated_stations(load_stations: Sequence[float], stiffness: Stiffness) -> None:
    """Refuse a load station that stands twice, and stations of the stiffness with more than a jump (m).

    Raises
    ------
    DataError
    """
    _refuse_twice("load_stations_m", "stations at", load_stations)
    stations, counts = np.unique(stiffness.station, return_counts=True)
    if (counts > 2).any():
        station = stations[int(np.argmax(counts > 2))]
        raise DataError(f"station {station:g} m of the stiffness stands more than twice; a jump takes two rows")


def refuse_misplaced(aft: float, forward: float, places: Mapping[str, Iterable[float]]) -> None:
    """Refuse stations that lie off the vehicle.

    Parameters
    ----------
    aft, forward : float
        Ends of the vehicle (m).
    places : mapping of key in the file to stations (m)

    Raises
    ------
    DataError
    """
    if not aft < forward:
        raise DataError(
            f"is {forward:g} m, aft of aft_end_m = {aft:g} m; stations count forward", column="forward_end_m"
        )
    slack = 1e-6 * (forward - aft)
    for column, stations in places.items():
        for station in stations:
            if not aft - slack <= station <= forward + slack:
                raise DataError(
                    f"{station:g} m lies beyond the vehicle's ends at {aft:g} and {forward:g} m; correct it",
                    column=column,
                )


def _refuse_twice(key: str, what: str, values: Iterable[Hashable], cure: str = "; remove or rename one") -> None:
    seen = set()
    for value in values:
        if value in seen:
            shown = f"'{value}'" if isinstance(value, str) else f"{value:g} m" if isinstance(value, float) else "alike"
            raise DataError(f"has two {what} {shown}{cure}", column=key)
        seen.add(value)


def _refuse_same(key: str, parts: Mapping[str, Hashable]) -> None:
    names: dict[Hashable, str] = {}
    for name, part in parts.items():
        if part in names:
            raise DataError(
                f"has '{names[part]}' and '{name}', the same in all but their names; remove one, or it counts twice",
                column=key,
            )
        names[part] = name
