"""What may be asked of a flight's load, and the errors where it may not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Literal, get_args

from ...model.errors import AscentwindError, AscentwindWarning, ParameterValueError, UnknownNameError

if TYPE_CHECKING:
    from .process import Process

Sides = Literal["both", "upper", "lower"]


class NoVarianceError(AscentwindError):
    """A load that no noise reaches has no odds: its maximum is the same on every flight."""


class SpacingWarning(AscentwindWarning):
    """The grid of times is too coarse for the probability of a response's maximum."""


class CertainPassageWarning(AscentwindWarning):
    """A limit lies below the mean, so that nearly every flight passes it."""


class UncheckedStationsWarning(AscentwindWarning):
    """A limit over stations ends before the vehicle does, and what lies beyond it is not looked at."""


def checked_probabilities(probabilities: float | Iterable[float]) -> tuple[float, ...]:
    """Return probabilities as they are given.

    Raises
    ------
    ParameterValueError
        None is given, or one is not between 0 and 1.
    """
    given = [probabilities] if isinstance(probabilities, int | float) else probabilities
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ParameterValueError(f"{given!r} is no list of probabilities; give numbers, such as [0.00135]")
    found = []
    for p in given:
        try:
            value = float(p)
        except (TypeError, ValueError):
            raise ParameterValueError(f"{p!r} is not a probability; give a number between 0 and 1") from None
        if not 0.0 < value < 1.0:
            raise ParameterValueError(
                f"a probability of {value:g} has no level; give one between 0 and 1, such as 0.00135"
            )
        found.append(value)
    if not found:
        raise ParameterValueError("no probability was given; 0.00135 is that of mean + 3 sigma at an instant")
    return tuple(dict.fromkeys(found))


def checked_sides(sides: str) -> Sides:
    """Return the sides asked for.

    Raises
    ------
    UnknownNameError
    """
    known: tuple[Sides, ...] = get_args(Sides)
    if sides not in known:
        raise UnknownNameError("choice of sides", str(sides), known)
    return known[known.index(sides)]


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
