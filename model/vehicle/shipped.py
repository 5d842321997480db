"""The vehicles that ship with the package, by name."""

from __future__ import annotations

from pathlib import Path

from ..errors import UnknownNameError

VEHICLE_FILE = "vehicle.toml"
_FOLDER = Path(__file__).parents[1] / "vehicles"


def built_in_vehicles() -> dict[str, Path]:
    """Return the folders of the shipped vehicles by name."""
    return {f.name: f for f in sorted(_FOLDER.iterdir()) if (f / VEHICLE_FILE).is_file()}


def find_vehicle(name: str | Path) -> Path:
    """Return the folder of a shipped vehicle, or the folder named.

    Raises
    ------
    UnknownNameError
        If it is neither.
    """
    shipped = built_in_vehicles()
    if str(name) in shipped:
        return shipped[str(name)]
    if Path(name).is_dir():
        return Path(name)
    raise UnknownNameError("vehicle or folder", str(name), shipped)
