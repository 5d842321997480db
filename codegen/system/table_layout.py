"""Where the tables of a system stand in the numbers that generated C reads, as ``run_time_vector`` lays them out."""

from __future__ import annotations

from dataclasses import dataclass

from ...model.system.linear_system import LinearSystem


@dataclass(frozen=True)
class GroupLayout:
    """Of one group of tables.

    Attributes
    ----------
    name, argument : str
        The argument is 'time' or the name of a table in an earlier group.
    argument_c : str
        The same in C.
    names, units : tuples of str
    knots : int
    first : int
        Place of its first table among all.
    offset : int
        Place of its first number, a knot.
    """

    name: str
    argument: str
    argument_c: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    knots: int
    first: int
    offset: int


def table_layout(system: LinearSystem, value: str = "v[{}]") -> list[GroupLayout]:
    """Return the layout of a system's tables; ``value`` is how C writes the value of a table by its place."""
    found: list[GroupLayout] = []
    position = {name: i for i, name in enumerate(name for g in system.tables for name in g.names)}
    first = offset = 0
    for group in system.tables:
        argument = "t" if group.argument == "time" else value.format(position[group.argument])
        shape = (group.names, group.units, group.knots.size, first, offset)
        found.append(GroupLayout(group.name, group.argument, argument, *shape))
        first += len(group.names)
        offset += group.size
    return found
