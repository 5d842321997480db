"""Shaping filters: linear filters over altitude that turn white noise into wind.

    dz/dh = F(h) z + G(h) n,   W = H(h) z          n: white noise of unit intensity in altitude

Every way of making a filter (the closed form here, fits elsewhere) ends in a ``ShapingFilter``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError
from ..tables import Table, TableGroup
from .record import WindOrigin

_SQRT3 = np.sqrt(3.0)


@dataclass(frozen=True, eq=False, repr=False)
class ShapingFilter:
    """A time-varying linear filter over altitude.

    Parameters
    ----------
    name : str
    altitude : (k,) array
        Increasing, m. Coefficients are cubic between the samples, and held beyond the last.
    F : (k, n, n) array
        1/m.
    G : (k, n, m) array
        1/sqrt(m) times the unit of the state.
    H : (k, n) array
        m/s by unit of the state.
    start_covariance : (n, n) array
        Covariance of z at ``altitude[0]``; with it the wind has its full variance from the first instant.
    kinks : sequence of float
        Altitudes at which a coefficient has a corner; must be samples.
    source : str
        Where the filter comes from.
    origin : WindOrigin, optional
        The statistics that it was fitted to.

    Raises
    ------
    DataError
        Shapes that disagree, values that are not finite, a start covariance that is not one.
    """

    name: str
    altitude: NDArray[np.float64]
    F: NDArray[np.float64]
    G: NDArray[np.float64]
    H: NDArray[np.float64]
    start_covariance: NDArray[np.float64]
    kinks: tuple[float, ...] = ()
    source: str = ""
    origin: WindOrigin | None = None

    def __repr__(self) -> str:
        states, noises = self.G.shape[1:]
        span = f"{self.altitude[0]:g} to {self.altitude[-1]:g} m"
        return f"ShapingFilter '{self.name}': {states} states, {noises} noises, {self.altitude.size} altitudes, {span}"

    def __post_init__(self):
        if self.altitude.ndim != 1 or self.start_covariance.ndim != 2 or not self.start_covariance.size:
            raise DataError(
                f"filter '{self.name}': altitudes are a list and the start covariance is a square matrix; they have "
                f"the shapes {self.altitude.shape} and {self.start_covariance.shape}"
            )
        k, n = self.altitude.size, self.start_covariance.shape[0]
        shapes = (self.F.shape == (k, n, n), self.G.ndim == 3 and self.G.shape[:2] == (k, n), self.H.shape == (k, n))
        if not all(shapes) or self.start_covariance.shape != (n, n):
            raise DataError(
                f"filter '{self.name}': F {self.F.shape}, G {self.G.shape}, H {self.H.shape} and start covariance "
                f"{self.start_covariance.shape} do not fit {k} altitudes and one state count"
            )
        for label, values in (("F", self.F), ("G", self.G), ("H", self.H), ("start covariance", self.start_covariance)):
            if not np.isfinite(values).all():
                raise DataError(f"filter '{self.name}': {label} holds a value that is not finite")
        if not np.isfinite(self.altitude).all() or k < 2 or not (np.diff(self.altitude) > 0).all():
            raise DataError(f"filter '{self.name}': altitudes must increase")
        kinks = np.array(self.kinks, dtype=object)
        if kinks.ndim != 1 or not all(isinstance(x, int | float) for x in self.kinks):
            raise DataError(f"filter '{self.name}': kinks are a list of altitudes, such as [10000.0], or an empty one")
        for kink in self.kinks:
            if not np.isclose(self.altitude, kink, rtol=1e-9, atol=1e-6).any():
                raise DataError(
                    f"filter '{self.name}': the kink at {kink:g} m is none of its altitudes; add a sample there, or "
                    "remove it"
                )
        if not np.allclose(self.start_covariance, self.start_covariance.T) or (
            np.linalg.eigvalsh(self.start_covariance).min() < -1e-9 * max(1e-300, np.trace(self.start_covariance))
        ):
            raise DataError(f"filter '{self.name}': the start covariance is not symmetric and positive semidefinite")

    @property
    def order(self) -> int:
        return self.start_covariance.shape[0]

    @property
    def noise_count(self) -> int:
        return self.G.shape[2]

    @cached_property
    def entries(self) -> tuple[tuple[str, int, int], ...]:
        """Entries of F, G and H that are not zero everywhere, as (matrix, row, column)."""
        found = []
        for label, matrix in (("F", self.F), ("G", self.G), ("H", self.H[:, None, :])):
            rows, columns = np.nonzero(np.abs(matrix).max(axis=0) > 0)
            found += [(label, int(i), int(j)) for i, j in zip(rows, columns, strict=True)]
        return tuple(found)

    def tables(self) -> list[Table]:
        """Return one table over altitude for every entry, named 'wind_filter.F_1_2' and so on."""
        units = {"F": "1/m", "G": "1/sqrt(m)", "H": "m/s"}
        matrices = {"F": self.F, "G": self.G, "H": self.H[:, None, :]}
        return [
            Table(entry_name(label, i, j), units[label], self.altitude, matrices[label][:, i, j], "cubic", self.kinks)
            for label, i, j in self.entries
        ]

    @cached_property
    def _group(self) -> TableGroup:
        polynomials = [(t.name, t.unit, t.polynomial) for t in self.tables()]
        low, high = float(self.altitude[0]), float(self.altitude[-1])
        return TableGroup.from_polynomials("wind_filter", "altitude", polynomials, low, high)

    def at(self, altitude: ArrayLike) -> tuple[NDArray, NDArray, NDArray]:
        """Return F (..., n, n), G (..., n, m) and H (..., n) at altitudes (...) in m."""
        n, values = self.order, self._group.evaluate(altitude)
        shapes = {"F": (n, n), "G": (n, self.noise_count), "H": (1, n)}
        found = {label: np.zeros((*values.shape[:-1], *shape)) for label, shape in shapes.items()}
        for k, (label, i, j) in enumerate(self.entries):
            found[label][..., i, j] = values[..., k]
        return found["F"], found["G"], found["H"][..., 0, :]


def entry_name(matrix: str, row: int, column: int) -> str:
    """Return the table name of an entry of F, G or H."""
    return f"wind_filter.{matrix}_{row + 1}_{column + 1}"


def matern(distance: ArrayLike, smoothness: float) -> NDArray[np.float64]:
    """Return the Matern correlation of unit scale at distances in scale lengths; smoothness 0.5 is exp(-d)."""
    d = np.asarray(distance, float)
    if smoothness == 0.5:
        return np.exp(-d)
    x = np.clip(np.sqrt(2 * smoothness) * d, 1e-12, 600.0)
    return np.where(
        d > 0,
        2 ** (1 - smoothness) / scipy.special.gamma(smoothness) * x**smoothness * scipy.special.kv(smoothness, x),
        1.0,
    )


@dataclass(frozen=True)
class TwoPartKernel:
    """Correlation of the wind between altitudes, positive definite on any set of them.

    rho(h1, h2) = a1 a2 M_1.5(|sL(h1) - sL(h2)|) + b1 b2 M_nu(|sS(h1) - sS(h2)|), a^2 + b^2 = 1,
    s(h) = integral of dh / L(h), M the Matern correlation. Knots as (altitudes m, values); scales are
    log-linear between knots, b^2 is logit-linear, and both are held beyond the last knot. The smoothness nu of
    the short part is 0.5 for an exact third-order filter; shears like dh^0.7 at the Cape ask for 0.7.
    """

    long_scale: tuple[NDArray[np.float64], NDArray[np.float64]]
    short_scale: tuple[NDArray[np.float64], NDArray[np.float64]]
    short_fraction: tuple[NDArray[np.float64], NDArray[np.float64]]
    source: str = ""
    short_smoothness: float = 0.5

    @property
    def kinks(self) -> tuple[float, ...]:
        knots = (self.long_scale[0], self.short_scale[0], self.short_fraction[0])
        return tuple(float(h) for h in np.unique(np.concatenate(knots)))

    def scales(self, altitude: ArrayLike) -> tuple[NDArray, NDArray, NDArray]:
        """Return L_long (m), L_short (m) and b^2 at the altitudes."""
        h = np.asarray(altitude, float)
        long, short = (np.exp(np.interp(h, x, np.log(y))) for x, y in (self.long_scale, self.short_scale))
        x, y = self.short_fraction
        return long, short, 1 / (1 + np.exp(-np.interp(h, x, np.log(y / (1 - y)))))

    def correlation(self, altitude: ArrayLike) -> NDArray[np.float64]:
        """Return the correlation matrix of the wind at the altitudes (m), shape (k, k)."""
        h = np.asarray(altitude, float)
        grid = np.unique(np.concatenate([np.linspace(min(0.0, h.min()), h.max(), 4001), self.kinks, h]))
        long, short, _ = self.scales(grid)
        middle = self.scales(0.5 * (grid[:-1] + grid[1:]))
        warped = []
        for edge, half in ((long, middle[0]), (short, middle[1])):
            simpson = (1 / edge[:-1] + 4 / half + 1 / edge[1:]) / 6 * np.diff(grid)
            warped.append(np.interp(h, grid, np.concatenate([[0.0], np.cumsum(simpson)])))
        b2 = self.scales(h)[2]
        r = _SQRT3 * np.abs(warped[0][:, None] - warped[0])
        d = np.abs(warped[1][:, None] - warped[1])
        a, b = np.sqrt(1 - b2), np.sqrt(b2)
        return np.outer(a, a) * (1 + r) * np.exp(-r) + np.outer(b, b) * matern(d, self.short_smoothness)

    def shaping_filter(
        self, altitude: ArrayLike, standard_deviation: ArrayLike, kinks: Sequence[float] = ()
    ) -> ShapingFilter:
        """Return the exact third-order filter for this correlation and a standard deviation over altitude.

        Parameters
        ----------
        altitude : (k,) array
            Samples, m; must hold the kernel's knots and ``kinks``.
        standard_deviation : (k,) array
            m/s.
        kinks : sequence of float
            Altitudes where the standard deviation has a corner.
        """
        if self.short_smoothness != 0.5:
            raise DataError(
                f"a kernel of smoothness {self.short_smoothness:g} has no exact filter of third order; "
                "fit one with synthesise(), or take smoothness 0.5"
            )
        h, sigma = np.asarray(altitude, float), np.asarray(standard_deviation, float)
        long, short, b2 = self.scales(h)
        F, G, H = np.zeros((h.size, 3, 3)), np.zeros((h.size, 3, 2)), np.zeros((h.size, 3))
        F[:, 0, 1] = 1 / long
        F[:, 1, 0] = -3 / long
        F[:, 1, 1] = -2 * _SQRT3 / long
        F[:, 2, 2] = -1 / short
        G[:, 1, 0] = np.sqrt(4 * 3 * _SQRT3 / long)
        G[:, 2, 1] = np.sqrt(2 / short)
        H[:, 0] = sigma * np.sqrt(1 - b2)
        H[:, 2] = sigma * np.sqrt(b2)
        inside = tuple(sorted({x for x in (*self.kinks, *kinks) if h[0] < x < h[-1]}))
        missing = [x for x in inside if not np.isclose(h, x).any()]
        if missing:
            raise DataError(f"the altitude samples of a filter must hold its corner at {missing[0]:g} m")
        return ShapingFilter("two_part_kernel", h, F, G, H, np.diag([1.0, 3.0, 1.0]), inside, self.source)
