"""Verification of a shaping filter (report 3.4.7): its covariances through the adjoint engine, and by an ensemble.

The filter over altitude is a linear system whose independent variable happens to be altitude; the same adjoint that
serves the vehicle gives its weighting functions g(h2, h).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson

from ...codegen.system.executable import executable_system
from ...model.errors import TimeRangeError
from ...model.system.labels import Noise, Output, State
from ...model.system.linear_system import LinearSystem
from ...model.system.symbols import TableSymbols
from ...model.tables import TableGroup
from ...model.wind.shaping_filter import ShapingFilter, entry_name
from ...model.wind.statistics import WindStatistics
from ..solvers.adjoint import AdjointSolver
from ..solvers.discretisation import symmetric_root
from ..solvers.integration import CvodesSettings
from .fitting.altitude_grid import transition
from .fitting.frozen_poles import largest_pole
from .fitting.intervals import share_inside

SPACING = 25.0  # m, of the points at which weighting functions are multiplied
TOLERANCE = 1e-10  # of CVODES


@dataclass(frozen=True, eq=False)
class Verification:
    """Covariances of a filter against data.

    Attributes
    ----------
    statistics : WindStatistics
    covariance : (k, k) array
        By (3-8) and (3-9), m2/s2.
    share_inside : float
        Of the distinct entries, inside the 90 % interval of the data.
    rms_error : float
        Of the distinct entries, m2/s2.
    largest_pole : float
        Largest real part of the frozen poles over altitude, 1/m; negative when stable everywhere.
    state_ratio : float
        Largest over smallest standard deviation of a state, over all altitudes.
    """

    statistics: WindStatistics
    covariance: NDArray[np.float64] = field(repr=False)
    share_inside: float
    rms_error: float
    largest_pole: float
    state_ratio: float


def altitude_system(shaping_filter: ShapingFilter, stops: tuple[float, ...] = ()) -> LinearSystem:
    """Return a filter as a linear system over altitude (m, in the place of time) with the wind as its output.

    Parameters
    ----------
    stops : tuple of float
        Altitudes at which integrators stop, beside the kinks of the filter.
    """
    n, m = shaping_filter.order, shaping_filter.noise_count
    low, high = float(shaping_filter.altitude[0]), float(shaping_filter.altitude[-1])
    polynomials = [(t.name, t.unit, t.polynomial) for t in shaping_filter.tables()]
    group = TableGroup.from_polynomials("wind_filter", "time", polynomials, low, high)
    tables = TableSymbols(group.names)
    matrices = {"F": ca.SX(n, n), "G": ca.SX(n, m), "H": ca.SX(1, n)}
    for label, i, j in shaping_filter.entries:
        matrices[label][i, j] = tables[entry_name(label, i, j)]
    x, white = ca.SX.sym("wind", n), ca.SX.sym("white", m)
    inner = {float(s) for s in (*stops, *shaping_filter.kinks) if low < s < high}
    return LinearSystem(
        name="wind_filter",
        time=ca.SX.sym("altitude"),
        x=x,
        w=white,
        u=ca.SX(0, 1),
        p=ca.SX(0, 1),
        v=tables.vector,
        derivative=matrices["F"] @ x + matrices["G"] @ white,
        output=matrices["H"] @ x,
        states=tuple(State(f"wind_{i + 1}") for i in range(n)),
        noises=tuple(Noise(f"white_{i + 1}", "wind") for i in range(m)),
        outputs=(Output("wind", "m/s", 10.0),),
        tables=(group,),
        start_covariance={"wind": shaping_filter.start_covariance},
        discontinuities=tuple(sorted(inner)),
        start=low,
        end=high,
        structure={"wind filter": f"order {n}, {m} noises"},
    )


def engine_covariance(
    shaping_filter: ShapingFilter, altitude: NDArray[np.float64], compile: bool = False
) -> NDArray[np.float64]:
    """Return the covariance of a filter's output at altitudes (m) from its weighting functions, m2/s2, (k, k).

    COV(h2, h1) = integral to h1 of g(h2, h) g(h1, h) dh + lambda2' P0 lambda1, (3-8) and (3-9) with a start covariance.

    Raises
    ------
    TimeRangeError
        An altitude lies outside the filter's.
    """
    low, high = shaping_filter.altitude[[0, -1]]
    if altitude.min() < low or altitude.max() > high:
        raise TimeRangeError(
            f"the filter covers {low:g} to {high:g} m, not {altitude.min():g} to {altitude.max():g} m; "
            "verify it within its range"
        )
    system = altitude_system(shaping_filter, tuple(altitude.tolist()))
    solver = AdjointSolver(executable_system(system, compile), CvodesSettings(relative_tolerance=TOLERANCE))
    result = np.zeros((altitude.size, altitude.size))
    P0 = shaping_filter.start_covariance
    runs = []
    for i, h2 in enumerate(altitude):
        if h2 > low:
            history = solver.history(float(h2), SPACING)
            points, weights, first = history.times, history.noise[:, 0, :], history.adjoint[0, 0]
        else:
            points, weights = np.zeros(0), np.zeros((0, shaping_filter.noise_count))
            first = shaping_filter.at(low)[2]
        runs.append((points, weights, first))
        for j, (lower, other, start) in enumerate(runs):
            # all runs pass the same points below the lower altitude, because the solver stops at every level
            product = np.sum(weights[: lower.size] * other, axis=1)
            result[i, j] = result[j, i] = _integral(lower, product) + first @ P0 @ start
    return result


def _integral(points: NDArray, values: NDArray) -> float:
    """Integrate between the points that stand twice, where the integrand may have a corner."""
    if not points.size:
        return 0.0
    edges = np.flatnonzero(np.diff(points) == 0) + 1
    parts = zip(np.split(points, edges), np.split(values, edges), strict=True)
    return float(sum(simpson(v, x=p) for p, v in parts))


def verify(shaping_filter: ShapingFilter, statistics: WindStatistics, compile: bool = False) -> Verification:
    """Hold a filter's covariances by the adjoint engine against data."""
    covariance = engine_covariance(shaping_filter, statistics.altitude, compile)
    error = (covariance - statistics.covariance)[np.triu_indices(len(covariance))]
    sizes = state_deviations(shaping_filter)
    return Verification(
        statistics,
        covariance,
        share_inside(covariance, statistics.covariance, statistics.independent_samples),
        float(np.sqrt(np.mean(error**2))),
        largest_pole(shaping_filter),
        float(sizes.max() / sizes.min()),
    )


