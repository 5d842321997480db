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

import ctypes
import logging
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...model.system.linear_system import LinearSystem
from ..toolchain.cache import CacheError, compiled_library, set_aside
from ..toolchain.compiler import find_compiler, optimizing
from ..toolchain.fingerprint import fingerprint
from .expressions import MATRICES, NodeExpressions, node_expressions
from .matrix import NodeMatrix
from .source import SOURCE_FILES, nodes_source

log = logging.getLogger(__name__)

AGREEMENT = 1e-12  # between compiled and interpreted functions, of the largest entry
_POINTER = ctypes.POINTER(ctypes.c_double)


@dataclass(frozen=True, eq=False)
class NodeFunctions:
    """The functions of a system at many points, compiled where a compiler is found, else interpreted."""

    expressions: NodeExpressions
    shared_library: Path | None

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
        call = getattr(ctypes.CDLL(str(self.shared_library)), function.name())
        call.restype = None
        pointers = [x.ctypes.data_as(_POINTER) for x in arrays]
        strides = [1, *(0 if x.ndim == 1 else x.shape[1] for x in arrays[1:])]
        given = [part for pair in zip(pointers, map(ctypes.c_long, strides), strict=True) for part in pair]
        call(ctypes.c_long(count), *given, *(x.ctypes.data_as(_POINTER) for x in (weights, total, kept)))
        return total, kept


@lru_cache(maxsize=4)
def node_functions(system: LinearSystem, compile: bool = True) -> NodeFunctions:
    """Derive the functions of a system and, where a compiler is found, generate and compile their C.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    expressions = node_expressions(system)
    compiler = find_compiler() if compile else None
    interpreted = NodeFunctions(expressions, None)
    if compiler is None:
        return interpreted
    try:
        library = compiled_library(
            f"{system.name}-nodes",
            fingerprint(system, expressions.at_points, SOURCE_FILES),
            lambda: nodes_source(system, expressions.at_points),
            optimizing(compiler),
            dict(system.structure),
        )
    except CacheError as error:
        log.info("the sensitivities of %s are interpreted: %s", system.name, error)
        return interpreted
    compiled = replace(interpreted, shared_library=library.path)
    if not _difference(compiled, interpreted) <= AGREEMENT:
        set_aside(library)
        log.warning("%s differs from the interpreter and was set aside: the interpreter is used", library.path)
        return interpreted
    return compiled


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
