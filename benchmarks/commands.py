"""Processor time of the commands, children included, as ratios of one run: to importing them, and to another version.

    python benchmarks/commands.py [PYTHON_WITH_AN_OTHER_VERSION]

Each command runs in an empty folder of its own with a cache of compiled models of its own: first with nothing there
(cold), then in turn with the others; the least of the turns counts, so that other work on the machine favours none.
With the Python of an environment that holds another version the same commands run there as well, where it has them.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROUNDS = 3
IMPORT = "import ascentwind.runners.cli.app"
WARM_LOAD = "from ascentwind.runners import Study; Study.load('as504')"
LIMITS = "time [s],bending_moment [N m]\n10,60e6\n150,60e6\n"
COMMANDS = (
    ("--help",),
    ("run", "as504"),
    ("run", "as504", "--set", "planes=both"),
    ("run", "falcon1"),
    ("verify", "as504"),
    ("tolerance", "as504"),
    ("sensitivity", "as504"),
    ("flight-load", "as504", "--response", "bending_moment"),
    ("gust", "as504"),
    ("availability", "as504", "--limit", "limits.csv"),
    ("build-vehicle", "as504"),
    ("regenerate", "as504"),
)


@dataclass
class Version:
    """One version, its cache, and what its programs took (s)."""

    python: Path
    folder: Path
    cold: dict[str, float]
    least: dict[str, float]

    def seconds(self, program: tuple[str, ...]) -> float:
        """Return the processor time of a program and its children, s; NaN where it fails."""

        def used() -> float:
            children = resource.getrusage(resource.RUSAGE_CHILDREN)
            return children.ru_utime + children.ru_stime

        surroundings = os.environ | {"ASCENTWIND_CACHE": str(self.folder / "cache"), "OPENBLAS_NUM_THREADS": "1"}
        before = used()
        done = subprocess.run(
            program, cwd=self.folder, env=surroundings, capture_output=True, stdin=subprocess.DEVNULL, check=False
        )
        return used() - before if done.returncode == 0 else float("nan")

    def programs(self) -> dict[str, tuple[str, ...]]:
        """Return the programs by the names under which they are printed."""
        python, command = str(self.python), str(self.python.with_name("ascentwind"))
        found = {"import": (python, "-c", IMPORT), "Study.load": (python, "-c", WARM_LOAD)}
        return found | {" ".join(arguments): (command, *arguments) for arguments in COMMANDS}

    def measure(self, name: str) -> None:
        """Run a program once more; what fails is not run again."""
        before = self.least.get(name, float("inf"))
        if before == before:  # no NaN
            self.least[name] = min(self.seconds(self.programs()[name]), before)


def main() -> None:
    """Measure and print."""
    pythons = [Path(sys.executable), *(Path(other) for other in sys.argv[1:])]
    with tempfile.TemporaryDirectory() as top:
        versions = []
        for number, python in enumerate(pythons):
            folder = Path(top) / str(number)
            folder.mkdir()
            (folder / "limits.csv").write_text(LIMITS, encoding="utf-8")
            versions.append(Version(python, folder, {}, {}))
        names = list(versions[0].programs())
        for version in versions:
            for name in names:
                version.cold[name] = version.seconds(version.programs()[name])
        for turn in range(ROUNDS):
            for name in names:
                for version in versions:
                    version.measure(name)
            print(f"turn {turn + 1} of {ROUNDS} done", file=sys.stderr, flush=True)
    print(f"processor time of this version, least of {ROUNDS} in turn; 'first' with an empty cache of compiled models")
    print(
        f"{'':34}{'s':>8}{'/ import':>10}{'first, s':>10}"
        + ("{:>12}{:>12}".format("/ other", "first") * bool(versions[1:]))
    )
    own = versions[0]
    for name in names:
        line = f"{name:34}{own.least[name]:8.2f}{own.least[name] / own.least['import']:10.2f}{own.cold[name]:10.2f}"
        for other in versions[1:]:
            line += f"{own.least[name] / other.least[name]:12.2f}{own.cold[name] / other.cold[name]:12.2f}"
        print(line)


if __name__ == "__main__":
    main()
