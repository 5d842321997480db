"""Our numbers for what the report published, from public data alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...model.errors import DataError
from ...model.system.names import COMBINED, TURBULENCE, WIND
from ...model.wind.range_reference import shipped_statistics
from ..case.times import parse_times
from ..solvers.stability import roots
from ..statistics.larger_side import larger_side
from ..statistics.results import ResponseStatistics
from ..study import Study
from ..wind.verification import verify
from .published import PUBLISHED, Published

TIME = 75.0  # s, at which the report compares
BENDING, ATTACK, ENGINE = "bending_moment", "angle_of_attack", "engine_angle"


@dataclass(frozen=True)
class Prediction:
    """A published figure and ours."""

    published: Published
    ours: float

    @property
    def miss(self) -> float:
        """Relative; 0 inside an upper bound."""
        return self.published.miss(self.ours)


@dataclass(frozen=True)
class Responses:
    """The numbers of one vehicle that the report's results are about.

    Attributes
    ----------
    peak_mean, sigma_75, peak : float
        Largest size of the mean bending moment; its standard deviation at 75 s from wind alone, turbulence included;
        largest |mean| + 3 sigma (N m).
    peak_time : float
        Of |mean| + 3 sigma (s).
    engine : float
        Largest |mean| + 3 sigma of the engine angle (rad).
    rise_bending, rise_attack, rise_engine : float
        What thrust and centre-of-pressure noise add to |mean| + 3 sigma, relative.
    """

    peak_mean: float
    sigma_75: float
    peak: float
    peak_time: float
    engine: float
    rise_bending: float
    rise_attack: float
    rise_engine: float


def end_times(study: Study) -> list[float]:
    """Return the vehicle's default end times, 75 s among them.

    Raises
    ------
    DataError
        If the study has no vehicle or it does not fly at 75 s.
    """
    if study.vehicle is None or not study.system.start < TIME <= study.system.end:
        raise DataError(f"the report compares at {TIME:g} s; reproduce a vehicle whose tables cover it")
    times = parse_times(study.vehicle.file.default_times)
    return sorted({*(t for t in times if study.system.start < t <= study.system.end), TIME})


def larger_sides(statistics: ResponseStatistics, source: str) -> xr.DataArray:
    """Return |mean| + 3 sigma from one source, or all, (time, response)."""
    return larger_side(*(statistics[name].sel(source=source) for name in ("mean", "std")))


def responses(statistics: ResponseStatistics) -> Responses:
    """Return the numbers of a full table of responses."""
    sources = [name for name in (WIND, TURBULENCE) if name in statistics.variance["source"].values]
    of_wind = statistics.variance.sel(source=sources).sum("source") ** 0.5
    both, wind = larger_sides(statistics, COMBINED), larger_side(statistics.mean.sel(source=WIND), of_wind)
    at = {"response": ATTACK, "time": TIME}

    def rise(response: str) -> float:
        return float(both.sel(response=response).max() / wind.sel(response=response).max()) - 1

    moment = both.sel(response=BENDING)
    return Responses(
        peak_mean=float(abs(statistics.mean.sel(response=BENDING, source=WIND)).max()),
        sigma_75=float(of_wind.sel(response=BENDING, time=TIME)),
        peak=float(moment.max()),
        peak_time=float(moment["time"].values[int(np.argmax(moment.values))]),
        engine=float(both.sel(response=ENGINE).max()),
        rise_bending=rise(BENDING),
        rise_attack=float(both.sel(at) / wind.sel(at)) - 1,
        rise_engine=rise(ENGINE),
    )


def predict(study: Study, local: Responses, wind_sensitivity: float) -> list[Prediction]:
    """Return all published figures with ours.

    Parameters
    ----------
    study : Study
        Of AS-504, as shipped.
    local : Responses
        The same with local angle of attack.
    wind_sensitivity : float
        Relative change of the variance at 75 s between filters as poor as the report's two.
    """
    found = responses(study.response_statistics(end_times(study)))
    modes = study.tables(TIME)
    vehicle = study.vehicle_for("a prediction")
    wind = verify(vehicle.wind.shaping_filter, shipped_statistics(top=16000.0))
    ours = {
        "peak_mean": found.peak_mean,
        "peak_mean_local": local.peak_mean,
        "local_rise": local.peak_mean / found.peak_mean - 1,
        "sigma_75": found.sigma_75,
        "rise_bending": found.rise_bending,
        "rise_attack": found.rise_attack,
        "rise_engine": found.rise_engine,
        "rigid_root": _rigid_root(study),
        "bending_1": modes["bending.1.frequency"],
        "bending_2": modes["bending.2.frequency"],
        "wind_error": wind.rms_error,
        "wind_share": wind.share_inside,
        "wind_sensitivity": wind_sensitivity,
    }
    return [Prediction(p, ours[p.name]) for p in PUBLISHED]


def _rigid_root(study: Study) -> float:
    """Return the frequency of the slowest oscillation that attitude rate takes part in, rad/s."""
    for root in roots(study.executable, TIME):
        if root.value.imag > 0 and "attitude_rate" in root.states:
            return root.frequency
    raise DataError(f"no oscillation of the rigid body was found at {TIME:g} s")
