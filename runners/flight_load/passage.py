"""Whether a flight keeps its limits: at any time, of any response, at any station, jointly."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..case.case import Case
from ..case.provenance import provenance
from ..present.notebook import html_of
from ..present.progress import steps
from ..statistics.percentiles import Sides
from .crossings import Boundary
from .norms import Norms, Process
from .probability import Estimate, Level, estimate, find_level
from .request import CertainPassageWarning
from .sampling import Draws, draw_beyond, instant_levels

BINS = 60  # of the time of passing
MOST_TOLD = 4000  # levels of resultants, about


@dataclass(frozen=True)
class LimitedLoad:
    """What a limit is of.

    Attributes
    ----------
    name : str
        Of the response, or of the load at a station.
    unit : str
    station : float
        m; NaN for a response.
    resultant : bool
        Whether it is the norm of both planes.
    """

    name: str
    unit: str
    station: float = float("nan")
    resultant: bool = False

    @property
    def label(self) -> str:
        """A name of its own, such as 'bending_moment_at_25m'."""
        return self.name if np.isnan(self.station) else f"{self.name}_at_{self.station:.6g}m"

    def __str__(self) -> str:
        where = "" if np.isnan(self.station) else f" at station {self.station:g} m"
        return f"{self.name.replace('_', ' ')}{where}"


@dataclass(frozen=True, eq=False, repr=False)
class Passage:
    """The chance that a flight passes limits, and what is left of them.

    Attributes
    ----------
    case : Case
    loads : tuple of LimitedLoad
        r of them.
    process : Process
        Of the loads.
    limit : (m, r) array
        Of their sizes, on the grid seen.
    sides : {'both', 'upper', 'lower'}
    design : float
        Probability that margins are of.
    draws, seed : int
    """

    case: Case
    loads: Sequence[LimitedLoad]
    process: Process
    limit: NDArray[np.float64]
    sides: Sides
    design: float
    draws: int
    seed: int

    def __post_init__(self):
        mean = self.process.seen.mean
        toward = {"both": np.abs(mean), "upper": mean, "lower": -mean}[self.sides]
        below = toward >= self.limit
        if below.any():
            load = int(np.argmax(below.any(axis=0)))
            time = self.process.seen.times[int(np.argmax(below[:, load]))]
            text = f"the limit of {self.loads[load]} lies below its mean at {time:g} s: nearly every flight passes it"
            warnings.warn(CertainPassageWarning(text), stacklevel=4)

    @cached_property
    def _boundary(self) -> Boundary:
        return Boundary.around(self.limit, self.sides)

    @cached_property
    @steps("flights that pass a limit")
    def _drawn(self) -> Draws:
        return draw_beyond(self.process, self._boundary, np.random.default_rng([self.seed, 10]), self.draws)

    @cached_property
    def probability(self) -> Estimate:
        """Of passing any of the limits at any time: jointly; ``sum_of_instants`` is what adding would say."""
        return estimate(self._drawn, self._boundary)

    @cached_property
    def by_load(self) -> xr.DataArray:
        """Probability of passing the limit of each load at any time, (load,)."""
        what = {"units": "1", "long_name": "probability of passing the limit at any time"}
        return xr.DataArray(
            np.minimum(self._drawn.by_output(self._boundary), 1.0), self._loads(), ("load",), "probability", what
        )

    @cached_property
    def by_time(self) -> xr.DataArray:
        """Density of passing over the times at which flights are farthest beyond, s^-1, (time,)."""
        places = self._drawn.places(self._boundary).sum(axis=(1, 2))
        times = self.process.seen.times
        edges = np.linspace(times[0], times[-1], BINS + 1)
        density = np.histogram(times, edges, weights=places)[0] / np.diff(edges)
        time = ("passage_time", 0.5 * (edges[1:] + edges[:-1]), {"units": "s", "long_name": "flight time"})
        what = {"units": "s^-1", "long_name": "probability density of passing, by the time farthest beyond"}
        return xr.DataArray(density, {"passage_time": time}, ("passage_time",), "passage_density", what)

    @property
    def told(self) -> slice:
        """The points drawn at which levels and margins are told: not all of many resultants, whose levels are dear."""
        mean = self.process.drawn.mean
        return slice(None, None, max(1, mean.size // MOST_TOLD) if isinstance(self.process, Norms) else 1)

    @property
    def limit_told(self) -> NDArray[np.float64]:
        """The limit at these points, (k, r)."""
        return self.limit[:: self.process.stride][self.told]

    @cached_property
    @steps("levels of all limits")
    def level(self) -> xr.DataArray:
        """The level that each load passes at each instant with the design probability, (time, load), SI."""
        values = instant_levels(self.process, self.design, self.sides, self.told)
        return self._over_time(values, "level", f"passed at the instant with probability {self.design:g}")

    @cached_property
    def margin(self) -> xr.DataArray:
        """Limit minus that level, (time, load), SI."""
        values = self.limit_told - self.level.values
        return self._over_time(values, "margin", f"limit minus the level passed with probability {self.design:g}")

    @cached_property
    @steps("factor on all limits")
    def factor(self) -> Level:
        """The factor on all limits at which a flight passes one of them with the design probability."""

        def scaled(by: float) -> Boundary:
            return Boundary.around(by * self.limit, self.sides)

        limit = self.limit[:: self.process.stride]
        size = float(((np.abs(self.process.drawn.mean) + 3 * self.process.std) / limit).max())
        random = np.random.default_rng([self.seed, 11])
        return find_level(self.process, self.design, scaled, size, random, self.draws)

    @property
    def margin_of_safety(self) -> float:
        """What is left of the limits at the design probability of the whole flight: one over the factor, minus one."""
        return 1.0 / self.factor.value - 1.0

    def to_dataset(self) -> xr.Dataset:
        """Return limits, levels, margins and probabilities.

        Returns
        -------
        xarray.Dataset
            Over (time, load), with name, unit and station of each load as coordinates. Attributes: ``probability`` of
            passing any, its ``standard_error`` and ``spacing_error``, the bounds, ``margin_of_safety``.
        """
        p = self.probability
        limit = self._over_time(self.limit_told, "limit", "limit of the size")
        parts = {"limit": limit, "level": self.level, "margin": self.margin}
        found = xr.Dataset(parts | {"passage_probability": self.by_load, "passage_density": self.by_time})
        return found.assign_attrs(
            provenance(self.case)
            | {
                "probability": p.value,
                "standard_error": p.standard_error,
                "spacing_error": p.spacing_error,
                "largest_instant": p.largest_instant,
                "sum_of_instants": p.sum_of_instants,
                "design_probability": self.design,
                "margin_of_safety": self.margin_of_safety,
                "sides": self.sides,
                "draws": self.draws,
                "seed": self.seed,
            }
        )

    def __repr__(self) -> str:
        p = self.probability
        names = f"{len(self.loads)} limits" if len(self.loads) > 1 else f"limit of {self.loads[0]}"
        low, high = p.interval
        return (
            f"Passage of {names}: {p.value:.4g} of flights ({low:.3g} to {high:.3g})\n"
            f"  margin of safety at {self.design:g}: {self.margin_of_safety:+.4f}"
        )

    def _repr_html_(self) -> str:
        return html_of(repr(self))

    def _loads(self) -> dict[str, tuple]:
        return {
            "load_name": ("load", [load.name for load in self.loads]),
            "load_unit": ("load", [load.unit for load in self.loads]),
            "station": ("load", [load.station for load in self.loads], {"units": "m", "long_name": "vehicle station"}),
        }

    def _over_time(self, values: NDArray[np.float64], name: str, meaning: str) -> xr.DataArray:
        time = ("time", self.process.drawn.times[self.told], {"units": "s", "long_name": "flight time"})
        return xr.DataArray(values, {"time": time} | self._loads(), ("time", "load"), name, {"long_name": meaning})
