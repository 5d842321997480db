"""A load-relief design from a TOML file: vehicle, parameters with bounds, limits, times and trades."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from ...model.errors import DataError, UnknownNameError
from ...model.files.folder_files import FileName, file_inside
from ...model.files.toml_file import Section, read_toml
from ...model.vehicle.shipped import find_vehicle
from ..case.times import parse_times
from ..study import Study
from .problem import LoadReliefProblem

DESIGN_FILE = "design.toml"


class LimitsEntry(Section):
    """``peaks`` by response, SI; ``damping`` by family of roots; ``largest_growth`` of any root, 1/s."""

    peaks: dict[str, float] = Field(default_factory=dict)
    damping: dict[str, float] = Field(default_factory=dict)
    largest_growth: float = 0.0


class TradeEntry(Section):
    """Limits on the peak of a response to go through, for several choices of parameters."""

    response: str
    limits: tuple[float, ...]
    variants: dict[str, tuple[str, ...]] = Field(default_factory=dict)


class DesignEntry(Section):
    """The whole file; without ``vehicle`` the folder it stands in."""

    format: Literal[1]
    vehicle: FileName | None = None
    response: str = "bending_moment"
    times: str
    frozen_times: str | None = None
    parameters: dict[str, tuple[float, float]]
    limits: LimitsEntry = LimitsEntry()
    trade: TradeEntry | None = None


@dataclass(frozen=True, eq=False)
class DesignTask:
    """A problem and the trades that go with it.

    Attributes
    ----------
    title : str
    problem : LoadReliefProblem
    trade : TradeEntry or None
    variants : dict of str to LoadReliefProblem
        Of the trade.
    """

    title: str
    problem: LoadReliefProblem
    trade: TradeEntry | None
    variants: dict[str, LoadReliefProblem]


def find_design(where: str) -> Path:
    """Return a design file: the file itself, or ``design.toml`` of a shipped vehicle or vehicle folder.

    Raises
    ------
    UnknownNameError, DataError
    """
    path = Path(where)
    if path.suffix == ".toml":
        return path
    file = file_inside(find_vehicle(where), DESIGN_FILE)
    if not file.is_file():
        raise DataError(f"holds no {DESIGN_FILE}; write one (docs/design.md)", file=file.parent)
    return file


def load_design(file: Path, changes: Mapping[str, Any] | None = None) -> DesignTask:
    """Read a design file and load its vehicle.

    Parameters
    ----------
    file : Path
    changes : mapping, optional
        Values in the place of those in vehicle.toml, by dotted key.

    Raises
    ------
    DataError
        The file and key at fault.
    DesignProblemError, UnknownNameError, ParameterValueError, TimeRangeError
    """
    entry = read_toml(file, DesignEntry)
    vehicle = file.parent if entry.vehicle is None else file.parent / entry.vehicle
    study = Study.load(vehicle if vehicle.is_dir() else str(entry.vehicle), changes=changes)
    problem = _problem(study, entry, entry.parameters)
    variants = {}
    if entry.trade is not None:
        for limit in entry.trade.limits:  # a limit that makes no sense is told before anything is computed
            replace(problem, peak_limits={**problem.peak_limits, entry.trade.response: limit})
        for name, parameters in (entry.trade.variants or {"all parameters": tuple(entry.parameters)}).items():
            for parameter in parameters:
                if parameter not in entry.parameters:
                    raise UnknownNameError(f"parameter of trade variant '{name}'", parameter, entry.parameters)
            variants[name] = _problem(study, entry, {p: entry.parameters[p] for p in parameters})
    return DesignTask(study.vehicle_for("a design").title, problem, entry.trade, variants)


def _problem(study: Study, entry: DesignEntry, parameters: dict[str, tuple[float, float]]) -> LoadReliefProblem:
    return LoadReliefProblem(
        study,
        parameters,
        tuple(parse_times(entry.times)),
        response=entry.response,
        peak_limits=entry.limits.peaks,
        damping_limits=entry.limits.damping,
        frozen_times=() if entry.frozen_times is None else tuple(parse_times(entry.frozen_times)),
        largest_growth=entry.limits.largest_growth,
    )
