"""The combined-load sheet: mean, random wind, gust and vehicle dispersions, by root sum square and jointly.

For every response at the time of its worst gust. The joint levels are those that the size of the response passes with
the chance 0.00135 when mean, gust and normal parts act together, with the gust where it does most harm, or with the
vehicle anywhere inside it, and from either side.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import root_scalar
from scipy.special import ndtri
from scipy.stats import norm

from ...model.system.names import COMBINED, TURBULENCE, WIND
from ...model.vehicle.biases import WIND_BIAS
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..statistics.engines import response_statistics
from ..statistics.percentiles import instant_level
from .response import gust_products
from .search import GustSweep, WorstGust
from .weights import wind_weights

CHANCE = 0.00135  # 1 - Phi(3)
DESIGN_WIND = 0.99  # one-sided; the wind that a gust is added to
REDUCED = 0.85  # on wind and gust where both are added (TM X-64757 as it is remembered, not checked)
OF_WIND = (WIND, TURBULENCE, WIND_BIAS)
PHASES = 201  # of the vehicle inside a gust
MEANINGS = {
    "mean": "mean response in the mean wind",
    "random_wind": "3 sigma of the random wind",
    "gust": "size of the response to the worst gust",
    "vehicle": "3 sigma of the vehicle's dispersions",
    "root_sum_square": "|mean| + root sum square of wind, gust and vehicle",
    "joint_worst": "passed with 0.00135, the gust where and from where it does most harm",
    "joint_inside": "passed with 0.00135, the vehicle anywhere inside the gust, which blows from either side",
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
    found = response_statistics(sweep.case, times, responses=sweep.responses)
    sheet: dict[str, list[float]] = {name: [] for name in MEANINGS}
    for each in worst:
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
        sheet["joint_inside"].append(mixture_level(mean + inside_gust(sweep, each), whole, CHANCE))
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


def inside_gust(sweep: GustSweep, worst: WorstGust) -> NDArray[np.float64]:
    """Return the responses at a worst gust's time to that gust at every phase, from one side and from the other."""
    top = float(sweep.climb.altitude(worst.time))
    lowest = max(top - worst.gust.length, float(sweep.climb.altitudes[0]))
    starts = np.linspace(lowest, top, PHASES)
    reach = worst.time - float(sweep.climb.time_at(lowest))
    weights = wind_weights(sweep.case, [worst.time], [worst.response], reach)[0]
    found = gust_products(weights, sweep.climb, worst.gust, starts)[:, 0]
    return np.concatenate([found, -found])


def mixture_level(means: NDArray[np.float64], std: float, chance: float) -> float:
    """Return the level that the size of a normal response passes, whose mean is each of several with equal chance."""
    largest = float(np.abs(means).max())
    if not std > 0:
        return float(np.quantile(np.abs(means), 1 - chance, method="higher"))

    def passed(level: float) -> float:
        return float(np.mean(norm.sf((level - means) / std) + norm.cdf((-level - means) / std))) - chance

    bracket = (0.0, largest + 10 * std)
    return float(root_scalar(passed, bracket=bracket, method="brentq", xtol=1e-12 * (largest + std)).root)
