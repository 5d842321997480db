"""What files that people keep must be for the programs that they keep them with."""

from __future__ import annotations

import csv
import importlib
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from scipy.io import loadmat

FORMULA = ("=", "+", "@", "\t")  # what Excel computes, where it begins a text


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def opens_as_a_sheet(file: Path) -> pd.DataFrame:
    """Hold a CSV file against what Excel makes of it; return it as pandas reads it.

    Excel takes the first line for the header, takes comments for cells, reads other letters than ASCII wrongly where
    no byte order mark says UTF-8, computes texts that begin with = + - or @, and makes dates of texts such as 3/4.
    """
    data = file.read_bytes()
    assert data.isascii() or data.startswith(b"\xef\xbb\xbf"), f"{file.name}: Excel would garble letters"
    with file.open(newline="", encoding="utf-8-sig") as opened:
        header, *rows = csv.reader(opened)
    assert rows, file.name
    assert all(cell.strip() and not is_number(cell) for cell in header), f"{file.name}: {header}"
    assert len(set(header)) == len(header), f"{file.name}: {header}"
    for row in rows:
        assert len(row) == len(header), f"{file.name}: {row}"
        for cell in (cell for cell in row if not is_number(cell)):
            assert not cell.startswith((*FORMULA, "-")), f"{file.name}: '{cell}'"
            parts = cell.split("/")
            assert not (len(parts) in (2, 3) and all(p.isdigit() for p in parts)), f"{file.name}: '{cell}'"
    frame = pd.read_csv(file)
    for name, column in zip(header, zip(*rows, strict=True), strict=True):
        if all(is_number(cell) or not cell for cell in column) and any(column):
            assert frame[name].dtype.kind in "if", f"{file.name}: {name}"
    return frame


def opens_in_excel(file: Path, folder: Path) -> None:
    """Write the sheet that Excel makes of a CSV file by openpyxl, and read the same numbers from it."""
    openpyxl = pytest.importorskip("openpyxl")
    frame = opens_as_a_sheet(file)
    book = folder / f"{file.stem}.xlsx"
    frame.to_excel(book, index=False)
    sheet = openpyxl.load_workbook(book, read_only=True).active
    assert sheet is not None
    rows = list(sheet.iter_rows(values_only=True))
    assert list(rows[0]) == list(frame.columns) and len(rows) == len(frame) + 1


def opens_in_xarray(file: Path, pint: bool) -> None:
    """Open a netCDF file by plain xarray; with pint-xarray every unit is one."""
    with xr.open_dataset(file) as dataset:
        assert dataset.data_vars
        if pint:
            importlib.import_module("pint_xarray")  # which makes the accessor
            dataset.load().pint.quantify()


def opens_in_matlab(file: Path) -> dict:
    """Open a MATLAB file as SciPy does; its names are MATLAB's, its strings cells."""
    found = {name: value for name, value in loadmat(file).items() if not name.startswith("__")}
    assert found
    for name, value in found.items():
        assert name.isidentifier() and len(name) <= 63 and not name.startswith("_"), name
        assert value.dtype.kind in "fiuOUV", name  # V: a struct
    return found
