"""A response of wind and of one other noise, stationary after the first seconds, as a small study."""

from __future__ import annotations

import casadi as ca

from ascentwind.model import define_system
from ascentwind.runners import Study

TAU, MEAN = 0.5, 4.0


def two_noises(wind: float, other: float, mean: float = MEAN, name: str = "wind") -> Study:
    """y = mean + x1 + x2, xi' = -xi/tau + g ni: sigmas ``wind`` and ``other``, g^2 tau/2 = sigma^2."""
    t, x, z, n, m, u, g, k, level = (ca.SX.sym(s) for s in ("t", "x", "z", "n", "m", "u", "g", "k", "level"))
    root = (2.0 / TAU) ** 0.5
    return Study.from_system(
        define_system(
            "two_noises",
            time=t,
            states={"x": (x, -x / TAU + g * root * n), "z": (z, -z / TAU + k * root * m)},
            noises={name: n, "engine": m},
            outputs={"y": (x + z + u)},
            inputs={"u": (u, level)},
            parameters={"g": (g, wind), "k": (k, other), "level": (level, mean)},
            end=40.0,
        )
    )
