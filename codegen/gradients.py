"""Gradients of bilinear forms of a system with respect to all parameters and table values, by reverse derivatives.

One reverse evaluation gives the derivatives with respect to every parameter and every table value at once, however
many there are. Two forms suffice for every first derivative of a variance or a mean:

    quadratic   2 a' A y + sum_j m_j (B' a)_j^2 + 2 c' C y
    linear      a' (A x + E u) + c' (C x + G u)

with u the known inputs, themselves functions of parameters and table values.
"""

from __future__ import annotations

import ctypes
import hashlib
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import jinja2
import numpy as np
from numpy.typing import NDArray

from ..model.system import LinearSystem
from .cache import CacheError, compiled_library
from .compiler import find_compiler
from .expressions import c_function, enumerators

ARGUMENTS = {
    "quadratic_gradient": ("t", "v", "p", "a", "y", "c", "m"),
    "linear_gradient": ("t", "v", "p", "a", "x", "c"),
}
_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("ascentwind.codegen"), undefined=jinja2.StrictUndefined, keep_trailing_newline=True
)
_POINTER = ctypes.POINTER(ctypes.c_double)


def gradient_functions(system: LinearSystem) -> tuple[ca.Function, ca.Function]:
    """Derive the gradients of the quadratic and of the linear form, each of length n_p + n_v, parameters first."""
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
    return (
        ca.Function("quadratic_gradient", [*first, m], [ca.densify(ca.gradient(quadratic, numbers))]),
        ca.Function("linear_gradient", first, [ca.densify(ca.gradient(linear, numbers))]),
    )


def gradient_source(system: LinearSystem, functions: tuple[ca.Function, ca.Function]) -> str:
    """Return C that evaluates both gradients at many points."""
    names = {
        "v": enumerators("V", [name for g in system.tables for name in g.names]),
        "p": enumerators("P", system.parameter_names),
    }
    loops = [
        {
            "name": f.name(),
            "arguments": list(zip(ARGUMENTS[f.name()], (f.numel_in(i) for i in range(f.n_in())), strict=True)),
            "size": f.numel_out(0),
            "core": c_function(f"{f.name()}_core", f, ARGUMENTS[f.name()], ("gradient",), names),
        }
        for f in functions
    ]
    return _ENVIRONMENT.get_template("gradients.c.jinja").render(
        title=f"{system.name}: gradients with respect to parameters and table values",
        table_names=names["v"],
        parameter_names=names["p"],
        loops=loops,
    )


@dataclass(frozen=True, eq=False)
class Gradients:
    """Both gradients, compiled where a compiler is found, else interpreted.

    Attributes
    ----------
    functions : (quadratic, linear) CasADi functions
    library : Path or None
    """

    functions: tuple[ca.Function, ca.Function]
    library: Path | None

    def quadratic(self, *arguments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient of the quadratic form at k points, (k, n_p + n_v).

        Parameters
        ----------
        arguments : arrays
            t (k,), v (k, n_v), p (n_p,), a (k, n), y (k, n), c (k, n_y), m (n_w,). One-dimensional ones but t are the
            same at every point.
        """
        return self._evaluate(self.functions[0], arguments)

    def linear(self, *arguments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient of the linear form at k points; arguments t, v, p, a, x, c as above."""
        return self._evaluate(self.functions[1], arguments)

    def _evaluate(self, function: ca.Function, arguments: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
        count = arguments[0].size
        arrays = [np.ascontiguousarray(x, float) for x in arguments]
        if self.library is None:
            columns = [
                x[None, :] if i == 0 else np.tile(x[:, None], count) if x.ndim == 1 else x.T
                for i, x in enumerate(arrays)
            ]
            return function.map(count)(*columns).full().T
        found = np.empty((count, function.numel_out(0)))
        call = getattr(ctypes.CDLL(str(self.library)), function.name())
        call.restype = None
        pointers = [x.ctypes.data_as(_POINTER) for x in arrays]
        strides = [1, *(0 if x.ndim == 1 else x.shape[1] for x in arrays[1:])]
        given = [part for pair in zip(pointers, map(ctypes.c_long, strides), strict=True) for part in pair]
        call(ctypes.c_long(count), *given, found.ctypes.data_as(_POINTER))
        return found


def system_gradients(system: LinearSystem, compile: bool = True) -> Gradients:
    """Derive the gradients of a system and, where a compiler is found, generate and compile their C.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    functions = gradient_functions(system)
    compiler = find_compiler() if compile else None
    if compiler is None:
        return Gradients(functions, None)
    here = Path(__file__).parent
    digest = hashlib.sha256(repr((system.name, system.parameter_names, [g.names for g in system.tables])).encode())
    for function in functions:
        digest.update(function.serialize().encode())
    for file in ("gradients.py", "expressions.py", "templates/gradients.c.jinja"):
        digest.update((here / file).read_bytes())
    try:
        library = compiled_library(
            f"{system.name}-gradients",
            digest.hexdigest(),
            lambda: gradient_source(system, functions),
            compiler,
            dict(system.structure),
        )
    except CacheError:
        return Gradients(functions, None)
    return Gradients(functions, library.path)
