"""A parameter study for people: tables on the screen, CSV files and figures."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import xarray as xr
from rich.console import Console
from rich.table import Table

from ..figures import words, write_figure
from ..output import write_bytes
from .changes import changes
from .compute import COMPUTED, FAILED, STATUS
from .figures import band_figure, grid_figure, histogram_figure, tornado_figure
from .measures import LABELS, PEAK, displayed, measures
from .run import ParameterStudy
from .spread import spread

SHOWN_REASONS = 3
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
    _print_reasons(result, console)
    kind = result.plan.kind
    if kind == "dispersion":
        found = spread(result)
        written.append(_write_csv(folder / "spread.csv", spread_rows(found)))
        _print_spread(found, console)
        for response in _names(found, "response"):
            written += write_figure(histogram_figure(result, measured, found, response), folder, f"spread_{response}")
            written += write_figure(band_figure(result, found, response), folder, f"band_{response}")
    elif kind == "one_at_a_time":
        found = changes(result)
        written.append(_write_csv(folder / "changes.csv", change_rows(found)))
        _print_changes(found, console)
        for response in _names(found, "response"):
            written += write_figure(tornado_figure(result, found, response), folder, f"tornado_{response}")
    else:
        _print_grid(result, measured, console)
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
    """Return one row a member: quantities, status, and the peak of mean + 3 sigma of each response, SI."""
    data, responses = result.data, _names(measured, "response")
    head = ["member", *(f"{q.name} ({q.unit})" for q in result.quantities), "status", "reason"]
    for response, unit in zip(responses, _names(measured, "unit"), strict=True):
        head += [f"peak mean + 3 sigma of {response} ({unit})", f"at (s), {response}"]
    rows = [head]
    column = {int(m): i for i, m in enumerate(measured["member"].values)}
    peak, time = measured["sample"].sel(measure=PEAK).values, measured["member_peak_time"].values
    for m, (row, status, reason) in enumerate(
        zip(data["value"].values, data["status"].values, data["reason"].values, strict=True)
    ):
        cells = [str(m), *map(_number, row), STATUS[status], str(reason)]
        for r in range(len(responses)):
            cells += [_number(peak[r, column[m]]), _number(time[r, column[m]])] if m in column else ["", ""]
        rows.append(cells)
    return rows


def spread_rows(found: xr.Dataset) -> list[list[str]]:
    """Return one row a measure and response."""
    names = ["nominal", "sample_mean", "sample_mean_low", "sample_mean_high", "sample_std", "sample_std_low"]
    names += ["sample_std_high", "first_order_mean", "first_order_std", "ratio"]
    percents = found["percent"].values.tolist()
    head = ["measure", "response", "unit", "at (s)", *names]
    rows = [head + [f"percentile_{p:g}{end}" for p in percents for end in ("", "_low", "_high")]]
    for measure in _names(found, "measure"):
        for response in _names(found, "response"):
            at = found.sel(measure=measure, response=response)
            cells = [measure, response, at["unit"].item(), "" if measure == PEAK else _number(at["peak_time"].item())]
            cells += [_number(at[name].item()) for name in names]
            for p in percents:
                cells += [_number(at[f"percentile{end}"].sel(percent=p).item()) for end in ("", "_low", "_high")]
            rows.append(cells)
    return rows


def change_rows(found: xr.Dataset) -> list[list[str]]:
    """Return one row a measure, response, quantity and end."""
    rows = [["measure", "response", "unit", "quantity", "value", "nominal", "change", "first_order_change"]]
    for measure in _names(found, "measure"):
        for response in _names(found, "response"):
            for quantity in _names(found, "quantity"):
                for end in _names(found, "end"):
                    at = found.sel(measure=measure, response=response, quantity=quantity, end=end)
                    numbers = (at[name].item() for name in ("value", "nominal", "change", "first_order_change"))
                    rows.append([measure, response, at["unit"].item(), quantity, *map(_number, numbers)])
    return rows


def _print_reasons(result: ParameterStudy, console: Console) -> None:
    status = result.data["status"].values
    console.print(f"{status.size} members: " + ", ".join(f"{(status == k).sum()} {s}" for k, s in enumerate(STATUS)))
    for m in np.flatnonzero(status != COMPUTED)[:SHOWN_REASONS]:
        text = f"member {m}: {result.data['reason'].values[m]}"
        console.print(text, style="yellow", soft_wrap=True, markup=False, highlight=False)
    more = int((status != COMPUTED).sum()) - SHOWN_REASONS
    if more > 0:
        console.print(f"and {more} more, with their reasons in members.csv", style="dim")
    if (status == FAILED).any():
        console.print("Failed members are left out of what follows; unstable ones are in it.", style="dim")


def _shown(value: float, factor: float, digits: int = 4) -> str:
    return f"{factor * value:.{digits}g}" if np.isfinite(value) else "-"


def _print_spread(found: xr.Dataset, console: Console) -> None:
    for response in _names(found, "response"):
        part = found.sel(response=response)
        (factor, unit), time = displayed(found, response), part["peak_time"].item()
        title = f"{words(response).capitalize()} ({unit}) of {found.attrs['members']} members"
        table = Table(title=f"{title}, below with 95 % intervals")
        table.add_column("of", no_wrap=True)
        for column in ("nominal", "mean", "σ", "first order σ", "ratio", "95 %", "99 %"):
            table.add_column(column, justify="right", no_wrap=True)
        for measure in _names(found, "measure"):
            at = part.sel(measure=measure)
            numbers = {name: _shown(at[name].item(), factor, 3) for name in found.data_vars if at[name].ndim == 0}
            ranked = [
                _interval(
                    *(_shown(at[f"percentile{e}"].sel(percent=p).item(), factor, 3) for e in ("", "_low", "_high"))
                )
                for p in (95.0, 99.0)
            ]
            table.add_row(
                LABELS[measure] if measure == PEAK else f"{LABELS[measure]} at {time:g} s",
                numbers["nominal"],
                numbers["sample_mean"],
                _interval(numbers["sample_std"], numbers["sample_std_low"], numbers["sample_std_high"]),
                numbers["first_order_std"],
                _shown(at["ratio"].item(), 1.0, 3),
                *ranked,
            )
        console.print(table)
    table = Table("quantity", title="What drives the spread of the peak mean + 3σ, to first order")
    for response in _names(found, "response"):
        table.add_column(words(response), justify="right")
    shares = found["share"].sel(measure=PEAK)
    for q in np.argsort(-shares.isel(response=0).values, kind="stable"):
        cells = (f"{100 * s:.1f} %" if np.isfinite(s) else "-" for s in shares.isel(quantity=q).values)
        table.add_row(str(found["quantity"].values[q]), *cells)
    console.print(table)


def _interval(value: str, low: str, high: str) -> str:
    """Return a number with its interval; an end that too few members leave open is not written."""
    return f"{value}\n{'' if low == '-' else low} … {'' if high == '-' else high}"


def _print_changes(found: xr.Dataset, console: Console) -> None:
    table = Table("response", "quantity", title="Change of the peak mean + 3σ, first order in brackets")
    for column in ("low", "change", "high", "change"):
        table.add_column(column, justify="right", no_wrap=True)
    for response in _names(found, "response"):
        part = found.sel(measure=PEAK, response=response)
        factor, unit = displayed(found, response)
        order = np.argsort(-np.abs(part["first_order_change"].values).max(axis=-1), kind="stable")
        for k, q in enumerate(order):
            at = part.isel(quantity=q)
            cells = []
            for end in ("low", "high"):
                one = at.sel(end=end)
                change, predicted = (factor * one[n].item() for n in ("change", "first_order_change"))
                text = f"{change:+.4g}" if np.isfinite(change) else "failed"
                cells += [f"{one['value'].item():.5g}", f"{text} ({predicted:+.4g}) {unit}"]
            label = words(response) if k == 0 else ""
            table.add_row(label, str(at["quantity"].item()), *cells, end_section=k + 1 == order.size)
    console.print(table)


def _print_grid(result: ParameterStudy, measured: xr.Dataset, console: Console) -> None:
    peak = measured["sample"].sel(measure=PEAK)
    table = Table("response", title="Peak mean + 3σ over the grid")
    for column in ("nominal", "least", "at", "largest", "at"):
        table.add_column(column, justify="right")
    for response in _names(measured, "response"):
        values = peak.sel(response=response).values
        if not values.size:
            continue
        factor, unit = displayed(measured, response)
        cells = [_shown(measured["nominal"].sel(measure=PEAK, response=response).item(), factor)]
        for k in (int(np.argmin(values)), int(np.argmax(values))):
            row = result.data["value"].values[measured["member"].values[k]]
            at = ", ".join(f"{q.name} = {v:.5g}" for q, v in zip(result.quantities, row, strict=True))
            cells += [_shown(values[k], factor), at]
        table.add_row(f"{words(response)} ({unit})", *cells)
    console.print(table)
