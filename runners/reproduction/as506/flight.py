"""The mean flight of AS-506 against its evaluation report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....model.construction import Construction
from ...construct.ascent.mean_flight import EVENT_MARGIN, MeanFlight, fly
from .construction import as506

SOURCE = "AS-506 flight evaluation report MPR-SAT-FE-69-9"


@dataclass(frozen=True)
class FlightCheck:
    """A computed number beside the flown one.

    Attributes
    ----------
    quantity, unit : str
    ours, flight : float
    limit : float or None
        Largest difference allowed; None where the number is only shown.
    source : str
        Table of the report.
    """

    quantity: str
    unit: str
    ours: float
    flight: float
    limit: float | None
    source: str

    @property
    def holds(self) -> bool:
        """Whether the difference is within the limit."""
        return self.limit is None or abs(self.ours - self.flight) <= self.limit


def trajectory_checks(as504: Construction) -> tuple[FlightCheck, ...]:
    """Fly AS-506, built from the shipped construction of AS-504, and compare.

    The mass at cutoff is no prediction: the flow is scaled to meet it.
    """
    flight = fly(as506(as504))
    oeco, ceco, peak = (
        _at(flight, event) for event in ("outboard_engine_cutoff", "center_engine_cutoff", "max_dynamic_pressure")
    )
    tables = {n: f"{SOURCE}, table {n}" for n in ("4-1", "4-2", "20-1")}
    rows = (
        ("Mach 1, time", "s", flight.events["mach_one"], 66.3, None, "4-1"),
        ("maximum dynamic pressure", "kPa", peak["dynamic_pressure"] / 1e3, 35.2, 1.5, "4-1"),
        ("maximum dynamic pressure, time", "s", peak["time"], 83.0, 4.0, "4-1"),
        ("centre-engine cutoff, altitude", "km", ceco["altitude"] / 1e3, 44.0, None, "4-2"),
        ("centre-engine cutoff, space-fixed speed", "m/s", ceco["inertial_speed"], 1979.0, None, "4-2"),
        ("centre-engine cutoff, mass", "t", ceco["mass"] / 1e3, 1110.189, None, "20-1"),
        ("outboard-engine cutoff, altitude", "km", oeco["altitude"] / 1e3, 66.1, 1.0, "4-2"),
        ("outboard-engine cutoff, space-fixed speed", "m/s", oeco["inertial_speed"], 2764.1, 10.0, "4-2"),
        (
            "outboard-engine cutoff, space-fixed flight-path angle",
            "deg",
            np.rad2deg(oeco["inertial_flight_path_angle"]),
            19.114,
            None,
            "4-2",
        ),
        ("outboard-engine cutoff, surface range", "km", oeco["surface_range"] / 1e3, 93.6, None, "4-2"),
        ("outboard-engine cutoff, mass", "t", oeco["mass"] / 1e3, 827.292, None, "20-1"),
    )
    return tuple(FlightCheck(q, u, float(ours), flown, limit, tables[t]) for q, u, ours, flown, limit, t in rows)


def _at(flight: MeanFlight, event: str) -> dict[str, float]:
    """Return the flight's values at an event, of a cutoff just before it."""
    time = flight.events[event]
    before = time - EVENT_MARGIN if event.endswith("cutoff") else time
    names = ("altitude", "inertial_speed", "inertial_flight_path_angle", "surface_range", "mass", "dynamic_pressure")
    return {"time": time} | {n: float(np.interp(before, flight.time, getattr(flight, n))) for n in names}
