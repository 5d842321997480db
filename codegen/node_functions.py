"""A system's matrices, and gradients of two forms of it, at many points in time at once.

One reverse evaluation gives the derivatives with respect to every parameter and every table value, however many
there are. Two forms suffice for every first derivative of a variance or a mean:

    quadratic   2 a' A y + sum_j m_j (B' a)_j^2 + 2 c' C y
    linear      a' (A x + E u) + c' (C x + G u)

with u the known inputs, themselves functions of parameters and table values.
"""

from __future__ import annotations

import ctypes
import logging
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import casadi as ca
import jinja2
import numpy as np
from numpy.typing import NDArray

from ..model.system import LinearSystem
from .cache import CacheError, compiled_library, set_aside
from .compiler import find_compiler
from .expressions import c_function, enumerators
from .fingerprint import fingerprint

log = logging.getLogger(__name__)

AGREEMENT = 1e-12  # between compiled and interpreted functions, of the largest entry
MATRICES = ("A", "B", "C", "E", "G", "inputs")
ARGUMENTS = {
    "node_matrices": ("t", "v", "p"),
    "quadratic_gradient": ("t", "v", "p", "a", "y", "c", "m"),
    "linear_gradient": ("t", "v", "p", "a", "x", "c"),
}
_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("ascentwind.codegen"), undefined=jinja2.StrictUndefined, keep_trailing_newline=True
)
_POINTER = ctypes.POINTER(ctypes.c_double)


def derive_functions(system: LinearSystem) -> tuple[ca.Function, ca.Function, ca.Function]:
    """Derive the nonzeros of the matrices, and the gradients of both forms, (n_p + n_v,), parameters first."""
    n, r = len(system.states), len(system.outputs)
    a, y, c, m = (ca.SX.sym(s, k) for s, k in (("a", n), ("y", n), ("c", r), ("m", len(system.noises))))
    signals = ca.vertcat(system.x, system.w, system.u)
    silent = ca.SX.zeros(system.w.numel())

    def at(expression: ca.SX, state: ca.SX, inputs: ca.SX) -> ca.SX:
        return ca.substitute(expression, signals, ca.vertcat(state, silent, inputs))

    still = ca.SX.zeros(system.u.numel())
    white = ca.jtimes(system.derivative, system.w, a, True) if system.w.numel() else ca.SX(0, 1)
    quadratic = (
        2 * ca.dot(a, at(system.derivative, y, still))
        + ca.dot(m, white**2)
        + 2 * ca.dot(c, at(system.output, y, still))
    )
    linear = ca.dot(a, at(system.derivative, y, system.input_values)) + ca.dot(
        c, at(system.output, y, system.input_values)
    )
    numbers = ca.vertcat(system.p, system.v)
    first = [system.time, system.v, system.p, a, y, c]
    nonzeros = ca.vertcat(*(ca.vec(matrix.nz[:]) for matrix in matrices(system)))
    return (
        ca.Function("node_matrices", first[:3], [ca.densify(nonzeros)]),
        ca.Function("quadratic_gradient", [*first, m], [ca.densify(ca.gradient(quadratic, numbers))]),
        ca.Function("linear_gradient", first, [ca.densify(ca.gradient(linear, numbers))]),
    )


def matrices(system: LinearSystem) -> tuple[ca.SX, ...]:
    """Return A, B, C, E, G and the known inputs, sparse."""
    return system.A, system.B, system.C, system.E, system.G, ca.sparsify(system.input_values)


def nodes_source(system: LinearSystem, functions: tuple[ca.Function, ...]) -> str:
    """Return C that evaluates the functions at many points."""
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    loops = [
        {
            "name": f.name(),
            "arguments": list(zip(ARGUMENTS[f.name()], (f.numel_in(i) for i in range(f.n_in())), strict=True)),
            "size": f.numel_out(0),
            "core": c_function(f"{f.name()}_core", f, ARGUMENTS[f.name()], ("result",), names),
        }
        for f in functions
    ]
    return _ENVIRONMENT.get_template("node_functions.c.jinja").render(
        title=f"{system.name}: matrices, and gradients with respect to parameters and table values",
        table_names=names["v"],
        parameter_names=names["p"],
        loops=loops,
    )


