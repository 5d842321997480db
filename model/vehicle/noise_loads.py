"""What a deviating force puts into the bending moment itself: 4-13 in equilibrium for every noise and bias.

4-13 holds M'_alpha alpha and M'_beta beta at their nominal coefficients. A force that deviates by df loads a station by
itself too, less the inertia with which the whole vehicle answers it as a rigid body,

    L[df] = int_(x > s) (x - s) df dx - S_1 / m int df dx - S_2 / I_ZZ int (x - X_CG) df dx

(docs/equations.md, section 4). A factor on the control thrust gives M'_beta beta, one on dynamic pressure or
normal-force slope M'_alpha alpha; thrust and drag along the axis load no station. A centre of pressure that moves by dX
turns the vehicle by the couple C dX, C = q A C'_N alpha, and where that couple acts is a choice:

    moved_line      the local normal force moves as a whole: N(s) - S_2 / I_ZZ C, N(s) the normal force forward of s;
                    its work on mode i moves with it (4-10), by q A int c'_N dY_i/dx dx alpha
    couple_forward  wholly forward of the station: (1 - S_2 / I_ZZ) C
    couple_aft      wholly aft of it: -S_2 / I_ZZ C
    as_reported     no deviation enters 4-13 itself, as in the report

A thrust that points beside the engine's direction loads a station as the engine angle does, by M'_beta. Masses that
lie beside the thrust axis by e pull there with -A_X mu per length: e A_X (mass forward of s - S_2 / I_ZZ mass).
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import get_args

from ..errors import AscentwindWarning, DataError
from ..files.csv_table import read_csv_table
from ..files.folder_files import file_inside
from .biases import CENTER_OF_GRAVITY_OFFSET, THRUST_MISALIGNMENT, vehicle_biases
from .columns import MOVED_LINE, MOVED_MODE, OFFSET_MASS, SECOND_MOMENT, Column, p_delta_columns
from .vehicle_file import NoiseLoads, VehicleFile

NOISE_LOADS: tuple[NoiseLoads, ...] = get_args(NoiseLoads)

COEFFICIENTS = {  # column of a load's table that a deviating table multiplies
    "control_thrust": "engine_angle",
    "dynamic_pressure": "angle_of_attack",
    "normal_force_slope": "angle_of_attack",
}
AXIAL_FORCES = ("thrust", "axial_drag", "mass")
CENTER_OF_PRESSURE = "center_of_pressure"
IN_PLACE = (CENTER_OF_GRAVITY_OFFSET, THRUST_MISALIGNMENT)  # biases that deviate no table
MASSES_IN_PLACE = ("center_of_gravity", "attach_point")  # a load's table cannot tell which masses move with these


class NoiseLoadsWarning(AscentwindWarning):
    """A vehicle's tables lack what a noise needs, and a form that does without was taken."""


def deviating_tables(file: VehicleFile) -> dict[str, tuple[str, ...]]:
    """Return the noises and biases that deviate tables, and which."""
    biases = {name: bias.tables for name, bias in vehicle_biases(file).items() if bias.tables}
    return {name: noise.tables for name, noise in file.noise.items()} | biases


def loading_deviations(file: VehicleFile) -> dict[str, tuple[str, ...]]:
    """Return the noises and biases that load stations by themselves and what of them does: tables, or the bias."""
    forces = () if file.options.noise_loads == "as_reported" else (*COEFFICIENTS, CENTER_OF_PRESSURE)
    found = {name: tuple(t for t in tables if t in forces) for name, tables in deviating_tables(file).items()}
    of_axis = {name: (name,) for name in vehicle_biases(file) if name in IN_PLACE}
    return {name: tables for name, tables in found.items() if tables} | of_axis


def component_deviations(file: VehicleFile) -> tuple[str, ...]:
    """Return the noises and biases that load stations by themselves, across the axis or along it."""
    along = deviating_tables(file).items() if has_axial(file) else ()
    return tuple(dict.fromkeys((*loading_deviations(file), *(name for name, tables in along if axial_tables(tables)))))


