"""Vehicles flown through measured winds: histories, percentiles and flight maxima beside a Gaussian wind's."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri

from ...model.errors import PlanesError
from ...model.system.names import WIND
from ...model.wind.soundings.collection import Soundings
from ...model.wind.soundings.normality import FEWEST, Normality, normality, skewed_level
from ...model.wind.soundings.sounding import Sounding
from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..case.times import end_times, parse_times
from ..present.netcdf import RULE
from ..present.notebook import html_of
from ..solvers.discretisation import symmetric_root
from ..statistics.engines import response_statistics
from ..statistics.resultants import resultant_pairs
from .flown_resultants import FlownResultants
from .level_weights import LevelWeights, level_weights
from .met_winds import met_winds
from .profile_statistics import independent_profiles, number_of, percentile_dataset, worst_profiles
from .profiles import CompleteProfiles, complete_profiles, soundings_of
from .random_wind import random_wind

PERCENTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
COMPLETED = 2000  # histories at least, where part of the winds is drawn
PATHS = 4000  # drawn, for the Gaussian wind's flight maxima
SIGMAS = 3.0  # of the level that skewness and kurtosis are told at


@dataclass(frozen=True, eq=False, repr=False)
class FlownWinds:
    """What measured winds make of responses, all other sources at rest.

    Attributes
    ----------
    case : Case
    responses : tuple of str
    profiles : CompleteProfiles
    weights : LevelWeights
        Of the responses.
    day : (n,) array
        Of the profiles, NaN without dates.
    """

    case: Case
    responses: tuple[str, ...]
    profiles: CompleteProfiles
    weights: LevelWeights
    day: NDArray[np.float64]

    @property
    def times(self) -> NDArray[np.float64]:
        """End times, s."""
        return self.weights.times

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """Histories (n, time, response), SI: the mean of other inputs and the whole measured wind."""
        return self.weights.responses(self.profiles.wind)

    @cached_property
    def residual_std(self) -> NDArray[np.float64]:
        """What the winds that were not measured leave open, (n, time, response)."""
        A = self.weights.weight
        found = np.zeros((len(self.profiles.residual), *A.shape[:2]))
        for number, left in enumerate(self.profiles.residual):
            if left is not None:
                found[number] = np.einsum("mrk,mrk->mr", A @ left, A)
        return np.sqrt(np.maximum(found, 0.0))[self.profiles.pattern]

    @cached_property
    def completed(self) -> NDArray[np.float64]:
        """Histories with what was not measured drawn, (q n, time, response): all profiles once, then all again.

        ``values`` themselves where everything was measured; else 2000 or more, so that what the unmeasured winds add is
        among percentiles and maxima.
        """
        if all(left is None for left in self.profiles.residual):
            return self.values
        random, A = np.random.default_rng(505), self.weights.weight
        n, m, r = self.values.shape
        found = np.tile(self.values, (max(1, -(-COMPLETED // n)), 1, 1))
        pattern = np.tile(self.profiles.pattern, len(found) // n)
        for number, left in enumerate(self.profiles.residual):
            if left is not None:
                at = np.flatnonzero(pattern == number)
                winds = random.standard_normal((at.size, left.shape[0])) @ symmetric_root(left[None])[0].T
                found[at] += (winds @ A.reshape(m * r, -1).T).reshape(at.size, m, r)
        return found

    @property
    def histories(self) -> xr.Dataset:
        """``value`` and ``residual_std`` over (profile, time, response), with the date of each profile."""
        dims = ("profile", "time", "response")
        return xr.Dataset(
            {
                "value": (dims, self.values, {RULE: "response", "long_name": "response to the measured wind"}),
                "residual_std": (
                    dims, self.residual_std, {RULE: "response", "long_name": "left open by winds not measured"},
                ),
            },
            {"profile": list(self.profiles.names), "date": ("profile", self.profiles.time)} | self._coordinates(),
            provenance(self.case) | {"soundings": self.profiles.source},
        )  # fmt: skip

    @cached_property
    def predicted_mean(self) -> NDArray[np.float64]:
        """Mean response in the vehicle's mean wind at the levels, (time, response)."""
        return self.weights.responses(random_wind(self.case, self.weights.levels).mean)

    def covariance_between(self, first: int, second: int) -> NDArray[np.float64]:
        """Return the covariance of two responses, by number, between all times, (time, time).

        By the vehicle's random wind, straight between the levels.

        Parameters
        ----------
        first, second : int

        Returns
        -------
        (time, time) array
        """
        A, R = self.weights.weight, random_wind(self.case, self.weights.levels).covariance
        return A[:, first] @ R @ A[:, second].T

    @cached_property
    def _covariance(self) -> NDArray[np.float64]:
        """Of each response between all times, (response, time, time)."""
        return np.array([self.covariance_between(r, r) for r in range(len(self.responses))])

    @property
    def predicted_std(self) -> NDArray[np.float64]:
        """By the vehicle's random wind, straight between the levels, (time, response)."""
        return np.sqrt(np.maximum(np.einsum("rmm->mr", self._covariance), 0.0))

    @cached_property
    def resultants(self) -> FlownResultants:
        """The norms of responses of both planes, such as the resultant bending moment.

        Raises
        ------
        PlanesError
            The vehicle flies in one plane.
        """
        pairs = resultant_pairs(self.responses)
        if not pairs:
            raise PlanesError.of_one("a resultant", self.case.system.name)
        numbers = {name: (self.responses.index(a), self.responses.index(b)) for name, (a, b) in pairs.items()}
        units = tuple(self.unit(a) for a, _ in pairs.values())
        return FlownResultants(
            self.case, numbers, units, self.profiles, self.times, self.day, self.values, self.completed,
            self.predicted_mean, self.covariance_between,
        )  # fmt: skip

    @cached_property
    def missed_share(self) -> NDArray[np.float64]:
        """Share of the wind's variance that winds straight between the levels do not have, (time, response)."""
        exact = response_statistics(self.case, self.weights.times.tolist(), responses=self.responses)
        whole = exact.variance.sel(source=WIND).transpose("time", "response").values
        return np.divide(whole - self.predicted_std**2, whole, out=np.zeros_like(whole), where=whole > 0)

    @cached_property
    def independent(self) -> NDArray[np.float64]:
        """Number of independent profiles behind each response at each time, (time, response)."""
        return independent_profiles(self.values, self.day)

    def percentiles(self, probabilities: Iterable[float] = PERCENTILES) -> xr.Dataset:
        """Return percentiles at each time, of the profiles and as predicted.

        Parameters
        ----------
        probabilities : iterable of float
            Of staying below.

        Returns
        -------
        xarray.Dataset
            Over (probability, time, response): ``measured`` and ``interval`` (bound), 95 % by order statistics of as
            many independent profiles; ``predicted`` of a Gaussian wind of the vehicle's mean and filter.
        """
        p = np.array([float(x) for x in probabilities])
        predicted = self.predicted_mean + ndtri(p)[:, None, None] * self.predicted_std
        return percentile_dataset(self.completed, self.independent, predicted, p, self._coordinates())

    @cached_property
    def maxima(self) -> NDArray[np.float64]:
        """The largest size of each response over the times, (q n, response), as of :attr:`completed`."""
        return np.abs(self.completed).max(axis=1)

    @cached_property
    def predicted_maxima(self) -> NDArray[np.float64]:
        """The same of drawn Gaussian winds at the same times, in order, (4000, response)."""
        random, found = np.random.default_rng(504), []
        for r in range(len(self.responses)):
            root = symmetric_root(self._covariance[r][None])[0]
            paths = self.predicted_mean[:, r] + random.standard_normal((PATHS, root.shape[0])) @ root.T
            found.append(np.sort(np.abs(paths).max(axis=1)))
        return np.array(found).T

    def worst(self, response: str, count: int = 10) -> list[tuple[str, str, float, float]]:
        """Return the profiles with the largest size of a response: name, date, value, time (s).

        Parameters
        ----------
        response : str
        count : int

        Returns
        -------
        list of tuples
        """
        values = self.values[:, :, number_of(response, self.responses)]
        return worst_profiles(values, self.profiles, self.weights.times, count)

    def normality(self, response: str) -> Normality | None:
        """Return how normal a response is at each time; None of fewer than 20 independent profiles, or all alike.

        Parameters
        ----------
        response : str

        Returns
        -------
        Normality or None
        """
        r = number_of(response, self.responses)
        least = float(self.independent[:, r].min())
        if least < FEWEST or not (self.values[:, :, r].std(axis=0) > 0).all() or not self.predicted_std[:, r].all():
            return None
        return normality(self.values[:, :, r], least)

    def skewed_levels(self, response: str) -> NDArray[np.float64] | None:
        """Return the upper and lower level of 3 sigma with the profiles' skewness and kurtosis, less that without.

        What winds that are not normal do to a load, (2, time), in sigmas; None where :meth:`normality` is.

        Parameters
        ----------
        response : str

        Returns
        -------
        array or None
        """
        found = self.normality(response)
        if found is None:
            return None
        upper = skewed_level(0.0, 1.0, found.skewness, found.kurtosis, SIGMAS) - SIGMAS
        lower = SIGMAS - skewed_level(0.0, 1.0, -found.skewness, found.kurtosis, SIGMAS)
        return np.array([upper, lower])

    def to_dataset(self) -> xr.Dataset:
        """Return histories, percentiles and predictions as one dataset."""
        percentiles = self.percentiles()
        found = self.histories.assign_coords(percentiles.coords).assign(percentiles.data_vars)
        dims = ("time", "response")
        found["predicted_mean"] = (dims, self.predicted_mean, {RULE: "response", "long_name": "mean in the mean wind"})
        found["predicted_std"] = (dims, self.predicted_std, {RULE: "response", "long_name": "std in a Gaussian wind"})
        found["missed_share"] = (
            dims, self.missed_share, {"units": "1", "long_name": "of the variance, by winds straight between levels"},
        )  # fmt: skip
        largest = np.abs(self.values).max(axis=1)
        found["flight_maximum"] = (
            ("profile", "response"), largest, {RULE: "response", "long_name": "largest size over the times"},
        )  # fmt: skip
        return found

    def __repr__(self) -> str:
        n = len(self.values)
        partly = int((~self.profiles.observed.all(axis=1)).sum())
        return f"FlownWinds: {n} profiles ({partly} partly observed), {self.weights.times.size} times, " + ", ".join(
            self.responses
        )

    def _repr_html_(self) -> str:
        return html_of(repr(self))

    def unit(self, response: str) -> str:
        """Return the unit of a response.

        Parameters
        ----------
        response : str
        """
        return self.case.system.outputs[self.case.system.output_index(response)].unit

    def _coordinates(self) -> dict[str, object]:
        units = [self.unit(name) for name in self.responses]
        return {
            "time": ("time", self.weights.times, {"units": "s", "long_name": "flight time"}),
            "response": list(self.responses),
            "unit": ("response", units),
        }


def fly(
    case: Case,
    profiles: str | Path | Soundings | Sounding,
    times: Iterable[float] | None,
    responses: Iterable[str] | None,
    component: str | None,
    sign: int,
) -> FlownWinds:
    """See :meth:`Study.fly`."""
    vehicle = case.vehicle_for("flying a measured wind")
    ends = case.checked_times(end_times(parse_times(vehicle.file.default_times) if times is None else times))
    names = case.checked_responses(responses)
    met, soundings = met_winds(case, component, sign), soundings_of(profiles)
    complete = complete_profiles(case, soundings, float(Climb.of(case).altitude(ends[-1])), met)
    weights = level_weights(case, ends, complete.levels, names)
    return FlownWinds(case, tuple(names), complete, weights, soundings.day)
