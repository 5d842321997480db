"""A first-order lag with a closed form, as a small study to vary."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ascentwind.model import define_system
from ascentwind.runners import Study

TAU, GAIN, INPUT = 2.0, 3.0, 1.5


def lag(compile: bool = True) -> Study:
    """x' = -x/tau + gain (n + u): variance gain^2 tau/2 (1 - exp(-2t/tau)), mean gain u tau (1 - exp(-t/tau))."""
    x, n, u, tau, gain, level = (ca.SX.sym(s) for s in ("x", "n", "u", "tau", "gain", "level"))
    return Study.from_system(
        define_system(
            "lag",
            time=ca.SX.sym("t"),
            states={"x": (x, -x / tau + gain * (n + u))},
            noises={"gust": n},
            outputs={"x": x},
            inputs={"u": (u, level)},
            parameters={"tau": (tau, TAU), "gain": (gain, GAIN), "level": (level, INPUT)},
            end=50.0,
        ),
        compile=compile,
    )


def closed_form(time: float | np.ndarray, tau=TAU, gain=GAIN, level=INPUT) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and standard deviation."""
    variance = np.square(gain) * tau / 2 * (1 - np.exp(-2 * time / tau))
    return gain * level * tau * (1 - np.exp(-time / tau)), np.sqrt(variance)


def plan(**part) -> dict:
    """Return a plan for the lag."""
    return {"format": 1, "title": "a lag", "times": "1,3", "relative_tolerance": 1e-8} | part


def dispersion(members: int, *quantities: dict, seed: int = 1, **more) -> dict:
    """Return a plan of a dispersion of the lag."""
    return plan(dispersion={"members": members, "seed": seed, "quantity": list(quantities), **more})


def normal(name: str, sigma: float, **more) -> dict:
    """Return a normal quantity."""
    return {"name": name, "distribution": "normal", "sigma": sigma} | more
