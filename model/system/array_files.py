"""Matrices over time as people have them on disk: netCDF, MATLAB (version 5 and 7.3), or a folder of CSV tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.io import loadmat

from ..errors import DataError, DataErrorCollector, suggestion
from ..files.csv_table import read_rows
from ..files.numbers import parse_number
from .arrays import SHAPES

REQUIRED = ("time", "A", "B", "C")
KINDS = {"states": "state", "noises": "noise", "outputs": "response", "inputs": "input"}  # in files of ascentwind
MOST = 100_000_000  # numbers of a matrix over time


@dataclass(frozen=True, eq=False)
class ArrayFile:
    """What a file says of a system.

    Attributes
    ----------
    times : (k,) array
    matrices : dict of str to array
        A, B, C and, where they are there, D, E, G; times in front, or constant.
    u : array or None
    names : dict of str to list of str
        By 'states', 'noises', 'outputs' and 'inputs'.
    sources, units, scales : dict
    start_covariance : dict of str to (n, n) array
    jumps : tuple of float
    """

    times: NDArray[Any]
    matrices: dict[str, Any]
    u: NDArray[Any] | None = None
    names: dict[str, list[str]] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    scales: dict[str, float] = field(default_factory=dict)
    start_covariance: dict[str, NDArray[Any]] = field(default_factory=dict)
    jumps: tuple[float, ...] = ()


def read_arrays(path: Path, variables: Mapping[str, str] | None = None) -> ArrayFile:
    """Read matrices over time.

    Parameters
    ----------
    path : Path
        A .nc or .mat file, or a folder with time and entries in A.csv, B.csv, C.csv and so on.
    variables : mapping, optional
        What time, A, B, C, D, E, G and u are called in a .nc or .mat file, where it is not that.

    Raises
    ------
    DataError
    """
    variables = variables or {}
    if path.is_dir():
        if variables:
            raise DataError("is a folder of tables, which are called A.csv and so on; leave [variables] out", file=path)
        return _read_folder(path)
    readers = {".nc": _read_netcdf, ".mat": _read_matlab}
    if path.suffix.lower() not in readers:
        raise DataError("is neither a .nc nor a .mat file nor a folder of CSV tables", file=path)
    if not path.is_file():
        raise DataError("is not there", file=path)
    found, column_names = readers[path.suffix.lower()](path)
    called = {name: variables.get(name, name) for name in ("time", "u", *SHAPES)}
    missing = [called[name] for name in REQUIRED if called[name] not in found]
    missing += [name for name in variables.values() if name not in found and name not in missing]
    if missing:
        held = [name for name in found if not name.startswith("_")]
        raise DataError(
            f"has no variable '{missing[0]}'{suggestion(missing[0], held)}; it holds {', '.join(held[:12]) or 'none'}",
            file=path,
        )
    given = {name: found[called[name]] for name in called if called[name] in found}
    return _array_file(given, found, column_names)


def _array_file(given: dict[str, Any], found: Mapping[str, Any], texts: Mapping[str, list[str]]) -> ArrayFile:
    """Return what variables say, those of ascentwind's own files by their names."""
    matrices = {name: given[name] for name in SHAPES if name in given and np.size(given[name])}
    names = {kind: texts[label] for kind, label in KINDS.items() if texts.get(label)}
    units: dict[str, str] = {}
    scales: dict[str, float] = {}
    for kind, label in (("states", "state"), ("outputs", "response")):
        if f"{label}_unit" in texts and kind in names:
            units |= dict(zip(names[kind], texts[f"{label}_unit"], strict=False))
        if f"{label}_scale" in found and kind in names:
            scales |= dict(zip(names[kind], np.ravel(found[f"{label}_scale"]).tolist(), strict=False))
    sources = dict(zip(names.get("noises", ()), texts.get("noise_source", ()), strict=False))
    covariance = found.get("start_covariance")
    of_source = texts.get("source", [])
    starts = {} if covariance is None else dict(zip(of_source, np.asarray(covariance, float), strict=False))
    return ArrayFile(
        np.ravel(given["time"]),
        matrices,
        given["u"] if "u" in given and np.size(given["u"]) else None,
        names,
        sources,
        units,
        scales,
        {source: P for source, P in starts.items() if np.ndim(P) == 2 and P.any()},
        tuple(np.ravel(found.get("jump", [])).tolist()),
    )


