"""A case whose vehicle meets other mean winds: what its deviations do goes with its mean response."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.tables import Table
from ..case.case import Case


def in_mean_winds(
    case: Case, wind: Callable[[int, NDArray[np.float64]], NDArray[np.float64]], added: bool = False
) -> Case:
    """Return a case in other mean winds; nothing is assembled again.

    Parameters
    ----------
    case : Case
    wind : callable
        Of the number of a wind that the vehicle meets and altitudes (m): its mean there, m/s.
    added : bool
        Whether that comes on top of the case's own.
    """
    polynomials = {}
    scale = case.parameters["wind.mean_scale"].value if added else 1.0
    for number, old in enumerate(case.vehicle_for("another mean wind").wind.means):
        values = wind(number, old.argument) / scale + (old.values if added else 0.0)
        polynomials[old.name] = Table(old.name, old.unit, old.argument, values, old.interpolation).polynomial
    groups = tuple(group.with_polynomials(polynomials) for group in case.executable.groups)
    return Case(case.executable.with_numbers(groups=groups), case.vehicle)
