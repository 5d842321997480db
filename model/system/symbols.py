"""The symbols that the equations are written in: parameters with their nominal values, tables by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

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


class SharedParameters(ParameterSymbols):
    """Parameters of one part of a system: those that another part has declared are shared with it.

    Parameters
    ----------
    parameters : ParameterSymbols
        Of the whole system.
    name : callable
        From a name in this part to the one in the system.
    """

    def __init__(self, parameters: ParameterSymbols, name: Callable[[str], str]):
        self._symbols, self.parameters, self._name = parameters._symbols, parameters.parameters, name

    def add(self, name: str, value: float, unit: str = "1", description: str = "") -> ca.SX:
        """Return the symbol of a parameter, a new one where the system has none of the name."""
        name = self._name(name)
        return self._symbols[name] if name in self._symbols else super().add(name, value, unit, description)


class TableSymbols:
    """Symbols of table values by name; ``tables['mass']``."""

    def __init__(self, names: tuple[str, ...]):
        self.vector = ca.SX.sym("v", len(names))
        self._index = {name: i for i, name in enumerate(names)}

    def scoped(self, scope: str) -> TableSymbols:
        """Return the tables as one part of a system sees them: its own, which begin with ``scope``, under plain names.

        All others keep their names.
        """
        found = TableSymbols(())
        own = {name.removeprefix(scope): i for name, i in self._index.items() if name.startswith(scope)}
        found.vector, found._index = self.vector, self._index | own
        return found

    def __getitem__(self, name: str) -> ca.SX:
        if name not in self._index:
            raise UnknownNameError("table", name, self._index)
        return self.vector[self._index[name]]

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def under(self, prefix: str) -> Mapping[str, ca.SX]:
        """Return the tables whose name starts with ``prefix``, without it."""
        return {n.removeprefix(prefix): self[n] for n in self._index if n.startswith(prefix)}
