"""The compiled ensemble of a system: C written for its sizes, compiled, cached, and held against NumPy."""

from __future__ import annotations

from ...model.system.linear_system import LinearSystem
from ..system.executable import ExecutableSystem
from ..toolchain.library import NoCompilerError, Recipe
from .difference import AGREEMENT, difference_from_numpy
from .simulation import CompiledEnsemble
from .source import ensemble_fingerprint, ensemble_sizes, ensemble_source


class EnsembleNeedsCompilerError(NoCompilerError):
    """The ensemble exists as compiled code only."""


def ensemble_of(executable: ExecutableSystem) -> CompiledEnsemble:
    """Return the compiled ensemble of a system, made once for all its numbers.

    Raises
    ------
    EnsembleNeedsCompilerError
        Without a compiler, or for a system that is not to be compiled.
    CompilerError, CacheError
    """
    system = executable.system
    return executable.libraries.held("ensemble", lambda: compiled_ensemble(system, executable.may_compile))


def compiled_ensemble(system: LinearSystem, may_compile: bool = True) -> CompiledEnsemble:
    """Compile the ensemble of a system, or take it from the cache; hold its numbers against NumPy's.

    Raises
    ------
    EnsembleNeedsCompilerError, CompilerError, CacheError
    """
    return CompiledEnsemble(ensemble_recipe(system).require(may_compile))


def ensemble_recipe(system: LinearSystem) -> Recipe:
    """Return how the library of the ensemble is made."""
    sizes = ensemble_sizes(system)
    return Recipe(
        system,
        "ensemble",
        fingerprint=lambda: ensemble_fingerprint(system),
        source=lambda: ensemble_source(system),
        difference=lambda library: difference_from_numpy(CompiledEnsemble(library), **sizes),
        agreement=AGREEMENT,
        structure={name: str(size) for name, size in sizes.items()},
        way_out="use another engine",
        refusal=EnsembleNeedsCompilerError,
    )
