"""The search behind a design: a smooth programme over parameters and the height of the peak, by SciPy's SLSQP.

The peak of |mean| + 3 sigma over end times is not smooth where it moves from one time to another. So its height s is
a variable: minimise s with 3 sigma +- mean <= s at every end time, beside the limits. Positions u run from 0 to 1
between the bounds and heights are parts of those at the start, so that all derivatives are near one.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear, minimize

from ..solvers.frozen_roots import FrozenDamping, FrozenRoots, root_families
from ..statistics.resultants import labels_of
from .peaks import SIGNS, Row, TrialPeaks, gradients
from .problem import LoadReliefProblem

if TYPE_CHECKING:
    from ..study import Study

log = logging.getLogger(__name__)

ACTIVE = 1e-6  # slack of a row that holds as an equation
NEAR = 1e-3  # of a peak: rows this close below it get derivatives of their own, others those of the nearest
MOST_EXACT = 4  # rows of one response
FAR = 0.8  # of a limit: a peak below it keeps the derivatives it had
GROWTH_SCALE = 0.05  # 1/s
TOO_FAST = 0.2  # 1/s: a flight that grows so is not integrated
LEAST_DAMPING_SCALE = 0.01
ITERATIONS, RESTARTS = 60, 3
SETTLED = 1e-8  # of a peak: what a grid may miss otherwise at the result than where its error was taken


class _FeasibleError(Exception):
    """Ends the search for a feasible point where one is found."""


@dataclass(frozen=True, eq=False)
class Point:
    """What trial values give: peaks as (responses, 2 signs, times), and damping at the frozen times, if any."""

    peaks: NDArray[np.float64]
    frozen: FrozenDamping | None


@dataclass(frozen=True)
class Stationarity:
    """How far a point is from a Karush-Kuhn-Tucker point.

    Attributes
    ----------
    residual : float
        Largest derivative of the Lagrangian with respect to a position, of the height of the peak: a part of the peak
        per span of a parameter.
    violation : float
        Largest violation of a limit, of the limit.
    multipliers : tuple of (str, float)
        Active rows by name, and what the height of the peak (of that at the start) gains per relative loosening.
    """

    residual: float
    violation: float
    multipliers: tuple[tuple[str, float], ...]


class Search:
    """Evaluates a problem at positions and moves through them."""

    def __init__(self, problem: LoadReliefProblem):
        self.problem = problem
        self.responses = [problem.response, *problem.peak_limits]
        self.families = root_families(problem.study.system)
        executable = problem.study.executable
        self.roots = FrozenRoots(executable, problem.frozen_times, problem.names) if problem.frozen_times else None
        self.evaluations = self.derivatives = 0
        self._points: dict[bytes, Point] = {}
        self._settled: dict[bytes, Point] = {}
        self._exact: dict[bytes, dict[Row, NDArray]] = {}
        self._last: dict[str, dict[Row, NDArray]] = {}
        sizes = [labels_of(problem.study, response)[0].scale for response in self.responses]
        self._fallback = np.array(sizes)[:, None, None] * np.ones((len(self.responses), len(SIGNS), len(problem.times)))
        self._peaks = TrialPeaks(problem.study, self.responses, problem.times)
        self.settle(problem.start)
        self.scale = self.height(problem.start)

    def point(self, u: NDArray[np.float64]) -> Point:
        """Return what a position gives; a flight too unstable to integrate gets peaks that grow with its roots."""
        key = u.tobytes()
        if key in self._settled:
            return self._settled[key]
        if key not in self._points:
            self._points[key] = self._point(u, self._peaks)
        return self._points[key]

    def settle(self, u: NDArray[np.float64]) -> float:
        """Compute a position by controlled steps; return by what part of a peak all others move by that."""
        moved = 0.0

        def exact(study: Study) -> NDArray[np.float64] | None:
            nonlocal moved
            values, moved = self._peaks.settle(study)
            return values

        key = u.tobytes()
        if key not in self._settled:
            self._settled[key] = self._point(u, exact)
            self._points.clear()
        return moved

    def _point(self, u: NDArray[np.float64], peaks_of: Callable[[Study], NDArray[np.float64] | None]) -> Point:
        study, growth = self.problem.study_at(u), 0.0
        frozen = self.roots(study.executable.parameters) if self.roots else None
        if frozen is not None:
            growth = float(frozen.growth.max())
        peaks = None if growth > TOO_FAST else peaks_of(study)
        if peaks is None:
            peaks = self._fallback * (2.0 + 10.0 * max(growth, 0.0))
        else:
            self._fallback = peaks
        self.evaluations += 1
        return Point(peaks, frozen)

    def height(self, u: NDArray[np.float64]) -> float:
        """Return the peak of the response that is minimised, SI."""
        return float(self.point(u).peaks[0].max())

    def limits(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slack of every limit, relative; a limit holds where it is not negative."""
        point, problem = self.point(u), self.problem
        allowed = np.array(list(problem.peak_limits.values()))
        parts = [(1 - point.peaks[1:] / allowed[:, None, None]).ravel()]
        if point.frozen is not None:
            for family, least in problem.damping_limits.items():
                found = point.frozen.damping[:, self.families.index(family)]
                parts.append((found - least) / max(abs(least), LEAST_DAMPING_SCALE))
            parts.append((problem.largest_growth - point.frozen.growth) / GROWTH_SCALE)
        return np.concatenate(parts)

    def violation(self, u: NDArray[np.float64]) -> float:
        """Return the largest relative violation of a limit, 0 where all hold."""
        return max(0.0, -float(self.limits(u).min(initial=0.0)))

    def limit_names(self) -> list[str]:
        """Return what each slack belongs to."""
        problem = self.problem
        names = [f"peak {r}, {t:g} s" for r in problem.peak_limits for _ in SIGNS for t in problem.times]
        if self.roots:
            names += [f"damping {f}, {t:g} s" for f in problem.damping_limits for t in problem.frozen_times]
            names += [f"growth, {t:g} s" for t in problem.frozen_times]
        return names

    def limit_gradients(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivatives of the slacks, (limits, n)."""
        point, problem, n = self.point(u), self.problem, len(self.problem.names)
        parts = [-self._peak_gradients(u, i) / limit for i, limit in enumerate(problem.peak_limits.values(), start=1)]
        if point.frozen is not None:
            for family, least in problem.damping_limits.items():
                slope = point.frozen.damping_gradient[:, self.families.index(family)]
                parts.append(slope * problem.span / max(abs(least), LEAST_DAMPING_SCALE))
            parts.append(-point.frozen.growth_gradient * problem.span / GROWTH_SCALE)
        return np.concatenate([np.zeros((0, n)), *parts])

    def _peak_gradients(self, u: NDArray[np.float64], response: int) -> NDArray[np.float64]:
        """Return derivatives of 3 sigma +- mean by position, (2 times, n), exact for the rows near the peak."""
        name, times, n = self.responses[response], np.array(self.problem.times), len(self.problem.names)
        wanted = {other: self._near(u, i) for i, other in enumerate(self.responses)}
        exact = self.exact(u, [row for rows in wanted.values() for row in rows])  # of all responses, which share work
        if wanted[name]:
            self._last[name] = {row: exact[row] for row in wanted[name]}
        known = self._last[name]
        found = np.zeros((len(SIGNS), times.size, n))
        for s, sign in enumerate(SIGNS):
            rows = [row for row in known if row[1] == sign] or list(known)
            nearest = np.argmin(np.abs(times[:, None] - [row[2] for row in rows]), axis=1)
            found[s] = np.array([known[row] for row in rows])[nearest]
        return found.reshape(-1, n)

    def _near(self, u: NDArray[np.float64], response: int) -> list[Row]:
        """Return the rows that need derivatives of their own; none for a peak far below its limit that had them."""
        name, values = self.responses[response], self.point(u).peaks[response]
        if name in self._last and values.max() < FAR * self.problem.peak_limits.get(name, 0.0):
            return []
        order = np.argsort(-values, axis=None)[:MOST_EXACT]
        near = [np.unravel_index(k, values.shape) for k in order if values.flat[k] >= (1 - NEAR) * values.max()]
        return [(name, SIGNS[s], self.problem.times[k]) for s, k in near]

    def exact(self, u: NDArray[np.float64], rows: list[Row]) -> dict[Row, NDArray[np.float64]]:
        """Return exact derivatives of rows by position."""
        known = self._exact.setdefault(u.tobytes(), {})
        missing = [row for row in rows if row not in known]
        if missing:
            self.derivatives += 1
            for row, value in gradients(self.problem.study_at(u), missing, self.problem.names).items():
                known[row] = value * self.problem.span
        return {row: known[row] for row in rows}

    def find_feasible(self, u: NDArray[np.float64], elastic: str = "") -> NDArray[np.float64]:
        """Return a position at which all limits hold, or the one that comes closest: the least largest violation.

        ``elastic`` names the one limit (as in ``limit_names``, without the time) that may be violated; any without it.
        """
        gives = np.array([float(name.startswith(elastic)) for name in self.limit_names()])
        best = u

        def missed(at: NDArray[np.float64]) -> tuple[float, float]:
            """Violation of the limits that must hold, then of those that give way."""
            short = np.maximum(-self.limits(at), 0.0)
            hard = float((short * (1 - gives)).max())
            return (hard if hard > ACTIVE else 0.0), float((short * gives).max())

        def slack(z: NDArray[np.float64]) -> NDArray[np.float64]:
            nonlocal best
            here = np.clip(z[:-1], 0, 1)
            best = min(best, here, key=missed)
            if self.violation(here) == 0:
                raise _FeasibleError
            return self.limits(here) + gives * z[-1]

        def slope(z: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.hstack([self.limit_gradients(np.clip(z[:-1], 0, 1)), gives[:, None]])

        for _ in range(RESTARTS):  # a trial flight that cannot be integrated may end the search far from the best
            before = best
            try:
                _slsqp(np.append(before, missed(before)[1]), slack, slope, lambda _: None)
            except _FeasibleError:
                break
            (hard, gave), (hard_before, gave_before) = missed(best), missed(before)
            if hard >= hard_before and gave > 0.99 * gave_before:
                break
        self.settle(best)
        return best

    def descend(
        self, u: NDArray[np.float64], heard: Callable[[NDArray[np.float64]], None] = lambda _: None
    ) -> NDArray[np.float64]:
        """Return the position of the lowest peak from a feasible start."""
        rows = 2 * len(self.problem.times)

        def slack(z: NDArray[np.float64]) -> NDArray[np.float64]:
            here = np.clip(z[:-1], 0, 1)
            return np.concatenate([z[-1] - self.point(here).peaks[0].ravel() / self.scale, self.limits(here)])

        def slope(z: NDArray[np.float64]) -> NDArray[np.float64]:
            here = np.clip(z[:-1], 0, 1)
            by_position = np.vstack([-self._peak_gradients(here, 0) / self.scale, self.limit_gradients(here)])
            return np.hstack([by_position, (np.arange(len(by_position)) < rows).astype(float)[:, None]])

        def tell(z: NDArray[np.float64]) -> None:
            heard(np.clip(z[:-1], 0, 1))

        for restart in range(RESTARTS):
            if restart == RESTARTS - 1:
                self._peaks.leave_grid()
            found = _slsqp(np.append(u, self.height(u) / self.scale), slack, slope, tell)
            u = np.clip(found[:-1], 0, 1)
            if self.settle(u) <= SETTLED and self.stationarity(u).residual <= ACTIVE:
                break
        return u

    def stationarity(self, u: NDArray[np.float64]) -> Stationarity:
        """Measure a position against the conditions of Karush, Kuhn and Tucker, with exact derivatives alone."""
        n, values, slack = len(self.problem.names), self.point(u).peaks, self.limits(u)
        names, columns, heights = [], [], []
        for s, k in np.argwhere(values[0] >= (1 - ACTIVE) * values[0].max()):
            row = (self.responses[0], SIGNS[s], self.problem.times[k])
            names.append(f"peak {row[0]}, {row[2]:g} s")
            columns.append(self.exact(u, [row])[row] / self.scale)
            heights.append(1.0)
        labels, smooth = self.limit_names(), self.limit_gradients(u)
        for j in np.flatnonzero(slack <= ACTIVE):
            which, rest = divmod(int(j), 2 * len(self.problem.times))
            if which < len(self.problem.peak_limits):
                response = self.responses[1 + which]
                sign, time = divmod(rest, len(self.problem.times))
                row = (response, SIGNS[sign], self.problem.times[time])
                columns.append(self.exact(u, [row])[row] / self.problem.peak_limits[response])
            else:
                columns.append(-smooth[j])
            names.append(labels[j])
            heights.append(0.0)
        for i, name in enumerate(self.problem.names):
            for at_bound, sign in ((u[i] <= ACTIVE, -1.0), (u[i] >= 1 - ACTIVE, 1.0)):
                if at_bound:
                    names.append(f"{'lower' if sign < 0 else 'upper'} bound of {name}")
                    columns.append(sign * np.eye(n)[i])
                    heights.append(0.0)
        matrix = np.vstack([np.array(columns).T, heights])
        target = np.append(np.zeros(n), 1.0)
        solved = lsq_linear(matrix, target, bounds=(0, np.inf), method="bvls", tol=1e-15)
        residual = float(np.abs(matrix @ solved.x - target).max()) * self.scale / self.height(u)
        active = tuple((n, float(m)) for n, m in zip(names, solved.x, strict=True))
        return Stationarity(residual, self.violation(u), active)


def _slsqp(
    z: NDArray[np.float64],
    slack: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    slope: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    heard: Callable[[NDArray[np.float64]], None],
) -> NDArray[np.float64]:
    """Minimise the last variable with slack >= 0 and the others between 0 and 1."""
    last = np.append(np.zeros(z.size - 1), 1.0)
    found = minimize(
        lambda x: x[-1],
        z,
        jac=lambda _: last,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * (z.size - 1) + [(0.0, None)],
        constraints={"type": "ineq", "fun": slack, "jac": slope},
        callback=heard,
        options={"ftol": 1e-10, "maxiter": ITERATIONS},
    )
    log.debug("SLSQP: %s after %d iterations", found.message, found.nit)
    return found.x
