"""Backward integration of the adjoint: one run a time of interest serves all responses and all sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...codegen.system.executable import ExecutableSystem
from ...codegen.system.functions import state_scales
from ...model.errors import IntegrationError, StepBudgetError
from .integration import Counters, CvodesSettings, Integrator
from .step_budget import naming_fastest_root
from .time_nodes import Interval, interval_before, intervals, time_nodes
from .typical_sizes import TypicalSizes, typical_sizes

WINDOWS, FEW_STEPS = 64, 20_000  # of a flight on which a system seems to grow beyond numbers; steps in each
LARGEST = 1e140  # of a scaled adjoint, whose square is integrated


@dataclass(frozen=True, eq=False)
class AdjointRun:
    """Result of one backward run from t2.

    Attributes
    ----------
    time : float
        t2, s.
    variance : (responses, sources) array
        Unit of the response squared.
    mean : (responses,) array
        Convolution of the weighting function with the known inputs, the part at t2 itself included.
    adjoint_at_start : (n, responses) array
    counters : dict
        CVODES steps, evaluations, Newton setups and failed error tests.
    """

    time: float
    variance: NDArray[np.float64]
    mean: NDArray[np.float64]
    adjoint_at_start: NDArray[np.float64]
    counters: dict[str, int]


@dataclass(frozen=True, eq=False)
class AdjointHistory:
    """Adjoint and weighting functions along one backward run.

    Attributes
    ----------
    times : (k,) array
        Increasing; a discontinuity stands twice, its left and right side.
    adjoint : (k, responses, n) array
    noise : (k, responses, noises) array
        g(t2, t) = B' lambda, from each white noise.
    inputs : (k, responses, inputs) array
        E' lambda, from each known input (the wind straight into the vehicle).
    direct : (responses, inputs) array
        Weight of the delta that the latter holds at t = t2.
    """

    times: NDArray[np.float64]
    adjoint: NDArray[np.float64]
    noise: NDArray[np.float64]
    inputs: NDArray[np.float64]
    direct: NDArray[np.float64]


def adjoint_member(
    numbers: ExecutableSystem, times: Sequence[float], settings: CvodesSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean (times, responses) and variance (times, responses, sources) of one set of numbers.

    Parameters
    ----------
    numbers : ExecutableSystem
        With its tables of the mean response filled in.
    times : sequence of float
        End times, s.
    settings : CvodesSettings

    Raises
    ------
    IntegrationError, StepBudgetError
    """
    solver = AdjointSolver(numbers, settings)
    runs = [solver.run(time) for time in times]
    return np.array([run.mean for run in runs]), np.array([run.variance for run in runs])


