"""Second derivatives of a response's statistics by a few parameters: the adjoint pair, differentiated forward.

Along one parameter the mean, the adjoint, its product with the covariance and the mean's own adjoint have tangents that
obey the same equations with forcing, solved by the same factors; the gradients at the nodes are differentiated by
CasADi. One parameter costs about as much as the gradient, interpreted. Along a parameter that moves a switch of the
equations the exact gradient is differentiated by extrapolated central differences, short of where switches meet.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import casadi as ca
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...codegen.nodes.expressions import MATRICES
from ...codegen.nodes.matrix import NodeMatrix
from ...codegen.sweep.gauss_legendre import STAGES
from ...model.errors import ParameterValueError, SwitchError
from ..case.provenance import provenance
from ..present.progress import each
from ..solvers.stability import warn_if_unstable
from ..solvers.start_functions import start_functions
from .gradient import gradient_of
from .one import refuse_undefined
from .pair import AdjointPair, Combination
from .peak import end_time
from .request import Request, parameter_rows

if TYPE_CHECKING:
    from ..case.case import Case

MOST = 10  # parameters at once
DIFFERENCE = 0.01  # of a parameter that moves a switch, the largest change


def second_derivatives(
    case: Case,
    response: str,
    time: float | Literal["peak"],
    parameters: Iterable[str],
    source: str,
    quantity: str,
) -> xr.Dataset:
    """See :meth:`Study.second_derivatives`."""
    request = Request.of(case, response, source, quantity)
    rows = parameter_rows(case, parameters)
    if not 1 <= len(rows) <= MOST:
        raise ParameterValueError(f"{len(rows)} parameters were asked for; second derivatives are for 1 to {MOST}")
    at, _ = end_time(case, request, time)
    warn_if_unstable(case.executable, at)
    pair = request.pair(case, at)
    factors = request.factors(pair)
    gradient = gradient_of(pair, *factors)
    refuse_undefined(case.system, gradient, rows)
    combined = pair.combine(*factors)
    moving = [k for k, row in enumerate(rows) if row in gradient.reach]
    hessian = np.array([_column(pair, combined, factors, row)[rows] for row in each(rows, "second derivatives")])
    curvature = request.curvature(pair)
    if curvature:
        of_variance = gradient_of(pair, 1.0, 0.0).parameters[rows]
        hessian = hessian + curvature * np.outer(of_variance, of_variance)
    for k in moving:
        hessian[k] = _by_differences(case, request, at, rows, k, gradient.reach[rows[k]])
    for k in moving:
        still = [i for i in range(len(rows)) if i not in moving]
        hessian[still, k] = hessian[k, still]
    names = [case.system.parameter_names[i] for i in rows]
    units = [case.system.parameters[i].unit for i in rows]
    return xr.Dataset(
        {
            "derivative": ("parameter", gradient.parameters[rows]),
            "second_derivative": (("parameter", "with_respect_to"), 0.5 * (hessian + hessian.T)),
            "parameter_value": ("parameter", case.executable.parameters[rows]),
        },
        {"parameter": names, "with_respect_to": names, "parameter_unit": ("parameter", units)},
        provenance(case)
        | {
            "response": response,
            "source": source,
            "quantity": quantity,
            "t2_s": at,
            "value": request.value(pair.variance, pair.mean),
            "by_differences": ", ".join(names[k] for k in moving) or "none",
            "asymmetry": float(np.abs(hessian - hessian.T).max() / max(1e-300, np.abs(hessian).max())),
        },
    )


def _by_differences(
    case: Case, request: Request, time: float, rows: list[int], which: int, reach: float
) -> NDArray[np.float64]:
    """Return the derivative of the exact gradient along a parameter that moves a switch, by central differences."""
    name = case.system.parameter_names[rows[which]]
    if not reach:
        raise SwitchError(
            f"there is no second derivative with respect to '{name}': the switch that it moves lies at the start or on "
            "the end time; name the parameters without it"
        )
    value = float(case.executable.parameters[rows[which]])

    def gradient(at: float) -> NDArray[np.float64]:
        pair = request.pair(case.with_parameters({name: at}), time)
        return gradient_of(pair, *request.factors(pair)).parameters[rows]

    step = min(0.25 * reach, DIFFERENCE * (abs(value) or 1.0))
    slopes = [(gradient(value + h) - gradient(value - h)) / (2 * h) for h in (step, step / 2, step / 4)]
    once = [fine + (fine - coarse) / 3 for coarse, fine in pairwise(slopes)]  # Richardson: h^2, then h^4
    return once[1] + (once[1] - once[0]) / 15


@lru_cache(maxsize=12)
def _tangent(function: ca.Function, count: int) -> ca.Function:
    return function.forward(1).map(count)


def _along(function: ca.Function, arguments: list[NDArray], directions: list[NDArray]) -> NDArray[np.float64]:
    """Return the directional derivative of a function at k points, (k, size); one-dimensional arguments are common."""
    count = arguments[0].shape[0]

    def columns(arrays: list[NDArray]) -> list[NDArray]:
        return [np.tile(x[:, None], count) if x.ndim == 1 else x.T for x in arrays]

    result = np.zeros((function.numel_out(0), count))
    return _tangent(function, count)(*columns(arguments), result, *columns(directions)).full().T


def _once(function: ca.Function, arguments: list[NDArray], directions: list[NDArray]) -> NDArray[np.float64]:
    none = np.zeros(function.numel_out(0))
    return np.array(function.forward(1)(*arguments, none, *directions), float).ravel()


class _Points:
    """Points at which a system is seen: the nodes, or the end."""

    def __init__(self, pair: AdjointPair, times: NDArray, tables: NDArray, matrices: dict[str, NodeMatrix]):
        self.expressions, self.numbers = pair.flight.functions.expressions, pair.flight.numbers
        self.times, self.tables, self.matrices = times[:, None], tables, matrices

    def matrix_tangents(self, numbers: NDArray, tables: NDArray) -> dict[str, NodeMatrix]:
        """Return the directional derivatives of A, B, C, E, G and the known inputs."""
        at = [self.times, self.tables, self.numbers]
        values = _along(self.expressions.matrices, at, [np.zeros_like(self.times), tables, numbers])
        edges = np.cumsum([0, *(pattern.nnz() for pattern in self.expressions.patterns)])
        return {
            name: NodeMatrix(pattern, values[:, a:b])
            for name, pattern, a, b in zip(MATRICES, self.expressions.patterns, edges[:-1], edges[1:], strict=True)
        }

    def mean_tangents(self, tangents: dict[str, NodeMatrix], x: NDArray, dx: NDArray) -> tuple[NDArray, NDArray]:
        """Return the tangents of the forcing of the mean, A x + E u without A dx, and of its outputs."""
        m, d = self.matrices, tangents
        u, du = m["inputs"].dense[..., 0], d["inputs"].dense[..., 0]
        forcing = d["A"].times(x) + d["E"].times(u) + m["E"].times(du)
        outputs = m["C"].times(dx) + d["C"].times(x) + d["G"].times(u) + m["G"].times(du)
        return forcing, outputs

    def form_tangent(
        self, form: ca.Function, values: list[NDArray], numbers: NDArray, tables: NDArray, directions: list[NDArray]
    ) -> NDArray[np.float64]:
        """Return the directional derivative of the gradient of a form, (k, n_z + n_v)."""
        at = [self.times, self.tables, self.numbers, *values]
        return _along(form, at, [np.zeros_like(self.times), tables, numbers, *directions])


def _column(pair: AdjointPair, combined: Combination, factors: tuple[float, float], row: int) -> NDArray[np.float64]:
    """Return the derivative of the gradient of variance and mean, combined by ``factors``, along one parameter."""
    flight, system = pair.flight, pair.executable.system
    expressions, p, n = flight.functions.expressions, pair.executable.parameters, pair.adjoint.shape[1]
    direction, k = np.eye(p.size)[row], pair.times.size
    n_z, n_v, r = flight.numbers.size, pair.tables.shape[1], len(system.outputs)
    nodes = _Points(pair, pair.times, pair.tables, pair.matrices)
    end_time_, end_tables = np.array([pair.end]), pair.tables_at_end[None]
    end = _Points(pair, end_time_, end_tables, flight.functions.matrices(end_time_, end_tables, flight.numbers))
    numbers = _once(expressions.numbers, [p], [direction])

    # the mean, which depends on no table of itself, then these tables
    d_tables, d_end_tables = np.zeros((k, n_v)), np.zeros((1, n_v))
    d, d_end = nodes.matrix_tangents(numbers, d_tables), end.matrix_tangents(numbers, d_end_tables)
    x, x_end = pair.states, pair.states_at_end[None]
    forcing, _ = nodes.mean_tangents(d, x, np.zeros_like(x))
    stages, edges = flight.solver.forward(np.zeros(n), forcing.reshape(-1, STAGES, n))
    dx, dx_end = stages.reshape(-1, n), edges[-1:]
    _, outputs = nodes.mean_tangents(d, x, dx)
    _, outputs_end = end.mean_tangents(d_end, x_end, dx_end)
    for value, (kind, of) in system.mean_sources.items():
        d_tables[:, value] = (outputs if kind == "output" else dx)[:, of]
        d_end_tables[:, value] = (outputs_end if kind == "output" else dx_end)[:, of]
    d, d_end = nodes.matrix_tangents(numbers, d_tables), end.matrix_tangents(numbers, d_end_tables)

    # the adjoint, and its product with the covariance
    a, y, m = pair.adjoint, pair.dual, pair.matrices
    forcing = d["A"].transposed_times(a).reshape(-1, STAGES, n)
    stages, edges = flight.solver.backward(pair.form @ d_end["C"].dense[0], forcing)
    da, da_start = stages.reshape(-1, n), edges[0]
    white = pair.mask * m["B"].transposed_times(a)
    d_white = pair.mask * (d["B"].transposed_times(a) + m["B"].transposed_times(da))
    forcing = d["A"].times(y) + d["B"].times(white) + m["B"].times(d_white)
    product, start_gradient = start_functions(system, pair.sources)
    at_start = [p, pair.adjoint_at_start], [direction, da_start]
    stages, edges = flight.solver.forward(_once(product, *at_start), forcing.reshape(-1, STAGES, n))
    dy, dy_end = stages.reshape(-1, n), edges[-1:]

    # the gradients of both forms
    on_variance, on_mean = factors
    selected, still, none = pair.form, np.zeros((1, n)), np.zeros(r)
    unmoved = [none, np.zeros_like(pair.mask)]
    along = on_variance * nodes.form_tangent(
        expressions.quadratic, [a, y, none, pair.mask], numbers, d_tables, [da, dy, *unmoved]
    )
    last = on_variance * end.form_tangent(
        expressions.quadratic,
        [still, pair.dual_at_end[None], selected, pair.mask],
        numbers,
        d_end_tables,
        [still, dy_end, *unmoved],
    )
    d_adjoint, d_outputs, d_outputs_end = on_mean * da, np.zeros((k, r)), np.zeros(r)
    path = pair.mean_path(along[:, n_z:], last[0, n_z:]) if on_variance else None
    if path is not None:
        own = combined.adjoint - on_mean * a  # the adjoint of the path through the mean alone
        own_end = combined.on_outputs_at_end - on_mean * selected
        d_outputs, d_outputs_end = path.on_outputs, path.on_outputs_at_end
        at_last = path.on_states_at_end + d_outputs_end @ pair.at_end["C"] + own_end @ d_end["C"].dense[0]
        forcing = path.on_states + m["C"].transposed_times(d_outputs) + d["C"].transposed_times(combined.on_outputs)
        forcing = forcing + d["A"].transposed_times(own)
        stages, _ = flight.solver.backward(at_last, forcing.reshape(-1, STAGES, n))
        d_adjoint = d_adjoint + stages.reshape(-1, n)
    along += nodes.form_tangent(
        expressions.linear, [combined.adjoint, x, combined.on_outputs], numbers, d_tables, [d_adjoint, dx, d_outputs]
    )
    last += end.form_tangent(
        expressions.linear,
        [still, x_end, combined.on_outputs_at_end],
        numbers,
        d_end_tables,
        [still, dx_end, d_outputs_end],
    )
    d_numbers = pair.weights @ along[:, :n_z] + last[0, :n_z]
    by_parameters = _once(expressions.numbers_reverse, [p, combined.numbers], [direction, d_numbers])
    return by_parameters + on_variance * _once(start_gradient, *at_start)
