"""Derivatives of many responses at many end times, which share nodes, matrices, factors and the mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.nodes.compiled import node_functions_of
from ...codegen.toolchain.interruption import Workers
from ..case.provenance import provenance
from ..case.times import end_times
from ..present.progress import each
from ..solvers.cores import available_cores
from ..solvers.flight_nodes import FlightNodes
from ..solvers.stability import warn_if_unstable
from .gradient import gradient_of
from .one import refuse_undefined
from .pair import AdjointPair
from .peak import check_end_time
from .request import Request, parameter_rows

if TYPE_CHECKING:
    from ..case.case import Case


def sensitivities(
    case: Case,
    responses: Iterable[str] | None,
    times: Iterable[float],
    source: str,
    quantity: str,
    parameters: Iterable[str] | None,
) -> xr.Dataset:
    """See :meth:`Study.sensitivities`."""
    ends = end_times(times)
    case.checked_times(ends)
    check_end_time(case, ends[0])
    names = case.checked_responses(responses)
    requests = [Request.of(case, name, source, quantity) for name in names]
    rows = parameter_rows(case, parameters)
    warn_if_unstable(case.executable, ends[-1])
    functions = node_functions_of(case.executable)
    flight = FlightNodes.until(case.with_means, functions, ends, keep=len(ends) * len(requests) > 1)
    _ = flight.mean  # once, before the threads

    def one(asked: tuple[float, Request]) -> tuple[float, NDArray[np.float64]]:
        time, request = asked
        pair = AdjointPair(flight, request.row, time, request.sources)
        gradient = gradient_of(pair, *request.factors(pair))
        refuse_undefined(case.system, gradient, rows)
        return request.value(pair.variance, pair.mean), gradient.parameters[rows]

    with Workers(available_cores()) as pool:
        asked = [(time, request) for time in ends for request in requests]
        found = list(each(pool.map(one, asked), "sensitivities", len(asked)))
    shape = (len(ends), len(names))
    values = np.array([value for value, _ in found]).reshape(shape)
    derivatives = np.array([derivative for _, derivative in found]).reshape(*shape, len(rows))
    system = case.system
    return xr.Dataset(
        {
            "value": (("time", "response"), values, {"long_name": quantity}),
            "derivative": (
                ("time", "response", "parameter"),
                derivatives,
                {"long_name": "derivative, response unit per parameter unit"},
            ),
            "parameter_value": ("parameter", case.executable.parameters[rows]),
        },
        {
            "time": ("time", ends, {"units": "s", "long_name": "end time t2"}),
            "response": names,
            "response_unit": ("response", [system.outputs[r.row].unit for r in requests]),
            "parameter": [system.parameters[i].name for i in rows],
            "parameter_unit": ("parameter", [system.parameters[i].unit for i in rows]),
        },
        provenance(case) | {"source": source, "quantity": quantity, "steps": flight.grid.steps.size},
    )