class AdjointSolver:
    """Runs the adjoint of a system backward with CVODES."""

    def __init__(self, executable: ExecutableSystem, options: CvodesSettings):
        self._executable, self._options = executable, options
        self._integrator = Integrator(executable.functions.adjoint, options)
        few = replace(options, max_steps=min(options.max_steps, FEW_STEPS))
        self._stopping = Integrator(executable.functions.adjoint, few)
        self._longest = options.longest_interval
        system = executable.system
        self._state_scale = state_scales(system)
        values = executable.parameters
        self._start_covariance = [system.start_covariance_matrix(source, values) for source in system.sources]

    def _output_scales(self, found: TypicalSizes | None) -> NDArray[np.float64]:
        """Return the sizes of the responses by which the adjoint is divided, (n_y,).

        An error of the adjoint counts by the size of its state. The absolute tolerance is one number for all states,
        divided by the sizes that they were declared with; so the state that is largest against that sets the scale.
        """
        declared = np.array([o.scale for o in self._executable.system.outputs])
        if found is None:
            return declared
        largest = max(1.0, float((found.largest_states / self._state_scale).max()))
        return np.where(found.last_outputs > 0, found.last_outputs / largest, declared)

    def _terminal(self, time: float, output_scale: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Return scaled adjoints at t2, G and the known inputs there."""
        last = interval_before(self._executable, time)
        matrices = self._executable.matrices(time, last.low, last.high)
        scaled = self._state_scale[:, None] * matrices["C"].T / output_scale
        return scaled, matrices["G"], matrices["inputs"][:, 0]

    def run(self, time: float) -> AdjointRun:
        """Integrate from t2 = ``time`` back to the start of the system.

        Raises
        ------
        IntegrationError, StepBudgetError
        """
        system = self._executable.system
        node = float(time_nodes(self._executable, [time])[0])
        sizes = typical_sizes(self._executable, node)
        output_scale = self._output_scales(sizes)
        scaled, G, inputs = self._terminal(node, output_scale)
        scaled, quadratures, counters = self._backward(scaled, node, system.start, growing=sizes is None)
        return self._result(time, scaled, quadratures, output_scale, G @ inputs, counters)

    def _result(
        self,
        time: float,
        scaled: NDArray,
        quadratures: NDArray,
        output_scale: NDArray,
        direct: NDArray,
        counters: Counters,
    ) -> AdjointRun:
        """Return statistics from the adjoint at the start and the quadratures over the run, both scaled."""
        s = len(self._executable.system.sources)
        adjoint = scaled / self._state_scale[:, None] * output_scale
        variance = quadratures[:, :s] * output_scale[:, None] ** 2
        for k, covariance in enumerate(self._start_covariance):
            variance[:, k] += np.einsum("ir,ij,jr->r", adjoint, covariance, adjoint)
        mean = quadratures[:, s] * output_scale + direct
        return AdjointRun(time, variance, mean, adjoint, counters.totals)

    def pair_moments(
        self, time: float, pairs: Sequence[tuple[int, ...]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return means and covariances of pairs of responses, by the variances of both and of their sum.

        Parameters
        ----------
        time : float
            t2, s.
        pairs : sequence of (int, int)
            Rows of responses.

        Returns
        -------
        mean : (pairs, 2) array
        covariance : (pairs, sources, 2, 2) array

        Raises
        ------
        IntegrationError, StepBudgetError
        """
        system = self._executable.system
        node = float(time_nodes(self._executable, [time])[0])
        sizes = typical_sizes(self._executable, node)
        output_scale = self._output_scales(sizes)
        scaled, G, inputs = self._terminal(node, output_scale)
        first, second = np.array(pairs).T
        columns = np.concatenate([scaled[:, first], scaled[:, second], scaled[:, first] + scaled[:, second]], axis=1)
        variance, integral, width = np.empty((0, len(system.sources))), np.empty(0), len(system.outputs)
        for begin in range(0, columns.shape[1], width):
            part = np.arange(begin, min(begin + width, columns.shape[1]))
            again = np.resize(part, width)  # a run has as many columns as there are responses
            back, quadratures, _ = self._backward(columns[:, again], node, system.start, growing=sizes is None)
            adjoint = back / self._state_scale[:, None]
            added = [np.einsum("ir,ij,jr->r", adjoint, P, adjoint) for P in self._start_covariance]
            found = quadratures[:, : len(system.sources)] + np.array(added).T
            variance = np.concatenate([variance, found[: part.size]])
            integral = np.concatenate([integral, quadratures[: part.size, len(system.sources)]])
        own, other, together = np.split(variance, 3)
        scale = output_scale[np.array(pairs)]
        mean = np.stack(np.split(integral, 3)[:2], axis=1) * scale + (G @ inputs)[np.array(pairs)]
        covariance = np.empty((*own.shape, 2, 2))
        covariance[..., 0, 0], covariance[..., 1, 1] = own, other
        covariance[..., 0, 1] = covariance[..., 1, 0] = 0.5 * (together - own - other)
        return mean, covariance * (scale[:, :, None] * scale[:, None, :])[:, None]

    def steps(self, adjoint: NDArray[np.float64], time: float, earliest: float) -> int:
        """Return the number of steps from ``time`` to ``earliest`` (s), with adjoints (responses, n) at ``time``."""
        scaled = (adjoint * self._state_scale).T / np.array([o.scale for o in self._executable.system.outputs])
        return self._backward(scaled, time, earliest)[2].totals["nsteps"]

    def _backward(
        self, scaled: NDArray, time: float, earliest: float, growing: bool = False
    ) -> tuple[NDArray, NDArray, Counters]:
        """Return scaled adjoints (n, responses) at ``earliest``, quadratures and counters."""
        system, counters = self._executable.system, Counters()
        quadratures = np.zeros((len(system.outputs), len(system.sources) + 1))
        longest = min(self._longest, (time - earliest) / WINDOWS) if growing and time > earliest else self._longest
        for interval in reversed(intervals(self._executable, earliest, time, longest)):
            states, integrals = self._piece(scaled, interval, time, 1, counters, growing)
            quadratures += integrals
            scaled = states[:, -1].reshape(scaled.shape, order="F")
        return scaled, quadratures, counters

    def _piece(
        self,
        scaled: NDArray,
        interval: Interval,
        time: float,
        points: int,
        counters: Counters,
        growing: bool = False,
    ) -> tuple[NDArray, NDArray]:
        """Return scaled adjoints back along an interval, (n responses, points), and its quadratures; count the work.

        With ``growing`` the numbers are looked at: CVODES works on with infinities for as many steps as it is allowed.
        """
        system, span = self._executable.system, interval.end - interval.begin
        parameters = self._executable.integrator_parameters(interval.end, span, interval.low, interval.high)
        where = f"of the adjoint from {interval.end:g} s back to {interval.begin:g} s (t2 = {time:g} s)"
        with naming_fastest_root(self._executable):
            integrator = self._stopping if growing else self._integrator
            states, integrals, statistics = integrator.run(scaled.ravel("F"), parameters, where, points)
            counters.add(statistics)
            if counters.totals["nsteps"] > self._options.max_steps:
                raise StepBudgetError(self._options.max_steps, f"t = {interval.begin:.6g} s", time=interval.begin)
        if growing and np.abs(states).max(initial=0.0) > LARGEST:
            raise IntegrationError(
                f"the adjoint leaves the range of numbers near {interval.begin:g} s (t2 = {time:g} s); the system "
                "grows without bound (see its roots)"
            )
        return states, integrals[:, -1].reshape(len(system.outputs), len(system.sources) + 1)

    def history(self, time: float, spacing: float) -> AdjointHistory:
        """Return adjoint and weighting functions at points at most ``spacing`` seconds apart."""
        return self.run_with_history(time, spacing)[1]

    def run_with_history(self, time: float, spacing: float) -> tuple[AdjointRun, AdjointHistory]:
        """Return statistics and, from the same integration, adjoint and weighting functions along it.

        Raises
        ------
        IntegrationError, StepBudgetError
        """
        system, counters = self._executable.system, Counters()
        node = float(time_nodes(self._executable, [time])[0])
        output_scale = self._output_scales(typical_sizes(self._executable, node))
        scaled, G, known = self._terminal(node, output_scale)
        quadratures = np.zeros((len(system.outputs), len(system.sources) + 1))
        times, adjoints, noise, inputs = [], [], [], []  # latest first
        for interval in reversed(intervals(self._executable, system.start, node)):
            points = max(1, int(np.ceil((interval.end - interval.begin) / spacing - 1e-9)))
            states, integrals = self._piece(scaled, interval, node, points, counters)
            quadratures += integrals
            columns = np.concatenate([scaled.ravel("F")[:, None], states], axis=1)
            at = np.linspace(interval.end, interval.begin, points + 1)
            B, E = self._executable.input_matrices(at, interval.low, interval.high)
            stacked = columns.T.reshape(points + 1, *scaled.shape[::-1])
            adjoint = stacked / self._state_scale * output_scale[:, None]
            times.append(at)
            adjoints.append(adjoint)
            noise.append(adjoint @ B)
            inputs.append(adjoint @ E)
            scaled = states[:, -1].reshape(scaled.shape, order="F")
        latest_first = (np.concatenate(parts) for parts in (times, adjoints, noise, inputs))
        t, adjoint, from_noise, from_inputs = (part[::-1] for part in latest_first)
        found = self._result(time, scaled, quadratures, output_scale, G @ known, counters)
        return found, AdjointHistory(t, adjoint, from_noise, from_inputs, G)
