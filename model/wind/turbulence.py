"""Small-scale wind as filters over altitude: Dryden and rational von Karman spectra (report 3.3).

A vehicle that climbs steeply meets a horizontal gust across its path: the transverse spectrum applies, with Omega the
wave number along the path, here along altitude, rad/m.

    Dryden       Phi(Omega) = sigma^2 (L / pi) (1 + 3 (L Omega)^2) / (1 + (L Omega)^2)^2
    von Karman   Phi(Omega) = sigma^2 (L / pi) (1 + 8/3 (1.339 L Omega)^2) / (1 + (1.339 L Omega)^2)^(11/6)

one-sided. The soundings' variance already holds part of it: see ``high_pass``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..errors import DataError, UnknownNameError
from ..tables import Table
from .range_reference import WIND_DATA, read_rows
from .shaping_filter import ShapingFilter

VON_KARMAN = 1.339
LENGTH = 533.4  # m, of MIL-F-8785C above 2000 ft (1750 ft), Dryden form
SEVERITY = {"light": "1e-2", "moderate": "1e-3", "severe": "1e-5"}  # probability of exceedance
INTENSITY = "turbulence.sigma"  # the table of sigma over altitude, m/s
FORMS = ("dryden", "von-karman-2", "von-karman-3")
SPACING = 250.0  # m, of the filter's samples
HIGH_PASS = 2000.0  # m: levels of soundings are 1 km apart, and longer waves are in their statistics for certain
LARGEST_INTENSITY = 26.0  # m/s, more than any turbulence has

# Numerator and denominator in L s, one at s = 0. Von Karman: least squares of the logarithm of the transverse spectrum,
# L Omega from 0.05 to 60, within 9 % (third order) and a factor 1.6 (second); variance 0.98 and 1.03 of sigma^2
RATIONAL = {
    "dryden": ([np.sqrt(3.0), 1.0], [1.0, 2.0, 1.0]),
    "von-karman-2": ([12.15576, 1.0], [6.030819, 12.32542, 1.0]),
    "von-karman-3": ([0.2764155, 3.243516, 1.0], [0.1108613, 2.154243, 3.478650, 1.0]),
}


@dataclass(frozen=True, eq=False)
class Turbulence:
    """Turbulence along a flight, beside the wind of its statistics.

    Parameters
    ----------
    form : {'dryden', 'von-karman-2', 'von-karman-3'}
    intensity : Table
        sigma over altitude, m/s; held beyond its ends.
    length : float
        L, m.
    high_pass : float or None
        Wavelength, m, of the first-order high pass that takes out what the wind's statistics hold; None without one.
    correlation : float or None
        Of its noise with the first noise of the wind's filter; None for independent ones.

    Raises
    ------
    UnknownNameError, DataError
    """

    form: str
    intensity: Table
    length: float = LENGTH
    high_pass: float | None = HIGH_PASS
    correlation: float | None = None

    def __post_init__(self):
        if self.form not in FORMS:
            raise UnknownNameError("form of turbulence", self.form, FORMS)
        sigma = self.intensity.values
        if not ((sigma >= 0) & (sigma <= LARGEST_INTENSITY)).all():
            k = int(np.argmax(~((sigma >= 0) & (sigma <= LARGEST_INTENSITY))))
            raise DataError(
                f"a turbulence of {sigma[k]:g} m/s at {self.intensity.argument[k]:g} m is none; give sigma in m/s, "
                f"from 0 to {LARGEST_INTENSITY:g}"
            )
        if not self.length > 0 or (self.high_pass is not None and not self.high_pass > 0):
            raise DataError("turbulence needs a positive length scale and a high pass at a positive wavelength")
        if self.correlation is not None and not abs(self.correlation) < 1:
            raise DataError(f"a correlation of {self.correlation:g} of two noises is not between -1 and 1")

    @property
    def order(self) -> int:
        """Number of states."""
        return self.row.size

    @property
    def row(self) -> NDArray[np.float64]:
        """The wind in terms of the states for sigma = 1, (order,)."""
        C = realisation(self.form)[2]
        return C if self.high_pass is None else np.append(C, -1.0)


def turbulence_intensity(severity: str = "moderate") -> Table:
    """Return sigma over altitude, m/s, MIL-F-8785C figure 7; 'light', 'moderate' or 'severe'."""
    if severity not in SEVERITY:
        raise UnknownNameError("severity of turbulence", severity, SEVERITY)
    rows = read_rows(WIND_DATA / "turbulence_mil_f_8785c.csv")
    altitude = np.array([float(r["altitude [m]"]) for r in rows])
    sigma = np.array([float(r[f"sigma_{SEVERITY[severity]} [m/s]"]) for r in rows])
    return Table(INTENSITY, "m/s", altitude, sigma, "linear")


def transverse_spectrum(form: str, wave_number: ArrayLike, sigma: float, length: float) -> NDArray[np.float64]:
    """Return the one-sided target spectrum at wave numbers in rad/m, m3/s2 by rad; 'dryden' or 'von-karman'."""
    x = np.asarray(wave_number, float) * length
    if form == "dryden":
        return sigma**2 * length / np.pi * (1 + 3 * x**2) / (1 + x**2) ** 2
    y = (VON_KARMAN * x) ** 2
    return sigma**2 * length / np.pi * (1 + 8 / 3 * y) / (1 + y) ** (11 / 6)


def turbulence_filter(
    form: str = "dryden",
    severity: str = "moderate",
    *,
    altitude: tuple[float, float] = (0.0, 20000.0),
    length: float | Callable[[NDArray], NDArray] = LENGTH,
    intensity: Table | None = None,
    high_pass: float | None = None,
) -> ShapingFilter:
    """Return turbulence as a filter driven by a noise of its own.

    Parameters
    ----------
    form : {'dryden', 'von-karman-2', 'von-karman-3'}
    severity : str
        Of MIL-F-8785C, unless ``intensity`` gives sigma over altitude.
    altitude : (float, float)
        Range of the filter, m.
    length : float or function of altitude
        Length scale L, m.
    high_pass : float, optional
        Wavelength in m. Waves longer than it are already in the soundings' variance: a first-order high pass takes
        them out, so that they are not counted twice. Adds one state.
    """
    if form not in FORMS:
        raise UnknownNameError("form of turbulence", form, FORMS)
    low, high = altitude
    if not high > low:
        raise DataError(f"turbulence from {low:g} to {high:g} m has no range; give the lower altitude first")
    if high_pass is not None and not 0 < high_pass < np.inf:
        raise DataError(f"a high pass at a wavelength of {high_pass:g} m is not possible; give a positive one, or none")
    table = intensity if intensity is not None else turbulence_intensity(severity)
    corners = [x for x in table.argument if low < x < high] if table.interpolation == "linear" else []
    h = np.unique(np.concatenate([np.arange(low, high, SPACING), [high], corners]))
    h = h[np.concatenate([[True], np.diff(h) > 1e-6])]
    sigma = table.polynomial(np.clip(h, table.argument[0], table.argument[-1]))
    scale = np.asarray(length(h) if callable(length) else np.full(h.size, float(length)), float)
    if not ((scale > 0) & (scale < np.inf)).all() or (sigma < 0).any():
        raise DataError("turbulence needs positive, finite length scales and intensities that are not negative")
    A, B, C = realisation(form)
    n = A.shape[0] + (high_pass is not None)
    F, G, H = np.zeros((h.size, n, n)), np.zeros((h.size, n, 1)), np.zeros((h.size, n))
    for k, L in enumerate(scale):
        m = A.shape[0]
        F[k, :m, :m], G[k, :m], H[k, :m] = A / L, B / np.sqrt(L), sigma[k] * C
        if high_pass is not None:
            corner = 2 * np.pi / high_pass
            F[k, m, :m], F[k, m, m], H[k, m] = corner * C, -corner, -sigma[k]
    start = stationary_covariance(F[0], G[0])
    return ShapingFilter(
        f"turbulence_{form.replace('-', '_')}",
        h,
        F,
        G,
        H,
        start,
        tuple(float(c) for c in corners),
        f"{form} turbulence, {severity if intensity is None else 'given intensity'}",
    )


def stationary_covariance(A: NDArray[np.float64], B: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance P of few states z' = A z + B n that have run forever, (n, n): A P + P A' + B B' = 0."""
    one = np.eye(A.shape[0])
    P = np.linalg.solve(np.kron(A, one) + np.kron(one, A), -(B @ B.T).ravel()).reshape(A.shape)
    return 0.5 * (P + P.T)


