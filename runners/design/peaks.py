"""|mean| + 3 sigma over the end times for trial values of the parameters, by the sweep, and its exact derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...codegen.nodes.compiled import node_functions_of
from ...model.errors import IntegrationError, UnstableSystemWarning
from ...model.system.names import COMBINED
from ..sensitivity.gradient import gradient_of
from ..sensitivity.pair import AdjointPair
from ..solvers.flight_nodes import FlightNodes
from ..statistics.larger_side import SIGMAS
from ..statistics.sweep import Sweep

if TYPE_CHECKING:
    from ..study import Study

TOLERANCE = 1e-10  # of the sweep: noise in a line search is then below what ends it
SIGNS = (1.0, -1.0)

Row = tuple[str, float, float]  # response, sign of the mean, end time


def three_sigma(study: Study, responses: list[str], times: tuple[float, ...]) -> NDArray[np.float64] | None:
    """Return 3 sigma + mean and 3 sigma - mean, (responses, 2, times); None where they are beyond numbers.

    The largest over both signs and all times is the peak of |mean| + 3 sigma.
    """
    engine = None if study.executable.shared_library is None else Sweep(TOLERANCE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnstableSystemWarning)
        try:
            found = study.response_statistics(times, responses=responses, engine=engine)
        except IntegrationError:
            return None
    mean, std = (found[name].sel(source=COMBINED).values.T for name in ("mean", "std"))
    values = np.stack([SIGMAS * std + sign * mean for sign in SIGNS], axis=1)
    return values if np.isfinite(values).all() else None


def gradients(study: Study, rows: Iterable[Row], parameters: tuple[str, ...]) -> dict[Row, NDArray[np.float64]]:
    """Return the derivatives of 3 sigma + sign * mean with respect to parameters by adjoint pairs, (n,) each."""
    rows, system = list(rows), study.system
    columns = [system.parameter_names.index(name) for name in parameters]
    functions = node_functions_of(study.executable)
    flight = FlightNodes.until(study.with_means, functions, sorted({time for _, _, time in rows}), keep=len(rows) > 1)
    pairs = {
        (response, time): AdjointPair(flight, system.output_index(response), time, system.sources)
        for response, _, time in rows
    }
    found = {}
    for response, sign, time in rows:
        pair = pairs[response, time]
        found[response, sign, time] = gradient_of(pair, 0.5 * SIGMAS / np.sqrt(pair.variance), sign).parameters[columns]
    return found
