"""What may be asked of a flight's load, and the errors where it may not."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...model.errors import AscentwindError, AscentwindWarning, ParameterValueError

if TYPE_CHECKING:
    from .norms import Process

DESIGN = 0.00135  # 1 - Phi(3): with this chance an instant passes mean + 3 sigma
DRAWS = 2000


class NoVarianceError(AscentwindError):
    """A load that no noise reaches has no odds: its maximum is the same on every flight."""


class SpacingWarning(AscentwindWarning):
    """The grid of times is too coarse for the probability of a response's maximum."""


class CertainPassageWarning(AscentwindWarning):
    """A limit lies below the mean, so that nearly every flight passes it."""


class UncheckedStationsWarning(AscentwindWarning):
    """A limit over stations ends before the vehicle does, and what lies beyond it is not looked at."""


def checked_level(value: float) -> float:
    """Return a level as a number.

    Raises
    ------
    ParameterValueError
    """
    try:
        level = float("nan") if isinstance(value, str | bool) else float(value)
    except (TypeError, ValueError):
        level = float("nan")
    if not math.isfinite(level):
        raise ParameterValueError(f"the chance of passing {value!r:.60} cannot be computed; give a finite level")
    return level


def checked_draws(draws: int, seed: int) -> None:
    """Raise if a number of draws or a seed cannot be used.

    Raises
    ------
    ParameterValueError
    """
    for name, value, least in (("draws", draws, 100), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ParameterValueError(f"{name} = {value!r} cannot be used; give a whole number of {least} or more")


def refuse_without_variance(response: str, process: Process) -> None:
    """Raise where a response does not vary.

    Raises
    ------
    NoVarianceError
    """
    if not float(process.std.max()) > 0:
        raise NoVarianceError(
            f"no noise reaches '{response}' within the window: its maximum is that of the mean, on every flight"
        )
