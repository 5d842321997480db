"""Whether a flight keeps its limits: at any time, at any station, jointly."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..statistics.percentiles import instant_level
from .crossings import Boundary
from .probability import Estimate, Level, estimate, find_level
from .process import Process
from .request import CertainPassageWarning, Sides
from .sampling import Draws, draw_beyond


@dataclass(frozen=True, eq=False, repr=False)
class Passage:
    """The chance that a flight passes limits, and what is left of them.

    Attributes
    ----------
    process : Process
        Of r loads.
    limit : (m, r) array
        Of their sizes, on the grid seen.
    unit : str
    station : (r,) array or None
        m; None where the limit is of one response.
    sides : {'both', 'upper', 'lower'}
    design : float
        Probability of which margins are.
    draws, seed : int
    """

    process: Process
    limit: NDArray[np.float64]
    unit: str
    station: NDArray[np.float64] | None
    sides: Sides
    design: float
    draws: int
    seed: int

    def __post_init__(self):
        below = np.abs(self.process.seen.mean) >= self.limit
        if below.any():
            at = int(np.argmax(below.any(axis=1)))
            warnings.warn(
                CertainPassageWarning(
                    f"the limit lies below the mean from {self.process.seen.times[at]:g} s on: nearly every flight "
                    "passes it"
                ),
                stacklevel=4,
            )

    @cached_property
    def _boundary(self) -> Boundary:
        return Boundary.around(self.limit, self.sides)

    @cached_property
    def _drawn(self) -> Draws:
        return draw_beyond(self.process, self._boundary, np.random.default_rng([self.seed, 10]), self.draws)

    @cached_property
    def probability(self) -> Estimate:
        """Of passing any limit at any time, at any station: jointly, not the sum of single probabilities."""
        return estimate(self._drawn, self._boundary)

    @cached_property
    def by_station(self) -> xr.DataArray:
        """Probability of passing the limit of each station at any time, (station,)."""
        each = self._drawn.near.passed_by_output(self._boundary)
        return self._over_stations(np.minimum((self._drawn.weight[:, None] * each).mean(axis=0), 1.0), "probability")

    @cached_property
    def by_time(self) -> xr.DataArray:
        """How the probability falls on the times at which flights are farthest beyond, s^-1, (time,)."""
        places = self._drawn.places(self._boundary).sum(axis=(1, 2))
        times = self.process.seen.times
        edges = np.linspace(times[0], times[-1], 61)
        density = np.histogram(times, edges, weights=places)[0] / np.diff(edges)
        time = ("time", 0.5 * (edges[1:] + edges[:-1]), {"units": "s", "long_name": "flight time"})
        what = {"units": "s^-1", "long_name": "probability density of passing, by the time farthest beyond"}
        return xr.DataArray(density, {"time": time}, ("time",), "passage_time", what)

    @cached_property
    def margin(self) -> xr.DataArray:
        """Limit minus the level that the load passes at that instant with the design probability, (time, station)."""
        drawn = self.process.drawn
        limit = self.limit[:: self.process.stride]
        margin = limit - instant_level(drawn.mean, self.process.std, self.design, self.sides)
        time = ("time", drawn.times, {"units": "s", "long_name": "flight time"})
        what = {"units": self.unit, "long_name": f"margin to the limit at an instant, with probability {self.design:g}"}
        if self.station is None:
            return xr.DataArray(margin[:, 0], {"time": time}, ("time",), "margin", what)
        station = ("station", self.station, {"units": "m", "long_name": "vehicle station"})
        return xr.DataArray(margin, {"time": time, "station": station}, ("time", "station"), "margin", what)

    @cached_property
    def factor(self) -> Level:
        """The factor on all limits at which the flight passes one of them with the design probability."""

        def scaled(by: float) -> Boundary:
            return Boundary.around(by * self.limit, self.sides)

        return find_level(
            self.process, self.design, scaled, self._typical_factor, np.random.default_rng([self.seed, 11]), self.draws
        )

    @property
    def _typical_factor(self) -> float:
        limit = self.limit[:: self.process.stride]
        return float(((np.abs(self.process.drawn.mean) + 3 * self.process.std) / limit).max())

    @property
    def margin_of_safety(self) -> float:
        """Limit over the flight's level, minus one: how much of the limits is left at the design probability."""
        return 1.0 / self.factor.value - 1.0

    def _over_stations(self, values: NDArray[np.float64], name: str) -> xr.DataArray:
        what = {"units": "1", "long_name": "probability of passing the limit at any time"}
        if self.station is None:
            return xr.DataArray(values[0], name=name, attrs=what)
        station = ("station", self.station, {"units": "m", "long_name": "vehicle station"})
        return xr.DataArray(values, {"station": station}, ("station",), name, what)

    def to_dataset(self) -> xr.Dataset:
        """Return probability, margins and shares in one dataset."""
        p, names = self.probability, ("value", "standard_error", "spacing_error", "largest_instant", "sum_of_instants")
        attributes = {f"passage_{name}": getattr(p, name) for name in names}
        attributes |= {"design_probability": self.design, "margin_of_safety": self.margin_of_safety}
        parts = {"passage_by_station": self.by_station, "passage_time": self.by_time}
        found = xr.Dataset({"margin": self.margin} | parts if self.station is not None else {"margin": self.margin})
        return found.assign_attrs(attributes)
