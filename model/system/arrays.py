"""A linear system from matrices that are numbers over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import SystemDefinitionError
from ..tables import Table
from .checks import check_keys, mapping
from .labels import Noise, Output, Parameter, State
from .time_tables import TimeGrid, group_over_time, kinks, real_numbers, time_grid, time_table

# rows and columns of each matrix
SHAPES = {
    "A": ("states", "states"),
    "B": ("states", "noises"),
    "C": ("outputs", "states"),
    "D": ("outputs", "noises"),
    "E": ("states", "inputs"),
    "G": ("outputs", "inputs"),
}
PREFIXES = {"states": "x", "noises": "w", "outputs": "y", "inputs": "u"}
PER_SECOND = ("A", "B", "E")


def parts_from_arrays(
    times: Any,
    matrices: Mapping[str, Any],
    u: Any,
    *,
    name: str,
    names: Mapping[str, Sequence[str]] | None,
    sources: Mapping[str, str] | None,
    units: Mapping[str, str] | None,
    scales: Mapping[str, float] | None,
    start_covariance: Mapping[str, np.ndarray] | None,
    discontinuities: Sequence[float],
    interpolation: str,
) -> dict[str, Any]:
    """Return what a LinearSystem is made of; arguments as :meth:`LinearSystem.from_arrays` has them.

    Entries that are always zero are no part of the system, those that are constant are its parameters, and the others
    its tables, named such as A(3,5): third row, fifth column.

    Raises
    ------
    SystemDefinitionError
        With all arrays at fault.
    """
    grid = time_grid("times", times, discontinuities)
    arrays, counts = _checked(name, grid, matrices, u)
    named = _names(name, counts, mapping("names", names, left_out=True), matrices)
    sources, given_units = mapping("sources", sources, left_out=True), mapping("units", units, left_out=True)
    given_scales = mapping("scales", scales, left_out=True)
    check_keys("noise", sources, named["noises"])
    check_keys("state, output or input", given_units, (*named["states"], *named["outputs"], *named["inputs"]))
    check_keys("state or output", given_scales, (*named["states"], *named["outputs"]))
    entries = _Entries(grid, interpolation)
    symbols = {kind: ca.SX.sym(kind, count) for kind, count in counts.items()}
    written = {
        matrix: entries.matrix(matrix, array, lambda i, j, m=matrix: _unit(m, named, given_units, i, j))
        for matrix, array in arrays.items()
        if matrix != "u"
    }
    inputs = entries.matrix("u", arrays["u"][:, :, None], lambda i, _: given_units.get(named["inputs"][i], "1"))
    x, w, given = symbols["states"], symbols["noises"], symbols["inputs"]
    start, end = float(grid.rows[0]), float(grid.rows[-1])
    bends = {t for table in entries.tables for t in kinks(table, grid.jumps)}
    return {
        "name": name,
        "time": ca.SX.sym("t"),
        "x": x,
        "w": w,
        "u": given,
        "p": ca.vertcat(ca.SX(0, 1), *entries.p),
        "v": ca.vertcat(ca.SX(0, 1), *entries.v),
        "derivative": written["A"] @ x + written["B"] @ w + written["E"] @ given,
        "output": written["C"] @ x + written["D"] @ w + written["G"] @ given,
        "states": tuple(State(n, given_units.get(n, "1"), given_scales.get(n, 1.0)) for n in named["states"]),
        "noises": tuple(Noise(n, sources.get(n, n)) for n in named["noises"]),
        "outputs": tuple(Output(n, given_units.get(n, "1"), given_scales.get(n, 1.0)) for n in named["outputs"]),
        "parameters": tuple(entries.parameters),
        "input_names": tuple(named["inputs"]),
        "input_values": ca.densify(inputs),
        "tables": group_over_time("matrices", entries.tables, start, end),
        "rows": tuple(entries.tables),
        "start_covariance": mapping("start_covariance", start_covariance, left_out=True),
        "discontinuities": (*grid.jumps, *bends),
        "start": start,
        "end": end,
        "structure": {
            **{kind: ", ".join(labels) or "none" for kind, labels in named.items()},
            "matrices": f"{len(entries.tables)} entries over {grid.rows.size} times, {len(entries.p)} constant",
        },
    }


def _checked(
    name: str, grid: TimeGrid, matrices: Mapping[str, Any], u: Any
) -> tuple[dict[str, NDArray[np.float64]], dict[str, int]]:
    """Return all arrays over time, (k, rows, columns), those left out as zeros, and the number of each kind."""
    faults: list[str] = []
    given: dict[str, NDArray[np.float64]] = {}
    for matrix in SHAPES:
        value = matrices.get(matrix)
        if value is None:
            if matrix in ("A", "B", "C"):
                faults.append(f"{matrix} is missing")
            continue
        try:
            array = real_numbers(matrix, value)
        except SystemDefinitionError as error:
            faults.append(str(error))
            continue
        if array.ndim not in (2, 3):
            faults.append(
                f"{matrix} has the shape {array.shape}; give rows and columns, with the times in front or none"
            )
        elif array.ndim == 3 and array.shape[0] != grid.rows.size:
            faults.append(
                f"{matrix} has the shape {array.shape} for {grid.rows.size} times; times are the first dimension"
            )
        else:
            given[matrix] = array if array.ndim == 3 else np.broadcast_to(array, (grid.rows.size, *array.shape))
    counts: dict[str, int] = {}
    said_by: dict[str, str] = {}
    for matrix, array in given.items():
        for kind, count, what in zip(SHAPES[matrix], array.shape[1:], ("rows", "columns"), strict=True):
            if kind not in counts:
                counts[kind], said_by[kind] = count, f"the {what} of {matrix}"
            elif counts[kind] != count:
                faults.append(f"{matrix} has {count} {what} for the {counts[kind]} {kind} that {said_by[kind]} are")
    if faults:
        raise SystemDefinitionError(f"system '{name}': " + "; ".join(faults))
    counts.setdefault("inputs", 0)
    k = grid.rows.size
    try:
        known = np.ones(counts["inputs"]) if u is None else real_numbers("u", u)
    except SystemDefinitionError as error:
        raise SystemDefinitionError(f"system '{name}': {error}") from None
    if known.shape not in ((counts["inputs"],), (k, counts["inputs"])):
        raise SystemDefinitionError(
            f"system '{name}': u has the shape {known.shape}; E and G have {counts['inputs']} columns, so give "
            f"{(counts['inputs'],)} or {(k, counts['inputs'])}"
        )
    arrays = {m: given.get(m, np.zeros((k, counts[r], counts[c]))) for m, (r, c) in SHAPES.items()}
    arrays["u"] = known if known.ndim == 2 else np.broadcast_to(known, (k, known.size))
    return arrays, counts


def _names(
    name: str, counts: Mapping[str, int], names: Mapping[str, Any], matrices: Mapping[str, Any]
) -> dict[str, tuple[str, ...]]:
    """Return the names of states, noises, outputs and inputs: as given, by the arrays' own labels, or numbered."""
    check_keys("kind of names", names, PREFIXES)
    found: dict[str, tuple[str, ...]] = {}
    for kind, prefix in PREFIXES.items():
        labels = names.get(kind, _labels(kind, matrices))
        if labels is None:
            labels = [f"{prefix}{i + 1}" for i in range(counts[kind])]
        if isinstance(labels, str) or not isinstance(labels, Iterable):
            raise SystemDefinitionError(f"system '{name}': the names of {kind} are no list of names")
        found[kind] = tuple(labels)
        if len(found[kind]) != counts[kind]:
            raise SystemDefinitionError(
                f"system '{name}': {len(found[kind])} names were given for {counts[kind]} {kind} of the arrays"
            )
        for label in found[kind]:
            if not isinstance(label, str):
                raise SystemDefinitionError(
                    f"system '{name}': {label!r:.40} is no name among the {kind}; names are text"
                )
    return found


