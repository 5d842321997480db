"""A parameter study for people: CSV files and figures; the screen is in ``printout``."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import xarray as xr
from rich.console import Console

from ..present.files import write_bytes
from ..present.style import write_figure
from .changes import changes
from .compute import STATUS
from .dispersion_figures import band_figure, histogram_figure, tornado_figure
from .grid_figure import grid_figure
from .measures import LEVEL, PEAK, measures
from .printout import print_changes, print_grid, print_reasons, print_spread
from .run import ParameterStudy
from .spread import spread

ENDS = ("", "_low", "_high")  # of a percentile: value and interval


def report(result: ParameterStudy, folder: Path, console: Console) -> list[Path]:
    """Print what a parameter study found, and write its CSV files and figures.

    Raises
    ------
    OutputFolderError
    DataError
        A dispersion with too few members that have numbers.
    """
    measured = measures(result)
    written = [_write_csv(folder / "members.csv", member_rows(result, measured))]
    print_reasons(result, console)
    kind = result.plan.kind
    if kind == "dispersion":
        found = spread(result)
        written.append(_write_csv(folder / "spread.csv", spread_rows(found)))
        print_spread(found, console)
        for response in _names(found, "response"):
            written += write_figure(histogram_figure(result, measured, found, response), folder, f"spread_{response}")
            written += write_figure(band_figure(result, found, response), folder, f"band_{response}")
    elif kind == "one_at_a_time":
        found = changes(result)
        written.append(_write_csv(folder / "changes.csv", change_rows(found)))
        print_changes(found, console)
        for response in _names(found, "response"):
            written += write_figure(tornado_figure(result, found, response), folder, f"tornado_{response}")
    else:
        print_grid(result, measured, console)
        if len(result.quantities) <= 2 and result.computed.any():
            for response in _names(measured, "response"):
                written += write_figure(grid_figure(result, measured, response), folder, f"grid_{response}")
    return written


def _names(dataset: xr.Dataset, name: str) -> list[str]:
    return [str(value) for value in dataset[name].values]


def _number(value: float) -> str:
    return f"{value:.10g}" if np.isfinite(value) else ""


def _write_csv(path: Path, rows: Iterable[Iterable[str]]) -> Path:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    return write_bytes(path, buffer.getvalue().encode())


def member_rows(result: ParameterStudy, measured: xr.Dataset) -> list[list[str]]:
    """Return one row a member: quantities, status, and the peak of each response and resultant, SI."""
    data, responses = result.data, _names(measured, "response")
    resultants = _names(data, "resultant") if LEVEL in data else []
    head = ["member", *(f"{q.name} ({q.unit})" for q in result.quantities), "status", "reason"]
    for response, unit in zip(responses, _names(measured, "unit"), strict=True):
        of, last = (LEVEL, "direction (rad)") if response in resultants else ("|mean| + 3 sigma", "side")
        head += [f"peak {of} of {response} ({unit})", f"at (s), {response}", f"{last}, {response}"]
    rows = [head]
    column = {int(m): i for i, m in enumerate(measured["member"].values)}
    peak, time = measured["sample"].sel(measure=PEAK).values, measured["member_peak_time"].values
    blank = xr.full_like(measured["member_peak_time"], np.nan)
    sides, directions = (measured.get(f"member_peak_{name}", blank).values for name in ("side", "direction"))
    for m, (row, status, reason) in enumerate(
        zip(data["value"].values, data["status"].values, data["reason"].values, strict=True)
    ):
        cells = [str(m), *map(_number, row), STATUS[status], str(reason)]
        for r, response in enumerate(responses):
            if m not in column:
                cells += [""] * 3
                continue
            at = r, column[m]
            last = _number(directions[at]) if response in resultants else str(sides[at])
            cells += [_number(peak[at]), _number(time[at]), last]
        rows.append(cells)
    return rows


def spread_rows(found: xr.Dataset) -> list[list[str]]:
    """Return one row a measure and response."""
    names = ["nominal", "sample_mean", "sample_mean_low", "sample_mean_high", "sample_std", "sample_std_low"]
    names += ["sample_std_high", "first_order_mean", "first_order_std", "ratio"]
    percents = found["percent"].values.tolist()
    head = ["measure", "response", "unit", "at (s)", *names]
    rows = [head + [f"percentile_{p:g}{end}" for p in percents for end in ENDS]]
    for measure in _names(found, "measure"):
        for response in _names(found, "response"):
            at = found.sel(measure=measure, response=response)
            if np.isnan(at["nominal"].item()):  # a resultant has no mean and no sigma, a response no level
                continue
            cells = [measure, response, at["unit"].item(), "" if measure == PEAK else _number(at["peak_time"].item())]
            cells += [_number(at[name].item()) for name in names]
            for p in percents:
                cells += [_number(at[f"percentile{end}"].sel(percent=p).item()) for end in ENDS]
            rows.append(cells)
    return rows


def change_rows(found: xr.Dataset) -> list[list[str]]:
    """Return one row a measure, response, quantity and end."""
    numbers = ("nominal", "change", "first_order_change")
    rows = [["measure", "response", "unit", "at (s)", "quantity", "quantity_unit", "value", "status", *numbers]]
    for measure in _names(found, "measure"):
        for response in _names(found, "response"):
            if np.isnan(found["nominal"].sel(measure=measure, response=response).item()):
                continue
            for quantity in _names(found, "quantity"):
                for end in _names(found, "end"):
                    at = found.sel(measure=measure, response=response, quantity=quantity, end=end)
                    time = "" if measure == PEAK else _number(at["peak_time"].item())
                    cells = [measure, response, at["unit"].item(), time, quantity, at["quantity_unit"].item()]
                    cells += [_number(at["value"].item()), STATUS[at["status"].item()]]
                    rows.append(cells + [_number(at[name].item()) for name in numbers])
    return rows
