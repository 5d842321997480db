"""All end times in one pass: the generated sweep integrator alone, with weighting functions, and in batches."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...codegen.sweep.compiled import sweep_of
from ...codegen.sweep.integrator import CompiledSweep
from ...codegen.sweep.segments import SegmentResults, Segments
from ...codegen.system.evaluation import MatrixEvaluator
from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import state_scales
from ...codegen.toolchain.cache import CacheError
from ...codegen.toolchain.interruption import Workers
from ...codegen.toolchain.library import InterpreterWarning
from ...model.errors import AscentwindError, IntegrationError, TimeRangeError
from ...model.system.linear_system import LinearSystem
from ..present.progress import each
from .cores import available_cores
from .fixed_grid import LEAST_TOLERANCE as GRID_TOLERANCE
from .fixed_grid import StepRule, step_rule
from .mean_response import FillMeans, MeanResponse, Respond, with_mean_tables
from .step_budget import at_most, check_explicit_steps, naming_fastest_root
from .time_nodes import Interval, intervals, on_flight, same_time, time_nodes
from .tolerances import check_relative_tolerance
from .typical_sizes import mean_misjudged, misjudged, sizes_of_sweep

log = logging.getLogger(__name__)

LONGEST_SEGMENT = 1.0  # s; weights of the error control are renewed and the Gramians stay well scaled
MOST_SEGMENTS = 5000  # for the sake of that, on a flight of hours or days
LEAST_TOLERANCE = 1e-12
MANY = 16  # sets of a batch, for which a grid is looked for
MOST_STEPS = 100_000  # of SciPy's DOP853, where nothing is compiled


def available_sweep(executable: ExecutableSystem) -> CompiledSweep | None:
    """Return the compiled sweep of a system; None where it is interpreted, or the cache cannot take the sweep.

    Warns
    -----
    InterpreterWarning
        Of the second.
    """
    if executable.shared_library is None:
        return None
    try:
        return sweep_of(executable)
    except CacheError as error:
        warnings.warn(InterpreterWarning(f"CVODES takes the place of the sweep: {error}"), stacklevel=3)
        return None


@dataclass(frozen=True, eq=False)
class WeightingFunctions:
    """The adjoint of every response and end time at the ends of the segments, from the backward sweep.

    Attributes
    ----------
    times : (m,) array
        s.
    noise : (k, m, responses, noises) array
        g(t2, t) = B' lambda for each end time; zero after the end time.
    inputs : (k, m, responses, inputs) array
        E' lambda, without the delta that G puts at t = t2.
    """

    times: NDArray[np.float64]
    noise: NDArray[np.float64]
    inputs: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Statistics of all responses at all end times.

    Attributes
    ----------
    times : (k,) array
        End times, s.
    covariance : (k, sources, responses, responses) array
        Between the responses, each source by itself.
    mean : (k, responses) array
    error_estimate : (k, sources, responses) array
        Relative error of the standard deviation, from the embedded formulas.
    counters : dict
        Steps, rejected steps, evaluations of the state matrix.
    weighting : WeightingFunctions or None
    """

    times: NDArray[np.float64]
    covariance: NDArray[np.float64]
    mean: NDArray[np.float64]
    error_estimate: NDArray[np.float64]
    counters: dict[str, int]
    weighting: WeightingFunctions | None = None

    @property
    def variance(self) -> NDArray[np.float64]:
        """Variance by end time, response and source, (k, responses, sources)."""
        return np.einsum("ksrr->krs", self.covariance)


class BatchError(IntegrationError):
    """Some sets of a batch failed.

    Attributes
    ----------
    failed : dict of int to AscentwindError
        By number of the set.
    completed : dict of int to SweepResult
        The others, computed to the end.
    """

    def __init__(self, failed: dict[int, AscentwindError], completed: dict[int, SweepResult]):
        self.failed, self.completed = failed, completed
        first = min(failed)
        super().__init__(
            f"parameter set {first}: {failed[first]} ({len(failed)} of {len(failed) + len(completed)} sets failed; "
            "'completed' of this error holds the results of the others)"
        )


