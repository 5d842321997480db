"""Typical sizes of states and outputs: they only weigh the integrators' errors against each other."""

from __future__ import annotations

SCALES = {
    "lateral_velocity": 10.0,
    "lateral_position": 100.0,
    "angle": 0.02,
    "bending": 0.1,
    "bending_rate": 0.5,
    "slosh": 0.5,
    "slosh_rate": 1.0,
    "q_alpha": 1e3,
    "bending_acceleration": 3.0,
    "slosh_acceleration": 3.0,
    "relative_deviation": 0.01,
    "offset": 0.01,
}
