"""One interface to all ways of synthesising a wind filter."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ....model.errors import AscentwindWarning, UnknownNameError
from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, StalledFitWarning
from ..fitting.progress import fit_progress
from . import (
    constrained_response as synthesis_constrained_response,
)
from . import (
    impulse_response as synthesis_impulse_response,
)
from . import (
    linear_regression as synthesis_linear_regression,
)
from . import (
    parameters as synthesis_parameters,
)
from . import (
    state_space as synthesis_state_space,
)
from .result import SynthesisError, SynthesisResult

METHODS: dict[str, tuple[Callable[..., SynthesisResult], tuple[int, ...]]] = {
    synthesis_state_space.METHOD: (synthesis_state_space.synthesise_state_space, (1, 2, 3, 4, 5, 6)),
    synthesis_constrained_response.METHOD: (
        synthesis_constrained_response.synthesise_constrained_response,
        (2, 3, 4, 5, 6),
    ),
    synthesis_impulse_response.METHOD: (synthesis_impulse_response.synthesise_impulse_response, (2, 3, 4, 5, 6)),
    synthesis_parameters.METHOD: (synthesis_parameters.synthesise_parameters, (2,)),
    synthesis_linear_regression.METHOD: (synthesis_linear_regression.synthesise_linear_regression, (2, 3)),
}


LONGEST_DECAY = 1e6  # m: a mode that lives longer than this is a constant over any flight


class SlowFilterWarning(AscentwindWarning):
    """A synthesised filter has a frozen pole that hardly decays or grows."""


def synthesise(
    statistics: WindStatistics,
    method: str = "state-space",
    order: int | None = None,
    options: FitOptions | None = None,
    **settings: object,
) -> SynthesisResult:
    """Make a filter whose output has the covariance of the statistics.

    Parameters
    ----------
    statistics : WindStatistics
    method : str
        'state-space' (direct), 'constrained-response' (3.4.4), 'impulse-response' (3.4.5), 'parameter-optimisation'
        (3.4.3) or 'linear-regression' (3.4.2).
    order : int, optional
        Number of states; 3 where the method allows it, else 2.
    options : FitOptions, optional
    settings
        ``noises`` of 'state-space', ``search`` of 'constrained-response'.

    Returns
    -------
    SynthesisResult

    Raises
    ------
    UnknownNameError
        No such method.
    SynthesisError
        An order the method does not have, or fewer altitudes than it needs.

    Warns
    -----
    StalledFitWarning
        The optimiser stopped early; the result is the best found and ``converged`` is False.
    SlowFilterWarning
        A frozen pole of the filter does not decay within ``LONGEST_DECAY``, or grows.
    """
    if method not in METHODS:
        raise UnknownNameError("synthesis method", method, METHODS)
    function, orders = METHODS[method]
    order = order if order is not None else (3 if 3 in orders else orders[-1])
    if order not in orders:
        raise SynthesisError(f"method '{method}' makes filters of order {', '.join(map(str, orders))}, not {order}")
    if statistics.altitude.size < order + 2:
        raise SynthesisError(
            f"a filter of order {order} needs at least {order + 2} altitudes, and {statistics.name} has "
            f"{statistics.altitude.size}; add levels or lower the order"
        )
    with (
        fit_progress(f"{method} for {statistics.name}", options) as heard,
        threadpool_limits(1, user_api="blas"),  # the matrices are small: on all threads a fit takes five times as long
    ):
        result = function(statistics, order, heard, **settings)
    result = replace(result, shaping_filter=replace(result.shaping_filter, origin=statistics.origin))
    if not result.converged:
        warnings.warn(
            StalledFitWarning(
                f"{method} for {statistics.name} stopped before it converged ({result.message}); the filter is the "
                f"best found, with {result.rms_error:.3g} m2/s2 rms"
            ),
            stacklevel=2,
        )
    if result.largest_pole > -1 / LONGEST_DECAY:
        grows = result.largest_pole >= 0
        warnings.warn(
            SlowFilterWarning(
                f"{method} for {statistics.name}: a frozen pole of the filter reaches {result.largest_pole:.2g} 1/m, "
                + ("which grows" if grows else f"a decay over {-1e-3 / result.largest_pole:.0f} km")
                + "; above the data such coefficients must not be held, and another order or method may do without"
            ),
            stacklevel=2,
        )
    return result
