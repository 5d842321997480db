"""What this machine offers: compiler, CasADi and its CVODES, cache, engine."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass

import casadi as ca

from ...codegen.toolchain.cache import CacheError, cache_contents, cache_folder
from ...codegen.toolchain.compiler import CompilerError, find_compiler


@dataclass(frozen=True)
class Finding:
    """One line of a diagnosis."""

    what: str
    found: str
    good: bool
    advice: str = ""


def diagnose() -> list[Finding]:
    """Look at everything that ascentwind depends on."""
    findings = [Finding("Python", platform.python_version(), True)]
    try:
        compiler = find_compiler()
        if compiler:
            findings.append(Finding("C compiler", f"{' '.join(compiler.command)}: {compiler.version}", True))
        else:
            findings.append(
                Finding(
                    "C compiler", "none", False, "install cc, gcc or clang, or set CC, for speed; results are the same"
                )
            )
    except CompilerError as error:
        compiler = None
        findings.append(Finding("C compiler", str(error.output), False, "point CC to a compiler that exists"))
    findings.append(Finding("CasADi", ca.CasadiMeta.version(), True))
    has_cvodes = ca.has_integrator("cvodes")
    findings.append(
        Finding("CVODES", "in CasADi" if has_cvodes else "missing", has_cvodes, "reinstall casadi from its wheel")
    )
    cached = False
    try:
        folder = cache_folder()
        held = cache_contents(folder)
        text = f"{folder} ({held.libraries} compiled libraries, {held.size / 1e6:.1f} MB)"
        cached = os.access(folder, os.W_OK)
        advice = "it cannot be written: what it does not hold is interpreted; set ASCENTWIND_CACHE to one that can"
        findings.append(Finding("cache", text, cached, advice))
    except CacheError as error:
        findings.append(Finding("cache", "not usable", False, str(error)))
    if compiler and cached:
        found = "sweep, compiled C"
    elif compiler:
        found = "sweep where the cache holds it, else CVODES with CasADi's interpreter"
    else:
        found = "CVODES with CasADi's interpreter"
    findings.append(Finding("default engine", found, True))
    return findings
