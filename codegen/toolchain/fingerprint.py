"""A hash that stands for generated C: of all that the source is written from, quicker to have than the source."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path

import casadi as ca

from ...model.system.linear_system import LinearSystem

_CODEGEN = Path(__file__).parents[1]
_SHARED = ("toolchain/c_printer.py", "toolchain/templates.py")


def fingerprint(system: LinearSystem, functions: Iterable[ca.Function], files: Iterable[str]) -> str:
    """Return a hash of arithmetic, names, structure and code generator.

    Parameters
    ----------
    system : LinearSystem
    functions : iterable of Function
        The arithmetic that is written as C.
    files : iterable of str
        Modules and templates that write it, below ``codegen``; those that write all C are known.
    """
    digest = hashlib.sha256()
    for function in functions:
        digest.update(function.serialize().encode())
    for part in (system.name, system.structure, system.states, system.noises, system.outputs, system.input_names):
        digest.update(repr(part).encode())
    for p in system.parameters:
        digest.update(repr((p.name, p.unit)).encode())
    for g in system.tables:
        digest.update(repr((g.name, g.argument, g.names, g.units, g.knots.size, g.sources)).encode())
    for file in (*files, *_SHARED):
        digest.update((_CODEGEN / file).read_bytes())
    return digest.hexdigest()
