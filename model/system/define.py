"""A linear system of one's own, written in a few lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ..errors import SystemDefinitionError
from ..tables import Table
from .checks import check_keys, finite_number, mapping, pair, scalar_expression, scalar_symbol
from .labels import Noise, Output, Parameter, State
from .linear_system import LinearSystem
from .time_tables import group_over_time, kinks, real_numbers, time_grid, time_table


def define_system(
    name: str,
    *,
    time: ca.SX,
    states: Mapping[str, tuple[ca.SX, ca.SX]],
    noises: Mapping[str, ca.SX],
    outputs: Mapping[str, ca.SX],
    parameters: Mapping[str, tuple[ca.SX, float]] | None = None,
    inputs: Mapping[str, tuple[ca.SX, ca.SX | float]] | None = None,
    sources: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    scales: Mapping[str, float] | None = None,
    start_covariance: Mapping[str, ca.SX | np.ndarray] | None = None,
    start: float = 0.0,
    end: float = float("inf"),
    discontinuities: Sequence[float] = (),
    tables: Mapping[str, tuple[Any, ...]] | None = None,
) -> LinearSystem:
    """Write a linear system of your own in a few lines.

    Parameters
    ----------
    name : str
    time : SX scalar
    states : mapping of name to (symbol, derivative)
    noises : mapping of name to symbol
        White noises of unit intensity.
    outputs : mapping of name to expression
    parameters : mapping of name to (symbol, value), optional
    inputs : mapping of name to (symbol, value over time), optional
        Known inputs; they make the mean.
    sources : mapping of noise name to source, optional
        Without it every noise is a source of its own.
    units : mapping by state, output, parameter or table name, optional
    scales : mapping by state or output name, optional
        Typical sizes, by which integrators weigh errors.
    start_covariance : mapping of source to (n, n) SX or array, optional
    start, end : float
        Seconds.
    discontinuities : sequence of float
        Times at which the equations jump, s, in any order; conditions on time in the expressions are located without.

    tables : mapping of name to (symbol, times, values) or (symbol, times, values, interpolation), optional
        Coefficients that are numbers over time, s; straight lines without an interpolation ('linear', 'cubic', 'pchip',
        'step'). A time that stands twice is a jump. Without an ``end`` the system ends where the first of them does.

    Returns
    -------
    LinearSystem

    Raises
    ------
    SystemDefinitionError, NonlinearSystemError, TimeRangeError
        As :class:`LinearSystem`, and symbols or expressions of another kind than casadi.SX.
    UnknownNameError
        A name in ``units``, ``scales``, ``sources`` or ``start_covariance`` that nothing carries.

    Examples
    --------
    >>> import casadi as ca
    >>> t, x, n, tau = (ca.SX.sym(s) for s in ("t", "x", "n", "tau"))
    >>> lag = define_system("lag", time=t, states={"x": (x, -x / tau + n)}, noises={"gust": n},
    ...                     outputs={"x": x}, parameters={"tau": (tau, 2.0)})
    >>> lag.sources
    ('gust',)
    """
    states, noises, outputs = mapping("states", states), mapping("noises", noises), mapping("outputs", outputs)
    parameters, inputs = mapping("parameters", parameters, left_out=True), mapping("inputs", inputs, left_out=True)
    sources, units = mapping("sources", sources, left_out=True), mapping("units", units, left_out=True)
    scales = mapping("scales", scales, left_out=True)
    start_covariance = mapping("start_covariance", start_covariance, left_out=True)
    tables = mapping("tables", tables, left_out=True)
    check_keys("state, output, parameter or table", units, (*states, *outputs, *parameters, *tables))
    check_keys("state or output", scales, (*states, *outputs))
    check_keys("noise", sources, noises)
    equations = {n: pair("state", n, value, "(symbol, derivative)") for n, value in states.items()}
    known = {n: pair("input", n, value, "(symbol, value over time)") for n, value in inputs.items()}
    numbers = {n: pair("parameter", n, value, "(symbol, number)") for n, value in parameters.items()}

    looked_up = {n: _table(n, value, units.get(n, "1"), discontinuities) for n, value in tables.items()}
    if looked_up and end == float("inf"):
        end = min(float(table.argument[-1]) for _, table, _ in looked_up.values())
    for n, (_, table, _) in looked_up.items():
        if table.argument[0] > start or table.argument[-1] < end:
            raise SystemDefinitionError(
                f"table '{n}' goes from {table.argument[0]:g} to {table.argument[-1]:g} s, and the system from "
                f"{start:g} to {end:g} s; extend the table, or give the system a later start and an earlier end"
            )
    nodes = {t for _, _, stops in looked_up.values() for t in stops if start < t < end}

    def column(entries: Iterable[ca.SX]) -> ca.SX:
        return ca.vertcat(ca.SX(0, 1), *entries)

    return LinearSystem(
        name=name,
        time=scalar_symbol("time", "t", time),
        x=column(scalar_symbol("state", n, s) for n, (s, _) in equations.items()),
        w=column(scalar_symbol("noise", n, s) for n, s in noises.items()),
        u=column(scalar_symbol("input", n, s) for n, (s, _) in known.items()),
        p=column(scalar_symbol("parameter", n, s) for n, (s, _) in numbers.items()),
        v=column(symbol for symbol, _, _ in looked_up.values()),
        derivative=column(scalar_expression("the derivative of state", n, d) for n, (_, d) in equations.items()),
        output=column(scalar_expression("output", n, e) for n, e in outputs.items()),
        states=tuple(State(n, units.get(n, "1"), scales.get(n, 1.0)) for n in states),
        noises=tuple(Noise(n, sources.get(n, n)) for n in noises),
        outputs=tuple(Output(n, units.get(n, "1"), scales.get(n, 1.0)) for n in outputs),
        parameters=tuple(
            Parameter(n, finite_number("parameter", n, value), units.get(n, "1")) for n, (_, value) in numbers.items()
        ),
        input_names=tuple(inputs),
        input_values=column(scalar_expression("the value of input", n, value) for n, (_, value) in known.items()),
        start_covariance=start_covariance,
        tables=group_over_time("tables", [table for _, table, _ in looked_up.values()], start, end),
        rows=tuple(table for _, table, _ in looked_up.values()),
        discontinuities=(*discontinuities, *nodes) if nodes else discontinuities,  # pyright: ignore[reportArgumentType]
        start=start,
        end=end,
        structure={
            "states": ", ".join(map(str, states)),
            "noises": ", ".join(map(str, noises)),
            "outputs": ", ".join(map(str, outputs)),
            "inputs": ", ".join(map(str, inputs)) or "none",
            **({"tables": ", ".join(tables)} if tables else {}),
        },
    )


def _table(name: str, given: Any, unit: str, discontinuities: Sequence[float]) -> tuple[ca.SX, Table, set[float]]:
    """Return the symbol of a table, its rows, and the times at which its value or slope jumps."""
    if not isinstance(given, tuple | list) or len(given) not in (3, 4):
        raise SystemDefinitionError(f"table '{name}' is {type(given).__name__}; give (symbol, times, values)")
    symbol, times, values, *how = given
    times = real_numbers(f"the times of table '{name}'", times)
    within = [t for t in discontinuities if times.size and times.min() < t < times.max()]
    grid = time_grid(f"the times of table '{name}'", times, within)
    rows = real_numbers(f"table '{name}'", values)
    if rows.shape != grid.rows.shape:
        raise SystemDefinitionError(f"table '{name}' has values of shape {rows.shape} at {grid.rows.size} times")
    table = time_table(name, unit, grid, rows, how[0] if how else "linear")
    return scalar_symbol("table", name, symbol), table, {*grid.jumps, *kinks(table, grid.jumps)}
