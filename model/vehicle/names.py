"""Names of a vehicle's file that stand for two things, and lists that hold one thing twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeVar

from ..system.names import NOISE_NAMES, RESPONSE_NAMES, TANK_NAMES, taken_by
from .biases import vehicle_biases
from .loads import load_outputs
from .vehicle_file import TableEntry, VehicleFile

Item = TypeVar("Item")


def name_faults(file: VehicleFile) -> Iterator[tuple[str, str]]:
    """Yield key and what is wrong with it for every name that something else has, and for what is listed twice."""
    for name in file.noise:
        if who := taken_by(name, NOISE_NAMES):
            yield f"noise.{name}", f"is called as {who}; rename it"
    for bias in vehicle_biases(file).values():
        if bias.source in file.noise:
            yield f"noise.{bias.source}", f"is called as the source of biases.{bias.key}; rename it"
    for i, tank in enumerate(file.slosh):
        if who := taken_by(tank.name, TANK_NAMES):
            yield f"slosh.{i}.name", f"'{tank.name}' is taken by {who}; rename the tank"
    for i, load in enumerate(file.loads):
        if who := taken_by(load.output, RESPONSE_NAMES):
            yield f"loads.{i}.output", f"'{load.output}' is taken by {who}; rename it"
    if name := repeated([tank.name for tank in file.slosh]):
        yield "slosh", f"two slosh tanks have the same name '{name}'; rename one"
    names = [part.format(tank.name) for tank in file.slosh for part in ("slosh_{}", "slosh_rate_{}")]
    if (name := repeated(names)) and not repeated([tank.name for tank in file.slosh]):
        yield "slosh", f"two tanks make one state '{name}'; rename the one whose name begins with 'rate_'"
    if name := repeated(load_outputs(file)):
        yield "loads", f"two loads have the same output name '{name}'; rename one"
    for key, names in (
        *((f"noise.{name}.tables", noise.tables) for name, noise in file.noise.items()),
        ("options.extra_outputs", file.options.extra_outputs),
        *((f"{key}.events", table.events) for key, table in _tables(file)),
    ):
        if name := repeated(names):
            yield key, f"lists '{name}' twice; keep it once"
    if (time := repeated(file.weighting_times_s)) is not None:
        yield "weighting_times_s", f"lists {time:g} twice; keep it once"


def repeated(items: Sequence[Item]) -> Item | None:
    """Return the first of the items that stands there before, None without one."""
    return next((item for i, item in enumerate(items) if item in items[:i]), None)


def _tables(file: VehicleFile) -> Iterator[tuple[str, TableEntry]]:
    for name in type(file.tables).model_fields:
        if table := getattr(file.tables, name):
            yield f"tables.{name}", table
    yield "control.gains", file.control.gains
    for kind in ("bending", "slosh", "loads"):
        for i, part in enumerate(getattr(file, kind)):
            yield f"{kind}.{i}.table", part.table
    for i, load in enumerate(file.loads):
        for name in ("local", "shear", "axial"):
            if table := getattr(load, name):
                yield f"loads.{i}.{name}", table
