"""Where a system's own equations switch: conditions on time in its expressions, and their times for given parameters.

Comparisons, floor, ceil, sign, fmod, fabs, fmin and the like of time and parameters make jumps or corners that no
integrator sees coming. Each is a condition: an argument s(t, p) that passes zero, or a whole number. One that is
straight in time is solved for; any other is bounded by interval arithmetic over boxes, which are halved until the
argument has no such level in them or passes it once, so that no pair of switches is stepped over.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import cast

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..errors import NonlinearSystemError, SwitchError
from .interval_arithmetic import bounds
from .switches import ROUNDINGS, rounding

MOST = 100_000  # switches of a system
MOST_BOXES = 50_000  # under examination at once
NARROWEST = 1e-10  # of the span, a box that is not halved: the argument touches a level there without passing it
HALVINGS = 64  # of a bracket, which is then as narrow as rounding allows
EPSILON = float(np.finfo(float).eps)

_COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE)
_TRUTHS = (*_COMPARISONS, ca.OP_NOT, ca.OP_AND, ca.OP_OR)
_TIME, _TABLE, _SIGNAL, _SWITCH = 1, 2, 4, 8  # what an expression depends on


@dataclass(frozen=True, eq=False)
class Condition:
    """An argument whose passage through zero, or through a whole number, switches an expression.

    Attributes
    ----------
    text : str
        The condition, for people.
    whole_numbers : bool
        It switches at every whole number, not at zero alone.
    straight : bool
        The argument is of first degree in time.
    function : Function
        (t, p) -> argument, its derivative with respect to time, the size of what is subtracted in it.
    by_parameters : Function
        (t, p) -> derivative of the argument with respect to the parameters, (n_p,).
    parameters : tuple of bool
        Which parameters the argument depends on.
    """

    text: str
    whole_numbers: bool
    straight: bool
    function: ca.Function
    by_parameters: ca.Function
    parameters: tuple[bool, ...]

    def at(self, times: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return argument, its rate and size at k times, (3, k)."""
        found = self.function(times[None], np.tile(p[:, None], times.size))
        return np.concatenate([value.full() for value in found])


@dataclass(frozen=True, eq=False)
class Stops:
    """Times at which integrators stop: declared discontinuities and located switches.

    What lies closer together than rounding tells apart is one stop.

    Attributes
    ----------
    times, before, after : (k,) arrays
        s, increasing; the last and first time at which the equations are evaluated on either side.
    members : tuple of (k,) tuples of (int, float)
        Number of the condition and time of each switch in a stop; none of a declared one.
    touched : (k,) array of bool
        The argument touches its level, and does not pass it once.
    """

    times: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    members: tuple[tuple[tuple[int, float], ...], ...]
    touched: NDArray[np.bool_]

    def between(self, begin: float, end: float) -> tuple[NDArray[np.intp], float, float]:
        """Return the stops inside (begin, end), ``begin`` seen from its right side and ``end`` from its left."""
        first, low, high = int(np.searchsorted(self.after, begin)), begin, end
        if first < self.times.size and self.before[first] <= begin:
            low, first = float(self.after[first]), first + 1
        last = int(np.searchsorted(self.before, end))
        if last > first and self.after[last - 1] >= end:
            last -= 1
            high = float(self.before[last])
        return np.arange(first, last), low, high


