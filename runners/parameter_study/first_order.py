"""First-order prediction: what the exact derivatives at the nominal numbers say of a spread or a change."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import AscentwindError
from ..sensitivity.one import UndefinedElasticityWarning
from ..statistics.larger_side import LARGER_SIDE, SIGMAS, sign
from .distributions import covariance, marginal, score_correlation
from .measures import LEVEL, PEAK
from .quantities import TABLES
from .run import ParameterStudy

log = logging.getLogger(__name__)


def gradients(result: ParameterStudy, measured: xr.Dataset) -> NDArray[np.float64]:
    """Return the derivatives of the measures by the quantities, (measures, responses, quantities).

    They are taken at the time of the nominal peak among the end times; for the peak itself that is its derivative too
    (envelope theorem). NaN where a response has none, which the log says.
    """
    known = [str(measure) for measure in measured["measure"].values]
    nothing = np.full(len(result.quantities), np.nan)
    rows = []
    for response, time in zip(measured["response"].values, measured["peak_time"].values, strict=True):
        of = _of_response if response in result.data["response"].values else _of_resultant
        try:
            by_name = of(result, measured["nominal"].sel(response=response), str(response), float(time))
        except AscentwindError as error:
            log.warning("no first-order prediction for %s: %s", response, error)
            by_name = {}
        rows.append(np.array([by_name.get(name, nothing) for name in known]))
    return np.stack(rows, axis=1)


Gradients = dict[str, NDArray[np.float64]]  # by measure, (quantities,)


def _of_response(result: ParameterStudy, nominal: xr.DataArray, response: str, time: float) -> Gradients:
    variance, mean = (
        _gradient(
            result, lambda names, q=quantity: result.study.sensitivity(response, time, quantity=q, parameters=names)
        )
        for quantity in ("variance", "mean")
    )
    std = variance / (2 * float(nominal.sel(measure="std")))
    larger = sign(float(nominal.sel(measure="mean"))) * mean + SIGMAS * std
    return {"mean": mean, "std": std, LARGER_SIDE: larger, PEAK: larger}


def _of_resultant(result: ParameterStudy, nominal: xr.DataArray, resultant: str, time: float) -> Gradients:
    chance = result.data.attrs["probability"]
    level = _gradient(result, lambda names: result.study.percentile_sensitivity(resultant, time, chance, names))
    return {LEVEL: level, PEAK: level}


def _gradient(result: ParameterStudy, sensitivity: Callable[[list[str]], xr.Dataset]) -> NDArray[np.float64]:
    """Return the derivatives of one number by all quantities, along all their targets together.

    ``sensitivity`` gives its derivatives by chosen parameters, and its elasticities of tables.
    """
    nominal, quantities = result.study.parameters, result.quantities
    targets = [t for q in quantities for t in q.targets]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedElasticityWarning)
        found = sensitivity([t for t in targets if t in nominal])
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
