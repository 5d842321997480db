"""Sensitivities: which parameter, which second of which table and which kilometre of wind drives a response."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr

from ...model.errors import AscentwindWarning, SwitchError
from ...model.system.linear_system import LinearSystem
from ...model.system.names import COMBINED
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..solvers.stability import warn_if_unstable
from .gradient import Gradient, gradient_of
from .knots import knot_sensitivities
from .peak import end_time
from .request import Request, ZeroQuantityError, parameter_rows
from .start import start_share
from .tables import Parts, table_sensitivities, total_density

if TYPE_CHECKING:
    from ..case.case import Case


class UndefinedElasticityWarning(AscentwindWarning):
    """Parameters that are zero have a derivative but no elasticity."""


def sensitivity(
    case: Case,
    response: str,
    time: float | Literal["peak"],
    source: str = COMBINED,
    quantity: str = "std",
    parameters: Iterable[str] | None = None,
    elasticity: bool = True,
) -> xr.Dataset:
    """See :meth:`Study.sensitivity`."""
    request = Request.of(case, response, source, quantity)
    rows = parameter_rows(case, parameters)
    at_peak = isinstance(time, str)
    time, at_limit = end_time(case, request, time)
    warn_if_unstable(case.executable, time)
    pair = request.pair(case, time)
    factors = request.factors(pair)
    gradient = gradient_of(pair, *factors, at_peak=at_peak and not at_limit)
    refuse_undefined(case.system, gradient, rows)
    value = request.value(pair.variance, pair.mean)
    if elasticity and value == 0:
        raise ZeroQuantityError(
            f"the {quantity} of '{response}' from '{source}' is zero at {time:g} s, so that a derivative in percent is "
            "not defined; pass elasticity=False for derivatives alone"
        )
    relative_to = value if elasticity else None
    variables, coordinates = parameter_sensitivities(case, gradient, rows, relative_to)
    if any(g.kind == "given" for g in case.system.tables):
        total = total_density(case.with_means.groups, pair, gradient)
        start = start_share(case.vehicle, pair, factors[0]) if factors[0] else None
        for more in (table_sensitivities, knot_sensitivities):
            parts = more(case, pair, total, start, relative_to)
            variables, coordinates = variables | parts[0], coordinates | parts[1]
    dataset = xr.Dataset(variables, coordinates)
    dataset.attrs = provenance(case) | {
        "response": response,
        "response_unit": case.system.outputs[request.row].unit,
        "source": source,
        "quantity": quantity,
        "t2_s": time,
        "value": value,
        "variance": pair.variance,
        "mean": pair.mean,
        "at_peak": int(at_peak),
        "peak_at_end_of_range": int(at_limit),
        "engine": "collocation, Gauss-Legendre of order 8",
        "steps": pair.steps,
    }
    return dataset


def refuse_undefined(system: LinearSystem, gradient: Gradient, rows: Iterable[int]) -> None:
    """Refuse parameters by which there is no derivative, because of a switch that they move.

    Raises
    ------
    SwitchError
    """
    for i in rows:
        if i in gradient.undefined:
            raise SwitchError(
                f"there is no derivative with respect to '{system.parameter_names[i]}': {gradient.undefined[i]}; "
                "name the parameters without it"
            )


def parameter_sensitivities(case: Case, gradient: Gradient, rows: list[int], value: float | None) -> Parts:
    """Return what a sensitivity says of parameters; elasticities are of ``value``, left out for None."""
    parameters = [case.system.parameters[i] for i in rows]
    numbers, derivative = case.executable.parameters[rows], gradient.parameters[rows]
    label = {RULE: "quantity parameter^-1", "long_name": "derivative"}
    variables: dict[str, tuple] = {
        "parameter_value": ("parameter", numbers, {RULE: "parameter", "long_name": "present value"}),
        "derivative": ("parameter", derivative, label),
    }
    if value is not None:
        zero = numbers == 0
        if zero.any():
            listed = ", ".join(p.name for p, is_zero in zip(parameters, zero, strict=True) if is_zero)
            warnings.warn(
                UndefinedElasticityWarning(
                    f"{listed}: zero, so that a change in percent is none; see the derivative instead"
                ),
                stacklevel=4,
            )
        label = {"units": "1", "long_name": "percent of the quantity per percent of the parameter"}
        variables["elasticity"] = ("parameter", derivative * numbers / value, label)
        variables["elasticity_defined"] = ("parameter", (~zero).astype(np.int8))
    return variables, {
        "parameter": [p.name for p in parameters],
        "parameter_unit": ("parameter", [p.unit for p in parameters]),
        "description": ("parameter", [p.description for p in parameters]),
    }
