"""Derivatives of many responses at many end times, which share nodes, matrices, factors and the mean."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..codegen.interruption import Workers
from ..codegen.node_functions import node_functions
from .cores import available_cores
from .flight_nodes import FlightNodes
from .sensitivity import Request, check_end_time, parameter_rows, refuse_undefined
from .sensitivity_gradient import AdjointPair
from .stability import warn_if_unstable
from .statistics import provenance
from .times import end_times

if TYPE_CHECKING:
    from .study import Study


def sensitivities(
    study: Study,
    responses: Iterable[str] | None,
    times: Iterable[float],
    source: str,
    quantity: str,
    parameters: Iterable[str] | None,
) -> xr.Dataset:
    """See :meth:`Study.sensitivities`."""
    ends = end_times(times)
    study._check_times(ends)
    check_end_time(study, ends[0])
    names = study._responses(responses)
    requests = [Request.of(study, name, source, quantity) for name in names]
    rows = parameter_rows(study.system, parameters)
    warn_if_unstable(study.executable, ends[-1])
    functions = node_functions(study.system, study.executable.shared_library is not None)
    flight = FlightNodes.until(study.with_means, functions, ends, keep=len(ends) * len(requests) > 1)
    _ = flight.mean  # once, before the threads

    def one(asked: tuple[float, Request]) -> tuple[float, NDArray[np.float64]]:
        time, request = asked
        pair = AdjointPair(flight, request.row, time, request.sources)
        gradient = pair.gradient(*request.factors(pair))
        refuse_undefined(study.system, gradient, rows)
        return request.value(pair.variance, pair.mean), gradient.parameters[rows]

    with Workers(available_cores()) as pool:
        found = list(pool.map(one, [(time, request) for time in ends for request in requests]))
    shape = (len(ends), len(names))
    values = np.array([value for value, _ in found]).reshape(shape)
    derivatives = np.array([derivative for _, derivative in found]).reshape(*shape, len(rows))
    system = study.system
    return xr.Dataset(
        {
            "value": (("time", "response"), values, {"long_name": quantity}),
            "derivative": (
                ("time", "response", "parameter"),
                derivatives,
                {"long_name": "derivative, response unit per parameter unit"},
            ),
            "parameter_value": ("parameter", study.executable.parameters[rows]),
        },
        {
            "time": ("time", ends, {"units": "s", "long_name": "end time t2"}),
            "response": names,
            "response_unit": ("response", [system.outputs[r.row].unit for r in requests]),
            "parameter": [system.parameters[i].name for i in rows],
            "parameter_unit": ("parameter", [system.parameters[i].unit for i in rows]),
        },
        provenance(study) | {"source": source, "quantity": quantity, "steps": flight.grid.steps.size},
    )