def find_conditions(
    expressions: Sequence[ca.SX],
    outputs: Sequence[ca.SX],
    time: ca.SX,
    p: ca.SX,
    tables: ca.SX,
    signals: ca.SX,
    system: str,
) -> tuple[Condition, ...]:
    """Return the conditions on time in expressions, inner ones before those that contain them.

    Parameters
    ----------
    expressions, outputs : sequences of SX
        Those that are integrated, and those that are only evaluated: a condition on a table stops no integrator there.
    time, p, tables, signals : SX
        Symbols: flight time, parameters, table values, and states, noises and inputs together.
    system : str
        Its name, for errors.

    Raises
    ------
    NonlinearSystemError
        If a condition depends on a state, noise or input.
    SwitchError
        If one that is integrated depends on a table.
    """
    depends: dict[int, int] = {}
    for symbols, what in ((time, _TIME), (p, 0), (tables, _TABLE), (signals, _SIGNAL)):
        depends |= {symbol.element_hash(): what for symbol in cast("list[ca.SX]", symbols.elements())}
    found: dict[tuple[int, bool], Condition] = {}
    for integrated, group in ((True, expressions), (False, outputs)):
        for e in _unfolded(group, depends):
            parts = [e.dep(i) for i in range(e.n_dep())]
            key = e.element_hash()
            depends[key] = 0
            for part in parts:
                depends[key] |= depends[part.element_hash()]
            for argument, size, whole in _arguments(e, parts):
                over = 0
                for symbol in ca.symvar(argument):
                    over |= depends.get(symbol.element_hash(), 0)
                if over & _SIGNAL:
                    raise NonlinearSystemError(
                        f"system '{system}': the condition '{_text(e)}' depends on a state, noise or input, which is "
                        "not linear; linearise it about the mean flight"
                    )
                if over & _TABLE and integrated:
                    raise SwitchError(
                        f"system '{system}': the condition '{_text(e)}' depends on a table, so that the times at which "
                        "it switches are not known; write it in terms of time and parameters"
                    )
                if over & _TIME and not over & _TABLE:
                    inner = any(depends[part.element_hash()] & _SWITCH for part in parts)
                    depends[key] |= _SWITCH
                    at = argument.element_hash(), whole
                    if at not in found:
                        found[at] = _condition(_text(e), argument, size, whole, inner, time, p)
    return tuple(found.values())


def _unfolded(expressions: Sequence[ca.SX], done: Mapping[int, int]) -> Iterator[ca.SX]:
    """Yield every operation in expressions that is not done, after its operands; the caller marks each as done."""
    stack = [element for expression in expressions for element in cast("list[ca.SX]", expression.nonzeros())]
    while stack:
        e = stack[-1]
        missing = [] if e.element_hash() in done else [e.dep(i) for i in range(e.n_dep())]
        missing = [part for part in missing if part.element_hash() not in done]
        if missing:
            stack += missing
            continue
        stack.pop()
        if e.element_hash() not in done:
            yield e


def _arguments(e: ca.SX, parts: list[ca.SX]) -> list[tuple[ca.SX, ca.SX, bool]]:
    """Return argument, size and whether whole numbers switch, for each way in which an operation switches."""
    operation = e.op()
    if operation in (*_COMPARISONS, ca.OP_FMIN, ca.OP_FMAX):
        return [(parts[0] - parts[1], ca.fabs(parts[0]) + ca.fabs(parts[1]), False)]
    if operation in (ca.OP_SIGN, ca.OP_FABS):
        return [(parts[0], ca.fabs(parts[0]), False)]
    if operation in (ca.OP_FLOOR, ca.OP_CEIL):
        return [(parts[0], ca.fabs(parts[0]), True)]
    if operation in (ca.OP_FMOD, ca.OP_REMAINDER):
        quotient = parts[0] / parts[1] + (0.5 if operation == ca.OP_REMAINDER else 0.0)
        return [(quotient, ca.fabs(quotient), True)]
    tested = {
        ca.OP_NOT: parts,
        ca.OP_AND: parts,
        ca.OP_OR: parts,
        ca.OP_IF_ELSE_ZERO: parts[:1],
        ca.OP_COPYSIGN: parts,
        ca.OP_ATAN2: parts[:1],  # its branch cut
    }.get(operation, [])
    return [(part, ca.fabs(part), False) for part in tested if part.is_symbolic() or part.op() not in _TRUTHS]


def _text(e: ca.SX) -> str:
    text = str(e)
    return text if len(text) <= 80 else text[:77] + "..."


def _condition(text: str, argument: ca.SX, size: ca.SX, whole: bool, inner: bool, time: ca.SX, p: ca.SX) -> Condition:
    rate = ca.densify(ca.jacobian(argument, time))
    gradient = ca.jacobian(argument, p)
    dependent = set(gradient.sparsity().get_col())
    return Condition(
        text,
        whole,
        not inner and not ca.depends_on(rate, time),
        ca.Function("condition", [time, p], [argument, rate, size]),
        ca.Function("condition_by_parameters", [time, p], [ca.densify(gradient).T]),
        tuple(i in dependent for i in range(p.numel())),
    )


