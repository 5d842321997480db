"""The mapping file: what a NASTRAN deck counts in, which of its grids are the centreline, and where that lies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator

from ....model.construction.construction_entries import Status
from ....model.files.toml_file import NotNegative, Positive, Section, Whole, read_toml

METRES = {"m": 1.0, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
KILOGRAMS = {
    "kg": 1.0,
    "g": 1e-3,
    "t": 1e3,
    "lb": 0.45359237,
    "slug": 14.59390293720636,  # lbf s2/ft
    "lbf s2/in": 175.12683524647636,
}
RANGE = re.compile(r"(\d+):(\d+)", re.ASCII)
Direction = Literal["x", "-x", "y", "-y", "z", "-z"]


class ResultEntry(Section):
    """Modes at a time of the flight."""

    time_s: float
    file: Annotated[str, Field(min_length=1)]
    modes: Annotated[tuple[Annotated[Whole, Field(ge=1)], ...], Field(min_length=1)]
    deck: str | None = None


class MappingFile(Section):
    """The whole mapping file; paths count from its folder."""

    format: Literal[1]
    deck: Annotated[str, Field(min_length=1)]
    length: Literal["m", "cm", "mm", "in", "ft"]
    mass: Literal["kg", "g", "t", "lb", "slug", "lbf s2/in"]
    forward: Direction
    lateral: Direction
    grids: Annotated[tuple[Whole | str, ...], Field(min_length=1)]
    aft_end_m: float
    forward_end_m: float
    mass_kg: Positive
    off_centreline_m: NotNegative = 1e-3
    status: Status = "computed"
    source: Annotated[str, Field(min_length=1)]
    results: tuple[ResultEntry, ...] = ()

    @field_validator("grids")
    @classmethod
    def _ranges(cls, grids: tuple[int | str, ...]) -> tuple[int | str, ...]:
        for grid in grids:
            found = RANGE.fullmatch(grid) if isinstance(grid, str) else None
            if isinstance(grid, str) and (found is None or int(found[1]) > int(found[2])):
                raise ValueError(f"'{grid[:40]}' is no range of grids; write numbers, or 'first:last'")
        return grids

    @field_validator("lateral")
    @classmethod
    def _across(cls, lateral: str, info) -> str:
        if lateral[-1] == str(info.data.get("forward", ""))[-1:]:
            raise ValueError("lies along forward; name an axis across it")
        return lateral

    @property
    def metre(self) -> float:
        """Metres in the deck's unit of length."""
        return METRES[self.length]

    @property
    def kilogram(self) -> float:
        """Kilograms in the deck's unit of mass."""
        return KILOGRAMS[self.mass]

    def holds(self, grid: int) -> bool:
        """Tell whether a grid is one of the centreline."""
        for given in self.grids:
            if isinstance(given, int):
                if given == grid:
                    return True
                continue
            first, last = map(int, given.split(":"))
            if first <= grid <= last:
                return True
        return False


def read_mapping(file: Path) -> MappingFile:
    """Read a mapping file.

    Raises
    ------
    DataError
    """
    return read_toml(file, MappingFile)
