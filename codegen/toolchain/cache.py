"""The cache of compiled libraries: by content hash, private, installed by rename, never overwritten."""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
import re
import shutil
import stat
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import platformdirs
from filelock import FileLock, Timeout

from ...model.errors import AscentwindError, AscentwindWarning
from ...model.system.names import file_name
from .compiler import Compiler, CompilerError, processor

log = logging.getLogger(__name__)

LOCK_SECONDS = 120
LEFT_SECONDS = 3600.0  # for which a lock or a folder may belong to a process at work
WORK = ".work"
LEFT = re.compile(r"\.(damaged|wrong)-\d+$|\.structure\.\d+$")
FULL = ("No space left on device", "Disk quota exceeded")


class CacheError(AscentwindError):
    """The cache folder cannot be used."""


class CacheWarning(AscentwindWarning):
    """A cached library was not usable and has been made again."""


@dataclass(frozen=True)
class CompiledLibrary:
    """A shared library in the cache."""

    path: Path
    key: str
    fresh: bool


def cache_folder() -> Path:
    """Return the user's private cache folder, made with mode 0700.

    ASCENTWIND_CACHE names another one; it may be read-only and the administrator's.

    Raises
    ------
    CacheError
        If it cannot be made, or others may write to it.
    """
    named = os.environ.get("ASCENTWIND_CACHE")
    folder = Path(named) if named else platformdirs.user_cache_path("ascentwind", appauthor=False)
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        raise CacheError(
            f"the cache folder {folder} cannot be made ({error.strerror}); set ASCENTWIND_CACHE to one that can"
        ) from None
    others = stat.S_IWGRP | stat.S_IWOTH
    if hasattr(os, "getuid") and (status.st_uid not in (os.getuid(), 0) or status.st_mode & others):
        raise CacheError(
            f"the cache folder {folder} belongs to or is writable by others, who could plant code; "
            f"run 'chmod 700 {folder}' or set ASCENTWIND_CACHE"
        )
    return folder


def content_key(fingerprint: str, compiler: Compiler) -> str:
    """Return the hash of everything that shapes a library.

    ``fingerprint`` stands for the C source: it hashes all that the source is written from, and is quicker to have.
    """
    parts = (fingerprint, *compiler.command, compiler.version, *compiler.flags, processor(), ca.CasadiMeta.version())
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


def compiled_library(
    name: str, fingerprint: str, source: Callable[[], str], compiler: Compiler, structure: dict[str, str]
) -> CompiledLibrary:
    """Return the library of a C source, compiled now or before.

    Parameters
    ----------
    name : str
        Of the system; a file name made of it starts those of the library.
    fingerprint : str
        Hash of what the source is written from.
    source : callable
        Writes the C source; called only when it has to be compiled.
    compiler : Compiler
    structure : dict
        Description of the system; when a library has to be made, the log says what changed since the last one.

    Raises
    ------
    CacheError, CompilerError
    """
    folder, name = cache_folder(), file_name(name)
    key = content_key(fingerprint, compiler)
    path = folder / f"{name}-{key}.so"
    if _intact(path):
        return CompiledLibrary(path, key, False)
    try:
        with FileLock(path.with_suffix(".lock"), timeout=LOCK_SECONDS):
            if _intact(path):
                return CompiledLibrary(path, key, False)
            if path.exists():
                warnings.warn(
                    CacheWarning(f"the cached library {path} is damaged; it was set aside and is compiled again"),
                    stacklevel=2,
                )
                path.replace(path.with_suffix(f".damaged-{os.getpid()}"))
            _report_change(folder / f"{name}.structure.json", structure, name)
            _install(path, source(), compiler)
    except Timeout:
        raise CacheError(
            f"another process has held {path.with_suffix('.lock')} for {LOCK_SECONDS} s; remove it if none runs"
        ) from None
    except OSError as error:
        why = error.strerror or error
        raise CacheError(f"{name} cannot be compiled in the cache folder {folder} ({why})") from None
    except CompilerError as error:
        if any(text in error.output for text in FULL):
            raise CacheError(f"{name} cannot be compiled: the disk of the cache folder {folder} is full") from None
        raise
    remove_leftovers(folder)
    return CompiledLibrary(path, key, True)


