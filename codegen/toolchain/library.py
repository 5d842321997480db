"""The life of a generated library: written, compiled or found, held against what it must agree with, and called."""

from __future__ import annotations

import ctypes
import logging
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ...model.errors import AscentwindError, AscentwindWarning
from ...model.system.linear_system import LinearSystem
from .cache import CacheError, CompiledLibrary, compiled_library, is_compiled, set_aside
from .compiler import Compiler, find_compiler, optimizing
from .interruption import Workers, interruptible

T = TypeVar("T")

NO_COMPILER = "no C compiler was found (CC, cc, gcc, clang)"
_said_once: set[str] = set()


class NoCompilerError(AscentwindError):
    """Something exists as compiled code only, and no compiler is found or allowed."""


class InterpreterWarning(AscentwindWarning):
    """Compiled code is not used; results are the same, slower."""


@dataclass(frozen=True)
class Library(CompiledLibrary):
    """A shared library whose functions are called; calls from several threads do not disturb each other.

    Arguments are numbers (int and float as C's int and double, NumPy scalars as their own types), arrays, which go by
    address, and None for a null pointer.
    """

    @cached_property
    def _handle(self) -> ctypes.CDLL:
        return ctypes.CDLL(str(self.path))

    def call(self, function: str, *arguments: object) -> int:
        """Call a function that looks at the flag of an interruption, and return what it returns.

        Raises
        ------
        KeyboardInterrupt
            If it was stopped.
        """
        given, code = [_c_argument(a) for a in arguments], getattr(self._handle, function)
        return interruptible(lambda flag: code(*given, _c_argument(flag)))

    def bound(self, function: str, *arguments: object) -> Callable[[], None]:
        """Return a short function with its arguments, to be called many times as their arrays change."""
        given, code = [_c_argument(a) for a in arguments], getattr(self._handle, function)

        def call() -> None:
            code(*given)

        return call

    def call_to_the_end(self, function: str, *arguments: object) -> None:
        """Call a short function, which looks at no flag and returns nothing."""
        getattr(self._handle, function)(*map(_c_argument, arguments))


def _c_argument(value: Any) -> Any:
    """Return an argument as ctypes takes it; that of an array keeps it alive."""
    if value is None:
        return ctypes.c_void_p(None)
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise ValueError(f"compiled code reads arrays row by row, and this one of shape {value.shape} has gaps")
        return value.ctypes.data_as(ctypes.c_void_p)
    if isinstance(value, np.generic):
        return np.ctypeslib.as_ctypes_type(value.dtype.str)(value.item())
    return ctypes.c_double(value) if isinstance(value, float) else ctypes.c_int(value)


def warn_once(level: int, text: str) -> None:
    """Warn that compiled code is not used, once for every text."""
    if text not in _said_once:
        _said_once.add(text)
        warnings.warn(InterpreterWarning(text), stacklevel=4)


