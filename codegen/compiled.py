"""The executable form of a system: compiled where a compiler is found, interpreted elsewhere, the same numbers."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.errors import AscentwindWarning
from ..model.system import LinearSystem
from ..model.tables import TableGroup, run_time_vector
from .cache import CacheError, CompiledLibrary, compiled_library, set_aside
from .compiler import find_compiler
from .functions import MATRICES, CoreFunctions, SystemFunctions, core_functions, interpreted_functions
from .source import c_source

log = logging.getLogger(__name__)

AGREEMENT = 1e-12  # between compiled and interpreted functions, of the largest entry
_said_once: set[str] = set()


class InterpreterWarning(AscentwindWarning):
    """Compiled code is not used; results are the same, slower."""


@dataclass(frozen=True, eq=False)
class ExecutableSystem:
    """A linear system with numbers, ready to be evaluated and integrated.

    Attributes
    ----------
    system : LinearSystem
    core : CoreFunctions
    library : CompiledLibrary or None
        None when the interpreter is used.
    groups : tuple of TableGroup
        The tables in force; their shapes are the system's.
    parameters : (n_p,) array
        Values in the order of ``system.parameters``.
    """

    system: LinearSystem
    core: CoreFunctions
    library: CompiledLibrary | None
    groups: tuple[TableGroup, ...]
    parameters: NDArray[np.float64]

    @cached_property
    def tables(self) -> NDArray[np.float64]:
        """The run-time vector that compiled code reads by address; lives as long as this object."""
        return run_time_vector(self.groups) if self.groups else np.zeros(1)

    @property
    def engine(self) -> str:
        return "interpreter" if self.library is None else "compiled"

    @cached_property
    def functions(self) -> SystemFunctions:
        if self.library is None:
            return interpreted_functions(self.system, self.core, self.groups)
        path = str(self.library.path)
        return SystemFunctions(*(ca.external(name, path) for name in ("matrices", "adjoint", "mean", "response")))

    @property
    def address(self) -> float:
        """Where the tables are, as the number that goes to the functions."""
        return float(self.tables.ctypes.data)

    def integrator_parameters(self, origin: float, span: float, low: float, high: float) -> NDArray[np.float64]:
        """Return the parameter vector of an integrand for the flight times from ``origin`` over ``span``."""
        return np.concatenate([[origin, span, low, high], self.parameters, [self.address]])

    def matrices(self, time: float, low: float, high: float) -> dict[str, NDArray[np.float64]]:
        """Return A, B, C, D, E, G and the known inputs at a time, tables looked up within [low, high]."""
        values = self.functions.matrices(time, low, high, self.parameters, self.address)
        return {name: np.array(value.full()) for name, value in zip(MATRICES, values, strict=True)}

    def with_numbers(
        self, *, groups: tuple[TableGroup, ...] | None = None, parameters: NDArray[np.float64] | None = None
    ) -> ExecutableSystem:
        """Return the same code with other tables of the same shape or other parameters."""
        return replace(
            self,
            groups=self.groups if groups is None else groups,
            parameters=self.parameters if parameters is None else parameters,
        )


def executable_system(system: LinearSystem, compile: bool = True) -> ExecutableSystem:
    """Generate, compile, load and verify a system; without a compiler, or on request, use the interpreter.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    core = core_functions(system)
    nominal = np.array([p.value for p in system.parameters])
    interpreted = ExecutableSystem(system, core, None, system.tables, nominal)
    compiler = find_compiler() if compile else None
    if compiler is None:
        if compile:
            _say_once("no C compiler was found (CC, cc, gcc, clang): CasADi's interpreter is used, a few times slower")
        return interpreted
    try:
        library = compiled_library(system.name, c_source(system, core), compiler, dict(system.structure))
    except CacheError as error:
        _say_once(f"compiled code is not used: {error}")
        return interpreted
    compiled = replace(interpreted, library=library)
    difference = compare(compiled, interpreted)
    if not difference <= AGREEMENT:
        set_aside(library)
        _say_once(
            f"the compiled library {library.path} differs from the interpreter by {difference:.1e} and was set "
            "aside: the interpreter is used"
        )
        return interpreted
    return compiled


def compare(one: ExecutableSystem, other: ExecutableSystem, points: int = 2, seed: int = 504) -> float:
    """Return the largest difference between two forms of a system at random points, relative to each result."""
    random = np.random.default_rng(seed)
    system, largest = one.system, 0.0
    end = system.end if np.isfinite(system.end) else system.start + 100.0
    for _ in range(points):
        time = random.uniform(system.start, end)
        pairs: list[tuple[Sequence, Sequence]] = []
        pairs.append(
            tuple(e.functions.matrices(time, system.start, end, e.parameters, e.address) for e in (one, other))
        )
        x = random.standard_normal(len(system.states))
        pairs.append(
            tuple([e.functions.response(time, system.start, end, e.parameters, e.address, x)] for e in (one, other))
        )
        for name in ("adjoint", "mean"):
            x = random.standard_normal(getattr(one.functions, name).size1_in(1))
            pairs.append(
                tuple(
                    getattr(e.functions, name)(0.0, x, [], e.integrator_parameters(time, 1.0, system.start, end), [])
                    for e in (one, other)
                )
            )
        for left, right in pairs:
            for a, b in zip(left, right, strict=True):
                a, b = np.array(ca.DM(a).full()), np.array(ca.DM(b).full())
                if a.size:
                    # a scale above zero: entries that vanish in exact arithmetic are compared absolutely
                    scale = max(1e-300, float(np.abs(b).max()))
                    largest = max(largest, float(np.abs(a - b).max()) / scale)
    return largest if np.isfinite(largest) else float("inf")


def _say_once(text: str) -> None:
    if text not in _said_once:
        _said_once.add(text)
        warnings.warn(InterpreterWarning(text), stacklevel=3)
