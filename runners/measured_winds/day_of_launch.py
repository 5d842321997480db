"""The day of launch: what balloons sent up some hours before say of the responses of the flight.

The wind at launch w and measured winds z_a, tau_a hours before, are jointly Gaussian: waves of the vehicle's filter
that persist (:mod:`wind_field`). With K the covariance of all measurements, their errors included, and c(t) that of a
response y(t) with them,

    E[y(t) | z] = mean + c(t)' K^-1 (z - mean z),   Cov[y(t), y(t') | z] = R(t, t') - c(t)' K^-1 c(t'),

R of all sources: what is left of the wind, its scales between grid levels and turbulence, and the vehicle's own
scatter. Means and deviations are on a coarse grid of times; the chance of passing a limit is on a fine one, where it is
worth while.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...model.errors import ParameterValueError, UnknownNameError
from ...model.wind.soundings.collection import Soundings
from ...model.wind.soundings.read import read_profiles
from ...model.wind.soundings.sounding import Sounding, SoundingError
from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..flight_load.limit_table import LimitError, Limits
from ..flight_load.passage import Passage
from ..flight_load.probability import Estimate
from ..flight_load.process import joint_covariance
from ..flight_load.request import DESIGN, checked_draws
from ..flight_load.window import checked_window, window_chain
from ..present.netcdf import RULE
from ..present.notebook import html_of
from ..present.progress import steps
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import Sides, checked_sides
from ..statistics.resultants import resultant_pairs
from .conditioning import Measured
from .level_weights import LevelWeights
from .limited_loads import LimitedLoads, kept_rows, limited_loads, row_weights, symmetric
from .met_winds import MetWinds, met_winds
from .other_winds import in_mean_winds
from .persistence import ComponentPersistence, Persistence
from .profile_statistics import number_of
from .random_wind import FARTHEST
from .wind_field import Lasting, WindField, default_persistence, wind_field

STEPS, FINER = 240, 10  # of the window, and of each for the chance of passing a limit
STRIDES = (1, 2, 5, FINER)  # of the finer steps, where there are many loads
MOST_KEPT = 10_000  # loads and close times whose weights are made at once
MOST_VALUES = 2000  # loads and times whose joint covariance is made: its draws take a second
LEFT_OUT = 2e-3  # of the instants' chances, at either end
FEWEST = 4  # coarse steps looked at
CLOCK = 1.5  # h that dates of balloons and their hours before launch may differ: files are dated by the nearest hour
NEAREST = 50.0  # m: levels nearer to the one below are passed over, whose errors are not independent
BAND = 1.645  # conditional sigmas to either side, which hold 90 %

Balloon = str | Path | Sounding | Soundings


@dataclass(frozen=True, eq=False)
class Balloons:
    """Measured winds across the flight.

    Attributes
    ----------
    altitude : (k,) array
        Of all measurements, m.
    wind : (k,) array
        As the vehicle meets it, m/s.
    component : (k,) array of int
        Which of the winds that it meets.
    hours : (k,) array
        Before launch.
    names : tuple of str
        Of the balloons.
    flown : tuple of (Sounding, float)
        The balloons, and the hours of each before launch.
    """

    altitude: NDArray[np.float64]
    wind: NDArray[np.float64]
    component: NDArray[np.intp]
    hours: NDArray[np.float64]
    names: tuple[str, ...]
    flown: tuple[tuple[Sounding, float], ...]


@dataclass(frozen=True, eq=False)
class Flight:
    """What a flight has by itself, whatever is measured: kept between updates.

    Attributes
    ----------
    case : Case
    loads : LimitedLoads
        The responses, or loads along the vehicle, and their limits.
    about : Case
        The same in the mean wind that deviations of the vehicle act in.
    field : WindField
    weights : LevelWeights
        Of the loads at the field's levels.
    by_wave : (m, r, c N) array
        Loads by each wave of the wind.
    mean : (m, r) array
    covariance : (m, r, r) array
        Of all sources, at each time.
    window : (float, float)
        s.
    """

    case: Case
    loads: LimitedLoads
    about: Case
    field: WindField
    weights: LevelWeights
    by_wave: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    window: tuple[float, float]

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Of the responses, (m, r)."""
        return np.sqrt(np.maximum(np.einsum("mrr->mr", self.covariance), 0.0))

    def fine(self, loads: LimitedLoads, first: int, last: int) -> FinePart:
        """Return some of the loads between two of the coarse times (numbers), at close times."""
        count = FINER * (last - first) + 1
        stride = next(k for k in STRIDES if k == FINER or count * len(loads.rows) <= k * MOST_VALUES)
        points = slice(FINER * first // stride, FINER * last // stride + 1)
        whole = window_chain(self.case, self.window, FINER * STEPS // stride)
        row, _, mean = (part if part is None else part[points] for part in kept_rows(self.case, loads, whole))
        if self.about is self.case:
            about = whole.part(points)
        else:
            about = window_chain(self.about, self.window, FINER * STEPS // stride).part(points)
            row, _, _ = loads.over(about, self.about)
        assert row is not None and mean is not None
        if self.holds_close_times(self.loads):  # of all rows: another balloon may need others of them
            weight = self.kept_weights(self.case, self.loads, self.window, self.field, 1).weight[::stride][points]
            weight = weight[:, [self.loads.rows.index(row) for row in loads.rows]]
        else:
            weight = self.kept_weights(self.case, loads, self.window, self.field, stride).weight[points]
        return FinePart(about.times, weight, mean, joint_covariance(about, row), row @ about.noise_matrix)

    @staticmethod
    def holds_close_times(loads: LimitedLoads) -> bool:
        """Return whether the weights of loads at all close times are few enough to be made with the coarse ones."""
        return bool(loads.limits) and (FINER * STEPS + 1) * len(loads.rows) <= MOST_KEPT

    @staticmethod
    def kept_weights(
        case: Case, loads: LimitedLoads, window: tuple[float, float], field: WindField, stride: int
    ) -> LevelWeights:
        """Return the weights of some rows at every so many of the close times of a window; kept with the case."""

        def made() -> LevelWeights:
            chain = window_chain(case, window, FINER * STEPS // stride)
            return row_weights(case, replace(loads, limits=()), chain, field.levels)

        return case.kept(("fine weights", window, stride, loads.rows), made)


@dataclass(frozen=True, eq=False)
class FinePart:
    """Responses at close times.

    Attributes
    ----------
    times : (m,) array
        s.
    weight : (m, r, c N) array
        Of the wind at the field's levels.
    mean : (m, r) array
    covariance : (m, r, m, r) array
        Of all sources.
    direct : (m, r, noises) array
        What white noise does to the loads directly.
    """

    times: NDArray[np.float64]
    weight: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    direct: NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class DayOfLaunch:
    """A flight given the winds measured before it.

    Attributes
    ----------
    flight : Flight
    balloons : Balloons
    persistence : Persistence or ComponentPersistence
    error : float
        Standard deviation of a measured wind's error, m/s, independent from level to level.
    threshold : float
        Probability of passing a limit above which it is no-go.
    sides : {'both', 'upper', 'lower'}
    draws, seed : int
    met : MetWinds
        What of a balloon's wind the vehicle meets.
    """

    flight: Flight
    balloons: Balloons
    persistence: Lasting
    error: float
    threshold: float
    sides: Sides
    draws: int
    seed: int
    met: MetWinds

    @property
    def times(self) -> NDArray[np.float64]:
        """s, (m,)."""
        return self.flight.weights.times

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the responses, or of the loads along the vehicle, r of them."""
        return self.flight.loads.labels

    @property
    def limits(self) -> Limits | None:
        """What may not be passed."""
        return self.flight.loads.table

    @cached_property
    def _rows(self) -> NDArray[np.float64]:
        """Measurements by each wave when they were made, (k, c N)."""
        field, balloons = self.flight.field, self.balloons
        rows = np.empty((balloons.altitude.size, field.waves.shape[0]))
        for number in range(field.components):
            at = balloons.component == number
            rows[at] = field.rows(balloons.altitude[at], number)
        return rows

    @cached_property
    def _seen_now(self) -> NDArray[np.float64]:
        """Measurements by each wave at launch, (k, c N): faded by their lag."""
        hours = self.balloons.hours
        rho = {h: self.flight.field.kept(self.persistence, h) for h in np.unique(hours).tolist()}
        return self._rows * np.array([rho[h] for h in hours.tolist()])

    @cached_property
    def measured(self) -> Measured:
        """The covariance K of all measurements."""
        hours = self.balloons.hours
        K = np.zeros((hours.size, hours.size))
        times = np.unique(hours).tolist()
        for a in times:
            for b in times:
                i, j = hours == a, hours == b
                rho = self.flight.field.kept(self.persistence, abs(a - b))
                K[np.ix_(i, j)] = (self._rows[i] * rho) @ self._rows[j].T
        return Measured(K + self.error**2 * np.eye(hours.size))

    @cached_property
    def _deviation(self) -> NDArray[np.float64]:
        """What was measured less the mean wind there, whitened, (k,)."""
        mean = np.empty(self.balloons.wind.size)
        for number in range(self.flight.field.components):
            at = self.balloons.component == number
            mean[at] = self.flight.field.mean_at(self.balloons.altitude[at], number)
        return self.measured.whitened(self.balloons.wind - mean)

    @cached_property
    def _gain(self) -> NDArray[np.float64]:
        """Covariances of the responses with the whitened measurements, (k, m r)."""
        by_wave = self.flight.by_wave
        return self.measured.whitened(self._seen_now @ by_wave.reshape(-1, by_wave.shape[2]).T)

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """E[y | z], (m, r), SI."""
        return self.flight.mean + (self._deviation @ self._gain).reshape(self.flight.mean.shape)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """Of the responses at each time given the measurements, all sources, (m, r, r)."""
        gain = self._gain.reshape(-1, *self.flight.mean.shape).transpose(1, 2, 0)
        return self.flight.covariance - gain @ gain.swapaxes(1, 2)

    @cached_property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of the responses given the measurements, all sources, (m, r)."""
        return np.sqrt(np.maximum(np.einsum("mrr->mr", self.covariance), 0.0))

    @property
    def resultants(self) -> tuple[str, ...]:
        """Names of the norms of responses of both planes; none in one plane."""
        return tuple(resultant_pairs(self.responses))

    def law(self, resultant: str, climatology: bool = False) -> NormOfNormal:
        """Return the law of a resultant at each time given the measurements.

        Parameters
        ----------
        resultant : str
        climatology : bool
            Of the season instead.

        Returns
        -------
        NormOfNormal
            ``percentile(probability)`` is the level passed at each instant.

        Raises
        ------
        UnknownNameError
        """
        pairs = resultant_pairs(self.responses)
        if resultant not in pairs:
            raise UnknownNameError("resultant", resultant, pairs)
        at = [self.responses.index(name) for name in pairs[resultant]]
        of = self.flight if climatology else self
        return NormOfNormal(of.mean[:, at], of.covariance[:, at][:, :, at])

    @cached_property
    def wind(self) -> xr.Dataset:
        """The wind at launch over (altitude), and of both planes over (component, altitude).

        ``mean`` and ``std`` given the measurements, ``climatology`` and its std.
        """
        field = self.flight.field
        gain = self.measured.whitened(self._seen_now @ field.waves.T)
        parts = {
            "mean": (field.wind.mean + self._deviation @ gain, "wind expected at launch"),
            "std": (np.sqrt(np.maximum(field.wind.std**2 - (gain**2).sum(axis=0), 0.0)), "its standard deviation"),
            "climatology": (field.wind.mean, "mean wind of the season"),
            "climatological_std": (field.wind.std, "its standard deviation"),
        }
        found = xr.Dataset(
            {
                name: (
                    ("component", "altitude"), values.reshape(field.components, -1),
                    {"units": "m/s", "long_name": text},
                )
                for name, (values, text) in parts.items()
            },
            {
                "component": list(self.met.components),
                "altitude": ("altitude", field.levels, {"units": "m", "long_name": "altitude"}),
            },
        )  # fmt: skip
        return found if self.met.both else found.isel(component=0, drop=True)

    def limit(self) -> NDArray[np.float64]:
        """Return the limits of the responses that have one by themselves, NaN elsewhere, (m, r)."""
        found, loads = np.full(self.mean.shape, np.nan), self.flight.loads
        for limit, values in zip(loads.limits, loads.values(self.times).T, strict=True):
            if len(limit.rows) == 1:
                found[:, limit.rows[0]] = values
        return found

    def resultant_limit(self) -> NDArray[np.float64]:
        """Return the limits of the resultants that have one, NaN elsewhere, (m, resultants)."""
        loads, names = self.flight.loads, self.resultants
        found = np.full((self.times.size, len(names)), np.nan)
        for limit, values in zip(loads.limits, loads.values(self.times).T, strict=True):
            if len(limit.rows) == 2:
                found[:, names.index(limit.load.label)] = values
        return found

    def margin_in_sigmas(self, climatology: bool = False) -> NDArray[np.float64]:
        """Return how many conditional sigmas the mean is off its limit, on the nearer side, (m, r); NaN without one.

        Parameters
        ----------
        climatology : bool
            Of the season instead.
        """
        mean, std = (self.flight.mean, self.flight.std) if climatology else (self.mean, self.std)
        toward = {"both": np.abs(mean), "upper": mean, "lower": -mean}[self.sides]
        return np.divide(self.limit() - toward, std, out=np.full(std.shape, np.nan), where=std > 0)

    @cached_property
    def passage(self) -> Passage:
        """Whether a flight given the measurements passes any of the limits, and where."""
        return self._passage(True)

    @cached_property
    def climatological_passage(self) -> Passage:
        """The same of the season, as if nothing was measured."""
        return self._passage(False)

    @property
    def chance(self) -> Estimate:
        """That any limit is passed during the flight, given the measurements, with its errors.

        What is left of the wind varies fast, and the limit lies many of its deviations out: what the grid of times
        misses, some per cent, is added by extrapolation.
        """
        return self.passage.probability.extrapolated

    @property
    def climatological_chance(self) -> Estimate:
        """The same of the season."""
        return self.climatological_passage.probability.extrapolated

    @property
    def probability(self) -> float:
        """That any limit is passed during the flight, given the measurements."""
        return self.chance.value

    @property
    def go(self) -> bool:
        """Whether that is no more than the threshold."""
        return self.probability <= self.threshold

    def update(self, sounding: Balloon, hours_before: float) -> DayOfLaunch:
        """Return the same with one more balloon.

        Parameters
        ----------
        sounding : path, Sounding or Soundings
            Of one time.
        hours_before : float
            Launch, h.

        Returns
        -------
        DayOfLaunch

        Raises
        ------
        SoundingError, DataError, ParameterValueError
        """
        new = _balloons(self.flight, [(sounding, hours_before)], self.met, self.error)
        both = (self.balloons, new)
        parts = [
            np.concatenate([getattr(b, name) for b in both]) for name in ("altitude", "wind", "component", "hours")
        ]
        flown = self.balloons.flown + new.flown
        _refuse_unlike(flown)
        return replace(self, balloons=Balloons(*parts, names=self.balloons.names + new.names, flown=flown))

    def about_its_mean(self) -> DayOfLaunch:
        """Return the same with the vehicle's own deviations acting on the mean flight of the day, not of the season.

        In a strong wind they do more, in a calm one less. The vehicle is integrated once in the wind expected.

        Returns
        -------
        DayOfLaunch

        Raises
        ------
        IntegrationError
        """
        flight, field = self.flight, self.flight.field
        expected = self.wind["mean"].values.reshape(field.components, -1)

        def of_day(number: int, levels: NDArray[np.float64]) -> NDArray[np.float64]:
            inside = np.clip(levels, field.levels[0], field.levels[-1])
            return np.interp(inside, field.levels, expected[number]) - field.mean_at(inside, number)

        about = in_mean_winds(flight.case, of_day, added=True)
        chain = window_chain(about, flight.window, STEPS)
        row, _, _ = flight.loads.over(chain, about)
        covariance = symmetric(row @ chain.covariance() @ row.swapaxes(1, 2))
        return replace(self, flight=replace(flight, about=about, covariance=covariance))

    def with_persistence(self, persistence: Lasting) -> DayOfLaunch:
        """Return the same with another persistence.

        Parameters
        ----------
        persistence : Persistence or ComponentPersistence

        Returns
        -------
        DayOfLaunch
        """
        return replace(self, persistence=persistence)

    def to_dataset(self) -> xr.Dataset:
        """Return means, deviations, limits and margins over (time, response), and levels of resultants of both planes.

        Returns
        -------
        xarray.Dataset
        """
        dims = ("time", "response")
        parts = {
            "mean": (self.mean, "expected at launch"),
            "std": (self.std, "standard deviation given the measurements"),
            "climatological_mean": (self.flight.mean, "mean of the season"),
            "climatological_std": (self.flight.std, "standard deviation of the season"),
            "limit": (self.limit(), "limit of the size"),
        }
        found = xr.Dataset(
            {name: (dims, values, {RULE: "response", "long_name": text}) for name, (values, text) in parts.items()},
            {
                "time": ("time", self.times, {"units": "s", "long_name": "flight time"}),
                "response": list(self.responses),
                "unit": ("response", [self.unit(name) for name in self.responses]),
            },
            provenance(self.flight.case)
            | {
                "balloons": "; ".join(self.balloons.names),
                "persistence": self.persistence.source,
                "persistence_hours": [part.hours for part in self.persistence.parts],
                "persistence_exponent": [part.exponent for part in self.persistence.parts],
                "error_m_s": self.error,
                "condition_of_measurements": self.measured.condition,
            },
        )
        if self.resultants:
            found = found.assign_coords(
                resultant=list(self.resultants),
                resultant_unit=(
                    "resultant", [self.unit(pair[0]) for pair in resultant_pairs(self.responses).values()]
                ),
            )  # fmt: skip
            for name, season, text in (
                ("resultant_level", False, "level passed with 0.00135 at the instant, given the measurements"),
                ("climatological_resultant_level", True, "the same of the season"),
            ):
                levels = [self.law(resultant, season).percentile() for resultant in self.resultants]
                found[name] = (("time", "resultant"), np.array(levels).T, {RULE: "resultant", "long_name": text})
        found["margin_in_sigmas"] = (dims, self.margin_in_sigmas(), {"units": "1", "long_name": "margin to the limit"})
        return found

    def __repr__(self) -> str:
        told = f"DayOfLaunch given {' and '.join(self.balloons.names)}: {', '.join(self.responses)}"
        return told if self.limits is None else f"{told}\n  {'go' if self.go else 'no-go'}: {self.probability:.3g}"

    def _repr_html_(self) -> str:
        return html_of(repr(self))

    def unit(self, response: str) -> str:
        """Return the unit of a response or load.

        Parameters
        ----------
        response : str
        """
        return self.flight.loads.rows[number_of(response, self.responses)].unit

    def _passage(self, given: bool) -> Passage:
        """Return the passage given the measurements, or of the season, on the fine grid where it is worth while."""
        flight, loads = self.flight, self.flight.loads
        if not loads.limits:
            raise LimitError("there is no limit of the responses; give limits= to ask for a probability")
        of = self if given else flight
        chance = loads.chances(of.mean, of.covariance, loads.values(self.times), self.sides)
        begin, end = worth_while(chance)
        loads, _ = loads.only(matter(chance))
        with steps("winds between the times of the grid"):
            fine = flight.fine(loads, begin, end)
        level_mean, covariance = fine.mean, fine.covariance
        if given:
            by_level = flight.field.waves @ self._seen_now.T  # cov(wind at levels, measurements)
            gain = self.measured.whitened(by_level.T @ fine.weight.reshape(-1, fine.weight.shape[2]).T)
            level_mean = level_mean + (self._deviation @ gain).reshape(level_mean.shape)
            covariance = covariance - (gain.T @ gain).reshape(covariance.shape)
        variance = np.maximum(np.einsum("mrmr->mr", covariance), 0.0)
        across_step = np.einsum("mrmr->mr", covariance[:-1, :, 1:])
        moved = np.maximum(variance[:-1] + variance[1:] - 2 * across_step, 0.0) / np.diff(fine.times)[:, None]
        left, size = np.sqrt(np.concatenate([moved, moved[-1:]])), np.sqrt((fine.direct**2).sum(axis=2))
        share = np.minimum(1.0, np.divide(left, size, out=np.ones(size.shape), where=size > 0))
        process = loads.process(fine.times, level_mean, covariance, fine.direct * share[..., None])
        limited, values = [limit.load for limit in loads.limits], loads.values(fine.times)
        return Passage(flight.case, limited, process, values, self.sides, DESIGN, self.draws, self.seed)


def worth_while(chance: NDArray[np.float64]) -> tuple[int, int]:
    """Return the first and last of the coarse times outside which limits are passed too rarely, by chances (m, q)."""
    total = np.cumsum(chance.sum(axis=1))
    if not total[-1] > 0:
        return 0, FEWEST
    first = int(np.searchsorted(total, LEFT_OUT * total[-1])) - 1
    last = int(np.searchsorted(total, (1 - LEFT_OUT) * total[-1])) + 1
    first = min(max(first, 0), len(chance) - 1 - FEWEST)
    return first, min(max(last, first + FEWEST), len(chance) - 1)


def matter(chance: NDArray[np.float64]) -> list[int]:
    """Return which limits are passed often enough to matter, by chances (m, q) of the instants; one at least."""
    each = chance.sum(axis=0)
    order = np.argsort(each)
    left = int(np.searchsorted(np.cumsum(each[order]), LEFT_OUT * each.sum()))
    return sorted(order[min(left, each.size - 1) :].tolist())


def day_of_launch(
    case: Case,
    soundings: Balloon | Sequence[Balloon],
    hours_before: float | Sequence[float],
    limits: str | Path | Limits | None,
    window: tuple[float, float] | None,
    responses: Iterable[str] | None,
    persistence: Lasting | None,
    error: float,
    threshold: float,
    sides: Sides,
    draws: int,
    seed: int,
    component: str | None,
    sign: int,
) -> DayOfLaunch:
    """See :meth:`Study.day_of_launch`."""
    checked_draws(draws, seed)
    for name, value, good in (("error", error, 0 <= error < np.inf), ("threshold", threshold, 0 < threshold < 1)):
        if not good:
            raise ParameterValueError(f"{name} = {value!r} cannot be used; an error is m/s, a threshold a probability")
    flown, chosen = checked_window(case, window), checked_sides(sides)
    loads = limited_loads(case, limits, responses, flown, chosen)
    balloons: list[Balloon] = list(soundings) if isinstance(soundings, list | tuple) else [cast("Balloon", soundings)]
    hours = list(hours_before) if isinstance(hours_before, Sequence) else [hours_before]
    if len(balloons) != len(hours):
        raise ParameterValueError(f"{len(balloons)} soundings and {len(hours)} times before launch; give one each")
    met = met_winds(case, component, sign)
    flight = _flight(case, loads, flown)
    found = _balloons(flight, list(zip(balloons, hours, strict=True)), met, error)
    lasting = persistence
    if lasting is None:
        lasting = case.kept(("persistence", flown, met), lambda: default_persistence(flight.field, met.components))
    if met.both and isinstance(lasting, Persistence):
        lasting = ComponentPersistence(lasting, lasting)
    if not met.both and isinstance(lasting, ComponentPersistence):
        raise ParameterValueError(
            f"the vehicle meets the {met.components[0]} wind alone; give the Persistence of that component"
        )
    return DayOfLaunch(flight, found, lasting, float(error), threshold, chosen, draws, seed, met)


def _flight(case: Case, loads: LimitedLoads, window: tuple[float, float]) -> Flight:
    field = wind_field(case, float(Climb.of(case).altitude(window[1])))

    def made() -> tuple[LevelWeights, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        chain = window_chain(case, window, STEPS)
        row, _, mean = loads.over(chain)
        covariance = symmetric(row @ chain.covariance() @ row.swapaxes(1, 2))
        if Flight.holds_close_times(loads):
            fine = Flight.kept_weights(case, loads, window, field, 1)
            weights = replace(
                fine, times=chain.times, weight=fine.weight[::FINER].copy(), rest=fine.rest[::FINER],
                altitude=fine.altitude[::FINER],
            )  # fmt: skip
        else:
            weights = row_weights(case, loads, chain, field.levels)
        return weights, weights.weight @ field.waves, mean, covariance

    weights, by_wave, mean, covariance = case.kept(("day of launch", loads.rows, window), made)
    return Flight(case, loads, case, field, weights, by_wave, mean, covariance, window)


def _balloons(flight: Flight, given: Sequence[tuple[Balloon, float]], met: MetWinds, error: float) -> Balloons:
    levels, parts, names, flown = flight.field.levels, [], [], []
    for balloon, before in given:
        if isinstance(before, bool) or not isinstance(before, int | float) or not 0 <= before < np.inf:
            raise ParameterValueError(f"a sounding {before!r} h before launch; give hours of 0 or more")
        sounding = _one(balloon)
        h = sounding.altitude
        inside = np.flatnonzero((h >= levels[0]) & (h <= levels[-1]))
        if not inside.size:
            span = f"{h[0]:g} to {h[-1]:g} m" if h.size else "no level"
            raise SoundingError(
                f"holds {span}, and the flight goes from {levels[0]:.0f} to {levels[-1]:.0f} m; give one that is there",
                file=sounding.file or None, sounding=sounding.name,
            )  # fmt: skip
        kept = [inside[0]]
        for k in inside[1:]:
            if h[k] - h[kept[-1]] >= NEAREST:
                kept.append(k)
        h = h[kept]
        for number, (name, whole) in enumerate(zip(met.components, met.of(sounding), strict=True)):
            wind = whole[kept]
            mean, std = flight.field.mean_at(h, number), flight.field.std_at(h, number)
            far = np.abs(wind - mean) / np.hypot(std, error)
            if far.max() > FARTHEST:
                k = int(far.argmax())
                which = f"{name} wind" if met.both else "wind"
                raise SoundingError(
                    f"{wind[k]:.3g} m/s {'' if met.both else 'across the flight '}is {far[k]:.1f} standard deviations "
                    f"from the mean of the vehicle's {which}, {mean[k]:.3g} m/s: is it in knots, or of another season "
                    "or place?", file=sounding.file or None, sounding=sounding.name, altitude=float(h[k]),
                )  # fmt: skip
            parts.append((h, wind, np.full(h.size, number), np.full(h.size, float(before))))
        names.append(f"{sounding.name}, {before:g} h before")
        flown.append((sounding, float(before)))
    _refuse_unlike(flown)
    columns = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Balloons(*columns, names=tuple(names), flown=tuple(flown))


def _refuse_unlike(flown: Sequence[tuple[Sounding, float]]) -> None:
    """Raise for balloons of two stations, or whose dates are not as far apart as their hours before launch."""
    for number, (sounding, before) in enumerate(flown):
        for other, other_before in flown[:number]:
            file, name = sounding.file or None, sounding.name
            if sounding.station and other.station and sounding.station != other.station:
                raise SoundingError(
                    f"is of station '{sounding.station}', and {other.name} of '{other.station}'; take balloons of one "
                    "station", file=file, sounding=name,
                )  # fmt: skip
            if sounding.time is None or other.time is None or not (sounding.hours_stated and other.hours_stated):
                continue
            later = (sounding.time - other.time).total_seconds() / 3600.0
            if abs(later - (other_before - before)) > CLOCK:
                raise SoundingError(
                    f"is dated {later:+g} h from {other.name}, and {before:g} and {other_before:g} h before launch "
                    f"make that {other_before - before:+g} h; correct the hours before launch, or take the right file",
                    file=file, sounding=name,
                )  # fmt: skip


def _one(balloon: Balloon) -> Sounding:
    """Return the one sounding of what a person gives."""
    if isinstance(balloon, Sounding):
        return balloon
    if isinstance(balloon, Soundings):
        if len(balloon.u) != 1:
            raise SoundingError(f"{balloon.source} hold {len(balloon.u)} soundings; give the one before launch")
        seen = np.isfinite(balloon.u[0])
        time = None if np.isnat(balloon.time[0]) else balloon.time[0].item()
        return Sounding(
            balloon.names[0], balloon.station, time, balloon.altitude[seen], balloon.u[0, seen], balloon.v[0, seen],
            hours_stated=balloon.hours_stated,
        )  # fmt: skip
    found, _ = read_profiles(balloon)
    if len(found) != 1:
        raise SoundingError(
            f"holds {len(found)} soundings, {found[0].name} to {found[-1].name}; give the one before launch, such as "
            "read_profiles(file)[0][-1]", file=balloon,
        )  # fmt: skip
    return found[0]
