"""A copy of a vehicle whose tables are built anew from changed inputs."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...model.construction import Construction
from ...model.construction.construction_file import load_construction
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.vehicle_file import VehicleFile, read_vehicle_file
from ..construct.tables import table_text, vehicle_tables
from ..construct.vehicle_numbers import VehicleNumbers, compute_vehicle


def rebuilt(
    folder: Path,
    out: Path,
    *,
    construction: Mapping[str, Any] | None = None,
    changes: Mapping[str, Any] | None = None,
    alter: Callable[[Construction], Construction] = lambda c: c,
    adjust: Callable[[VehicleNumbers], VehicleNumbers] = lambda n: n,
) -> Path:
    """Copy a vehicle folder and write the tables of changed raw inputs over its own.

    Parameters
    ----------
    folder, out : Path
        The second is made.
    construction, changes : mapping, optional
        Of construction.toml and vehicle.toml, by dotted key. The copy's TOML files stay as they are: load it with
        the same ``changes``.
    alter, adjust : callable
        Change the raw inputs, and the numbers computed from them.

    Returns
    -------
    Path
        ``out``.
    """
    shutil.copytree(folder, out)
    file = read_vehicle_file(folder / VEHICLE_FILE, changes)
    numbers = adjust(compute_vehicle(alter(load_construction(folder, construction))))
    for name, (note, columns) in vehicle_tables(numbers, file).items():
        (out / name).write_text(table_text((note,), columns), encoding="utf-8")
    return out


def third_mode(file: VehicleFile) -> dict[str, Any]:
    """Return the changes of vehicle.toml that add a bending mode like the last one."""
    modes = [mode.model_dump() for mode in file.bending]
    last = modes[-1] | {"table": modes[-1]["table"] | {"file": f"bending_{len(modes) + 1}.csv"}}
    return {"bending": [*modes, last]}


def scaled_stiffness(construction: Construction, factor: float) -> Construction:
    """Return the vehicle with all bending and shear stiffness multiplied."""
    s = construction.stiffness
    return replace(construction, stiffness=replace(s, bending=factor * s.bending, shear=factor * s.shear))


def scaled_normal_force(construction: Construction, factor: float, shift: float) -> Construction:
    """Return the vehicle with its normal force multiplied and moved forward by ``shift`` (m)."""
    parts = tuple(
        replace(part, slope=factor * part.slope, station=np.asarray(part.station) + shift)
        for part in construction.normal_force
    )
    return replace(construction, normal_force=parts)


def scaled_generalized_mass(numbers: VehicleNumbers, factor: float) -> VehicleNumbers:
    """Return the numbers with all generalised masses multiplied, the shapes held."""
    return replace(numbers, modes=replace(numbers.modes, generalized_mass=factor * numbers.modes.generalized_mass))
