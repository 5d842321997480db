"""Structure is known from the file's own keys: no number of it can be changed without new code, all others can."""

from __future__ import annotations

from ascentwind.model.vehicle.reader import load_vehicle
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.model.vehicle.structural_keys import structural_keys


def test_structure_of_a_shipped_vehicle():
    keys = structural_keys(load_vehicle(find_vehicle("as504")).file)
    assert {
        "options", "options.full_coupling", "events", "events.center_engine_cutoff", "bending", "bending.count",
        "slosh", "slosh.0.name", "loads.0.output", "noise.thrust.white", "noise.thrust.tables",
        "control.T1.denominator",
        "control.T3.numerator.count", "wind.synthesis",
    } <= keys  # fmt: skip
    numbers = {
        "reference_area_m2", "bending.0.damping", "slosh.0.damping", "noise.thrust.sigma",
        "noise.thrust.correlation_time_s", "control.T1.denominator.0", "start_time_s", "title", "mass",
    }  # fmt: skip
    assert not numbers & keys