@dataclass(frozen=True, eq=False)
class Recipe:
    """How a library of a system is made and proved.

    Attributes
    ----------
    system : LinearSystem
    part : str
        What of it; empty for the system's own functions.
    fingerprint : callable
        Returns a hash of what the source is written from.
    source : callable
        Writes the C; called only when it has to be compiled.
    difference : callable
        Returns how far a loaded library is from what it must agree with, relative.
    agreement : float
        The largest such difference.
    structure : mapping of str to str, optional
        What shapes the source, for the log of changes; that of the system without it.
    optimised : bool
        Whether loops over columns side by side are worth more of the compiler's time.
    say : callable
        Takes a level of logging and why the interpreter is used.
    way_out : str
        What to do without, for what exists as compiled code only.
    refusal : class of NoCompilerError
    """

    system: LinearSystem
    part: str
    fingerprint: Callable[[], str]
    source: Callable[[], str]
    difference: Callable[[Library], float]
    agreement: float
    structure: Mapping[str, str] | None = None
    optimised: bool = False
    say: Callable[[int, str], None] = warn_once
    way_out: str = ""
    refusal: type[NoCompilerError] = NoCompilerError

    @property
    def file_name(self) -> str:
        """Of the readable source that is kept."""
        return f"{self.system.name}_{self.part}.c" if self.part else f"{self.system.name}.c"

    def load(self, may_compile: bool) -> Library | None:
        """Compile or take from the cache, and compare; return None, and say so, where the interpreter is used.

        Raises
        ------
        CompilerError
            If a compiler was found and failed.
        """
        if not may_compile:
            return None
        compiler = find_compiler()
        if compiler is None:
            self.say(logging.INFO, f"{NO_COMPILER}: CasADi's interpreter is used, a few times slower")
            return None
        try:
            library = self._compiled(compiler)
        except CacheError as error:
            self.say(logging.INFO, f"compiled code is not used: {error}")
            return None
        if wrong := self._wrong(library):
            self.say(logging.WARNING, f"{wrong}: the interpreter is used")
            return None
        return library

    def require(self, may_compile: bool) -> Library:
        """Compile or take from the cache, and compare, what exists as compiled code only.

        Raises
        ------
        NoCompilerError, CompilerError, CacheError
        """
        if not may_compile:
            raise self.refusal(
                f"'{self.system.name}' was loaded with compile=False, and the {self.part} exists as compiled code "
                f"only; {self.way_out}, or load it without compile=False"
            )
        compiler = find_compiler()
        if compiler is None:
            raise self.refusal(
                f"the {self.part} is compiled for each system, and {NO_COMPILER}; install one, or {self.way_out}"
            )
        library = self._compiled(compiler)
        if wrong := self._wrong(library):
            raise CacheError(f"{wrong}; run the same again, which compiles it anew, or {self.way_out}")
        return library

    @property
    def _name(self) -> str:
        return f"{self.system.name}-{self.part}" if self.part else self.system.name

    def _compiler(self, found: Compiler) -> Compiler:
        return optimizing(found) if self.optimised else found

    def is_compiled(self, compiler: Compiler) -> bool:
        """Return whether the cache has the library.

        Raises
        ------
        CacheError
        """
        return is_compiled(self._name, self.fingerprint(), self._compiler(compiler))

    def written(self, compiler: Compiler) -> Callable[[], CompiledLibrary]:
        """Write the source, and return what compiles it; symbols belong to one thread, compilers to any."""
        structure = self.system.structure if self.structure is None else self.structure
        text, key, chosen = self.source(), self.fingerprint(), self._compiler(compiler)
        return lambda: compiled_library(self._name, key, lambda: text, chosen, dict(structure))

    def _compiled(self, compiler: Compiler) -> Library:
        structure = self.system.structure if self.structure is None else self.structure
        chosen = self._compiler(compiler)
        found = compiled_library(self._name, self.fingerprint(), self.source, chosen, dict(structure))
        return Library(found.path, found.key, found.fresh)

    def _wrong(self, library: Library) -> str:
        """Set a library aside that gives wrong numbers, and say by how much; empty for a right one."""
        difference = self.difference(library)
        if difference <= self.agreement:
            return ""
        set_aside(library)
        return f"the compiled library {library.path} differs from the interpreter by {difference:.1e} and was set aside"


def compile_together(first: Recipe, others: Callable[[], Sequence[Recipe]]) -> None:
    """Compile libraries at the same time where the first is not in the cache: a compiler uses one core.

    Whoever takes them afterwards finds them there. An error of the cache is left to them.

    Raises
    ------
    CompilerError
        Of the first that fails; the others are stopped, and nothing of them is left.
    """
    compiler = find_compiler()
    try:
        if compiler is None or first.is_compiled(compiler):
            return
        missing = [first, *(recipe for recipe in others() if not recipe.is_compiled(compiler))]
        if len(missing) == 1:
            return
        jobs = [recipe.written(compiler) for recipe in missing]
        with Workers(len(jobs)) as pool:
            for done in as_completed([pool.submit(job) for job in jobs]):
                done.result()
    except CacheError:
        return


class Libraries:
    """What the code of one system was loaded into: each part once, however many threads ask for it at the same time.

    An error is not kept: whoever asks next tries again.
    """

    def __init__(self):
        self._held: dict[str, Any] = {}
        self._locks: dict[str, threading.Lock] = {}

    def held(self, part: str, make: Callable[[], T]) -> T:
        """Return a part, made by the first who asks."""
        with self._locks.setdefault(part, threading.Lock()):
            if part not in self._held:
                self._held[part] = make()
            return self._held[part]
