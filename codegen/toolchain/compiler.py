"""Finding and running a C compiler."""

from __future__ import annotations

import contextlib
import os
import platform
import shlex
import shutil
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from ...model.errors import AscentwindError
from .interruption import refuse_if_stopped

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared")
NATIVE = "-march=native"
PATIENCE = 0.1  # s, until it is looked whether anyone still waits for a program


class CompilerError(AscentwindError):
    """A compiler failed; the message holds the command and what it printed."""

    def __init__(self, command: list[str], code: int, output: str):
        self.command, self.code, self.output = command, code, output
        lines = output.strip().splitlines()
        shown = "\n".join(lines[:12]) or "(it printed nothing)"
        super().__init__(
            f"the compiler failed with code {code}: {shlex.join(command)}\n{shown}\n"
            "Point CC to a working compiler, or set CC= (empty) to use the interpreter."
        )


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command, what it calls itself, and the flags it is given."""

    command: tuple[str, ...]
    version: str
    flags: tuple[str, ...] = FLAGS

    def compile(self, source: Path, library: Path) -> None:
        """Compile a C file into a shared library.

        Raises
        ------
        CompilerError
            With command and text.
        """
        command = [*self.command, *self.flags, "-o", str(library), str(source), "-lm"]
        done = run_program(command, environment={"TMPDIR": str(library.parent), "LC_ALL": "C"})
        if done.returncode != 0 or not library.is_file():
            raise CompilerError(command, done.returncode, done.stderr + done.stdout)


def find_compiler() -> Compiler | None:
    """Return the compiler named by CC, else the first of cc, gcc and clang; None without one or with CC empty.

    Raises
    ------
    CompilerError
        If CC names a program that cannot be run, or cannot be read.
    """
    named = os.environ.get("CC")
    if named is not None and not named.strip():
        return None
    for candidate in [_split(named)] if named else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            command = tuple(candidate)
            return Compiler(command, _version(command), known_flags(command, (*FLAGS, NATIVE)))
        if named:
            raise CompilerError(candidate, 127, f"CC={named}: there is no such program")
    return None


def _split(named: str) -> list[str]:
    try:
        return shlex.split(named)
    except ValueError as error:
        raise CompilerError([named], 127, f"CC={named}: quotes that do not match ({error})") from None


def run_program(
    command: Sequence[str], given: str = "", environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a program to its end; an exception meanwhile, such as Ctrl-C, ends it with all that it started.

    So does the flag of a thread of :class:`Workers`.

    Raises
    ------
    CompilerError
        If it cannot be started.
    """
    pipe = subprocess.PIPE
    try:
        process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, errors="replace", start_new_session=True,
            env={**os.environ, **(environment or {})},
        )  # fmt: skip
    except OSError as error:
        raise CompilerError(list(command), 126, f"{command[0]} cannot be run ({error.strerror or error})") from None
    with process:
        try:
            printed, complained = _communicated(process, given)
        except BaseException:
            _end(process)
            raise
    return subprocess.CompletedProcess(command, process.returncode, printed, complained)


def _communicated(process: subprocess.Popen[str], given: str) -> tuple[str, str]:
    to_give: str | None = given
    while True:
        try:
            return process.communicate(to_give, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            to_give = None  # it has what it was given
            refuse_if_stopped()


def _end(process: subprocess.Popen[str]) -> None:
    """End a program and what it started: a compiler's driver leaves the work to others."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()


@lru_cache
def _version(command: tuple[str, ...]) -> str:
    done = run_program([*command, "--version"])
    return (done.stdout or done.stderr).partition("\n")[0].strip() or "unknown version"


@lru_cache
def known_flags(command: tuple[str, ...], flags: tuple[str, ...]) -> tuple[str, ...]:
    """Return the flags without those for a processor (-m...) that the compiler does not know."""

    def knows(flag: str) -> bool:
        check = [*command, flag, "-E", "-x", "c", "-"]
        return run_program(check).returncode == 0

    return tuple(flag for flag in flags if not flag.startswith("-m") or knows(flag))


@lru_cache
def processor() -> str:
    """Return what tells processors apart that '-march=native' compiles for."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    wanted = ("model name", "flags", "Features", "CPU part")
    return "; ".join(sorted({line for line in lines if line.startswith(wanted)}))


def optimizing(compiler: Compiler) -> Compiler:
    """Return the compiler with the options that a loop over columns needs: fused products and the widest registers."""
    flags = (*compiler.flags, "-O3", "-ffp-contract=fast", "-fno-math-errno", "-mprefer-vector-width=512")
    return replace(compiler, flags=known_flags(compiler.command, flags))
