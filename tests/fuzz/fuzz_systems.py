"""Systems of a user's own with one thing wrong, or odd, in them."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

import casadi as ca
import numpy as np
from fuzz_mutations import Mutation

from ascentwind.model import LinearSystem, define_system

FACTORS = (1e15, 1e8, 1e3, 1e-3, 1e-8, 1e-15)


def mutated_system(kind: str, random: Random) -> tuple[Mutation, Callable[[], LinearSystem]]:
    """Return what was done and a function that defines the system: two coupled states, two noises, a known input."""
    t, a, b, n, m, u, k, s = (ca.SX.sym(name) for name in ("t", "a", "b", "n", "m", "u", "k", "s"))
    given: dict[str, Any] = {
        "name": "pair",
        "time": t,
        "states": {"a": (a, -k * a + b + n), "b": (b, -2 * b + s * m + u)},
        "noises": {"n": n, "m": m},
        "outputs": {"a": a, "sum": a + 3 * b},
        "parameters": {"k": (k, 0.5), "s": (s, 2.0)},
        "inputs": {"u": (u, ca.sin(t))},
        "sources": {"n": "wind", "m": "thrust"},
        "units": {"a": "m", "k": "1/s"},
        "scales": {"a": 0.5},
        "start_covariance": {"wind": np.diag([0.3, 0.0])},
        "start": 1.0,
        "end": 9.0,
        "discontinuities": [2.0, 3.0],
    }
    key = random.choice(sorted(given))
    odd = (
        None, True, -1.0, 0.0, float("nan"), float("inf"), 10**400, "", "x", "\0", "*/", [], {}, [1.0], [[1.0]], (1, 2),
        ca.MX.sym("q"), ca.SX.sym("q"), ca.SX.sym("q", 2), 2 * a, a * b, ca.DM([1.0, 2.0]), np.zeros((2, 2)), np.eye(3),
        -np.eye(2), object(), 1 + 2j, {"a": 1.0}, {1: 2}, {"": 1.0}, range(3), b"n", t, lambda: 1,
    )  # fmt: skip
    place, what = key, ""
    value = given[key]
    inner = random.choice(list(value)) if isinstance(value, dict) else None
    if kind == "type":
        new = random.choice(odd)
        if inner is None or random.random() < 0.3:
            given[key] = new
        elif isinstance(value[inner], tuple) and random.random() < 0.7:
            pair = list(value[inner])
            pair[random.randrange(2)] = new
            value[inner] = tuple(pair)
        else:
            value[inner] = new
        what = f"is {type(new).__name__} {str(new)[:30]!r}"
    elif kind in ("unit", "sign"):
        factor = -1.0 if kind == "sign" else random.choice(FACTORS)
        place = random.choice(("noise", "input", "output", "k", "s", "scale", "start covariance"))
        if place in ("noise", "input"):
            symbol = n if place == "noise" else u
            given["states"] = {
                name: (x, ca.substitute(d, symbol, factor * symbol)) for name, (x, d) in given["states"].items()
            }
        elif place == "output":
            given["outputs"]["a"] = factor * a
        elif place in ("k", "s"):
            symbol, number = given["parameters"][place]
            given["parameters"][place] = (symbol, factor * number)
        elif place == "scale":
            given["scales"]["a"] *= factor
        else:
            given["start_covariance"]["wind"] = factor * given["start_covariance"]["wind"]
        what = f"times {factor:g}"
    elif kind == "missing":
        if inner is not None:
            del value[inner]
            place = f"{key}.{inner}"
        elif key in ("name", "time", "states", "noises", "outputs"):
            given[key] = {} if isinstance(value, dict) else None
        else:
            del given[key]
        what = "missing"
    elif kind == "duplicate":
        key = random.choice(("states", "noises", "parameters", "inputs", "outputs"))
        first = next(iter(given[key]))
        given[key]["again"] = given[key][first]
        place, what = key, f"{first} twice"
    elif kind == "swap" and inner is not None:
        other = random.choice(list(value))
        value[inner], value[other] = value[other], value[inner]
        what = f"{inner} and {other} swapped"
    elif kind == "text":
        text = random.choice(
            ("", " ", "\n", "\0", "*/ #error", "../x", "combined", "wind", "α", "x" * 5000, "\ud800", "{{ 1 }}")
        )
        if inner is None:
            given["name"] = text
        else:
            given[key] = {text if name == inner else name: entry for name, entry in value.items()}
        what = f"{inner or 'name'} called {text[:20]!r}"
    elif kind == "shift":
        given["start"], given["end"] = random.choice(
            ((9.0, 1.0), (1.0, 1.0), (1e9, 1e9 + 9), (-5.0, 9.0), (1.0, 1.0 + 1e-12))
        )
        place, what = "start, end", f"{given['start']} to {given['end']}"

    def define() -> LinearSystem:
        name = given.pop("name", "pair")
        return define_system(name, **given)

    return Mutation(kind, "define_system", place, what or "nothing"), define
