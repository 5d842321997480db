"""What the entries of a system's states, noises, outputs and parameters are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class State:
    """A state: its name, unit, and a typical size that the integrators use to weigh errors."""

    name: str
    unit: str = "1"
    scale: float = 1.0


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
