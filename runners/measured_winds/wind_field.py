"""The random wind over altitude as independent waves, each of which persists in time by itself.

On an even grid of altitudes the vehicle's wind has the covariance R; with B its symmetric root and C the discrete
cosine transform, w = mean + B C' x with x of independent standard values, x_k of the vertical wavelength 2 N dh / k.
Winds of two times have cov = B C' diag(rho_k) C B, which goes with R for any |rho_k| <= 1; where the wind is even over
altitude, x_k is its own wave of that length. One rho for all waves is the separable form rho R. Of both components w is
one after the other and C transforms each: x are waves of either, which B joins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.optimize import least_squares, root_scalar

from ...model.errors import ParameterValueError
from ...model.wind.soundings.collection import Soundings
from ...model.wind.soundings.sounding import SoundingError
from ..case.case import Case
from ..case.climb import Climb
from .persistence import (
    ASSUMED,
    DAY,
    EXPONENTS,
    LONG_WAVELENGTH,
    MEASURED,
    MEASURED_LEVELS,
    SCALE_EXPONENT,
    ComponentPersistence,
    Persistence,
)
from .random_wind import RandomWind, random_wind

SPACING = 25.0  # m
MOST = 1400  # levels
LONGEST_HOURS = 1e5
LEAST_PAIRS = 20
ROUNDS, SETTLED = 20, 1e-8  # of fitting each component while the other is held

Lasting = Persistence | ComponentPersistence
Whole = Callable[[Persistence], Lasting]


@dataclass(frozen=True, eq=False)
class WindField:
    """The wind as waves.

    Attributes
    ----------
    wind : RandomWind
        At an even grid of levels.
    """

    wind: RandomWind

    @property
    def levels(self) -> NDArray[np.float64]:
        """Of the grid, (N,), m."""
        return self.wind.levels

    @property
    def components(self) -> int:
        """How many components of the wind it holds."""
        return self.wind.mean.size // self.levels.size

    @cached_property
    def wavelengths(self) -> NDArray[np.float64]:
        """Of the waves, (c, N), m; the first is infinite."""
        h = self.levels
        with np.errstate(divide="ignore"):
            return np.tile(2 * h.size * (h[1] - h[0]) / np.arange(h.size), (self.components, 1))

    @cached_property
    def waves(self) -> NDArray[np.float64]:
        """B C': the wind at each level by each wave, (c N, c N), m/s."""
        values, vectors = np.linalg.eigh(self.wind.covariance)
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        n = self.levels.size
        return np.asarray(dct(root.reshape(len(root), -1, n), axis=2, norm="ortho")).reshape(root.shape)

    def kept(self, persistence: Lasting, hours: float) -> NDArray[np.float64]:
        """Return the correlation of each wave with itself some hours later, (c N,)."""
        return persistence.correlation(self.wavelengths, hours).ravel()

    def rows(self, altitudes: NDArray[np.float64], component: int = 0) -> NDArray[np.float64]:
        """Return one component of the wind at altitudes within the grid by each wave, (k, c N), straight in between."""
        h = self.levels
        at = np.clip(np.searchsorted(h, altitudes, side="right") - 1, 0, h.size - 2)
        share = ((altitudes - h[at]) / (h[at + 1] - h[at]))[:, None]
        at = at + component * h.size
        return (1 - share) * self.waves[at] + share * self.waves[at + 1]

    def mean_at(self, altitudes: NDArray[np.float64], component: int = 0) -> NDArray[np.float64]:
        """Return the mean of one component at altitudes (m) within the grid, (k,), m/s."""
        return np.interp(altitudes, self.levels, self.wind.mean.reshape(self.components, -1)[component])

    def std_at(self, altitudes: NDArray[np.float64], component: int = 0) -> NDArray[np.float64]:
        """Return the standard deviation of one component at altitudes (m) within the grid, (k,), m/s."""
        return np.interp(altitudes, self.levels, self.wind.std.reshape(self.components, -1)[component])

    def correlation_in_time(
        self, persistence: Lasting, altitudes: NDArray[np.float64], hours: float, component: int = 0
    ) -> NDArray[np.float64]:
        """Return the correlation of one component at altitudes (m) with itself some hours later, (k,)."""
        rows = self.rows(altitudes, component)
        return (rows**2 @ self.kept(persistence, hours)) / (rows**2).sum(axis=1)


