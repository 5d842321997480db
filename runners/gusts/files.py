"""Gusts as files: netCDF with one unit a variable, and CSV with units in a column."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ..present.files import write_text
from ..present.netcdf import one_unit_a_variable, with_conventions, write_netcdf
from .combined import MEANINGS
from .search import GustSweep


def write_gusts(sweeps: Sequence[GustSweep], sheets: Sequence[xr.Dataset], folder: Path) -> list[Path]:
    """Write gusts_SHAPE.nc, worst_gusts.csv and combined_loads.csv.

    Parameters
    ----------
    sweeps : sequence of GustSweep
        One a shape.
    sheets : sequence of Dataset
        The combined loads of each.
    folder : Path

    Returns
    -------
    list of Path

    Raises
    ------
    OutputFolderError
    """
    written = []
    for sweep in sweeps:
        found = sweep.dataset.drop_vars("unit")
        whole = one_unit_a_variable(found, {"response": list(sweep.units)}, words={})
        written.append(write_netcdf(with_conventions(whole), folder / f"gusts_{sweep.gust.name}.nc"))
    for name, text in (("worst_gusts.csv", _worst_csv(sweeps)), ("combined_loads.csv", _sheet_csv(sheets))):
        written.append(write_text(folder / name, text))
    return written


def _worst_csv(sweeps: Sequence[GustSweep]) -> str:
    head = ["response", "unit", "shape", "amplitude_m_s", "value", "time_s", "length_m", "start_altitude_m", "met_at_s"]
    if any(sweep.from_any_direction for sweep in sweeps):
        head.append("blows_towards_deg")
    rows: list[Sequence[object]] = [head]
    for sweep in sweeps:
        for name in sweep.responses:
            w = sweep.worst(name)
            numbers = (w.gust.amplitude, w.value, w.time, w.gust.length, w.start_altitude, w.time_met)
            toward = [] if w.direction is None else [f"{np.degrees(w.direction) % 360:.9g}"]
            rows.append((name, w.unit, w.gust.name, *(f"{x:.9g}" for x in numbers), *toward))
    return _csv(rows)


def _sheet_csv(sheets: Sequence[xr.Dataset]) -> str:
    rows: list[Sequence[object]] = [("response", "unit", "shape", "time_s", *MEANINGS)]
    for sheet in sheets:
        for k, name in enumerate(sheet["response"].values):
            unit, time = str(sheet["unit"].values[k]), float(sheet["time"][k])
            values = (float(sheet[column][k]) for column in MEANINGS)
            numbers = ("" if np.isnan(value) else f"{value:.9e}" for value in values)
            rows.append((str(name), unit, sheet.attrs["gust"], f"{time:.9g}", *numbers))
    return _csv(rows)


def _csv(rows: Sequence[Sequence[object]]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return buffer.getvalue()
