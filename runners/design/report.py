"""Designs and trades on the screen and as files."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..present.files import write_text
from ..present.style import write_figure
from ..present.terminal import print_table
from ..present.wording import display, words
from ..statistics.resultants import outputs_of
from .design import DesignResult, RecomputedPeak, TradePoint
from .trade_figure import trade_figure


def print_design(result: DesignResult, again: Sequence[RecomputedPeak], console: Console) -> None:
    """Print parameters, peaks and dampings before and after, what holds the design, and the verdict."""
    table = Table("parameter", title=f"Design of {result.problem.study.system.name}")
    for column in ("before", "after", "between"):
        table.add_column(column, justify="right", no_wrap=True)
    for name, (low, high) in result.problem.parameters.items():
        table.add_row(name, f"{result.start[name]:.5g}", f"{result.values[name]:.5g}", f"{low:g} and {high:g}")
    print_table(table, console)
    problem = result.problem
    of_two = any(len(outputs_of(problem.study, name)) == 2 for name in (problem.response, *problem.peak_limits))
    resultants = ", of resultants levels passed with 0.00135" if of_two else ""
    title = f"Peaks are of |mean| + 3σ{resultants}, dampings the least at the frozen times"
    table = Table("what", title=title)
    for column in ("before", "after", "limit"):
        table.add_column(column, justify="right", no_wrap=True)
    for quantity in result.quantities:
        factor, unit = display(quantity.unit, quantity.before)
        unit = f" {unit}".removesuffix(" 1")
        at = f" at {quantity.time_after:g} s" + (f", {quantity.side}" if quantity.side else "")
        limit = "" if quantity.limit is None else f"{factor * quantity.limit:.4g}{unit}"
        table.add_row(
            words(quantity.name),
            f"{factor * quantity.before:.4g}{unit}",
            f"{factor * quantity.after:.4g}{unit}{at}",
            limit,
        )
    print_table(table, console)
    for name, multiplier in result.stationarity.multipliers:
        console.print(f"active: {name}, multiplier {multiplier:.3g}", soft_wrap=True, highlight=False)
    console.print(verdict(result, again), style="green" if good(result, again) else "bold red", soft_wrap=True)


def good(result: DesignResult, again: Sequence[RecomputedPeak]) -> bool:
    """Return whether a design converged and CVODES agrees."""
    return result.converged and all(v.agrees for v in again)


def verdict(result: DesignResult, again: Sequence[RecomputedPeak]) -> str:
    """Return stationarity, run time and what CVODES says in a sentence."""
    state = "stationary point" if result.converged else "no stationary point was reached"
    worst = max((v.difference for v in again), default=0.0)
    return (
        f"{state}: residual {result.stationarity.residual:.1e}, violation {result.stationarity.violation:.1e}; "
        f"{result.evaluations} flights and {result.gradients} gradients in {result.seconds:.1f} s; "
        f"CVODES differs by {worst:.1e} at most at {len(again)} peaks"
    )


def write_design(result: DesignResult, folder: Path) -> list[Path]:
    """Write design.csv: parameters, peaks and dampings before and after, SI."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(("kind", "name", "unit", "before", "after", "limit", "time_s"))
    for name, value in result.values.items():
        unit = result.problem.study.parameters[name].unit
        writer.writerow(("parameter", name, unit, f"{result.start[name]:.10g}", f"{value:.10g}", "", ""))
    for q in result.quantities:
        limit = "" if q.limit is None else f"{q.limit:.10g}"
        writer.writerow(("result", q.name, q.unit, f"{q.before:.10g}", f"{q.after:.10g}", limit, f"{q.time_after:g}"))
    for name, multiplier in result.stationarity.multipliers:
        writer.writerow(("active", name, "1", "", f"{multiplier:.6g}", "", ""))
    return [write_text(folder / "design.csv", buffer.getvalue())]


def write_trade(trades: Mapping[str, Sequence[TradePoint]], response: str, title: str, folder: Path) -> list[Path]:
    """Write trade.csv (one row a variant and limit, SI) and the figure."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    results = [p.result for points in trades.values() for p in points if p.result]
    names = list(dict.fromkeys(name for result in results for name in result.values))
    writer.writerow(("variant", f"limit_{response}", "closest", "peak", f"peak_{response}", "converged", *names))
    for variant, points in trades.items():
        for point in points:
            row: list[str] = [variant, f"{point.limit:.10g}"]
            if point.result is None:
                row += ["" if point.closest is None else f"{point.closest:.10g}", "", "", "", *[""] * len(names)]
            else:
                reached = next(q.after for q in point.result.quantities if q.name == f"peak {response}")
                row += ["", f"{point.result.peak:.10g}", f"{reached:.10g}", str(int(point.result.converged))]
                row += [f"{point.result.values[n]:.8g}" if n in point.result.values else "" for n in names]
            writer.writerow(row)
    written = [write_text(folder / "trade.csv", buffer.getvalue())]
    if results:
        written += write_figure(trade_figure(trades, response, title), folder, "trade")
    return written