def state_deviations(shaping_filter: ShapingFilter) -> NDArray[np.float64]:
    """Return the standard deviations of the states at the filter's altitudes, (k, n)."""
    return np.sqrt([np.diag(P) for P in _state_covariances(shaping_filter)])


def standard_deviation(shaping_filter: ShapingFilter) -> NDArray[np.float64]:
    """Return the standard deviation of the wind at the filter's own altitudes, m/s."""
    P = _state_covariances(shaping_filter)
    return np.sqrt([h @ p @ h for h, p in zip(shaping_filter.H, P, strict=True)])


def _state_covariances(shaping_filter: ShapingFilter) -> list[NDArray]:
    found = [shaping_filter.start_covariance]
    for phi, added in _steps(shaping_filter, shaping_filter.altitude):
        found.append(phi @ found[-1] @ phi.T + added)
    return found


def _steps(shaping_filter: ShapingFilter, altitude: NDArray) -> list[tuple[NDArray, NDArray]]:
    def matrices(h: float) -> tuple[NDArray, NDArray]:
        F, G, _ = shaping_filter.at(h)
        return F, G

    return [transition(matrices, a, b) for a, b in itertools.pairwise(altitude)]


def simulate_profiles(
    shaping_filter: ShapingFilter, altitude: NDArray[np.float64], count: int = 5000, seed: int = 504
) -> NDArray[np.float64]:
    """Return simulated wind profiles without their mean at altitudes (m), m/s, (count, k).

    Each interval is one exact Gaussian step, from samples at most the filter's own spacing apart.
    """
    random = np.random.default_rng(seed)
    low = float(shaping_filter.altitude[0])
    inner = shaping_filter.altitude[shaping_filter.altitude <= altitude.max()]
    grid = np.unique(np.concatenate([inner, np.maximum(altitude, low)]))
    z = random.standard_normal((count, shaping_filter.order)) @ symmetric_root(shaping_filter.start_covariance).T
    wind = {grid[0]: z @ shaping_filter.at(grid[0])[2]}
    for h, (phi, added) in zip(grid[1:], _steps(shaping_filter, grid), strict=True):
        z = z @ phi.T + random.standard_normal(z.shape) @ symmetric_root(added).T
        wind[h] = z @ shaping_filter.at(h)[2]
    return np.stack([wind[max(h, low)] for h in altitude], axis=1)


def ensemble_share_inside(
    shaping_filter: ShapingFilter,
    covariance: NDArray[np.float64],
    altitude: NDArray[np.float64],
    count: int = 5000,
    seed: int = 504,
    confidence: float = 0.99,
) -> float:
    """Return the share of covariances that lie inside the interval of an ensemble of simulated profiles."""
    profiles = simulate_profiles(shaping_filter, altitude, count, seed)
    # the mean is known to be zero: one degree of freedom more than the interval takes off
    return share_inside(covariance, profiles.T @ profiles / count, count + 1, confidence)
