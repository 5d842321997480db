"""What every block of the model offers: its states and their rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ..system.labels import State


@dataclass(frozen=True, eq=False)
class Block:
    """States with one meaning and unit.

    Attributes
    ----------
    states : tuple of State
    symbols, rates : (n,) SX
        The states themselves and their derivatives with respect to time.
    """

    states: tuple[State, ...]
    symbols: ca.SX
    rates: ca.SX

    @staticmethod
    def of(
        block: str, symbols: ca.SX, rates: ca.SX, unit: str = "1", scale: float = 1.0, names: Sequence[str] = ()
    ) -> Block:
        """Return a block; without ``names`` a single state is called as the block is."""
        names = names or [block] * symbols.numel()
        return Block(tuple(State(name, unit, scale, block) for name in names), symbols, rates)

    @staticmethod
    def numbered(block: str, symbols: ca.SX, rates: ca.SX, unit: str = "1", scale: float = 1.0) -> Block:
        """Return a block whose states are counted from 1."""
        return Block.of(block, symbols, rates, unit, scale, [f"{block}_{i + 1}" for i in range(symbols.numel())])

    def named(self, prefix: str) -> Block:
        """Return the block with ``prefix`` in front of the names of its states and its own."""
        states = tuple(replace(s, name=prefix + s.name, block=prefix + s.block) for s in self.states)
        return self if not prefix else Block(states, self.symbols, self.rates)
