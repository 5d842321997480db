"""The files that a vehicle's own files name: inside its folder, regular, of bounded size."""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Annotated, Any

from pydantic import WrapValidator

from ..errors import DataError

LARGEST = 64 * 2**20  # bytes
SHIPPED = Path(__file__).parents[1]  # installers may make every file in there a link into a cache of theirs


class OwnPath(str):
    """A path that its user gave in Python or on the command line; it may lead anywhere."""


def _checked(value: Any, validate: Callable[[Any], str]) -> str:
    if isinstance(value, OwnPath):
        return value
    name = validate(value)
    parts, windows = PurePosixPath(name).parts, PureWindowsPath(name)
    if not parts or not name.isprintable():
        raise ValueError("is not the name of a file")
    if PurePosixPath(name).is_absolute() or windows.drive or windows.root or ".." in parts or "\\" in name:
        raise ValueError(
            "leads out of the folder; give a file inside it, by its path from there with '/' between folders"
        )
    return name


FileName = Annotated[str, WrapValidator(_checked)]


def file_inside(folder: Path, name: str) -> Path:
    """Return the path of a file that a key names, whether it is to be read or written.

    Parameters
    ----------
    folder : Path
    name : str
        As checked by ``FileName``; an ``OwnPath`` is only joined.

    Raises
    ------
    DataError
        It leads out of the folder by a link, unless the package came with it, is no regular file, or is larger than
        ``LARGEST``. A file that is not there is no error here.
    """
    path = folder / name
    if isinstance(name, OwnPath):
        return path
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        if not inside and not path.absolute().is_relative_to(SHIPPED):
            raise DataError("is a link that leads out of the folder; copy the file into it", file=path)
        status = path.stat()
    except FileNotFoundError:
        return path
    except (OSError, RuntimeError) as error:  # a circle of links, a folder that is a file
        why = getattr(error, "strerror", None) or "a circle of links"
        raise DataError(f"cannot be reached ({why})", file=path) from None
    if not stat.S_ISREG(status.st_mode):
        raise DataError("is not a regular file; give one", file=path)
    if status.st_size > LARGEST:
        raise DataError(
            f"has {status.st_size / 2**20:.0f} MB, more than the {LARGEST // 2**20} MB that are read; make it shorter",
            file=path,
        )
    return path


def unsafe_to_copy(folder: Path) -> Callable[[str, list[str]], set[str]]:
    """Return what a copy of a folder leaves out, as the ``ignore`` of ``shutil.copytree``.

    Those are folders behind links, files by links from outside, devices, pipes, and what is too large.
    """

    def left_out(inner: str, names: list[str]) -> set[str]:
        return {name for name in names if not _may_be_copied(folder, Path(inner, name))}

    return left_out


def _may_be_copied(folder: Path, path: Path) -> bool:
    if path.is_dir():
        return not path.is_symlink()
    try:
        return file_inside(folder, str(path.relative_to(folder))).is_file()
    except DataError:
        return False
