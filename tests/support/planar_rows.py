"""The rigid-body rows of the linear model, 4-1 to 4-3, as CasADi's linearisation of the nonlinear planar equations."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ascentwind.model.construction.planar_equations import planar_motion
from ascentwind.model.system.symbols import TableSymbols

ROWS = ("forward", "lateral", "rotation", "angle_of_attack")
COLUMNS = ("forward_speed", "lateral_velocity", "attitude", "engine_angle", "wind")


def planar_rows(
    tables: Mapping[str, float], reference_area: float, about: Mapping[str, float] | None = None
) -> NDArray[np.float64]:
    """Return the Jacobian of the planar motion.

    Parameters
    ----------
    tables : mapping
        Table values at the time, by name (``Study.tables``).
    reference_area : float
        m2.
    about : mapping, optional
        Values of ``COLUMNS`` to linearise about; those left out are as on the flight without wind.

    Returns
    -------
    (4, 5) array
        Of ``ROWS`` by ``COLUMNS``.
    """
    names = tuple(tables)
    symbols, variables = TableSymbols(names), ca.SX.sym("variables", len(COLUMNS))
    forward, lateral, attitude, engine_angle, wind = ca.vertsplit(variables)
    motion = planar_motion(symbols, ca.SX(reference_area), ca.SX(0), forward, lateral, attitude, engine_angle, wind)
    rows = ca.vertcat(*(getattr(motion, row) for row in ROWS))
    jacobian = ca.Function("rows", [variables, symbols.vector], [ca.jacobian(rows, variables)])
    point = dict.fromkeys(COLUMNS, 0.0) | {"forward_speed": tables["relative_velocity"]} | dict(about or {})
    return jacobian([point[c] for c in COLUMNS], [tables[n] for n in names]).full()
