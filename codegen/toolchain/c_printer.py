"""Writes a scalar CasADi function as readable C: one assignment an operation, inputs by their names."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import casadi as ca

from ...model.errors import AscentwindError

_ELEMENTARY = (
    *("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh"),
    *("atanh", "floor", "ceil", "fabs", "erf", "expm1", "log1p"),
)
_BINARY = {
    ca.OP_ADD: "{} + {}",
    ca.OP_SUB: "{} - {}",
    ca.OP_MUL: "{} * {}",
    ca.OP_DIV: "{} / {}",
    ca.OP_POW: "pow({}, {})",
    ca.OP_CONSTPOW: "pow({}, {})",
    ca.OP_FMIN: "fmin({}, {})",
    ca.OP_FMAX: "fmax({}, {})",
    ca.OP_FMOD: "fmod({}, {})",
    ca.OP_ATAN2: "atan2({}, {})",
    ca.OP_HYPOT: "hypot({}, {})",
    ca.OP_COPYSIGN: "copysign({}, {})",
    ca.OP_LT: "{} < {}",
    ca.OP_LE: "{} <= {}",
    ca.OP_EQ: "{} == {}",
    ca.OP_NE: "{} != {}",
    ca.OP_AND: "{} && {}",
    ca.OP_OR: "{} || {}",
    ca.OP_IF_ELSE_ZERO: "{} ? {} : 0.0",
}
_UNARY = {
    ca.OP_ASSIGN: "{}",
    ca.OP_NEG: "-{}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "1.0 / {}",
    ca.OP_NOT: "!{}",
    ca.OP_SIGN: "(({0} > 0) - ({0} < 0))",
    **{getattr(ca, f"OP_{name.upper()}"): f"{name}({{}})" for name in _ELEMENTARY},
}


class UnsupportedOperationError(AscentwindError, NotImplementedError):
    """An expression uses an operation that cannot be written as C here."""


def c_function(
    name: str, function: ca.Function, inputs: Sequence[str], outputs: Sequence[str], names: Mapping[str, Sequence[str]]
) -> str:
    """Return a static C function with the arithmetic of a scalar CasADi function.

    Parameters
    ----------
    name : str
    function : Function
        Of SX expressions; inputs dense.
    inputs, outputs : sequences of str
        Their C names. Every input and output is a pointer to its nonzeros, column by column.
    names : mapping of input to sequence of str
        Enumerators to index an input by name instead of by number.

    Raises
    ------
    UnsupportedOperationError
        An operation without a C equivalent above.
    """
    arguments = [f"const double *{i}" for i in inputs] + [f"double *restrict {o}" for o in outputs]
    lines = c_statements(function, inputs, outputs, names)
    unused = [f"(void){o};" for o in outputs if not any(line.startswith(f"{o}[") for line in lines)]
    unused += [f"(void){i};" for i in inputs if not any(re.search(rf"\b{i}\[", line) for line in lines)]
    body = "\n  ".join(unused + lines)
    return f"static void {name}({', '.join(arguments)}) {{\n  {body}\n}}\n"


def c_statements(
    function: ca.Function,
    inputs: Sequence[str],
    outputs: Sequence[str],
    names: Mapping[str, Sequence[str]],
    lanes: Mapping[str, str] | None = None,
) -> list[str]:
    """Return the assignments of ``c_function``, one an operation.

    ``lanes`` gives a second index to those inputs and outputs that hold several points side by side.
    """
    lanes = {name: f"[{lane}]" for name, lane in (lanes or {}).items()}
    lines: list[str] = []
    values: dict[int, str] = {}
    count = 0
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        into, of = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_INPUT:
            argument = inputs[of[0]]
            index = names[argument][of[1]] if argument in names else str(of[1])
            values[into[0]] = f"{argument}[{index}]{lanes.get(argument, '')}"
        elif operation == ca.OP_CONST:
            values[into[0]] = _number(function.instruction_constant(k))
        elif operation == ca.OP_OUTPUT:
            result = outputs[into[0]]
            lines.append(f"{result}[{into[1]}]{lanes.get(result, '')} = {values[of[0]]};")
        else:
            form = _UNARY.get(operation) if len(of) == 1 else _BINARY.get(operation)
            if form is None:
                raise UnsupportedOperationError(
                    f"the expression uses CasADi operation {operation}, which has no C form here; write it with "
                    "arithmetic, powers, roots and elementary functions"
                )
            lines.append(f"const double a{count} = {form.format(*(values[i] for i in of))};")
            values[into[0]] = f"a{count}"
            count += 1
    return lines


def enumerators(prefix: str, names: Sequence[str]) -> list[str]:
    """Return C identifiers for names such as 'bending.1.frequency', numbered where two would be the same."""
    plain = [re.sub(r"[^A-Za-z0-9]+", "_", name) for name in names]
    if len(set(plain)) == len(plain):
        return [f"{prefix}_{name}" for name in plain]
    return [f"{prefix}{i}_{name}" for i, name in enumerate(plain)]


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "INFINITY" if value > 0 else "-INFINITY" if value < 0 else "NAN"
    text = repr(float(value))
    return f"({text})" if value < 0 else text
