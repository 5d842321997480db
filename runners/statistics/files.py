"""Response statistics as files: netCDF with one unit a variable, and CSV with units in a column."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import xarray as xr

from ...model.errors import DataError
from ..present.files import write_text
from ..present.netcdf import joined, one_unit_a_variable, with_conventions, write_netcdf
from .instant_levels import LEVEL

NAME = "statistics.nc"
COLUMNS = ("time_s", "response", "unit", "source", "mean", "variance", "std", "mean_plus_3sigma")


def write_statistics(statistics: xr.Dataset, folder: Path) -> list[Path]:
    """Write statistics.nc (NetCDF) and statistics.csv (one row a member, time, response and source)."""
    text = statistics_csv(statistics)
    return [write_stored(statistics, folder), write_text(folder / "statistics.csv", text)]


def write_stored(statistics: xr.Dataset, folder: Path) -> Path:
    """Write statistics.nc alone: of statistics that were written before, with more that the table does not hold."""
    return write_netcdf(by_response(statistics), folder / NAME)


def by_response(statistics: xr.Dataset) -> xr.Dataset:
    """Return statistics as files hold them: one variable a response and quantity, each with its unit."""
    found = whole(statistics)
    units = [str(unit) for unit in found["unit"].values]
    dims = {"response": units} | ({"other_response": units} if "other_response" in found.dims else {})
    if "resultant" in found.dims:
        dims["resultant"] = [str(unit) for unit in found["resultant_unit"].values]
    return with_conventions(one_unit_a_variable(found, dims))


def whole(statistics: xr.Dataset) -> xr.Dataset:
    """Return statistics with the dimensions time, response and source where one entry of them had been chosen."""
    chosen = [d for d in ("time", "response", "source") if d in statistics.coords and d not in statistics.dims]
    order = ("member", "time", "response", "source")
    grown = statistics.expand_dims(chosen)
    if "response" in chosen:  # its unit goes with it
        grown = grown.assign_coords(unit=("response", [str(statistics["unit"].item())]))
    if "other_response" in grown.dims:
        grown = grown.sel(other_response=grown["response"].values)
    return grown.transpose(*(d for d in order if d in grown.dims), ...) if chosen else grown


def read_statistics(path: Path) -> xr.Dataset:
    """Read what :func:`write_statistics` wrote, from the file or its folder.

    Raises
    ------
    DataError
        There is no such file, or it holds no response statistics.
    """
    path = path / NAME if path.is_dir() else path
    try:
        with xr.open_dataset(path, engine="scipy", decode_times=False) as stored:
            found = joined(stored.load())
    except FileNotFoundError:
        raise DataError("there is no such file; 'ascentwind run' writes one", file=path) from None
    except (OSError, TypeError, ValueError, IndexError, KeyError) as error:
        raise DataError(f"cannot be read as NetCDF ({error})", file=path) from None
    if not {"mean", "std", "response", "source", "time"} <= set(found.variables):
        raise DataError("holds no response statistics of this version; compute them again", file=path)
    units = [stored[v].attrs for v in stored.data_vars if stored[v].attrs.get("quantity") == "std"]
    by_name = {attributes["response"]: attributes["response_unit"] for attributes in units}
    found.attrs = {k: v for k, v in found.attrs.items() if k not in ("Conventions", "history")}
    if "resultant" in found.dims:
        of = {a["resultant"]: a["resultant_unit"] for a in (v.attrs for v in stored.values()) if "resultant" in a}
        found = found.assign_coords(resultant_unit=("resultant", [of[str(r)] for r in found["resultant"].values]))
    return found.assign_coords(unit=("response", [by_name[str(r)] for r in found["response"].values]))


def statistics_csv(statistics: xr.Dataset) -> str:
    """Return the statistics as tidy CSV; the rows of a batch begin with the number of the member."""
    found = whole(statistics)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    members = "member" in found.dims
    levels = [float(p) for p in found["probability"].values] if LEVEL in found else []
    header = *COLUMNS, *(f"{LEVEL}_{p!r}" for p in levels)
    writer.writerow(("member", *header) if members else header)
    for m in range(found.sizes["member"]) if members else (None,):
        part = found if m is None else found.isel(member=m)
        values = [part[name].values for name in COLUMNS[4:]]
        values += [part[LEVEL].sel(probability=p).values for p in levels]
        for k, time in enumerate(part["time"].values):
            for r, response in enumerate(part["response"].values):
                for s, source in enumerate(part["source"].values):
                    numbers = (np.format_float_scientific(column[k, r, s], 9) for column in values)
                    row = [f"{time:.12g}", response, part["unit"].values[r], source, *numbers]
                    writer.writerow(row if m is None else [m, *row])
    return buffer.getvalue()
