"""A system whose every matrix switches, at times that are parameters, and its closed form."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np

from ascentwind.model import LinearSystem, define_system


def pieces(p: dict[str, float], time: float) -> tuple[float, float]:
    """Variance and mean of x' = a_k x + b_k n + e_k between the switches t1 and t2, y = x before t3 and 2 x after."""
    edges = np.clip([0.0, *sorted((p["t1"], p["t2"])), np.inf], 0.0, time)
    variance = mean = 0.0
    for a, b in pairwise(edges):
        middle = 0.5 * (a + b)
        first, second = middle < p["t1"], middle < p["t2"]
        rate = p["a1"] if first else p["a2"]
        noise, known = (p["b1"] if second else p["b2"]), (p["e1"] if first else p["e2"])
        grown = np.exp(rate * (b - a))
        variance = variance * grown**2 + noise**2 * (grown**2 - 1) / (2 * rate)
        mean = mean * grown + known * (grown - 1) / rate
    output = 1.0 if time <= p["t3"] else 2.0
    return variance * output**2, mean * output


NOMINAL = {"t1": 1.0, "t2": 2.0, "t3": 1.5, "a1": -1.0, "a2": -0.3, "b1": 2.0, "b2": 0.5, "e1": 1.0, "e2": -2.0}


def switched_system() -> LinearSystem:
    """Return the system of ``pieces``, nothing declared."""
    t, x, n, u = (ca.SX.sym(s) for s in ("t", "x", "n", "u"))
    p = {name: ca.SX.sym(name) for name in NOMINAL}
    rate = ca.if_else(t < p["t1"], p["a1"], p["a2"])
    noise = ca.pw_const(t, p["t2"], ca.vertcat(p["b1"], p["b2"]))
    known = p["e1"] + ca.heaviside(t - p["t1"]) * (p["e2"] - p["e1"])
    return define_system(
        "switched",
        time=t,
        states={"x": (x, rate * x + noise * n + u)},
        noises={"n": n},
        outputs={"y": ca.if_else(t <= p["t3"], 1, 2) * x},
        inputs={"u": (u, known)},
        parameters={name: (p[name], value) for name, value in NOMINAL.items()},
    )
