"""Equations and their derivatives as LaTeX: CasADi expressions turned into SymPy's, with the report's symbols."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from ...model.equations.report_equations import ReportEquation, report_equations
from ...model.equations.report_symbols import latex_symbol
from ...model.errors import AscentwindError, UnknownNameError
from ..study import Study

if TYPE_CHECKING:
    import sympy

LONGEST_LINE = 400  # operations: of a longer expression, the parts that occur more than once get a line each


class MissingSymPyError(AscentwindError):
    """Equations are printed through SymPy, an extra."""

    def __init__(self):
        super().__init__("equations are printed through SymPy, which is not installed; pip install 'ascentwind[latex]'")


def to_sympy(expression: ca.SX, names: Mapping[str, ca.SX]) -> sympy.Expr:
    """Return a scalar CasADi expression as SymPy's.

    Parameters
    ----------
    expression : SX scalar
    names : mapping of str to SX scalar
        Its symbols; in SymPy they carry these names.

    Raises
    ------
    MissingSymPyError
    NotImplementedError
        For an operation that has no form here.
    """
    sp = _sympy()
    symbols = list(names.values())
    function = ca.Function("expression", [ca.vertcat(ca.SX(0, 1), *symbols)], [ca.densify(expression)])
    inputs = [sp.Symbol(name, real=True) for name in names]
    operations = _operations(sp)
    values: dict[int, Any] = {}
    result: Any = sp.Integer(0)
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        into, of = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_INPUT:
            values[into[0]] = inputs[of[1]]
        elif operation == ca.OP_CONST:
            values[into[0]] = sp.nsimplify(function.instruction_constant(k), rational=True)
        elif operation == ca.OP_OUTPUT:
            result = values[of[0]]
        elif operation in operations:
            values[into[0]] = operations[operation](*(values[i] for i in of))
        else:
            raise NotImplementedError(f"CasADi operation {operation} has no SymPy form here")
    return result


def _sympy() -> Any:
    try:
        import sympy
    except ImportError:
        raise MissingSymPyError from None
    return sympy


def _operations(sp: Any) -> dict[int, Callable[..., Any]]:
    elementary = {
        getattr(ca, f"OP_{name.upper()}"): getattr(sp, name)
        for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
    }
    return elementary | {
        ca.OP_ASSIGN: lambda a: a,
        ca.OP_ADD: lambda a, b: a + b,
        ca.OP_SUB: lambda a, b: a - b,
        ca.OP_MUL: lambda a, b: a * b,
        ca.OP_DIV: lambda a, b: a / b,
        ca.OP_NEG: lambda a: -a,
        ca.OP_POW: lambda a, b: a**b,
        ca.OP_CONSTPOW: lambda a, b: a**b,
        ca.OP_SQ: lambda a: a**2,
        ca.OP_TWICE: lambda a: 2 * a,
        ca.OP_INV: lambda a: 1 / a,
        ca.OP_FABS: sp.Abs,
        ca.OP_SIGN: sp.sign,
        ca.OP_ATAN2: sp.atan2,
        ca.OP_FMIN: sp.Min,
        ca.OP_FMAX: sp.Max,
    }


def equation_names(study: Study) -> list[str]:
    """Return what :func:`equation_latex` knows: the report's numbers, then outputs and states of the system."""
    numbers = list(report_equations(study.vehicle)) if study.vehicle is not None else []
    return [*numbers, *study.system.output_names, *(n for n in study.system.state_names)]


def equation_latex(study: Study, of: str, by: str | None = None) -> str:
    """Return an equation, or one derivative of it, as LaTeX.

    Parameters
    ----------
    study : Study
    of : str
        '4-1' to '4-13' for an equation of the report as the model reads it; or an output, or a state for its rate, of
        the assembled system.
    by : str, optional
        A table, parameter, state or input: the partial derivative with respect to it.

    Raises
    ------
    UnknownNameError, MissingSymPyError
    """
    equation = _equation(study, of)
    left, right = _left(equation.left), equation.right
    if by is not None:
        if by not in equation.symbols:
            raise UnknownNameError("symbol", by, equation.symbols)
        left = rf"\frac{{\partial {left}}}{{\partial {latex_symbol(by)}}}"
        right = ca.jacobian(right, equation.symbols[by])
    return _latex(left, right, equation.symbols)


def _equation(study: Study, of: str) -> ReportEquation:
    known = report_equations(study.vehicle) if study.vehicle is not None else {}
    if of in known:
        return known[of]
    system = study.system
    if of not in (*system.output_names, *system.state_names):
        raise UnknownNameError("equation", of, equation_names(study))
    tables = [name for g in system.tables for name in g.names]
    vectors = ((system.state_names, system.x), (tables, system.v), (system.parameter_names, system.p))
    symbols = {name: vector[i] for names, vector in vectors for i, name in enumerate(names)}
    symbols |= {f"input {name}": system.u[i] for i, name in enumerate(system.input_names)}
    symbols |= {f"noise {name}": system.w[i] for i, name in enumerate(system.noise_names)}
    symbols |= {"t": system.time}
    if of in system.output_names:
        return ReportEquation(of, of, system.output[system.output_index(of)], symbols)
    return ReportEquation(of, f"rate of {of}", system.derivative[system.state_names.index(of)], symbols)


def _left(name: str) -> str:
    if name.startswith("rate of "):
        return rf"\frac{{d}}{{dt}} {latex_symbol(name.removeprefix('rate of '))}"
    if name.endswith("(s)"):
        return f"T_{name[1]}(s)"
    return latex_symbol(name)


def _latex(left: str, right: ca.SX, symbols: Mapping[str, ca.SX]) -> str:
    sp = _sympy()
    free = {symbol.__hash__() for symbol in ca.symvar(right)}
    used = {name: symbol for name, symbol in symbols.items() if symbol.__hash__() in free}
    expression = to_sympy(right, used)
    names = {sp.Symbol(name, real=True): latex_symbol(name) for name in used}
    if sp.count_ops(expression) < LONGEST_LINE:
        shortest = min((expression, sp.together(expression), sp.factor(expression)), key=sp.count_ops)
        return f"{left} = {sp.latex(shortest, symbol_names=names)}"
    parts, (rest,) = sp.cse(expression, sp.numbered_symbols("c"), order="none")
    lines = [(left, rest), *((sp.latex(symbol), part) for symbol, part in parts)]
    rows = (f"{name} &= {sp.latex(value, symbol_names=names)}" for name, value in lines)
    return r"\begin{aligned}" + "\n" + " \\\\\n".join(rows) + "\n" + r"\end{aligned}"
