"""A load-relief design as a question: which numbers may change, what is to be small, and what must hold."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...model.errors import AscentwindError, ParameterValueError, TimeRangeError, UnknownNameError
from ..solvers.frozen_roots import root_families
from ..statistics.resultants import response_or_resultant

if TYPE_CHECKING:
    from ..study import Study


class DesignProblemError(AscentwindError):
    """A design was asked for that makes no sense."""


@dataclass(frozen=True, eq=False)
class LoadReliefProblem:
    """Minimise the peak of |mean| + 3 sigma of a response by changing parameters, under limits.

    Parameters
    ----------
    study : Study
        Holds the starting values.
    parameters : mapping of str to (low, high)
        Parameters that may change, and their bounds.
    times : sequence of float
        End times t2, s; a peak is the largest value over them.
    response : str
        Whose peak is minimised; of a resultant of both planes the largest level passed with 1 - Phi(3) at an instant.
    peak_limits : mapping of str to float
        Largest peak of |mean| + 3 sigma of other responses, or of the level of other resultants, SI.
    damping_limits : mapping of str to float
        Least damping ratio at the frozen times by family of roots: 'rigid_body' (with control networks and sensors),
        'bending_1', ..., 'slosh'.
    frozen_times : sequence of float
        s.
    largest_growth : float
        Largest real part of any root at the frozen times, 1/s.

    Raises
    ------
    DesignProblemError, UnknownNameError, ParameterValueError, TimeRangeError, DirectNoiseError
    """

    study: Study
    parameters: Mapping[str, tuple[float, float]]
    times: tuple[float, ...]
    response: str = "bending_moment"
    peak_limits: Mapping[str, float] = field(default_factory=dict)
    damping_limits: Mapping[str, float] = field(default_factory=dict)
    frozen_times: tuple[float, ...] = ()
    largest_growth: float = 0.0

    def __post_init__(self):
        study = self.study
        study.require_linear_mean("a design")
        object.__setattr__(self, "times", tuple(sorted({float(t) for t in self.times})))
        object.__setattr__(self, "frozen_times", tuple(sorted({float(t) for t in self.frozen_times})))
        study.checked_times(list(self.times))
        if self.times[0] <= study.system.start:
            raise TimeRangeError(f"the first end time of a design must lie after the start, {study.system.start:g} s")
        if self.damping_limits and not self.frozen_times:
            raise DesignProblemError("damping limits need frozen times at which they hold; add frozen_times")
        if self.frozen_times:
            study.checked_times(list(self.frozen_times))
        if not self.parameters:
            raise DesignProblemError("a design needs at least one parameter that may change")
        for name in (self.response, *self.peak_limits):
            response_or_resultant(study, name)
        if self.response in self.peak_limits:
            raise DesignProblemError(f"the peak of '{self.response}' is minimised; a limit on it has no place")
        families = root_families(study.system)
        for family, least in self.damping_limits.items():
            if family not in families:
                raise UnknownNameError("family of roots", family, families)
            if not -1 < least < 1:
                raise DesignProblemError(f"a damping ratio of {least:g} for '{family}' is not between -1 and 1")
        for response, limit in self.peak_limits.items():
            if not (np.isfinite(limit) and limit > 0):
                raise DesignProblemError(
                    f"the limit on '{response}' is {limit:g}; a peak of |mean| + 3 sigma is positive"
                )
        present = study.parameters
        for name, (low, high) in self.parameters.items():
            if name not in present:
                raise UnknownNameError("parameter", name, present)
            if not (np.isfinite([low, high]).all() and low < high):
                raise ParameterValueError(f"bounds of '{name}' are {low:g} and {high:g}; give two numbers, low first")
            study.numbers({name: low})
            study.numbers({name: high})
            if not low <= present[name].value <= high:
                raise ParameterValueError(
                    f"'{name}' is {present[name].value:g}, outside its bounds {low:g} to {high:g}; widen them or start "
                    "from a study with another value"
                )

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.parameters)

    @property
    def start(self) -> NDArray[np.float64]:
        """Present values as parts of the span between the bounds, (n,)."""
        values = np.array([self.study.parameters[name].value for name in self.names])
        return (values - self.low) / self.span

    @property
    def low(self) -> NDArray[np.float64]:
        return np.array([low for low, _ in self.parameters.values()])

    @property
    def span(self) -> NDArray[np.float64]:
        """High less low bound, (n,)."""
        return np.array([high - low for low, high in self.parameters.values()])

    def study_at(self, position: NDArray[np.float64]) -> Study:
        """Return the study with the parameters at a position between their bounds, 0 to 1 each."""
        values = self.low + self.span * np.clip(position, 0.0, 1.0)
        return self.study.with_parameters(dict(zip(self.names, values.tolist(), strict=True)))


def family_words(family: str) -> str:
    """Return a family of roots as people say it."""
    return re.sub(r"^bending_(\d+)$", r"bending mode \1", family).replace("_", " ")
