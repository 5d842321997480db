"""Writing results: a folder checked beforehand, every file whole or not at all."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

from ...model.errors import OutputFolderError

HALF_FILE = re.compile(r"\..+\.(?P<process>\d+)\.unfinished(\.\w+)?")


def prepare_folder(folder: Path) -> None:
    """Make a folder and make sure that it can be written, before anything is computed.

    Raises
    ------
    OutputFolderError
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        _remove_leftovers(folder)
    except OSError as error:
        raise OutputFolderError(
            f"results cannot be written to {folder} ({error.strerror or error}); choose another folder with --out"
        ) from None


def _remove_leftovers(folder: Path) -> None:
    """Remove half files of processes that are no more."""
    for path in folder.glob(".*"):
        if (left := HALF_FILE.fullmatch(path.name)) and not _runs(int(left["process"])):
            path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    if os.name != "posix":
        return True  # there is no asking without harm
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def write_whole(path: Path, write: Callable[[Path], object]) -> Path:
    """Let ``write`` fill a temporary file beside ``path`` and put it in place by rename.

    Raises
    ------
    OutputFolderError
        The file that stood at ``path`` before, if any, is untouched.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.unfinished{path.suffix}")
    try:
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        raise OutputFolderError(
            f"{path} cannot be written ({error.strerror or error}); nothing was left there"
        ) from None
    finally:
        temporary.unlink(missing_ok=True)
    return path


def write_text(path: Path, text: str) -> Path:
    """Write text whole, in UTF-8.

    Raises
    ------
    OutputFolderError
    """
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_bytes(path: Path, contents: bytes) -> Path:
    """Write a file whole, and onto the disk before it takes its name.

    Raises
    ------
    OutputFolderError
        With the size that did not find room.
    """

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            file.write(contents)
            file.flush()
            os.fsync(file.fileno())

    try:
        return write_whole(path, write)
    except OutputFolderError as error:
        raise OutputFolderError(f"{error} ({len(contents)} bytes)") from None
