"""A linear system on disk: a TOML file that names its matrices over time and what their rows and columns are."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from ..errors import DataError, SystemDefinitionError, UnknownNameError
from ..files.toml_file import Section, read_toml
from .array_files import ArrayFile, read_arrays
from .arrays import PREFIXES, SHAPES
from .linear_system import LinearSystem


class SystemFile(Section):
    """A system's TOML file; what it says goes before what the data say of names, units, scales, sources and jumps."""

    name: str = Field(min_length=1)
    data: str = Field(min_length=1)
    interpolation: Literal["linear", "cubic", "pchip", "step"] = "linear"
    default_times: str = ""
    discontinuities: tuple[float, ...] | None = None
    variables: dict[Literal["time", "u", "A", "B", "C", "D", "E", "G"], str] = Field(default_factory=dict)
    names: dict[Literal["states", "noises", "outputs", "inputs"], tuple[str, ...]] = Field(default_factory=dict)
    sources: dict[str, str] = Field(default_factory=dict)
    units: dict[str, str] = Field(default_factory=dict)
    scales: dict[str, float] = Field(default_factory=dict)


def read_system(file: str | Path) -> LinearSystem:
    """Read a linear system from disk.

    Parameters
    ----------
    file : str or path
        A TOML file: ``name``, ``data`` (a .nc or .mat file, or a folder of CSV tables, beside it), ``interpolation``,
        ``discontinuities``, ``default_times`` and, where the data do not say them, ``[variables]``, ``[names]``,
        ``[sources]``, ``[units]`` and ``[scales]``.

    Returns
    -------
    LinearSystem

    Raises
    ------
    DataError
        With the file, and the key, variable, array, row or column at fault.
    """
    return system_of(read_toml(Path(file), SystemFile), Path(file))


def system_of(said: SystemFile, file: Path) -> LinearSystem:
    """Return the system that a TOML file says; as :func:`read_system`."""
    path = file.parent / said.data
    given: dict[str, list[str]] = {str(kind): list(names) for kind, names in said.names.items()}
    data = read_arrays(path, {str(name): variable for name, variable in said.variables.items()})
    names = {kind: given.get(kind, list(data.names.get(kind, ()))) for kind in PREFIXES}
    try:
        return LinearSystem.from_arrays(
            data.times,
            **{name: data.matrices.get(name) for name in SHAPES},  # pyright: ignore[reportArgumentType]
            u=data.u,
            name=said.name,
            names={kind: labels for kind, labels in names.items() if labels},
            sources=_kept(data, said, "sources", {}) | said.sources,
            units=_kept(data, said, "units", {}) | said.units,
            scales=_kept(data, said, "scales", {}) | said.scales,
            start_covariance=data.start_covariance,
            discontinuities=data.jumps if said.discontinuities is None else said.discontinuities,
            interpolation=said.interpolation,
        )
    except (SystemDefinitionError, UnknownNameError) as error:
        raise DataError(f"{error}", file=path) from None


def _kept(data: ArrayFile, said: SystemFile, what: str, none: dict) -> dict:
    """Return what the data say by name; nothing where the TOML file gives other names."""
    return none if said.names else dict(getattr(data, what))
