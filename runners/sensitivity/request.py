"""What a sensitivity is asked for, checked: response, source, quantity, parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...codegen.nodes.compiled import node_functions_of
from ...model.errors import AscentwindError, UnknownNameError
from ...model.system.names import COMBINED
from ...model.vehicle.grouped_factors import grouped_factors
from ...model.vehicle.structural_keys import structural_keys
from ..case.case import Case
from ..solvers.flight_nodes import FlightNodes
from ..statistics.larger_side import LARGER_SIDE, larger_side, sign
from .pair import AdjointPair

QUANTITIES: tuple[str, ...] = (LARGER_SIDE, "std", "variance", "mean", "mean_plus_3sigma")


class ZeroQuantityError(AscentwindError):
    """A derivative or elasticity was asked for of a quantity that is zero, where it is not defined."""


class NotAParameterError(UnknownNameError):
    """A derivative was asked for with respect to something known that is not one number."""

    why = ""

    def __init__(self, name: str):
        self.kind, self.name, self.known = "parameter", name, ()
        Exception.__init__(self, f"'{name}' is {self.why}")


class StructuralParameterError(NotAParameterError):
    """A derivative was asked for with respect to something that changes the equations, not a number in them."""

    why = (
        "structure, not a number: another value makes other equations, which have no derivative; "
        "edit the vehicle file and compare the two vehicles"
    )


class TableParameterError(NotAParameterError):
    """A derivative by a parameter was asked for with the name of a table, which is many numbers."""

    why = (
        "a table, not a parameter: every sensitivity has its derivatives over time (table_derivative), by rows "
        "(knot_derivative) and as a whole (table_elasticity); leave it out"
    )


class GroupedFactorError(NotAParameterError):
    """A derivative by a parameter was asked for with the name of a grouped factor, which is on several tables."""

    why = (
        "a factor on several tables, not a parameter: every sensitivity has its derivative "
        "(grouped_factor_derivative, grouped_factor_elasticity); leave it out"
    )


@dataclass(frozen=True)
class Request:
    """What a sensitivity is asked of.

    Parameters
    ----------
    response, source, quantity : str
    row : int
        Of the response in C.
    sources : tuple of str
        Those that ``source`` stands for.
    """

    response: str
    source: str
    quantity: str
    row: int
    sources: tuple[str, ...]

    @staticmethod
    def of(case: Case, response: str, source: str, quantity: str) -> Request:
        """Check names.

        Raises
        ------
        UnknownNameError, DirectNoiseError
        """
        (response,) = case.checked_responses([response])
        system = case.system
        if source not in (*system.sources, COMBINED):
            raise UnknownNameError("noise source", source, (*system.sources, COMBINED))
        if quantity not in QUANTITIES:
            raise UnknownNameError("quantity", quantity, QUANTITIES)
        sources = system.sources if source == COMBINED else (source,)
        return Request(response, source, quantity, system.output_index(response), sources)

    def pair(self, case: Case, time: float) -> AdjointPair:
        functions = node_functions_of(case.executable)
        flight = FlightNodes.until(case.with_means, functions, [time])
        return AdjointPair(flight, self.row, time, self.sources)

    def factors(self, pair: AdjointPair) -> tuple[float, float]:
        """Return dQ/dVar and dQ/dmean.

        Raises
        ------
        ZeroQuantityError
            Where the variance is zero and the quantity holds its root.
        """
        if self.quantity in ("variance", "mean"):
            return (1.0, 0.0) if self.quantity == "variance" else (0.0, 1.0)
        if not pair.variance > 0:
            raise ZeroQuantityError(
                f"the variance of '{self.response}' from '{self.source}' is zero at {pair.time:g} s, where its root "
                "has no derivative; ask for quantity 'variance', or for a source with a sigma above zero"
            )
        root = 0.5 / np.sqrt(pair.variance)
        if self.quantity == "std":
            return root, 0.0
        return 3 * root, sign(pair.mean) if self.quantity == LARGER_SIDE else 1.0

    def curvature(self, pair: AdjointPair) -> float:
        """Return d2Q/dVar2."""
        if self.quantity in ("variance", "mean"):
            return 0.0
        return (1 if self.quantity == "std" else 3) * -0.25 * pair.variance**-1.5

    def value(self, variance: float, mean: float) -> float:
        """Return the quantity."""
        std = float(np.sqrt(max(variance, 0.0)))
        return {
            LARGER_SIDE: float(larger_side(mean, std)),
            "std": std,
            "variance": variance,
            "mean": mean,
            "mean_plus_3sigma": mean + 3 * std,
        }[self.quantity]

    def sought(self, variance: float, mean: float) -> float:
        """Return what is largest at the peak: the quantity, of the mean its size."""
        return abs(mean) if self.quantity == "mean" else self.value(variance, mean)


def is_structure(case: Case, name: str) -> bool:
    """Return whether a name is a part of a system's structure, or a key of its vehicle's file that changes it."""
    of_vehicle = structural_keys(case.vehicle.file) if case.vehicle is not None else ()
    return name in case.system.structure or name in of_vehicle


def parameter_rows(case: Case, wanted: Iterable[str] | None) -> list[int]:
    """Return the numbers of parameters by name, all without names.

    Raises
    ------
    UnknownNameError, StructuralParameterError
    """
    system, names = case.system, case.system.parameter_names
    if wanted is None:
        return list(range(len(names)))
    rows = []
    for name in dict.fromkeys([wanted] if isinstance(wanted, str) else wanted):
        if name not in names:
            if is_structure(case, name):
                raise StructuralParameterError(name)
            if case.vehicle is not None and name in grouped_factors(case.vehicle.tables):
                raise GroupedFactorError(name)
            if any(name in group.names for group in system.tables):
                raise TableParameterError(name)
            raise UnknownNameError("parameter", name, names)
        rows.append(names.index(name))
    return rows