def wind_field(case: Case, last: float) -> WindField:
    """Return the wind of a case as waves, from the start of the flight to an altitude ``last`` (m), kept with it.

    Raises
    ------
    NoVehicleError
    """
    first = float(Climb.of(case).altitudes[0])
    shaping_filter = case.vehicle_for("a random wind").wind.shaping_filter
    bottom = max(first, float(shaping_filter.altitude[0]))
    top = min(max(last, bottom + 10 * SPACING), max(float(shaping_filter.altitude[-1]), bottom + 10 * SPACING))
    count = min(MOST, int(np.ceil((top - bottom) / SPACING)) + 1)
    levels = np.linspace(bottom, top, count)
    return case.kept(("wind field", tuple(levels.tolist())), lambda: WindField(random_wind(case, levels)))


def default_persistence(field: WindField, components: Sequence[str], exponent: float = EXPONENTS[0]) -> Lasting:
    """Return the persistence whose correlation after 24 h is, in the mean over four levels, that measured at the Cape.

    Parameters
    ----------
    field : WindField
    components : sequence of {'zonal', 'meridional'}
        Of the field, in its order.
    exponent : float
        Of growth with lag.

    Raises
    ------
    ParameterValueError
    """
    inside = [k for k, h in enumerate(MEASURED_LEVELS) if field.levels[0] <= h <= field.levels[-1]]
    if not inside:
        raise ParameterValueError(
            "the flight meets none of the levels at which persistence was measured (1.5 to 10.7 km); give persistence="
        )
    levels, source = np.array(MEASURED_LEVELS)[inside], ASSUMED.format(exponent=exponent, wavelength=LONG_WAVELENGTH)

    def fit(number: int, whole: Whole) -> Persistence:
        wanted = float(np.array(MEASURED[components[number]])[inside].mean())
        return _fitted(lambda p: float(field.correlation_in_time(whole(p), levels, DAY, number).mean()), wanted, DAY,
                       exponent, source)  # fmt: skip

    return _of_each(len(components), fit)


def measured_persistence(field: WindField, soundings: Soundings, components: Sequence[str]) -> Lasting:
    """Return the persistence of one's own soundings, from all pairs of one lag or of several.

    Parameters
    ----------
    field : WindField
    soundings : Soundings
        With dates and hours.
    components : sequence of {'zonal', 'meridional'}
        Of the field, in its order.

    Returns
    -------
    Persistence or ComponentPersistence
        Of one lag with the exponent 2/3, which is assumed then; of two and more the exponent is fitted too.

    Raises
    ------
    SoundingError
        Fewer than 20 pairs of any lag, or no level within the flight.
    ParameterValueError
        Correlations that no persistence has.
    """
    h = soundings.altitude
    inside = np.flatnonzero((h >= field.levels[0]) & (h <= field.levels[-1]))
    levels = h[inside]

    def fit(number: int, whole: Whole) -> Persistence:
        values = soundings.component(components[number])[:, inside]
        lags, found = _correlations(values - np.nanmean(values, axis=0), soundings.day) if inside.size else ([], [])
        if not len(lags):
            raise SoundingError(
                f"{soundings.source}: no lag has {LEAST_PAIRS} pairs of soundings at levels of the flight; give more, "
                "with hours in their dates"
            )
        pairs = ", ".join(f"{lag:g}" for lag in lags)
        told = f"{soundings.source}, pairs {pairs} h apart; shorter lags and waves are assumed"

        def correlation(tried: Persistence, lag: float) -> float:
            return float(field.correlation_in_time(whole(tried), levels, lag, number).mean())

        if len(lags) == 1:
            wanted = float(found[0].mean())
            return _fitted(lambda tried: correlation(tried, lags[0]), wanted, lags[0], EXPONENTS[0], told)

        def off(x: NDArray[np.float64]) -> NDArray[np.float64]:
            tried = Persistence(float(np.exp(x[0])), float(x[1]), source=told)
            return np.array([correlation(tried, lag) - r.mean() for lag, r in zip(lags, found, strict=True)])

        start, bounds = [np.log(2 * lags[-1]), EXPONENTS[0]], ([np.log(1e-3), 0.05], [np.log(1e5), 2.0])
        best = least_squares(off, start, bounds=bounds)
        return Persistence(float(np.exp(best.x[0])), float(best.x[1]), source=told)

    return _of_each(len(components), fit)


