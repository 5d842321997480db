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
from scipy.stats import norm

from ...model.errors import ParameterValueError
from ...model.wind.soundings.collection import Soundings
from ...model.wind.soundings.read import read_profiles
from ...model.wind.soundings.sounding import Sounding, SoundingError
from ..case.case import Case
from ..case.climb import Climb
from ..case.provenance import provenance
from ..flight_load.limit_table import LimitError, Limits, limit_table
from ..flight_load.load import DESIGN
from ..flight_load.passage import LimitedLoad, Passage
from ..flight_load.process import Grid, JointOutputs, joint_covariance
from ..flight_load.request import checked_draws
from ..flight_load.window import checked_window, window_chain
from ..present.netcdf import RULE
from ..statistics.percentiles import Sides, checked_sides
from .conditioning import Measured
from .level_weights import LevelWeights, level_weights
from .persistence import Persistence
from .profiles import across
from .wind_field import WindField, default_persistence, wind_field

STEPS, FINER = 240, 10  # of the window, and of each for the chance of passing a limit
LEFT_OUT = 2e-3  # of the instants' chances, at either end
FEWEST = 4  # coarse steps looked at
ERROR = 1.0  # m/s in a component, of a balloon's wind
NEAREST = 50.0  # m: levels nearer to the one below are passed over, whose errors are not independent
FARTHEST = 6.0  # standard deviations of a measured wind from the mean of the vehicle's month
THRESHOLD = 0.01
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
        Along +Y, m/s.
    hours : (k,) array
        Before launch.
    names : tuple of str
        Of the balloons.
    """

    altitude: NDArray[np.float64]
    wind: NDArray[np.float64]
    hours: NDArray[np.float64]
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Flight:
    """What a flight has by itself, whatever is measured: kept between updates.

    Attributes
    ----------
    case : Case
    responses : tuple of str
    field : WindField
    weights : LevelWeights
        Of the responses at the field's levels.
    mean : (m, r) array
    std : (m, r) array
        Of all sources.
    window : (float, float)
        s.
    """

    case: Case
    responses: tuple[str, ...]
    field: WindField
    weights: LevelWeights
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    window: tuple[float, float]

    @cached_property
    def by_wave(self) -> NDArray[np.float64]:
        """Responses to each wave of the wind, (m, r, N)."""
        return self.weights.weight @ self.field.waves

    def fine(self, names: tuple[str, ...], first: int, last: int) -> FinePart:
        """Return some responses between two of the coarse times (numbers) on the fine grid."""
        chain = window_chain(self.case, self.window, FINER * STEPS)
        weights = level_weights(self.case, chain.times.tolist(), self.field.levels, names)
        points = slice(FINER * first, FINER * last + 1)
        rows = [self.case.system.output_index(name) for name in names]
        part = chain.part(points)
        row = part.output[:, rows]
        direct = row @ part.noise_matrix
        size = np.sqrt((direct**2).sum(axis=2))
        largest = np.take_along_axis(direct, np.abs(direct).argmax(axis=2)[..., None], axis=2)[..., 0]
        covariance = joint_covariance(part, row)
        diffusion = np.copysign(size, largest)
        return FinePart(part.times, weights.weight[points], part.mean[:, rows], covariance, diffusion)


@dataclass(frozen=True, eq=False)
class FinePart:
    """Responses at close times.

    Attributes
    ----------
    times : (m,) array
        s.
    weight : (m, r, N) array
        Of the wind at the field's levels.
    mean, diffusion : (m, r) arrays
    covariance : (m, r, m, r) array
        Of all sources.
    """

    times: NDArray[np.float64]
    weight: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    diffusion: NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class DayOfLaunch:
    """A flight given the winds measured before it.

    Attributes
    ----------
    flight : Flight
    balloons : Balloons
    persistence : Persistence
    error : float
        Standard deviation of a measured wind's error, m/s, independent from level to level.
    limits : Limits or None
    threshold : float
        Probability of passing a limit above which it is no-go.
    sides : {'both', 'upper', 'lower'}
    draws, seed : int
    component : str
        Across the flight.
    sign : {1, -1}
    """

    flight: Flight
    balloons: Balloons
    persistence: Persistence
    error: float
    limits: Limits | None
    threshold: float
    sides: Sides
    draws: int
    seed: int
    component: str
    sign: int

    @property
    def times(self) -> NDArray[np.float64]:
        """s, (m,)."""
        return self.flight.weights.times

    @property
    def responses(self) -> tuple[str, ...]:
        """Names, r of them."""
        return self.flight.responses

    @cached_property
    def _rows(self) -> NDArray[np.float64]:
        return self.flight.field.rows(self.balloons.altitude)

    @cached_property
    def _seen_now(self) -> NDArray[np.float64]:
        """Measurements by each wave at launch, (k, N): faded by their lag."""
        waves, hours = self.flight.field.wavelengths, self.balloons.hours
        rho = {h: self.persistence.correlation(waves, h) for h in np.unique(hours).tolist()}
        return self._rows * np.array([rho[h] for h in hours.tolist()])

    @cached_property
    def measured(self) -> Measured:
        """The covariance K of all measurements."""
        hours, waves = self.balloons.hours, self.flight.field.wavelengths
        K = np.zeros((hours.size, hours.size))
        times = np.unique(hours).tolist()
        for a in times:
            for b in times:
                i, j = hours == a, hours == b
                rho = self.persistence.correlation(waves, abs(a - b))
                K[np.ix_(i, j)] = (self._rows[i] * rho) @ self._rows[j].T
        return Measured(K + self.error**2 * np.eye(hours.size))

    @cached_property
    def _deviation(self) -> NDArray[np.float64]:
        """What was measured less the mean wind there, whitened, (k,)."""
        mean = np.interp(self.balloons.altitude, self.flight.field.levels, self.flight.field.wind.mean)
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
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of the responses given the measurements, all sources, (m, r)."""
        taken = (self._gain**2).sum(axis=0).reshape(self.flight.mean.shape)
        return np.sqrt(np.maximum(self.flight.std**2 - taken, 0.0))

    @cached_property
    def wind(self) -> xr.Dataset:
        """The wind at launch over (altitude): ``mean``, ``std`` given the measurements, ``climatology`` and its std."""
        field = self.flight.field
        gain = self.measured.whitened(self._seen_now @ field.waves.T)
        mean = field.wind.mean + self._deviation @ gain
        std = np.sqrt(np.maximum(field.wind.std**2 - (gain**2).sum(axis=0), 0.0))
        speed = {"units": "m/s"}
        return xr.Dataset(
            {
                "mean": ("altitude", mean, speed | {"long_name": "wind expected at launch"}),
                "std": ("altitude", std, speed | {"long_name": "its standard deviation"}),
                "climatology": ("altitude", field.wind.mean, speed | {"long_name": "mean wind of the season"}),
                "climatological_std": ("altitude", field.wind.std, speed | {"long_name": "its standard deviation"}),
            },
            {"altitude": ("altitude", field.levels, {"units": "m", "long_name": "altitude"})},
        )

    def limit(self) -> NDArray[np.float64]:
        """Return the limits of the responses that have one, NaN elsewhere, (m, r)."""
        found = np.full(self.mean.shape, np.nan)
        for r, name in enumerate(self.responses):
            if self.limits is not None and name in self.limits.values:
                found[:, r] = self.limits.of(name, self._unit(name), self.times)[:, 0]
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
    def probability(self) -> float:
        """That any limit is passed during the flight, given the measurements."""
        return self.passage.probability.value

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
        new = _balloons(self.flight, [(sounding, hours_before)], self.component, self.sign, self.error)
        both = (self.balloons, new)
        parts = [np.concatenate([getattr(b, name) for b in both]) for name in ("altitude", "wind", "hours")]
        return replace(self, balloons=Balloons(*parts, names=self.balloons.names + new.names))

    def with_persistence(self, persistence: Persistence) -> DayOfLaunch:
        """Return the same with another persistence.

        Parameters
        ----------
        persistence : Persistence

        Returns
        -------
        DayOfLaunch
        """
        return replace(self, persistence=persistence)

    def to_dataset(self) -> xr.Dataset:
        """Return means, deviations, limits and margins over (time, response).

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
                "unit": ("response", [self._unit(name) for name in self.responses]),
            },
            provenance(self.flight.case)
            | {
                "balloons": "; ".join(self.balloons.names),
                "persistence": self.persistence.source,
                "persistence_hours": self.persistence.hours,
                "persistence_exponent": self.persistence.exponent,
                "error_m_s": self.error,
                "condition_of_measurements": self.measured.condition,
            },
        )
        found["margin_in_sigmas"] = (dims, self.margin_in_sigmas(), {"units": "1", "long_name": "margin to the limit"})
        return found

    def __repr__(self) -> str:
        told = f"DayOfLaunch given {' and '.join(self.balloons.names)}: {', '.join(self.responses)}"
        return told if self.limits is None else f"{told}\n  {'go' if self.go else 'no-go'}: {self.probability:.3g}"

    def _unit(self, name: str) -> str:
        system = self.flight.case.system
        return system.outputs[system.output_index(name)].unit

    def _passage(self, given: bool) -> Passage:
        """Return the passage given the measurements, or of the season, on the fine grid where it is worth while."""
        limit = self.limit()
        at = np.flatnonzero(np.isfinite(limit).all(axis=0))
        if not at.size or self.limits is None:
            raise LimitError("there is no limit of the responses; give limits= to ask for a probability")
        flight, names = self.flight, [self.responses[r] for r in at]
        mean, std = (self.mean, self.std) if given else (flight.mean, flight.std)
        begin, end = worth_while(mean[:, at], std[:, at], limit[:, at], self.sides)
        fine = flight.fine(tuple(names), begin, end)
        level_mean, covariance = fine.mean, fine.covariance
        if given:
            by_level = flight.field.waves @ self._seen_now.T  # cov(wind at levels, measurements)
            gain = self.measured.whitened(by_level.T @ fine.weight.reshape(-1, fine.weight.shape[2]).T)
            level_mean = level_mean + (self._deviation @ gain).reshape(level_mean.shape)
            covariance = covariance - (gain.T @ gain).reshape(covariance.shape)
        variance = np.maximum(np.einsum("mrmr->mr", covariance), 0.0)
        across_step = np.einsum("mrmr->mr", covariance[:-1, :, 1:])
        moved = np.maximum(variance[:-1] + variance[1:] - 2 * across_step, 0.0) / np.diff(fine.times)[:, None]
        left = np.sqrt(np.concatenate([moved, moved[-1:]]))
        diffusion = np.sign(fine.diffusion) * np.minimum(np.abs(fine.diffusion), left)
        loads = [LimitedLoad(name, self._unit(name)) for name in names]
        values = np.stack([self.limits.of(name, self._unit(name), fine.times)[:, 0] for name in names], axis=1)
        process = JointOutputs(Grid(fine.times, level_mean, diffusion), covariance)
        return Passage(flight.case, loads, process, values, self.sides, DESIGN, self.draws, self.seed)


def worth_while(
    mean: NDArray[np.float64], std: NDArray[np.float64], limit: NDArray[np.float64], sides: Sides
) -> tuple[int, int]:
    """Return the first and last of the coarse times outside which limits are passed too rarely to matter."""
    unit = np.where(std > 0, std, np.inf)
    chance = np.zeros(mean.shape)
    if sides != "lower":
        chance += norm.sf((limit - mean) / unit)
    if sides != "upper":
        chance += norm.sf((limit + mean) / unit)
    total = np.cumsum(chance.sum(axis=1))
    if not total[-1] > 0:
        return 0, FEWEST
    first = int(np.searchsorted(total, LEFT_OUT * total[-1])) - 1
    last = int(np.searchsorted(total, (1 - LEFT_OUT) * total[-1])) + 1
    first = min(max(first, 0), mean.shape[0] - 1 - FEWEST)
    return first, min(max(last, first + FEWEST), mean.shape[0] - 1)


def day_of_launch(
    case: Case,
    soundings: Balloon | Sequence[Balloon],
    hours_before: float | Sequence[float],
    limits: str | Path | Limits | None,
    window: tuple[float, float] | None,
    responses: Iterable[str] | None,
    persistence: Persistence | None,
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
    table = None if limits is None else limit_table(limits)
    if table is not None and table.station is not None:
        raise LimitError(
            "is over stations of the structure; on the day of launch limits are of responses over time", file=table.file
        )
    wanted = list(table.values) if responses is None and table is not None else responses
    names, flown = case.checked_responses(wanted), checked_window(case, window)
    if table is not None:
        case.checked_responses(table.values)
        for name in table.values:
            table.of(name, case.system.outputs[case.system.output_index(name)].unit, np.array(flown))
    balloons: list[Balloon] = list(soundings) if isinstance(soundings, list | tuple) else [cast("Balloon", soundings)]
    hours = list(hours_before) if isinstance(hours_before, Sequence) else [hours_before]
    if len(balloons) != len(hours):
        raise ParameterValueError(f"{len(balloons)} soundings and {len(hours)} times before launch; give one each")
    which, direction = across(case, component, sign)
    flight = _flight(case, tuple(names), flown)
    found = _balloons(flight, list(zip(balloons, hours, strict=True)), which, direction, error)
    lasting = persistence
    if lasting is None:
        lasting = case.kept(("persistence", flown, which), lambda: default_persistence(flight.field, which))
    return DayOfLaunch(
        flight, found, lasting, float(error), table, threshold, checked_sides(sides), draws, seed, which, direction
    )


def _flight(case: Case, names: tuple[str, ...], window: tuple[float, float]) -> Flight:
    def made() -> Flight:
        chain = window_chain(case, window, STEPS)
        at = [case.system.output_index(name) for name in names]
        field = wind_field(case, float(Climb.of(case).altitude(window[1])))
        weights = level_weights(case, chain.times.tolist(), field.levels, names)
        row = chain.output[:, at]
        variance = np.einsum("mri,mij,mrj->mr", row, chain.covariance(), row, optimize=True)
        return Flight(case, names, field, weights, chain.mean[:, at], np.sqrt(np.maximum(variance, 0.0)), window)

    return case.kept(("day of launch", names, window), made)


def _balloons(
    flight: Flight, given: Sequence[tuple[Balloon, float]], component: str, sign: int, error: float
) -> Balloons:
    levels, field = flight.field.levels, flight.field
    altitude, wind, hours, names = [], [], [], []
    for balloon, before in given:
        if isinstance(before, bool) or not isinstance(before, int | float) or not 0 <= before < np.inf:
            raise ParameterValueError(f"a sounding {before!r} h before launch; give hours of 0 or more")
        sounding = _one(balloon)
        h, w = sounding.altitude, sign * (sounding.u if component == "zonal" else sounding.v)
        inside = (h >= levels[0]) & (h <= levels[-1])
        if not inside.any():
            span = f"{h[0]:g} to {h[-1]:g} m" if h.size else "no level"
            raise SoundingError(
                f"holds {span}, and the flight goes from {levels[0]:.0f} to {levels[-1]:.0f} m; give one that is there",
                file=sounding.file or None, sounding=sounding.name,
            )  # fmt: skip
        h, w = h[inside], w[inside]
        kept = [0]
        for k in range(1, h.size):
            if h[k] - h[kept[-1]] >= NEAREST:
                kept.append(k)
        h, w = h[kept], w[kept]
        mean, std = np.interp(h, levels, field.wind.mean), np.interp(h, levels, field.wind.std)
        far = np.abs(w - mean) / np.hypot(std, error)
        if far.max() > FARTHEST:
            k = int(far.argmax())
            raise SoundingError(
                f"{w[k]:.3g} m/s across the flight is {far[k]:.1f} standard deviations from the mean of the vehicle's "
                f"wind, {mean[k]:.3g} m/s: is it in knots, or of another season or place?",
                file=sounding.file or None, sounding=sounding.name, altitude=float(h[k]),
            )  # fmt: skip
        altitude.append(h)
        wind.append(w)
        hours.append(np.full(h.size, float(before)))
        names.append(f"{sounding.name}, {before:g} h before")
    return Balloons(np.concatenate(altitude), np.concatenate(wind), np.concatenate(hours), tuple(names))


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
            balloon.names[0], balloon.station, time, balloon.altitude[seen], balloon.u[0, seen], balloon.v[0, seen]
        )
    found, _ = read_profiles(balloon)
    if len(found) != 1:
        raise SoundingError(
            f"holds {len(found)} soundings, {found[0].name} to {found[-1].name}; give the one before launch, such as "
            "read_profiles(file)[0][-1]", file=balloon,
        )  # fmt: skip
    return found[0]


def wind_share(flight: Flight) -> NDArray[np.float64]:
    """Return the share of the random wind in the variance of the responses, (m, r)."""
    by_wind = (flight.by_wave**2).sum(axis=2)
    return np.divide(by_wind, flight.std**2, out=np.zeros_like(by_wind), where=flight.std > 0)
