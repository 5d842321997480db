"""The commands by name, each imported from its file when it is asked for."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from typing import Any

import typer
from typer.core import TyperGroup

from .frame import frame_group, framed

FILES = {  # command: its file in this folder, where a function or a group of that name stands
    "run": "run",
    "flight-load": "flight_load",
    "gust": "gust",
    "fly": "fly",
    "day-of-launch": "day_of_launch",
    "availability": "availability",
    "verify": "checks",
    "tolerance": "checks",
    "sensitivity": "sensitivity",
    "mean": "mean",
    "inspect": "views",
    "equations": "views",
    "export": "export",
    "study": "study",
    "report": "report",
    "design": "design",
    "vehicles": "vehicles",
    "new-vehicle": "vehicles",
    "import-structure": "vehicles",
    "build-vehicle": "vehicles",
    "wind": "wind",
    "reproduce": "reproduce",
    "regenerate": "upkeep",
    "doctor": "upkeep",
    "cache": "upkeep",
}


class Commands(Mapping[str, Any]):
    """Commands made by Typer from the functions of a file, which is imported for the first of them."""

    def __init__(self, files: Mapping[str, str]):
        self.files = files
        self.made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self.made:
            module = importlib.import_module(f"{__package__}.{self.files[name]}")
            found = getattr(module, name.replace("-", "_"))
            if not isinstance(found, typer.Typer):
                alone = typer.Typer(add_completion=False)
                alone.command(name)(framed(found, name))
                found = alone
            else:
                frame_group(found, name)
            self.made[name] = typer.main.get_command(found)
            self.made[name].name = name
        return self.made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)


class LazyGroup(TyperGroup):
    """The group of all commands."""

    def __init__(self, **settings: Any):
        super().__init__(**settings)
        self.commands: Any = Commands(FILES)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names, in the order of a help text."""
        return list(self.commands)
