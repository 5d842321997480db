"""One factor on the mean wind: what meets the report's ratio of peak mean to sigma, and what else it makes.

Mean and standard deviation of the bending moment are both linear in the air forces, so that no input of the vehicle
moves their ratio much; a factor on the mean wind moves the mean alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...model.vehicle.noise_loads import NOISE_LOADS
from ...model.vehicle.shipped import find_vehicle
from ...model.wind.range_reference import EDITIONS, MONTHS, range_reference
from ..study import Study
from .predictions import TIME, Responses, end_times, responses
from .published import BY_NAME


@dataclass(frozen=True)
class WindRatio:
    """Mean over standard deviation of a wind at the altitude of 75 s."""

    wind: str
    ratio: float
    mean: float


@dataclass(frozen=True)
class MeanWind:
    """Responses with the vehicle's mean wind and with one that meets the report's ratio.

    Attributes
    ----------
    factor : float
        On the mean wind.
    report : float
        Peak mean bending moment over its standard deviation at 75 s.
    altitude : float
        At 75 s (m).
    before, after : dict of str to Responses
        By ``options.noise_loads``; without and with the factor.
    own, strongest : WindRatio
        March 1983; the month of the editions that ship with the largest ratio.
    """

    factor: float
    report: float
    altitude: float
    before: dict[str, Responses]
    after: dict[str, Responses]
    own: WindRatio
    strongest: WindRatio


def mean_wind(vehicle: str | Path = "as504") -> MeanWind:
    """Find the factor that meets the report's ratio, exact because the mean is linear in the mean wind."""
    folder = find_vehicle(vehicle)
    report = BY_NAME["peak_mean"].value / BY_NAME["sigma_75"].value
    studies = {form: Study.load(folder, changes={"options.noise_loads": form}) for form in NOISE_LOADS}
    times = end_times(studies[NOISE_LOADS[0]])
    before = {form: responses(study.response_statistics(times)) for form, study in studies.items()}
    first = before[NOISE_LOADS[0]]
    factor = report * first.sigma_75 / first.peak_mean
    after = {
        form: responses(study.with_parameters({"wind.mean_scale": factor}).response_statistics(times))
        for form, study in studies.items()
    }
    altitude = studies[NOISE_LOADS[0]].tables(TIME)["altitude"]
    ratios = [_ratio(month, edition, altitude) for edition in EDITIONS for month in MONTHS]
    own = _ratio("march", "1983", altitude)
    return MeanWind(factor, report, altitude, before, after, own, max(ratios, key=lambda r: r.ratio))


def _ratio(month: str, edition: str, altitude: float) -> WindRatio:
    table = range_reference(month, edition)
    mean, sigma = (
        float(np.interp(altitude, table.altitude, x["zonal"])) for x in (table.mean, table.standard_deviation)
    )
    return WindRatio(f"{month.capitalize()} {edition}", mean / sigma, mean)