def has_axial(file: VehicleFile) -> bool:
    """Return whether the vehicle knows axial forces, at a station or along the vehicle."""
    return file.tables.axial_along_vehicle is not None or any(load.axial for load in file.loads)


def axial_tables(tables: Iterable[str]) -> tuple[str, ...]:
    """Return those of the tables that make the axial force."""
    return tuple(table for table in tables if table in AXIAL_FORCES)


def needed_columns(file: VehicleFile) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
    """Return the columns that deviations and P-delta need in the tables of the loads and in those of the modes."""
    loading = loading_deviations(file)
    of_loads, of_modes = _moved_columns(file)
    if CENTER_OF_GRAVITY_OFFSET in loading:
        of_loads += (OFFSET_MASS,)
    if file.options.p_delta:
        of_loads += p_delta_columns(len(file.bending))
    return of_loads, of_modes


def _moved_columns(file: VehicleFile) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
    if not any(CENTER_OF_PRESSURE in tables for tables in loading_deviations(file).values()):
        return (), ()
    return ((MOVED_LINE,), (MOVED_MODE,)) if file.options.noise_loads == "moved_line" else ((SECOND_MOMENT,), ())


def needed_for(column: str) -> str | None:
    """Return the key of vehicle.toml that alone asks for a column of a load's table; None of any other column."""
    if column == OFFSET_MASS.name:
        return f"biases.{CENTER_OF_GRAVITY_OFFSET}"
    return "options.p_delta" if column.startswith("p_delta_") else None


def form_is_open(file: VehicleFile) -> bool:
    """Return whether the file leaves it to its tables what a moved centre of pressure does to the loads."""
    return "noise_loads" not in file.options.model_fields_set and any(_moved_columns(file))


def form_of_tables(folder: Path, toml: Path, file: VehicleFile) -> tuple[NoiseLoads, NoiseLoadsWarning | None]:
    """Return the best form of those that the vehicle's tables have columns for, and what to say when it is another.

    Raises
    ------
    DataError
        A table cannot be read.
    """

    def lacking(entries: Iterable[str], column: Column) -> str | None:
        tables = ((entry, read_csv_table(file_inside(folder, entry), "time", "s").columns) for entry in entries)
        return next((entry for entry, columns in tables if column.name not in columns), None)

    loads, modes = [load.table.file for load in file.loads], [mode.table.file for mode in file.bending]
    missing = [
        (table, c) for t, c in ((loads, MOVED_LINE), (modes, MOVED_MODE)) if (table := lacking(t, c)) is not None
    ]
    if not missing:
        return "moved_line", None
    bound = bool(loads) and lacking(loads, SECOND_MOMENT) is None
    table, column = missing[0]
    taken = (
        '"couple_aft", a bound: the couple of the centre of pressure wholly aft of the station'
        if bound
        else '"as_reported": thrust and centre of pressure load the station through accelerations alone'
    )
    return "couple_aft" if bound else "as_reported", NoiseLoadsWarning(
        f"{folder / table}: has no column '{column.label}', which options.noise_loads = \"moved_line\" needs. Taken "
        f"instead: {taken}. 'ascentwind build-vehicle' writes the column; to keep the lesser form without this warning "
        f"name it under [options] in {toml.name}"
    )


def check_noises(file: VehicleFile, toml: Path) -> None:
    """Refuse deviations that would count twice in a moment, or that its coefficients cannot follow.

    Raises
    ------
    DataError
    """
    if file.options.noise_loads == "as_reported" or not file.loads:
        return
    out = 'or set options.noise_loads = "as_reported"'
    for name, noise in file.noise.items():
        for table in noise.tables:
            last = table.split(".")[-1]
            twice = [t for t in noise.tables if COEFFICIENTS.get(t) == last]
            if last in MASSES_IN_PLACE:
                why = (
                    f"'{table}' moves masses, which the coefficients of a bending moment cannot follow; choose a force"
                )
            elif table.startswith("loads.") and twice:
                why = f"'{table}' follows '{twice[0]}' by itself and would count twice; remove it"
            else:
                continue
            raise DataError(f"{why}, {out}", file=toml, column=f"noise.{name}.tables")
