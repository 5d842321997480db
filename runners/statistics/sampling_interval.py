"""How well sigma and level of a response at one instant are known from so many soundings of the wind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ...model.errors import ParameterValueError, TimeRangeError, UnknownNameError
from ...model.system.names import COMBINED, WIND
from .percentiles import level_sampling_interval, std_sampling_interval

ROUNDING = 1e-12  # of a variance: what is left of it without the wind, where nothing else acts


@dataclass(frozen=True)
class SamplingInterval:
    """What N independent soundings of the wind leave open of a response at one time, in its unit.

    Attributes
    ----------
    response, unit : str
    time : float
        s.
    samples, confidence : float
        N, and of the intervals.
    sigmas : float
        k, of the level |mean| + k sigma.
    mean, wind_std, std : float
        The mean with its sign; sigma by the wind alone and by all sources.
    wind_std_interval, std_interval : (float, float)
        Of the wind's sigma, whose variance is chi-square with N - 1 degrees, and of that of all sources.
    level : float
        On the larger side.
    level_interval : (float, float)
    """

    response: str
    unit: str
    time: float
    samples: float
    confidence: float
    sigmas: float
    mean: float
    wind_std: float
    std: float
    wind_std_interval: tuple[float, float]
    std_interval: tuple[float, float]
    level: float
    level_interval: tuple[float, float]

    @property
    def side(self) -> str:
        """Name of the larger side."""
        return f"mean {'-' if self.mean < 0 else '+'} {self.sigmas:g}σ"


def instant_sampling_interval(
    statistics: xr.Dataset, response: str, time: float, samples: float | None, confidence: float, sigmas: float
) -> SamplingInterval:
    """See :meth:`ResponseStatistics.sampling_interval`."""
    number = checked_samples(samples, statistics.attrs.get("wind_independent_samples"))
    for kind, name, dim in (("response", response, "response"), ("noise source", WIND, "source")):
        known = [str(entry) for entry in statistics[dim].values]
        if name not in known:
            raise UnknownNameError(kind, str(name), known)
    times = statistics["time"].values
    near = np.flatnonzero(np.isclose(times, time, rtol=1e-12, atol=1e-9))
    if not near.size:
        raise TimeRangeError(
            f"{time:g} s is not among the end times, {times[0]:g} to {times[-1]:g} s; ask for one of them"
        )
    if not (np.isfinite(sigmas) and sigmas >= 0):
        raise ParameterValueError(f"|mean| + {sigmas:g} sigma is no level; give a finite number of 0 or more")
    at = statistics.isel(time=int(near[0])).sel(response=response)
    mean, std = (float(at[name].sel(source=COMBINED)) for name in ("mean", "std"))
    wind = float(at["std"].sel(source=WIND))
    rest = std**2 - wind**2
    other = float(np.sqrt(rest)) if rest > ROUNDING * std**2 else 0.0
    low, high = std_sampling_interval(wind, number, confidence)
    return SamplingInterval(
        response=response,
        unit=str(at["unit"].item()),
        time=float(times[near[0]]),
        samples=number,
        confidence=confidence,
        sigmas=sigmas,
        mean=mean,
        wind_std=wind,
        std=std,
        wind_std_interval=(low, high),
        std_interval=(float(np.hypot(low, other)), float(np.hypot(high, other))),
        level=abs(mean) + sigmas * std,
        level_interval=level_sampling_interval(abs(mean), wind, other, sigmas, number, confidence),
    )


def checked_samples(given: float | None, recorded: float | None) -> float:
    """Return the number of independent soundings, as given or as the wind's record has it.

    Raises
    ------
    ParameterValueError
        Neither is there, or what was given is no number.
    """
    number = recorded if given is None else given
    if number is None:
        raise ParameterValueError(
            "how many independent soundings the wind's statistics are from is not known; give samples=..., or state "
            "independent_samples in [wind.record] of vehicle.toml"
        )
    try:
        return float(number)
    except (TypeError, ValueError):
        raise ParameterValueError(f"samples = {number!r} is no number of soundings; give one above 1") from None
