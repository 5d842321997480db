"""A design wind as the file that flight simulations read: altitude, wind towards the east, wind towards the north."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...model.errors import DataError
from ...model.vehicle.planes import BOTH
from ..case.case import Case
from ..present.files import prepare_folder, write_text


def write_wind(case: Case, altitude: np.ndarray, wind: np.ndarray, path: Path) -> Path:
    """Write altitude [m], u [m/s] and v [m/s], linear between rows.

    Of a vehicle in one plane the component of the other direction is zero.

    Parameters
    ----------
    case : Case
        Whose vehicle has a record of how its wind is taken across the flight.
    altitude : (k,) array
        m.
    wind : (k,) or (k, 2) array
        m/s towards the vehicle's +Y, or in both planes u and v.
    path : Path

    Raises
    ------
    DataError
        The vehicle does not say which component of the wind its own is.
    OutputFolderError
    """
    vehicle = case.vehicle_for("a design wind")
    if vehicle.file.planes == BOTH:
        both = np.asarray(wind, float)
        return _write(altitude, both[:, 0], both[:, 1], path)
    record = vehicle.wind.record
    if record is None:
        raise DataError(
            "does not say which component of the wind blows across the flight, so that u and v are unknown; add "
            "[wind.record], or take altitude and wind from the profile",
            file=vehicle.folder / "vehicle.toml",
            column="wind.record",
        )
    own, zero = record.sign * np.asarray(wind, float), np.zeros(len(wind))
    u, v = (own, zero) if record.origin.component == "zonal" else (zero, own)
    return _write(altitude, u, v, path)


def _write(altitude: np.ndarray, u: np.ndarray, v: np.ndarray, path: Path) -> Path:
    rows = [f"{h:.10g},{x:.10g},{y:.10g}" for h, x, y in zip(altitude, u, v, strict=True)]
    text = "\n".join(["altitude [m],u [m/s],v [m/s]", *rows, ""])
    prepare_folder(path.parent)
    return write_text(path, text)
