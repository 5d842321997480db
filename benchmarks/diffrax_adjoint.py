"""Adjoints by diffrax on the CPU: the same A(t), as cubic pieces through its values, because JAX cannot call our C."""

from __future__ import annotations

from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from ascentwind.codegen.system.evaluation import MatrixEvaluator
from ascentwind.runners import Study
from ascentwind.runners.solvers.time_nodes import intervals

jax.config.update("jax_enable_x64", True)
SPACING = 0.05  # s; a kink of a table is smeared over this much
THIRDS = np.arange(4) / 3


def diffrax_adjoints(study: Study, tolerance: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function from end times to standard deviations; compilation is done here."""
    executable, system = study.with_means, study.system
    outputs = np.array([o.scale for o in system.outputs])
    columns = [np.array(system.noise_columns(source)) for source in system.sources]
    covariances = [system.start_covariance_matrix(name, executable.parameters) for name in system.sources]
    evaluate = MatrixEvaluator(executable, ("A", "B"))
    tables = []
    for piece in intervals(executable, system.start, system.end):
        count = int(np.ceil((piece.end - piece.begin) / SPACING))
        spacing = (piece.end - piece.begin) / count
        at = piece.begin + spacing * (np.arange(count)[:, None] + THIRDS)
        values = np.array([np.hstack(evaluate(float(t), piece.low, piece.high)) for t in at.ravel()])
        through = np.linalg.inv(np.vander(spacing * THIRDS, increasing=True))
        coefficients = np.einsum("ij,kj...->ki...", through, values.reshape(count, 4, *values.shape[1:]))
        tables.append((piece, jnp.asarray(coefficients), spacing))
    n = len(system.states)

    def rate(s, y, arguments):
        origin, begin, spacing, coefficients = arguments
        x = (origin - s - begin) / spacing
        k = jnp.clip(x.astype(int), 0, coefficients.shape[0] - 1)
        u, c = (x - k) * spacing, coefficients[k]
        M = c[0] + u * (c[1] + u * (c[2] + u * c[3]))
        adjoint, _ = y
        g = M[:, n:].T @ adjoint
        return M[:, :n].T @ adjoint, jnp.stack([(g[c] ** 2).sum(axis=0) for c in columns], axis=1)

    @jax.jit
    def back(adjoint, variance, origin, span, begin, spacing, coefficients):
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(rate), diffrax.Dopri8(), 0.0, span, None, (adjoint, variance),
            args=(origin, begin, spacing, coefficients), max_steps=1_000_000,
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=1e-3 * tolerance),
            adjoint=diffrax.DirectAdjoint(),
        )  # fmt: skip
        return jax.tree.map(lambda a: a[-1], solution.ys)

    def std(time: float) -> np.ndarray:
        last = intervals(executable, system.start, time)[-1]
        C = executable.matrices(time, last.low, last.high)["C"]
        adjoint, variance = jnp.asarray(C.T / outputs), jnp.zeros((len(outputs), len(columns)))
        for piece, coefficients, spacing in reversed(tables):
            if piece.begin < time:
                end = min(time, piece.end)
                adjoint, variance = back(adjoint, variance, end, end - piece.begin, piece.begin, spacing, coefficients)
        found = np.array(variance) * outputs[:, None] ** 2
        start = np.array(adjoint) * outputs
        for k, covariance in enumerate(covariances):
            found[:, k] += np.einsum("ir,ij,jr->r", start, covariance, start)
        return np.sqrt(found)

    std(system.end)
    return lambda times: np.array([std(float(t)) for t in times])
