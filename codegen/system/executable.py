"""The executable form of a system: compiled where a compiler is found, interpreted elsewhere, the same numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...model.deprecation import warn_deprecated
from ...model.system.linear_system import LinearSystem
from ...model.system.time_conditions import Stops
from ...model.tables import TableGroup, run_time_vector, table_values
from ..toolchain.library import Libraries, Library, Recipe, compile_together
from .covariance import compiled_rate, interpreted_derivative, size_of
from .functions import (
    MATRICES,
    CoreFunctions,
    SystemFunctions,
    core_functions,
    interpreted_functions,
)
from .source import c_source, source_fingerprint

AGREEMENT = 1e-12  # between compiled and interpreted functions, of the largest entry


@dataclass(frozen=True, eq=False, repr=False)
class ExecutableSystem:
    """A linear system with numbers, ready to be evaluated and integrated.

    Attributes
    ----------
    system : LinearSystem
    core : CoreFunctions
    shared_library : Library or None
        None when the interpreter is used.
    groups : tuple of TableGroup
        The tables in force; their shapes are the system's.
    parameters : (n_p,) array
        Values in the order of ``system.parameters``.
    may_compile : bool
        Whether engines that exist as compiled code only may be compiled for it.
    libraries : Libraries
        Those of its engines, made when first asked for and shared by the system with all its numbers.
    """

    system: LinearSystem
    core: CoreFunctions
    shared_library: Library | None
    groups: tuple[TableGroup, ...]
    parameters: NDArray[np.float64]
    may_compile: bool = True
    libraries: Libraries = field(default_factory=Libraries)

    @cached_property
    def tables(self) -> NDArray[np.float64]:
        """The run-time vector that compiled code reads by address; lives as long as this object."""
        return run_time_vector(self.groups) if self.groups else np.zeros(1)

    def __repr__(self) -> str:
        return f"ExecutableSystem ({self.code}) of {self.system!r}"

    def stops(self, until: float) -> Stops:
        """Return where integrators stop up to ``until`` (s) for the parameters in force."""
        return self.system.stops(self.parameters, until)

    def pulses(self, until: float) -> NDArray[np.float64]:
        """Return where integrators begin anew up to ``until`` (s), beside pulses of the coefficients."""
        return self.system.pulses(self.parameters, until)

    @property
    def code(self) -> str:
        """What evaluates the system: 'compiled' code or CasADi's 'interpreter'."""
        return "interpreter" if self.shared_library is None else "compiled"

    @property
    def engine(self) -> str:
        warn_deprecated("executable.engine", "executable.code")
        return self.code

    @cached_property
    def functions(self) -> SystemFunctions:
        if self.shared_library is None:
            return interpreted_functions(self.system, self.core, self.groups)
        path = str(self.shared_library.path)
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

    def input_matrices(
        self, times: NDArray[np.float64], low: float, high: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return B (k, n, n_w) and E (k, n, n_u) at many times."""
        k, n = times.size, len(self.system.states)
        fixed = (np.full(k, low), np.full(k, high), np.tile(self.parameters[:, None], k), np.full(k, self.address))
        found = dict(zip(MATRICES, self.functions.matrices.map(k)(times, *fixed), strict=True))
        B, E = (found[name].full().reshape(n, k, found[name].shape[1] // k).transpose(1, 0, 2) for name in ("B", "E"))
        return B, E

    def with_numbers(
        self, *, groups: tuple[TableGroup, ...] | None = None, parameters: NDArray[np.float64] | None = None
    ) -> ExecutableSystem:
        """Return the same code with other tables of the same shape or other parameters."""
        return replace(
            self,
            groups=self.groups if groups is None else groups,
            parameters=self.parameters if parameters is None else parameters,
        )


def executable_system(
    system: LinearSystem, compile: bool = True, together: Callable[[LinearSystem], Recipe] | None = None
) -> ExecutableSystem:
    """Generate, compile and load a system; without a compiler, on request, or where they differ, use the interpreter.

    Where the system itself has to be compiled, so is ``together``, at the same time: what will be asked for next.

    Raises
    ------
    CompilerError
        If a compiler was found and failed.
    """
    nominal = np.array([p.value for p in system.parameters])
    interpreted = ExecutableSystem(system, core_functions(system), None, system.tables, nominal, may_compile=compile)
    recipe = system_recipe(interpreted)
    if compile and together is not None:
        compile_together(recipe, lambda: [together(system)])
    return replace(interpreted, shared_library=recipe.load(compile))


def system_recipe(interpreted: ExecutableSystem) -> Recipe:
    """Return how the library of a system's own functions is made."""
    system, core = interpreted.system, interpreted.core
    return Recipe(
        system,
        "",
        fingerprint=cache(lambda: source_fingerprint(system, core)),
        source=lambda: c_source(system, core),
        difference=lambda library: difference_from_core(replace(interpreted, shared_library=library)),
        agreement=AGREEMENT,
    )


def difference_from_core(executable: ExecutableSystem, points: int = 2, seed: int = 504) -> float:
    """Return the largest difference between a system's functions and CasADi's interpreter at random points.

    The interpreter evaluates the core functions on table values looked up by NumPy; a difference is relative to the
    largest entry of its result.
    """
    random = np.random.default_rng(seed)
    system, core, functions, p = executable.system, executable.core, executable.functions, executable.parameters
    begin, end = system.start, system.end if np.isfinite(system.end) else system.start + 100.0
    largest = 0.0
    for _ in range(points):
        time = random.uniform(begin, end)
        v = np.array(list(table_values(executable.groups, time).values()))
        x, adjoint = random.standard_normal(len(system.states)), random.standard_normal(core.adjoint.size1_in(3))
        interval = executable.integrator_parameters(time, 1.0, begin, end)
        at_time = (time, begin, end, p, executable.address)
        backward, forward = functions.adjoint(0, adjoint, [], interval, []), functions.mean(0, x, [], interval, [])
        pairs: list[tuple[ca.DM | NDArray, ca.DM | NDArray]] = [
            *zip(
                functions.matrices(*at_time),
                [core.state_matrix(time, v, p), *core.other_matrices(time, v, p)],
                strict=True,
            ),
            (functions.response(*at_time, x), core.response(time, v, p, x)),
            (backward[0], -core.adjoint(time, v, p, adjoint)),
            (backward[2], core.adjoint_quadrature(time, v, p, adjoint)),
            (forward[0], core.mean(time, v, p, x)),
        ]
        if executable.shared_library is not None:
            pairs.append(_covariance_rates(executable, executable.shared_library, time, v, random))
        for ours, reference in pairs:
            a, b = ca.DM(ours).full(), ca.DM(reference).full()
            differ = ~((a == b) | (np.isnan(a) & np.isnan(b)))
            if differ.any():
                scale = max(1e-300, float(np.abs(b[np.isfinite(b)]).max(initial=0.0)))
                difference = float(np.abs(a[differ] - b[differ]).max()) / scale
                largest = difference if not difference <= largest else largest
    return largest


def _covariance_rates(
    executable: ExecutableSystem, library: Library, time: float, v: NDArray, random: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the right-hand side of the covariance equation at a random y by compiled code, and by NumPy."""
    system, core, p = executable.system, executable.core, executable.parameters
    y = random.standard_normal(size_of(system))
    ours = compiled_rate(system, library, p, executable.tables)(time, time, time, y)
    A, (B, known) = core.state_matrix(time, v, p), core.covariance_inputs(time, v, p)
    return ours, interpreted_derivative(system)(A.full(), B.full(), known.full()[:, 0], y)
