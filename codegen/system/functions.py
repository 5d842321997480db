"""The CasADi functions of a linear system: matrices, backward adjoint and forward mean.

The arithmetic stands in core functions of flight time t, table values v, parameters p and a state: scalar (SX)
expressions, the same for the interpreter and for C. Around them stands the table lookup. The interpreter gets it
as CasADi splines with constant coefficients; C gets it from a template that reads coefficients at run time.

Adjoint and mean have the signature of a CasADi integrator, f(t, x, z, p, u) -> (ode, alg, quad, zero), over a
pseudo-time s from 0 to 1, so that one integrator serves every interval. Their parameter vector is

    [origin, span, low, high, parameters, address of the tables]

with flight time = origin - span s for the adjoint and origin + span s for the mean, kept within [low, high], the
interval between two discontinuities, so that no step sees the value beyond a jump.
The tables go by address because CasADi copies an integrator's parameters at every call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ...model.system.linear_system import LinearSystem
from ...model.tables import ORDER, TableGroup

INTERVAL = 4  # origin, span, low, high
INPUTS = ("t", "x", "z", "p", "u")
OUTPUTS = ("ode", "alg", "quad", "zero")
MATRICES = ("A", "B", "C", "D", "E", "G", "inputs")


@dataclass(frozen=True, eq=False)
class SystemFunctions:
    """Functions of a system, interpreted or compiled alike.

    Attributes
    ----------
    matrices : Function
        (t, low, high, parameters, address) -> A, B, C, D, E, G and the known inputs, sparse.
    adjoint : Function
        State: scaled adjoints, one column a response. Quadratures: for each response one integral of |B_s' lambda|^2
        a source, then the convolution with the known inputs; in units of the response's scale (squared).
    mean : Function
        State: scaled states, driven by the known inputs alone.
    response : Function
        (t, low, high, parameters, address, x) -> C x + G u, x not scaled.
    """

    matrices: ca.Function
    adjoint: ca.Function
    mean: ca.Function
    response: ca.Function


@dataclass(frozen=True, eq=False)
class CoreFunctions:
    """The arithmetic of a system, without table lookup.

    Attributes
    ----------
    state_matrix : Function
        (t, v, p) -> A, sparse.
    other_matrices : Function
        (t, v, p) -> B, C, D, E, G and the known inputs, sparse.
    adjoint, mean : Function
        (t, v, p, x) -> derivative of x with flight time.
    adjoint_quadrature : Function
        (t, v, p, x) -> integrands of the quadratures, per second of flight.
    response : Function
        (t, v, p, x) -> outputs without noise.
    covariance_inputs : Function
        (t, v, p) -> B, sparse, and E u, dense: what drives the covariance equation and the mean beside it.
    """

    state_matrix: ca.Function
    other_matrices: ca.Function
    adjoint: ca.Function
    adjoint_quadrature: ca.Function
    mean: ca.Function
    response: ca.Function
    covariance_inputs: ca.Function


def core_functions(system: LinearSystem) -> CoreFunctions:
    """Derive the core functions; the adjoint is CasADi's transposed Jacobian product, never typed."""
    at = [system.time, system.v, system.p]
    others = [system.B, system.C, system.D, system.E, system.G, ca.sparsify(system.input_values)]
    adjoint, rate, quadrature = _adjoint(system)
    state, mean_rate = _mean(system)
    return CoreFunctions(
        state_matrix=ca.Function("state_matrix_core", at, [system.A]),
        other_matrices=ca.Function("other_matrices_core", at, others),
        adjoint=ca.Function("adjoint_core", [*at, adjoint], [rate]),
        adjoint_quadrature=ca.Function("adjoint_quadrature_core", [*at, adjoint], [quadrature]),
        mean=ca.Function("mean_core", [*at, state], [mean_rate]),
        response=ca.Function("response_core", [*at, system.x], [ca.densify(_without_noise(system, system.output))]),
        covariance_inputs=ca.Function("covariance_inputs_core", at, [system.B, ca.densify(known_rate(system))]),
    )


def known_rate(system: LinearSystem) -> ca.SX:
    """Return E u, (n, 1): what known inputs do to the states."""
    return system.E @ system.input_values if system.u.numel() else ca.SX.zeros(len(system.states))


def direct_response(system: LinearSystem) -> ca.SX:
    """Return G u, (n_y, 1), dense: what known inputs do to the responses at once."""
    return ca.densify(system.G @ system.input_values) if system.u.numel() else ca.SX.zeros(len(system.outputs))


def state_scales(system: LinearSystem) -> np.ndarray:
    """Return the typical sizes of the states, shape (n,)."""
    return np.array([s.scale for s in system.states])


def declared_sizes(system: LinearSystem) -> np.ndarray:
    """Return the typical sizes of states, then responses, shape (n + n_y,)."""
    return np.concatenate([state_scales(system), [output.scale for output in system.outputs]])