@dataclass(frozen=True, eq=False)
class _Found:
    """Switches of one condition, in whatever order; attributes as those of :class:`Stops`."""

    times: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    touched: NDArray[np.bool_]


def locate(
    conditions: Sequence[Condition],
    declared: Sequence[float],
    parameters: NDArray[np.float64],
    start: float,
    end: float,
    system: str,
) -> Stops:
    """Return the declared discontinuities and the switches of all conditions between ``start`` and ``end``, s.

    Raises
    ------
    SwitchError
        If a condition cannot be located; it says which and why.
    """
    jumps = np.array(declared, float)
    apart = np.array([rounding(jump, start) for jump in declared], float)
    found: list[tuple[int, _Found]] = [(-1, _Found(jumps, jumps - apart, jumps + apart, np.zeros(jumps.size, bool)))]
    for number, condition in enumerate(conditions):
        search = _Search(condition, parameters, start, end, f"system '{system}': the condition '{condition.text}'")
        if condition.straight:
            found.append((number, search.straight()))
        else:
            stops = _merged(found)
            inside, first, last = stops.between(start, end)
            low = np.concatenate([[first], stops.after[inside]])
            high = np.concatenate([stops.before[inside], [last]])
            found += [(number, part) for part in search.boxes(low, high)]
        if sum(part.times.size for _, part in found) > MOST:
            search.refuse(f"switches more than {MOST} times between {start:g} s and {end:g} s; write its average")
    return _merged(found)


