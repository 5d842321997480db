"""Ranked tables of sensitivities, on the screen and as files."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import xarray as xr
from rich.console import Console
from rich.table import Table

from ..present.files import write_text
from ..present.netcdf import write_netcdf
from ..present.style import write_figure
from ..present.terminal import print_table
from .derivative_figures import altitude_figure, heading, largest, time_figure, tornado_figure
from .layout import stored_layout

SHOWN = 15


def print_sensitivity(found: xr.Dataset, console: Console) -> None:
    """Print the parameters and tables with the largest elasticities."""
    unit = found.attrs["response_unit"]
    squared = f"({unit})²" if found.attrs["quantity"] == "variance" else unit
    table = Table("parameter", title=f"What drives {heading(found)}")
    for column in ("value", "% per %", f"derivative ({squared} per unit)"):
        table.add_column(column, justify="right", no_wrap=True)
    for name, size in largest(found["parameter"].values, found["elasticity"].values, SHOWN):
        at = found.sel(parameter=name)
        number = f"{float(at['parameter_value']):.5g} {at['parameter_unit'].item()}".removesuffix(" 1")
        table.add_row(name, number, f"{size:+.4f}", f"{float(at['derivative']):+.4g}")
    print_table(table, console)
    if "table_elasticity" in found:
        table = Table("table", title="The same by whole tables, others held")
        table.add_column("% per %", justify="right")
        for name, size in largest(found["table"].values, found["table_elasticity"].values, SHOWN):
            table.add_row(name, f"{size:+.4f}")
        print_table(table, console)
    if found.sizes.get("grouped_factor"):
        table = Table("grouped factor", title="Tables that one cause moves together")
        table.add_column("% per %", justify="right")
        for name, size in zip(found["grouped_factor"].values, found["grouped_factor_elasticity"].values, strict=True):
            table.add_row(str(name), f"{float(size):+.4f}")
        print_table(table, console)
    if found.attrs["peak_at_end_of_range"]:
        console.print("The peak is an end of the range searched; the true one may lie beyond.", style="dim")


def write_sensitivity(found: xr.Dataset, folder: Path) -> list[Path]:
    """Write sensitivity.nc, sensitivity.csv (one row a parameter, table and table row) and the figures."""
    text = sensitivity_csv(found)
    written = [
        write_netcdf(stored_layout(found), folder / "sensitivity.nc"),
        write_text(folder / "sensitivity.csv", text),
        *write_figure(tornado_figure(found), folder, "sensitivity_tornado"),
    ]
    if "table_elasticity" in found:
        written += write_figure(time_figure(found), folder, "sensitivity_over_time")
    if "wind_sigma_elasticity" in found:
        written += write_figure(altitude_figure(found), folder, "sensitivity_over_altitude")
    return written


def sensitivity_csv(found: xr.Dataset) -> str:
    """Return parameters, whole tables, rows of tables and kilometres of wind as tidy CSV."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(("kind", "name", "argument", "value", "derivative", "elasticity"))

    def rows(kind: str, names, arguments, values, derivatives, elasticities) -> None:
        for name, *numbers in zip(names, arguments, values, derivatives, elasticities, strict=True):
            writer.writerow([kind, name, *("" if x is None else f"{float(x):.10g}" for x in numbers)])

    def column(name: str):
        return found[name].values

    none = [None] * found.sizes["parameter"]
    defined = [e if d else None for e, d in zip(column("elasticity"), column("elasticity_defined"), strict=True)]
    rows("parameter", column("parameter"), none, column("parameter_value"), column("derivative"), defined)
    if "table_elasticity" in found:
        none = [None] * found.sizes["table"]
        rows("table", column("table"), none, none, none, column("table_elasticity"))
    if found.sizes.get("grouped_factor"):
        of_factors = (column(f"grouped_factor{part}") for part in ("", "_derivative", "_elasticity"))
        names, derivatives, elasticities = of_factors
        none = [None] * len(names)
        rows("grouped factor", names, none, [1.0] * len(names), derivatives, elasticities)
    if "knot_elasticity" in found:
        rows("row", *(column(f"knot_{n}") for n in ("table", "argument", "value", "derivative", "elasticity")))
    for name in ("wind_sigma_elasticity", "wind_mean_elasticity"):
        if name in found:
            none = [None] * found.sizes["band"]
            rows("kilometre", [name] * len(none), column("band"), none, none, column(name))
    return buffer.getvalue()
