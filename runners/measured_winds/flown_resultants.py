"""Resultants of both planes in measured winds: histories, percentiles and flight maxima beside a Gaussian wind's."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..case.case import Case
from ..case.provenance import provenance
from ..present.netcdf import RULE
from ..present.notebook import html_of
from ..solvers.discretisation import symmetric_root
from ..statistics.norm import NormOfNormal
from .profile_statistics import independent_profiles, number_of, percentile_dataset, worst_profiles
from .profiles import CompleteProfiles

PERCENTILES = (0.05, 0.5, 0.95, 0.99)
PATHS = 4000  # drawn, for the Gaussian wind's flight maxima


@dataclass(frozen=True, eq=False, repr=False)
class FlownResultants:
    """Norms of what measured winds make of both planes.

    Attributes
    ----------
    case : Case
    pairs : dict of str to (int, int)
        Numbers of the responses, pitch and yaw, by resultant.
    units : tuple of str
        Of the resultants.
    profiles : CompleteProfiles
        The winds flown.
    times : (m,) array
        End times, s.
    day : (n,) array
        Of the profiles, NaN without dates.
    expected : (n, m, r) array
        Histories of the responses: of what is expected where part of a wind was not measured.
    drawn : (q n, m, r) array
        With that part drawn.
    predicted_mean : (m, r) array
        In the vehicle's mean wind at the levels.
    covariance_between : callable
        Of two numbers of responses: their covariance between all times, (m, m), in the vehicle's random wind.
    """

    case: Case
    pairs: dict[str, tuple[int, int]]
    units: tuple[str, ...]
    profiles: CompleteProfiles
    times: NDArray[np.float64]
    day: NDArray[np.float64]
    expected: NDArray[np.float64]
    drawn: NDArray[np.float64]
    predicted_mean: NDArray[np.float64]
    covariance_between: Callable[[int, int], NDArray[np.float64]]

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the resultants."""
        return tuple(self.pairs)

    def unit(self, resultant: str) -> str:
        """Return the unit of a resultant.

        Parameters
        ----------
        resultant : str
        """
        return self.units[number_of(resultant, self.responses)]

    def _norms(self, histories: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.stack([np.hypot(histories[..., a], histories[..., b]) for a, b in self.pairs.values()], axis=-1)

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """Histories (n, time, resultant): of what is expected in each plane, where part of a wind was not measured."""
        return self._norms(self.expected)

    @cached_property
    def completed(self) -> NDArray[np.float64]:
        """Histories with what was not measured drawn, (q n, time, resultant)."""
        return self._norms(self.drawn)

    def law(self, resultant: str) -> NormOfNormal:
        """Return the law of a resultant at each time in the vehicle's Gaussian wind, straight between the levels.

        Parameters
        ----------
        resultant : str

        Returns
        -------
        NormOfNormal
        """
        a, b = self.pairs[resultant]
        covariance = np.empty((self.times.size, 2, 2))
        for i, first in enumerate((a, b)):
            for j, second in enumerate((a, b)):
                covariance[:, i, j] = np.diagonal(self.covariance_between(first, second))
        covariance[:, 1, 0] = covariance[:, 0, 1]
        return NormOfNormal(self.predicted_mean[:, [a, b]], covariance)

    @cached_property
    def independent(self) -> NDArray[np.float64]:
        """Number of independent profiles behind each resultant at each time, (time, resultant)."""
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
            Over (probability, time, response): ``measured`` and ``interval`` (bound), 95 % by order statistics;
            ``predicted``, the percentile of the norm in a Gaussian wind of the vehicle's means and filters.
        """
        p = np.array([float(x) for x in probabilities])
        laws = [self.law(name) for name in self.pairs]
        predicted = np.stack([[law.percentile(1.0 - x) for law in laws] for x in p]).transpose(0, 2, 1)
        return percentile_dataset(self.completed, self.independent, predicted, p, self._coordinates())

    @cached_property
    def maxima(self) -> NDArray[np.float64]:
        """The largest resultant over the times, (q n, resultant), as of :attr:`completed`."""
        return self.completed.max(axis=1)

    @cached_property
    def predicted_maxima(self) -> NDArray[np.float64]:
        """The same of drawn Gaussian winds at the same times, both planes jointly, in order, (4000, resultant)."""
        random, found, m = np.random.default_rng(506), [], self.times.size
        for a, b in self.pairs.values():
            between = self.covariance_between
            across = between(a, b)
            root = symmetric_root(np.block([[between(a, a), across], [across.T, between(b, b)]])[None])[0]
            drawn = (random.standard_normal((PATHS, 2 * m)) @ root.T).reshape(PATHS, 2, m)
            paths = self.predicted_mean[:, [a, b]].T + drawn
            found.append(np.sort(np.hypot(paths[:, 0], paths[:, 1]).max(axis=1)))
        return np.array(found).T

    def worst(self, resultant: str, count: int = 10) -> list[tuple[str, str, float, float]]:
        """Return the profiles with the largest resultant: name, date, value, time (s).

        Parameters
        ----------
        resultant : str
        count : int

        Returns
        -------
        list of tuples
        """
        values = self.values[:, :, number_of(resultant, self.responses)]
        return worst_profiles(values, self.profiles, self.times, count)

    def to_dataset(self) -> xr.Dataset:
        """Return histories, percentiles and flight maxima as one dataset.

        Returns
        -------
        xarray.Dataset
        """
        found, dims = self.percentiles(), ("profile", "time", "response")
        largest = self.values.max(axis=1)
        return found.assign(
            value=(dims, self.values, {RULE: "response", "long_name": "resultant in the measured wind"}),
            flight_maximum=(
                ("profile", "response"), largest, {RULE: "response", "long_name": "largest over the times"},
            ),
        ).assign_coords(
            profile=list(self.profiles.names), date=("profile", self.profiles.time)
        ).assign_attrs(provenance(self.case) | {"soundings": self.profiles.source})  # fmt: skip

    def __repr__(self) -> str:
        return f"FlownResultants: {len(self.values)} profiles, {self.times.size} times, " + ", ".join(self.responses)

    def _repr_html_(self) -> str:
        return html_of(repr(self))

    def _coordinates(self) -> dict[str, object]:
        return {
            "time": ("time", self.times, {"units": "s", "long_name": "flight time"}),
            "response": list(self.responses),
            "unit": ("response", list(self.units)),
        }
