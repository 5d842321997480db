"""Processes whose largest value has a known law, and that law by roads of its own."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags, identity
from scipy.sparse.linalg import splu
from scipy.stats import norm

from ascentwind.model import define_system
from ascentwind.runners import Study


def brownian(end: float = 1.0) -> Study:
    """x' = n from rest: P(max over [0, T] > u) = 2 (1 - Phi(u / sqrt T)) by reflection."""
    x, n = ca.SX.sym("x"), ca.SX.sym("n")
    return Study.from_system(
        define_system("brownian", time=ca.SX.sym("t"), states={"x": (x, n)}, noises={"n": n}, outputs={"x": x}, end=end)
    )


def ornstein_uhlenbeck(end: float = 4.0, scale: float = 1.0, mean: float = 0.0) -> Study:
    """x' = -x + sqrt(2) n, stationary with a standard deviation of one; y = scale (x + mean)."""
    x, n, u = (ca.SX.sym(s) for s in ("x", "n", "u"))
    return Study.from_system(
        define_system(
            "stationary",
            time=ca.SX.sym("t"),
            states={"x": (x, -x + np.sqrt(2) * n)},
            noises={"n": n},
            inputs={"u": (u, mean)},
            outputs={"y": scale * (x + u)},
            start_covariance={"n": np.eye(1)},
            end=end,
        )
    )


def constants(spreads: Mapping[str, float], mean: float = 0.0, end: float = 10.0) -> Study:
    """Constants of a flight, random from flight to flight, with given standard deviations; y is their sum."""
    states = {name: ca.SX.sym(name) for name in spreads}
    noises = {f"n_{name}": ca.SX.sym(f"n_{name}") for name in spreads}
    u = ca.SX.sym("u")
    start = {}
    for k, (name, spread) in enumerate(spreads.items()):
        start[f"n_{name}"] = np.zeros((len(spreads), len(spreads)))
        start[f"n_{name}"][k, k] = spread**2
    return Study.from_system(
        define_system(
            "constants",
            time=ca.SX.sym("t"),
            states={name: (x, 0 * noises[f"n_{name}"]) for name, x in states.items()},
            noises=noises,
            inputs={"u": (u, mean)},
            outputs={"y": ca.sum1(ca.vertcat(*states.values())) + u},
            start_covariance=start,
            end=end,
        )
    )


def integrated(end: float = 1.0) -> Study:
    """z' = w, w' = n from rest: differentiable."""
    z, w, n = (ca.SX.sym(s) for s in ("z", "w", "n"))
    return Study.from_system(
        define_system(
            "integrated",
            time=ca.SX.sym("t"),
            states={"z": (z, w), "w": (w, n)},
            noises={"n": n},
            outputs={"z": z, "w": w},
            end=end,
        )
    )


def passing_of_ornstein_uhlenbeck(
    lower: float, upper: float, end: float, points: int = 4000, steps: int = 2000
) -> float:
    """Probability that a stationary x' = -x + sqrt(2) n leaves (lower, upper) within ``end`` seconds.

    The chance f(t, x) to have stayed, from x, follows f_t = f'' - x f', f = 0 at both ends: central differences in x,
    Crank-Nicolson in t after four short implicit steps that smooth the jump at the start.
    """
    lower, upper = max(lower, -9.0), min(upper, 9.0)
    h = (upper - lower) / points
    x = lower + h * np.arange(1, points)
    generator = diags(
        [(1 / h**2 + x / (2 * h))[1:], np.full(x.size, -2 / h**2), (1 / h**2 - x / (2 * h))[:-1]],
        [-1, 0, 1],  # pyright: ignore[reportArgumentType]  # its stub knows one offset
    ).tocsc()
    one, dt = identity(x.size, format="csc"), end / steps
    stays = np.ones(x.size)
    implicit = splu((one - dt / 4 * generator).tocsc())
    for _ in range(4):
        stays = implicit.solve(stays)
    implicit = splu((one - dt / 2 * generator).tocsc())
    for _ in range(steps - 1):
        stays = implicit.solve(stays + dt / 2 * (generator @ stays))
    return float(1 - h * norm.pdf(x) @ stays)


def largest_of_integrated(end: float, runs: int, seed: int, points: int = 400) -> NDArray[np.float64]:
    """Return the largest z of plain flights of z' = w, w' = n from rest, (runs,), by exact steps."""
    random, h = np.random.default_rng(seed), end / points
    z, w, largest = np.zeros(runs), np.zeros(runs), np.zeros(runs)
    root = np.linalg.cholesky(np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]]))
    for _ in range(points):
        dz, dw = root @ random.standard_normal((2, runs))
        z += h * w + dz
        w += dw
        np.maximum(largest, z, out=largest)
    return largest