def sweep(
    compiled: CompiledSweep,
    executable: ExecutableSystem,
    times: ArrayLike,
    *,
    relative_tolerance: float = 1e-6,
    longest_interval: float = float("inf"),
    weighting_spacing: float | None = None,
    responses: Sequence[str] | None = None,
) -> SweepResult:
    """Sweep once over the flight for all end times.

    Parameters
    ----------
    compiled : CompiledSweep
    executable : ExecutableSystem
        Numbers: parameters, and tables with those of the mean response filled in.
    times : (k,) array
        End times, increasing, from the start on, s. One that falls on a discontinuity is taken from the left.
    relative_tolerance : float
        Of every standard deviation, between 1e-12 and 1e-2.
    longest_interval : float
        Flight is looked at in pieces no longer than this, s.
    weighting_spacing : float, optional
        Keep the weighting functions at points at most this many seconds apart.
    responses : sequence of str, optional
        Those wanted; all are computed, and only these are refused where white noise reaches them directly.

    Raises
    ------
    TimeRangeError, DirectNoiseError, IntegrationError, DataError
    """
    ends = _checked(compiled.system, times, relative_tolerance, responses)
    nodes = time_nodes(executable, ends)
    longest = longest_segment(float(ends[-1] - compiled.system.start))
    segments = _segments_of(executable, nodes, min(longest, longest_interval, weighting_spacing or longest))
    result = swept(compiled, executable, segments, relative_tolerance, steps=weighting_spacing is not None)
    found = _at_nodes(executable, segments, nodes, ends, result)
    if result.transition is None:
        return found
    at = _segment_of(segments, nodes)
    return replace(found, weighting=_weighting_functions(executable, segments, at, result.transition))


def _checked(
    system: LinearSystem, times: ArrayLike, relative_tolerance: float, responses: Sequence[str] | None
) -> NDArray[np.float64]:
    """Return end times after all that is asked was checked."""
    ends = check_times(system, times)
    check_relative_tolerance(relative_tolerance, LEAST_TOLERANCE)
    system.refuse_direct_noise(system.output_names if responses is None else responses)
    return ends


def _at_nodes(
    executable: ExecutableSystem,
    segments: Segments,
    nodes: NDArray[np.float64],
    ends: NDArray[np.float64],
    result: SegmentResults,
) -> SweepResult:
    """Take from the ends of segments what was asked for; at the start nothing has acted yet."""
    at = _segment_of(segments, nodes)
    found = result.covariance[at], result.mean[at], result.error[at]
    if at[0] < 0:
        for array, value in zip(found, _at_start(executable, segments), strict=True):
            array[at < 0] = value
    return SweepResult(ends, *found, result.counters)