def realisation(form: str) -> tuple[NDArray, NDArray, NDArray]:
    """Return A, B, C of a form for L = 1 and sigma = 1, in states of unit variance: z' = A z + B n, W = C z."""
    numerator, denominator = (np.array(c) for c in RATIONAL[form])
    numerator, denominator = numerator / denominator[0], denominator / denominator[0]
    n = denominator.size - 1
    A = np.diag(np.ones(n - 1), 1)
    A[-1] = -denominator[:0:-1]
    B, C = np.zeros((n, 1)), np.zeros(n)
    B[-1] = 1.0
    C[: numerator.size] = numerator[::-1]
    size = np.sqrt(np.diag(stationary_covariance(A, B)))
    A, B, C = A * size / size[:, None], B / size[:, None], C * size
    return A, B, C / float(-C @ np.linalg.solve(A, B[:, 0]))


def start_cross_covariance(first: ShapingFilter, second: ShapingFilter, correlation: float) -> NDArray[np.float64]:
    """Return the covariance of the states of two filters at their start that correlates their winds there, (n, m).

    C = r (P1 H1 / sigma1) (P2 H2 / sigma2)': the winds have the correlation r, and the joint covariance is positive
    semidefinite for any |r| <= 1.
    """
    if not abs(correlation) <= 1:
        raise DataError(f"a correlation of {correlation:g} of two winds at their start is not between -1 and 1")
    parts = []
    for f in (first, second):
        direction = f.start_covariance @ f.H[0]
        deviation = np.sqrt(f.H[0] @ direction)
        parts.append(direction / deviation if deviation > 0 else np.zeros_like(direction))
    return correlation * np.outer(*parts)


