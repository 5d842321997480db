"""What a linear system is refused for, said with the name of the state, noise, output or parameter at fault."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import SystemDefinitionError, UnknownNameError
from .labels import Noise, Output, Parameter, State
from .names import COMBINED, unfit

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
        return ca.SX(_rounded(value))
    if not isinstance(value, ca.SX | ca.DM):
        raise SystemDefinitionError(
            f"{kind} '{name}' is {type(value).__name__} {_short(value)}; give a number or an expression of casadi.SX"
        )
    expression = ca.densify(ca.SX(value))
    if expression.numel() != 1:
        raise SystemDefinitionError(f"{kind} '{name}' has {expression.numel()} entries; give each a name of its own")
    return expression


def mapping(what: str, given: Any, left_out: bool = False) -> Mapping[str, Any]:
    """Return a mapping by name; an empty one for None that may be left out.

    Raises
    ------
    SystemDefinitionError
        If it is none, or has a name that is no text.
    """
    if given is None and left_out:
        return {}
    if not isinstance(given, Mapping):
        raise SystemDefinitionError(
            f"{what}: {type(given).__name__} {_short(given)} is no mapping; give them by name, such as {{'x': ...}}"
        )
    for name in given:
        if not isinstance(name, str):
            raise SystemDefinitionError(f"{what}: the name {_short(name)} is {type(name).__name__}; names are text")
    return given


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
    if not isinstance(value, Real) or isinstance(value, bool | np.bool_) or not math.isfinite(_rounded(value)):
        raise SystemDefinitionError(f"{kind} '{name}' is {_short(value)}; give a finite number")
    return float(value)


def _rounded(value: Real) -> float:
    """Return a number as the nearest float; infinity for an integer that is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf  # pyright: ignore[reportOperatorIssue]  # Real lacks the order


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


def check_labels(system: str, labels: Iterable[tuple[str, str, str]]) -> None:
    """Refuse names and units that results and generated code cannot carry.

    Parameters
    ----------
    system : str
        Its name.
    labels : iterable of (kind, name, unit)

    Raises
    ------
    SystemDefinitionError
    """
    if why := unfit(system):
        raise SystemDefinitionError(f"the name of a system {why}; give it a short plain one")
    for kind, name, unit in labels:
        if why := unfit(name):
            raise SystemDefinitionError(f"system '{system}': the name of a {kind} {why}; give it a short plain one")
        if why := unfit(unit, empty=True):
            raise SystemDefinitionError(f"system '{system}': the unit of {kind} '{name}' {why}; write it such as 'm/s'")


def check_entries(
    where: str,
    states: Sequence[State],
    noises: Sequence[Noise],
    outputs: Sequence[Output],
    parameters: Sequence[Parameter],
) -> None:
    """Refuse sizes, values and symbols that are none, a source with a reserved name, and a system of nothing.

    Raises
    ------
    SystemDefinitionError
    """
    for output in outputs:
        if why := unfit(output.symbol, empty=True):
            raise SystemDefinitionError(f"{where}: the symbol of output '{output.name}' {why}")
    if any(noise.source == COMBINED for noise in noises):
        raise SystemDefinitionError(
            f"{where}: a noise source cannot be called '{COMBINED}', which is the sum over all sources in every "
            "result; rename it"
        )
    for kind, entry in (*(("state", s) for s in states), *(("output", o) for o in outputs)):
        if not finite_number(f"{where}: the scale of {kind}", entry.name, entry.scale) > 0:
            raise SystemDefinitionError(
                f"{where}: the scale of {kind} '{entry.name}' is {entry.scale:g}; give a typical size above zero"
            )
    for parameter in parameters:
        finite_number(f"{where}: parameter", parameter.name, parameter.value)
    for kind, entries in (("states", states), ("outputs", outputs)):
        if not entries:
            raise SystemDefinitionError(f"{where} has no {kind}; give one at least")


def check_span(where: str, start: float, end: float) -> None:
    """Refuse a start that is no time, and an end that is neither a time nor infinity.

    Raises
    ------
    SystemDefinitionError
    """
    finite_number(f"{where}: the time", "start", start)
    if not (isinstance(end, Real) and end == math.inf):
        finite_number(f"{where}: the time", "end", end)


