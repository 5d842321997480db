"""How long ascentwind makes wait before it computes: processor time of fresh interpreters, as ratios of one run.

    python benchmarks/startup.py [PYTHON_WITH_AN_OTHER_VERSION]

The programs run in turn and the least of each counts, so that other work on the machine favours none. With the Python
of an environment that holds another version, its ``ascentwind --help`` is measured too.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

ROUNDS = 15
EMPTY, TYPER, FRONT, COMMANDS = "pass", "import typer, rich", "import ascentwind", "import ascentwind.runners.cli.app"


def seconds(program: tuple[str, ...]) -> float:
    """Return the processor time of a program, s."""

    def used() -> float:
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return children.ru_utime + children.ru_stime

    before = used()
    subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
    return used() - before


def main() -> None:
    """Measure and print."""
    programs = {code: (sys.executable, "-c", code) for code in (EMPTY, TYPER, FRONT, COMMANDS)}
    programs["--help"] = (str(Path(sys.executable).with_name("ascentwind")), "--help")
    programs["--version"] = (str(Path(sys.executable).with_name("ascentwind")), "--version")
    if other := sys.argv[1:]:
        programs["other --help"] = (str(Path(other[0]).with_name("ascentwind")), "--help")
    for program in programs.values():
        seconds(program)  # bytecode and file caches
    least = dict.fromkeys(programs, float("inf"))
    for _ in range(ROUNDS):
        for name, program in programs.items():
            least[name] = min(least[name], seconds(program))
    print(f"processor time, least of {ROUNDS} in turn")
    for name, time in least.items():
        print(f"{name:36}{1e3 * time:8.0f} ms")
    print(f"{'import ascentwind / empty Python':36}{least[FRONT] / least[EMPTY]:8.2f}")
    print(f"{'command line / typer and rich':36}{least[COMMANDS] / least[TYPER]:8.2f}")
    if other:
        print(f"{'--help / --help of the other':36}{least['--help'] / least['other --help']:8.3f}")


if __name__ == "__main__":
    main()
