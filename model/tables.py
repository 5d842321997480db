"""Tables over flight time or altitude as piecewise cubic polynomials, evaluated together in one lookup.

A table group holds all tables that share one argument. Their polynomials are written on the union of their
knots, so that one search and one Horner scheme give all of them. Knots and coefficients are run-time numbers:
changing a table value needs no new code, only the number of knots and tables is structure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import DataError
from .polynomials import PiecewisePolynomial, monotone_cubics, not_a_knot_spline, straight_lines

ORDER = 4  # coefficients of a cubic
Kind = Literal["given", "mean"]  # of a group of tables
MeanKind = Literal["output", "state"]
INTERPOLATIONS = ("cubic", "pchip", "linear", "step")


@dataclass(frozen=True, repr=False)
class Table:
    """One quantity over one argument.

    Parameters
    ----------
    name, unit : str
    argument : (n,) array
        Increasing sample points.
    values : (n,) array
    interpolation : {'cubic', 'pchip', 'linear', 'step'}
        Not-a-knot cubic spline, monotone cubic, straight lines, or the value of the row above.
    breaks : sequence of float
        Arguments at which the quantity may jump. Rows on either side are interpolated separately and carried on
        to the break by their own polynomial; a row exactly at a break belongs to both sides.
    """

    name: str
    unit: str
    argument: NDArray[np.float64]
    values: NDArray[np.float64]
    interpolation: str = "cubic"
    breaks: tuple[float, ...] = ()

    def __repr__(self) -> str:
        first, *_, last = self.argument
        return f"Table '{self.name}' [{self.unit}]: {self.argument.size} rows, {first:g} to {last:g}"

    def __post_init__(self):
        x, y = np.asarray(self.argument, float), np.asarray(self.values, float)
        object.__setattr__(self, "argument", x)
        object.__setattr__(self, "values", y)
        if x.ndim != 1 or x.shape != y.shape or x.size < 2:
            raise DataError(f"table '{self.name}' needs at least two rows of argument and value")
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            raise DataError(f"table '{self.name}' holds a value that is not finite")
        if not (np.diff(x) > 0).all():
            row = int(np.argmin(np.diff(x) > 0))
            raise DataError(f"table '{self.name}' is not increasing after argument {x[row]:g}")
        if self.interpolation not in INTERPOLATIONS:
            raise DataError(f"interpolation '{self.interpolation}' is not one of {', '.join(INTERPOLATIONS)}")

    @cached_property
    def polynomial(self) -> PiecewisePolynomial:
        """The table as a piecewise cubic, extended to the breaks inside its range."""
        x, y = self.argument, self.values
        if self.interpolation == "step":
            return PiecewisePolynomial(np.vstack([np.zeros((ORDER - 1, y.size)), y]), np.append(x, x[-1] + 1.0))
        inner = [b for b in sorted(set(self.breaks)) if x[0] < b < x[-1]]
        edges = [x[0], *inner, x[-1]]
        knots, coefficients = [], []
        for low, high in pairwise(edges):
            inside = (x >= low) & (x <= high)
            if inside.sum() < 2:
                raise DataError(f"table '{self.name}' has too few rows between {low:g} and {high:g} to interpolate")
            piece = self._piece(x[inside], y[inside])
            points = np.unique(np.concatenate([[low], piece.x[(piece.x > low) & (piece.x < high)]]))
            knots.append(points)
            coefficients.append(taylor_coefficients(piece, points, points))
        return PiecewisePolynomial(np.concatenate(coefficients, axis=1), np.append(np.concatenate(knots), x[-1]))

    def _piece(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> PiecewisePolynomial:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            try:
                piece = _interpolate(x, y, self.interpolation)
                finite = np.isfinite(piece.c).all()
            except ZeroDivisionError:  # of what underflows on its way
                piece, finite = None, False
        if piece is None or not finite:
            raise DataError(
                f"table '{self.name}' cannot be interpolated between {x[0]:g} and {x[-1]:g}: with values up to "
                f"{np.abs(y).max():g} it leaves the range of numbers; correct them"
            )
        return piece


def _interpolate(x: NDArray, y: NDArray, interpolation: str) -> PiecewisePolynomial:
    if interpolation == "linear" or x.size == 2:
        return straight_lines(x, y)
    return monotone_cubics(x, y) if interpolation == "pchip" else not_a_knot_spline(x, y)


def taylor_coefficients(polynomial: PiecewisePolynomial, points: ArrayLike, inside: ArrayLike) -> NDArray:
    """Expand a piecewise polynomial about ``points``, using the piece that holds ``inside``.

    Returns
    -------
    (4, n) array
        Highest power first, as piecewise polynomials have them.
    """
    points, inside = np.asarray(points, float), np.asarray(inside, float)
    piece = np.clip(np.searchsorted(polynomial.x, inside, side="right") - 1, 0, polynomial.c.shape[1] - 1)
    c = np.zeros((ORDER, points.size))
    c[ORDER - polynomial.c.shape[0] :] = polynomial.c[:, piece]
    u = points - polynomial.x[piece]
    c3, c2, c1, c0 = c
    return np.array([c3, c2 + 3 * c3 * u, c1 + u * (2 * c2 + 3 * c3 * u), c0 + u * (c1 + u * (c2 + u * c3))])


@dataclass(frozen=True, eq=False)
class TableGroup:
    """All tables over one argument, on common knots.

    Parameters
    ----------
    name : str
    argument : str
        'time', or the name of a table in an earlier group whose value is the argument here (altitude).
    names, units : (m,) tuples of str
    knots : (k,) array
        Beyond the first and last knot the value there is held.
    coefficients : (k - 1, 4, m) array
        Interval, power 0 to 3 of (argument - left knot), table.
    kind : {'given', 'mean'}
        Numbers of a vehicle and its wind, or the mean response, which follows from them and is zero until computed.
    sources : (m,) tuple of pairs
        Of the mean response: 'output' or 'state', and the name of the one that each table holds.
    """

    name: str
    argument: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    knots: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    kind: Kind = "given"
    sources: tuple[tuple[MeanKind, str], ...] = ()

    def __post_init__(self):
        k, m = self.knots.size, len(self.names)
        if self.coefficients.shape != (k - 1, ORDER, m) or len(self.units) != m:
            raise DataError(f"table group '{self.name}': coefficients do not match {k} knots and {m} tables")
        if len(self.sources) != (m if self.kind == "mean" else 0):
            raise DataError(f"table group '{self.name}': a table of the mean response, and no other, has its source")

    @staticmethod
    def from_polynomials(
        name: str, argument: str, polynomials: Sequence[tuple[str, str, PiecewisePolynomial]], start: float, end: float
    ) -> TableGroup:
        """Merge (name, unit, polynomial) onto the union of the knots between ``start`` and ``end``.

        A polynomial that covers less than the union is held at its own first and last value.
        """
        inner = np.concatenate([p.x for _, _, p in polynomials])
        knots = np.unique(np.concatenate([[start], inner[(inner > start) & (inner < end)], [end]]))
        keep = np.concatenate([[True], np.diff(knots) > 1e-9 * max(1.0, abs(end))])
        knots = knots[keep]
        return TableGroup(
            name,
            argument,
            tuple(n for n, _, _ in polynomials),
            tuple(u for _, u, _ in polynomials),
            knots,
            np.stack([_column(p, knots) for _, _, p in polynomials], axis=2),
        )

    def with_polynomials(self, polynomials: Mapping[str, PiecewisePolynomial]) -> TableGroup:
        """Return the group with some of its tables replaced on its own knots, which hold theirs; others pass over."""
        coefficients = self.coefficients.copy()
        for name in polynomials.keys() & set(self.names):
            coefficients[:, :, self.names.index(name)] = _column(polynomials[name], self.knots)
        return replace(self, coefficients=coefficients)

    def scaled(self, factors: Mapping[str, float]) -> TableGroup:
        """Return the group with some of its tables multiplied; names of other groups' tables are passed over."""
        if not factors.keys() & set(self.names):
            return self
        return replace(self, coefficients=self.coefficients * np.array([factors.get(name, 1.0) for name in self.names]))

    @property
    def size(self) -> int:
        """Length of the run-time vector: knots, then coefficients in storage order."""
        return self.knots.size + self.coefficients.size

    def run_time_vector(self) -> NDArray[np.float64]:
        """Return knots and coefficients as the generated code expects them, shape (size,)."""
        return np.concatenate([self.knots, self.coefficients.ravel()])

    def evaluate(self, argument: ArrayLike) -> NDArray[np.float64]:
        """Return all table values, shape (..., m)."""
        x = np.clip(np.asarray(argument, float), self.knots[0], self.knots[-1])
        i = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, self.knots.size - 2)
        u, c = (x - self.knots[i])[..., None], self.coefficients
        found = np.array(c[i, ORDER - 1])
        for power in reversed(range(ORDER - 1)):
            found *= u
            found += c[i, power]
        return found


def table_values(groups: Sequence[TableGroup], time: float) -> dict[str, float]:
    """Return every table value at a time (s), by name."""
    found: dict[str, float] = {}
    for group in groups:
        argument = time if group.argument == "time" else found[group.argument]
        found.update(zip(group.names, group.evaluate(argument).tolist(), strict=True))
    return found


def run_time_vector(groups: Sequence[TableGroup]) -> NDArray[np.float64]:
    """Return all groups as one run-time vector."""
    return np.concatenate([np.zeros(0), *(g.run_time_vector() for g in groups)])


def _column(polynomial: PiecewisePolynomial, knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a polynomial's coefficients on knots that hold its own, (k - 1, 4), held beyond its ends."""
    middle = 0.5 * (knots[:-1] + knots[1:])
    column = taylor_coefficients(polynomial, knots[:-1], middle)[::-1].T
    first, last = polynomial.x[0], polynomial.x[-1]
    for outside, end in ((middle < first, first), (middle > last, last)):
        column[outside] = [float(polynomial(end)), 0.0, 0.0, 0.0]
    return column
