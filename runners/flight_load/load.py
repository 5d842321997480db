"""The load of a whole flight: the largest value of a response or resultant in a window, with its probability."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtri_exp

from ...model.errors import ParameterValueError
from ..case.case import Case
from ..case.provenance import provenance, wind_samples
from ..present.notebook import html_of
from ..present.progress import steps
from ..statistics.percentiles import (
    Sides,
    checked_probabilities,
    checked_sides,
    monte_carlo_runs,
)
from ..statistics.resultants import response_or_resultant
from ..statistics.sampling_interval import checked_samples
from .crossings import Boundary
from .limit_table import LimitError, Limits, limits_over_time
from .norms import Norms, Process
from .passage import LimitedLoad, Passage
from .pathwise import Movement, Reaching, movement, reaching
from .probability import Estimate, Level, estimate, find_level
from .process import ManyOutputs
from .request import SpacingWarning, checked_draws, checked_level, refuse_without_variance
from .response import HALVINGS, STEPS, ResponseInWindow, squared_diffusion
from .sampling import draw_beyond, instant_levels, sighted_steps, steps_near
from .sensitivity import level_sensitivity
from .uncertain_parameter import checked_spread, processes_of, uncertain_level
from .upcrossings import upcrossing_rate
from .wind_interval import wind_interval_of
from .window import MOST_STEPS, checked_window

SPACING_ERROR = 0.02  # relative, of a probability; finer where it is larger
FREEDOM = 0.03  # of a variance
MOVED = 8000  # draws of paths that just reach a level, of which derivatives are made
BINS = 60  # of the time of the maximum
SIDES = "upper", "lower"
SIZES = {"both": np.abs, "upper": np.asarray, "lower": np.negative}  # what of a response is large
WIND_SIGMA = "wind.sigma_scale"
RUNS = "simulated flights without a failure that would say as much, at a consumer's risk of 10 %"


@dataclass(frozen=True, eq=False, repr=False)
class FlightLoad:
    """The largest value of a response, or of the resultant of two planes, over a window of flight.

    Attributes
    ----------
    of : ResponseInWindow
        The case, the response or resultant and the window.
    probabilities : tuple of float
        For which levels were asked.
    sides : {'both', 'upper', 'lower'}
        Whether the maximum is of the size of the response, of the response, or of its negative; a resultant is a size.
    draws, seed : int
        Paths drawn, and the seed of the draws.
    limits : Limits or None
        What the response may not pass over time.
    """

    of: ResponseInWindow
    probabilities: tuple[float, ...]
    sides: Sides
    draws: int
    seed: int
    limits: Limits | None = None

    @property
    def response(self) -> str:
        """Its name."""
        return self.of.response

    @property
    def unit(self) -> str:
        """Unit of the response."""
        return self.of.unit

    @property
    def window(self) -> tuple[float, float]:
        """Begin and end, s."""
        return self.of.window

    @cached_property
    def process(self) -> Process:
        """The response as a Gaussian process over the window, or the norm of two."""
        return replace(self.of, steps=min(self.of.steps, MOST_STEPS)).process()

    @cached_property
    def parts(self) -> tuple[ResponseInWindow, ...]:
        """Where flights pass the level of each probability, which is mostly a part of the window."""
        return tuple(self.of.near(p, self.sides) for p in self.probabilities)

    @cached_property
    def processes(self) -> tuple[Process, ...]:
        """The response as a process there, one a probability."""
        made = {(part.window, part.steps): part for part in self.parts}
        processes = {place: part.process() for place, part in made.items()}
        return tuple(processes[part.window, part.steps] for part in self.parts)

    def _process_for(self, value: float) -> Process:
        """Return the response over the smallest part of the window outside which a level is not passed."""
        lower = [k for k, level in enumerate(self.levels) if level.value <= value]
        return self.processes[max(lower, key=lambda k: self.levels[k].value)] if lower else self.process

    def _boundary(self, value: float) -> Boundary:
        return Boundary.constant(value, self.process.seen, self.sides)

    def _random(self, *what: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *what])

    @cached_property
    def levels(self) -> tuple[Level, ...]:
        """What is found for every probability: level, interval, estimate, paths."""
        with steps(f"level of {self.response}", len(self.probabilities)) as line:
            found = []
            for process, p in zip(self.processes, self.probabilities, strict=True):
                found.append(self._level(process, p, self.draws))
                line.done()
        return tuple(found)

    def _level(self, process: Process, probability: float, draws: int) -> Level:
        size = float((np.abs(process.drawn.mean) + process.std).max())

        def boundary(value: float) -> Boundary:
            return Boundary.constant(value, process.seen, self.sides)

        return find_level(process, probability, boundary, size, self._random(0), draws)

    @cached_property
    def level(self) -> xr.DataArray:
        """The level that the flight's maximum passes with each probability, (probability,)."""
        return self._array([found.value for found in self.levels], "level that the flight's maximum passes")

    @cached_property
    def instant_level(self) -> xr.DataArray:
        """The level that the worst single instant passes with each probability, (probability,); the lower one."""
        pairs = zip(self.processes, self.probabilities, strict=True)
        values = [float(instant_levels(process, p, self.sides).max()) for process, p in pairs]
        return self._array(values, "level that the worst instant passes")

    @cached_property
    def interval(self) -> xr.DataArray:
        """95 % interval of the level by its own sampling, (probability, bound)."""
        return self._array([found.interval for found in self.levels], "95 % interval by the sampling", ("bound",))

    @cached_property
    def side_shares(self) -> xr.DataArray:
        """How the flights that pass each level fall on the two sides, (probability, side); they add up to one.

        NaN for a resultant, which has no sides.
        """
        found = np.array([level.draws.places(level.boundary).sum(axis=(0, 1)) for level in self.levels])
        name = "share of the passing flights"
        if self.of.is_resultant:
            found = np.full(found.shape, np.nan)
        whole = self._array(found / found.sum(axis=1, keepdims=True), name, ("side",), "1")
        return whole.assign_coords(side=list(SIDES))

    @property
    def side(self) -> list[str]:
        """The side on which flights pass each level more often, 'upper' or 'lower', '' where none."""
        if self.of.is_resultant:
            return [""] * len(self.probabilities)
        return [SIDES[k] for k in self.side_shares.values.argmax(axis=1)]

    @property
    def wind_samples(self) -> float | None:
        """Independent soundings behind the wind's statistics; None where its record does not say."""
        return wind_samples(self.of.case)

    def wind_interval(self, samples: float | None = None, confidence: float = 0.95) -> xr.DataArray:
        """Return the interval of each level by the sampling error of the wind's statistics, (probability, bound).

        Mean and spread of the wind's part, at the times and on the sides where flights pass the level and in their
        shares, are those of N independent normal profiles; the level is the mean there and k sigma.
        Errors at those times are taken as one, which is on the safe side, and the level moves as its envelope of
        instants does; other sources' sigmas are taken as known, although noises that multiply the mean move with it.
        Without other sources the interval is that of the noncentral t distribution, with them by the delta method
        (:func:`level_sampling_interval`).

        Parameters
        ----------
        samples : float, optional
            N; that of the wind's record without it.
        confidence : float
            Share of such intervals that hold the true level.

        Returns
        -------
        xarray.DataArray
            In the unit of the response.

        Raises
        ------
        ParameterValueError
            N is not known, or not above one; a confidence that is none.
        UnknownNameError
            There is no source 'wind'.

        Notes
        -----
        Nothing else is in it: not the filter's error, nor that of reconstructed correlations between altitudes, nor the
        model's, nor the sampling of the paths (``interval``).
        """
        number = checked_samples(samples, self.wind_samples)
        found = [
            wind_interval_of(self.parts[k], level, lambda k=k: self._reaching(k, 7, self.draws), number, confidence)
            for k, level in enumerate(self.levels)
        ]
        name = f"{100 * confidence:g} % interval by {number:g} independent soundings of the wind"
        return self._array(found, name, ("bound",)).assign_attrs(independent_samples=number, confidence=confidence)

    @steps("levels with an uncertain parameter")
    def level_with_uncertain(self, parameter: str = WIND_SIGMA, spread: float | None = None) -> xr.DataArray:
        """Return the levels of flights of which a parameter is uncertain, a constant of each, (probability,).

        The wind's sigma is known from N soundings only, to 1 / sqrt(2 (N - 1)) of itself, besides what its filter is
        off: the load of a flight that is drawn with its own sigma has a longer tail than any of one sigma.

        Parameters
        ----------
        parameter : str
            One of the case.
        spread : float, optional
            Relative standard deviation of its normal law; that of the wind's sigma by the soundings of the wind's
            record without it.

        Returns
        -------
        xarray.DataArray
            In the unit of the response; attributes ``parameter``, ``spread`` and ``standard_error``, by the sampling.

        Raises
        ------
        UnknownNameError
            There is no such parameter.
        ParameterValueError
            No spread is given or known, it is none, or the parameter is 0.
        """
        if spread is None:
            if parameter != WIND_SIGMA:
                raise ParameterValueError(
                    f"the spread of '{parameter}' is not known; give a relative one, such as 0.05"
                )
            spread = float(1 / np.sqrt(2 * (checked_samples(None, self.wind_samples) - 1)))
        asked = checked_spread(spread)
        draws, found, made = max(200, self.draws // 4), [], {}
        for k, (p, level, part) in enumerate(zip(self.probabilities, self.levels, self.parts, strict=True)):
            place = part.window, part.steps
            made[place] = made.get(place) or processes_of(part, parameter, asked)
            found.append(uncertain_level(made[place], level, p, self.sides, self._random(6, k), draws))
        name = f"level that flights pass with {parameter} uncertain by {100 * asked:.3g} %"
        return self._array([value for value, _ in found], name).assign_attrs(
            parameter=parameter, spread=asked, standard_error=[error for _, error in found]
        )

    def monte_carlo_runs(self, probability: float | None = None, risk: float = 0.10, failures: int = 0) -> int:
        """Return the number of simulated flights that would say as much of a level.

        With at most ``failures`` of so many flights beyond the level, its being passed more often than the probability
        is accepted wrongly with a consumer's risk of ``risk``: order statistics (:func:`monte_carlo_runs`).

        Parameters
        ----------
        probability : float, optional
            A probability asked for; the first without it.
        risk : float
            Probability of accepting the level wrongly.
        failures : int

        Returns
        -------
        int

        Raises
        ------
        ParameterValueError
        """
        return monte_carlo_runs(self.probabilities[self.number_of(probability)], risk, failures)

    @property
    def spacing_error(self) -> xr.DataArray:
        """What the grid of times still misses of each probability, relative, (probability,)."""
        errors = [found.probability.spacing_error for found in self.levels]
        return self._array(errors, "relative error of the probability by the grid of times", unit="1")

    @property
    def spacing_missed(self) -> float:
        """The largest of these errors without what may be the draws' own noise."""
        found = [level.probability for level in self.levels]
        return max(each.spacing_error - each.spacing_noise for each in found)

    @property
    def freedom(self) -> float:
        """By how much of a variance paths are drawn too freely between points where flights pass a level, at most.

        That of a fast oscillation on a grid that is coarse against its period; its crests then are too many.
        """
        found = []
        for process, level in zip(self.processes, self.levels, strict=True):
            where = level.draws.places(level.boundary).sum(axis=(1, 2))
            found.append(float(where @ process.freedom) / max(float(where.sum()), np.finfo(float).tiny))
        return max(found)

    @property
    def is_fast(self) -> bool:
        """Whether the response moves too much within a step drawn.

        Paths are drawn too freely between points, or so few of those that come near a level reach it that the interval
        of a probability begins at zero.
        """
        return self.freedom > FREEDOM or any(level.probability.interval[0] == 0 for level in self.levels)

    @property
    def is_coarse(self) -> bool:
        """Whether the grid of times is too coarse for the levels."""
        return self.spacing_missed > SPACING_ERROR or self.is_fast

    @steps("chance of passing a level")
    def probability(self, value: float) -> Estimate:
        """Return the probability that the flight's maximum passes a value.

        Parameters
        ----------
        value : float
            In the unit of the response.

        Returns
        -------
        Estimate
            With its standard error, and bounds that cost nothing.

        Raises
        ------
        ParameterValueError
            The value is no finite number.
        """
        level = checked_level(value)
        process = self._process_for(level)
        boundary = Boundary.constant(level, process.seen, self.sides)
        return estimate(draw_beyond(process, boundary, self._random(1), self.draws), boundary)

    def upcrossing_rate(self, level: float) -> xr.DataArray:
        """Return Rice's rate at which a level is passed outward, (time,), of a response that is differentiable.

        Parameters
        ----------
        level : float
            In the unit of the response.

        Returns
        -------
        xarray.DataArray
            s^-1. Attributes: ``start_probability`` of being beyond it at the begin of the window, and
            ``probability_bound``, that and the integral of the rate: flights pass the level no more often.

        Raises
        ------
        ParameterValueError
            The level is no finite number.
            Or the response is a resultant.
        NotDifferentiableError
            White noise reaches the rate of the response, whose variance is infinite.
        """
        return upcrossing_rate(self.of, checked_level(level), self.sides)

    def number_of(self, probability: float | None) -> int:
        """Return the number of a probability among those asked for.

        Parameters
        ----------
        probability : float or None
            A probability; the first for None.

        Returns
        -------
        int

        Raises
        ------
        ParameterValueError
        """
        if probability is None:
            return 0
        if probability not in self.probabilities:
            known = ", ".join(f"{p:g}" for p in self.probabilities)
            raise ParameterValueError(f"no level was asked for with probability {probability:g}; known: {known}")
        return self.probabilities.index(probability)

    @cached_property
    def passage(self) -> Passage:
        """Whether a flight keeps the limit of the response, at the first of the probabilities.

        Raises a LimitError where no limit was given.
        """
        if self.limits is None:
            raise LimitError(f"no limit of '{self.response}' was given; ask with limit=...")
        limit, own = self.limits.of(self.response, self.unit, self.process.seen.times), self.probabilities[0]
        loads = (LimitedLoad(self.response, self.unit, resultant=self.of.is_resultant),)
        return Passage(self.of.case, loads, self.process, limit, self.sides, own, self.draws, self.seed)

    @cached_property
    @steps("chances of passing levels")
    def exceedance(self) -> xr.DataArray:
        """Probability of passing each level from about 0.5 down to 1e-7, (level,), with ``standard_error``."""
        begin, end = (self._instant_level(np.log(p)) for p in (0.5, 1e-8))
        values, found, errors = np.linspace(begin, end, 36), [], []
        count = self.draws // (2 if self.of.is_resultant else 4)  # those of circles weigh less alike
        for number, group in enumerate(np.split(values, 12)):
            process = self._process_for(group[0])
            boundaries = [Boundary.constant(value, process.seen, self.sides) for value in group]
            draws = draw_beyond(process, boundaries[0], self._random(2, number), count)
            for boundary in boundaries:
                each = draws.contributions(boundary)
                found.append(min(float(each.mean()), 1.0))
                errors.append(float(each.std(ddof=1) / np.sqrt(each.size)))
        level = ("level", values, {"units": self.unit, "long_name": "level"})
        error = ("level", np.array(errors), {"units": "1", "long_name": "standard error of the sampling"})
        what = {"units": "1", "long_name": "probability that the flight's maximum passes the level"}
        return xr.DataArray(
            np.minimum.accumulate(found), {"level": level, "standard_error": error}, ("level",), "exceedance", what
        )

    def _instant_level(self, log_probability: float) -> float:
        """Return the level that the worst instant passes with a probability, or a little less."""
        if isinstance(self.process, Norms):
            return float(instant_levels(self.process, float(np.exp(log_probability)), self.sides).max())
        mean, away = self.process.drawn.mean, -ndtri_exp(log_probability) * self.process.std
        sides = {"upper": mean + away, "lower": away - mean}
        return max(float(side.max()) for name, side in sides.items() if self.sides in (name, "both"))

    @cached_property
    @steps("times of the maximum")
    def time_of_maximum(self) -> xr.DataArray:
        """Probability density of the time of the maximum, s^-1, (given, time).

        ``given`` is 'any flight', or the probability of the level that is passed. A bin is a sixtieth of the window.
        """
        edges, times = np.linspace(*self.window, BINS + 1), self.process.seen.times
        random = self._random(3)
        drawn, size = self._drawn(random)
        near = (size > size.max(axis=1, keepdims=True) - 2 * self.process.between).any(axis=2)
        steps, _ = steps_near(self.process, drawn, near, random)
        seen = sighted_steps(self.process, self.draws, steps, self._boundary(-np.inf))
        _, points, *_ = seen.worst(self._boundary(0.0))
        rows = [np.histogram(times[points], edges, density=True)[0]]
        for found in self.levels:
            weight = found.draws.places(found.boundary).sum(axis=(1, 2))
            rows.append(np.histogram(found.draws.process.seen.times, edges, weights=weight, density=True)[0])
        return xr.DataArray(
            np.array(rows),
            {
                "given": ["any flight", *(f"{p:g}" for p in self.probabilities)],
                "time": ("time", 0.5 * (edges[1:] + edges[:-1]), {"units": "s", "long_name": "flight time"}),
            },
            ("given", "time"),
            "time_of_maximum",
            {"units": "s^-1", "long_name": "probability density of the time of the maximum"},
        )

    def _drawn(self, random: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return drawn deviations, and the sizes of what they make, on the grid drawn."""
        process = self.process
        if isinstance(process, Norms):
            drawn = process.of.deviations(random, self.draws)
            return drawn, process.sizes(drawn)
        drawn = process.deviations(random, self.draws)
        return drawn, SIZES[self.sides](process.drawn.mean + drawn)

    def _reaching(self, which: int, stream: int, draws: int) -> Reaching:
        process = self.processes[which]
        assert not isinstance(process, ManyOutputs)
        return reaching(process, self.levels[which], self._random(stream, which), draws)

    def _movement(self, which: int, paths: Reaching) -> Movement:
        part = self.parts[which]
        diffusion = squared_diffusion(part.chain, part.chain.output[:, part.rows])
        return movement(paths, diffusion[:: paths.outputs.stride])

    def movement(self, which: int) -> Movement:
        """Return how a level moves with mean and covariance of the response.

        Parameters
        ----------
        which : int
            Number of its probability.

        Returns
        -------
        Movement
        """
        return self._movement(which, self._reaching(which, 4, MOVED))

    @steps("derivatives of a level")
    def sensitivity(self, probability: float | None = None, parameters: Iterable[str] | None = None) -> xr.Dataset:
        """Return derivatives of a level by parameters.

        Parameters
        ----------
        probability : float, optional
            A probability asked for; the first without it.
        parameters : iterable of str, optional
            The dozen that lead without it.

        Returns
        -------
        xarray.Dataset
            Over (parameter), largest first: ``derivative``, level unit per parameter unit; ``elasticity``;
            ``envelope_elasticity``, what mean and sigma at the times of passing alone would say.

        Raises
        ------
        ParameterValueError, UnknownNameError, StructuralParameterError
        """
        which = self.number_of(probability)
        paths = self._reaching(which, 4, MOVED)
        moved = self._movement(which, paths)
        found = level_sensitivity(self.parts[which], self.levels[which], moved, paths, parameters)
        return found.assign_attrs(probability=self.probabilities[which], sides=self.sides)

    @cached_property
    @steps("shares of the sources")
    def shares(self) -> xr.Dataset:
        """What each source adds, over (probability, source).

        ``share`` of what paths that just reach the level are away from the mean there, adding up to one; fast sources
        have more of it than of the variance. ``level_without`` the level of a flight in which the source is silent.
        """
        system, share, without = self.of.case.system, [], []
        count = len(system.sources)
        for which in range(len(self.probabilities)):
            moved = self._movement(which, self._reaching(which, 5, 2 * self.draws))
            still = np.zeros_like(moved.mean)
            part = np.array([moved.change(still, *self.parts[which].share_of([k])) for k in range(count)])
            share.append(part / part.sum())
        for number in range(count):
            others = [k for k in range(count) if k != number]
            levels = []
            for p in self.probabilities:
                process = self.of.near(p, self.sides, others).process(others)
                varies = float(process.std.max()) > 0
                still = float(SIZES[self.sides](process.seen.mean).max())
                levels.append(self._level(process, p, self.draws // 4).value if varies else still)
            without.append(levels)
        dims, unit = ("probability", "source"), self.unit
        return xr.Dataset(
            {
                "share": (
                    dims,
                    np.array(share),
                    {"units": "1", "long_name": "share of the deviation where the level is reached"},
                ),
                "level_without": (dims, np.array(without).T, {"units": unit, "long_name": "level without the source"}),
            },
            {"probability": np.array(self.probabilities), "source": list(system.sources)},
        )

    def to_dataset(self) -> xr.Dataset:
        """Return everything in one dataset: over probability, along the curve of exceedance, and over time.

        Returns
        -------
        xarray.Dataset
        """
        curve = self.exceedance
        units = {"units": self.unit}
        parts = {
            "flight_level": self.level,
            "flight_level_interval": self.interval,
            "spacing_error": self.spacing_error,
            "instant_level": self.instant_level,
            "side_share": self.side_shares,
            "monte_carlo_runs": self._array(
                [float(self.monte_carlo_runs(p)) for p in self.probabilities], RUNS, (), "1"
            ),
            "exceedance_level": ("point", curve["level"].values, units | {"long_name": "level"}),
            "exceedance": ("point", curve.values, curve.attrs),
            "exceedance_error": ("point", curve["standard_error"].values, curve["standard_error"].attrs),
            "time_of_maximum": self.time_of_maximum,
        }
        if self.wind_samples is not None:
            parts["wind_interval"] = self.wind_interval()
        found = xr.Dataset(parts).merge(self.shares)
        return found.assign_attrs(
            provenance(self.of.case)
            | {"response": self.response, "unit": self.unit, "sides": self.sides, "window_s": list(self.window)}
            | {"draws": self.draws, "seed": self.seed, "steps": self.of.steps}
        )

    def __repr__(self) -> str:
        lines = [
            f"FlightLoad of {self.response} [{self.unit}], {self.window[0]:g} to {self.window[1]:g} s, {self.sides}"
        ]
        for p, found in zip(self.probabilities, self.levels, strict=True):
            low, high = found.interval
            lines.append(f"passed with {p:g}: {found.value:.5g} ({low:.5g} to {high:.5g})")
        return "\n  ".join(lines)

    def _repr_html_(self) -> str:
        return html_of(repr(self))

    def _array(
        self, values: Iterable[object], name: str, more: tuple[str, ...] = (), unit: str | None = None
    ) -> xr.DataArray:
        coords: dict = {"probability": ("probability", np.array(self.probabilities), {"units": "1"})}
        if "bound" in more:
            coords["bound"] = ["lower", "upper"]
        attributes = {"units": unit or self.unit, "long_name": name}
        return xr.DataArray(np.array(list(values)), coords, ("probability", *more), attrs=attributes)


def flight_load(
    case: Case,
    response: str,
    window: tuple[float, float] | None,
    probabilities: float | Iterable[float],
    sides: Sides,
    draws: int,
    seed: int,
    limit: str | Path | Limits | float | None = None,
) -> FlightLoad:
    """See :meth:`Study.flight_load`."""
    name, sided = response_or_resultant(case, response), checked_sides(sides)
    checked_draws(draws, seed)
    asked = checked_probabilities(probabilities)
    flown = checked_window(case, window)
    asked_of = ResponseInWindow(case, name, flown, STEPS)
    unit = asked_of.unit
    limits = None if limit is None else limits_over_time(limit, name, unit, flown)
    if asked_of.is_resultant and sided != "both":
        raise ParameterValueError(f"'{name}' is a resultant, which has no {sided} side; ask with sides='both'")
    load = FlightLoad(asked_of, asked, sided, draws, seed, limits)
    refuse_without_variance(name, load.processes[0])
    while load.is_coarse and max(part.steps for part in load.parts) < MOST_STEPS:
        load = replace(load, of=replace(load.of, steps=2 * load.of.steps))
    if load.is_coarse:
        warnings.warn(SpacingWarning(_coarse_in_words(load)), stacklevel=3)
    return load


def _coarse_in_words(load: FlightLoad) -> str:
    part, reasons = max(load.parts, key=lambda part: part.steps), []
    if load.spacing_missed > SPACING_ERROR:
        reasons.append(f"it misses about {100 * load.spacing_missed:.2g} % of it")
    if load.is_fast:
        step = (part.window[1] - part.window[0]) / part.steps
        error = max(level.probability.standard_error / level.probability.value for level in load.levels)
        reasons.append(
            f"'{load.response}' swings within steps of {2**HALVINGS * step:.2g} s, so that it may be too large, and is "
            f"known to {100 * error:.2g} % only"
        )
    return (
        f"the grid of {part.steps} steps from {part.window[0]:.4g} to {part.window[1]:.4g} s is coarse for the "
        f"probability that '{load.response}' passes its level: "
        f"{', and '.join(reasons)}; ask for a shorter window"
    )
