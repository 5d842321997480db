"""What a linear system is refused for, said with the name of the state, noise, output or parameter at fault."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import SystemDefinitionError, UnknownNameError
from .names import COMBINED, unfit

if TYPE_CHECKING:
    from .linear_system import LinearSystem

ROUNDING = 1e-8  # of a start covariance, relative to its standard deviations


def scalar_symbol(kind: str, name: str, value: Any) -> ca.SX:
    """Return a symbol of a user's own system.

    Raises
    ------
    SystemDefinitionError
        If it is not one SX symbol.
    """
    _refuse_mx(kind, name, value)
    if not isinstance(value, ca.SX):
        raise SystemDefinitionError(
            f"{kind} '{name}' is {type(value).__name__} {_short(value)}, not a symbol; make one with casadi.SX.sym"
        )
    if value.numel() != 1:
        raise SystemDefinitionError(
            f"{kind} '{name}' has {value.numel()} entries; make a symbol for each, with a name of its own"
        )
    if not value.is_symbolic():
        raise SystemDefinitionError(
            f"{kind} '{name}' is the expression {_short(value)}, not a symbol; make one with casadi.SX.sym and "
            "write the expression where it is used"
        )
    return value


def scalar_expression(kind: str, name: str, value: Any) -> ca.SX:
    """Return an expression of a user's own system.

    Raises
    ------
    SystemDefinitionError
        If it is neither an SX expression of one entry nor a number.
    """
    _refuse_mx(kind, name, value)
    if isinstance(value, Real) and not isinstance(value, bool | np.bool_):
        return ca.SX(float(value))
    if not isinstance(value, ca.SX | ca.DM):
        raise SystemDefinitionError(
            f"{kind} '{name}' is {type(value).__name__} {_short(value)}; give a number or an expression of casadi.SX"
        )
    expression = ca.densify(ca.SX(value))
    if expression.numel() != 1:
        raise SystemDefinitionError(f"{kind} '{name}' has {expression.numel()} entries; give each a name of its own")
    return expression


def pair(kind: str, name: str, value: Any, what: str) -> tuple[Any, Any]:
    """Return the two entries of a mapping's value.

    Raises
    ------
    SystemDefinitionError
    """
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise SystemDefinitionError(f"{kind} '{name}' is {type(value).__name__} {_short(value)}; give {what}")
    return value[0], value[1]


def finite_number(kind: str, name: str, value: Any) -> float:
    """Return a number as a float.

    Raises
    ------
    SystemDefinitionError
        If it is none, or not finite.
    """
    if isinstance(value, ca.DM) and value.numel() == 1:
        value = float(value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if not isinstance(value, Real) or isinstance(value, bool | np.bool_) or not math.isfinite(value):
        raise SystemDefinitionError(f"{kind} '{name}' is {_short(value)}; give a finite number")
    return float(value)


def check_keys(kind: str, given: Mapping[str, object], known: Iterable[str]) -> None:
    """Refuse a mapping by name that has a name which nothing carries.

    Raises
    ------
    UnknownNameError
        With the nearest name.
    """
    known = list(dict.fromkeys(known))
    for name in given:
        if name not in known:
            raise UnknownNameError(kind, str(name), known)


def check_labels(system: LinearSystem) -> None:
    """Refuse names, units and sizes that results and generated code cannot carry.

    Raises
    ------
    SystemDefinitionError
    """
    where = f"system '{system.name}'"
    if why := unfit(system.name):
        raise SystemDefinitionError(f"the name of a system {why}; give it a short plain one")
    labels = [
        *(("state", s.name, s.unit) for s in system.states),
        *(("output", o.name, o.unit) for o in system.outputs),
        *(("parameter", p.name, p.unit) for p in system.parameters),
        *(("noise", n.name, "1") for n in system.noises),
        *(("noise source", n.source, "1") for n in system.noises),
        *(("input", name, "1") for name in system.input_names),
        *(("table", name, unit) for g in system.tables for name, unit in zip(g.names, g.units, strict=True)),
    ]
    for kind, name, unit in labels:
        if why := unfit(name):
            raise SystemDefinitionError(f"{where}: the name of a {kind} {why}; give it a short plain one")
        if why := unfit(unit, empty=True):
            raise SystemDefinitionError(f"{where}: the unit of {kind} '{name}' {why}; write it such as 'm/s'")
    for output in system.outputs:
        if why := unfit(output.symbol, empty=True):
            raise SystemDefinitionError(f"{where}: the symbol of output '{output.name}' {why}")
    if COMBINED in system.sources:
        raise SystemDefinitionError(
            f"{where}: a noise source cannot be called '{COMBINED}', which is the sum over all sources in every "
            "result; rename it"
        )
    for kind, entry in (*(("state", s) for s in system.states), *(("output", o) for o in system.outputs)):
        if not finite_number(f"{where}: the scale of {kind}", entry.name, entry.scale) > 0:
            raise SystemDefinitionError(
                f"{where}: the scale of {kind} '{entry.name}' is {entry.scale:g}; give a typical size above zero"
            )
    for parameter in system.parameters:
        finite_number(f"{where}: parameter", parameter.name, parameter.value)
    finite_number(f"{where}: the time", "start", system.start)
    if system.end != math.inf:
        finite_number(f"{where}: the time", "end", system.end)
    for kind, entries in (("states", system.states), ("outputs", system.outputs)):
        if not entries:
            raise SystemDefinitionError(f"{where} has no {kind}; give one at least")


def check_symbols(system: LinearSystem) -> None:
    """Refuse symbols that are expressions or stand for two things, and calls of functions inside the expressions.

    Raises
    ------
    SystemDefinitionError
    """
    groups = (
        ("time", ("time",), system.time),
        ("state", system.state_names, system.x),
        ("noise", system.noise_names, system.w),
        ("input", system.input_names, system.u),
        ("parameter", system.parameter_names, system.p),
        ("table", tuple(name for g in system.tables for name in g.names), system.v),
    )
    first: dict[int, str] = {}
    for kind, names, symbols in groups:
        for i, name in enumerate(names):
            label = kind if kind == "time" else f"{kind} '{name}'"
            symbol = symbols[i]
            if not symbol.is_symbolic():
                raise SystemDefinitionError(
                    f"system '{system.name}': {label} is the expression {_short(symbol)}, not a symbol"
                )
            other = first.setdefault(symbol.element_hash(), label)
            if other != label:
                raise SystemDefinitionError(
                    f"system '{system.name}': one symbol stands for {other} and {label}; make one for each"
                )
    for what, expressions, names in (
        ("derivative of", system.derivative, system.state_names),
        ("output", system.output, system.output_names),
        ("input", system.input_values, system.input_names),
    ):
        if _calls(expressions):
            name = next(name for i, name in enumerate(names) if _calls(expressions[i]))
            raise SystemDefinitionError(
                f"system '{system.name}': the {what} '{name}' calls a function (casadi.interpolant, external code), "
                "which has no C form here; write it with arithmetic, elementary functions and if_else, or make it a "
                "table of the system"
            )


def _calls(expression: ca.SX) -> bool:
    function = ca.Function("expression", ca.symvar(expression), [expression])
    return any(function.instruction_id(k) == ca.OP_CALL for k in range(function.n_instructions()))


def checked_covariance(system: LinearSystem, source: str, given: Any) -> ca.SX | NDArray[np.float64]:
    """Return a start covariance as an array, or as an expression of the parameters where it is one.

    Raises
    ------
    SystemDefinitionError
        Shape, values, or symbols that are no parameters.
    """
    n, where = len(system.states), f"system '{system.name}': the start covariance of '{source}'"
    if isinstance(given, ca.MX):
        raise SystemDefinitionError(f"{where} is an MX expression; write it with the SX symbols of the parameters")
    if isinstance(given, ca.SX) and not given.is_constant():
        matrix: ca.SX | NDArray[np.float64] = given
        known = {p.element_hash() for p in ca.symvar(system.p)}
        for symbol in ca.symvar(given):
            if symbol.element_hash() not in known:
                raise SystemDefinitionError(
                    f"{where} depends on '{symbol.name()}', which is no parameter of the system"
                )
    else:
        try:
            matrix = np.array(ca.DM(given) if isinstance(given, ca.SX) else given, dtype=float)
        except (TypeError, ValueError, NotImplementedError):
            raise SystemDefinitionError(f"{where} is {type(given).__name__} {_short(given)}; give numbers") from None
        matrix = matrix.reshape(1, 1) if matrix.size == n == 1 else matrix
    if tuple(matrix.shape) != (n, n):
        raise SystemDefinitionError(
            f"{where} has the shape {tuple(matrix.shape)}; it is {(n, n)}, a row and a column for each of the states "
            f"{', '.join(system.state_names[:12])}"
        )
    if isinstance(matrix, np.ndarray):
        check_covariance(system, source, matrix)
    return matrix


def check_covariance(system: LinearSystem, source: str, matrix: NDArray[np.float64]) -> None:
    """Refuse a matrix that is no covariance.

    Raises
    ------
    SystemDefinitionError
        An entry that is not finite, a negative variance, a matrix that is not symmetric or is indefinite.
    """
    names, where = system.state_names, f"system '{system.name}': the start covariance of '{source}'"

    def entry(bad: NDArray[np.bool_]) -> tuple[str, float]:
        i, j = np.argwhere(bad)[0]
        return f"'{names[i]}' and '{names[j]}'", float(matrix[i, j])

    if (bad := ~np.isfinite(matrix)).any():
        at, value = entry(bad)
        raise SystemDefinitionError(f"{where} is {value:g} between {at}; give finite numbers")
    variance = np.diag(matrix)
    if (bad := variance < 0).any():
        i = int(np.argmax(bad))
        raise SystemDefinitionError(
            f"{where} gives '{names[i]}' the variance {variance[i]:g}; a variance is not negative"
        )
    std = np.sqrt(variance)
    size = np.outer(std, std)
    if (bad := np.abs(matrix - matrix.T) > ROUNDING * size).any():
        at, _ = entry(bad)
        raise SystemDefinitionError(f"{where} is not symmetric between {at}; give one covariance for the pair")
    if (bad := np.abs(matrix) > (1 + ROUNDING) * size).any():
        at, value = entry(bad)
        raise SystemDefinitionError(
            f"{where} is indefinite: {value:g} between {at} is more than the product of their standard deviations"
        )
    inside = std > 0
    correlation = matrix[np.ix_(inside, inside)] / size[np.ix_(inside, inside)]
    least = float(np.linalg.eigvalsh(correlation).min(initial=0.0))
    if least < -ROUNDING * max(1, len(correlation)):
        raise SystemDefinitionError(f"{where} is indefinite: its correlations have the negative eigenvalue {least:.2g}")


def _refuse_mx(kind: str, name: str, value: Any) -> None:
    if isinstance(value, ca.MX):
        raise SystemDefinitionError(
            f"{kind} '{name}' is an MX expression; write the system with casadi.SX symbols throughout"
        )


def _short(value: object) -> str:
    text = " ".join(repr(value).removeprefix("SX").split())
    return text if len(text) <= 60 else f"{text[:57]}..."
