"""The grid of steps that many members like a case share, chosen once and kept with its libraries."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from ...codegen.sweep.compiled import sweep_of
from ..solvers.fixed_grid import StepRule
from ..solvers.sweep import rule_for
from .case import Case


def shared_rule(case: Case, times: Sequence[float], relative_tolerance: float) -> StepRule | None:
    """Return the rule of the grid for numbers like those of a compiled case; the same whoever asks, and when.

    Parameters
    ----------
    case : Case
    times : sequence of float
        End times, increasing, s.
    relative_tolerance : float
        Of every standard deviation.

    Returns
    -------
    StepRule or None
        None where controlled steps serve them better.
    """
    numbers = case.executable
    compiled = sweep_of(numbers)
    asked = compiled.shared_library.key, tuple(times), relative_tolerance, type(case.mean)
    digest = hashlib.sha256(repr(asked).encode())
    for array in (numbers.parameters, numbers.tables):
        digest.update(np.ascontiguousarray(array).tobytes())

    def choose() -> StepRule | None:
        return rule_for(compiled, numbers, times, relative_tolerance=relative_tolerance, fill=case.mean.fill)

    return numbers.libraries.held(f"steps of {digest.hexdigest()}", choose)
