"""The whole derivative of a combination of variance and mean: within the equations, and by the switches that move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..solvers.start_functions import start_functions
from .pair import AdjointPair
from .switches import through_switches


@dataclass(frozen=True, eq=False)
class Gradient:
    """A number and its derivatives.

    Attributes
    ----------
    value : float
    parameters : (n_p,) array
    tables : (k, n_v) array
        Derivative with respect to a table's value at a node, per second.
    tables_at_end : (n_v,) array
        Weight of the delta that the latter holds at t = t2.
    undefined : dict of int to str
        Parameters by which there is no derivative, because of a switch that they move, and why.
    reach : dict of int to float
        Parameters that move a switch, and how far before it meets another, the start or t2.
    """

    value: float
    parameters: NDArray[np.float64]
    tables: NDArray[np.float64]
    tables_at_end: NDArray[np.float64]
    undefined: Mapping[int, str] = field(default_factory=dict)
    reach: Mapping[int, float] = field(default_factory=dict)


def gradient_of(pair: AdjointPair, variance_factor: float, mean_factor: float, at_peak: bool = False) -> Gradient:
    """Return the derivatives of ``variance_factor`` variance + ``mean_factor`` mean.

    ``at_peak`` says that t2 is where it is largest: on a switch that moves, the peak moves along.
    """
    p, found = pair.executable.parameters, pair.combine(variance_factor, mean_factor)
    parameters = pair.flight.functions.by_parameters(p, found.numbers)
    if variance_factor:
        by_start = start_functions(pair.executable.system, pair.sources)[1](p, pair.adjoint_at_start)
        parameters = parameters + variance_factor * np.array(by_start, float).ravel()
    by_switches = through_switches(pair, variance_factor, mean_factor, at_peak)
    parameters = parameters + by_switches.parameters
    value = variance_factor * pair.variance + mean_factor * pair.mean
    return Gradient(value, parameters, found.tables, found.tables_at_end, by_switches.undefined, by_switches.reach)
