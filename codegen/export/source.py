"""The C library of a system with its numbers: header, sources, numbers, and what builds them."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...model.errors import DataError, DirectNoiseError
from ...model.system.linear_system import LinearSystem
from ..sweep.source import sweep_functions, sweep_source
from ..system.executable import ExecutableSystem
from ..system.functions import MATRICES
from ..system.table_layout import table_layout
from ..toolchain.c_printer import c_function, enumerators
from ..toolchain.templates import render

MOST_POINTS = 1_000_000  # of a weighting function
NUMBERS_A_LINE = 5
WITH_UNITS = ("state", "response", "parameter", "table")
# a file of such a name would hide what the sources themselves include
TAKEN = frozenset(
    (
        "assert",
        "complex",
        "ctype",
        "errno",
        "fenv",
        "float",
        "inttypes",
        "iso646",
        "limits",
        "locale",
        "math",
        "setjmp",
        "signal",
        "stdarg",
        "stdbool",
        "stddef",
        "stdint",
        "stdio",
        "stdlib",
        "string",
        "tgmath",
        "time",
        "wchar",
        "wctype",
    )
)


class ExportError(DataError):
    """A system cannot be written in the form that is asked for."""


@dataclass(frozen=True, eq=False)
class FlightCuts:
    """How the engine cuts a flight and weighs its errors; a library that does the same gets the same numbers.

    Attributes
    ----------
    times : (k,) array
        End times that are asked for where none are named, s.
    pulses : (m,) array
        s.
    sizes : (n + n_y,) array
        Typical sizes of states and responses.
    constants : dict of str to float
        ``same``, ``near_start``, ``roundings``, ``longest_segment``, ``most_segments``, ``least_tolerance`` and
        ``largest_tolerance``.
    tolerance : float
        Relative, of the statistics that the example prints.
    """

    times: NDArray[np.float64]
    pulses: NDArray[np.float64]
    sizes: NDArray[np.float64]
    constants: dict[str, float]
    tolerance: float = 1e-7


@dataclass(frozen=True)
class Expected:
    """What the engine found for the default times, which ``make check`` holds the library against.

    Attributes
    ----------
    mean : (k, n_y) array
    sigma : (k, n_y, sources + 1) array
        Standard deviations by source, then of all together; not a number where white noise reaches a response itself.
    agreement : float
        How far, relative to the largest of a flight, a library may be from it.
    """

    mean: NDArray[np.float64]
    sigma: NDArray[np.float64]
    agreement: float


@dataclass(frozen=True)
class MeasuredInput:
    """An input that is measured over the value of a table, such as a wind over altitude.

    Attributes
    ----------
    name, table : str
        Of the input and of the table.
    argument, values : (k,) arrays
        An example of what is measured.
    unit : str
    limits : dict of str to float
        An example of limits of responses.
    """

    name: str
    table: str
    argument: NDArray[np.float64]
    values: NDArray[np.float64]
    unit: str
    limits: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Entry:
    constant: str
    name: str
    unit: str = ""
    says: str = ""

    @property
    def name_c(self) -> str:
        return c_string(self.name)

    @property
    def unit_c(self) -> str:
        return c_string(self.unit)


def library_prefix(name: str) -> str:
    """Return what all names of a library begin with, and its files: letters, digits and single underscores."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()
    return plain if plain and not plain[0].isdigit() and plain not in TAKEN else f"system_{plain}".rstrip("_")


def c_string(text: str) -> str:
    """Return a text as a C string literal; what is not plain ASCII as the bytes of UTF-8."""
    plain = set(range(32, 127)) - set(b'"\\?')
    return '"' + "".join(chr(b) if b in plain else f"\\{b:03o}" for b in text.encode()) + '"'


