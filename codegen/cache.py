"""The cache of compiled libraries: by content hash, private, installed by rename, never overwritten."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import stat
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import platformdirs
from filelock import FileLock, Timeout

from ..model.errors import AscentwindError, AscentwindWarning
from ..model.names import file_name
from .compiler import Compiler, processor

log = logging.getLogger(__name__)

LOCK_SECONDS = 120


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

    ASCENTWIND_CACHE names another one.

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
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        raise CacheError(
            f"the cache folder {folder} belongs to or is writable by others, who could plant code; "
            f"run 'chmod 700 {folder}' or set ASCENTWIND_CACHE"
        )
    if not os.access(folder, os.W_OK):
        raise CacheError(f"the cache folder {folder} is not writable; set ASCENTWIND_CACHE to one that is")
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
        with FileLock(folder / f"{name}-{key}.lock", timeout=LOCK_SECONDS):
            if _intact(path):
                return CompiledLibrary(path, key, False)
            if path.exists():
                warnings.warn(
                    CacheWarning(f"the cached library {path} is damaged; it was set aside and is compiled again"),
                    stacklevel=2,
                )
                path.replace(path.with_suffix(f".damaged-{os.getpid()}"))
            _report_change(folder / f"{name}.structure.json", structure, name)
            _install(folder, path, source(), compiler)
    except Timeout:
        raise CacheError(
            f"another process has held {folder / f'{name}-{key}.lock'} for {LOCK_SECONDS} s; remove it if none runs"
        ) from None
    return CompiledLibrary(path, key, True)


def set_aside(library: CompiledLibrary) -> None:
    """Move a library that gives wrong numbers out of the way, so that the next process makes it again."""
    library.path.replace(library.path.with_suffix(f".wrong-{os.getpid()}"))


def _install(folder: Path, path: Path, source: str, compiler: Compiler) -> None:
    with tempfile.TemporaryDirectory(dir=folder) as work:
        c_file, library = Path(work) / "system.c", Path(work) / "system.so"
        c_file.write_text(source, encoding="utf-8")
        compiler.compile(c_file, library)
        digest = Path(work) / "digest"
        digest.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
        # the digest goes first: a library without one counts as damaged
        digest.replace(_digest_path(path))
        library.replace(path)


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
