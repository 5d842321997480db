"""Parameter studies on the screen: tables that keep every digit, also in a narrow terminal."""

from __future__ import annotations

import numpy as np
import xarray as xr
from rich.console import Console
from rich.table import Table

from ..present.terminal import print_whole
from ..present.wording import words
from .compute import COMPUTED, FAILED, STATUS, UNSTABLE
from .measures import LABELS, PEAK, displayed, label, nominal_side, timed
from .run import ParameterStudy

SHOWN_REASONS = 3


def print_reasons(result: ParameterStudy, console: Console) -> None:
    """Print how many members were computed, and why others were not."""
    status = result.data["status"].values
    console.print(f"{status.size} members: " + ", ".join(f"{(status == k).sum()} {s}" for k, s in enumerate(STATUS)))
    for m in np.flatnonzero(status != COMPUTED)[:SHOWN_REASONS]:
        text = f"member {m}: {result.data['reason'].values[m]}"
        console.print(text, style="yellow", soft_wrap=True, markup=False, highlight=False)
    more = int((status != COMPUTED).sum()) - SHOWN_REASONS
    if more > 0:
        console.print(f"and {more} more, with their reasons in members.csv", style="dim")
    if (status != COMPUTED).any():
        console.print("Failed members are left out of what follows; unstable ones are in it.", style="dim")


def print_spread(found: xr.Dataset, console: Console) -> None:
    """Print a table a response, a column a measure, and what each quantity has of the spread of the peak."""
    for response in _names(found, "response"):
        part = found.sel(response=response)
        (factor, unit), time = displayed(found, response), part["peak_time"].item()
        title = f"{words(response).capitalize()} ({unit}) of {found.attrs['members']} members, with 95 % intervals"
        title += f"; nominal peak: {side}" if (side := nominal_side(found, response)) else f"; {label(found, response)}"
        table = Table("", title=title)
        rows: list[list[str]] = [["nominal"], ["mean"], ["σ"], ["first-order σ"], ["ratio of σ"], ["95 %"], ["99 %"]]
        for measure in _names(found, "measure"):
            at = part.sel(measure=measure)
            if np.isnan(at["nominal"].item()):
                continue
            head = LABELS[measure] if measure != PEAK else f"peak of\n{LABELS[timed(found, response)]}"
            table.add_column(head if measure == PEAK else f"{head}\nat {time:g} s", justify="right")
            ranked = (
                [at[f"percentile{end}"].sel(percent=p).item() for end in ("", "_low", "_high")] for p in (95.0, 99.0)
            )
            cells = [
                _shown(at["nominal"].item(), factor),
                _interval([at[f"sample_mean{end}"].item() for end in ("", "_low", "_high")], factor),
                _interval([at[f"sample_std{end}"].item() for end in ("", "_low", "_high")], factor),
                _shown(at["first_order_std"].item(), factor),
                _shown(at["ratio"].item(), 1.0),
                *(_interval(numbers, factor) for numbers in ranked),
            ]
            for row, cell in zip(rows, cells, strict=True):
                row.append(cell)
        for row in rows:
            table.add_row(*row)
        print_whole(table, console)
    table = Table("quantity", title="Shares in the spread of the peak, to first order")
    for response in _names(found, "response"):
        table.add_column(words(response), justify="right")
    shares = found["share"].sel(measure=PEAK)
    for q in np.argsort(-shares.isel(response=0).values, kind="stable"):
        cells = (f"{100 * s:.1f} %" if np.isfinite(s) else "-" for s in shares.isel(quantity=q).values)
        table.add_row(str(found["quantity"].values[q]), *cells)
    print_whole(table, console)


def print_changes(found: xr.Dataset, console: Console) -> None:
    """Print a table a response: the change of its peak at both ends of every quantity, the largest first."""
    for response in _names(found, "response"):
        part = found.sel(measure=PEAK, response=response)
        factor, unit = displayed(found, response)
        nominal = _shown(part["nominal"].item(), factor, 4)
        title = f"Peak {label(found, response)}, nominal {nominal} {unit}{_in_brackets(found, response)}: "
        title += f"changes ({unit})"
        table = Table("quantity", title=title)
        for column in ("value", "change", "first order"):
            table.add_column(column, justify="right")
        order = np.argsort(-np.abs(part["first_order_change"].values).max(axis=-1), kind="stable")
        for q in order:
            at = part.isel(quantity=q)
            for k, end in enumerate(("low", "high")):
                one = at.sel(end=end)
                change, predicted = (factor * one[n].item() for n in ("change", "first_order_change"))
                text = "failed" if one["status"] == FAILED else f"{change:+.4g}"
                value = f"{one['value'].item():.5g} {at['quantity_unit'].item()}".removesuffix(" 1")
                table.add_row(
                    "" if k else str(at["quantity"].item()),
                    value,
                    f"{text}, unstable" if one["status"] == UNSTABLE else text,
                    f"{predicted:+.4g}" if np.isfinite(predicted) else "-",
                    end_section=k == 1,
                )
        print_whole(table, console)


def print_grid(result: ParameterStudy, measured: xr.Dataset, console: Console) -> None:
    """Print the least and the largest peak of every response, and the values at which they stand."""
    peak = measured["sample"].sel(measure=PEAK)
    table = Table("response", "", title="Peaks over the grid")
    for column in ("peak", *(q.name if q.unit == "1" else f"{q.name} ({q.unit})" for q in result.quantities)):
        table.add_column(column, justify="right")
    for response in _names(measured, "response"):
        values = peak.sel(response=response).values
        factor, unit = displayed(measured, response)
        name = f"{label(measured, response)} ({unit})" + (
            f", {side}" if (side := nominal_side(measured, response)) else ""
        )
        nominal = measured["nominal"].sel(measure=PEAK, response=response).item()
        at = [f"{q.nominal:.5g}" for q in result.quantities]
        table.add_row(name, "nominal", _shown(nominal, factor, 4), *at, end_section=not values.size)
        chosen = (("least", np.argmin), ("largest", np.argmax)) if values.size else ()
        for which, find in chosen:
            k = int(find(values))
            row = result.data["value"].values[measured["member"].values[k]]
            cells = [_shown(values[k], factor, 4), *(f"{v:.5g}" for v in row)]
            table.add_row("", which, *cells, end_section=which == "largest")
    print_whole(table, console)


def _in_brackets(found: xr.Dataset, response: str) -> str:
    side = nominal_side(found, response)
    return f" ({side})" if side else ""


def _names(dataset: xr.Dataset, name: str) -> list[str]:
    return [str(value) for value in dataset[name].values]


def _shown(value: float, factor: float, digits: int = 3) -> str:
    return f"{factor * value:.{digits}g}" if np.isfinite(value) else "-"


def _interval(numbers: list[float], factor: float) -> str:
    """Return a number with its interval below, one end of which too few members may leave open."""
    value, low, high = (_shown(x, factor) for x in numbers)
    if "-" in (low, high):
        return f"{value}\n" + (f"over {low}" if low != "-" else f"under {high}" if high != "-" else "")
    return f"{value}\n{low}…{high}"
