"""Response variances under different winds (report section 5.1, figure 5-2)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from ...model.errors import DataError
from ...model.vehicle.reader import VEHICLE_FILE
from ...model.vehicle.vehicle import Vehicle
from ...model.wind.range_reference import interlevel_kernel, shipped_statistics
from ...model.wind.record import WindRecord
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.statistics import WindModel, WindStatistics, closed_form_filter
from ..present.progress import each
from ..solvers.least_squares import FitOptions
from ..study import Study
from ..wind.fitting.altitude_grid import propagated_covariance
from ..wind.synthesis.result import SynthesisError
from ..wind.synthesis.synthesise import synthesise

TOP = 20000.0  # m, of the fitted filters of a comparison
REPORT_ERRORS = (14.0, 14.0 * np.sqrt(2.0))  # m2/s2 rms: the report's filter, and one of twice the mean squared error
LARGEST_STRETCH = 50.0
CASES = {
    "march": ("march", "1983"),
    "february": ("february", "1983"),
    "annual": ("annual", "1983"),
    "march 2006": ("march", "2006"),
}
VEHICLE = "as in the vehicle"


@dataclass(frozen=True)
class WindResponse:
    """Mean and standard deviation of a response, from wind alone, under one wind; ``unit`` of both."""

    wind: str
    mean: float
    deviation: float
    unit: str


def recorded_wind(vehicle: Vehicle) -> WindRecord:
    """Return the record of a vehicle's wind, which says with what it may be compared.

    Raises
    ------
    DataError
        Without one.
    """
    record = vehicle.wind.record
    if record is None:
        raise DataError(
            "is missing, so that nobody knows which component the other winds must have; 'ascentwind wind apply "
            "VEHICLE --component zonal|meridional' writes a wind with its record",
            file=vehicle.folder / VEHICLE_FILE,
            column="wind.record",
        )
    return record


def compare_winds(
    study: Study,
    winds: Mapping[str, WindModel],
    time: float,
    response: str = "bending_moment",
) -> list[WindResponse]:
    """Return a response at an end time (s) under the study's own wind, then each of the others."""
    found = []
    for name, wind in each(list({VEHICLE: None, **winds}.items()), "responses under winds"):
        case = study if wind is None else study.with_wind(wind)
        part = case.response_statistics([time], responses=[response]).sel(response=response, source="wind", time=time)
        found.append(WindResponse(name, float(part["mean"]), float(part["std"]), str(part["unit"].item())))
    return found


def shipped_winds(component: str = "zonal", sign: int = 1, options: FitOptions | None = None) -> dict[str, WindModel]:
    """Return the winds of the report's comparison: March, February and annual, and March of the other edition.

    Parameters
    ----------
    component : {'zonal', 'meridional'}
        Zonal: the closed form of March too, which has no meridional kernel.
    sign : {1, -1}
        Of the component along the vehicle's +Y.
    """
    winds = {}
    for name, (period, edition) in each(list(CASES.items()), "fitted winds"):
        statistics = shipped_statistics(period, component, edition=edition, top=TOP)
        winds[f"{name}, fitted"] = wind_of(statistics, synthesise(statistics, options=options).shaping_filter, sign)
    if component == "zonal":
        exact = shipped_statistics(top=TOP, third_order=True)
        kernel = interlevel_kernel("march", "zonal", True)
        closed = closed_form_filter(kernel, exact.standard_deviation_table())
        winds["march, closed form"] = wind_of(exact, closed, sign)
    return winds


def wind_of(statistics: WindStatistics, shaping_filter: ShapingFilter, sign: int = 1) -> WindModel:
    """Return statistics and a filter fitted to them as one wind; ``sign`` -1 where +Y is west or south."""
    mean = statistics.mean_table()
    return WindModel(replace(mean, values=sign * mean.values), shaping_filter, statistics.standard_deviation_table())


def stretched(shaping_filter: ShapingFilter, factor: float) -> ShapingFilter:
    """Return a filter that runs faster over altitude by a factor: the same variances, shorter correlations."""
    f = shaping_filter
    return replace(f, name=f"{f.name}_stretched", F=factor * f.F, G=np.sqrt(factor) * f.G)


def stretched_to_error(shaping_filter: ShapingFilter, statistics: WindStatistics, rms: float) -> ShapingFilter:
    """Return the filter made poorer, by shorter correlations, until its covariances are wrong by ``rms`` (m2/s2).

    Raises
    ------
    SynthesisError
        An error smaller than the filter's own, or larger than shortening can give.
    """
    upper = np.triu_indices(statistics.altitude.size)

    def excess(logarithm: float) -> float:
        covariance = propagated_covariance(
            stretched(shaping_filter, float(np.exp(logarithm))), statistics.altitude, 250.0
        )
        return float(np.sqrt(np.mean((covariance - statistics.covariance)[upper] ** 2))) - rms

    limits = (0.0, float(np.log(LARGEST_STRETCH)))
    if excess(limits[0]) > 0 or excess(limits[1]) < 0:
        raise SynthesisError(
            f"filter '{shaping_filter.name}' cannot be made wrong by {rms:g} m2/s2 rms; choose another error"
        )
    root = brentq(excess, *limits, xtol=1e-4, full_output=False)
    return stretched(shaping_filter, math.exp(float(root)))  # pyright: ignore[reportArgumentType]
