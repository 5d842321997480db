"""The planes that a vehicle flies in, each with its own view of the vehicle: what [pitch] and [yaw] say differs.

In both planes names of states, outputs and white noises begin with the plane's; tables and parameters that a plane has
for itself stand under it, and all others are shared. One plane alone has the names of the report.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ..errors import PlanesError
from ..wind.statistics import WindModel
from .vehicle import Vehicle
from .vehicle_file import PlaneEntry, PlaneTablesEntry, VehicleFile

BOTH = "both"
PLANES = ("pitch", "yaw")  # in the order of states and outputs
SECTIONS = ("control", "bending", "slosh", "loads")  # that a plane may have for itself
UNDER = {  # first word of a parameter's name, and the sections whose numbers it follows
    "control": ("control",),
    "bending": ("bending",),
    "slosh": ("slosh",),
    "loads": ("loads", "slosh"),
}


@dataclass(frozen=True, eq=False)
class Plane:
    """One plane of a vehicle.

    Attributes
    ----------
    name : {'pitch', 'yaw'}
    prefix : str
        In front of the names of its states and outputs; empty where it is the only one.
    scope : str
        In front of the names of its own tables and parameters.
    vehicle : Vehicle
        As this plane sees it: ``file`` and ``tables`` without the others' and without prefixes.
    own : frozenset of str
        Sections that it has for itself.
    """

    name: str
    prefix: str
    scope: str
    vehicle: Vehicle
    own: frozenset[str]

    def owns(self, parameter: str) -> bool:
        """Tell whether a parameter is this plane's alone."""
        return any(section in self.own for section in UNDER.get(parameter.split(".")[0], ()))


def plane_names(file: VehicleFile) -> tuple[str, ...]:
    """Return the planes that a vehicle flies in."""
    return PLANES if file.planes == BOTH else (file.planes,)


def plane_entry(file: VehicleFile, plane: str) -> PlaneEntry:
    """Return what a vehicle says of one plane alone."""
    return getattr(file, plane) or PlaneEntry()


def own_tables(entry: PlaneEntry) -> tuple[str, ...]:
    """Return the keys of [tables] that a plane has for itself."""
    return tuple(name for name in PlaneTablesEntry.model_fields if getattr(entry.tables, name) is not None)


def plane_file(file: VehicleFile, plane: str) -> VehicleFile:
    """Return a vehicle's file as one plane sees it."""
    entry = plane_entry(file, plane)
    tables = {name: getattr(entry.tables, name) for name in own_tables(entry) if name != "moment_of_inertia"}
    changes = {name: getattr(entry, name) for name in SECTIONS if getattr(entry, name) is not None}
    return file.model_copy(update=changes | {"tables": file.tables.model_copy(update=tables)})


def flown_planes(vehicle: Vehicle) -> tuple[Plane, ...]:
    """Return the planes that a vehicle flies in, each with its view of it."""
    names = plane_names(vehicle.file)
    if len(names) == 1:
        return (Plane(names[0], "", "", replace(vehicle, file=plane_file(vehicle.file, names[0])), frozenset()),)
    return tuple(_of_both(vehicle, name) for name in names)


def _of_both(vehicle: Vehicle, name: str) -> Plane:
    scopes = {plane: f"{plane}." for plane in PLANES}
    tables = {n: t for n, t in vehicle.tables.items() if not n.startswith(tuple(scopes.values()))}
    own = {n.removeprefix(scopes[name]): t for n, t in vehicle.tables.items() if n.startswith(scopes[name])}
    entry = plane_entry(vehicle.file, name)
    sections = frozenset(section for section in SECTIONS if getattr(entry, section) is not None)
    view = replace(vehicle, file=plane_file(vehicle.file, name), tables=tables | own)
    return Plane(name, f"{name}_", scopes[name], view, sections)


def one_wind(vehicle: Vehicle, what: str) -> WindModel:
    """Return the wind of a vehicle that flies in one plane.

    Parameters
    ----------
    vehicle : Vehicle
    what : str
        What asks for it; begins the sentence of the error.

    Raises
    ------
    PlanesError
        The vehicle flies in both.
    """
    if not isinstance(vehicle.wind, WindModel):
        raise PlanesError(what, vehicle.name)
    return vehicle.wind


def require_yaw(vehicle: Vehicle, what: str) -> None:
    """Raise where a vehicle flies in another plane than yaw, of which ``what`` alone is known.

    Raises
    ------
    PlanesError
    """
    if vehicle.file.planes != "yaw":
        raise PlanesError(what, vehicle.name, "yaw")


def paired(names: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Return by their common name the responses that both planes have, (pitch, yaw)."""
    names, (first, second) = list(names), (f"{plane}_" for plane in PLANES)
    found = {name.removeprefix(first): name for name in names if name.startswith(first)}
    return {name: (full, second + name) for name, full in found.items() if second + name in names}
