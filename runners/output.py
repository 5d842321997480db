"""Writing results: a folder checked beforehand, every file whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..model.errors import OutputFolderError
from .statistics import ResponseStatistics

HALF_FILE = re.compile(r"\..+\.(?P<process>\d+)\.unfinished(\.\w+)?")
COLUMNS = ("time_s", "response", "unit", "source", "mean", "variance", "std", "mean_plus_3sigma")


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


def write_statistics(statistics: ResponseStatistics, folder: Path) -> list[Path]:
    """Write statistics.nc (NetCDF) and statistics.csv (one row a time, response and source)."""
    text = statistics_csv(statistics)
    return [
        write_whole(folder / "statistics.nc", lambda p: statistics.to_netcdf(p, engine="scipy")),
        write_whole(folder / "statistics.csv", lambda p: p.write_text(text, encoding="utf-8")),
    ]


def statistics_csv(statistics: ResponseStatistics) -> str:
    """Return the statistics as tidy CSV."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    values = {name: statistics[name].values for name in COLUMNS[4:]}
    for k, time in enumerate(statistics["time"].values):
        for r, response in enumerate(statistics["response"].values):
            for s, source in enumerate(statistics["source"].values):
                numbers = (np.format_float_scientific(values[name][k, r, s], 9) for name in COLUMNS[4:])
                writer.writerow([f"{time:.12g}", response, statistics["unit"].values[r], source, *numbers])
    return buffer.getvalue()
