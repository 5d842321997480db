"""One quantity at a time: by how much each response changes, computed and predicted to first order."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...model.errors import DataError
from .first_order import gradients
from .measures import measures
from .run import ParameterStudy


def changes(result: ParameterStudy) -> xr.Dataset:
    """Return the changes of a one-at-a-time study.

    Returns
    -------
    xarray.Dataset
        ``change`` and ``first_order_change`` (measure, response, quantity, end: 'low' and 'high'), SI, from the
        nominal study; NaN where a member failed. ``value`` and ``status`` (quantity, end: 0 computed, 1 unstable,
        2 failed) and ``nominal`` (measure, response).

    Raises
    ------
    DataError
        Of a study of another kind.
    """
    if result.plan.one_at_a_time is None:
        raise DataError(f"a study of kind '{result.plan.kind}' has no changes one at a time")
    measured = measures(result)
    d = len(result.quantities)
    nominal = measured["nominal"].values
    change = np.full((*nominal.shape, 2 * d), np.nan)
    change[..., measured["member"].values] = measured["sample"].values - nominal[..., None]
    value = result.data["value"].values.reshape(d, 2, d)[np.arange(d), :, np.arange(d)]
    step = value - np.array([[q.nominal] for q in result.quantities])
    dims = ("measure", "response", "quantity", "end")
    return xr.Dataset(
        {
            "change": (dims, change.reshape(*nominal.shape, d, 2)),
            "first_order_change": (dims, gradients(result, measured)[..., None] * step),
            "value": (("quantity", "end"), value),
            "status": (("quantity", "end"), result.data["status"].values.reshape(d, 2)),
            "nominal": measured["nominal"],
            "peak_time": measured["peak_time"],
        },
        {
            "quantity": result.data["quantity"].values,
            "quantity_unit": ("quantity", [q.unit for q in result.quantities]),
            "end": ["low", "high"],
        },
    )
