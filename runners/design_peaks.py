"""|mean| + 3 sigma over the end times for trial values of the parameters, by the sweep, and its exact derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..model.errors import IntegrationError, UnstableSystemWarning
from .sensitivity import Request
from .statistics import COMBINED
from .sweep_engine import SweepOptions

if TYPE_CHECKING:
    from .study import Study

TOLERANCE = 1e-9  # of the sweep: far below what a search can tell apart
SIGNS = (1.0, -1.0)

Row = tuple[str, float, float]  # response, sign of the mean, end time


def three_sigma(study: Study, responses: list[str], times: tuple[float, ...]) -> NDArray[np.float64] | None:
    """Return 3 sigma + mean and 3 sigma - mean, (responses, 2, times); None where they are beyond numbers.

    The largest over both signs and all times is the peak of |mean| + 3 sigma.
    """
    options = None if study.executable.shared_library is None else SweepOptions(TOLERANCE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnstableSystemWarning)
        try:
            found = study.response_statistics(times, responses=responses, options=options)
        except IntegrationError:
            return None
    mean, std = (found[name].sel(source=COMBINED).values.T for name in ("mean", "std"))
    values = np.stack([3 * std + sign * mean for sign in SIGNS], axis=1)
    return values if np.isfinite(values).all() else None


def gradients(study: Study, rows: Iterable[Row], parameters: tuple[str, ...]) -> dict[Row, NDArray[np.float64]]:
    """Return the derivatives of 3 sigma + sign * mean with respect to parameters by adjoint pairs, (n,) each."""
    columns = [study.system.parameter_names.index(name) for name in parameters]
    found, pairs = {}, {}
    for row in rows:
        response, sign, time = row
        if (response, time) not in pairs:
            request = Request.of(study, response, COMBINED, "mean_plus_3sigma")
            pairs[response, time] = request, request.pair(study, time)
        request, pair = pairs[response, time]
        on_variance, on_mean = request.factors(pair)
        found[row] = pair.gradient(on_variance, sign * on_mean).parameters[columns]
    return found
