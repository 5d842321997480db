"""Matrices over time as files: one netCDF or MATLAB file, or a folder of CSV tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import savemat

from ..present.files import write_text, write_whole
from ..present.netcdf import write_netcdf
from .matrix_grid import SHAPES

MATLAB = ("time", "A", "B", "C", "D", "E", "G", "u")


def write_matrices(grid: xr.Dataset, format: str, folder: Path, name: str) -> list[Path]:
    """Write a grid of matrices in one of ``FORMATS``.

    Raises
    ------
    OutputFolderError
    """
    return FORMATS[format](grid, folder, name)


def _netcdf(grid: xr.Dataset, folder: Path, name: str) -> list[Path]:
    return [write_netcdf(grid, folder / f"{name}.nc")]


def _mat(grid: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write a version 5 file: matrices (rows, columns, times), as MATLAB has pages; names as columns of cells."""

    def cells(values: Any) -> np.ndarray:
        found = np.empty((len(values), 1), object)
        found[:, 0] = [str(value) for value in values]
        return found

    variables: dict[str, Any] = {"time": grid["time"].values[:, None], "jump": grid["jump"].values[:, None]}
    for matrix in SHAPES:
        variables[matrix] = np.moveaxis(grid[matrix].values, 0, -1)
    variables["u"] = grid["u"].values
    variables["start_covariance"] = np.moveaxis(grid["start_covariance"].values, 0, -1)
    for label in ("state", "noise", "response", "input", "source", "state_unit", "response_unit", "noise_source"):
        variables[label] = cells(grid[label].values)
    for label in ("state_scale", "response_scale"):
        variables[label] = grid[label].values[:, None]
    variables["info"] = {key: str(value) for key, value in grid.attrs.items()}

    def write(path: Path) -> None:
        with path.open("wb") as file:
            savemat(file, variables, do_compression=True, long_field_names=True)

    return [write_whole(folder / f"{name}.mat", write)]


def _csv(grid: xr.Dataset, folder: Path, name: str) -> list[Path]:
    """Write a table for each matrix, a column for each entry that is ever not zero, and one that names them."""
    tables: dict[str, list[list[Any]]] = {}
    time = grid["time"].values
    for matrix, dims in SHAPES.items():
        values = grid[matrix].values
        places = np.argwhere(np.abs(values).max(axis=0, initial=0.0) > 0)
        header = ["time [s]", *(f"{matrix}({i + 1},{j + 1})" for i, j in places.tolist())]
        if len(places) or dims[1] in ("state", "noise"):
            columns = [time, *(values[:, i, j] for i, j in places)]
            tables[matrix] = [header, *(list(row) for row in zip(*(c.tolist() for c in columns), strict=True))]
    if grid.sizes["input"]:
        header = ["time [s]", *(f"u({k + 1})" for k in range(grid.sizes["input"]))]
        tables["u"] = [header, *([t, *row] for t, row in zip(time.tolist(), grid["u"].values.tolist(), strict=True))]
    covariance = grid["start_covariance"].values
    tables["start_covariance"] = [
        ["source", "row", "column", "value"],
        *([k + 1, i + 1, j + 1, float(covariance[k, i, j])] for k, i, j in np.argwhere(covariance).tolist()),
    ]
    names: list[list[Any]] = [["kind", "number", "name", "unit", "scale", "source"]]
    for kind in ("state", "response"):
        labels = zip(grid[kind].values, grid[f"{kind}_unit"].values, grid[f"{kind}_scale"].values, strict=True)
        names += [[kind, k, str(n), str(u), float(s), ""] for k, (n, u, s) in enumerate(labels, 1)]
    noises = zip(grid["noise"].values, grid["noise_source"].values, strict=True)
    names += [["noise", k, str(n), "", "", str(s)] for k, (n, s) in enumerate(noises, 1)]
    names += [["input", k, str(n), "", "", ""] for k, n in enumerate(grid["input"].values, 1)]
    names += [["jump", k, float(t), "s", "", ""] for k, t in enumerate(grid["jump"].values, 1)]
    tables["names"] = names
    return [_write_csv(rows, folder / f"{table}.csv") for table, rows in tables.items()]


def _write_csv(rows: list[list[Any]], path: Path) -> Path:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([[repr(x) if isinstance(x, float) else x for x in r] for r in rows])
    return write_text(path, text.getvalue())


FORMATS: dict[str, Callable[[xr.Dataset, Path, str], list[Path]]] = {"netcdf": _netcdf, "mat": _mat, "csv": _csv}
