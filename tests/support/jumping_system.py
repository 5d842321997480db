"""A system that jumps, with two sources, a known input, a white response and odd names."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ascentwind.model import define_system
from ascentwind.model.system.linear_system import LinearSystem

TAU, GAIN, JUMP, END = 2.0, 3.0, 3.0, 8.0


def jumping_system(name: str = "1 läg", end: float = END) -> LinearSystem:
    """x' = -x/tau + gain (n + u), its gain doubled after a jump, shakes an oscillator; one response is white."""
    t, x, y, v, n, m, u, tau = (ca.SX.sym(s) for s in ("t", "x", "y", "v", "n", "m", "u", "tau"))
    gain = ca.if_else(t < JUMP, GAIN, 2 * GAIN)
    return define_system(
        name,
        time=t,
        states={"x": (x, -x / tau + gain * (n + u)), "y": (y, v), "v": (v, -9 * y - 0.6 * v + x + 0.5 * m)},
        noises={"n": n, "m": m},
        sources={"n": "gust", "m": 'bu"mp'},
        outputs={"x": x, "y, in \\ it": 2 * y + u, "white": v + m},
        inputs={"u": (u, 1.5)},
        parameters={"tau": (tau, TAU)},
        units={"x": "m", "tau": "s"},
        start_covariance={"gust": np.diag([0.25, 0.0, 0.0])},
        end=end,
    )
