"""Which files of a results folder belong together: what a command wrote, and nothing of an earlier run of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ...model.errors import DataError
from ...model.files.folder_files import file_inside
from .files import write_text

MANIFEST = "manifest.json"
PAGE = "report"  # the command whose file shows what the others wrote
RESULTS = (".nc", ".csv", ".png", ".svg")


class Manifest:
    """The files of one command in a results folder.

    Between ``begin`` and ``finish`` the manifest says that the run is not complete.

    Parameters
    ----------
    folder : Path
    command : str
        Each command has its own list: several may write to one folder.
    of : str
        The vehicle or system computed.
    about : mapping, optional
        What else a reader is told of it, such as the command as it was typed; goes into JSON.
    """

    def __init__(self, folder: Path, command: str, of: str, about: Mapping[str, object] | None = None):
        self.folder, self.command, self.of, self.about = folder, command, of, dict(about or {})
        self.commands = read_manifest(folder)
        self.earlier: dict[str, str] = dict(self.commands.get(command, {}).get("files", {}))

    @classmethod
    def begin(cls, folder: Path, command: str, of: str, about: Mapping[str, object] | None = None) -> Manifest:
        """Say that the files of an earlier run are about to be replaced.

        Raises
        ------
        OutputFolderError
        """
        manifest = cls(folder, command, of, about)
        manifest._write(False, manifest.earlier)
        return manifest

    def finish(self, written: Sequence[Path]) -> list[str]:
        """Remove what an earlier run left and this one did not write, and list what belongs to this run.

        Returns
        -------
        list of str
            Sentences about files removed, and about others in the folder that are not of this run.

        Raises
        ------
        OutputFolderError
        """
        files = {path.name: file_hash(path) for path in written}
        removed, kept = [], []
        for name, digest in self.earlier.items():
            path = own_file(self.folder, name)
            if name in files or path is None:
                continue
            if file_hash(path) == digest:
                path.unlink()
                removed.append(name)
            else:
                kept.append(name)
        self._write(True, files)
        stale = [n for n in self.commands.get(PAGE, {}).get("files", {}) if own_file(self.folder, n) is not None]
        return [
            *_sentence("removed, of an earlier run", removed),
            *_sentence("not of this run", kept + self._others()),
            *_sentence(
                "of the results before; 'ascentwind report' writes it anew", stale if self.command != PAGE else []
            ),
        ]

    def _others(self) -> list[str]:
        """Return results in the folder that no command's list holds."""
        listed = {name for entry in self.commands.values() for name in (*entry.get("files", {}), MANIFEST)}
        listed |= self.earlier.keys()
        return sorted(p.name for p in self.folder.iterdir() if p.suffix in RESULTS and p.name not in listed)

    def _write(self, complete: bool, files: dict[str, str]) -> None:
        entry = {"of": self.of, "ascentwind": version("ascentwind"), "complete": complete, "files": files}
        self.commands[self.command] = entry | ({"about": self.about} if self.about else {})
        text = json.dumps(self.commands, indent=1, ensure_ascii=False) + "\n"
        write_text(self.folder / MANIFEST, text)


def read_manifest(folder: Path) -> dict[str, dict[str, Any]]:
    """Return the manifest of a folder by command; what cannot be read as one counts as none."""
    try:
        found = json.loads(file_inside(folder, MANIFEST).read_text(encoding="utf-8"))
        return {
            str(command): {**entry, "files": {str(k): str(v) for k, v in entry["files"].items()}}
            for command, entry in found.items()
        }
    except (OSError, DataError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return {}


def own_file(folder: Path, name: str) -> Path | None:
    """Return a file of the folder itself that a manifest names, if it is there."""
    path = folder / name
    if Path(name).name != name or path.is_symlink() or not path.is_file():
        return None
    return path


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _sentence(what: str, names: list[str]) -> list[str]:
    if not names:
        return []
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    return [f"{what}: {', '.join(names[:6])}{more}"]
