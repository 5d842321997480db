"""A system's matrices, and gradients of two forms of it, at many points in time at once.

One reverse evaluation gives the derivatives with respect to every number and every table value, however many
there are. Two forms suffice for every first derivative of a variance or a mean:

    quadratic   2 a' A y + sum_j m_j (B' a)_j^2 + 2 c' C y
    linear      a' (A x + E u) + c' (C x + G u)

with u the known inputs, themselves functions of parameters and table values. What depends on parameters alone is
computed once for all points: the functions see *numbers* z(p), the parameters that stand in the equations beside
tables or time and every larger expression of parameters alone, so that a point's cost follows the equations and not
the count of parameters.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...model.system.linear_system import LinearSystem
from ..system.executable import ExecutableSystem
from ..toolchain.fingerprint import fingerprint
from ..toolchain.library import Library, Recipe
from .expressions import MATRICES, NodeExpressions, node_expressions
from .matrix import NodeMatrix
from .source import SOURCE_FILES, nodes_source

log = logging.getLogger(__name__)

AGREEMENT = 1e-12  # between compiled and interpreted functions, of the largest entry


@dataclass(frozen=True, eq=False)
class NodeFunctions:
    """The functions of a system at many points, compiled where a compiler is found, else interpreted."""

    expressions: NodeExpressions
    shared_library: Library | None

    def numbers(self, p: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the numbers z of parameters p."""
        return np.array(self.expressions.numbers(p), float).ravel()

    def by_parameters(self, p: NDArray[np.float64], by_numbers: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a gradient with respect to the parameters from one with respect to the numbers."""
        return np.array(self.expressions.numbers_reverse(p, by_numbers), float).ravel()

    def matrices(self, t: NDArray, v: NDArray, z: NDArray) -> dict[str, NodeMatrix]:
        """Return A, B, C, E, G and the known inputs at k points.

        Parameters
        ----------
        t : (k,) array
        v : (k, n_v) array
        z : (n_z,) array
        """
        values, first, found = self._evaluate(0, (t, v, z))[1], 0, {}
        for name, pattern in zip(MATRICES, self.expressions.patterns, strict=True):
            found[name] = NodeMatrix(pattern, values[:, first : first + pattern.nnz()])
            first += pattern.nnz()
        return found

    def quadratic_gradient(
        self, weights: NDArray[np.float64], *arguments: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the gradient of the quadratic form at k points.

        Parameters
        ----------
        weights : (k,) array
        arguments : arrays
            t (k,), v (k, n_v), z (n_z,), a (k, n), y (k, n), c (k, n_y), m (n_w,). One-dimensional ones but t are the
            same at every point.

        Returns
        -------
        by_numbers : (n_z,) array
            Weighted sum over the points.
        by_tables : (k, n_v) array
            Point by point.
        """
        return self._evaluate(1, arguments, weights)

    def linear_gradient(
        self, weights: NDArray[np.float64], *arguments: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the gradient of the linear form at k points; arguments t, v, z, a, x, c and results as above."""
        return self._evaluate(2, arguments, weights)

    def _evaluate(
        self, which: int, arguments: tuple[NDArray[np.float64], ...], weights: NDArray[np.float64] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        function, count = self.expressions.at_points[which], arguments[0].size
        summed = 0 if weights is None else self.expressions.numbers.numel_out(0)
        arrays = [np.ascontiguousarray(x, float) for x in arguments]
        weights = np.zeros(count) if weights is None else np.ascontiguousarray(weights, float)
        if self.shared_library is None:
            columns = [
                x[None, :] if i == 0 else np.tile(x[:, None], count) if x.ndim == 1 else x.T
                for i, x in enumerate(arrays)
            ]
            result = function.map(count)(*columns).full()
            return result[:summed] @ weights, result[summed:].T
        total, kept = np.zeros(summed), np.empty((count, function.numel_out(0) - summed))
        strides = [1, *(0 if x.ndim == 1 else x.shape[1] for x in arrays[1:])]
        given = [part for pair in zip(arrays, map(np.long, strides), strict=True) for part in pair]
        self.shared_library.call_to_the_end(function.name(), np.long(count), *given, weights, total, kept)
        return total, kept


def node_functions_of(executable: ExecutableSystem) -> NodeFunctions:
    """Return the functions of a system, made once for all its numbers, compiled where the system itself is.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    compiled = executable.shared_library is not None
    return executable.libraries.held("nodes", lambda: node_functions(executable.system, compiled))


def node_functions(system: LinearSystem, may_compile: bool = True) -> NodeFunctions:
    """Derive the functions of a system and, where a compiler is found, generate and compile their C.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    expressions = node_expressions(system)
    return NodeFunctions(expressions, node_recipe(system, expressions).load(may_compile))


def node_recipe(system: LinearSystem, expressions: NodeExpressions) -> Recipe:
    """Return how the library of the functions is made."""
    interpreted = NodeFunctions(expressions, None)
    return Recipe(
        system,
        "nodes",
        fingerprint=lambda: fingerprint(system, expressions.at_points, SOURCE_FILES),
        source=lambda: nodes_source(system, expressions.at_points),
        difference=lambda library: _difference(replace(interpreted, shared_library=library), interpreted),
        agreement=AGREEMENT,
        optimised=True,
        say=lambda level, why: log.log(level, "sensitivities of %s: %s", system.name, why),
    )


def _difference(one: NodeFunctions, other: NodeFunctions) -> float:
    """Return the largest difference at a few random points, relative to the largest entry of its result."""
    random, points = np.random.default_rng(504), 11
    largest = 0.0
    for which, function in enumerate(one.expressions.at_points):
        sizes = [function.numel_in(i) for i in range(function.n_in())]
        arguments = [random.uniform(0.5, 1.5, size if i == 2 else (points, size)) for i, size in enumerate(sizes)]
        weights = random.uniform(0.5, 1.5, points) if which else None
        results = (f._evaluate(which, (arguments[0][:, 0], *arguments[1:]), weights) for f in (one, other))
        for found, expected in zip(*results, strict=True):
            if expected.size:
                largest = max(largest, float(np.abs(found - expected).max() / max(1e-300, np.abs(expected).max())))
    return largest
