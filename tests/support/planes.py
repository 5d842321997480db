"""AS-504 in both planes: winds whose components are independent, and the studies of each plane alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import built_in_vehicles
from ascentwind.model.vehicle.vehicle import Vehicle
from ascentwind.model.wind.statistics import WindModel
from ascentwind.model.wind.two_components import TwoComponentFilter, TwoComponentWind

HORIZONTAL = {"wind.pitch_wind": "horizontal"}
EACH = {"noise.thrust.planes": "each", "noise.center_of_pressure.planes": "each"}


def in_both(changes: Mapping[str, Any] | None = None, independent: bool = False) -> Vehicle:
    """Return AS-504 in both planes; ``independent`` takes the correlation of u and v away."""
    vehicle = load_vehicle(built_in_vehicles()["as504"], {"planes": "both", **(changes or {})})
    if not independent:
        return vehicle
    assert isinstance(vehicle.wind, TwoComponentWind)
    f = vehicle.wind.filters
    none = replace(f.noise_correlation, values=np.zeros_like(f.noise_correlation.values))
    filters = TwoComponentFilter(f.zonal, f.meridional, none, 0.0)
    return replace(vehicle, wind=replace(vehicle.wind, filters=filters))


def in_one(plane: str, component: str, changes: Mapping[str, Any] | None = None) -> Vehicle:
    """Return AS-504 in one plane with the whole of one component in it."""
    wind = in_both().wind
    assert isinstance(wind, TwoComponentWind)
    part = wind.components[component]
    vehicle = load_vehicle(built_in_vehicles()["as504"], {"planes": plane, **(changes or {})})
    return replace(vehicle, wind=WindModel(replace(part.mean, name="wind.mean"), part.shaping_filter))
