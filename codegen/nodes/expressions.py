"""Which expressions the functions at many points compute, as CasADi graphs."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ...model.system.linear_system import LinearSystem

MATRICES = ("A", "B", "C", "E", "G", "inputs")


@dataclass(frozen=True, eq=False)
class NodeExpressions:
    """The functions of a system that are evaluated at points, and what they have from its parameters.

    Attributes
    ----------
    numbers : Function
        p -> z.
    numbers_reverse : Function
        (p, seed of z) -> gradient with respect to p.
    matrices : Function
        (t, v, z) -> nonzeros of A, B, C, E, G and the known inputs.
    quadratic : Function
        (t, v, z, a, y, c, m) -> gradient of the quadratic form with respect to z and v.
    linear : Function
        (t, v, z, a, x, c) -> gradient of the linear form.
    patterns : tuple of Sparsity
        Of A, B, C, E, G and the known inputs.
    """

    numbers: ca.Function
    numbers_reverse: ca.Function
    matrices: ca.Function
    quadratic: ca.Function
    linear: ca.Function
    patterns: tuple[ca.Sparsity, ...]

    @property
    def at_points(self) -> tuple[ca.Function, ca.Function, ca.Function]:
        return self.matrices, self.quadratic, self.linear


def node_expressions(system: LinearSystem) -> NodeExpressions:
    """Derive the functions of a system."""
    n, r = len(system.states), len(system.outputs)
    a, y, c, m = (ca.SX.sym(s, k) for s, k in (("a", n), ("y", n), ("c", r), ("m", len(system.noises))))
    derivative, output, inputs, numbers, symbols = _with_numbers(system)
    signals = ca.vertcat(system.x, system.w, system.u)
    silent = ca.SX.zeros(system.w.numel())

    def at(expression: ca.SX, state: ca.SX, known: ca.SX) -> ca.SX:
        return ca.substitute(expression, signals, ca.vertcat(state, silent, known))

    still = ca.SX.zeros(system.u.numel())
    white = ca.jtimes(derivative, system.w, a, True) if system.w.numel() else ca.SX(0, 1)
    quadratic = 2 * ca.dot(a, at(derivative, y, still)) + ca.dot(m, white**2) + 2 * ca.dot(c, at(output, y, still))
    linear = ca.dot(a, at(derivative, y, inputs)) + ca.dot(c, at(output, y, inputs))
    blocks = [(derivative, system.x), (derivative, system.w), (output, system.x)]
    blocks += [(derivative, system.u), (output, system.u)]
    found = [*(ca.jacobian(*block) for block in blocks), ca.sparsify(inputs)]
    first, seed = [system.time, system.v, symbols], ca.SX.sym("seed", symbols.numel())
    to = ca.vertcat(symbols, system.v)
    nonzeros = ca.vertcat(ca.SX(0, 1), *(ca.vec(matrix.nz[:]) for matrix in found))
    return NodeExpressions(
        ca.Function("numbers", [system.p], [ca.densify(numbers)]),
        ca.Function("numbers_reverse", [system.p, seed], [ca.densify(ca.jtimes(numbers, system.p, seed, True))]),
        ca.Function("node_matrices", first, [ca.cse(ca.densify(nonzeros))]),
        ca.Function("quadratic_gradient", [*first, a, y, c, m], [ca.cse(ca.densify(ca.gradient(quadratic, to)))]),
        ca.Function("linear_gradient", [*first, a, y, c], [ca.cse(ca.densify(ca.gradient(linear, to)))]),
        tuple(matrix.sparsity() for matrix in found),
    )


def _with_numbers(system: LinearSystem) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return x', y and the known inputs in terms of numbers, these as expressions of p, and their symbols."""
    given = [system.derivative, system.output, system.input_values]
    expressions, symbols, hoisted = ca.extract_parametric(given, system.p)
    free = {symbol.__hash__() for symbol in ca.symvar(ca.veccat(*expressions))}
    bare = [system.p[i] for i in range(system.p.numel()) if system.p[i].__hash__() in free]
    renamed = [ca.SX.sym(p.name()) for p in bare]
    derivative, output, inputs = ca.substitute(
        [ca.SX(e) for e in expressions], [ca.vertcat(ca.SX(0, 1), *bare)], [ca.vertcat(ca.SX(0, 1), *renamed)]
    )
    numbers = ca.vertcat(ca.SX(0, 1), *bare, *hoisted)
    return derivative, output, inputs, numbers, ca.vertcat(ca.SX(0, 1), *renamed, *symbols)
