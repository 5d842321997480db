"""The frame of a command that computes: its study, its folder, its progress, its last line."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...model.errors import UnknownNameError, UnusedOptionError
from ..present.progress import Steps, opened
from ..present.progress import steps as own_steps
from ..present.terminal import console, machine_reads, warned
from .terminal import parse_changes

if TYPE_CHECKING:
    from ..present.manifest import Manifest
    from ..study import Study

SHOWN = ("default_times", "title", "weighting_times_s")  # keys of vehicle.toml that no equation holds
KEY = "wind.turbulence.severity"


def load_study(
    vehicle: str | Path,
    changes: Sequence[str] | None = None,
    shows: Sequence[str] = (),
    turbulence: str | None = None,
    *,
    compile: bool = True,
) -> Study:
    """Load a vehicle with the changes typed after ``--set``.

    Parameters
    ----------
    vehicle : str or Path
    changes : sequence of str, optional
        Each 'KEY=VALUE'.
    shows : sequence of str
        Which of ``SHOWN`` the command reads: another one would change nothing.
    turbulence : str, optional
        What was typed after ``--turbulence``.
    compile : bool
        False where so little is computed that compilers would take longer.

    Raises
    ------
    DataError, UnknownNameError, UnusedOptionError
    """
    wanted = checked_changes(changes, shows)
    if turbulence is not None:
        wanted |= _with_turbulence(turbulence, wanted)
    with steps("loading"):
        from ..study import Study

        return Study.load(vehicle, compile=compile, changes=wanted)


def checked_changes(changes: Sequence[str] | None, shows: Sequence[str] = ()) -> dict[str, Any]:
    """Return the changes typed after ``--set``, as :func:`load_study` takes them.

    Raises
    ------
    DataError, UnusedOptionError
    """
    wanted = parse_changes(changes or [])
    for key in SHOWN:
        if key in wanted and key not in shows:
            raise UnusedOptionError(f"--set {key} is not used here and would change nothing; leave it out")
    return wanted


def _with_turbulence(typed: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    from ...model.wind.turbulence import SEVERITY

    if typed not in (known := ("off", *SEVERITY)):
        raise UnknownNameError("severity of turbulence", typed, known)
    if {"wind.turbulence", KEY} & changes.keys():
        raise UnusedOptionError(f"--turbulence and --set {KEY} name two severities; leave one of them out")
    return {KEY: typed}


@contextmanager
def on_terminal() -> Iterator[None]:
    """Show on the terminal what the library says of its progress."""
    from ..present.bars import terminal_bar

    with opened(terminal_bar(console)):
        yield


@contextmanager
def steps(text: str, total: float | None = None) -> Iterator[Steps]:
    """Show a bar on the terminal while something is computed, with what the library says of it."""
    with on_terminal(), own_steps(text, total) as line:
        yield line


class Job:
    """What a command writes: a folder that is there before anything is computed, its files, and a last line.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OutputFolderError
        If nothing can be written there.
    """

    def __init__(self, folder: Path):
        from ..present.files import prepare_folder

        prepare_folder(folder)
        self.folder = folder
        self.written: list[Path] = []
        self.notes: list[str] = []  # what people are told beside the tables, kept for a report
        self.manifest: Manifest | None = None

    def replace_earlier(self, command: str, of: Study | str) -> None:
        """Say in the folder's manifest that what an earlier run of a command wrote is about to be replaced.

        Parameters
        ----------
        command : str
        of : Study or str
            The study, or the name of what is no vehicle.

        Raises
        ------
        OutputFolderError
        """
        from ..case.description import description
        from ..present.manifest import Manifest

        about, name = {"typed": typed()}, of
        if not isinstance(of, str):
            about, name = about | description(of), of.system.name
        self.manifest = Manifest.begin(self.folder, command, str(name), about)
        if count := len(self.manifest.earlier):
            said = f"{self.folder} holds an earlier '{command}': its {count} files are replaced"
            console.print(said, style="dim", soft_wrap=True, markup=False, highlight=False)

    def end(self) -> None:
        """Print what was written and where, and what became of an earlier run's files.

        Raises
        ------
        OutputFolderError
        """
        print_files(self.written, self.folder)
        if self.manifest is None:
            return
        self.manifest.about |= {"notes": self.notes, "warnings": list(dict.fromkeys(warned))}
        for sentence in self.manifest.finish(self.written):
            console.print(sentence, style="dim", soft_wrap=True, markup=False)


def typed() -> str:
    """Return the command as it was typed, for a shell."""
    return shlex.join(["ascentwind", *sys.argv[1:]])


def print_files(written: Iterable[Path], folder: Path) -> None:
    """Print the last line of a command: the files it wrote, by their place in a folder."""
    written = list(written)
    machine_reads.wrote(written, folder)
    names = [path.relative_to(folder).as_posix() for path in written]
    count = "1 file" if len(names) == 1 else f"{len(names)} files"
    console.print(f"{count} in {folder}: {', '.join(names)}", soft_wrap=True)
