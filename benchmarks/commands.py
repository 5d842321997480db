"""Processor time of the commands, children included, as ratios of one run: to importing them, and to another version.

    python benchmarks/commands.py [PYTHON_WITH_AN_OTHER_VERSION [FIRST_WORDS_OF_COMMANDS...]]

Each version runs in a folder of its own with caches of compiled models and of bytecode of its own. Commands run once to
fill them, then in turn, and the least of the turns counts, so that other work on the machine favours none; ``first`` is
with an empty cache of compiled models. With the Python of an environment that holds another version the same commands
run there as well, where it has them, and ``same/`` is that version's AS-504, whose outputs both give.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROUNDS = 2
IMPORT = "import ascentwind.runners.cli.app"
WARM_LOAD = "from ascentwind.runners.study import Study; Study.load('as504')"
SHIPPED = "import ascentwind.model as model; print(*model.__path__)"
MADE = "built"  # by build-vehicle, which writes into no folder that exists
LIMITS = "time [s],bending_moment [N m]\n10,60e6\n150,60e6\n"
SAME = "same/as504"
COMMANDS = (
    "--help",
    "run as504",
    f"run {SAME}",
    "verify as504",
    f"verify {SAME}",
    "tolerance as504",
    f"tolerance {SAME}",
    "sensitivity as504",
    f"build-vehicle as504 --out {MADE}",
    "inspect as504 --time 75",
    "flight-load as504 --response bending_moment",
    "gust as504",
    "availability as504 --limit limits.csv",
    "regenerate as504 --out generated",
    "run as504 --set planes=both",
    "run falcon1",
)
COLD = ("Study.load", "run as504", f"run {SAME}")


@dataclass
class Version:
    """One version, its folder, and what its programs took (s)."""

    python: Path
    folder: Path
    cold: dict[str, float] = field(default_factory=dict)
    least: dict[str, float] = field(default_factory=dict)

    def seconds(self, program: tuple[str, ...], cache: str = "cache") -> float:
        """Return the processor time of a program and its children, s; NaN where it fails."""

        def used() -> float:
            children = resource.getrusage(resource.RUSAGE_CHILDREN)
            return children.ru_utime + children.ru_stime

        own = {"ASCENTWIND_CACHE": str(self.folder / cache), "PYTHONPYCACHEPREFIX": str(self.folder / "bytecode")}
        surroundings = os.environ | own | {"OPENBLAS_NUM_THREADS": "1"}
        surroundings.pop("PYTHONDONTWRITEBYTECODE", None)
        shutil.rmtree(self.folder / MADE, ignore_errors=True)
        before = used()
        done = subprocess.run(
            program, cwd=self.folder, env=surroundings, capture_output=True, stdin=subprocess.DEVNULL, check=False
        )
        return used() - before if done.returncode == 0 else float("nan")

    def programs(self, wanted: list[str]) -> dict[str, tuple[str, ...]]:
        """Return the programs by the names under which they are printed."""
        python, command = str(self.python), str(self.python.with_name("ascentwind"))
        found = {"import": (python, "-c", IMPORT), "Study.load": (python, "-c", WARM_LOAD)}
        always = ("run as504", f"run {SAME}")
        chosen = [line for line in COMMANDS if not wanted or line in always or line.startswith(tuple(wanted))]
        return found | {line: (command, *line.split()) for line in chosen}

    def measure(self, name: str, program: tuple[str, ...]) -> None:
        """Run a program once more; what fails is not run again."""
        before = self.least.get(name, float("inf"))
        if before == before:  # no NaN
            self.least[name] = min(self.seconds(program), before)


def prepared(python: Path, folder: Path, other: Path) -> Version:
    """Return a version with the files that its commands read, the vehicle of the other one among them."""
    folder.mkdir()
    (folder / "limits.csv").write_text(LIMITS, encoding="utf-8")
    where = subprocess.run([str(other), "-c", SHIPPED], capture_output=True, text=True, check=True, cwd=folder).stdout
    shutil.copytree(Path(where.strip()) / "vehicles" / "as504", folder / SAME)
    return Version(python, folder)


def main() -> None:
    """Measure and print."""
    own, *others = [Path(sys.executable), *(Path(python) for python in sys.argv[1:2])]
    wanted = sys.argv[2:]
    with tempfile.TemporaryDirectory() as top:
        versions = [
            prepared(python, Path(top) / str(k), (others or [own])[0]) for k, python in enumerate([own, *others])
        ]
        programs = [version.programs(wanted) for version in versions]
        for version, its in zip(versions, programs, strict=True):
            version.seconds(its["import"])
            for name, program in its.items():
                if name in COLD:
                    version.cold[name] = version.seconds(program, f"empty {len(version.cold)}")
                version.measure(name, program)
                version.least[name] += 1e9  # it filled the caches, and does not count
        for turn in range(ROUNDS):
            for name in programs[0]:
                for version, its in zip(versions, programs, strict=True):
                    version.measure(name, its[name])
            show(turn + 1, *versions)


def show(turns: int, own: Version, other: Version | None = None) -> None:
    """Print the table."""
    print(f"processor time of this version, least of {turns} in turn; 'first' with an empty cache of compiled models")
    heads = ("s", "/ import", "first, s") + ("/ other", "/ its run", "first / other") * (other is not None)
    print(" " * 46 + "".join(f"{head:>14}" for head in heads))
    for name, seconds in own.least.items():
        first = own.cold.get(name, float("nan"))
        numbers = [seconds, seconds / own.least["import"], first]
        if other is not None:
            run = other.least[f"run {SAME}" if SAME in name else "run as504"]
            numbers += [seconds / other.least[name], seconds / run, first / other.cold.get(name, float("nan"))]
        print(
            f"{name:46}" + "".join(f"{number:14.2f}" if number == number else " " * 14 for number in numbers),
            flush=True,
        )


if __name__ == "__main__":
    main()
