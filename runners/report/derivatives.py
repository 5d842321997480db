"""Sensitivities, ranked."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..present.wording import words
from ..sensitivity.derivative_figures import heading, largest
from .figures import bars
from .parts import Key, Part, Table, Text

SHOWN = 15


def sensitivities(found: xr.Dataset) -> list[Part]:
    """Return the parameters and tables that a response owes most to, and a figure of them."""
    unit = found.attrs["response_unit"]
    squared = f"({unit})²" if found.attrs["quantity"] == "variance" else unit
    ranked = largest(found["parameter"].values, found["elasticity"].values, SHOWN)
    rows = []
    for name, size in ranked:
        at = found.sel(parameter=name)
        value = f"{float(at['parameter_value']):.5g} {at['parameter_unit'].item()}".removesuffix(" 1")
        rows.append((name, value, f"{size:+.4f}", f"{float(at['derivative']):+.4g}"))
    head = ("parameter", "value", "% per %", f"derivative ({squared} per unit)")
    title = f"What drives {heading(found)}"
    names, sizes = [n for n, _ in ranked], np.array([s for _, s in ranked])
    parts: list[Part] = [
        bars(
            title,
            f"Percent change of the response by one percent of each parameter; largest: {names[0]}, {sizes[0]:+.3f}.",
            names,
            [(Key("% per %", "wind"), sizes)],
            "change by 1 % of the parameter (%)",
        ),
        Table("Parameters, the largest first", head, rows, "Exact derivatives, by one adjoint pair."),
    ]
    if "table_elasticity" in found:
        tables = largest(found["table"].values, found["table_elasticity"].values, SHOWN)
        rows = [(name, f"{size:+.4f}") for name, size in tables]
        parts.append(Table("The same by whole tables, others held", ("table", "% per %"), rows, folded=True))
    if found.attrs.get("peak_at_end_of_range"):
        name = words(found.attrs["response"])
        parts.append(Text(f"The peak of {name} is an end of the range searched; the true one may lie beyond.", "note"))
    return parts
