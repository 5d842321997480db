"""What a vehicle rests on, for people: tables with their origin, the wind, noises; goes into JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from .case import Case

if TYPE_CHECKING:
    from ...model.vehicle.vehicle import Vehicle

LEVELS = 120  # of the wind, at most


def description(case: Case) -> dict[str, Any]:
    """Return the title, tables by file, wind, noises and options of a vehicle; the name alone of another system."""
    vehicle = case.vehicle
    if vehicle is None:
        return {"title": case.system.name}
    noises = [
        {"name": name, "sigma": noise.sigma, "of": ", ".join(noise.tables), "source": noise.source}
        | ({"correlation_time_s": noise.correlation_time_s} if not noise.white else {"white": True})
        for name, noise in vehicle.noise.items()
    ]
    tables = [
        {"file": s.file.name, "status": s.status, "source": s.source, "first": s.first, "last": s.last}
        for s in vehicle.sources
    ]
    options = vehicle.file.options.model_dump(mode="json", exclude_defaults=True)
    return {
        "title": vehicle.title,
        "flight_s": [vehicle.start, vehicle.end],
        "tables": tables,
        "wind": _wind(vehicle),
        "noises": noises,
        "options": {name: str(value) for name, value in options.items()},
    }


def _wind(vehicle: Vehicle) -> dict[str, Any]:
    wind, record, turbulence = vehicle.wind, vehicle.wind.record, vehicle.turbulence
    found: dict[str, Any] = {"filter": wind.shaping_filter.name}
    if record is not None:
        found["statistics"] = str(record.origin)
        found["azimuth_deg"] = math.degrees(record.azimuth)
        found["held_above_m"] = record.held_above
        found["source"] = record.source
        if record.independent_samples is not None:
            found["independent_samples"] = record.independent_samples
    if turbulence is not None:
        found["turbulence"] = f"{turbulence.form}, scale {turbulence.length:g} m"
    found["components"] = {}
    for name, model in getattr(wind, "components", {"wind": wind}).items():
        altitude = model.mean.argument
        if altitude.size > LEVELS:
            altitude = np.linspace(altitude[0], altitude[-1], LEVELS)
        columns = {"altitude_m": altitude, "mean_m_s": model.mean.polynomial(altitude)}
        if (spread := model.standard_deviation) is not None:
            held = np.clip(altitude, spread.argument[0], spread.argument[-1])
            columns["standard_deviation_m_s"] = spread.polynomial(held)
        found["components"][name] = {key: [float(f"{x:.6g}") for x in values] for key, values in columns.items()}
    return found
