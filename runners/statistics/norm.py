"""The norm of two correlated normal responses with means: probabilities, percentiles, direction, derivatives.

The norm of a normal vector M with mean m and covariance S is not normal; Rayleigh, Rice, Hoyt and the folded normal are
its special cases. In principal axes, a the mean there and s1 >= s2 the standard deviations,

    P(|M| > R) = P(|M_1| > R) + integral of phi((x - a1) / s1) / s1 [Q((y - a2) / s2) + Q((y + a2) / s2)] dx

over |x| < R with y = sqrt(R^2 - x^2) and Q = 1 - Phi: every term is positive, so that tails keep their digits. In an
angle, x = R cos and y = R sin, the integrand is smooth; pieces end where either normal density has its width, so that
no ratio s2 / s1 is too small. The density of the direction where |M| = R is that of M on this circle, and with E the
mean over it (the divergence theorem and the heat equation of the normal density),

    dR/dm = E[e],    dR/dS = E[S^-1 (R e - m) e'] / 2 symmetrised,    at a fixed probability.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...model.errors import ParameterValueError

Array = NDArray[np.float64]

LIKE_3_SIGMA = 0.0013498980316300933  # 1 - Phi(3): beside the mean + 3 sigma of one response
_WIDTHS = np.array([-8.5, -5.0, -2.5, 0.0, 2.5, 5.0, 8.5])  # standard deviations at which pieces of the circle end
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(14)
_SMALLEST = 1e-11  # of the size: least standard deviation that is told from none
_SMALLEST_DIFFERENTIATED = 1e-4  # the same where a derivative by the covariance is asked for; its error is the square
_MOST_ROUNDS = 200
_LAST_STEP = 1e-13  # of a level, of Newton's method
_ROUNDING = 1e-9  # of the largest eigenvalue: how far below zero rounding may take the smallest


@dataclass(frozen=True, eq=False)
class NormOfNormal:
    """The norm of pairs of normal responses, such as bending moments in two planes.

    Parameters
    ----------
    mean : (..., 2) array
        In the unit of both responses.
    covariance : (..., 2, 2) array
        In its square.

    Raises
    ------
    ParameterValueError
        Shapes that are none of pairs, numbers that are not finite, a covariance that is not symmetric or not positive
        semidefinite.
    """

    mean: Array
    covariance: Array

    def __post_init__(self):
        mean, covariance = np.asarray(self.mean, float), np.asarray(self.covariance, float)
        if mean.shape[-1:] != (2,) or covariance.shape != (*mean.shape, 2):
            raise ParameterValueError(
                f"a norm of two responses needs a mean (..., 2) and a covariance (..., 2, 2); they have the shapes "
                f"{mean.shape} and {covariance.shape}"
            )
        if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
            raise ParameterValueError("mean or covariance of two responses holds a number that is not finite")
        largest = np.abs(covariance).max(axis=(-2, -1), initial=0.0)
        if (np.abs(covariance[..., 0, 1] - covariance[..., 1, 0]) > _ROUNDING * largest).any():
            raise ParameterValueError("a covariance of two responses is not symmetric")
        if (np.linalg.eigvalsh(covariance)[..., 0] < -_ROUNDING * largest).any():
            raise ParameterValueError(
                "a covariance of two responses is not positive semidefinite: their correlation is beyond 1 in size"
            )
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", covariance)

    @cached_property
    def _scale(self) -> Array:
        """Root mean square of the norm; 1 where it is zero."""
        size = np.sqrt(np.trace(self.covariance, axis1=-2, axis2=-1) + (self.mean**2).sum(axis=-1))
        return np.where(size > 0, size, 1.0)

    @cached_property
    def _axes(self) -> Array:
        """Principal axes as columns (..., 2, 2), that of the larger standard deviation first."""
        return np.linalg.eigh(self.covariance)[1][..., ::-1]

    @cached_property
    def _turned_mean(self) -> Array:
        """Mean in principal axes over the size, (..., 2)."""
        return np.einsum("...ij,...i->...j", self._axes, self.mean) / self._scale[..., None]

    def _sigmas(self, smallest: float) -> Array:
        """Standard deviations in principal axes over the size, larger first, (..., 2)."""
        values = np.linalg.eigvalsh(self.covariance)[..., ::-1] / self._scale[..., None] ** 2
        return np.sqrt(np.maximum(values, smallest**2))

    def rms(self) -> Array:
        """Return the root of E|M|^2 = tr S + |m|^2, (...)."""
        return np.sqrt(np.trace(self.covariance, axis1=-2, axis2=-1) + (self.mean**2).sum(axis=-1))

    def ellipse(self) -> tuple[Array, Array, Array]:
        """Return the ellipse of one sigma: both standard deviations along its axes, and the larger one's direction.

        Returns
        -------
        major, minor : (...) arrays
            In the unit of the responses.
        axis : (...) array
            rad from the first response towards the second, above -pi / 2 and up to pi / 2.
        """
        values = np.sqrt(np.maximum(np.linalg.eigvalsh(self.covariance), 0.0))
        angle = np.arctan2(self._axes[..., 1, 0], self._axes[..., 0, 0])
        return values[..., 1], values[..., 0], -((-angle + np.pi / 2) % np.pi - np.pi / 2)

    def exceedance(self, level: ArrayLike) -> Array:
        """Return P(|M| > level), (...); small ones keep their digits.

        Parameters
        ----------
        level : (...) array
            In the unit of the responses, not negative.

        Returns
        -------
        (...) array
        """
        level = np.broadcast_to(np.asarray(level, float), self.mean.shape[:-1])
        circle = _Circle.of(level / self._scale, self._turned_mean, self._sigmas(_SMALLEST))
        return np.where(level < 0, 1.0, circle.beyond())

    def density(self, level: ArrayLike) -> Array:
        """Return the probability density of the norm at a level.

        Parameters
        ----------
        level : (...) array

        Returns
        -------
        (...) array
            In one over the unit of the responses.
        """
        level = np.broadcast_to(np.asarray(level, float), self.mean.shape[:-1])
        circle = _Circle.of(level / self._scale, self._turned_mean, self._sigmas(_SMALLEST))
        return np.where(level < 0, 0.0, circle.mean_of(np.ones_like(circle.x))) / self._scale

    def percentile(self, exceedance: float = LIKE_3_SIGMA) -> Array:
        """Return the level that the norm exceeds with a probability, (...).

        Parameters
        ----------
        exceedance : float
            A probability between 0 and 1; by default 1 - Phi(3), that of mean + 3 sigma of one normal response.

        Returns
        -------
        (...) array
            In the unit of the responses.

        Raises
        ------
        ParameterValueError
        """
        if not 0.0 < exceedance < 1.0:
            raise ParameterValueError(f"a probability of {exceedance:g} has no level; give one between 0 and 1")
        a, s = self._turned_mean, self._sigmas(_SMALLEST)
        level = _solved(np.log(exceedance), a, s)
        varies = np.trace(self.covariance, axis1=-2, axis2=-1) > 0
        return np.where(varies, level, np.sqrt((a**2).sum(axis=-1))) * np.where(self.rms() > 0, self._scale, 0.0)

    def direction(self, level: ArrayLike) -> Direction:
        """Return how the direction of M is distributed where its norm is a level.

        Parameters
        ----------
        level : (...) array
            In the unit of the responses.

        Returns
        -------
        Direction
        """
        level = np.broadcast_to(np.asarray(level, float), self.mean.shape[:-1])
        circle = _Circle.of(level / self._scale, self._turned_mean, self._sigmas(_SMALLEST))
        mean = np.stack([circle.average(circle.x), circle.average(circle.y)], axis=-1) / _safe(circle.level)[..., None]
        mean = np.einsum("...ij,...j->...i", self._axes, mean)
        length = np.sqrt((mean**2).sum(axis=-1))
        likely = np.einsum("...ij,...j->...i", self._axes, circle.most_likely())
        likely *= np.where((self.mean**2).sum(axis=-1) > 0, 1.0, np.where(likely[..., 0] < 0, -1.0, 1.0))[..., None]
        return Direction(
            np.arctan2(likely[..., 1], likely[..., 0]),
            np.arctan2(mean[..., 1], mean[..., 0]),
            np.sqrt(-2.0 * np.log(np.clip(length, 1e-300, 1.0))),
        )

    def derivatives(self, exceedance: float = LIKE_3_SIGMA) -> tuple[Array, Array]:
        """Return the derivatives of a percentile by mean and covariance.

        Parameters
        ----------
        exceedance : float
            A probability between 0 and 1.

        Returns
        -------
        by_mean : (..., 2) array
        by_covariance : (..., 2, 2) array
            Symmetric G: the percentile changes by the sum of G_ij dS_ij. In one over the unit of the responses.

        Raises
        ------
        ParameterValueError
        """
        level = self.percentile(exceedance) / self._scale
        circle = _Circle.of(level, self._turned_mean, self._sigmas(_SMALLEST))
        by_mean = np.stack([circle.average(circle.x), circle.average(circle.y)], axis=-1) / _safe(level)[..., None]
        sigmas = self._sigmas(_SMALLEST_DIFFERENTIATED)
        circle = _Circle.of(_solved(np.log(exceedance), self._turned_mean, sigmas), self._turned_mean, sigmas)
        forces = [
            (z - self._turned_mean[..., k, None]) / sigmas[..., k, None] ** 2
            for k, z in enumerate((circle.x, circle.y))
        ]
        half = 0.5 / _safe(circle.level)
        by = np.empty((*level.shape, 2, 2))
        by[..., 0, 0] = half * circle.average(forces[0] * circle.x)
        by[..., 1, 1] = half * circle.average(forces[1] * circle.y)
        mixed = 0.5 * half * (circle.average(forces[0] * circle.y) + circle.average(forces[1] * circle.x))
        by[..., 0, 1] = by[..., 1, 0] = mixed
        by_mean = np.einsum("...ij,...j->...i", self._axes, by_mean)
        by = np.einsum("...ij,...jk,...lk->...il", self._axes, by, self._axes) / self._scale[..., None, None]
        return by_mean, by


@dataclass(frozen=True, eq=False)
class Direction:
    """How a direction is distributed on the circle of a norm; angles from the first response towards the second.

    Attributes
    ----------
    most_likely : (...) array
        rad; of two that are equally likely, as with zero mean, the one whose first component is not negative.
    circular_mean : (...) array
        rad; tells little where the spread is large.
    circular_std : (...) array
        rad; sqrt(-2 ln |E e|), infinite for a direction without preference.
    """

    most_likely: Array
    circular_mean: Array
    circular_std: Array


@dataclass(frozen=True, eq=False)
class _Circle:
    """Points of the circle |z| = level in principal axes, with weights, all over the size of the norm."""

    level: Array
    a: Array
    s: Array
    angle: Array  # from y = 0, a quarter of the circle
    step: Array  # weights of the angle
    x: Array  # (..., 4 n): the quarter and its mirror images
    y: Array

    @classmethod
    def of(cls, level: Array, a: Array, s: Array) -> _Circle:
        level = np.maximum(level, 0.0)
        safe = _safe(level)[..., None]
        ends = [np.zeros((*level.shape, 1)), np.full((*level.shape, 1), np.pi / 2)]
        for sign in (-1.0, 1.0):
            at_y = (sign * a[..., 1:] + _WIDTHS * s[..., 1:]) / safe
            at_x = (sign * a[..., :1] + _WIDTHS * s[..., :1]) / safe
            ends += [np.arcsin(np.clip(at_y, 0.0, 1.0)), np.arccos(np.clip(at_x, 0.0, 1.0))]
        edges = np.sort(np.concatenate(ends, axis=-1), axis=-1)
        half = 0.5 * np.diff(edges, axis=-1)[..., None]
        angle = (edges[..., :-1, None] + half * (1.0 + _NODES)).reshape(*level.shape, -1)
        step = (half * _WEIGHTS).reshape(*level.shape, -1)
        x, y = level[..., None] * np.cos(angle), level[..., None] * np.sin(angle)
        return cls(
            level, a, s, angle, step, np.concatenate([x, -x, x, -x], axis=-1), np.concatenate([y, y, -y, -y], axis=-1)
        )

    def beyond(self) -> Array:
        """P(|M| > level)."""
        n = self.angle.shape[-1]
        x, y = self.x[..., : 2 * n], self.y[..., : 2 * n]
        (a1, a2), (s1, s2) = (np.moveaxis(v[..., None], -2, 0) for v in (self.a, self.s))
        beside = scipy.special.ndtr((a2 - y) / s2) + scipy.special.ndtr((-a2 - y) / s2)
        step = np.concatenate([self.step, self.step], axis=-1) * y  # |dx| = R sin d(angle)
        inside = (_density((x - a1) / s1) / s1 * beside * step).sum(axis=-1)
        level = self.level
        outside = scipy.special.ndtr((a1[..., 0] - level) / s1[..., 0]) + scipy.special.ndtr(
            (-a1[..., 0] - level) / s1[..., 0]
        )
        return np.minimum(outside + inside, 1.0)

    def mean_of(self, values: Array) -> Array:
        """Return the integral of values times the density of M over the circle, its length element included."""
        (a1, a2), (s1, s2) = (np.moveaxis(v[..., None], -2, 0) for v in (self.a, self.s))
        density = _density((self.x - a1) / s1) * _density((self.y - a2) / s2) / (s1 * s2)
        return self.level * (values * density * np.concatenate([self.step] * 4, axis=-1)).sum(axis=-1)

    def average(self, values: Array) -> Array:
        """Return the mean of values over the direction's distribution on the circle."""
        weight = np.exp(-0.5 * (self._distance() - self._distance().min(axis=-1, keepdims=True)))
        weight = weight * np.concatenate([self.step] * 4, axis=-1)
        return (values * weight).sum(axis=-1) / weight.sum(axis=-1)

    def _distance(self) -> Array:
        """Square of the distance from the mean, in standard deviations."""
        (a1, a2), (s1, s2) = (np.moveaxis(v[..., None], -2, 0) for v in (self.a, self.s))
        return ((self.x - a1) / s1) ** 2 + ((self.y - a2) / s2) ** 2

    def most_likely(self) -> Array:
        """Return the unit vector of the likeliest point: of those looked at the best, then made exact by halving."""
        distance = self._distance()
        best = np.argmin(distance, axis=-1)[..., None]
        x, y = (np.take_along_axis(z, best, -1)[..., 0] for z in (self.x, self.y))
        at = np.arctan2(y, x)
        angles = np.sort(np.arctan2(self.y, self.x), axis=-1)
        wide = np.diff(angles, axis=-1).max(axis=-1, initial=1e-3)
        low, high = at - wide, at + wide
        (a1, a2), (s1, s2) = (np.moveaxis(v, -1, 0) for v in (self.a, self.s))
        for _ in range(60):
            middle = 0.5 * (low + high)
            c, s = np.cos(middle), np.sin(middle)
            slope = -(self.level * c - a1) / s1**2 * s + (self.level * s - a2) / s2**2 * c
            low, high = np.where(slope < 0, middle, low), np.where(slope < 0, high, middle)
        return np.stack([np.cos(low), np.sin(low)], axis=-1)