def _segment_of(segments: Segments, nodes: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the number of the segment that ends at each node; -1 at the start."""
    return np.where(nodes > segments.start, np.searchsorted(segments.end, nodes), -1)


def _segments_of(executable: ExecutableSystem, nodes: NDArray[np.float64], longest: float) -> Segments:
    """Return the segments to the last of the nodes of the end times."""
    system = executable.system
    # an end time at the start needs no integration, only a segment to read it in
    last = nodes[-1] if nodes[-1] > system.start else min(system.end, system.start + longest)
    return flight_segments(executable, (*np.unique(nodes[nodes < last]).tolist(), float(last)), longest)


def _on_grid(
    compiled: CompiledSweep, member: ExecutableSystem, ends: NDArray[np.float64], rule: StepRule
) -> SweepResult | None:
    """Sweep on a grid; None where that fails and controlled steps may not."""
    try:
        nodes = time_nodes(member, ends)
        segments = _segments_of(member, nodes, longest_segment(float(ends[-1] - compiled.system.start)))
        return _at_nodes(member, segments, nodes, ends, rule.run(compiled, member, segments))
    except IntegrationError as error:
        log.info("not on the grid: %s", error)
        return None


def rule_for(
    compiled: CompiledSweep,
    numbers: ExecutableSystem,
    times: ArrayLike,
    *,
    relative_tolerance: float,
    fill: FillMeans = with_mean_tables,
) -> StepRule | None:
    """Return the grid's rule for many sets of numbers like these; None where controlled steps serve them better.

    It costs some three sweeps. Arguments as of :func:`sweep_member`.
    """
    system = compiled.system
    if relative_tolerance < GRID_TOLERANCE or not compiled.takes_a_grid:
        return None
    try:
        ends = check_times(system, times)
        nominal = fill(numbers, forward_mean(compiled, 1e-2 * relative_tolerance))
        segments = _segments_of(nominal, time_nodes(nominal, ends), longest_segment(float(ends[-1] - system.start)))
        controlled = swept(compiled, nominal, segments, relative_tolerance, steps=False).counters["steps"]
        fills = compiled.fills_means and fill is with_mean_tables
        return step_rule(compiled, nominal, segments, relative_tolerance, controlled, fills)
    except AscentwindError:
        return None  # the members say what is wrong


def longest_segment(flight: float) -> float:
    """Return the length (s) of the longest segment of a flight (s)."""
    return max(LONGEST_SEGMENT, flight / MOST_SEGMENTS)


def swept(
    compiled: CompiledSweep, executable: ExecutableSystem, segments: Segments, tolerance: float, *, steps: bool
) -> SegmentResults:
    """Sweep over segments with typical sizes of the system; a second time where they turn out to be misjudged.

    ``steps`` keeps what each segment does to the states.

    Raises
    ------
    IntegrationError, DataError
    """
    last = float(segments.end[-1])
    with naming_fastest_root(executable):
        sizes = sizes_of_sweep(executable, last)
        result = compiled.run(executable, segments, tolerance, sizes, steps=steps)
        if misjudged(sizes, result.covariance):
            sizes = sizes_of_sweep(executable, last, trust=False)
            result = compiled.run(executable, segments, tolerance, sizes, steps=steps)
    return result


def _at_start(
    executable: ExecutableSystem, segments: Segments
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return covariances, mean and their error before any noise has acted."""
    system = executable.system
    matrices = executable.matrices(segments.start, segments.low[0], segments.high[0])
    covariances = [system.start_covariance_matrix(source, executable.parameters) for source in system.sources]
    covariance = np.array([matrices["C"] @ P @ matrices["C"].T for P in covariances])
    return covariance, (matrices["G"] @ matrices["inputs"])[:, 0], 0.0


def forward_mean(compiled: CompiledSweep, relative_tolerance: float = 1e-9) -> Respond:
    """Return what computes the mean response at given times by the sweep's own forward mean."""

    def mean(of: ExecutableSystem, times: NDArray[np.float64]) -> MeanResponse:
        pieces = intervals(of, float(times[0]), float(times[-1]))
        stops = np.array([p.end for p in pieces])
        nearest = np.abs(stops[:, None] - times[np.clip(np.searchsorted(times, stops)[:, None] - [0, 1], 0, None)])
        within = stops[nearest.min(axis=1) > same_time(of.system, times)]
        ends = np.unique(np.concatenate([times[1:], within]))
        which = np.searchsorted([p.end for p in pieces], ends)
        low, high = (np.array([getattr(p, side) for p in pieces])[which] for side in ("low", "high"))
        segments = Segments(float(times[0]), ends, low, high)
        sizes = sizes_of_sweep(of, float(times[-1]))
        with naming_fastest_root(of):
            states, outputs, _ = compiled.mean_history(of, segments, relative_tolerance, sizes)
            if mean_misjudged(sizes, states):
                sizes = sizes_of_sweep(of, float(times[-1]), trust=False)
                states, outputs, _ = compiled.mean_history(of, segments, relative_tolerance, sizes)
        asked = np.concatenate([[0], 1 + np.searchsorted(ends, times[1:])])
        return MeanResponse(times, states[asked], outputs[asked])

    return mean


def sweep_member(
    compiled: CompiledSweep,
    numbers: ExecutableSystem,
    times: ArrayLike,
    *,
    relative_tolerance: float,
    responses: Sequence[str] | None = None,
    fill: FillMeans = with_mean_tables,
    rule: StepRule | None = None,
) -> SweepResult:
    """Sweep one set of numbers, its tables of the mean response made for it at a hundredth of the tolerance.

    Parameters
    ----------
    compiled : CompiledSweep
    numbers : ExecutableSystem
        Parameters and tables of the member.
    times, relative_tolerance, responses
        As for :func:`sweep`.
    fill : callable
        Of a system and what computes its linear mean, that gives the system with its tables of the mean.
    rule : StepRule, optional
        Of the steps of a grid, instead of steps that the tolerance controls; these follow where the grid fails.

    Raises
    ------
    TimeRangeError, DirectNoiseError, IntegrationError, DataError
    """
    ends = _checked(compiled.system, times, relative_tolerance, responses)
    respond = forward_mean(compiled, 1e-2 * relative_tolerance)
    # at the start nothing has stepped yet that could fill a table
    fills = rule is not None and rule.fills and time_nodes(numbers, ends[:1])[0] > compiled.system.start
    member = numbers if fills else fill(numbers, respond)
    if rule is not None:
        found = _on_grid(compiled, member, ends, replace(rule, fills=fills))
        if found is not None:
            return found
    if fills:
        member = fill(numbers, respond)
    return sweep(compiled, member, ends, relative_tolerance=relative_tolerance, responses=responses)


def batch(
    compiled: CompiledSweep,
    executable: ExecutableSystem,
    parameter_sets: Sequence[NDArray[np.float64]] | NDArray[np.float64],
    times: ArrayLike,
    *,
    relative_tolerance: float = 1e-4,
    threads: int | None = None,
    fill: FillMeans = with_mean_tables,
) -> list[SweepResult]:
    """Sweep many parameter sets, one after another on each of several threads.

    Where there are enough of them, and it costs less, they share the rule of a grid (:class:`StepRule`), chosen on the
    numbers of ``executable``.

    Parameters
    ----------
    compiled : CompiledSweep
    executable : ExecutableSystem
        Tables common to all sets; those of the mean response are computed anew for each set.
    parameter_sets : (n, parameters) array or sequence
    times, relative_tolerance
        As for ``sweep``; the mean tables are made at a hundredth of the tolerance.
    threads : int, optional
        All cores by default.
    fill : callable
        As for :func:`sweep_member`.

    Raises
    ------
    IntegrationError
        If more threads are asked for than there are cores.
    BatchError
        If a set fails; it holds the results of the others.
    """
    cores = available_cores()
    threads = cores if threads is None else threads
    if not 1 <= threads <= cores:
        raise IntegrationError(f"{threads} threads were asked for and there are {cores} cores; choose 1 to {cores}")

    rule = None
    if len(parameter_sets) >= MANY:
        rule = rule_for(compiled, executable, times, relative_tolerance=relative_tolerance, fill=fill)

    def one(values: NDArray[np.float64]) -> SweepResult | AscentwindError:
        try:
            member = executable.with_numbers(parameters=np.asarray(values, float))
            return sweep_member(compiled, member, times, relative_tolerance=relative_tolerance, fill=fill, rule=rule)
        except AscentwindError as error:
            return error

    with Workers(threads) as pool:
        found = list(each(pool.map(one, parameter_sets), "members", len(parameter_sets)))
    completed = {k: member for k, member in enumerate(found) if isinstance(member, SweepResult)}
    if len(completed) < len(found):
        raise BatchError({k: e for k, e in enumerate(found) if isinstance(e, AscentwindError)}, completed)
    return list(completed.values())


def interpreted_weighting(executable: ExecutableSystem, times: ArrayLike, spacing: float) -> WeightingFunctions:
    """Return the weighting functions without compiled code: transition matrices of the segments by SciPy's DOP853.

    Parameters
    ----------
    executable : ExecutableSystem
    times : (k,) array
        End times, increasing, after the start, s.
    spacing : float
        Longest segment, s.

    Raises
    ------
    TimeRangeError, IntegrationError, StepBudgetError
    """
    system, ends = executable.system, check_times(executable.system, times)
    n, nodes = len(system.states), time_nodes(executable, ends)
    last = nodes[-1] if nodes[-1] > system.start else min(system.end, system.start + spacing)
    segments = flight_segments(executable, (*np.unique(nodes[nodes < last]).tolist(), float(last)), spacing)
    check_explicit_steps(executable, intervals(executable, system.start, float(last)), MOST_STEPS)
    A = MatrixEvaluator(executable, ("A",))
    scale, transitions, begin = state_scales(system), [], system.start
    for end, low, high in zip(segments.end, segments.low, segments.high, strict=True):

        def rate(t: float, y: NDArray[np.float64], low: float = low, high: float = high) -> NDArray[np.float64]:
            (matrix,) = A(t, low, high)
            return ((matrix * scale / scale[:, None]) @ y.reshape(n, n)).ravel()

        budgeted = at_most(rate, MOST_STEPS, "t = {:.6g} s")
        found = scipy.integrate.solve_ivp(budgeted, (begin, end), np.eye(n).ravel(), "DOP853", rtol=1e-9, atol=1e-12)
        if not found.success:
            raise IntegrationError(f"the transition from {begin:g} s to {end:g} s: {found.message}")
        transitions.append(found.y[:, -1].reshape(n, n) * scale[:, None] / scale)
        begin = end
    return _weighting_functions(executable, segments, _segment_of(segments, nodes), np.array(transitions))


def check_times(system: LinearSystem, times: ArrayLike) -> NDArray[np.float64]:
    """Return end times as an array.

    Raises
    ------
    TimeRangeError
        If there is none, or one is off the flight, not finite, or not after the one before.
    """
    ends = np.atleast_1d(np.asarray(times, dtype=float))
    if ends.ndim != 1 or ends.size == 0:
        raise TimeRangeError("the sweep needs at least one end time")
    inside = on_flight(system, ends)
    if not inside.all():
        raise TimeRangeError(
            f"end time {ends[np.argmin(inside)]:g} s is off the flight of '{system.name}'; choose times from "
            f"{system.start:g} s to {system.end:g} s"
        )
    if not (np.diff(ends) > 0).all():
        raise TimeRangeError(f"end times must increase; look after {ends[np.argmin(np.diff(ends) > 0)]:g} s")
    return ends


def flight_segments(executable: ExecutableSystem, end_times: tuple[float, ...], longest: float) -> Segments:
    """Cut the flight at end times and discontinuities into segments no longer than ``longest`` seconds."""
    start = executable.system.start
    return _segments(start, tuple(intervals(executable, start, end_times[-1])), end_times, longest)


@lru_cache(maxsize=16)
def _segments(
    start: float, pieces_of_flight: tuple[Interval, ...], end_times: tuple[float, ...], longest: float
) -> Segments:
    """Cut intervals at end times; kept, because the members of a batch often ask for the same."""
    times = np.array(end_times)
    ends, low, high = [], [], []
    for interval in pieces_of_flight:
        inside = times[(times > interval.begin) & (times < interval.end)]
        marks = np.concatenate([[interval.begin], inside, [interval.end]])
        for a, b in pairwise(marks):
            pieces = max(1, int(np.ceil((b - a) / longest - 1e-9)))
            ends.append(np.append(np.linspace(a, b, pieces + 1)[1:-1], b))
            low.append(np.full(pieces, interval.low))
            high.append(np.full(pieces, interval.high))
    return Segments(start, np.concatenate(ends), np.concatenate(low), np.concatenate(high))


def _weighting_functions(
    executable: ExecutableSystem, segments: Segments, at: NDArray[np.intp], transition: NDArray[np.float64]
) -> WeightingFunctions:
    """Run all adjoints backward over the segments; a column joins the block at its end time."""
    system = executable.system
    n, r, k, m = len(system.states), len(system.outputs), at.size, segments.end.size + 1
    times = np.concatenate([[segments.start], segments.end])
    noise = np.zeros((m, k * r, len(system.noises)))
    inputs = np.zeros((m, k * r, len(system.input_names)))
    evaluate = MatrixEvaluator(executable, ("C", "B", "E"))
    rows = np.zeros((k * r, n))
    joins = {int(segment): r * int(np.argmax(at == segment)) for segment in at}  # the first of the ends of a segment
    first = k * r
    for point in range(m - 1, -1, -1):
        segment = max(point - 1, 0)  # a point belongs to the segment that it ends: the left side of a jump
        C, B, E = evaluate(float(times[point]), segments.low[segment], segments.high[segment])
        if point < m - 1:
            rows[first:] = rows[first:] @ transition[point]
        if point - 1 in joins:
            rows[joins[point - 1] : first] = np.tile(C, ((first - joins[point - 1]) // r, 1))
            first = joins[point - 1]
        noise[point, first:] = rows[first:] @ B
        inputs[point, first:] = rows[first:] @ E
    by_end = (array.reshape(m, k, r, -1).swapaxes(0, 1) for array in (noise, inputs))
    return WeightingFunctions(times, *by_end)
