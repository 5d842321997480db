"""The bending moment of AS-506 against its evaluation report."""

from __future__ import annotations

import numpy as np

from ....model.construction import Construction
from ...construct.vehicle_numbers import compute_vehicle
from .construction import as506
from .flight import SOURCE, FlightCheck

STATION = 25.0  # m
TIME, ANGLE_OF_ATTACK, ENGINE_ANGLE, PRESSURE = 91.5, 1.7, 0.27, 33.0e3  # s, deg, deg, Pa; section 9.2.2, figure 9-3
FLOWN, LIMIT = 3.75e6, 0.05  # N m; NASA's own sum of measured angles and loads, relative
ROWS = 1.5  # s


def load_checks(as504: Construction) -> tuple[FlightCheck, ...]:
    """Compare the moment at station 25 m with the largest of the flight, at its angles and dynamic pressure.

    Two factors of the normal force are fitted to the same flight's gimbal angle and spacecraft moments (docs/data.md).
    """
    numbers = compute_vehicle(as506(as504), ROWS)
    row = int(np.argmin(np.abs(numbers.flight.time - TIME)))
    x = STATION - numbers.construction.gimbal_station
    station = int(np.argmin(np.abs(numbers.stations - x)))
    found = numbers.loads[row]
    pressure = PRESSURE / numbers.flight.dynamic_pressure[row]
    moment = pressure * found.angle_of_attack[station] * np.deg2rad(ANGLE_OF_ATTACK)
    moment += found.engine_angle[station] * np.deg2rad(ENGINE_ANGLE)
    what = f"bending moment, station {STATION:g} m, at {ANGLE_OF_ATTACK:g}° and gimbal {ENGINE_ANGLE:g}°, {TIME:g} s"
    ours, limit = float(moment) / 1e6, LIMIT * FLOWN / 1e6
    return (FlightCheck(what, "MN m", ours, FLOWN / 1e6, limit, f"{SOURCE}, section 9.2.2"),)
