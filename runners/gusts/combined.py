"""The combined-load sheet: mean, random wind, gust and vehicle dispersions, by root sum square and jointly.

For every response at the time of its worst gust. The joint levels are those that the size of the response passes with
the chance 0.00135 when mean, gust and normal parts act together, with the gust where it does most harm, or with the
vehicle anywhere inside it, and from either side. In both planes gusts blow from any direction, and a resultant has its
joint levels alone, by the law of a norm, which has no sigma.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import root_scalar
from scipy.special import ndtr, ndtri

from ...model.system.names import COMBINED, TURBULENCE, WIND
from ...model.vehicle.biases import WIND_BIAS
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..statistics.engines import engine_with_covariances, response_statistics
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import instant_level
from .clocking import Quantities, towards
from .response import gust_products
from .search import GustSweep, WorstGust
from .weights import wind_weights

CHANCE = 0.00135  # 1 - Phi(3)
DESIGN_WIND = 0.99  # one-sided; the wind that a gust is added to
REDUCED = 0.85  # on wind and gust where both are added (TM X-64757 as it is remembered, not checked)
OF_WIND = (WIND, TURBULENCE, WIND_BIAS)
PHASES = 201  # of the vehicle inside a gust
DIRECTIONS = 24  # of a gust that blows from any: a smooth periodic integrand
MEANINGS = {
    "mean": "mean response in the mean wind",
    "random_wind": "3 sigma of the random wind",
    "gust": "size of the response to the worst gust",
    "vehicle": "3 sigma of the vehicle's dispersions",
    "root_sum_square": "|mean| + root sum square of wind, gust and vehicle",
    "joint_worst": "passed with 0.00135, the gust where and from where it does most harm",
    "joint_inside": "passed with 0.00135, the vehicle anywhere inside the gust, from either side or any direction",
    "gust_on_design_wind": "|mean| + root sum square of vehicle and 0.85 (99 % wind + gust)",
    "without_gust": "passed with 0.00135 without a gust",
}


def combined_loads(sweep: GustSweep) -> xr.Dataset:
    """Return the sheet over (response).

    Parameters
    ----------
    sweep : GustSweep

    Returns
    -------
    xarray.Dataset
        One variable for each of ``MEANINGS``, and time, length and start altitude of the gust.

    Raises
    ------
    DirectNoiseError, IntegrationError
    """
    worst = [sweep.worst(name) for name in sweep.responses]
    times = sorted({each.time for each in worst})
    quantities = Quantities.of(sweep.case, sweep.responses)
    with_covariance = any(len(members) > 1 for members in quantities.members)
    engine = engine_with_covariances(sweep.case) if with_covariance else None  # of norms
    found = response_statistics(sweep.case, times, responses=quantities.outputs, engine=engine)
    sheet: dict[str, list[float]] = {name: [] for name in MEANINGS}
    for each, members in zip(worst, quantities.members, strict=True):
        if len(members) > 1:
            row = _of_resultant(sweep, each, found.dataset, [quantities.outputs[k] for k in members])
            for name in MEANINGS:
                sheet[name].append(row.get(name, np.nan))
            continue
        at = {"time": each.time, "response": each.response}
        mean = float(found.mean.sel(source=COMBINED, **at))
        variance = {str(s): float(found.variance.sel(source=s, **at)) for s in found["source"].values if s != COMBINED}
        wind = np.sqrt(sum(v for name, v in variance.items() if name in OF_WIND))
        vehicle = np.sqrt(sum(v for name, v in variance.items() if name not in OF_WIND))
        whole, size = float(np.hypot(wind, vehicle)), abs(each.value)
        sheet["mean"].append(mean)
        sheet["random_wind"].append(3 * wind)
        sheet["gust"].append(size)
        sheet["vehicle"].append(3 * vehicle)
        sheet["root_sum_square"].append(abs(mean) + float(np.sqrt((3 * whole) ** 2 + size**2)))
        sheet["joint_worst"].append(float(instant_level(abs(mean) + size, whole, CHANCE)))
        sheet["joint_inside"].append(mixture_level(mean + inside_gust(sweep, each)[:, 0], whole, CHANCE))
        together = REDUCED * (float(ndtri(DESIGN_WIND)) * wind + size)
        sheet["gust_on_design_wind"].append(abs(mean) + float(np.hypot(together, 3 * vehicle)))
        sheet["without_gust"].append(float(instant_level(mean, whole, CHANCE)))
    where = {"time": [w.time for w in worst], "length": [w.gust.length for w in worst]}
    where["start_altitude"] = [w.start_altitude for w in worst]
    units = {"time": "s", "length": "m", "start_altitude": "m"}
    return xr.Dataset(
        {
            **{
                name: ("response", values, {RULE: "response", "long_name": MEANINGS[name]})
                for name, values in sheet.items()
            },
            **{name: ("response", values, {"units": units[name]}) for name, values in where.items()},
        },
        {"response": list(sweep.responses), "unit": ("response", list(sweep.units))},
        provenance(sweep.case) | {"gust": sweep.gust.name, "amplitude_m_s": sweep.gust.amplitude},
    )


def inside_gust(sweep: GustSweep, worst: WorstGust, phases: int = PHASES) -> NDArray[np.float64]:
    """Return the responses at a worst gust's time to that gust at every phase, from either side or any direction.

    (gusts, rows): of a resultant both planes' responses.
    """
    top = float(sweep.climb.altitude(worst.time))
    lowest = max(top - worst.gust.length, float(sweep.climb.altitudes[0]))
    starts = np.linspace(lowest, top, phases)
    reach = worst.time - float(sweep.climb.time_at(lowest))
    quantities = Quantities.of(sweep.case, [worst.response])
    weights = wind_weights(sweep.case, [worst.time], quantities.outputs, reach)[0]
    rows = quantities.rows(gust_products(weights, sweep.climb, worst.gust, starts), 0)
    if worst.direction is None:
        found = towards(rows, None)
        return np.concatenate([found, -found])
    return np.concatenate([towards(rows, chi) for chi in np.linspace(0, 2 * np.pi, DIRECTIONS, endpoint=False)])


def _of_resultant(sweep: GustSweep, worst: WorstGust, found: xr.Dataset, outputs: list[str]) -> dict[str, float]:
    """Return what a norm has of the sheet: its mean's size, the gust, and the joint levels."""
    at = found.sel(time=worst.time, source=COMBINED)
    mean = at["mean"].sel(response=outputs).values
    whole = at["covariance"].sel(response=outputs, other_response=outputs)
    S = whole.transpose("response", "other_response").values
    quantities = Quantities.of(sweep.case, [worst.response])
    (weights,) = wind_weights(sweep.case, [worst.time], quantities.outputs, worst.time - worst.time_met)
    rows = quantities.rows(gust_products(weights, sweep.climb, worst.gust, np.array([worst.start_altitude]))[0], 0)
    gusts = np.array([towards(rows, chi) for chi in np.linspace(0, 2 * np.pi, 15 * DIRECTIONS, endpoint=False)])
    alone = float(NormOfNormal(mean, S).percentile(CHANCE))
    worst_of_all = float(_law(mean + gusts, S).percentile(CHANCE).max())
    law = _law(mean + inside_gust(sweep, worst, PHASES // 2), S)

    def passed(level: float) -> float:
        return float(np.mean(law.exceedance(level))) - CHANCE

    top = float(np.linalg.norm(law.mean, axis=1).max() + 10 * np.sqrt(np.trace(S)))
    inside = root_scalar(passed, bracket=(0.0, top), method="brentq", rtol=1e-6, xtol=1e-6 * top).root
    return {
        "mean": float(np.linalg.norm(mean)),
        "gust": abs(worst.value),
        "joint_worst": worst_of_all,
        "joint_inside": float(inside),
        "without_gust": alone,
    }


def _law(means: NDArray[np.float64], covariance: NDArray[np.float64]) -> NormOfNormal:
    return NormOfNormal(means, np.broadcast_to(covariance, (len(means), 2, 2)))


def mixture_level(means: NDArray[np.float64], std: float, chance: float) -> float:
    """Return the level that the size of a normal response passes, whose mean is each of several with equal chance."""
    largest = float(np.abs(means).max())
    if not std > 0:
        return float(np.quantile(np.abs(means), 1 - chance, method="higher"))

    def passed(level: float) -> float:
        return float(np.mean(ndtr((means - level) / std) + ndtr((-level - means) / std))) - chance

    bracket = (0.0, largest + 10 * std)
    return float(root_scalar(passed, bracket=bracket, method="brentq", xtol=1e-12 * (largest + std)).root)
