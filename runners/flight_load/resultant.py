"""The largest resultant of two planes over a window of flight, with its probability.

As for one response (:mod:`sampling`), by importance sampling, but beyond a circle: half-planes whose lines enclose a
circle are the places of the mixture. A time and a direction are drawn by their probability of being beyond the line,
the component along that direction from its law beyond it, the paths of both planes given that component; a draw weighs
the sum of all probabilities over the number of lines that it is beyond at any time, and counts with the probability
that its path passes the true circle, which the lines enclose, between points too: by a Brownian bridge along the
radius, of the diffusion that white noise has along it. Unbiased for any number of directions. Only the part of the
window where the circle is not passed too rarely is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri_exp

from ...model.errors import ParameterValueError, PlanesError, UnknownNameError
from ...model.vehicle.planes import PLANES
from ..case.case import Case
from ..case.provenance import provenance
from ..solvers.markov_chain import MarkovChain
from ..statistics.norm import NormOfNormal
from ..statistics.percentiles import checked_probabilities
from ..statistics.resultants import resultant_pairs
from .probability import CONFIDENCE, ORDER, interval_of, root_between
from .request import NoVarianceError, checked_draws, checked_level
from .window import checked_window, window_chain

Array = NDArray[np.float64]

COARSE = 0.5  # s, between the times at which it is seen where the window is worth drawing
FINE = 0.03  # s, between the points drawn
MOST_POINTS = 800
LEFT_OUT = 2e-3  # of the probability, at most, that is passed only where no path is drawn
DIRECTIONS = 24
SEVERAL = 3.0  # standard deviations of a bridge's middle that the circle is drawn in by
JITTER = 1e-12
SOLVED = 1e-7  # relative, to which a level is solved for


@dataclass(frozen=True, eq=False)
class PairProcess:
    """Two responses over times as one Gaussian process.

    Attributes
    ----------
    times : (m,) array
        s.
    mean : (m, 2) array
    covariance : (m, 2, m, 2) array
    diffusion : (m, 2, 2) array
        Of both by white noise directly: C B B' C', unit^2 / s.
    """

    times: Array
    mean: Array
    covariance: Array
    diffusion: Array

    @staticmethod
    def of(chain: MarkovChain, rows: list[int]) -> PairProcess:
        """Return the process of two outputs of a chain."""
        P, C = chain.covariance(), chain.output[:, rows]
        m, n = len(C), C.shape[2]
        columns, R = np.zeros((n, 2 * m)), np.zeros((2 * m, 2 * m))
        for k in range(m):
            if k:
                columns[:, : 2 * k] = chain.transition[k - 1] @ columns[:, : 2 * k]
            columns[:, 2 * k : 2 * k + 2] = P[k] @ C[k].T
            R[2 * k : 2 * k + 2, : 2 * k + 2] = C[k] @ columns[:, : 2 * k + 2]
            R[: 2 * k + 2, 2 * k : 2 * k + 2] = R[2 * k : 2 * k + 2, : 2 * k + 2].T
        direct = C @ chain.noise_matrix
        return PairProcess(chain.times, chain.mean[:, rows], R.reshape(m, 2, m, 2), direct @ direct.swapaxes(1, 2))

    @cached_property
    def instants(self) -> NormOfNormal:
        """The law of the norm at every time."""
        m = self.times.size
        return NormOfNormal(self.mean, self.covariance[np.arange(m), :, np.arange(m)])

    @cached_property
    def factor(self) -> Array:
        """A root L of the covariance, L L' = R, (2 m, 2 m)."""
        size = self.mean.size
        R = self.covariance.reshape(size, size)
        std = np.sqrt(np.maximum(np.diagonal(R), 0.0))
        unit = np.where(std > 0, std, 1.0)
        correlation = R / np.outer(unit, unit) + JITTER * np.eye(size)
        try:
            return np.asarray(std[:, None] * np.linalg.cholesky(correlation), float)
        except np.linalg.LinAlgError:
            values, vectors = np.linalg.eigh(correlation)
            return std[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


@dataclass(frozen=True, eq=False)
class SeldomSeen:
    """Two responses at times far apart in a window.

    Attributes
    ----------
    case : Case
    rows : list of int
        Of both responses.
    times : (k,) array
        s.
    law : NormOfNormal
        Of the norm at these.
    """

    case: Case
    rows: list[int]
    times: Array
    law: NormOfNormal

    @staticmethod
    def of(case: Case, rows: list[int], window: tuple[float, float]) -> SeldomSeen:
        """Return them over a window."""
        chain = window_chain(case, window, max(2, int(np.ceil((window[1] - window[0]) / COARSE))))
        C = chain.output[:, rows]
        return SeldomSeen(
            case, rows, chain.times, NormOfNormal(chain.mean[:, rows], C @ chain.covariance() @ C.swapaxes(1, 2))
        )

    def process(self, level: Array) -> PairProcess:
        """Return the process at times close together where a level (k,) is not passed too rarely to matter."""
        beyond = self.law.exceedance(level)
        kept = np.flatnonzero(beyond >= LEFT_OUT * beyond.max() / level.size)
        first, last = max(int(kept[0]) - 1, 0), min(int(kept[-1]) + 1, level.size - 1)
        part = float(self.times[first]), float(self.times[last])
        steps = 2 * int(np.clip(np.ceil((part[1] - part[0]) / FINE / 2), 4, MOST_POINTS // 2))
        return PairProcess.of(window_chain(self.case, part, steps), self.rows)


@dataclass(frozen=True, eq=False)
class _Draws:
    """Paths (count, m, 2) drawn beyond circles of one factor times a radius (m,), with their weights (count,)."""

    paths: Array
    weight: Array
    radius: Array
    process: PairProcess

    @cached_property
    def _size(self) -> Array:
        return np.linalg.norm(self.paths, axis=2)

    @cached_property
    def _bridge(self) -> Array:
        """Variance along the radius of what lies between neighbours, times their distance in time: (count, m - 1)."""
        return self._variance(1)

    def _variance(self, every: int) -> Array:
        at = self.paths[:, ::every]
        middle = at[:, 1:] + at[:, :-1]
        length = np.maximum(np.linalg.norm(middle, axis=2, keepdims=True), 1e-300)
        e = middle / length
        D = self.process.diffusion[::every]
        return np.einsum("cki,kij,ckj->ck", e, 0.5 * (D[1:] + D[:-1]), e, optimize=True) * np.diff(
            self.process.times[::every]
        )

    def contributions(self, level: float, every: int = 1) -> Array:
        """Return what each draw adds to the probability of passing a level, (count,)."""
        gap = level * self.radius[::every] - self._size[:, ::every]
        variance = self._bridge if every == 1 else self._variance(every)
        with np.errstate(divide="ignore", invalid="ignore"):
            chance = np.exp(np.minimum(-2.0 * gap[:, 1:] * gap[:, :-1] / variance, 0.0))
        stays = np.prod(np.where(variance > 0, 1.0 - chance, 1.0), axis=1)
        return self.weight * np.where((gap < 0).any(axis=1), 1.0, 1.0 - stays)


@dataclass(frozen=True)
class ResultantEstimate:
    """The probability that a flight's largest resultant passes a level.

    Attributes
    ----------
    value, standard_error : float
        From the number of draws.
    spacing_error : float
        Relative; what the grid of times still misses, estimated from half as many points.
    largest_instant : float
        Of a single time: a lower bound.
    """

    value: float
    standard_error: float
    spacing_error: float
    largest_instant: float

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the sampling."""
        return interval_of(self.value, self.standard_error)


@dataclass(frozen=True, eq=False, repr=False)
class ResultantLoad:
    """The largest resultant over a window of flight, jointly over both planes.

    Attributes
    ----------
    case : Case
    resultant, unit : str
    window : (float, float)
        s.
    probabilities : tuple of float
        For which levels were asked.
    draws, seed : int
        Paths drawn, and the seed of the draws.
    seldom : SeldomSeen
        Both planes at times far apart, by which the part of the window is chosen that is worth drawing.
    """

    case: Case
    resultant: str
    unit: str
    window: tuple[float, float]
    probabilities: tuple[float, ...]
    draws: int
    seed: int
    seldom: SeldomSeen

    @cached_property
    def level(self) -> xr.DataArray:
        """The level that the flight's largest resultant passes with each probability, (probability,)."""
        return self._array([level for level, _ in self._levels], "level that the flight's largest resultant passes")

    @cached_property
    def interval(self) -> xr.DataArray:
        """95 % interval of the level by the sampling, (probability, bound)."""
        found = self._array([interval for _, interval in self._levels], "95 % interval by the sampling", ("bound",))
        return found.assign_coords(bound=["lower", "upper"])

    @cached_property
    def instant_level(self) -> xr.DataArray:
        """The level that the worst single instant passes with each probability, (probability,)."""
        values = [float(self._by_instant(p).max()) for p in self.probabilities]
        return self._array(values, "level that the worst instant passes")

    def probability(self, level: float) -> ResultantEstimate:
        """Return the probability that the flight's largest resultant passes a level.

        Parameters
        ----------
        level : float
            In the unit of the responses.

        Returns
        -------
        ResultantEstimate

        Raises
        ------
        ParameterValueError
            The level is no finite number.
        """
        return self._passing(checked_level(level), lambda t: np.ones(t.size))

    def passing(self, times: Iterable[float], limit: Iterable[float]) -> ResultantEstimate:
        """Return the probability that the resultant passes a limit that varies over time.

        Parameters
        ----------
        times, limit : iterables of float
            s, increasing, and positive in the unit of the responses; straight lines between them, held beyond.

        Returns
        -------
        ResultantEstimate

        Raises
        ------
        ParameterValueError
            Numbers that are not finite or positive, or not as many of one as of the other.
        """
        t, values = (np.asarray(list(x), float) for x in (times, limit))
        if t.shape != values.shape or t.size < 1 or not (np.diff(t) > 0).all():
            raise ParameterValueError("a limit over time needs as many values as times, and times that increase")
        if not (np.isfinite(values).all() and (values > 0).all()):
            raise ParameterValueError("a limit of a resultant is a positive, finite number at every time")
        return self._passing(1.0, lambda at: np.interp(at, t, values))

    def _passing(self, level: float, shape: Callable[[Array], Array]) -> ResultantEstimate:
        if level <= 0:
            return ResultantEstimate(1.0, 0.0, 0.0, 1.0)
        process = self.seldom.process(level * shape(self.seldom.times))
        radius = shape(process.times)
        draws = self._draw(process, level, radius, 1)
        each, coarser = draws.contributions(level), draws.contributions(level, 2)
        value = float(each.mean())
        instants = process.instants.exceedance(level * radius)
        left = abs(float((each - coarser).mean())) / value / (2**ORDER - 1) if value > 0 else 0.0
        error = float(each.std(ddof=1) / np.sqrt(each.size))
        return ResultantEstimate(min(value, 1.0), error, left, float(instants.max()))

    @cached_property
    def _levels(self) -> list[tuple[float, tuple[float, float]]]:
        return [self._find(p) for p in self.probabilities]

    def _by_instant(self, probability: float) -> Array:
        """Return the level that each time far apart passes with a probability."""
        return self.seldom.law.percentile(probability)

    def _find(self, probability: float) -> tuple[float, tuple[float, float]]:
        """Return the level of a probability and its interval: paths are drawn beyond what one instant passes."""
        start = float(self._by_instant(probability).max())  # flights pass it more often than that
        process = self.seldom.process(np.full(self.seldom.times.size, start))
        draws = self._draw(process, start, np.ones(process.times.size), 0)
        low = high = start
        while draws.contributions(high).mean() > probability:
            low, high = high, 1.05 * high
        if high > low:
            high = root_between(lambda u: draws.contributions(u).mean() / probability - 1.0, low, high, SOLVED * high)
        each = draws.contributions(high)
        nearby = 1.01 * high
        slope = np.log(max(each.mean(), 1e-300) / max(draws.contributions(nearby).mean(), 1e-300)) / (nearby - high)
        relative = float(each.std(ddof=1) / np.sqrt(each.size) / max(each.mean(), 1e-300))
        half = CONFIDENCE * relative / slope if slope > 0 else 0.0
        return high, (high - half, high + half)

    def _draw(self, process: PairProcess, level: float, radius: Array, what: int) -> _Draws:
        """Draw paths beyond circles of a level times a radius (m,), drawn in by what lies between points."""
        random, count = np.random.default_rng([self.seed, what]), self.draws
        dt = np.gradient(process.times)
        wide = np.sqrt(np.linalg.eigvalsh(process.diffusion)[:, 1] * dt / 4.0)
        inner = np.maximum(level * radius - SEVERAL * wide, 0.0) * np.cos(np.pi / DIRECTIONS)
        angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        e = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        m = process.times.size
        own = process.covariance[np.arange(m), :, np.arange(m)]
        std = np.sqrt(np.maximum(np.einsum("ki,mij,kj->mk", e, own, e), 0.0))
        mean = process.mean @ e.T
        beyond = mean - inner[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            chance = np.where(std > 0, ndtr(beyond / std), (beyond > 0).astype(float))
        total = float(chance.sum())
        deviations = (random.standard_normal((count, 2 * m)) @ process.factor.T).reshape(count, m, 2)
        if not total > 0:
            return _Draws(process.mean + deviations, np.zeros(count), radius, process)
        cumulative = np.cumsum(chance.ravel())
        spread = (np.arange(count) + random.random(count)) / count * cumulative[-1]
        chosen = np.minimum(np.searchsorted(cumulative, spread, side="right"), cumulative.size - 1)
        point, direction = np.unravel_index(chosen, chance.shape)
        tail = np.log(np.maximum(chance[point, direction], 1e-300)) + np.log1p(-random.random(count))
        wanted = -ndtri_exp(tail) * std[point, direction]
        along = np.einsum("ci,ci->c", deviations[np.arange(count), point], e[direction])
        variance = std[point, direction] ** 2
        gain = np.divide(wanted - along, variance, out=np.zeros(count), where=variance > 0)
        # cov(everything, e . M_j), a row of the covariance for each of the two
        row = process.covariance.reshape(m, 2, 2 * m)[point]
        weights = gain[:, None] * e[direction]
        deviations += np.einsum("ci,cik->ck", weights, row).reshape(count, m, 2)
        paths = process.mean + deviations
        number = np.zeros(count)
        for k in range(DIRECTIONS):
            number += (paths @ e[k] > inner).sum(axis=1)
        return _Draws(paths, total / np.maximum(number, 1.0), radius, process)

    def to_dataset(self) -> xr.Dataset:
        """Return levels, intervals and levels of the worst instant over probability.

        Returns
        -------
        xarray.Dataset
        """
        parts = {
            "flight_level": self.level,
            "flight_level_interval": self.interval,
            "instant_level": self.instant_level,
        }
        return xr.Dataset(parts).assign_attrs(
            provenance(self.case)
            | {"response": self.resultant, "unit": self.unit, "window_s": list(self.window)}
            | {"draws": self.draws, "seed": self.seed}
        )

    def __repr__(self) -> str:
        lines = [f"ResultantLoad of {self.resultant} [{self.unit}], {self.window[0]:g} to {self.window[1]:g} s"]
        for p, (level, (low, high)) in zip(self.probabilities, self._levels, strict=True):
            lines.append(f"passed with {p:g}: {level:.5g} ({low:.5g} to {high:.5g})")
        return "\n  ".join(lines)

    def _array(self, values: Iterable[object], name: str, more: tuple[str, ...] = ()) -> xr.DataArray:
        coords = {"probability": ("probability", np.array(self.probabilities), {"units": "1"})}
        attributes = {"units": self.unit, "long_name": name}
        return xr.DataArray(np.array(list(values)), coords, ("probability", *more), attrs=attributes)


def resultant_load(
    case: Case,
    resultant: str,
    window: tuple[float, float] | None,
    probabilities: float | Iterable[float],
    draws: int,
    seed: int,
) -> ResultantLoad:
    """See :meth:`Study.resultant_load`."""
    pairs = resultant_pairs(case.system.output_names)
    if not pairs:
        raise PlanesError.of_one("a resultant's load", case.system.name)
    if resultant not in pairs:
        raise UnknownNameError("resultant", resultant, pairs)
    checked_draws(draws, seed)
    asked, flown = checked_probabilities(probabilities), checked_window(case, window)
    names = case.checked_responses(pairs[resultant])
    rows = [case.system.output_index(name) for name in names]
    units = [case.system.outputs[row].unit for row in rows]
    if units[0] != units[1]:
        raise ParameterValueError(f"'{names[0]}' is in {units[0]} and '{names[1]}' in {units[1]}: they have no norm")
    seldom = SeldomSeen.of(case, rows, flown)
    if not float(seldom.law.covariance.max()) > 0:
        raise NoVarianceError(f"no noise reaches '{resultant}' in {' or '.join(PLANES)} within the window")
    return ResultantLoad(case, resultant, units[0], flown, asked, draws, seed, seldom)
