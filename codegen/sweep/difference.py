"""Every loaded sweep against CasADi's interpreter, over a hundredth of a second or less of flight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError, IntegrationError
from ...model.tables import table_values
from ..system.functions import declared_sizes, state_scales
from ..system.nominal import NominalNumbers
from .integrator import CompiledSweep
from .runge_kutta import DOP853
from .segments import GridSteps, Segments

AGREEMENT = 1e-7  # of scaled numbers; a wrong library is off in the first digits
STEP_TIMES_ROOT, LONGEST, SHORTEST = 0.1, 1e-2, 1e-6  # s, of what is integrated; the interpreter takes one step
POINTS = 3  # one that agrees is enough: an undeclared jump may lie within another
TOLERANCE = 1e-8
LEAST_SIZE = 1e-10  # of the largest, for a second try
LEAST_CHANGE = 1e-6  # of the identity: below, what a step adds to it drowns in rounding


def difference_from_interpreter(sweep: CompiledSweep, seed: int = 504) -> float:
    """Return how far covariances, mean and transition of a sweep are from those of CasADi's interpreter, scaled.

    Zero where there is nothing to compare: the equations give no finite numbers, or are far too fast for any sweep.
    """
    random, numbers = np.random.default_rng(seed), NominalNumbers(sweep.system)
    ahead = 1.0 if sweep.system.conditions else 1e3  # s; no switches are looked for where nobody asks for them
    begin, end = sweep.system.start, min(sweep.system.end, sweep.system.start + ahead)
    smallest = np.inf
    for _ in range(POINTS):
        smallest = min(smallest, _difference_at(sweep, numbers, float(random.uniform(begin, 0.9 * end + 0.1 * begin))))
        if smallest <= AGREEMENT:
            break
    return smallest


def _difference_at(sweep: CompiledSweep, numbers: NominalNumbers, time: float) -> float:
    system, scale = sweep.system, state_scales(sweep.system)
    A = _matrices(sweep, numbers, time)[0]
    if not np.isfinite(A).all():
        return 0.0
    span = min(LONGEST, STEP_TIMES_ROOT / max(1.0, float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))))
    span = min(span, 0.05 * (system.end - system.start))
    stops = system.stops(numbers.parameters, time + span)  # no step across a switch
    inside, time, end_time = stops.between(time, time + span)
    span = float(stops.before[inside[0]] if inside.size else end_time) - time
    if span < SHORTEST * max(1.0, abs(time)):
        return 0.0
    Phi, P, m = _one_step(sweep, numbers, time, span)
    v = list(table_values(numbers.groups, time + span).values())
    C, direct = (x.full() for x in sweep.functions.output(time + span, v, numbers.parameters))
    if not all(np.isfinite(x).all() for x in (Phi, P, m, C, direct)):
        return 0.0
    end, low = np.array([time + span]), np.array([time])
    segments = Segments(time, end, low, end)
    n, s = len(system.states), len(system.sources)
    state = np.zeros((s, n, n))
    response = C @ m + direct[:, 0]
    variance = np.einsum("ri,sij,rj->sr", C, P, C)
    sizes = np.sqrt(np.concatenate([np.einsum("sii->i", P) + m**2, variance.sum(axis=0) + response**2]))
    sizes = np.where(sizes > 0, sizes, declared_sizes(system))
    try:
        try:
            found = sweep.integrate(numbers, segments, TOLERANCE, state, sizes, steps=True)
        except IntegrationError:
            # in so short a time noise reaches far states as a high power of it, or not at all: sizes say nothing then
            sizes, state = np.maximum(sizes, LEAST_SIZE * sizes.max()), np.zeros((s, n, n))
            found = sweep.integrate(numbers, segments, TOLERANCE, state, sizes, steps=True)
        means, outputs, _ = sweep.mean_history(numbers, segments, TOLERANCE, sizes)
        on_grid, grid_state = found, state
        if sweep.takes_a_grid:
            grid_state = np.zeros((s, n, n))
            step = GridSteps.equal(segments, np.ones(1, np.intc))
            on_grid = sweep.on_grid(numbers, segments, step, state=grid_state, steps=True)
    except AscentwindError:
        return np.inf
    difference = []
    for by_formula, own in ((found, state), (on_grid, grid_state)):
        assert by_formula.transition is not None
        transition = by_formula.transition[0] / scale[:, None] * scale
        difference += [
            _apart(transition, Phi / scale[:, None] * scale - np.eye(n), np.eye(n)),
            *(_apart(a / np.outer(scale, scale), b / np.outer(scale, scale)) for a, b in zip(own, P, strict=True)),
            _apart(by_formula.mean[0], response),
        ]
    difference += [
        # of its own P, held against ours above: where noise reaches a response through many states, its variance from
        # rest grows as a power of time that neither formula integrates exactly
        *(_apart(np.diag(a), np.diag(C @ P @ C.T)) for a, P in zip(found.covariance[0], state, strict=True)),
        _apart(means[1] / scale, m / scale),
        _apart(outputs[1], response),
    ]
    return float(max(difference))


def _apart(found: NDArray, expected: NDArray, less: NDArray | float = 0.0) -> float:
    """Return the largest difference relative to the largest number expected."""
    size = max(float(np.abs(expected).max(initial=0.0)), LEAST_CHANGE * float(np.abs(less).max(initial=0.0)))
    difference = float(np.abs(found - less - expected).max(initial=0.0))
    return 0.0 if difference == 0 else difference / max(size, 1e-300) if np.isfinite(difference) else np.inf


def _matrices(sweep: CompiledSweep, numbers: NominalNumbers, time: float) -> tuple[NDArray, NDArray, NDArray]:
    v = list(table_values(numbers.groups, time).values())
    A, B, known = (x.full() for x in sweep.functions.stage(time, v, numbers.parameters))
    return A, B, known[:, 0]


def _one_step(
    sweep: CompiledSweep, numbers: NominalNumbers, time: float, span: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return transition (n, n), added covariances (sources, n, n) and mean from rest (n,), by one Runge-Kutta step."""
    system = sweep.system
    n = len(system.states)
    columns = [system.noise_columns(source) for source in system.sources]
    y = np.zeros((n, n + len(columns) * n + 1))
    y[:, :n] = np.eye(n)
    slopes: list[NDArray] = []
    for node, row in zip(DOP853.nodes, DOP853.matrix, strict=True):
        A, B, known = _matrices(sweep, numbers, time + node * span)
        x = y + span * sum((a * k for a, k in zip(row, slopes, strict=False)), np.zeros_like(y))
        slope = A @ x
        slope[:, -1] += known
        for s, of_source in enumerate(columns):
            part = slice(n * (s + 1), n * (s + 2))
            slope[:, part] += x[:, part] @ A.T + B[:, of_source] @ B[:, of_source].T
        slopes.append(slope)
    y = y + span * sum((b * k for b, k in zip(DOP853.weights, slopes, strict=True)), np.zeros_like(y))
    P = y[:, n:-1].reshape(n, len(columns), n).swapaxes(0, 1)
    return y[:, :n], P, y[:, -1]