def is_compiled(name: str, fingerprint: str, compiler: Compiler) -> bool:
    """Return whether the cache has a library, whole; arguments as of :func:`compiled_library`.

    Raises
    ------
    CacheError
    """
    return _intact(cache_folder() / f"{file_name(name)}-{content_key(fingerprint, compiler)}.so")


def set_aside(library: CompiledLibrary) -> None:
    """Move a library that gives wrong numbers out of the way, so that the next process makes it again."""
    with contextlib.suppress(OSError):  # of a read-only cache; it is not used here in any case
        library.path.replace(library.path.with_suffix(f".wrong-{os.getpid()}"))


def _install(path: Path, source: str, compiler: Compiler) -> None:
    with tempfile.TemporaryDirectory(prefix=f"{path.stem}.", suffix=WORK, dir=path.parent) as work:
        c_file, library = Path(work) / "system.c", Path(work) / "system.so"
        c_file.write_text(source, encoding="utf-8")
        compiler.compile(c_file, library)
        digest = Path(work) / "digest"
        digest.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
        # the digest goes first: a library without one counts as damaged
        digest.replace(_digest_path(path))
        library.replace(path)


def remove_leftovers(folder: Path, older: float = LEFT_SECONDS) -> int:
    """Remove what killed processes left: folders of compilers, locks nobody holds, libraries set aside, half files.

    Parameters
    ----------
    folder : Path
    older : float
        Only what is older, s.

    Returns
    -------
    int
        How many files and folders.
    """
    count, now = 0, time.time()
    for path in _listed(folder):
        with contextlib.suppress(OSError, Timeout):
            if now - path.stat().st_mtime < older:
                continue
            if path.suffix == ".lock":
                with FileLock(path, timeout=0):
                    path.unlink(missing_ok=True)
            elif path.suffix == WORK:
                with FileLock(folder / f"{path.name.split('.')[0]}.lock", timeout=0):
                    shutil.rmtree(path)
            elif LEFT.search(path.name):
                path.unlink()
            else:
                continue
            count += 1
    return count


@dataclass(frozen=True)
class CacheContents:
    """What a cache folder holds: compiled libraries, all files, and their size in bytes."""

    libraries: int
    files: int
    size: int


def cache_contents(folder: Path) -> CacheContents:
    """Return what a cache folder holds."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = 0
    for path in files:
        with contextlib.suppress(OSError):
            size += path.stat().st_size
    return CacheContents(sum(path.suffix == ".so" for path in files), len(files), size)


def clean_cache(folder: Path) -> int:
    """Remove all compiled libraries but those that a process is making, and what goes with them.

    Returns
    -------
    int
        How many files and folders.

    Raises
    ------
    CacheError
    """
    count = 0
    try:
        for path in _listed(folder):
            if path.suffix in (".so", ".sha256") or path.name.endswith(".structure.json"):
                path.unlink(missing_ok=True)
                count += 1
    except OSError as error:
        raise CacheError(f"the cache folder {folder} cannot be cleaned ({error.strerror or error})") from None
    return count + remove_leftovers(folder, older=0.0)


def _listed(folder: Path) -> list[Path]:
    """Return what stands in the folder, work before the locks that guard it."""
    return sorted(folder.iterdir(), key=lambda path: path.suffix == ".lock")


def _digest_path(path: Path) -> Path:
    return path.with_suffix(".sha256")


def _intact(path: Path) -> bool:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() == _digest_path(path).read_text()
    except OSError:
        return False


def _report_change(record: Path, structure: dict[str, str], name: str) -> None:
    try:
        before = json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        before = None
    if before is None:
        log.info("%s: compiling generated C for the first time", name)
    elif changes := describe_changes(before, structure):
        log.info("%s: compiling again because %s", name, "; ".join(changes))
    else:
        log.info("%s: compiling again because the compiler, processor, CasADi or ascentwind changed", name)
    temporary = record.with_suffix(f".{os.getpid()}")
    temporary.write_text(json.dumps(structure), encoding="utf-8")
    temporary.replace(record)


def describe_changes(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """Return what differs between two structures, as 'what: old -> new'."""
    keys = dict.fromkeys((*before, *after))
    return [
        f"{key}: {before.get(key, 'none')} -> {after.get(key, 'none')}"
        for key in keys
        if before.get(key, "none") != after.get(key, "none")
    ]
