"""A sensitivity as its file holds it: one unit a variable, the rows of each table beside each other."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..present.netcdf import RULE, one_unit_a_variable, unit_by_rule, variable_name

KNOTS = "knot_"  # begins the names of what is by row


def stored_layout(found: xr.Dataset) -> xr.Dataset:
    """Return a sensitivity with one variable for each parameter, table and table's rows that has its own unit.

    ``derivative`` (parameter) becomes ``control_T1_gain_derivative`` and so on, ``table_derivative`` (table, t)
    ``mass_table_derivative`` (t), ``knot_derivative`` (knot) ``mass_knot_derivative`` (mass_row),
    ``grouped_factor_derivative`` (grouped_factor) ``aerodynamics_grouped_factor_derivative``. What is in percent per
    percent stays over (parameter), (table), (band) and (grouped_factor).
    """
    quantity = unit_by_rule("unit^2" if found.attrs["quantity"] == "variance" else "unit", {"unit": unit_of(found)})
    dims = {"parameter": found["parameter_unit"].values.tolist()}
    if "table" in found.dims:
        dims["table"] = found["table_unit"].values.tolist()
    if "grouped_factor" in found.dims:
        dims["grouped_factor"] = ["1"] * found.sizes["grouped_factor"]
    by_row = [name for name in found.variables if str(name).startswith(KNOTS)]
    stored = one_unit_a_variable(found.drop_vars(by_row), dims, {"quantity": quantity})
    stored.attrs["quantity_unit"] = quantity
    return stored.assign(rows_of_tables(found, quantity)) if by_row else stored


def unit_of(found: xr.Dataset) -> str:
    return str(found.attrs["response_unit"])


def rows_of_tables(found: xr.Dataset, quantity: str) -> dict[str, tuple]:
    """Return value, argument, derivative and elasticity by row, a variable for each table, over its own dimension."""
    variables: dict[str, tuple] = {}
    tables = found["knot_table"].values
    for table in dict.fromkeys(tables.tolist()):
        at = np.flatnonzero(tables == table)
        unit, name = str(found["knot_unit"].values[at[0]]), variable_name(str(table))
        argument = {
            "units": str(found["knot_argument_unit"].values[at[0]]),
            "long_name": f"argument of a row of {table}",
        }
        variables[f"{name}_knot_argument"] = (f"{name}_row", found["knot_argument"].values[at], argument)
        for what in ("knot_value", "knot_derivative", "knot_elasticity"):
            if what in found:
                attributes = dict(found[what].attrs) | {"quantity": what, "table": table}
                if RULE in attributes:
                    attributes["units"] = unit_by_rule(attributes[RULE], {"quantity": quantity, "knot": unit})
                attributes["long_name"] = f"{attributes['long_name']}: {table}"
                variables[f"{name}_{what}"] = (f"{name}_row", found[what].values[at], attributes)
    return variables
