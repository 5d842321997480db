"""Copying a vehicle folder as the start of another one."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from ..model.construction.construction_file import CONSTRUCTION_FILE
from ..model.errors import OutputFolderError
from ..model.folder_files import unsafe_to_copy
from ..model.shipped import find_vehicle
from ..model.vehicle import VEHICLE_FILE, load_vehicle


def copy_vehicle(source: str | Path, folder: Path) -> list[Path]:
    """Copy a vehicle into a new folder and name it after the folder.

    Raises
    ------
    OutputFolderError
        If the folder exists and is not empty, or cannot be made.
    """
    start = find_vehicle(source)
    load_vehicle(start)
    name = re.sub(r"[^A-Za-z0-9_]", "_", folder.resolve().name)
    name = name if name[:1].isalpha() else f"vehicle_{name}"
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise OutputFolderError(f"{folder} exists already and is not empty; choose another folder")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as work:
            made = Path(work) / "vehicle"
            shutil.copytree(start, made, copy_function=shutil.copyfile, ignore=unsafe_to_copy(start))
            for file in (VEHICLE_FILE, CONSTRUCTION_FILE):
                toml = made / file
                if toml.is_file():
                    toml.write_text(re.sub(r'(?m)^name = ".*"', f'name = "{name}"', toml.read_text(), count=1))
            made.replace(folder)
    except OSError as error:
        raise OutputFolderError(f"{folder} cannot be made ({error.strerror or error}); choose another folder") from None
    return sorted(folder.iterdir())