class _Search:
    """Looks for the switches of one condition for given parameters."""

    def __init__(self, condition: Condition, parameters: NDArray, start: float, end: float, name: str):
        self.condition, self.parameters, self.start, self.end, self.name = condition, parameters, start, end, name

    def refuse(self, why: str) -> None:
        raise SwitchError(f"{self.name} {why}")

    def straight(self) -> _Found:
        """Return the switches of an argument that is straight in time."""
        ends = self.condition.at(np.array([self.start, self.end]), self.parameters)
        if not np.isfinite(ends[:2]).all():
            self.refuse(f"is not finite at {self.start:g} s or {self.end:g} s; see what divides by zero there")
        (offset,), (rate,), _ = self.condition.at(np.zeros(1), self.parameters)
        if rate == 0:
            nowhere = np.zeros(0)
            return _Found(nowhere, nowhere, nowhere, np.zeros(0, bool))
        levels = np.zeros(1)
        if self.condition.whole_numbers:
            first, last = np.floor(ends[0].min()), np.ceil(ends[0].max())
            if last - first > MOST:
                self.refuse(
                    f"switches {last - first:.0f} times between {self.start:g} s and {self.end:g} s, more than {MOST}; "
                    "write its average"
                )
            levels = np.arange(first, last + 1)
        found = self._with_margins((levels - offset) / rate)
        near = (found.after >= self.start) & (found.before <= self.end)
        return _Found(found.times[near], found.before[near], found.after[near], found.touched[near])

    def boxes(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> list[_Found]:
        """Return the switches inside pieces [low, high], in each of which the argument is smooth."""
        narrowest = NARROWEST * (self.end - self.start)
        brackets, touched = [], []
        low, high = low[high > low], high[high > low]
        while low.size:
            if low.size > MOST_BOXES:
                self.refuse(
                    f"cannot be located: near {np.median(low):g} s it neither holds nor fails over a stretch of time; "
                    "write it so that its two sides differ except where it switches, or leave it out"
                )
            fixed = [[(np.full(low.size, value), np.full(low.size, value)) for value in self.parameters]]
            (argument,), (rate,), _ = bounds(self.condition.function, [[(low, high)], *fixed])
            passes = self._passes(*argument)
            once = passes & ((rate[0] > 0) | (rate[1] < 0)) & np.isfinite(argument[0]) & np.isfinite(argument[1])
            brackets.append((low[once], high[once]))
            rest = passes & ~once
            small = rest & (high - low <= narrowest)
            touched.append((low[small], high[small]))
            low, high = low[rest & ~small], high[rest & ~small]
            middle = 0.5 * (low + high)
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        a, b = (np.concatenate([pair[side] for pair in brackets]) for side in (0, 1)) if brackets else [np.zeros(0)] * 2
        at_low, at_high = (np.concatenate([pair[side] for pair in touched] or [np.zeros(0)]) for side in (0, 1))
        return [
            self._with_margins(self._bisect(a, b)),
            _Found(0.5 * (at_low + at_high), at_low - narrowest, at_high + narrowest, np.ones(at_low.size, bool)),
        ]

    def _passes(self, low: NDArray, high: NDArray) -> NDArray[np.bool_]:
        """Tell in which boxes an argument within [low, high] may reach a level; a constant one passes none."""
        if self.condition.whole_numbers:
            return (np.ceil(low) <= high) & (low < high)
        return (low <= 0) & (high >= 0) & (low < high)

    def _bisect(self, low: NDArray, high: NDArray) -> NDArray[np.float64]:
        """Return the times in [low, high], over which the argument is monotone, at which it passes its levels."""
        if not low.size:
            return low
        first, last = self.condition.at(low, self.parameters)[0], self.condition.at(high, self.parameters)[0]
        levels = np.zeros(low.size)
        if self.condition.whole_numbers:
            lowest, highest = np.ceil(np.minimum(first, last)), np.floor(np.maximum(first, last))
            count = np.maximum(0, highest - lowest + 1).astype(int)
            if count.sum() > MOST:
                self.refuse(f"switches more than {MOST} times between {self.start:g} s and {self.end:g} s")
            within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            low, high, first, last = (np.repeat(part, count) for part in (low, high, first, last))
            levels = np.repeat(lowest, count) + within
        inside = (np.minimum(first, last) <= levels) & (levels <= np.maximum(first, last))
        low, high, levels, rises = low[inside], high[inside], levels[inside], (last > first)[inside]
        for _ in range(HALVINGS if low.size else 0):
            middle = 0.5 * (low + high)
            beyond = (self.condition.at(middle, self.parameters)[0] >= levels) == rises
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return high

    def _with_margins(self, times: NDArray) -> _Found:
        if not times.size:
            return _Found(times, times, times, np.zeros(0, bool))
        _, rate, size = self.condition.at(times, self.parameters)
        if self.condition.whole_numbers:
            size = np.maximum(size, 1.0)
        span = self.end - self.start
        margin = ROUNDINGS * EPSILON * np.maximum(np.abs(times), size / np.maximum(np.abs(rate), 1e-300))
        around = [self.condition.at(times + side * np.minimum(margin, span), self.parameters)[1] for side in (-1, 1)]
        touched = ~((around[0] * rate > 0) & (around[1] * rate > 0))  # to rounding it may as well not pass the level
        margin = np.clip(margin, EPSILON * span, NARROWEST * span)
        return _Found(times, times - margin, times + margin, touched)


def _merged(found: Sequence[tuple[int, _Found]]) -> Stops:
    """Join switches that overlap; the time of a stop is a declared one or, without any, the first."""
    times, before, after, touched = (
        np.concatenate([getattr(f, name) for _, f in found]) for name in ("times", "before", "after", "touched")
    )
    numbers = np.concatenate([np.full(f.times.size, number) for number, f in found])
    order = np.lexsort((numbers >= 0, before))
    times, before, after, numbers, touched = (a[order] for a in (times, before, after, numbers, touched))
    if not times.size:
        return Stops(times, before, after, (), touched)
    reach = np.maximum.accumulate(after)
    first = np.flatnonzero(np.concatenate([[True], before[1:] > reach[:-1]]))
    groups = [range(a, b) for a, b in pairwise([*first.tolist(), times.size])]
    chosen = [next((i for i in group if numbers[i] < 0), group[0]) for group in groups]
    members = tuple(tuple((int(numbers[i]), float(times[i])) for i in group if numbers[i] >= 0) for group in groups)
    reduced = np.minimum.reduceat(before, first), np.maximum.reduceat(after, first)
    return Stops(times[chosen], *reduced, members, np.logical_or.reduceat(touched, first))
