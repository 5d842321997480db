"""Mode shapes that NASTRAN computed: .op2 by pyNastran, .f06 by its printed tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....model.errors import DataError
from .pynastran import pynastran, reading

Array = NDArray[np.float64]

ASK_FOR_SHAPES = "run SOL 103 with DISPLACEMENT(PLOT,PRINT) = ALL, and PARAM,POST,-1 for an .op2"
NO_SHAPES = f"holds no mode shapes; {ASK_FOR_SHAPES}"
VECTOR = re.compile(r"R\s*E\s*A\s*L\s+E\s*I\s*G\s*E\s*N\s*V\s*E\s*C\s*T\s*O\s*R\s+N\s*O\s*\.\s+(\d+)")
VALUES = re.compile(r"R\s*E\s*A\s*L\s+E\s*I\s*G\s*E\s*N\s*V\s*A\s*L\s*U\s*E\s*S")
OTHER = re.compile(r"[A-Z](\s[A-Z]){5}")  # the spaced title of another table
GRID = re.compile(r"^\s*\d*\s+(\d+)\s+G\s+(.+)$")
NUMBER = re.compile(r"[+-]?\d*\.\d*(?:E?[+-]\d+)?")


@dataclass(frozen=True, eq=False)
class ModeResults:
    """Modes of a file, in the deck's units and normalisation.

    Attributes
    ----------
    frequency : mapping of mode to float
        rad/s.
    generalized_mass : mapping of mode to float
        Empty where the file has no table of eigenvalues.
    shapes : mapping of mode to mapping of grid to (6,) array
        Translations and rotations in the basic coordinates.
    """

    frequency: dict[int, float]
    generalized_mass: dict[int, float]
    shapes: dict[int, dict[int, Array]]


def read_results(file: Path) -> ModeResults:
    """Read the modes of an .op2 or .f06.

    Raises
    ------
    DataError
        The file is neither, cannot be read, or has no mode shapes.
    MissingLibraryError
    """
    kinds = {".op2": _op2, ".f06": _f06}
    if file.suffix.lower() not in kinds:
        raise DataError("is neither .op2 nor .f06; give the results of NASTRAN's SOL 103", file=file)
    found = kinds[file.suffix.lower()](file)
    if not found.shapes:
        raise DataError(NO_SHAPES, file=file)
    return found


def _op2(file: Path) -> ModeResults:
    made = pynastran("op2.op2", "OP2")
    with reading(file):
        model = made(debug=None)
        model.read_op2(str(file), build_dataframe=False)
    if len(model.eigenvectors) > 1:
        raise DataError(f"holds mode shapes of {len(model.eigenvectors)} subcases; keep one", file=file)
    frequency, mass, shapes = {}, {}, {}
    for table in model.eigenvectors.values():
        for k, mode in enumerate(table.modes):
            frequency[int(mode)] = float(np.sqrt(max(float(table.eigns[k]), 0.0)))
            numbers = table.node_gridtype[:, 0]
            shapes[int(mode)] = {int(n): np.array(v, dtype=float) for n, v in zip(numbers, table.data[k], strict=True)}
    for table in model.eigenvalues.values():
        mass |= {int(m): float(v) for m, v in zip(table.mode, table.generalized_mass, strict=True)}
    return ModeResults(frequency, mass, shapes)


def _f06(file: Path) -> ModeResults:
    try:
        lines = file.read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise DataError(f"cannot be read ({error.strerror or error}); check its name", file=file) from None
    frequency, mass, shapes = {}, {}, {}
    mode, in_values = None, False
    for line, text in enumerate(lines, start=1):
        if title := VECTOR.search(text):
            mode, in_values = int(title[1]), False
            shapes.setdefault(mode, {})
        elif VALUES.search(text):
            mode, in_values = None, True
        elif OTHER.search(text.upper()):
            mode, in_values = None, False
        elif in_values and len(cells := text.split()) == 7 and cells[0].isdigit() and cells[1].isdigit():
            number = int(cells[0])
            if number in frequency:
                raise DataError(f"holds eigenvalue {number} twice; keep one subcase", file=file, row=line)
            values = [_number(cell, file, line) for cell in cells[2:]]
            frequency[number], mass[number] = values[1], values[3]
        elif mode is not None and (row := GRID.match(text)):
            grid, values = int(row[1]), [_number(cell, file, line) for cell in row[2].split()]
            if len(values) != 6:
                raise DataError(f"GRID {grid} has {len(values)} components of 6", file=file, row=line)
            if grid in shapes[mode]:
                raise DataError(f"mode {mode} has GRID {grid} twice; keep one subcase", file=file, row=line)
            shapes[mode][grid] = np.array(values)
    shapes = {mode: rows for mode, rows in shapes.items() if rows}
    if shapes and not frequency:
        raise DataError("holds no table of real eigenvalues beside its mode shapes; keep the whole file", file=file)
    return ModeResults(frequency, mass, shapes)


def _number(cell: str, file: Path, line: int) -> float:
    if not NUMBER.fullmatch(cell):
        raise DataError(f"'{cell[:40]}' is not a number", file=file, row=line)
    text = cell if "E" in cell else re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", cell)
    try:
        return float(text)
    except ValueError:
        raise DataError(f"'{cell[:40]}' is not a number", file=file, row=line) from None