def _adjoint(system: LinearSystem) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return scaled adjoints (a column a response, stacked), their rate and the quadrature integrands."""
    n, r = len(system.states), len(system.outputs)
    scaled = ca.SX.sym("adjoint", n, r)
    adjoint = ca.diag(1 / state_scales(system)) @ scaled
    rate = ca.diag(state_scales(system)) @ system.adjoint_derivative(adjoint)
    white = ca.jtimes(system.derivative, system.w, adjoint, True)
    known = ca.jtimes(system.derivative, system.u, adjoint, True)
    quadratures = [
        ca.vertcat(
            *(ca.sumsqr(white[system.noise_columns(source), i]) for source in system.sources),
            ca.dot(known[:, i], system.input_values) if system.u.numel() else ca.SX(0),
        )
        for i in range(r)
    ]
    return ca.vec(scaled), ca.densify(ca.vec(rate)), ca.densify(ca.vertcat(*quadratures))


def _mean(system: LinearSystem) -> tuple[ca.SX, ca.SX]:
    """Return scaled states and their rate under the known inputs alone."""
    scaled, scale = ca.SX.sym("state", len(system.states)), state_scales(system)
    rate = ca.substitute(_without_noise(system, system.derivative), system.x, ca.diag(scale) @ scaled)
    return scaled, ca.densify(ca.diag(1 / scale) @ rate)


def _without_noise(system: LinearSystem, expression: ca.SX) -> ca.SX:
    signals = ca.vertcat(ca.SX.zeros(system.w.numel()), system.input_values)
    return ca.substitute(expression, ca.vertcat(system.w, system.u), signals)


def interpreted_functions(system: LinearSystem, core: CoreFunctions, groups: Sequence[TableGroup]) -> SystemFunctions:
    """Return the functions for CasADi's interpreter, with the numbers of ``groups`` built in."""
    t, low, high, address = (ca.MX.sym(n) for n in ("t", "low", "high", "address"))
    p = ca.MX.sym("p", system.p.numel())
    time = ca.fmin(ca.fmax(t, low), high)
    values = spline_lookup(groups, time)
    matrices = ca.Function(
        "matrices",
        [t, low, high, p, address],
        core.state_matrix.call([time, values, p]) + core.other_matrices.call([time, values, p]),
        ["t", "low", "high", "p", "address"],
        list(MATRICES),
    )
    adjoint = _integrand("adjoint", system.p.numel(), groups, core.adjoint, core.adjoint_quadrature, -1.0)
    mean = _integrand("mean", system.p.numel(), groups, core.mean, None, 1.0)
    x = ca.MX.sym("x", len(system.states))
    response = ca.Function(
        "response",
        [t, low, high, p, address, x],
        [core.response(time, values, p, x)],
        ["t", "low", "high", "p", "address", "x"],
        ["y"],
    )
    return SystemFunctions(matrices, adjoint, mean, response)


def _integrand(
    name: str,
    parameters: int,
    groups: Sequence[TableGroup],
    core: ca.Function,
    quadrature: ca.Function | None,
    sign: float,
) -> ca.Function:
    s, x = ca.MX.sym("t"), ca.MX.sym("x", core.size1_in(3))
    p, z, u = ca.MX.sym("p", INTERVAL + parameters + 1), ca.MX.sym("z", 0), ca.MX.sym("u", 0)
    time = ca.fmin(ca.fmax(p[0] + sign * p[1] * s, p[2]), p[3])
    values = spline_lookup(groups, time)
    arguments = [time, values, p[INTERVAL : INTERVAL + parameters], x]
    integrand = p[1] * quadrature(*arguments) if quadrature else ca.MX(0, 1)
    rate = ca.densify(sign * p[1] * core(*arguments))  # sparse where no state moves another
    outputs = [rate, ca.MX(0, 1), integrand, ca.MX(0, 1)]
    return ca.Function(name, [s, x, z, p, u], outputs, list(INPUTS), list(OUTPUTS))


def spline_lookup(groups: Sequence[TableGroup], time: ca.MX) -> ca.MX:
    """Return all table values at a time as CasADi splines with constant coefficients.

    Every knot is fourfold, so that a spline is an independent cubic on each interval, in Bernstein form.
    """
    found: dict[str, ca.MX] = {}
    values = [ca.MX(0, 1)]
    for group in groups:
        argument = time if group.argument == "time" else found[group.argument]
        # the last knot itself belongs to no interval of a spline whose end is open
        last = np.nextafter(group.knots[-1], -np.inf)
        inside = ca.fmin(ca.fmax(argument, group.knots[0]), last)
        c0, c1, c2, c3 = np.moveaxis(group.coefficients, 1, 0)
        h = np.diff(group.knots)[:, None]
        bernstein = np.stack(
            [c0, c0 + c1 * h / 3, c0 + 2 * c1 * h / 3 + c2 * h**2 / 3, c0 + h * (c1 + h * (c2 + h * c3))], axis=1
        )
        knots = np.repeat(group.knots, ORDER)
        value = ca.bspline(inside, ca.DM(bernstein.ravel()), [knots.tolist()], [ORDER - 1], len(group.names))
        found.update({name: value[i] for i, name in enumerate(group.names) if _is_argument(name, groups)})
        values.append(value)
    return ca.vertcat(*values)


def _is_argument(name: str, groups: Sequence[TableGroup]) -> bool:
    return any(group.argument == name for group in groups)
