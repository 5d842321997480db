"""Load-relief design: the parameters that lower the peak of |mean| + 3 sigma under limits, and what that costs."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.deprecation import warn_deprecated
from ...model.errors import IntegrationError, UnknownNameError
from ..present.notebook import html_of
from ..present.progress import each, steps
from ..solvers.adjoint import AdjointSolver
from ..solvers.integration import CvodesSettings
from ..statistics.larger_side import larger_side, side
from ..statistics.peaks_of_resultants import laws_by_adjoint
from ..statistics.resultants import labels_of, outputs_of
from ..study import Study
from .peaks import SIGNS, three_sigma
from .problem import DesignProblemError, LoadReliefProblem, family_words
from .search import ACTIVE, Search, Stationarity

CLOSE = 2e-3  # of a peak: end times this close below it are recomputed too
AGREEMENT = 1e-6
ON_A_BOUND = 1e-12  # of the span between bounds


class InfeasibleDesignError(DesignProblemError):
    """The limits cannot all be met.

    Attributes
    ----------
    limit : str
        The limit that is missed by most at the closest position found.
    allowed, closest : float
        What was asked for and what was reached, SI.
    values : dict of str to float
        The parameters there.
    """

    def __init__(self, limit: str, allowed: float, closest: float, values: dict[str, float]):
        self.limit, self.allowed, self.closest, self.values = limit, allowed, closest, values
        where = ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
        super().__init__(
            f"no values between the bounds were found that meet all limits: {limit} is {closest:.4g} at the closest "
            f"({where}) and {allowed:.4g} was asked for; loosen it or another limit, or widen the bounds"
        )


@dataclass(frozen=True)
class Quantity:
    """A number that a design changes.

    Attributes
    ----------
    name, unit : str
    before, after : float
        SI.
    time_before, time_after : float
        End time or frozen time of the peak or of the least damping, s.
    limit : float or None
    side : str
        Of a peak: the side on which it lies after the design; a resultant has none.
    """

    name: str
    unit: str
    before: float
    after: float
    time_before: float
    time_after: float
    limit: float | None = None
    side: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class DesignResult:
    """A design.

    Attributes
    ----------
    problem : LoadReliefProblem
    values, start : dict of str to float
        Parameters designed, and as they were.
    quantities : tuple of Quantity
        Peaks and dampings before and after.
    history : tuple of (float, float)
        Height of the peak (SI) and largest relative violation of a limit at every iteration.
    stationarity : Stationarity
    evaluations, gradients : int
        Sweeps, and positions at which exact derivatives were taken.
    seconds : float
    """

    problem: LoadReliefProblem
    values: dict[str, float]
    start: dict[str, float]
    quantities: tuple[Quantity, ...]
    history: tuple[tuple[float, float], ...]
    stationarity: Stationarity
    evaluations: int
    gradients: int
    seconds: float

    @property
    def converged(self) -> bool:
        """Whether the design is a stationary point at which all limits hold, to 1e-6."""
        return max(self.stationarity.residual, self.stationarity.violation) <= ACTIVE

    @property
    def study(self) -> Study:
        """The study with the designed parameters."""
        return self.problem.study.with_parameters(self.values)

    @property
    def peak(self) -> float:
        """Peak of |mean| + 3 sigma that was minimised, SI."""
        return self.quantities[0].after

    def __repr__(self) -> str:
        lines = [f"DesignResult of {self.problem.study.system.name}, {'' if self.converged else 'not '}stationary"]
        lines += [f"{name}: {self.start[name]:.5g} before, {value:.5g} after" for name, value in self.values.items()]
        lines += [f"{q.name}: {q.before:.5g} before, {q.after:.5g} {q.unit} after" for q in self.quantities]
        return "\n  ".join(lines)

    def _repr_html_(self) -> str:
        return html_of(repr(self))


def design(
    problem: LoadReliefProblem,
    start: Mapping[str, float] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> DesignResult:
    """Return the parameters with the lowest peak that meet the limits: a local optimum, from the present values.

    Parameters
    ----------
    problem : LoadReliefProblem
    start : mapping of str to float, optional
        Other values to start from.
    progress : callable, optional
        Called with the height of the peak (SI) after each iteration.

    Returns
    -------
    DesignResult

    Raises
    ------
    InfeasibleDesignError
    """
    began = time.monotonic()
    search = Search(problem)
    u = problem.start if start is None else _position(problem, start)
    unit = labels_of(problem.study, problem.response)[0].unit
    with steps("looking for a lower peak") as line:
        history = [_history(search, u)]

        def heard(at: NDArray[np.float64]) -> None:
            history.append(_history(search, at))
            line.reached(len(history), text=f"iteration {len(history)}, peak now {history[-1][0]:.4g} {unit}")
            progress(history[-1][0])

        if search.violation(u) > ACTIVE:
            u = search.find_feasible(u)
        if search.violation(u) > ACTIVE:
            raise _infeasible(search, u)
        u = search.descend(u, heard)
    return DesignResult(
        problem,
        _values(problem, u),
        {name: problem.study.parameters[name].value for name in problem.names},
        tuple(_quantities(search, problem.start, u)),
        tuple(history),
        search.stationarity(u),
        search.evaluations,
        search.derivatives,
        time.monotonic() - began,
    )


@dataclass(frozen=True)
class RecomputedPeak:
    """|mean| + 3 sigma of a response, or a resultant's level, at an end time, by the design's own engine and CVODES."""

    response: str
    time: float
    designed: float
    cvodes: float

    @property
    def difference(self) -> float:
        """Relative."""
        return abs(self.designed - self.cvodes) / self.cvodes

    @property
    def agrees(self) -> bool:
        return self.difference <= AGREEMENT


def recompute_peaks(result: DesignResult, relative_tolerance: float = 1e-11) -> list[RecomputedPeak]:
    """Compute the peaks of a design again by CVODES, the mean response included, at all end times near a peak.

    Raises
    ------
    IntegrationError
    """
    problem, study = result.problem, result.study
    responses = [problem.response, *problem.peak_limits]
    peaks = three_sigma(study, responses, problem.times)
    if peaks is None:
        raise IntegrationError("the peaks of the design are beyond numbers; see its dampings and growth")
    options = CvodesSettings(relative_tolerance=relative_tolerance)
    solver = AdjointSolver(study.mean.fill(study.executable), options)
    largest = peaks.max(axis=1)
    near = largest >= (1 - CLOSE) * largest.max(axis=1, keepdims=True)
    found = []
    for k in each(np.flatnonzero(near.any(axis=0)), "peaks again by CVODES"):
        run = solver.run(problem.times[k])
        for r in np.flatnonzero(near[:, k]):
            of = outputs_of(study, responses[r])
            if len(of) == 2:
                value = float(laws_by_adjoint(study, solver, problem.times[k], [responses[r]]).percentile()[0])
                found.append(RecomputedPeak(responses[r], problem.times[k], float(largest[r, k]), value))
                continue
            row = study.system.output_index(responses[r])
            value = larger_side(float(run.mean[row]), float(np.sqrt(run.variance[row].sum())))
            found.append(RecomputedPeak(responses[r], problem.times[k], float(largest[r, k]), float(value)))
    return found


@dataclass(frozen=True)
class TradePoint:
    """The lowest peak under one limit; None where the limit cannot be met, with the closest value then."""

    limit: float
    result: DesignResult | None
    closest: float | None = None


def trade(
    problem: LoadReliefProblem,
    response: str,
    limits: Sequence[float],
) -> list[TradePoint]:
    """Return designs under a sequence of limits on the peak of a response, the loosest first, each from the last.

    Raises
    ------
    DesignProblemError, UnknownNameError
    """
    points: list[TradePoint] = []
    start: Mapping[str, float] | None = None
    for limit in each(sorted(limits, reverse=True), f"trade against {response}"):
        if points and points[-1].result is None:  # a tighter limit cannot be met either
            points.append(TradePoint(limit, None, points[-1].closest))
            continue
        try:
            found = design(replace(problem, peak_limits={**problem.peak_limits, response: limit}), start)
            start = found.values
            points.append(TradePoint(limit, found))
        except InfeasibleDesignError as error:
            points.append(TradePoint(limit, None, error.closest))
    return points


def _position(problem: LoadReliefProblem, values: Mapping[str, float]) -> NDArray[np.float64]:
    for name in values:
        if name not in problem.names:
            raise UnknownNameError("parameter of this design", name, problem.names)
    given = problem.low + problem.span * problem.start
    for i, name in enumerate(problem.names):
        given[i] = values.get(name, given[i])
    return np.clip((given - problem.low) / problem.span, 0.0, 1.0)


def _values(problem: LoadReliefProblem, u: NDArray[np.float64]) -> dict[str, float]:
    u = np.where(np.abs(u - np.round(u)) < ON_A_BOUND, np.round(u), u)  # 0 and 1 are the bounds
    return dict(zip(problem.names, (problem.low + problem.span * u).tolist(), strict=True))


def _history(search: Search, u: NDArray[np.float64]) -> tuple[float, float]:
    return search.height(u), search.violation(u)


def _quantities(search: Search, before: NDArray[np.float64], after: NDArray[np.float64]) -> list[Quantity]:
    """Return peaks, then least dampings, of two positions."""
    problem, points = search.problem, (search.point(before), search.point(after))
    found = []
    for r, response in enumerate(search.responses):
        of = labels_of(problem.study, response)
        unit = of[0].unit
        largest = [p.peaks[r].max(axis=0) for p in points]
        times = [problem.times[int(np.argmax(x))] for x in largest]
        heights = [float(x.max()) for x in largest]
        after_by_sign = points[1].peaks[r].max(axis=1)
        found.append(
            Quantity(
                f"peak {response}",
                unit,
                *heights,
                *times,
                limit=problem.peak_limits.get(response),
                side=side(SIGNS[int(np.argmax(after_by_sign))]) if len(of) == 1 else "",
            )
        )
    frozen = [p.frozen for p in points if p.frozen is not None]
    if search.roots and len(frozen) == len(points):
        for f, family in enumerate(search.families):
            least = [x.damping[:, f] for x in frozen]
            times = [problem.frozen_times[int(np.argmin(x))] for x in least]
            values = [float(x.min()) for x in least]
            limit = problem.damping_limits.get(family)
            found.append(Quantity(f"damping {family_words(family)}", "1", *values, *times, limit=limit))
        times = [problem.frozen_times[int(np.argmax(x.growth))] for x in frozen]
        values = [float(x.growth.max()) for x in frozen]
        found.append(Quantity("growth", "1/s", *values, *times, limit=problem.largest_growth))
    return found


def _infeasible(search: Search, u: NDArray[np.float64]) -> InfeasibleDesignError:
    """Return the verdict on a compromise: how close the worst limit can come when the others hold, if they can."""
    name = search.limit_names()[int(np.argmin(search.limits(u)))]
    what = name.rpartition(", ")[0]
    others = search.find_feasible(u, elastic=what)
    rest = [s for s, n in zip(search.limits(others), search.limit_names(), strict=True) if not n.startswith(what)]
    u = others if min(rest, default=0.0) >= -ACTIVE else u
    words = {f"damping {f}": f"damping {family_words(f)}" for f in search.problem.damping_limits}.get(what, what)
    quantity = next(q for q in _quantities(search, u, u) if q.name == words)
    assert quantity.limit is not None
    at = f"{quantity.name} [{quantity.unit}] at {quantity.time_after:g} s"
    return InfeasibleDesignError(at, quantity.limit, quantity.after, _values(search.problem, u))


_SUCCESSORS = {"verify_design": recompute_peaks, "Verification": RecomputedPeak}


def __getattr__(name: str) -> object:
    if name not in _SUCCESSORS:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    successor = _SUCCESSORS[name]
    warn_deprecated(f"{__name__}.{name}", f"{__name__}.{successor.__name__}")
    return successor