def _solved(target: float, a: Array, s: Array) -> Array:
    """Return the level, over the size, whose exceedance has the logarithm ``target``: Newton's method in brackets."""
    shape, a, s = a.shape[:-1], a.reshape(-1, 2), s.reshape(-1, 2)
    length, rare = np.sqrt((a**2).sum(axis=-1)), target < np.log(0.5)
    low = np.zeros(length.size)
    high = length + s[:, 0] * (np.sqrt(-2.0 * target) + 1.0)  # P(|M| > |a| + k s1) <= exp(-k^2 / 2), Rayleigh's law
    k = float(-scipy.special.ndtri_exp(target)) if rare else 1.0
    level = np.clip(np.sqrt(length**2 + 2.0 * k * np.abs(a * s).sum(axis=-1) + (k * s[:, 0]) ** 2), low, high)
    left = np.arange(length.size)
    for _ in range(_MOST_ROUNDS):
        circle = _Circle.of(level[left], a[left], s[left])
        beyond, density = circle.beyond(), circle.mean_of(np.ones_like(circle.x))
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.log(beyond) - target if rare else beyond - np.exp(target)
            step = off * (beyond if rare else 1.0) / density
        now = level[left]
        low[left] = np.where(off > 0, now, low[left])
        high[left] = np.where(off <= 0, now, high[left])
        following = now + step
        outside = ~((following > low[left]) & (following < high[left]))
        done = (np.abs(step) <= _LAST_STEP * now) | (high[left] - low[left] <= _LAST_STEP * high[left])
        level[left] = np.where(outside, np.where(done, now, 0.5 * (low[left] + high[left])), following)
        left = left[~done]
        if not left.size:
            break
    return level.reshape(shape)


def _safe(level: Array) -> Array:
    return np.where(level > 0, level, 1.0)


def _density(z: Array) -> Array:
    return np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
