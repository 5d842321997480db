"""What the entries of a system's states, noises, outputs and parameters are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..errors import UnknownNameError


@dataclass(frozen=True)
class State:
    """A state: its name, unit, and a typical size that the integrators use to weigh errors.

    ``block`` is what it belongs to, such as the modes' displacements or the wind filter; its own name by default.
    """

    name: str
    unit: str = "1"
    scale: float = 1.0
    block: str = field(default="", repr=False)  # no part of what generated code is known by

    def __post_init__(self):
        if not self.block:
            object.__setattr__(self, "block", self.name)


@dataclass(frozen=True)
class Noise:
    """A white-noise input of unit intensity and the source (wind, thrust, ...) that it belongs to."""

    name: str
    source: str


@dataclass(frozen=True)
class Output:
    """A response: its name, unit, typical size and, where it has one, the report's symbol."""

    name: str
    unit: str = "1"
    scale: float = 1.0
    symbol: str = ""


@dataclass(frozen=True)
class Parameter:
    """A number that can be changed without new code."""

    name: str
    value: float
    unit: str = "1"
    description: str = ""


def block_of(states: Sequence[State], name: str) -> slice:
    """Return where the states of a block stand, one after the other.

    Raises
    ------
    UnknownNameError
    """
    rows = [i for i, state in enumerate(states) if state.block == name]
    if not rows:
        raise UnknownNameError("block of states", name, dict.fromkeys(state.block for state in states))
    return slice(rows[0], rows[-1] + 1)