def add_filters(
    first: ShapingFilter, second: ShapingFilter, correlation: Table | None = None, start_correlation: float = 0.0
) -> ShapingFilter:
    """Return the sum of two winds over the altitudes that both cover.

    Parameters
    ----------
    correlation : Table, optional
        Correlation over altitude (m) of the first noise of the second filter with the first noise of the first one
        (report 3.3, figure 3-1); independent without it.
    start_correlation : float
        Of the two winds at the lowest altitude.
    """
    low, high = max(first.altitude[0], second.altitude[0]), min(first.altitude[-1], second.altitude[-1])
    if not high > low:
        raise DataError(f"filters '{first.name}' and '{second.name}' share no altitudes")
    h = np.unique(
        np.concatenate(
            [f.altitude[(f.altitude >= low) & (f.altitude <= high)] for f in (first, second)] + [[low, high]]
        )
    )
    h = h[np.concatenate([[True], np.diff(h) > 1e-6])]
    values = [[f.at(x) for x in h] for f in (first, second)]
    F = np.array([scipy.linalg.block_diag(a[0], b[0]) for a, b in zip(*values, strict=True)])
    G = np.array([scipy.linalg.block_diag(a[1], b[1]) for a, b in zip(*values, strict=True)])
    if correlation is not None:
        r = correlation.polynomial(np.clip(h, correlation.argument[0], correlation.argument[-1]))
        if (np.abs(r) > 1).any():
            raise DataError("a correlation of two noises is not between -1 and 1")
        own = G[:, first.order :, first.noise_count].copy()
        G[:, first.order :, 0] = r[:, None] * own
        G[:, first.order :, first.noise_count] = np.sqrt(1 - r**2)[:, None] * own
    H = np.array([np.concatenate([a[2], b[2]]) for a, b in zip(*values, strict=True)])
    start = np.asarray(scipy.linalg.block_diag(first.start_covariance, second.start_covariance))
    cross = start_cross_covariance(first, second, start_correlation)
    start[: first.order, first.order :], start[first.order :, : first.order] = cross, cross.T
    kinks = tuple(sorted({x for f in (first, second) for x in f.kinks if low < x < high}))
    return ShapingFilter(
        f"{first.name}_and_{second.name}",
        h,
        F,
        G,
        H,
        start,
        kinks,
        f"{first.source}; {second.source}",
    )
