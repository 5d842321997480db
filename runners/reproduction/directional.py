"""The first-order change of a response from one study to a neighbouring one, by its exact derivatives."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import DataError
from ..solvers.collocation_grid import tables_at
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
    along = _difference(study, neighbour, times)[:, keep]
    tables = float(np.einsum("t,ht,th->", sensitivity["node_weight"], sensitivity["table_derivative"], along))
    at_end = _difference(study, neighbour, np.array([sensitivity.attrs["t2_s"]]))[0, keep]
    return parameters + tables + float(sensitivity["table_derivative_at_end"].values @ at_end)


def _difference(study: Study, neighbour: Study, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how all tables differ, (k, tables).

    Tables over altitude are compared at the same altitude: what another altitude does is in the derivative by it.
    """
    names, here, found = [], tables_at(study.system.tables, times), []
    for group, other in zip(study.system.tables, neighbour.system.tables, strict=True):
        argument = times if group.argument == "time" else here[:, names.index(group.argument)]
        found.append(other.evaluate(argument) - group.evaluate(argument))
        names += group.names
    return np.concatenate(found, axis=1)
