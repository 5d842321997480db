"""The compiled sweep of a system: C written for it, compiled, cached, and held against CasADi."""

from __future__ import annotations

from ...model.system.linear_system import LinearSystem
from ..system.executable import ExecutableSystem
from ..toolchain.library import Recipe
from .difference import AGREEMENT, difference_from_interpreter
from .integrator import CompiledSweep
from .source import SweepFunctions, sweep_fingerprint, sweep_functions, sweep_source


def sweep_of(executable: ExecutableSystem) -> CompiledSweep:
    """Return the compiled sweep of a system, made once for all its numbers.

    Raises
    ------
    NoCompilerError
        Without a compiler, or for a system that is not to be compiled.
    CompilerError, CacheError
    """
    system = executable.system
    return executable.libraries.held("sweep", lambda: compiled_sweep(system, executable.may_compile))


def compiled_sweep(system: LinearSystem, may_compile: bool = True) -> CompiledSweep:
    """Generate and compile the sweep of a system, or take it from the cache; hold its numbers against CasADi's.

    Raises
    ------
    NoCompilerError, CompilerError, CacheError
    """
    functions = sweep_functions(system)
    return CompiledSweep(system, functions, sweep_recipe(system, functions).require(may_compile))


def sweep_recipe(system: LinearSystem, functions: SweepFunctions) -> Recipe:
    """Return how the library of the sweep is made."""
    return Recipe(
        system,
        "sweep",
        fingerprint=lambda: sweep_fingerprint(system, functions),
        source=lambda: sweep_source(system, functions, with_grid=True),
        difference=lambda library: difference_from_interpreter(CompiledSweep(system, functions, library)),
        agreement=AGREEMENT,
        optimised=True,
        way_out="use engine='cvodes', which works without",
    )
