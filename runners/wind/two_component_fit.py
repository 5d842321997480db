"""Correlation of the noises of two filters that gives their winds a wanted correlation at equal levels.

With both filters as one, (z_u, z_v), the cross covariance C of their states obeys C' = F_u C + C F_v' + r(h) G_u G_v'
with the first noises correlated by r(h): the correlation of the winds is linear in r, and r at a few knots follows by
bounded least squares. At the lowest altitude the states are correlated so that the winds have their correlation
there; C is linear in that one too.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ...model.tables import Table
from ...model.wind.propagation import divided
from ...model.wind.shaping_filter import ShapingFilter
from ...model.wind.turbulence import start_cross_covariance

STEP = 50.0  # m, of the classical Runge-Kutta method
LARGEST = 0.99  # magnitude of a noise correlation
SMOOTHNESS = 0.05


def cross_covariance(
    zonal: ShapingFilter,
    meridional: ShapingFilter,
    noise_correlation: Table,
    altitude: NDArray[np.float64],
    start_correlation: float = 0.0,
) -> NDArray[np.float64]:
    """Return the covariance of u and v at equal altitudes (m), m2/s2, (k,).

    ``start_correlation`` is that of the two winds at the lowest altitude.
    """

    def rate(h: float, C: NDArray) -> NDArray:
        (F, G, _), (E, J, _) = zonal.at(h), meridional.at(h)
        x = float(np.clip(h, noise_correlation.argument[0], noise_correlation.argument[-1]))
        return F @ C + C @ E.T + noise_correlation.polynomial(x) * np.outer(G[:, 0], J[:, 0])

    C = start_cross_covariance(zonal, meridional, start_correlation)
    low = max(zonal.altitude[0], meridional.altitude[0])
    levels = np.maximum(altitude, low)
    found, position = [], low
    for target in levels:
        for edges in divided(np.array([position, target]), STEP) if target > position else []:
            for a, b in itertools.pairwise(edges):
                d = b - a
                k1 = rate(a, C)
                k2 = rate(a + d / 2, C + d / 2 * k1)
                k3 = rate(a + d / 2, C + d / 2 * k2)
                C = C + d / 6 * (k1 + 2 * k2 + 2 * k3 + rate(b, C + d * k3))
        position = target
        found.append(zonal.at(target)[2] @ C @ meridional.at(target)[2])
    return np.array(found)


def fit_noise_correlation(
    zonal: ShapingFilter,
    meridional: ShapingFilter,
    altitude: NDArray[np.float64],
    correlation: NDArray[np.float64],
    deviations: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[Table, float]:
    """Return the correlation of the first noises over altitude, and that of the two winds at the lowest altitude.

    Parameters
    ----------
    altitude : (k,) array
        m.
    correlation : (k,) array
        Wanted, of u and v at equal altitude; what no bounded r can reach is met as nearly as possible.
    deviations : two (k,) arrays
        Standard deviations of u and v, m/s.
    """
    knots = altitude[:: max(1, altitude.size // 9)]
    hats = [Table("r", "1", knots, row, "linear") for row in np.vstack([np.eye(knots.size), np.zeros(knots.size)])]
    columns = [
        cross_covariance(zonal, meridional, hat, altitude, start) / (deviations[0] * deviations[1])
        for hat, start in zip(hats, [0.0] * knots.size + [1.0], strict=True)
    ]
    start = float(np.clip(correlation[0], -LARGEST, LARGEST))
    smooth = SMOOTHNESS * np.diff(np.eye(knots.size), 2, axis=0)
    matrix = np.vstack([np.array(columns[:-1]).T, smooth])
    target = np.concatenate([correlation - start * columns[-1], np.zeros(len(smooth))])
    fit = lsq_linear(matrix, target, (-LARGEST, LARGEST))
    return Table("wind.noise_correlation", "1", knots, fit.x, "linear"), start
