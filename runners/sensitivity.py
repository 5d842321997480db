"""Sensitivities: which parameter, which second of which table and which kilometre of wind drives a response."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import xarray as xr

from ..codegen.node_functions import node_functions
from ..model.errors import AscentwindError, AscentwindWarning, SwitchError, TimeRangeError, UnknownNameError
from ..model.system import LinearSystem
from .flight_nodes import FlightNodes
from .larger_side import LARGER_SIDE, larger_side, sign
from .sensitivity_gradient import AdjointPair, Gradient
from .sensitivity_peak import peak_time
from .sensitivity_tables import Parts, table_sensitivities, total_density
from .stability import warn_if_unstable
from .start_covariance import start_share
from .statistics import COMBINED, provenance
from .table_knots import knot_sensitivities
from .times import seconds

if TYPE_CHECKING:
    from .study import Study

QUANTITIES: tuple[str, ...] = (LARGER_SIDE, "std", "variance", "mean", "mean_plus_3sigma")
STRUCTURAL = re.compile(
    r"^(options|events)\.|(count|number|order|synthesis|modes?|tanks?|masses|sources?|states?|loads?|outputs?)$"
)


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


class UndefinedElasticityWarning(AscentwindWarning):
    """Parameters that are zero have a derivative but no elasticity."""


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
    def of(study: Study, response: str, source: str, quantity: str) -> Request:
        """Check names.

        Raises
        ------
        UnknownNameError, DirectNoiseError
        """
        (response,) = study._responses([response])
        system = study.system
        if source not in (*system.sources, COMBINED):
            raise UnknownNameError("noise source", source, (*system.sources, COMBINED))
        if quantity not in QUANTITIES:
            raise UnknownNameError("quantity", quantity, QUANTITIES)
        sources = system.sources if source == COMBINED else (source,)
        return Request(response, source, quantity, system.output_index(response), sources)

    def pair(self, study: Study, time: float) -> AdjointPair:
        functions = node_functions(study.system, study.executable.shared_library is not None)
        flight = FlightNodes.until(study.with_means, functions, [time])
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


def sensitivity(
    study: Study,
    response: str,
    time: float | Literal["peak"],
    source: str = COMBINED,
    quantity: str = "std",
    parameters: Iterable[str] | None = None,
    elasticity: bool = True,
) -> xr.Dataset:
    """See :meth:`Study.sensitivity`."""
    request = Request.of(study, response, source, quantity)
    rows = parameter_rows(study.system, parameters)
    at_peak = isinstance(time, str)
    time, at_limit = end_time(study, request, time)
    warn_if_unstable(study.executable, time)
    pair = request.pair(study, time)
    factors = request.factors(pair)
    gradient = pair.gradient(*factors, at_peak=at_peak and not at_limit)
    refuse_undefined(study.system, gradient, rows)
    value = request.value(pair.variance, pair.mean)
    if elasticity and value == 0:
        raise ZeroQuantityError(
            f"the {quantity} of '{response}' from '{source}' is zero at {time:g} s, so that a derivative in percent is "
            "not defined; pass elasticity=False for derivatives alone"
        )
    relative_to = value if elasticity else None
    variables, coordinates = _parameter_sensitivities(study, gradient, rows, relative_to)
    if any(g.name != "mean" for g in study.system.tables):
        total = total_density(study.with_means.groups, pair, gradient)
        start = start_share(study.vehicle, pair, factors[0]) if factors[0] else None
        for more in (table_sensitivities, knot_sensitivities):
            parts = more(study, pair, total, start, relative_to)
            variables, coordinates = variables | parts[0], coordinates | parts[1]
    dataset = xr.Dataset(variables, coordinates)
    dataset.attrs = provenance(study) | {
        "response": response,
        "response_unit": study.system.outputs[request.row].unit,
        "source": source,
        "quantity": quantity,
        "t2_s": time,
        "value": value,
        "variance": pair.variance,
        "mean": pair.mean,
        "at_peak": int(at_peak),
        "peak_at_end_of_range": int(at_limit),
        "engine": "collocation, Gauss-Legendre of order 8",
        "steps": pair.steps,
    }
    return dataset


def end_time(study: Study, request: Request, time: float | str) -> tuple[float, bool]:
    """Return an end time, s, that of the peak for 'peak', and whether that is an end of the range searched.

    Raises
    ------
    TimeRangeError
    """
    if isinstance(time, str):
        if time != "peak":
            raise TimeRangeError(f"'{time}' is not a time; give seconds or 'peak'")
        time, at_limit = peak_time(study, request)
    else:
        time, at_limit = seconds(time), False
    study._check_times([time])
    check_end_time(study, time)
    return time, at_limit


def check_end_time(study: Study, time: float) -> None:
    """Refuse the start of a system.

    Raises
    ------
    TimeRangeError
    """
    if time <= study.system.start:
        raise TimeRangeError(f"at its start, {time:g} s, a system has no history to differentiate; choose a later time")


def parameter_rows(system: LinearSystem, wanted: Iterable[str] | None) -> list[int]:
    """Return the numbers of parameters by name, all without names.

    Raises
    ------
    UnknownNameError, StructuralParameterError
    """
    names = system.parameter_names
    if wanted is None:
        return list(range(len(names)))
    rows = []
    for name in dict.fromkeys([wanted] if isinstance(wanted, str) else wanted):
        if name not in names:
            if name in system.structure or STRUCTURAL.search(name):
                raise StructuralParameterError(name)
            if any(name in group.names for group in system.tables):
                raise TableParameterError(name)
            raise UnknownNameError("parameter", name, names)
        rows.append(names.index(name))
    return rows


def refuse_undefined(system: LinearSystem, gradient: Gradient, rows: Iterable[int]) -> None:
    """Refuse parameters by which there is no derivative, because of a switch that they move.

    Raises
    ------
    SwitchError
    """
    for i in rows:
        if i in gradient.undefined:
            raise SwitchError(
                f"there is no derivative with respect to '{system.parameter_names[i]}': {gradient.undefined[i]}; "
                "name the parameters without it"
            )


def _parameter_sensitivities(study: Study, gradient: Gradient, rows: list[int], value: float | None) -> Parts:
    parameters = [study.system.parameters[i] for i in rows]
    numbers, derivative = study.executable.parameters[rows], gradient.parameters[rows]
    label = {"long_name": "derivative, response unit per parameter unit"}
    variables: dict[str, tuple] = {
        "parameter_value": ("parameter", numbers, {"long_name": "present value"}),
        "derivative": ("parameter", derivative, label),
    }
    if value is not None:
        zero = numbers == 0
        if zero.any():
            listed = ", ".join(p.name for p, is_zero in zip(parameters, zero, strict=True) if is_zero)
            warnings.warn(
                UndefinedElasticityWarning(
                    f"{listed}: zero, so that a change in percent is none; see the derivative instead"
                ),
                stacklevel=4,
            )
        label = {"units": "1", "long_name": "percent of the quantity per percent of the parameter"}
        variables["elasticity"] = ("parameter", derivative * numbers / value, label)
        variables["elasticity_defined"] = ("parameter", (~zero).astype(np.int8))
    return variables, {
        "parameter": [p.name for p in parameters],
        "parameter_unit": ("parameter", [p.unit for p in parameters]),
        "description": ("parameter", [p.description for p in parameters]),
    }