def library_files(
    executable: ExecutableSystem,
    cuts: FlightCuts,
    version: str,
    expected: Expected | None = None,
    measured: MeasuredInput | None = None,
) -> dict[str, str]:
    """Return the files of the library by name: sources, examples, and what builds them.

    Parameters
    ----------
    executable : ExecutableSystem
        With the tables of its mean response filled in.
    cuts : FlightCuts
    version : str
        Of ascentwind.
    expected : Expected, optional
    measured : MeasuredInput, optional
        With it there is a second example.

    Raises
    ------
    ExportError
        A system without an end, or a number that is not finite.
    """
    system = executable.system
    if not np.isfinite(system.end):
        raise ExportError(f"system '{system.name}' has no end, and its library needs one; give it a finite end")
    p = library_prefix(system.name)
    prefix, functions = p.upper(), sweep_functions(system)
    stops = executable.stops(system.end)
    start = [system.start_covariance_matrix(source, executable.parameters) for source in system.sources]
    numbers = {
        "parameters": executable.parameters,
        "times": cuts.times,
        "sizes": cuts.sizes,
        "stop_time": stops.times,
        "stop_before": stops.before,
        "stop_after": stops.after,
        "pulses": cuts.pulses,
        "tables": executable.tables,
    }
    for what, values in numbers.items():
        if not np.isfinite(values).all():
            raise ExportError(f"system '{system.name}': {what} hold a number that is not finite; correct it")
    kinds = _kinds(system, prefix)
    swept = sweep_source(system, functions)
    common = {
        "p": p,
        "P": prefix,
        "header": p,
        "title": f"{system.name}: response statistics of a flight",
        "version": version,
        "states": system.states,
        "noises": system.noises,
        "sources": system.sources,
        "outputs": system.outputs,
        "inputs": system.input_names,
        "parameters": system.parameters,
        "tables": [name for group in system.tables for name in group.names],
        "times": cuts.times.size,
        "stops": stops.times.size,
        "pulses": cuts.pulses.size,
        "table_numbers": executable.tables.size,
        "most_points": MOST_POINTS,
        "kinds": kinds,
        "with_units": WITH_UNITS,
    }
    white = _white(system)
    written = {name: c_numbers(values) for name, values in numbers.items()}
    covariances = [c_numbers(P) for P in start] or [c_numbers([])]
    digest = hashlib.sha256(swept.encode())
    for values in (*numbers.values(), *start):
        digest.update(np.ascontiguousarray(values, float).tobytes())
    examples = {**common, "tolerance": repr(cuts.tolerance), "expected": expected, "measured": measured}
    files = {
        f"{p}.h": render("export.h.jinja", **common),
        f"{p}_internal.h": render("export_internal.h.jinja", **common),
        f"{p}.c": render("export.c.jinja", **common, **{k: _constant(v) for k, v in cuts.constants.items()}),
        f"{p}_matrices.c": render("export_matrices.c.jinja", **common, **_arithmetic(executable)),
        f"{p}_sweep.c": f"#define sweep {p}_sweep_segments\n#define mean_history {p}_mean_segments\n\n{swept}",
        f"{p}_numbers.c": render(
            "export_numbers.c.jinja",
            **common,
            values={**written, "start_covariance": covariances},
            version_c=c_string(version),
            hash=digest.hexdigest()[:32],
            start=repr(float(system.start)),
            end=repr(float(system.end)),
            white=[int(any(row[i] for row in white)) for i in range(len(system.outputs))],
            white_sources=white or [[0] * len(system.outputs)],
            noise_sources=[system.sources.index(noise.source) for noise in system.noises],
        ),
        "example_statistics.c": render("export_statistics.c.jinja", **examples),
        "Makefile": render("export.make.jinja", **examples),
        "CMakeLists.txt": render("export.cmake.jinja", **examples),
        "README.md": render("export.md.jinja", **examples, hash=digest.hexdigest()[:32]),
    }
    if expected is not None:
        files["expected.csv"] = _expected_csv(system, cuts.times, expected)
    if measured is not None:
        named = {kind: {e.name: e.constant for e in entries} for kind, entries in kinds.items()}
        constants = {"input_c": named["input"][measured.name], "table_c": named["table"][measured.table]}
        files["example_history.c"] = render("export_history.c.jinja", **examples, **constants)
        files["measured.csv"] = _measured_csv(measured)
        files["limits.csv"] = "".join(f"{name},{value!r}\n" for name, value in measured.limits.items())
    return files


