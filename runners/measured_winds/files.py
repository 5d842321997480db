"""Flown winds as files: netCDF with one unit a variable, and the worst profiles as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from ..present.files import write_text
from ..present.netcdf import one_unit_a_variable, with_conventions, write_netcdf
from .fly import FlownWinds

WORST = 20


def write_flown(flown: FlownWinds, folder: Path) -> list[Path]:
    """Write flown_winds.nc and worst_profiles.csv.

    Parameters
    ----------
    flown : FlownWinds
    folder : Path

    Returns
    -------
    list of Path

    Raises
    ------
    OutputFolderError
    """
    found = flown.to_dataset()
    units = [str(unit) for unit in found["unit"].values]
    whole = one_unit_a_variable(found.drop_vars("unit"), {"response": units}, words={})
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("response", "unit", "rank", "profile", "date", "value", "time_s"))
    for response, unit in zip(flown.responses, units, strict=True):
        for rank, (name, date, value, time) in enumerate(flown.worst(response, WORST), start=1):
            writer.writerow((response, unit, rank, name, date, f"{value:.9g}", f"{time:g}"))
    return [
        write_netcdf(with_conventions(whole), folder / "flown_winds.nc"),
        write_text(folder / "worst_profiles.csv", text.getvalue()),
    ]
