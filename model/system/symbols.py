"""The symbols that the equations are written in: parameters with their nominal values, tables by name."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from ..errors import UnknownNameError
from .labels import Parameter


class ParameterSymbols:
    """Creates one symbol for each parameter and remembers its value, unit and meaning."""

    def __init__(self):
        self._symbols: dict[str, ca.SX] = {}
        self.parameters: list[Parameter] = []

    def add(self, name: str, value: float, unit: str = "1", description: str = "") -> ca.SX:
        """Return a new symbol for a parameter."""
        self._symbols[name] = ca.SX.sym(name)
        self.parameters.append(Parameter(name, float(value), unit, description))
        return self._symbols[name]

    @property
    def vector(self) -> ca.SX:
        return ca.vertcat(ca.SX(0, 1), *self._symbols.values())


class TableSymbols:
    """Symbols of table values by name; ``tables['mass']``."""

    def __init__(self, names: tuple[str, ...]):
        self.vector = ca.SX.sym("v", len(names))
        self._index = {name: i for i, name in enumerate(names)}

    def __getitem__(self, name: str) -> ca.SX:
        if name not in self._index:
            raise UnknownNameError("table", name, self._index)
        return self.vector[self._index[name]]

    def under(self, prefix: str) -> Mapping[str, ca.SX]:
        """Return the tables whose name starts with ``prefix``, without it."""
        return {n.removeprefix(prefix): self[n] for n in self._index if n.startswith(prefix)}