def _of_each(components: int, fit: Callable[[int, Whole], Persistence]) -> Lasting:
    """Return the persistence of each component, fitted while the other's is held, in turns until both stay.

    ``fit`` is given the number of a component and what makes the whole persistence of that component's.
    """
    if components == 1:
        return fit(0, lambda tried: tried)
    zonal, meridional = (fit(number, lambda tried: ComponentPersistence(tried, tried)) for number in range(2))
    for _ in range(ROUNDS):
        before = zonal, meridional
        zonal = fit(0, lambda tried, other=meridional: ComponentPersistence(tried, other))
        meridional = fit(1, lambda tried, other=zonal: ComponentPersistence(other, tried))
        moved = (abs(now.hours / old.hours - 1) for now, old in zip((zonal, meridional), before, strict=True))
        if max(moved) < SETTLED:
            break
    return ComponentPersistence(zonal, meridional)


def _fitted(
    correlation: Callable[[Persistence], float], wanted: float, hours: float, exponent: float, source: str
) -> Persistence:
    """Return the persistence with a wanted correlation after a lag (h).

    Raises
    ------
    ParameterValueError
        One that is not between 0 and 1.
    """
    if not 0 < wanted < 1:
        raise ParameterValueError(
            f"winds {hours:g} h apart have a correlation of {wanted:.3g}; persistence is fitted to one between 0 and 1"
        )

    def of(log_hours: float) -> Persistence:
        return Persistence(float(np.exp(log_hours)), exponent, LONG_WAVELENGTH, SCALE_EXPONENT, source)

    def off(log_hours: float) -> float:
        return correlation(of(log_hours)) - wanted

    low, high = np.log(1e-3), np.log(LONGEST_HOURS)
    if off(high) < 0:
        raise ParameterValueError(
            f"a correlation of {wanted:.6g} after {hours:g} h is more than any persistence has; give another"
        )
    return of(float(root_scalar(off, bracket=(low, high), method="brentq", xtol=1e-10).root))


def _correlations(values: NDArray, day: NDArray) -> tuple[list[float], list[NDArray[np.float64]]]:
    """Return the lags (h, whole) with enough pairs, and the correlation of each level at each."""
    order = np.argsort(day, kind="stable")
    order = order[np.isfinite(day[order])]
    d, x = np.round(24 * day[order]), values[order]
    lags, found = [], []
    for lag in range(1, 49):
        later = np.searchsorted(d, d + lag)
        pairs = np.flatnonzero((later < d.size) & (d[np.minimum(later, d.size - 1)] == d + lag))
        a, b = x[pairs], x[later[pairs]]
        good = np.isfinite(a) & np.isfinite(b)
        if not good.size or good.sum(axis=0).min() < LEAST_PAIRS:
            continue
        a, b = np.where(good, a, 0.0), np.where(good, b, 0.0)
        lags.append(float(lag))
        found.append((a * b).sum(axis=0) / np.sqrt((a**2).sum(axis=0) * (b**2).sum(axis=0)))
    return lags, found
