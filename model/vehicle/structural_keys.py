"""Which keys of a vehicle's file are structure: another value makes other equations, not other numbers in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..files.toml_file import Section
from .vehicle_file import STRUCTURE, VehicleFile


def structural_keys(file: VehicleFile) -> frozenset[str]:
    """Return the dotted keys that are structure, items counted from 0; how many a list has is ``LIST.count``."""
    return frozenset(_keys(file, ""))


def _keys(section: Section, prefix: str) -> Iterator[str]:
    for name, field in type(section).model_fields.items():
        key, value = prefix + name, getattr(section, name)
        if STRUCTURE in field.metadata:
            yield from _marked(key, value)
        items = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, tuple) else ()
        for item, entry in ((key, value), *((f"{key}.{item}", entry) for item, entry in items)):
            if isinstance(entry, Section):
                yield from _keys(entry, f"{item}.")


def _marked(key: str, value: Any) -> Iterator[str]:
    """Yield a key that is structure, with the number of its entries or the numbers and choices in it."""
    yield key
    if isinstance(value, tuple | Mapping):
        yield f"{key}.count"
    if isinstance(value, Mapping):
        yield from (f"{key}.{item}" for item in value)
    if isinstance(value, Section):
        yield from (f"{key}.{item}" for item in type(value).model_fields)