def _expected_csv(system: LinearSystem, times: NDArray[np.float64], expected: Expected) -> str:
    columns = ("mean", *(f"sigma {source}" for source in system.sources), "sigma", "|mean| + 3 sigma")
    lines = ["time [s],response," + ",".join(columns)]
    for k, time in enumerate(times.tolist()):
        for i, output in enumerate(system.outputs):
            mean, sigma = float(expected.mean[k, i]), expected.sigma[k, i].tolist()
            if np.isfinite(sigma).all():
                numbers = (mean, *sigma, abs(mean) + 3 * sigma[-1])
                lines.append(f"{time:g},{output.name}," + ",".join(f"{x:.17g}" for x in numbers))
    return "\n".join(lines) + "\n"


def _measured_csv(measured: MeasuredInput) -> str:
    pairs = zip(measured.argument.tolist(), measured.values.tolist(), strict=True)
    return "".join(f"{x!r},{y!r}\n" for x, y in pairs)


def c_numbers(values: ArrayLike) -> str:
    """Return numbers as a C initialiser, every digit kept; one zero where there are none."""
    texts = [repr(float(value)) for value in np.asarray(values, float).ravel()] or ["0.0"]
    lines = (", ".join(texts[i : i + NUMBERS_A_LINE]) for i in range(0, len(texts), NUMBERS_A_LINE))
    return "{\n  " + ",\n  ".join(lines) + "\n}"


def _constant(value: float) -> str:
    return str(value) if isinstance(value, int) else repr(float(value))


def _kinds(system: LinearSystem, prefix: str) -> dict[str, list[_Entry]]:
    """Return the members of every enumeration of the header."""

    def entries(kind: str, names: Sequence[str], units: Iterable[str] = (), says: Iterable[str] = ()) -> list[_Entry]:
        constants = enumerators(f"{prefix}_{kind.upper()}", names)
        units, says = [*units] or [""] * len(names), [*says] or [""] * len(names)
        return [_Entry(*each) for each in zip(constants, names, units, says, strict=True)]

    tables = [(name, unit) for g in system.tables for name, unit in zip(g.names, g.units, strict=True)]
    return {
        "state": entries("state", system.state_names, [s.unit for s in system.states]),
        "response": entries("response", system.output_names, [o.unit for o in system.outputs]),
        "source": entries("source", system.sources),
        "noise": entries("noise", system.noise_names, says=[f"of {n.source}" for n in system.noises]),
        "input": entries("input", system.input_names),
        "parameter": entries("parameter", system.parameter_names, [p.unit for p in system.parameters]),
        "table": entries("table", [name for name, _ in tables], [unit for _, unit in tables]),
    }


def _white(system: LinearSystem) -> list[list[int]]:
    """Return for every source and response whether white noise of the source reaches it directly."""

    def direct(name: str) -> bool:
        try:
            system.refuse_direct_noise([name])
        except DirectNoiseError:
            return True
        return False

    reached = [direct(name) for name in system.output_names]
    return [
        [int(hit and not ca.SX(system.D[i, system.noise_columns(source)]).is_zero()) for i, hit in enumerate(reached)]
        for source in system.sources
    ]


def _arithmetic(executable: ExecutableSystem) -> dict[str, object]:
    """Return the functions of table values and parameters, and where their nonzeros stand in matrices row by row."""
    system, core = executable.system, executable.core
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    patterns = [core.state_matrix.sparsity_out(0)]
    patterns += [core.other_matrices.sparsity_out(i) for i in range(len(MATRICES) - 1)]
    return {
        "core": [
            c_function("state_matrix_core", core.state_matrix, ("t", "v", "p"), ("A",), names),
            c_function("other_matrices_core", core.other_matrices, ("t", "v", "p"), MATRICES[1:], names),
        ],
        "enumerators": [e for e in (names["v"], names["p"]) if e],
        "groups": table_layout(system),
        "table_values": system.v.numel(),
        "matrices": [
            {
                "name": name,
                "size": pattern.numel(),
                "places": [i * pattern.size2() + j for i, j in zip(pattern.row(), pattern.get_col(), strict=True)],
            }
            for name, pattern in zip(MATRICES, patterns, strict=True)
        ],
    }