def _labels(kind: str, matrices: Mapping[str, Any]) -> list[str] | None:
    """Return the labels of an xarray's own coordinates, where it has texts."""
    for matrix, kinds in SHAPES.items():
        array: Any = matrices.get(matrix)
        if kind not in kinds or not (hasattr(array, "dims") and hasattr(array, "coords")) or len(array.dims) < 2:
            continue
        dimension = array.dims[-2 + kinds.index(kind)]
        if dimension in array.coords and array.coords[dimension].dtype.kind in "UO":
            return [str(label) for label in array.coords[dimension].values]
    return None


class _Entries:
    """Writes matrices of numbers over time as expressions, and keeps the tables and parameters that it makes."""

    def __init__(self, grid: TimeGrid, interpolation: str):
        self.grid, self.interpolation = grid, interpolation
        self.tables: list[Table] = []
        self.parameters: list[Parameter] = []
        self.v: list[ca.SX] = []
        self.p: list[ca.SX] = []

    def matrix(self, name: str, array: NDArray[np.float64], unit: Callable[[int, int], str]) -> ca.SX:
        """Return the expression of an array (k, rows, columns)."""
        found = ca.SX(*array.shape[1:])
        for i, j in np.argwhere(np.abs(array).max(axis=0, initial=0.0) > 0).tolist():
            label = f"u({i + 1})" if name == "u" else f"{name}({i + 1},{j + 1})"
            values = np.ascontiguousarray(array[:, i, j])
            symbol = ca.SX.sym(label)
            if (values == values[0]).all():
                self.parameters.append(Parameter(label, float(values[0]), unit(i, j)))
                self.p.append(symbol)
            else:
                self.tables.append(time_table(label, unit(i, j), self.grid, values, self.interpolation))
                self.v.append(symbol)
            found[i, j] = symbol
        return found


def _unit(matrix: str, named: Mapping[str, Sequence[str]], units: Mapping[str, str], i: int, j: int) -> str:
    """Return the unit of an entry: that of its row, per second in a rate, over that of its column."""
    rows, columns = SHAPES[matrix]
    row = units.get(named[rows][i], "1")
    factors = [] if row == "1" else [row]
    if columns == "noises":  # white noise of unit intensity is in s^-0.5
        factors.append("s^-0.5" if matrix in PER_SECOND else "s^0.5")
    elif matrix in PER_SECOND:
        factors.append("s^-1")
    column = "1" if columns == "noises" else units.get(named[columns][j], "1")
    text = " ".join(factors) or "1"
    return text if column == "1" else f"{text} / ({column})"
