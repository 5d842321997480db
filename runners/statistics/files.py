"""Response statistics as files: netCDF, and CSV with units in the header."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from ..present.files import write_whole
from .results import ResponseStatistics

COLUMNS = ("time_s", "response", "unit", "source", "mean", "variance", "std", "mean_plus_3sigma")


def write_statistics(statistics: ResponseStatistics, folder: Path) -> list[Path]:
    """Write statistics.nc (NetCDF) and statistics.csv (one row a time, response and source)."""
    text = statistics_csv(statistics)
    return [
        write_whole(folder / "statistics.nc", lambda p: statistics.to_netcdf(p, engine="scipy")),
        write_whole(folder / "statistics.csv", lambda p: p.write_text(text, encoding="utf-8")),
    ]


def statistics_csv(statistics: ResponseStatistics) -> str:
    """Return the statistics as tidy CSV."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    values = {name: statistics[name].values for name in COLUMNS[4:]}
    for k, time in enumerate(statistics["time"].values):
        for r, response in enumerate(statistics["response"].values):
            for s, source in enumerate(statistics["source"].values):
                numbers = (np.format_float_scientific(values[name][k, r, s], 9) for name in COLUMNS[4:])
                writer.writerow([f"{time:.12g}", response, statistics["unit"].values[r], source, *numbers])
    return buffer.getvalue()
