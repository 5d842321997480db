"""The report's analytic fits of standard deviation and correlation over altitude (Appendix A)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....model.wind.statistics import WindStatistics
from ...solvers.least_squares import FitOptions, fit_least_squares, residual_functions

SPLIT = 10.0  # km: altitudes of reference above it have the second form of correlation
FAINT = 1e-6
DEVIATION_START = np.array([5.0, 4.0, -0.1, 11.0, 50.0, 1.5, 1.5])


def deviation_form(h, b):
    """Return sigma(h), h in km; B3 is negative (docs/equations.md)."""
    s = ca.fmax(h / 22.0, 1e-9)  # the derivative of s^B6 with B6 holds ln s
    return b[0] + b[1] * ca.exp(b[2] * (h - b[3]) ** 2) + b[4] * s ** b[5] * (1 - s) ** b[6]


def low_correlation_form(h, b, reference: float):
    """Return rho_h1(h) = B1 + B2 h^B3 + B4 h + B5 h^2 + B6 h^3, for h1 up to 10 km; h in km."""
    return b[0] + b[1] * h ** b[2] + b[3] * h + b[4] * h**2 + b[5] * h**3


def high_correlation_form(h, b, reference: float):
    """Return rho_h1(h) = B1 + B2 h + B3 e^(B4 h) sin(K (h - h1)), for h1 above 10 km; h in km."""
    return b[0] + b[1] * h + b[2] * ca.exp(b[3] * h) * ca.sin(b[4] * (h - reference))


@dataclass(frozen=True, eq=False)
class AnalyticCovariance:
    """The covariance as analytic curves, C(h1, h) = rho_h1(h) sigma(h1) sigma(h).

    Attributes
    ----------
    levels : (k,) array
        km.
    deviation : (7,) array
        B1 to B7 of sigma(h).
    correlations : tuple of arrays
        B of the correlation with each level.
    rms : float
        Error of the correlations.
    """

    levels: NDArray[np.float64]
    deviation: NDArray[np.float64]
    correlations: tuple[NDArray[np.float64], ...]
    rms: float

    def derivatives(self, level: int, altitude: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return C(h1, h) and its first three derivatives with h at altitudes (km), in 1/km, (4, m)."""
        h = ca.SX.sym("h")
        c = _correlation(self.levels[level])(h, ca.DM(self.correlations[level]), float(self.levels[level]))
        reference = float(deviation_form(ca.DM(self.levels[level]), ca.DM(self.deviation)))
        expression = c * reference * deviation_form(h, ca.DM(self.deviation))
        found = [expression]
        for _ in range(3):
            found.append(ca.jacobian(found[-1], h))
        function = ca.Function("derivatives", [h], [ca.vertcat(*found)])
        return np.array(function.map(altitude.size)(altitude[None, :]))


def _correlation(reference: float):
    return low_correlation_form if reference <= SPLIT else high_correlation_form


def fit_deviation(altitude: NDArray, deviation: NDArray, options: FitOptions | None = None) -> NDArray[np.float64]:
    """Return B1 to B7 of the standard deviation (m/s) over altitude (m) by Levenberg-Marquardt."""
    b = ca.SX.sym("b", 7)
    h = altitude / 1000.0
    residuals = ca.vertcat(*(deviation_form(float(x), b) - y for x, y in zip(h, deviation, strict=True)))
    # where levels are few they do not determine all seven: a slight pull to the start keeps the rest
    residuals = ca.vertcat(residuals, FAINT * (b - DEVIATION_START))
    options = options or FitOptions(tolerance=1e-12, max_evaluations=5000)
    return fit_least_squares(residual_functions(residuals, b), DEVIATION_START, options).unknowns


def fit_covariance(statistics: WindStatistics) -> AnalyticCovariance:
    """Fit all curves of Appendix A to the statistics."""
    h = statistics.altitude / 1000.0
    fitted, squares = [], 0.0
    options = FitOptions(max_evaluations=2000, tolerance=1e-9)
    for i, reference in enumerate(h):
        form = _correlation(reference)
        start = (
            np.array([0.5, 0.1, 0.5, 0.0, 0.0, 0.0]) if reference <= SPLIT else np.array([0.2, 0.05, 0.1, 0.05, 0.3])
        )
        b = ca.SX.sym("b", start.size)
        curve = ca.vertcat(
            *(form(float(x), b, float(reference)) - r for x, r in zip(h, statistics.correlation[i], strict=True))
        )
        # a slight pull to the start keeps exponents where three terms say the same thing
        fit = fit_least_squares(residual_functions(ca.vertcat(curve, 1e-4 * (b - start)), b), start, options)
        fitted.append(fit.unknowns)
        squares += float(ca.sumsqr(ca.Function("c", [b], [curve])(fit.unknowns)))
    rms = float(np.sqrt(squares / h.size**2))
    return AnalyticCovariance(h, fit_deviation(statistics.altitude, statistics.standard_deviation), tuple(fitted), rms)
