"""The covariance at the start as functions of the parameters."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca

from ...model.system.linear_system import LinearSystem


@lru_cache(maxsize=32)
def start_functions(system: LinearSystem, sources: tuple[str, ...]) -> tuple[ca.Function, ca.Function]:
    """Return P0 a and the gradient of a' P0 a with respect to the parameters, both functions of (p, a)."""
    n = len(system.states)
    a, P = ca.SX.sym("a", n), ca.SX(n, n)
    for source in sources:
        given = system.start_covariance.get(source)
        if given is not None:
            P += ca.reshape(ca.SX(given), n, n)
    product, form = P @ a, ca.bilin(ca.densify(P), a, a)
    return (
        ca.Function("start_product", [system.p, a], [ca.densify(product)]),
        ca.Function("start_gradient", [system.p, a], [ca.densify(ca.gradient(form, system.p))]),
    )
