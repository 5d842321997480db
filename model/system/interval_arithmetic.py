"""Bounds of a scalar CasADi function over many boxes at once, by interval arithmetic.

Moore, Kearfott and Cloud, Introduction to Interval Analysis, 2009. Bounds are rounded to nearest, not outward: who
needs more than that leaves a margin of a few roundings. What has no bound here is the whole line, which is true. Only
the whole line may hold what is not a number: comparisons make a number of that, so that no rule may narrow it again.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import scipy
from numpy.typing import NDArray

Bounds = tuple[NDArray[np.float64], NDArray[np.float64]]  # low, high
TRUE_OR_FALSE = (0.0, 1.0)


def bounds(function: ca.Function, arguments: list[list[Bounds]]) -> list[list[Bounds]]:
    """Return the bounds of all outputs of a function of SX expressions.

    Parameters
    ----------
    function : Function
        Inputs and outputs are scalars or column vectors, dense.
    arguments : list of list of pairs of (k,) arrays
        Bounds of the entries of every input over k boxes.

    Returns
    -------
    list of list of pairs of (k,) arrays
        By output and entry. Where an expression is not defined the bounds are the whole line.
    """
    work: dict[int, Bounds] = {}
    shape = next((low.shape for of in arguments for low, _ in of), (1,))
    found = [[(np.zeros(shape), np.zeros(shape))] * function.numel_out(i) for i in range(function.n_out())]
    with np.errstate(all="ignore"):
        for k in range(function.n_instructions()):
            operation = function.instruction_id(k)
            into, of = function.instruction_output(k), function.instruction_input(k)
            if operation == ca.OP_INPUT:
                work[into[0]] = arguments[of[0]][of[1]]
            elif operation == ca.OP_CONST:
                constant = np.full(shape, function.instruction_constant(k))
                unknown = np.isnan(constant)
                work[into[0]] = np.where(unknown, -np.inf, constant), np.where(unknown, np.inf, constant)
            elif operation == ca.OP_OUTPUT:
                found[into[0]][into[1]] = work[of[0]]
            else:
                rule = _RULES.get(operation)
                low, high = rule(*(work[i] for i in of)) if rule else (np.full(shape, np.nan),) * 2
                undefined = np.isnan(low) | np.isnan(high)
                if operation not in _DECIDED:
                    for i in of:
                        below, above = np.isinf(work[i][0]), np.isinf(work[i][1])
                        undefined |= (below | above) if operation in _UNDEFINED_AT_INFINITY else (below & above)
                work[into[0]] = np.where(undefined, -np.inf, low), np.where(undefined, np.inf, high)
    return found


def _hull(*values: NDArray) -> Bounds:
    return np.minimum.reduce(values), np.maximum.reduce(values)


def _increasing(f: Callable[[NDArray], NDArray], least: float = -np.inf, largest: float = np.inf):
    def rule(a: Bounds) -> Bounds:
        return f(np.where(a[0] < least, np.nan, a[0])), f(np.where(a[1] > largest, np.nan, a[1]))

    return rule


def _even(f: Callable[[NDArray], NDArray]):
    def rule(a: Bounds) -> Bounds:
        size = _absolute(a)
        return f(size[0]), f(size[1])

    return rule


def _absolute(a: Bounds) -> Bounds:
    nearest = np.where((a[0] <= 0) & (a[1] >= 0), 0.0, np.minimum(np.abs(a[0]), np.abs(a[1])))
    return nearest, np.maximum(np.abs(a[0]), np.abs(a[1]))


def _negative(a: Bounds) -> Bounds:
    return -a[1], -a[0]


def _add(a: Bounds, b: Bounds) -> Bounds:
    return a[0] + b[0], a[1] + b[1]


def _subtract(a: Bounds, b: Bounds) -> Bounds:
    return a[0] - b[1], a[1] - b[0]


def _multiply(a: Bounds, b: Bounds) -> Bounds:
    products = [x * y for x in a for y in b]
    return _hull(*(np.where(np.isnan(p), 0.0, p) for p in products))  # 0 times a bound at infinity


def _inverse(a: Bounds) -> Bounds:
    through_zero = (a[0] <= 0) & (a[1] >= 0)
    return np.where(through_zero, -np.inf, 1 / a[1]), np.where(through_zero, np.inf, 1 / a[0])


def _divide(a: Bounds, b: Bounds) -> Bounds:
    quotients = _hull(*(x / y for x in a for y in b))
    through_zero = (b[0] <= 0) & (b[1] >= 0)
    return np.where(through_zero, -np.inf, quotients[0]), np.where(through_zero, np.inf, quotients[1])


def _power(a: Bounds, b: Bounds) -> Bounds:
    corners = _hull(*(x**y for x in a for y in b))
    size = _absolute(a)
    even = size[0] ** b[0], size[1] ** b[0]
    whole, positive = (b[0] == b[1]) & (b[0] == np.round(b[0])) & (b[0] > 0), a[0] > 0
    is_even = whole & (b[0] % 2 == 0)
    sides = (np.where(is_even, e, np.where(whole | positive, c, np.nan)) for e, c in zip(even, corners, strict=True))
    return next(sides), next(sides)


def _sine(a: Bounds) -> Bounds:
    low, high = _hull(np.sin(a[0]), np.sin(a[1]))
    turns = a[0] / (2 * np.pi), a[1] / (2 * np.pi)
    crest = np.floor(turns[1] - 0.25) >= np.ceil(turns[0] - 0.25)
    trough = np.floor(turns[1] + 0.25) >= np.ceil(turns[0] + 0.25)
    unknown = ~np.isfinite(a[0]) | ~np.isfinite(a[1])
    return np.where(trough | unknown, -1.0, low), np.where(crest | unknown, 1.0, high)


def _cosine(a: Bounds) -> Bounds:
    low, high = _hull(np.cos(a[0]), np.cos(a[1]))
    turns = a[0] / (2 * np.pi), a[1] / (2 * np.pi)
    crest = np.floor(turns[1]) >= np.ceil(turns[0])
    trough = np.floor(turns[1] + 0.5) >= np.ceil(turns[0] + 0.5)
    unknown = ~np.isfinite(a[0]) | ~np.isfinite(a[1])
    return np.where(trough | unknown, -1.0, low), np.where(crest | unknown, 1.0, high)


def _tangent(a: Bounds) -> Bounds:
    pole = np.floor(a[1] / np.pi - 0.5) != np.floor(a[0] / np.pi - 0.5)
    return np.where(pole, -np.inf, np.tan(a[0])), np.where(pole, np.inf, np.tan(a[1]))


def _arc_tangent_2(y: Bounds, x: Bounds) -> Bounds:
    right = x[0] > 0
    low, high = _divide(y, x)
    return np.where(right, np.arctan(low), -np.pi), np.where(right, np.arctan(high), np.pi)


def _hypotenuse(a: Bounds, b: Bounds) -> Bounds:
    a, b = _absolute(a), _absolute(b)
    return np.hypot(a[0], b[0]), np.hypot(a[1], b[1])


def _remainder(whole: Callable[[NDArray], NDArray]):
    def rule(a: Bounds, b: Bounds) -> Bounds:
        quotient = _divide(a, b)
        count = whole(quotient[0])
        within = _subtract(a, _multiply((count, count), b))
        size, known = _absolute(b)[1], count == whole(quotient[1])
        size = np.where(_holds_zero(b), np.inf, size)
        return np.where(known, within[0], -size), np.where(known, within[1], size)

    return rule


def _copy_sign(a: Bounds, b: Bounds) -> Bounds:
    size = _absolute(a)
    return np.where(b[0] > 0, size[0], -size[1]), np.where(b[1] < 0, -size[0], size[1])


def _truth(surely: NDArray, possibly: NDArray) -> Bounds:
    no, yes = TRUE_OR_FALSE
    return np.where(surely, yes, no), np.where(possibly, yes, no)


def _both(*conditions: Bounds) -> Bounds:
    surely = np.logical_and.reduce([~_holds_zero(c) for c in conditions])
    return _truth(surely, np.logical_and.reduce([~_is_zero(c) for c in conditions]))


def _either(*conditions: Bounds) -> Bounds:
    surely = np.logical_or.reduce([~_holds_zero(c) for c in conditions])
    return _truth(surely, np.logical_or.reduce([~_is_zero(c) for c in conditions]))


def _holds_zero(a: Bounds) -> NDArray:
    return (a[0] <= 0) & (a[1] >= 0)


def _is_zero(a: Bounds) -> NDArray:
    return (a[0] == 0) & (a[1] == 0)


def _equal(a: Bounds, b: Bounds) -> Bounds:
    same = (a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0])
    return _truth(same, (a[0] <= b[1]) & (b[0] <= a[1]))


def _not(a: Bounds) -> Bounds:
    return _truth(_is_zero(a), _holds_zero(a))


def _where(condition: Bounds, a: Bounds) -> Bounds:
    never, always = _is_zero(condition), ~_holds_zero(condition)
    low, high = _hull(a[0], np.zeros_like(a[0])), _hull(a[1], np.zeros_like(a[1]))
    return (
        np.where(never, 0.0, np.where(always, a[0], low[0])),
        np.where(never, 0.0, np.where(always, a[1], high[1])),
    )


_RULES: dict[int, Callable[..., Bounds]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_LIFT: lambda a, _: a,
    ca.OP_ADD: _add,
    ca.OP_SUB: _subtract,
    ca.OP_MUL: _multiply,
    ca.OP_DIV: _divide,
    ca.OP_NEG: _negative,
    ca.OP_TWICE: lambda a: (2 * a[0], 2 * a[1]),
    ca.OP_SQ: _even(np.square),
    ca.OP_INV: _inverse,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_SQRT: _increasing(np.sqrt, 0.0),
    ca.OP_EXP: _increasing(np.exp),
    ca.OP_EXPM1: _increasing(np.expm1),
    ca.OP_LOG: _increasing(np.log, 0.0),
    ca.OP_LOG1P: _increasing(np.log1p, -1.0),
    ca.OP_SIN: _sine,
    ca.OP_COS: _cosine,
    ca.OP_TAN: _tangent,
    ca.OP_ASIN: _increasing(np.arcsin, -1.0, 1.0),
    ca.OP_ACOS: lambda a: _negative(_increasing(lambda x: -np.arccos(x), -1.0, 1.0)((a[0], a[1]))),
    ca.OP_ATAN: _increasing(np.arctan),
    ca.OP_ATAN2: _arc_tangent_2,
    ca.OP_SINH: _increasing(np.sinh),
    ca.OP_COSH: _even(np.cosh),
    ca.OP_TANH: _increasing(np.tanh),
    ca.OP_ASINH: _increasing(np.arcsinh),
    ca.OP_ACOSH: _increasing(np.arccosh, 1.0),
    ca.OP_ATANH: _increasing(np.arctanh, -1.0, 1.0),
    ca.OP_ERF: _increasing(lambda x: scipy.special.erf(x)),
    ca.OP_HYPOT: _hypotenuse,
    ca.OP_FABS: _absolute,
    ca.OP_SIGN: _increasing(np.sign),
    ca.OP_FLOOR: _increasing(np.floor),
    ca.OP_CEIL: _increasing(np.ceil),
    ca.OP_FMOD: _remainder(np.trunc),
    ca.OP_REMAINDER: _remainder(np.round),
    ca.OP_FMIN: lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    ca.OP_FMAX: lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
    ca.OP_COPYSIGN: _copy_sign,
    ca.OP_LT: lambda a, b: _truth(a[1] < b[0], a[0] < b[1]),
    ca.OP_LE: lambda a, b: _truth((a[1] <= b[0]) & np.isfinite(a[1]), a[0] <= b[1]),
    ca.OP_EQ: _equal,
    ca.OP_NE: lambda a, b: _not(_equal(a, b)),
    ca.OP_NOT: _not,
    ca.OP_AND: _both,
    ca.OP_OR: _either,
    ca.OP_IF_ELSE_ZERO: _where,
}
_DECIDED = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO}
_UNDEFINED_AT_INFINITY = {
    ca.OP_MUL, ca.OP_DIV, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_FMOD, ca.OP_REMAINDER,
}  # fmt: skip