def check_symbols(
    where: str,
    symbols: Iterable[tuple[str, Sequence[str], ca.SX]],
    expressions: Iterable[tuple[str, Sequence[str], ca.SX]],
) -> None:
    """Refuse symbols that are expressions or stand for two things, and calls of functions inside the expressions.

    Parameters
    ----------
    where : str
        The system, for errors.
    symbols, expressions : iterables of (kind, names, SX column)

    Raises
    ------
    SystemDefinitionError
    """
    first: dict[int, str] = {}
    for kind, names, column in symbols:
        for i, name in enumerate(names):
            label = kind if kind == "time" else f"{kind} '{name}'"
            symbol = column[i]
            if not symbol.is_symbolic():
                raise SystemDefinitionError(f"{where}: {label} is the expression {_short(symbol)}, not a symbol")
            other = first.setdefault(symbol.element_hash(), label)
            if other != label:
                raise SystemDefinitionError(f"{where}: one symbol stands for {other} and {label}; make one for each")
    for what, names, column in expressions:
        if _calls(column):
            name = next(name for i, name in enumerate(names) if _calls(column[i]))
            raise SystemDefinitionError(
                f"{where}: the {what} '{name}' calls a function (casadi.interpolant, external code), "
                "which has no C form here; write it with arithmetic, elementary functions and if_else, or give its "
                "rows in tables={'name': (symbol, times, values)}"
            )


def _calls(expression: ca.SX) -> bool:
    function = ca.Function("expression", ca.symvar(expression), [expression])
    return any(function.instruction_id(k) == ca.OP_CALL for k in range(function.n_instructions()))


def checked_covariance(where: str, states: Sequence[str], p: ca.SX, given: Any) -> ca.SX | NDArray[np.float64]:
    """Return a start covariance as an array, or as an expression of the parameters where it is one.

    Parameters
    ----------
    where : str
        Of which system and source, for errors.
    states : sequence of str
        Names.
    p : SX
        Symbols of the parameters.
    given : SX, DM, array or number

    Raises
    ------
    SystemDefinitionError
        Shape, values, or symbols that are no parameters.
    """
    n = len(states)
    if isinstance(given, ca.MX):
        raise SystemDefinitionError(f"{where} is an MX expression; write it with the SX symbols of the parameters")
    if isinstance(given, ca.SX) and not given.is_constant():
        matrix: ca.SX | NDArray[np.float64] = given
        known = {p.element_hash() for p in ca.symvar(p)}
        for symbol in ca.symvar(given):
            if symbol.element_hash() not in known:
                raise SystemDefinitionError(
                    f"{where} depends on '{symbol.name()}', which is no parameter of the system"
                )
    else:
        try:
            matrix = np.array(ca.DM(given) if isinstance(given, ca.SX) else given, dtype=float)
        except (TypeError, ValueError, NotImplementedError, OverflowError):
            raise SystemDefinitionError(f"{where} is {type(given).__name__} {_short(given)}; give numbers") from None
        matrix = matrix.reshape(1, 1) if matrix.size == n == 1 else matrix
    if tuple(matrix.shape) != (n, n):
        raise SystemDefinitionError(
            f"{where} has the shape {tuple(matrix.shape)}; it is {(n, n)}, a row and a column for each of the states "
            f"{', '.join(states[:12])}"
        )
    if isinstance(matrix, np.ndarray):
        check_covariance(where, states, matrix)
    return matrix


def check_covariance(where: str, states: Sequence[str], matrix: NDArray[np.float64]) -> None:
    """Refuse a matrix that is no covariance.

    Parameters
    ----------
    where, states
        As for :func:`checked_covariance`.
    matrix : (n, n) array

    Raises
    ------
    SystemDefinitionError
        An entry that is not finite, a negative variance, a matrix that is not symmetric or is indefinite.
    """

    def entry(bad: NDArray[np.bool_]) -> tuple[str, float]:
        i, j = np.argwhere(bad)[0]
        return f"'{states[i]}' and '{states[j]}'", float(matrix[i, j])

    if (bad := ~np.isfinite(matrix)).any():
        at, value = entry(bad)
        raise SystemDefinitionError(f"{where} is {value:g} between {at}; give finite numbers")
    variance = np.diag(matrix)
    if (bad := variance < 0).any():
        i = int(np.argmax(bad))
        raise SystemDefinitionError(
            f"{where} gives '{states[i]}' the variance {variance[i]:g}; a variance is not negative"
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