def _read_netcdf(path: Path) -> tuple[dict[str, Any], dict[str, list[str]]]:
    try:
        with xr.open_dataset(path, decode_times=False) as dataset:
            loaded = dataset.load()
    except (OSError, ValueError, KeyError) as error:
        raise DataError(f"cannot be read as netCDF ({str(error).splitlines()[0]:.100})", file=path) from None
    found = {str(name): variable.values for name, variable in loaded.variables.items()}
    return found, {name: [str(x) for x in v] for name, v in found.items() if v.dtype.kind in "OUS" and v.ndim == 1}


def _read_matlab(path: Path) -> tuple[dict[str, Any], dict[str, list[str]]]:
    try:
        return _pages(loadmat(path))
    except NotImplementedError:  # version 7.3 is HDF5
        return _read_matlab_hdf5(path)
    except Exception as error:  # SciPy raises whatever a broken file leads it to
        raise DataError(f"cannot be read as a MATLAB file ({str(error)[:100]})", file=path) from None


def _pages(held: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """Return variables with pages in front, (rows, columns, k) as (k, rows, columns), and columns of cells as texts."""
    found, texts = {}, {}
    for name, value in held.items():
        if not isinstance(value, np.ndarray):
            continue
        if value.dtype.kind == "O":
            texts[name] = ["".join(map(str, np.ravel(cell))) for cell in value.ravel()]
        else:
            found[name] = np.moveaxis(value, -1, 0) if value.ndim == 3 else value
    return found, texts


def _read_matlab_hdf5(path: Path) -> tuple[dict[str, Any], dict[str, list[str]]]:
    import h5py  # for these files alone

    found: dict[str, Any] = {}
    texts: dict[str, list[str]] = {}
    try:
        with h5py.File(path, "r") as file:
            for name, value in file.items():
                if not isinstance(value, h5py.Dataset) or int(value.size or 0) > MOST:
                    continue
                if value.dtype == h5py.ref_dtype:
                    cells = [np.ravel(cast("Any", file[ref])[()]) for ref in np.ravel(value[()])]
                    texts[name] = ["".join(map(chr, cell)) for cell in cells]
                else:  # columns first on disk
                    array = np.asarray(value[()]).T
                    if array.dtype.names == ("real", "imag"):
                        array = array["real"] + 1j * array["imag"]
                    found[name] = np.moveaxis(array, -1, 0) if array.ndim == 3 else array
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise DataError(f"cannot be read as a MATLAB file of version 7.3 ({str(error)[:100]})", file=path) from None
    return found, texts


def _read_folder(folder: Path) -> ArrayFile:
    collector, names, more = DataErrorCollector(), {}, {}
    with collector.part():
        names, more = _read_names(folder / "names.csv") if (folder / "names.csv").is_file() else ({}, {})
    tables = {
        name: collector.take(lambda n=name: _read_table(folder / f"{n}.csv", n))
        for name in (*SHAPES, "u")
        if (folder / f"{name}.csv").is_file()
    }
    missing = [DataError(f"holds no {name}.csv", file=folder) for name in ("A", "B", "C") if name not in tables]
    collector.errors += missing
    collector.raise_all()
    of_u = tables.pop("u", None)
    times = tables["A"][0]
    counts = {kind: len(labels) for kind, labels in names.items()}
    for name, (_, entries) in tables.items():
        for place in (0, 1):
            kind, reached = SHAPES[name][place], max((at[place] for at in entries), default=0)
            if kind in names and reached > counts[kind]:
                why = f"has an entry in {('row', 'column')[place]} {reached}, and names.csv {counts[kind]} {kind}"
                collector.errors.append(DataError(why, file=folder / f"{name}.csv"))
            counts[kind] = max(counts.get(kind, 0), reached)
    for name, (own_times, _) in (tables if of_u is None else tables | {"u": of_u}).items():
        if not np.array_equal(own_times, times):
            why = "has other times than A.csv"
            collector.errors.append(DataError(why, file=folder / f"{name}.csv", column="time [s]"))
    sources = list(dict.fromkeys(more.get("sources", {}).get(n, n) for n in names.get("noises", ())))
    starts = collector.take(lambda: _read_starts(folder / "start_covariance.csv", sources, counts["states"]))
    collector.raise_all()
    matrices = {}
    for name, (_, entries) in tables.items():
        rows, columns = (counts.get(kind, 0) for kind in SHAPES[name])
        matrices[name] = np.zeros((times.size, rows, columns))
        for (i, j), values in entries.items():
            matrices[name][:, i - 1, j - 1] = values
    u = None
    if of_u is not None:
        u = np.zeros((times.size, max((i for i, _ in of_u[1]), default=0)))
        for (i, _), values in of_u[1].items():
            u[:, i - 1] = values
    given = {k: v for k, v in more.items() if k != "jumps"}
    return ArrayFile(
        times, matrices, u, names, start_covariance=starts, jumps=tuple(more.get("jumps", {}).values()), **given
    )


def _numbers(file: Path, line: int, cells: Iterable[str], header: list[str]) -> list[float]:
    found, collector = [], DataErrorCollector()
    for column, cell in zip(header, cells, strict=True):
        try:
            found.append(parse_number(cell))
        except ValueError as error:
            collector.errors.append(DataError(str(error), file=file, row=line, column=column))
    collector.raise_all()
    return found


def _read_table(file: Path, name: str) -> tuple[NDArray[np.float64], dict[tuple[int, int], NDArray[np.float64]]]:
    """Return the times of a table and its entries by row and column, counted from 1."""
    rows = read_rows(file)
    if len(rows) < 2 or rows[0][1][0].partition("[")[0].strip() != "time":
        raise DataError(f"begins with a header such as 'time [s],{name}(1,1)' and has rows", file=file)
    header = [cell.strip() for cell in rows[0][1]]
    form = r"u\((\d+)\)()" if name == "u" else rf"{name}\((\d+),(\d+)\)"
    places: list[tuple[int, int]] = []
    for cell in header[1:]:
        entry = re.fullmatch(form, cell.replace(" ", ""))
        place = (int(entry[1]), int(entry[2] or 1)) if entry else (0, 0)
        if entry is None or min(place) < 1 or max(place) > 10_000:
            raise DataError(f"is no entry; write {name}(ROW,COLUMN), counted from 1", file=file, column=cell)
        if place in places:
            raise DataError("is there twice", file=file, column=cell)
        places.append(place)
    values, collector = [], DataErrorCollector()
    for line, cells in rows[1:]:
        with collector.part():
            if len(cells) != len(header):
                raise DataError(f"has {len(cells)} cells under {len(header)} columns", file=file, row=line)
            values.append(_numbers(file, line, cells, header))
    collector.raise_all()
    array = np.array(values)
    return array[:, 0], {place: array[:, k] for k, place in enumerate(places, 1)}


def _read_names(file: Path) -> tuple[dict[str, list[str]], dict[str, dict[str, Any]]]:
    """Return names by kind, and units, scales, sources and jumps by name."""
    names: dict[str, list[str]] = {}
    more: dict[str, dict[str, Any]] = {"units": {}, "scales": {}, "sources": {}, "jumps": {}}
    kinds, collector = {label: kind for kind, label in KINDS.items()}, DataErrorCollector()
    columns = ["kind", "number", "name", "unit", "scale", "source"]
    for line, cells in read_rows(file):
        kind, _, name, unit, scale, source = [*(c.strip() for c in cells), *[""] * 6][:6]
        if [c.strip() for c in cells][:3] == columns[:3]:
            continue
        with collector.part():
            if kind == "jump":
                more["jumps"][str(line)] = _numbers(file, line, [name], ["name"])[0]
                continue
            if kind not in kinds:
                why = f"'{kind}' is no kind{suggestion(kind, [*kinds, 'jump'])}"
                raise DataError(why, file=file, row=line, column="kind")
            names.setdefault(kinds[kind], []).append(name)
            more["units"] |= {name: unit} if unit else {}
            more["sources"] |= {name: source} if source else {}
            more["scales"] |= {name: _numbers(file, line, [scale], ["scale"])[0]} if scale else {}
    collector.raise_all()
    return names, more


def _read_starts(file: Path, sources: list[str], states: int) -> dict[str, NDArray[np.float64]]:
    found: dict[str, NDArray[np.float64]] = {}
    if not file.is_file():
        return found
    header = ["source", "row", "column", "value"]
    for line, cells in read_rows(file):
        if [c.strip() for c in cells] == header:
            continue
        if len(cells) != len(header):
            raise DataError(f"has {len(cells)} cells under {', '.join(header)}", file=file, row=line)
        source, i, j, value = _numbers(file, line, cells, header)
        if not all(x.is_integer() and x >= 1 for x in (source, i, j)) or source > len(sources) or max(i, j) > states:
            raise DataError("names no source, row and column of the system, counted from 1", file=file, row=line)
        of = found.setdefault(sources[int(source) - 1], np.zeros((states, states)))
        of[int(i) - 1, int(j) - 1] = value
    return found
