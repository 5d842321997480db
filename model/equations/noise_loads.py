"""What a deviation puts into the bending moment itself (docs/equations.md, section 4)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import casadi as ca

from ..system.symbols import TableSymbols
from ..vehicle.biases import CENTER_OF_GRAVITY_OFFSET, THRUST_MISALIGNMENT
from ..vehicle.columns import MOVED_LINE, MOVED_MODE, OFFSET_MASS, SECOND_MOMENT
from ..vehicle.noise_loads import CENTER_OF_PRESSURE, COEFFICIENTS
from ..vehicle.vehicle_file import NoiseLoads
from .bending import mode_column


def moved_modal_force(tables: TableSymbols, reference_area: ca.SX, modes: int, alpha: ca.SX) -> ca.SX:
    """Return what each metre that the normal force moves forward adds to 4-10, N/m, shape (modes,)."""
    return tables["dynamic_pressure"] * reference_area * mode_column(tables, modes, MOVED_MODE.name) * alpha


def noise_load(
    tables: Iterable[str],
    form: NoiseLoads,
    coefficients: Mapping[str, Any],
    flight: Any,
    reference_area: Any,
    alpha: Any,
    beta: Any,
) -> Any:
    """Return the moment (N m) for a deviation of 1 of all these, by symbols or by numbers.

    Parameters
    ----------
    tables : iterable of str
        As ``loading_deviations`` gives them.
    form : str
    coefficients : mapping
        Columns of the load's table.
    flight : mapping
        Tables of the flight, by name.
    reference_area, alpha, beta
        m2, and the mean angles (rad).
    """
    angles, moment = {"angle_of_attack": alpha, "engine_angle": beta}, 0.0
    for table in tables:
        if table in COEFFICIENTS:
            coefficient = COEFFICIENTS[table]
            moment = moment + coefficients[coefficient] * angles[coefficient]
        elif table == THRUST_MISALIGNMENT:
            moment = moment + coefficients["engine_angle"]
        elif table == CENTER_OF_GRAVITY_OFFSET:
            moment = moment + coefficients[OFFSET_MASS.name] * flight["axial_acceleration"]
        else:
            metre = _load_of_a_metre(form, coefficients, flight, reference_area)
            moment = moment + metre * flight[CENTER_OF_PRESSURE] * alpha
    return moment


def _load_of_a_metre(form: NoiseLoads, coefficients: Mapping[str, Any], flight: Any, reference_area: Any) -> Any:
    if form == "moved_line":
        return coefficients[MOVED_LINE.name]
    forward = 1.0 if form == "couple_forward" else 0.0
    couple = flight["dynamic_pressure"] * reference_area * flight["normal_force_slope"]
    return couple * (forward - coefficients[SECOND_MOMENT.name] / flight["moment_of_inertia"])
