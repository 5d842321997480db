"""Values that stand for missing ones, and values that no wind of their level has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .sounding import LARGEST_SPEED

CODES = (88.8, 88.88, 99.0, 99.9, 99.99, 777.7, 888.8, 999.0, 999.9, 999.99, 9999.0, 9999.9, 32767.0, 99999.0)
CODE_DISTANCE = 4.0  # robust standard deviations from the level's median: nearer, 99 m/s is a jet
CODE_SHARE = 0.1  # of the profiles that hold one and the same code at a level: then the median is one too
OUTLIER_DISTANCE = 10.0  # robust standard deviations
SMALLEST_SPREAD = 0.5  # m/s, of a level that is often calm
ENOUGH = 5  # values of a level, to know its spread


@dataclass(frozen=True)
class Fault:
    """A value that is no wind: of which profile and level, m/s."""

    profile: int
    level: int
    value: float


def find_faults(components: tuple[NDArray[np.float64], ...]) -> tuple[list[Fault], list[Fault]]:
    """Return the values of components (n, k) that stand for missing ones, and others that no wind of a level has."""
    codes: list[Fault] = []
    outliers: list[Fault] = []
    for level in range(components[0].shape[1]):
        for column in components:
            at = np.flatnonzero(np.isfinite(column[:, level]))
            values = column[at, level]
            if not at.size:
                continue
            middle = float(np.median(values))
            spread = max(1.4826 * float(np.median(np.abs(values - middle))), SMALLEST_SPREAD)
            distance = np.abs(values - middle) / spread if at.size >= ENOUGH else np.zeros(at.size)
            for i in np.flatnonzero((distance > CODE_DISTANCE) | (np.abs(values) > CODES[0] - 1)):
                fault = Fault(int(at[i]), level, float(values[i]))
                frequent = at.size >= ENOUGH and np.mean(values == values[i]) > CODE_SHARE
                if np.isclose(abs(values[i]), CODES, rtol=0, atol=1e-6).any() and (
                    frequent or distance[i] > CODE_DISTANCE
                ):
                    codes.append(fault)
                elif distance[i] > OUTLIER_DISTANCE or abs(values[i]) > LARGEST_SPEED:
                    outliers.append(fault)
    return codes, outliers
