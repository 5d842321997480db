"""Names and units as people read them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

# what people read: factor from SI, unit
DISPLAY = {
    "rad": (180 / np.pi, "deg"),
    "m": (1.0, "m"),
    "m/s": (1.0, "m/s"),
    "Pa rad": (1e-3 * 180 / np.pi, "kPa deg"),
    "1": (1.0, "1"),
}
NEWTONS = ("N", "N m", "N m/rad")
PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""))  # of newtons: the first that leaves the largest value at 1 or more
BRITISH = {"center": "centre", "generalized": "generalised"}  # names are American, prose is not


def display(unit: str, values: ArrayLike) -> tuple[float, str]:
    """Return the factor from SI and the unit in which values of a response are shown."""
    if unit in NEWTONS:
        largest = float(np.nanmax(np.abs(values)))
        size, prefix = next((p for p in PREFIXES if largest >= p[0]), PREFIXES[0])
        return 1 / size, prefix + unit
    return DISPLAY.get(unit, (1.0, unit))


def words(name: str) -> str:
    """Return a name as words of prose, which is British: 'center_of_pressure' becomes 'centre of pressure'."""
    found = name.replace("_", " ")
    for american, british in BRITISH.items():
        found = found.replace(american, british)
    return found
