"""The general linear time-varying system that every vehicle, wind filter and user's own model becomes.

    x' = A(t, p) x + B(t, p) w + E(t, p) u        w: white noise of unit intensity, grouped by source
    y  = C(t, p) x + D(t, p) w + G(t, p) u        u: known inputs, such as the mean wind

The equations stand once, as CasADi expressions linear in x, w and u; the matrices are their derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Self

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ..errors import DirectNoiseError, NonlinearSystemError, SystemDefinitionError, TimeRangeError, UnknownNameError
from ..tables import MeanKind, Table, TableGroup
from .arrays import parts_from_arrays
from .checks import (
    check_covariance,
    check_entries,
    check_keys,
    check_labels,
    check_span,
    check_symbols,
    checked_covariance,
)
from .labels import Noise, Output, Parameter, State, block_of
from .pulses import Coefficients, coefficients, pulse_marks
from .switches import switch_times
from .time_conditions import Condition, Stops, find_conditions, locate


@dataclass(frozen=True, eq=False, repr=False)
class LinearSystem:
    """A linear time-varying system, symbolically.

    Parameters
    ----------
    name : str
    time : SX scalar
    x, w, u, p, v : SX column vectors
        States, white noises, known inputs, parameters, and table values at ``time``.
    derivative, output : SX
        x' and y in terms of the symbols above; linear in x, w, u.
    states, noises, outputs, parameters : tuples
        What the entries of x, w, y and p are.
    input_names : tuple of str
    input_values : SX
        The known inputs as functions of time, p and v, shape (n_u,).
    tables : tuple of TableGroup
        Their values, group by group, are v.
    rows : tuple of Table
        Those of the tables that were given as rows over time, of which a sensitivity tells the derivative of each.
    start_covariance : mapping of source to (n, n) SX or array
        Covariance P0 of the states at the start that a source brings; a function of p. Missing means zero.
    discontinuities : tuple of float
        Times at which a table or a matrix jumps, s; integrators stop there. They are put in order, each once. A
        condition on time in the expressions needs no declaration: it is located (:meth:`stops`).
    start, end : float
        Times between which the system is defined, s.
    coupling_matrix : SX, optional
        A symmetric matrix whose inverse stands in the equations; checked to be positive definite.
    structure : mapping of str to str
        What the system is made of, in words; used to say why code is generated again.

    Raises
    ------
    SystemDefinitionError
        Names and units that are empty or hold control characters, sizes and values that are not finite, symbols that
        are expressions or stand for two things, a start covariance that is none, no states or no outputs.
    NonlinearSystemError
        If an expression is not linear in x, w, u, or depends on a symbol that was not declared.
    UnknownNameError
        A start covariance for a source that is not there.
    SwitchError
        If a condition (a comparison, floor, sign, ...) outside of the outputs depends on a table.
    """

    name: str
    time: ca.SX
    x: ca.SX
    w: ca.SX
    u: ca.SX
    p: ca.SX
    v: ca.SX
    derivative: ca.SX
    output: ca.SX
    states: tuple[State, ...]
    noises: tuple[Noise, ...]
    outputs: tuple[Output, ...]
    parameters: tuple[Parameter, ...] = ()
    input_names: tuple[str, ...] = ()
    input_values: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    tables: tuple[TableGroup, ...] = ()
    start_covariance: Mapping[str, ca.SX | np.ndarray] = field(default_factory=dict)
    discontinuities: tuple[float, ...] = ()
    start: float = 0.0
    end: float = float("inf")
    coupling_matrix: ca.SX | None = None
    structure: Mapping[str, str] = field(default_factory=dict)
    rows: tuple[Table, ...] = ()

    @classmethod
    def from_arrays(
        cls,
        times: ArrayLike,
        A: ArrayLike,
        B: ArrayLike,
        C: ArrayLike,
        D: ArrayLike | None = None,
        E: ArrayLike | None = None,
        G: ArrayLike | None = None,
        *,
        u: ArrayLike | None = None,
        name: str = "system",
        names: Mapping[str, Sequence[str]] | None = None,
        sources: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        scales: Mapping[str, float] | None = None,
        start_covariance: Mapping[str, np.ndarray] | None = None,
        discontinuities: Sequence[float] = (),
        interpolation: str = "linear",
    ) -> Self:
        """Make a system of matrices that are numbers over time.

        An entry that is constant is a parameter of the system, one that varies a table of it, both named such as
        'A(3,5)': third row, fifth column. One that is always zero is none of it.

        Parameters
        ----------
        times : (k,) array
            s, from the start to the end of the system. A time that stands twice is a jump; integrators stop there.
        A : (k, n, n) or (n, n) array
            Each array over the times or constant; of NumPy, or of xarray with dimensions in this order.
        B : (k, n, n_w) or (n, n_w) array
        C : (k, n_y, n) or (n_y, n) array
        D : (k, n_y, n_w) or (n_y, n_w) array, optional
        E : (k, n, n_u) or (n, n_u) array, optional
        G : (k, n_y, n_u) or (n_y, n_u) array, optional
        u : (k, n_u) or (n_u,) array, optional
            Known inputs, which make the mean; ones without it.
        name : str
        names : mapping of 'states', 'noises', 'outputs' and 'inputs' to names, optional
            Without them the labels of arrays of xarray, else x1, w1, y1, u1 and so on.
        sources : mapping of noise name to source, optional
            Without it every noise is a source of its own.
        units : mapping by state, output or input name, optional
        scales : mapping by state or output name, optional
            Typical sizes, by which integrators weigh errors.
        start_covariance : mapping of source to (n, n) array, optional
        discontinuities : sequence of float
            Times between two rows at which matrices jump, s; rows on either side are carried on to them.
        interpolation : {'linear', 'cubic', 'pchip', 'step'}
            Straight lines, whose kinks integrators stop at; not-a-knot cubic splines; monotone cubics; or the value of
            the row before.

        Returns
        -------
        LinearSystem

        Raises
        ------
        SystemDefinitionError
            Arrays that do not fit each other, with all that are at fault; times that decrease; numbers that are none.
        UnknownNameError
            A name that nothing carries.

        Examples
        --------
        >>> import ascentwind as aw
        >>> lag = aw.LinearSystem.from_arrays([0, 10], A=[[-0.5]], B=[[1.0]], C=[[1.0]], names={"outputs": ["lag"]})
        >>> [p.name for p in lag.parameters]
        ['A(1,1)', 'B(1,1)', 'C(1,1)']
        """
        parts = parts_from_arrays(
            times,
            {"A": A, "B": B, "C": C, "D": D, "E": E, "G": G},
            u,
            name=name,
            names=names,
            sources=sources,
            units=units,
            scales=scales,
            start_covariance=start_covariance,
            discontinuities=discontinuities,
            interpolation=interpolation,
        )
        return cls(**parts)

    def __repr__(self) -> str:
        counts = {
            "state": self.states,
            "output": self.outputs,
            "noise": self.noises,
            "source": self.sources,
            "input": self.input_names,
            "parameter": self.parameters,
            "table": [name for group in self.tables for name in group.names],
        }
        told = ", ".join(f"{len(x)} {what}{'' if len(x) == 1 else 's'}" for what, x in counts.items())
        return f"LinearSystem '{self.name}': {told}, {self.start:g} to {self.end:g} s"

    def __post_init__(self):
        where = f"system '{self.name}'"
        check_labels(self.name, self._labels())
        check_entries(where, self.states, self.noises, self.outputs, self.parameters)
        check_span(where, self.start, self.end)
        sizes = {
            "states": (self.x.numel(), len(self.states), self.derivative.numel()),
            "noises": (self.w.numel(), len(self.noises)),
            "inputs": (self.u.numel(), len(self.input_names), self.input_values.numel()),
            "parameters": (self.p.numel(), len(self.parameters)),
            "table values": (self.v.numel(), sum(len(g.names) for g in self.tables)),
            "outputs": (self.output.numel(), len(self.outputs)),
        }
        for what, counts in sizes.items():
            if len(set(counts)) > 1:
                raise SystemDefinitionError(f"system '{self.name}': {what} disagree in number: {counts}")
        if not self.end > self.start:
            raise TimeRangeError(f"system '{self.name}' ends at {self.end:g} s, before its start at {self.start:g} s")
        object.__setattr__(self, "discontinuities", switch_times(self.discontinuities, self.start))
        for label, names in (
            ("state", self.state_names),
            ("noise", self.noise_names),
            ("output", self.output_names),
            ("parameter", self.parameter_names),
            ("input", self.input_names),
        ):
            repeated = {n for n in names if names.count(n) > 1}
            if repeated:
                raise SystemDefinitionError(f"system '{self.name}' has more than one {label} '{repeated.pop()}'")
        symbols = (
            ("time", ("time",), self.time),
            ("state", self.state_names, self.x),
            ("noise", self.noise_names, self.w),
            ("input", self.input_names, self.u),
            ("parameter", self.parameter_names, self.p),
            ("table", tuple(name for g in self.tables for name in g.names), self.v),
        )
        expressions = (
            ("derivative of", self.state_names, self.derivative),
            ("output", self.output_names, self.output),
            ("input", self.input_names, self.input_values),
        )
        check_symbols(where, symbols, expressions)
        check_keys("noise source", self.start_covariance, self.sources)
        covariance = {
            source: checked_covariance(self._where(source), self.state_names, self.p, given)
            for source, given in self.start_covariance.items()
        }
        object.__setattr__(self, "start_covariance", covariance)
        signals = ca.vertcat(self.x, self.w, self.u)
        for what, expression, labels in (
            ("derivative of", self.derivative, self.state_names),
            ("output", self.output, self.output_names),
        ):
            free = ca.symvar(ca.veccat(expression, self.input_values))
            known = {e.__hash__() for e in ca.symvar(ca.veccat(signals, self.time, self.p, self.v))}
            unknown = [e.name() for e in free if e.__hash__() not in known]
            if unknown:
                raise NonlinearSystemError(
                    f"system '{self.name}' uses the symbol '{unknown[0]}', which is neither a state, input, "
                    "noise nor parameter of it; declare it"
                )
            for i, label in enumerate(labels):
                row = ca.jacobian(expression[i], signals)
                at_rest = ca.substitute(expression[i], signals, ca.DM.zeros(signals.numel()))
                if ca.depends_on(row, signals) or not ca.simplify(at_rest).is_zero():
                    raise NonlinearSystemError(
                        f"system '{self.name}': the {what} '{label}' is not linear in states, noises and inputs; "
                        "linearise it about the mean flight"
                    )
        _ = self.conditions

    def _labels(self) -> list[tuple[str, str, str]]:
        """Return kind, name and unit of everything that has a name."""
        return [
            *(("state", s.name, s.unit) for s in self.states),
            *(("output", o.name, o.unit) for o in self.outputs),
            *(("parameter", p.name, p.unit) for p in self.parameters),
            *(("noise", n.name, "1") for n in self.noises),
            *(("noise source", n.source, "1") for n in self.noises),
            *(("input", name, "1") for name in self.input_names),
            *(("table", name, unit) for g in self.tables for name, unit in zip(g.names, g.units, strict=True)),
        ]

    def _where(self, source: str) -> str:
        return f"system '{self.name}': the start covariance of '{source}'"

    @property
    def state_names(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.states)

    @property
    def noise_names(self) -> tuple[str, ...]:
        return tuple(n.name for n in self.noises)

    @property
    def output_names(self) -> tuple[str, ...]:
        return tuple(o.name for o in self.outputs)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def block(self, name: str) -> slice:
        """Return where the states of a block stand in x, such as those of the wind filter ('wind').

        Parameters
        ----------
        name : str

        Returns
        -------
        slice

        Raises
        ------
        UnknownNameError
        """
        return block_of(self.states, name)

    @property
    def sources(self) -> tuple[str, ...]:
        """Noise sources in the order of their first noise input."""
        return tuple(dict.fromkeys(n.source for n in self.noises))

    def noise_columns(self, source: str) -> list[int]:
        """Return the columns of B and D that belong to a source.

        Parameters
        ----------
        source : str

        Returns
        -------
        list of int

        Raises
        ------
        UnknownNameError
        """
        if source not in self.sources:
            raise UnknownNameError("noise source", source, self.sources)
        return [i for i, n in enumerate(self.noises) if n.source == source]

    @property
    def mean_sources(self) -> dict[int, tuple[MeanKind, int]]:
        """Of each table of the mean response, by the number of its value: whether an output or a state, and which."""
        sources = [source for g in self.tables for source in (g.sources or (None,) * len(g.names))]
        number = {"output": self.output_index, "state": self.state_names.index}
        return {value: (of[0], number[of[0]](of[1])) for value, of in enumerate(sources) if of is not None}

    def output_index(self, name: str) -> int:
        """Return the row of a response in C and D.

        Parameters
        ----------
        name : str

        Returns
        -------
        int

        Raises
        ------
        UnknownNameError
        """
        if name not in self.output_names:
            raise UnknownNameError("response", name, self.output_names)
        return self.output_names.index(name)

    def refuse_direct_noise(self, outputs: Iterable[str]) -> None:
        """Raise if white noise reaches one of the outputs directly.

        Parameters
        ----------
        outputs : iterable of str
            Names of responses.

        Raises
        ------
        DirectNoiseError
            Names source, output and the way out.
        UnknownNameError
        """
        rows, columns = self.D.sparsity().row(), self.D.sparsity().get_col()
        for name in outputs:
            which = self.output_index(name)
            for row, column in zip(rows, columns, strict=True):
                if row == which and not self.D[row, column].is_zero():
                    raise DirectNoiseError(
                        f"white noise of source '{self.noises[column].source}' reaches '{name}' directly, so that its "
                        "variance is infinite; colour the noise (white = false with a correlation time) or leave the "
                        "response out"
                    )

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """Conditions on time in the expressions: comparisons, floor, sign, fmod, ... of time and parameters."""
        signals = ca.vertcat(self.x, self.w, self.u)
        integrated = (self.derivative, self.input_values)
        return find_conditions(integrated, (self.output,), self.time, self.p, self.v, signals, self.name)

    def stops(self, parameters: np.ndarray, until: float) -> Stops:
        """Return where integrators stop for given parameters: declared discontinuities and located switches.

        Parameters
        ----------
        parameters : (n_p,) array
        until : float
            s; those beyond it may be among them.

        Returns
        -------
        Stops
            Times (s) and the switches that lie there.

        Raises
        ------
        SwitchError
            If a condition cannot be located; it says which and why.
        """
        return _located(self, np.asarray(parameters, float).tobytes() if self.conditions else b"", self._last(until))

    def pulses(self, parameters: np.ndarray, until: float) -> np.ndarray:
        """Return where integrators begin anew so that they do not pass over smooth pulses of the coefficients.

        Parameters
        ----------
        parameters : (n_p,) array
        until : float
            s; those beyond it may be among them.

        Returns
        -------
        (k,) array
            s, increasing.

        Raises
        ------
        SwitchError
            If a condition on time cannot be located.
        """
        if self._coefficients is None or not until > self.start:
            return np.zeros(0)
        return _with_pulses(self, np.asarray(parameters, float).tobytes(), self._last(until))

    @cached_property
    def _coefficients(self) -> Coefficients | None:
        matrices = (self.A, self.B, self.E @ self.input_values)
        return coefficients(matrices, self.time, self.p, self.v)

    def _last(self, until: float) -> float:
        """Return the end; without one a time that is doubled, so that few searches serve all end times."""
        if np.isfinite(self.end):
            return float(self.end)
        return float(self.start + 2.0 ** np.ceil(np.log2(max(until - self.start, 1.0))))

    @cached_property
    def A(self) -> ca.SX:
        """State matrix, (n, n)."""
        return ca.jacobian(self.derivative, self.x)

    @cached_property
    def B(self) -> ca.SX:
        """Noise matrix, (n, n_w)."""
        return ca.jacobian(self.derivative, self.w)

    @cached_property
    def C(self) -> ca.SX:
        """Output matrix, (n_y, n)."""
        return ca.jacobian(self.output, self.x)

    @cached_property
    def D(self) -> ca.SX:
        """Noise feedthrough, (n_y, n_w)."""
        return ca.jacobian(self.output, self.w)

    @cached_property
    def E(self) -> ca.SX:
        """Matrix of the known inputs in x', (n, n_u)."""
        return ca.jacobian(self.derivative, self.u)

    @cached_property
    def G(self) -> ca.SX:
        """Matrix of the known inputs in y, (n_y, n_u)."""
        return ca.jacobian(self.output, self.u)

    def adjoint_derivative(self, adjoint: ca.SX) -> ca.SX:
        """Return -A^T times the columns of ``adjoint``, derived as CasADi's transposed Jacobian product.

        Parameters
        ----------
        adjoint : (n, k) SX

        Returns
        -------
        (n, k) SX
        """
        return -ca.jtimes(self.derivative, self.x, adjoint, True)

    def start_covariance_matrix(self, source: str, values: np.ndarray) -> np.ndarray:
        """Return P0 of a source for given parameter values.

        Parameters
        ----------
        source : str
        values : (n_p,) array

        Returns
        -------
        (n, n) array

        Raises
        ------
        SystemDefinitionError
            These values make it indefinite or not finite.
        """
        n = len(self.states)
        given = self.start_covariance.get(source)
        if given is None:
            return np.zeros((n, n))
        if isinstance(given, np.ndarray):
            return given
        found = np.array(ca.Function("p0", [self.p], [ca.densify(given)])(values), dtype=float).reshape(n, n)
        check_covariance(self._where(source), self.state_names, found)
        return found


@lru_cache(maxsize=64)
def _located(system: LinearSystem, parameters: bytes, end: float) -> Stops:
    return locate(system.conditions, system.discontinuities, np.frombuffer(parameters), system.start, end, system.name)


@lru_cache(maxsize=64)
def _with_pulses(system: LinearSystem, parameters: bytes, end: float) -> np.ndarray:
    assert system._coefficients is not None
    values = np.frombuffer(parameters)
    return pulse_marks(system._coefficients, values, system.stops(values, end), system.start, end)