@dataclass(frozen=True, eq=False)
class NodeFunctions:
    """The functions of a system at many points, compiled where a compiler is found, else interpreted.

    Attributes
    ----------
    functions : CasADi functions
        Nonzeros of the matrices, gradient of the quadratic and of the linear form.
    patterns : tuple of Sparsity
        Of A, B, C, E, G and the known inputs.
    shared_library : Path or None
    """

    functions: tuple[ca.Function, ca.Function, ca.Function]
    patterns: tuple[ca.Sparsity, ...]
    shared_library: Path | None

    def matrices(self, t: NDArray, v: NDArray, p: NDArray) -> dict[str, NDArray[np.float64]]:
        """Return A, B, C, E, G and the known inputs at k points, each (k, rows, columns).

        Parameters
        ----------
        t : (k,) array
        v : (k, n_v) array
        p : (n_p,) array
        """
        values, first, found = self._evaluate(0, (t, v, p)), 0, {}
        for name, pattern in zip(MATRICES, self.patterns, strict=True):
            dense = np.zeros((t.size, *pattern.shape))
            dense[:, pattern.row(), pattern.get_col()] = values[:, first : first + pattern.nnz()]
            found[name], first = dense, first + pattern.nnz()
        return found

    def quadratic_gradient(self, *arguments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient of the quadratic form at k points, (k, n_p + n_v).

        Parameters
        ----------
        arguments : arrays
            t (k,), v (k, n_v), p (n_p,), a (k, n), y (k, n), c (k, n_y), m (n_w,). One-dimensional ones but t are the
            same at every point.
        """
        return self._evaluate(1, arguments)

    def linear_gradient(self, *arguments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient of the linear form at k points; arguments t, v, p, a, x, c as above."""
        return self._evaluate(2, arguments)

    def _evaluate(self, which: int, arguments: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
        function, count = self.functions[which], arguments[0].size
        arrays = [np.ascontiguousarray(x, float) for x in arguments]
        if self.shared_library is None:
            columns = [
                x[None, :] if i == 0 else np.tile(x[:, None], count) if x.ndim == 1 else x.T
                for i, x in enumerate(arrays)
            ]
            return function.map(count)(*columns).full().T
        found = np.empty((count, function.numel_out(0)))
        call = getattr(ctypes.CDLL(str(self.shared_library)), function.name())
        call.restype = None
        pointers = [x.ctypes.data_as(_POINTER) for x in arrays]
        strides = [1, *(0 if x.ndim == 1 else x.shape[1] for x in arrays[1:])]
        given = [part for pair in zip(pointers, map(ctypes.c_long, strides), strict=True) for part in pair]
        call(ctypes.c_long(count), *given, found.ctypes.data_as(_POINTER))
        return found


@lru_cache(maxsize=4)
def node_functions(system: LinearSystem, compile: bool = True) -> NodeFunctions:
    """Derive the functions of a system and, where a compiler is found, generate and compile their C.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    functions = derive_functions(system)
    patterns = tuple(matrix.sparsity() for matrix in matrices(system))
    compiler = find_compiler() if compile else None
    interpreted = NodeFunctions(functions, patterns, None)
    if compiler is None:
        return interpreted
    files = ("node_functions.py", "expressions.py", "templates/node_functions.c.jinja", "templates/collocation.c")
    try:
        library = compiled_library(
            f"{system.name}-nodes",
            fingerprint(system, functions, files),
            lambda: nodes_source(system, functions),
            compiler,
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
    """Return the largest difference at two random points, relative to the largest entry of its result."""
    random = np.random.default_rng(504)
    largest = 0.0
    for which, function in enumerate(one.functions):
        sizes = [function.numel_in(i) for i in range(function.n_in())]
        arguments = [random.uniform(0.5, 1.5, size if i == 2 else (2, size)) for i, size in enumerate(sizes)]
        found, expected = (f._evaluate(which, (arguments[0][:, 0], *arguments[1:])) for f in (one, other))
        if expected.size:
            largest = max(largest, float(np.abs(found - expected).max() / max(1e-300, np.abs(expected).max())))
    return largest
