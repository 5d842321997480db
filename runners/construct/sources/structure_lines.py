"""What a source holds of a structure: masses, stiffness and modes along the vehicle, in SI."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from ....model.construction.given_modes import GivenModes
from ....model.construction.structure import LumpedMass

DIGITS = 9


@dataclass(frozen=True)
class StiffnessRow:
    """Bending (N m2) and shear stiffness (N) of an item at a station (m)."""

    item: str
    station: float
    bending: float
    shear: float


@dataclass(frozen=True, eq=False)
class Structure:
    """Tables of a construction that a source gives; what it does not hold is empty.

    Attributes
    ----------
    masses : tuple of LumpedMass
    stiffness : tuple of StiffnessRow
    modes : GivenModes or None
    status, source : str
        Of every row.
    checks : tuple of str
        What was held against what, in sentences.
    """

    masses: tuple[LumpedMass, ...]
    stiffness: tuple[StiffnessRow, ...]
    modes: GivenModes | None
    status: str
    source: str
    checks: tuple[str, ...] = field(default=())


def structure_tables(structure: Structure) -> dict[str, str]:
    """Return the CSV files of a construction by name: masses.csv, stiffness.csv and modes.csv, as far as there."""
    origin = (structure.status, structure.source)
    found: dict[str, str] = {}
    if structure.masses:
        found["masses.csv"] = _text(
            ("item", "begin [m]", "end [m]", "mass [kg]", "radius_of_gyration [m]"),
            ((m.name, m.begin, m.end, m.mass, m.radius) for m in structure.masses),
            origin,
        )
    if structure.stiffness:
        found["stiffness.csv"] = _text(
            ("item", "station [m]", "bending [N m2]", "shear [N]"),
            ((row.item, row.station, row.bending, row.shear) for row in structure.stiffness),
            origin,
        )
    modes = structure.modes
    if modes is not None:
        header = ("time [s]", "mode [1]", "frequency [rad/s]", "generalized_mass [kg]", "station [m]")
        rows = (
            (
                time, k + 1, modes.frequency[t, k], modes.generalized_mass[t, k], station,
                modes.displacement[t, k, n], modes.rotation[t, k, n],
            )
            for t, time in enumerate(modes.time)
            for k in range(modes.frequency.shape[1])
            for n, station in enumerate(modes.station)
        )  # fmt: skip
        found["modes.csv"] = _text((*header, "displacement [1]", "rotation [1/m]"), rows, origin)
    return found


def _text(header: Sequence[str], rows: Iterable[Sequence], origin: tuple[str, str]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*header, "status", "source"])
    for row in rows:
        writer.writerow([*(cell if isinstance(cell, str) else f"{cell:.{DIGITS}g}" for cell in row), *origin])
    return buffer.getvalue()
