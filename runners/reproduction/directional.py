"""The first-order change of a response from one study to a neighbouring one, by its exact derivatives."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...model.errors import DataError
from ..collocation_grid import tables_at
from ..study import Study


def directional_derivative(sensitivity: xr.Dataset, study: Study, neighbour: Study) -> float:
    """Return sum over parameters, and integral over time for tables, of derivative times difference.

    Parameters
    ----------
    sensitivity : xarray.Dataset
        Of ``study.sensitivity``, all parameters.
    study, neighbour : Study
        Of the same structure and flight; parameters and tables may differ.

    Raises
    ------
    DataError
        The two studies have other parameters or tables.
    """
    system, other = study.system, neighbour.system
    names = [str(name) for name in sensitivity["table"].values]
    columns = [n for g in system.tables for n in g.names]
    if columns != [n for g in other.tables for n in g.names] or system.parameter_names != other.parameter_names:
        raise DataError("the two vehicles have other parameters or tables; compare two of the same structure")
    keep = [columns.index(name) for name in names]
    change = neighbour.executable.parameters - study.executable.parameters
    parameters = float(sensitivity["derivative"].values @ change)
    times = sensitivity["t"].values
    along = tables_at(other.tables, times)[:, keep] - sensitivity["table_value"].values.T
    tables = float(np.einsum("t,ht,th->", sensitivity["node_weight"], sensitivity["table_derivative"], along))
    end = np.array([sensitivity.attrs["t2_s"]])
    at_end = (tables_at(other.tables, end) - tables_at(system.tables, end))[0, keep]
    return parameters + tables + float(sensitivity["table_derivative_at_end"].values @ at_end)
