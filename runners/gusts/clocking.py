"""Gusts from any direction: what they do to a response, or to a resultant of both planes, at worst.

A gust of W m/s that blows towards chi, from north towards east, is (W sin chi, W cos chi) in u and v. Responses that
answer to u and v by the rows of J answer to it by J d, d = (sin chi, cos chi), whose norm is largest where d is the
first right singular vector of J, and then J's largest singular value: of one row (a, b), its length. In one plane there
is one wind, and J a number with a sign.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.errors import ParameterValueError, UnknownNameError
from ..case.case import Case
from ..statistics.resultants import labels_of, outputs_of, response_or_resultant, resultant_pairs

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Quantities:
    """Responses, and in both planes resultants too, by the outputs that they are made of.

    Attributes
    ----------
    names, units : tuple of str
    outputs : tuple of str
        All that are needed, each once.
    members : tuple of tuple of int
        Which of them make each quantity.
    winds : int
        One, or two components.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    outputs: tuple[str, ...]
    members: tuple[tuple[int, ...], ...]
    winds: int

    @classmethod
    def of(cls, case: Case, names: Iterable[str]) -> Quantities:
        """Return quantities by name, which :func:`checked_quantities` knows."""
        names = tuple(names)
        parts = [outputs_of(case, name) for name in names]
        outputs = tuple(dict.fromkeys(output for part in parts for output in part))
        units = tuple(labels_of(case, name)[0].unit for name in names)
        members = tuple(tuple(outputs.index(output) for output in part) for part in parts)
        return cls(names, units, outputs, members, len(case.wind_inputs("a gust")))

    def rows(self, found: Array, quantity: int) -> Array:
        """Return J of one of the quantities of products (..., outputs x winds): (..., rows, winds)."""
        whole = found.reshape(*found.shape[:-1], len(self.outputs), self.winds)
        return whole[..., list(self.members[quantity]), :]

    def sizes(self, found: Array) -> Array:
        """Return the largest of all directions of products (..., outputs x winds): (..., quantities)."""
        return np.stack([largest(self.rows(found, k)) for k in range(len(self.names))], axis=-1)

    def directions(self, found: Array) -> Array:
        """Return where a gust blows that is worst, rad, likewise."""
        return np.stack([worst_direction(self.rows(found, k)) for k in range(len(self.names))], axis=-1)

    def towards(self, found: Array, direction: float | None) -> Array:
        """Return what a gust in one direction (rad) does, likewise; of a resultant the norm."""
        parts = [towards(self.rows(found, k), direction) for k in range(len(self.names))]
        return np.stack([x[..., 0] if x.shape[-1] == 1 else np.linalg.norm(x, axis=-1) for x in parts], axis=-1)


def largest(rows: Array) -> Array:
    """Return the largest singular value of each J (..., rows, winds); of one wind the number itself."""
    if rows.shape[-1] == 1:
        return rows[..., 0, 0]
    sums, crossed = _moments(rows)
    return np.sqrt(0.5 * (sums.sum(axis=-1) + np.hypot(sums[..., 0] - sums[..., 1], 2 * crossed)))


def worst_direction(rows: Array) -> Array:
    """Return where a gust blows (rad, from north towards east) in which J (..., rows, 2) makes the most.

    A single row it makes positive; of two either side is as bad, and that towards the east is returned.
    """
    if rows.shape[-2] == 1:
        return np.arctan2(rows[..., 0, 0], rows[..., 0, 1])
    sums, crossed = _moments(rows)
    return 0.5 * np.arctan2(2 * crossed, sums[..., 1] - sums[..., 0]) % np.pi


def towards(rows: Array, direction: float | None) -> Array:
    """Return J d of a gust that blows in a direction (rad), (..., rows); of one wind, which has none, J itself."""
    return rows[..., 0] if direction is None else rows @ np.array([np.sin(direction), np.cos(direction)])


def _moments(rows: Array) -> tuple[Array, Array]:
    """Return the diagonal (..., 2) and the other element (...) of J' J."""
    return (rows**2).sum(axis=-2), (rows[..., 0] * rows[..., 1]).sum(axis=-1)


def checked_quantities(case: Case, responses: Iterable[str] | None) -> list[str]:
    """Return names of responses, and of resultants in both planes, each once; all for None.

    White noise that reaches a response directly does not matter here.

    Raises
    ------
    UnknownNameError, ParameterValueError, PlanesError
    """
    if isinstance(responses, str):
        responses = [responses]
    known = case.system.output_names
    pairs = resultant_pairs(known)
    if responses is None:
        same = [name for name in pairs if len({label.unit for label in labels_of(case, name)}) == 1]
        return [*known, *same]
    names = list(dict.fromkeys(responses))
    if not names:
        raise ParameterValueError("no response was given; name some, or leave them out for all")
    for name in names:
        if not isinstance(name, str):
            raise UnknownNameError("response", f"{name!r:.60}", known)
        if name not in known:
            response_or_resultant(case, name)
    return names


def checked_direction(case: Case, direction: float | None) -> float | None:
    """Return the direction of a gust, which a vehicle in both planes needs and one in a single plane has none of.

    Raises
    ------
    ParameterValueError
    """
    both = len(case.wind_inputs("a gust")) > 1
    if direction is None:
        if both:
            raise ParameterValueError(
                "in both planes a gust blows in some direction: give it in rad, from north towards east, or let "
                "gust_sweep find the worst"
            )
        return None
    if isinstance(direction, bool) or not isinstance(direction, int | float) or not abs(direction) < 1e300:
        raise ParameterValueError(f"a gust cannot blow towards {direction!r:.60}; give rad, from north towards east")
    if not both:
        raise ParameterValueError("in one plane a gust has no direction but its sign; leave the direction out")
    if abs(direction) > 2 * np.pi:
        raise ParameterValueError(
            f"a gust towards {direction:g} rad is turned by more than a circle; are these degrees? Convert them to rad"
        )
    return float(direction)
