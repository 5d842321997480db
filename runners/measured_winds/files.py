"""Flown winds as files: netCDF with one unit a variable, and the worst profiles as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from ..present.files import write_text
from ..present.netcdf import one_unit_a_variable, with_conventions, write_netcdf
from ..statistics.resultants import resultant_pairs
from .flown_resultants import FlownResultants
from .fly import FlownWinds

WORST = 20


def write_flown(flown: FlownWinds, folder: Path) -> list[Path]:
    """Write flown_winds.nc and worst_profiles.csv, and of both planes flown_resultants.nc.

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
    written, text = [], io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("response", "unit", "rank", "profile", "date", "value", "time_s"))
    parts: dict[str, FlownWinds | FlownResultants] = {"flown_winds": flown}
    if resultant_pairs(flown.responses):
        parts["flown_resultants"] = flown.resultants
    for name, part in parts.items():
        found = part.to_dataset()
        units = [str(unit) for unit in found["unit"].values]
        whole = one_unit_a_variable(found.drop_vars("unit"), {"response": units}, words={})
        written.append(write_netcdf(with_conventions(whole), folder / f"{name}.nc"))
        for response, unit in zip(part.responses, units, strict=True):
            for rank, (profile, date, value, time) in enumerate(part.worst(response, WORST), start=1):
                writer.writerow((response, unit, rank, profile, date, f"{value:.9g}", f"{time:g}"))
    return [*written, write_text(folder / "worst_profiles.csv", text.getvalue())]
