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
from ..sensitivity.percentile import two_forms
from ..solvers.flight_nodes import FlightNodes
from ..statistics.larger_side import SIGMAS
from ..statistics.norm import LIKE_3_SIGMA
from ..statistics.resultants import outputs_of
from ..statistics.sweep import Sweep

if TYPE_CHECKING:
    from ..study import Study

TOLERANCE = 1e-10  # of the sweep: noise in a line search is then below what ends it
SIGNS = (1.0, -1.0)

Row = tuple[str, float, float]  # response, sign of the mean, end time


def three_sigma(study: Study, responses: list[str], times: tuple[float, ...]) -> NDArray[np.float64] | None:
    """Return 3 sigma + mean and 3 sigma - mean, (responses, 2, times); None where they are beyond numbers.

    The largest over both signs and all times is the peak of |mean| + 3 sigma. Of a resultant it is the level that it
    passes with 1 - Phi(3) at an instant, and the same with the other sign, so that it counts once.
    """
    outputs = list(dict.fromkeys(output for name in responses for output in outputs_of(study, name)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnstableSystemWarning)
        try:
            found = study.response_statistics(times, responses=outputs, engine=_engine(study, responses))
        except IntegrationError:
            return None
    combined, rows = found.dataset.sel(source=COMBINED), []
    for name in responses:
        of = outputs_of(study, name)
        if len(of) == 2:
            level = found.norm(*of).percentile(LIKE_3_SIGMA)
            rows.append([level, -level])
        else:
            mean, std = (combined[quantity].sel(response=name).values for quantity in ("mean", "std"))
            rows.append([SIGMAS * std + sign * mean for sign in SIGNS])
    values = np.array(rows)
    return values if np.isfinite(values).all() else None


def _engine(study: Study, responses: Iterable[str]) -> Sweep | str | None:
    """Return the engine of peaks: of resultants one that gives covariances between responses."""
    if study.executable.shared_library is not None:
        return Sweep(TOLERANCE)
    return "covariance" if any(len(outputs_of(study, name)) == 2 for name in responses) else None


def gradients(study: Study, rows: Iterable[Row], parameters: tuple[str, ...]) -> dict[Row, NDArray[np.float64]]:
    """Return the derivatives of 3 sigma + sign * mean, or of a resultant's level, by adjoint pairs, (n,) each."""
    rows, system = list(rows), study.system
    columns = [system.parameter_names.index(name) for name in parameters]
    functions = node_functions_of(study.executable)
    flight = FlightNodes.until(study.with_means, functions, sorted({time for _, _, time in rows}), keep=len(rows) > 1)
    pairs = {
        (response, time): AdjointPair(flight, system.output_index(response), time, system.sources)
        for response, _, time in rows
        if len(outputs_of(study, response)) == 1
    }
    of_two: dict[tuple[str, float], NDArray[np.float64]] = {}
    for response, time in dict.fromkeys((response, time) for response, _, time in rows):
        if (response, time) in pairs:
            continue
        of = outputs_of(study, response)
        statistics = study.response_statistics([time], responses=of, engine=_engine(study, [response]))
        by_mean, by_covariance = (part[0] for part in statistics.norm(*of).derivatives(LIKE_3_SIGMA))
        forms = two_forms(study, flight, of, time, by_mean, by_covariance)
        of_two[response, time] = np.sum([gradient.parameters[columns] for _, gradient, _ in forms], axis=0)
    found = {}
    for response, sign, time in rows:
        if (response, time) in of_two:
            found[response, sign, time] = sign * of_two[response, time]
            continue
        pair = pairs[response, time]
        found[response, sign, time] = gradient_of(pair, 0.5 * SIGMAS / np.sqrt(pair.variance), sign).parameters[columns]
    return found
