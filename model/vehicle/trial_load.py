"""Loading a vehicle in a temporary folder, before its files take their place."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import AscentwindWarning, DataError
from .reader import load_vehicle


def load_trial(made: Path, folder: Path, changes: Mapping[str, Any] | None = None) -> None:
    """Load a vehicle as made; its errors and warnings name the files of the folder that it is for.

    Raises
    ------
    DataError

    Warns
    -----
    As :func:`load_vehicle`.
    """
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            load_vehicle(made, changes)
        except DataError as error:
            file = None if error.file is None else folder / Path(error.file).relative_to(made)
            raise DataError(error.why, file=file, column=error.column, row=error.row, time=error.time) from None
    for warning in told:
        message = warning.message
        if isinstance(message, AscentwindWarning):
            message = type(message)(str(message).replace(str(made), str(folder)))
        warnings.warn(message, warning.category, stacklevel=2)
