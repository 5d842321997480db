"""Finding and running a C compiler."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..model.errors import AscentwindError

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared")
NATIVE = "-march=native"


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
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0 or not library.is_file():
            raise CompilerError(command, done.returncode, done.stderr + done.stdout)


def find_compiler() -> Compiler | None:
    """Return the compiler named by CC, else the first of cc, gcc and clang; None without one or with CC empty.

    Raises
    ------
    CompilerError
        If CC names a program that cannot be run.
    """
    named = os.environ.get("CC")
    if named is not None and not named.strip():
        return None
    for candidate in [shlex.split(named)] if named else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            command = tuple(candidate)
            return Compiler(command, _version(command), (*FLAGS, NATIVE) if _knows_native(command) else FLAGS)
        if named:
            raise CompilerError(candidate, 127, f"CC={named}: there is no such program")
    return None


@lru_cache
def _version(command: tuple[str, ...]) -> str:
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    return (done.stdout or done.stderr).partition("\n")[0].strip() or "unknown version"


@lru_cache
def _knows_native(command: tuple[str, ...]) -> bool:
    check = [*command, NATIVE, "-E", "-x", "c", "-"]
    return subprocess.run(check, input="", capture_output=True, text=True, check=False).returncode == 0


@lru_cache
def processor() -> str:
    """Return what tells processors apart that '-march=native' compiles for."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    wanted = ("model name", "flags", "Features", "CPU part")
    return "; ".join(sorted({line for line in lines if line.startswith(wanted)}))
