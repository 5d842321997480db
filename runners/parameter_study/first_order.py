"""First-order prediction: what the exact derivatives at the nominal numbers say of a spread or a change."""

from __future__ import annotations

import logging
import warnings

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import AscentwindError
from ..sensitivity.one import UndefinedElasticityWarning
from ..statistics.larger_side import LARGER_SIDE, SIGMAS, sign
from ..study import Study
from .distributions import covariance, marginal, score_correlation
from .measures import MEASURES, PEAK
from .quantities import TABLES, Quantity
from .run import ParameterStudy

log = logging.getLogger(__name__)


def gradients(result: ParameterStudy, measured: xr.Dataset) -> NDArray[np.float64]:
    """Return the derivatives of the measures by the quantities, (measures, responses, quantities).

    They are taken at the time of the nominal peak among the end times; for the peak itself that is its derivative too
    (envelope theorem). NaN where a response has none, which the log says.
    """
    rows = []
    for response, time in zip(measured["response"].values, measured["peak_time"].values, strict=True):
        try:
            variance, mean = (
                _gradient(result.study, result.quantities, str(response), float(time), name)
                for name in ("variance", "mean")
            )
        except AscentwindError as error:
            log.warning("no first-order prediction for %s: %s", response, error)
            rows.append(np.full((len(MEASURES), len(result.quantities)), np.nan))
            continue
        nominal = measured["nominal"].sel(response=response)
        std = variance / (2 * float(nominal.sel(measure="std")))
        larger = sign(float(nominal.sel(measure="mean"))) * mean + SIGMAS * std
        by_name = {"mean": mean, "std": std, LARGER_SIDE: larger, PEAK: larger}
        rows.append(np.array([by_name[name] for name in MEASURES]))
    return np.stack(rows, axis=1)


def _gradient(
    study: Study, quantities: tuple[Quantity, ...], response: str, time: float, quantity: str
) -> NDArray[np.float64]:
    """Return the derivatives of one number by all quantities, along all their targets together."""
    nominal = study.parameters
    targets = [t for q in quantities for t in q.targets]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedElasticityWarning)
        found = study.sensitivity(response, time, quantity=quantity, parameters=[t for t in targets if t in nominal])
    by_target = {t: float(found["derivative"].sel(parameter=t)) for t in targets if t in nominal}
    for target in targets:
        if target not in nominal:
            elasticity = float(found["table_elasticity"].sel(table=target.removeprefix(TABLES)))
            by_target[target] = elasticity * found.attrs["value"]
    return np.array(
        [
            sum(by_target[t] * (nominal[t].value if q.relative and t in nominal else 1.0) for t in q.targets)
            for q in quantities
        ]
    )


def quantity_moments(result: ParameterStudy) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean (d,) and covariance (d, d) of the quantities of a dispersion."""
    dispersion = result.plan.dispersion
    assert dispersion is not None  # asked of dispersions only
    marginals = [marginal(planned, q) for planned, q in zip(dispersion.quantity, result.quantities, strict=True)]
    scores = score_correlation(dispersion, [q.name for q in result.quantities])
    return np.array([m.mean() for m in marginals]), covariance(marginals, scores)
