"""A grid of steps for many sweeps of one system, chosen once on its nominal numbers: how many steps a second, and when.

Steps of Gauss collocation follow the lightly damped roots alone, so that a fast, well damped root costs nothing. The
rule is found by halving: what a grid and one twice as fine differ by is the error of the first. It serves every member
of a study that has roots like the nominal ones; a member whose roots are faster takes as much finer a grid.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...codegen.sweep.integrator import CompiledSweep
from ...codegen.sweep.segments import GridSteps, SegmentResults, Segments
from ...codegen.system.evaluation import MatrixEvaluator
from ...codegen.system.executable import ExecutableSystem
from ...model.errors import IntegrationError
from .collocation_grid import LIGHT
from .time_nodes import interval_after

log = logging.getLogger(__name__)

LEAST_TOLERANCE = 1e-6  # below, kinks between steps tell
LOOKS = 13  # times at which the nominal roots are looked at
WATCHED = 2  # those of them at which a member's are, where they are fastest
FIRST_PHASE = 1.9  # rad a step at the tolerance of 1e-4, where the search begins
ORDER = 8
TRIES = 4
MARGIN = 1.1  # for the error of the finer grid
WORTH_IT = 1.1  # as long steps, for another try
TOGETHER = 32  # most steps between two sums of covariances: their factors stay in the second-level cache
GAIN = 0.8  # steps of the rule, against those of the explicit formula, that are worth it


@dataclass(frozen=True, eq=False)
class StepRule:
    """How fine a grid is.

    Attributes
    ----------
    times : (k,) array
        s.
    rates : (k,) array
        Steps a second there.
    roots : (k,) array
        The fastest lightly damped root there, rad/s.
    error : float
        Largest relative error of a standard deviation of the nominal numbers.
    tolerance : float
        That it was chosen for.
    fills : bool
        Whether the sweep fills the tables of the mean response itself, so that a member comes without.
    """

    times: NDArray[np.float64]
    rates: NDArray[np.float64]
    roots: NDArray[np.float64]
    error: float
    tolerance: float
    fills: bool = False

    def steps(self, segments: Segments, finer: float = 1.0) -> GridSteps:
        """Return the steps of segments, ``finer`` times as many a second."""
        begin, end = segments.begin, segments.end
        rates = np.maximum(np.interp(begin, self.times, self.rates), np.interp(end, self.times, self.rates))
        counts = np.maximum(1, np.ceil((end - begin) * rates * finer - 1e-9))
        return GridSteps.equal(segments, counts.astype(np.intc))

    def run(self, compiled: CompiledSweep, member: ExecutableSystem, segments: Segments) -> SegmentResults:
        """Sweep a member on its grid, with the error that its roots let expect.

        Raises
        ------
        IntegrationError, DataError
        """
        watched = np.argsort(-self.roots)[:WATCHED]
        own = np.array([_light_root(member, float(time)) for time in self.times[watched]])
        faster = float((own / self.roots[watched]).max(initial=1.0))
        error, finer = self.error * faster**ORDER, 1.0
        if error > self.tolerance:
            finer = (error / self.tolerance) ** (1 / ORDER)
            log.info("the grid is too coarse for a root of %.3g rad/s: %.2g times as many steps", own.max(), finer)
        found = self.swept(compiled, member, segments, finer)
        expected = np.full_like(found.error, error / finer**ORDER)
        return replace(found, error=expected, counters={**found.counters, "refined": int(finer > 1.0)})

    def swept(
        self, compiled: CompiledSweep, member: ExecutableSystem, segments: Segments, finer: float = 1.0
    ) -> SegmentResults:
        """Sweep on the grid, ``finer`` times as fine.

        Raises
        ------
        IntegrationError, DataError
        """
        pieces = -(-self.steps(segments, finer).counts // TOGETHER)
        cut = segments.cut(pieces)
        found, at = compiled.on_grid(member, cut, self.steps(cut, finer), fill=self.fills), np.cumsum(pieces) - 1
        return replace(found, covariance=found.covariance[at], mean=found.mean[at], error=found.error[at])


def step_rule(
    compiled: CompiledSweep,
    nominal: ExecutableSystem,
    segments: Segments,
    tolerance: float,
    explicit_steps: int,
    fills: bool = False,
) -> StepRule | None:
    """Return the rule for a tolerance; None where explicit steps are no more, or no grid holds it.

    Parameters
    ----------
    compiled : CompiledSweep
    nominal : ExecutableSystem
        With its tables of the mean response filled in.
    segments : Segments
    tolerance : float
        Relative, of every standard deviation.
    explicit_steps : int
        Those of the explicit formula at the same tolerance.
    fills : bool
        Let the sweep fill the tables of the mean response itself.

    Raises
    ------
    DataError
    """
    if tolerance < LEAST_TOLERANCE or not compiled.takes_a_grid:
        return None
    start, end = segments.start, float(segments.end[-1])
    times = start + (end - start) * (np.arange(LOOKS) + 0.5) / LOOKS
    roots = np.array([_light_root(nominal, float(time)) for time in times])
    roots = np.maximum(roots, 1.0 / (end - start))
    phase, found = FIRST_PHASE * (tolerance / 1e-4) ** (1 / ORDER), None
    for _ in range(TRIES):
        rule = StepRule(times, roots / phase, roots, 0.0, tolerance, fills)
        if rule.steps(segments).counts.sum() > GAIN * explicit_steps:
            break
        try:
            error = MARGIN * _apart(*(rule.swept(compiled, nominal, segments, finer) for finer in (1.0, 2.0)))
        except IntegrationError:
            break
        wanted = (0.4 * tolerance / max(error, 1e-3 * tolerance)) ** (1 / ORDER)
        if error <= 0.5 * tolerance:
            found = replace(rule, error=error)
            if wanted < WORTH_IT:
                break
            phase *= min(wanted, 2.0)
        elif found is not None:
            break
        else:
            phase *= max(0.5, min(0.9, wanted))
    return found


def _light_root(executable: ExecutableSystem, time: float) -> float:
    here = interval_after(executable, time)
    (A,) = MatrixEvaluator(executable, ("A",))(time, here.low, here.high)
    if not np.isfinite(A).all():
        return 0.0  # who steps says what is wrong, and when
    roots = np.linalg.eigvals(A)
    return float(np.abs(roots[-roots.real < LIGHT * np.abs(roots)]).max(initial=0.0))


def _apart(coarse: SegmentResults, fine: SegmentResults) -> float:
    """Return the largest relative difference of a standard deviation."""
    a, b = (np.sqrt(np.maximum(np.einsum("ksrr->ksr", found.covariance), 0.0)) for found in (coarse, fine))
    return float(np.abs(a / np.where(b > 0, b, 1.0) - 1.0)[b > 0].max(initial=0.0))
